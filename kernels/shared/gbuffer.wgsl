// The G-buffer of this frame and of the last, as the caller has them, and what this frame's says about a pixel: packed
// by `classify`, or decoded anew by every pass that asks.

import package::shared::frame;
import package::shared::packing;

// 0: xyz in -1..1, 1: xyz in 0..1, 2: octahedral in -1..1, 3: octahedral in 0..1.
override NORMAL_ENCODING: u32 = 0u;
// Channel of the roughness texture.
override ROUGHNESS_CHANNEL: u32 = 0u;
// The roughness texture holds GGX alpha, not perceptual roughness.
override ROUGHNESS_IS_ALPHA: bool = false;
// All surfaces have the roughness in the constants; there is no texture of it.
override ROUGHNESS_IS_CONSTANT: bool = false;
// `classify` keeps what it decodes in a texture.
override GUIDE_IS_PACKED: bool = true;
// limpid keeps last frame's G-buffer; else the caller supplies it.
override GBUFFER_IS_COPIED: bool = true;
// There is a texture of normals; else they are the slope of depth.
override NORMAL_IS_INPUT: bool = true;

@group(0) @binding(2) var in_normal: texture_2d<f32>;
@group(0) @binding(3) var in_roughness: texture_2d<f32>;
@group(0) @binding(4) var in_depth: texture_2d<f32>;
@group(0) @binding(8) var in_prev_normal: texture_2d<f32>;
@group(0) @binding(9) var in_prev_roughness: texture_2d<f32>;
@group(0) @binding(10) var in_prev_depth: texture_2d<f32>;

@group(1) @binding(12) var in_guide: texture_2d<u32>;

fn decode_normal(texel: vec4<f32>) -> vec3<f32> {
    if NORMAL_ENCODING == 0u {
        return texel.xyz;
    }
    if NORMAL_ENCODING == 1u {
        return texel.xyz * 2.0 - 1.0;
    }
    if NORMAL_ENCODING == 2u {
        return oct_decode(texel.xy);
    }
    return oct_decode(texel.xy * 2.0 - 1.0);
}

// How the depths that the caller supplies become linear.
struct DepthEncoding {
    from_device: vec4<f32>,
    sky: vec2<f32>,
}

// All conditions at once: each `&&` doubles SwiftShader's time and memory to compile (kernels/README.md).
fn linear_depth(device: f32, encoding: DepthEncoding) -> f32 {
    let c = encoding.from_device;
    let depth = abs((c.x + c.y * device) / (c.z + c.w * device));
    let is_within = vec4<f32>(encoding.sky.x, device, 0.0, depth) < vec4<f32>(device, encoding.sky.y, depth, SKY_DEPTH);
    let is_surface = all(vec3<bool>(is_finite(device), is_finite(depth), all(is_within)));
    return select(SKY_DEPTH, depth, is_surface);
}

// Normals that are no direction and roughness that is no number make their pixel one without a surface.
fn guide_of(normal: vec3<f32>, stored_roughness: f32, depth: f32) -> Guide {
    let squared_length = dot(normal, normal);
    let usable = is_finite(squared_length) && squared_length > 1e-12 && is_finite(stored_roughness);
    var guide: Guide;
    guide.normal = select(vec3<f32>(0.0, 0.0, 1.0), normal * inverseSqrt(max(squared_length, 1e-12)), usable);
    guide.roughness = select(1.0, saturate(stored_roughness), is_finite(stored_roughness));
    if ROUGHNESS_IS_ALPHA {
        guide.roughness = sqrt(guide.roughness);
    }
    guide.roughness = quantized_roughness(guide.roughness);
    guide.depth = select(SKY_DEPTH, depth, usable);
    guide.denoised = guide.depth < SKY_DEPTH && guide.roughness <= frame.roughness_threshold;
    return guide;
}

fn depth_encoding() -> DepthEncoding {
    return DepthEncoding(frame.depth_from_device, frame.sky_depth);
}

fn decode_depth(pixel: vec2<u32>, encoding: DepthEncoding) -> f32 {
    return linear_depth(textureLoad(in_depth, pixel, 0).x, encoding);
}

// x: by how much 1/depth differs from a pixel's own (with parallel rays: depth, and the other way round), as a share of it:
// over a plane that is linear. y: 1 where it is known; else both are 0.
fn depth_change(texel: vec2<i32>, own: f32, encoding: DepthEncoding) -> vec2<f32> {
    let on_screen = clamp(texel, vec2<i32>(0), vec2<i32>(frame.size) - 1);
    let depth = decode_depth(vec2<u32>(on_screen), encoding);
    let change = select(own / depth - 1.0, 1.0 - depth / own, frame.clip_w.y == 0.0);
    let is_known = all(vec3<bool>(texel == on_screen, depth < SKY_DEPTH));
    return select(vec2<f32>(0.0), vec2<f32>(clamp(change, -1e6, 1e6), 1.0), is_known);
}

