// Accumulated radiance, kept from frame to frame.

import package::shared::frame;
import package::shared::packing;

struct History {
    radiance: vec3<f32>,
    // Frames, up to 31; 0 where there is no reflection.
    length: f32,
    // Hit share.
    share: f32,
    // Variance of the brightness of `radiance`; negative where it is not known.
    noise: f32,
}

// Radiance in three half floats; 5 bits of length, 7 of hit share, 4 of the logarithm of noise.
fn pack_history(history: History) -> vec2<u32> {
    let words = pack_radiance(history.radiance, 0.0);
    let length = u32(round(clamp(history.length, 0.0, 31.0)));
    let share = u32(round(saturate(history.share) * 127.0));
    // Powers of two from 2^-15 to 2^-1; 0 for what is not known.
    let level = u32(clamp(round(log2(max(history.noise, 1e-6)) + 16.0), 1.0, 15.0));
    let noise = select(level, 0u, history.noise < 0.0);
    return vec2<u32>(words.x, (words.y & 0xffffu) | (length << 16u) | (share << 21u) | (noise << 28u));
}

fn unpack_history(packed: vec2<u32>) -> History {
    let level = packed.y >> 28u;
    var history: History;
    history.radiance = vec3<f32>(unpack2x16float(packed.x), unpack2x16float(packed.y & 0xffffu).x);
    history.length = f32((packed.y >> 16u) & 31u);
    history.share = f32((packed.y >> 21u) & 127u) * (1.0 / 127.0);
    history.noise = select(exp2(f32(level) - 16.0), -1.0, level == 0u);
    return history;
}

// Position relative to this frame's camera of what a texel of last frame showed.
fn prev_world_position(texel: vec2<i32>, depth: f32) -> vec3<f32> {
    let w = frame.prev_clip_w.x + frame.prev_clip_w.y * depth;
    return (frame.world_from_prev_pixel * vec4<f32>((vec2<f32>(texel) + 0.5) * w, depth, 1.0)).xyz;
}

// Where last frame showed a position relative to this frame's camera; -1 where that lay behind its camera.
fn prev_uv_of(position: vec3<f32>) -> vec2<f32> {
    let projected = frame.prev_uv_from_world * vec4<f32>(position, 1.0);
    let uv = projected.xy / projected.w - frame.jitter_uv;
    let usable = projected.w > 0.0 && is_finite(uv.x) && is_finite(uv.y);
    return select(vec2<f32>(-1.0), clamp(uv, vec2<f32>(-4.0), vec2<f32>(4.0)), usable);
}
