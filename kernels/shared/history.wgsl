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

// Half floats that are neither 0, nor denormal, nor infinite, nor NaN have so many bit patterns of either sign. They
// survive every load and store. There are 32 lengths, 128 hit shares and 15 levels of noise: just as many together.
const HALF_CODES: u32 = 30720u;
// The word of the smallest of them as a float, without the bits that a half float has not.
const FIRST_HALF_CODE: u32 = 113u << 10u;

// Radiance as half floats, and all else in the bits of a fourth one.
fn pack_history(history: History) -> vec4<f32> {
    let length = u32(round(clamp(history.length, 0.0, 31.0)));
    let share = u32(round(saturate(history.share) * 127.0));
    // Powers of two from 2^-15 to 2^-2; 0 for what is not known.
    let level = u32(clamp(round(log2(max(history.noise, 1e-6)) + 16.0), 1.0, 14.0));
    let noise = select(level, 0u, history.noise < 0.0);
    let code = length | (share << 5u) | (noise << 12u);
    let is_negative = code >= HALF_CODES;
    let magnitude = (select(code, code - HALF_CODES, is_negative) + FIRST_HALF_CODE) << 13u;
    let other = bitcast<f32>(select(magnitude, magnitude | 0x80000000u, is_negative));
    let radiance = min(history.radiance, vec3<f32>(HALF_MAX));
    return vec4<f32>(rounded_to_half(vec4<f32>(radiance, 0.0)).rgb, other);
}

fn unpack_history(texel: vec4<f32>) -> History {
    let word = bitcast<u32>(texel.a);
    let magnitude = max((word & 0x7fffffffu) >> 13u, FIRST_HALF_CODE) - FIRST_HALF_CODE;
    let code = select(magnitude, magnitude + HALF_CODES, (word >> 31u) != 0u);
    let level = code >> 12u;
    var history: History;
    history.radiance = texel.rgb;
    history.length = f32(code & 31u);
    history.share = f32((code >> 5u) & 127u) * (1.0 / 127.0);
    history.noise = select(exp2(f32(level) - 16.0), -1.0, level == 0u);
    return history;
}

// What is kept of last frame's G-buffer: 16 bits of depth, 12 of normal, 4 of roughness. 0 where nothing is denoised.
// The normal is octahedral, 0 to 1.
fn prev_guide_word(depth: f32, normal: vec2<f32>, roughness: f32, denoised: bool) -> u32 {
    // From 2^-31 to 2^31 units, 10 bits of mantissa, rounded.
    let depth_word = ((bitcast<u32>(clamp(depth, 4.7e-10, 2.1e9)) + 0x1000u) >> 13u) - (95u << 10u);
    let oct = vec2<u32>(round(normal * 63.0));
    let word = depth_word | (oct.x << 16u) | (oct.y << 22u) | (u32(round(roughness * 15.0)) << 28u);
    return select(0u, word, denoised);
}

fn pack_prev_guide(guide: Guide) -> u32 {
    return prev_guide_word(guide.depth, oct_encode(guide.normal) * 0.5 + 0.5, saturate(guide.roughness), guide.denoised);
}

// The same of a packed guide, without decoding it.
fn repack_prev_guide(packed: vec2<u32>) -> u32 {
    let depth = bitcast<f32>(packed.x);
    let oct = vec2<f32>(vec2<u32>(packed.y, packed.y >> 11u) & vec2<u32>(2047u)) * (1.0 / 2047.0);
    return prev_guide_word(abs(depth), oct, f32(packed.y >> 22u) * (1.0 / 1023.0), depth > 0.0);
}

fn unpack_prev_guide(word: u32) -> Guide {
    let oct = vec2<f32>(vec2<u32>(word >> 16u, word >> 22u) & vec2<u32>(63u)) * (2.0 / 63.0) - 1.0;
    var guide: Guide;
    guide.normal = oct_decode(oct);
    guide.depth = bitcast<f32>(((word & 0xffffu) + (95u << 10u)) << 13u);
    guide.roughness = f32(word >> 28u) * (1.0 / 15.0);
    guide.denoised = word != 0u;
    return guide;
}

// Where last frame showed a position relative to this frame's camera; -1 where that lay behind its camera.
fn prev_uv_of(position: vec3<f32>) -> vec2<f32> {
    let projected = frame.prev_uv_from_world * vec4<f32>(position, 1.0);
    let uv = projected.xy / projected.w - frame.jitter_uv;
    let usable = projected.w > 0.0 && is_finite(uv.x) && is_finite(uv.y);
    return select(vec2<f32>(-1.0), clamp(uv, vec2<f32>(-4.0), vec2<f32>(4.0)), usable);
}