// x: that change from pixel to pixel on one side of a pixel; y: its weight, by how straight the next two pixels go on.
fn slope_towards(pixel: vec2<i32>, step: vec2<i32>, own: f32, encoding: DepthEncoding) -> vec2<f32> {
    let near = depth_change(pixel + step, own, encoding);
    let far = depth_change(pixel + 2 * step, own, encoding);
    let bend = select(1.0, far.x - 2.0 * near.x, far.y * near.y > 0.0);
    return vec2<f32>(near.x, 1.0 / (bend * bend + 1e-10));
}

// Both sides of it: of a smooth surface the mean, at an edge the side that goes on.
fn slope_along(pixel: vec2<i32>, step: vec2<i32>, own: f32, encoding: DepthEncoding) -> f32 {
    let ahead = slope_towards(pixel, step, own, encoding);
    let behind = slope_towards(pixel, -step, own, encoding);
    return (ahead.x * ahead.y - behind.x * behind.y) / (ahead.y + behind.y);
}

// The normal of the surface through the depths around a pixel; straight at the camera where they say nothing.
fn derived_normal(pixel: vec2<u32>, depth: f32, encoding: DepthEncoding) -> vec3<f32> {
    let toward = -view_direction(world_position(pixel, depth));
    // What a step of a pixel adds to the position, over depth: at the same depth, and by the change of depth.
    let w = frame.clip_w.x / depth + frame.clip_w.y;
    let away = (frame.world_from_pixel * vec4<f32>((vec2<f32>(pixel) + 0.5) * frame.clip_w.y, 1.0, 0.0)).xyz;
    let at = vec2<i32>(pixel);
    let beside = (frame.world_from_pixel * vec4<f32>(w, 0.0, 0.0, 0.0)).xyz;
    let below = (frame.world_from_pixel * vec4<f32>(0.0, w, 0.0, 0.0)).xyz;
    let right = beside - away * slope_along(at, vec2<i32>(1, 0), depth, encoding);
    let down = below - away * slope_along(at, vec2<i32>(0, 1), depth, encoding);
    let normal = cross(normalize(right), normalize(down));
    let facing = select(-normal, normal, dot(normal, toward) > 0.0);
    let squared_length = dot(normal, normal);
    return select(toward, facing, is_finite(squared_length) && squared_length > 1e-11);
}

// This frame's, from the caller's images.
fn decode_guide(pixel: vec2<u32>, encoding: DepthEncoding) -> Guide {
    var roughness = frame.constant_roughness;
    if !ROUGHNESS_IS_CONSTANT {
        roughness = textureLoad(in_roughness, pixel, 0)[ROUGHNESS_CHANNEL];
    }
    let depth = decode_depth(pixel, encoding);
    if NORMAL_IS_INPUT {
        return guide_of(decode_normal(textureLoad(in_normal, pixel, 0)), roughness, depth);
    }
    return guide_of(derived_normal(pixel, depth, encoding), roughness, depth);
}

// Last frame's, from the caller's images.
fn decode_prev_guide(texel: vec2<i32>) -> Guide {
    var roughness = frame.constant_roughness;
    if !ROUGHNESS_IS_CONSTANT {
        roughness = textureLoad(in_prev_roughness, texel, 0)[ROUGHNESS_CHANNEL];
    }
    let encoding = DepthEncoding(frame.prev_depth_from_device, frame.sky_depth);
    let depth = linear_depth(textureLoad(in_prev_depth, texel, 0).x, encoding);
    return guide_of(decode_normal(textureLoad(in_prev_normal, texel, 0)), roughness, depth);
}

// This frame's, from wherever it is.
fn load_guide(pixel: vec2<u32>) -> Guide {
    if GUIDE_IS_PACKED {
        return unpack_guide(textureLoad(in_guide, pixel, 0).xy);
    }
    return decode_guide(pixel, depth_encoding());
}

// Whether this frame's pixel is denoised.
fn is_denoised(pixel: vec2<u32>) -> bool {
    if GUIDE_IS_PACKED {
        return packed_guide_is_denoised(textureLoad(in_guide, pixel, 0).xy);
    }
    return decode_guide(pixel, depth_encoding()).denoised;
}
