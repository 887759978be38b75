//! Prefilter: one sparse edge-stopping blur of the noisy input, stronger where it varies over time.
//!
//! in   radiance       any float     full   noisy input
//! in   guide          rg32uint      full   packed G-buffer, or normal, roughness, depth
//! in   reprojected    rg32uint      full   for the variance
//! in   average        rgba16float   tile
//! in   tiles, args    lists         tiles to denoise
//! out  prefiltered    rg32uint      full   packed radiance and its variance
//!
//! Grid: one 8x8 workgroup per listed tile (indirect). 16 taps of workgroup memory per pixel.
//! After: the prefilter of the AMD FidelityFX denoiser 1.2 (2021). Differs: the average is sampled between
//! tiles that have one, taps off screen or on pixels that are left out have no weight.

import package::shared::frame;
import package::shared::packing;
import package::shared::gbuffer;
import package::shared::radiance;
import package::shared::tiles;
import package::shared::average;

@group(1) @binding(2) var in_reprojected: texture_2d<u32>;
@group(1) @binding(3) var<storage, read> in_tiles: array<u32>;
@group(1) @binding(4) var<storage, read> in_args: array<vec4<u32>, 4>;
@group(1) @binding(5) var out_prefiltered: texture_storage_2d<rg32uint, write>;

const WINDOW_SIZE: u32 = 14u;
const WINDOW_BORDER: u32 = 3u;
const WINDOW_COUNT: u32 = 196u;
const TAP_COUNT: u32 = 15u;

// Halton points in bases 2 and 3 over 7x7 pixels, centre left out, as published.
const TAPS: array<vec2<i32>, 15> = array<vec2<i32>, 15>(
    vec2<i32>(0, 1), vec2<i32>(-2, 1), vec2<i32>(2, -3), vec2<i32>(-3, 0), vec2<i32>(1, 2),
    vec2<i32>(-1, -2), vec2<i32>(3, 0), vec2<i32>(-3, 3), vec2<i32>(0, -3), vec2<i32>(-1, -1),
    vec2<i32>(2, 1), vec2<i32>(-2, -2), vec2<i32>(1, 0), vec2<i32>(0, 2), vec2<i32>(3, -1),
);

// Radiance and variance as halves; normal as 16-bit xy and z; linear depth, 0 where the tap has no weight.
var<workgroup> window_radiance: array<vec2<u32>, 196>;
var<workgroup> window_normal: array<vec2<u32>, 196>;
var<workgroup> window_depth: array<f32, 196>;

fn load_window(tile: vec2<u32>, entry: u32) {
    let offset = vec2<u32>(entry % WINDOW_SIZE, entry / WINDOW_SIZE);
    let p = vec2<i32>(tile * TILE_SIZE + offset) - vec2<i32>(i32(WINDOW_BORDER));
    var depth = 0.0;
    if all(p >= vec2<i32>(0)) && all(p < vec2<i32>(frame.size)) {
        let guide = load_guide(vec2<u32>(p));
        if guide.denoised {
            depth = guide.depth;
            let variance = unpack_reprojected(textureLoad(in_reprojected, p, 0).xy).variance;
            window_radiance[entry] = pack_radiance(load_radiance(vec2<u32>(p)), variance);
            window_normal[entry] = vec2<u32>(pack2x16snorm(guide.normal.xy), pack2x16snorm(vec2<f32>(guide.normal.z, 0.0)));
        }
    }
    window_depth[entry] = depth;
}

fn window_normal_at(entry: u32) -> vec3<f32> {
    let packed = window_normal[entry];
    return vec3<f32>(unpack2x16snorm(packed.x), unpack2x16snorm(packed.y).x);
}

fn radiance_weight(radiance: vec3<f32>, average: vec3<f32>, variance: f32) -> f32 {
    let falloff = frame.prefilter_radiance_falloff + frame.prefilter_radiance_variance_falloff * variance;
    return max(exp(-falloff * length(average - radiance)), frame.prefilter_radiance_weight_floor);
}

fn depth_weight(center_depth: f32, depth: f32) -> f32 {
    // Bounded, so that no falloff makes it infinite: infinity times 0 is no number.
    return exp(-frame.prefilter_depth_falloff * min(center_depth * abs(center_depth - depth), 1e26));
}

// Zero to the power of zero is left to the driver by the languages that kernels are emitted in.
fn normal_weight(cosine: f32) -> f32 {
    return pow(clamp(cosine, 1e-6, 1.0), frame.prefilter_normal_power);
}

// rgb: filtered radiance; a: its variance.
fn prefilter_at(center: u32, average: vec3<f32>) -> vec4<f32> {
    let center_signal = unpack_radiance(window_radiance[center]);
    let center_normal = window_normal_at(center);
    let center_depth = window_depth[center];
    let variance = center_signal.a;
    let variance_weight = max(frame.prefilter_variance_weight_floor, 1.0 - exp(-frame.prefilter_variance_falloff * variance));

    var weight_sum = radiance_weight(center_signal.rgb, average, variance);
    var radiance_sum = weight_sum * center_signal.rgb;
    var variance_sum = weight_sum * weight_sum * variance;
    for (var i = 0u; i < TAP_COUNT; i++) {
        let tap = TAPS[i];
        let entry = u32(i32(center) + tap.x + tap.y * i32(WINDOW_SIZE));
        let depth = window_depth[entry];
        if depth > 0.0 {
            let signal = unpack_radiance(window_radiance[entry]);
            let weight = normal_weight(dot(center_normal, window_normal_at(entry)))
                * depth_weight(center_depth, depth)
                * radiance_weight(signal.rgb, average, variance)
                * variance_weight;
            weight_sum += weight;
            radiance_sum += weight * signal.rgb;
            variance_sum += weight * weight * signal.a;
        }
    }
    return vec4<f32>(radiance_sum / weight_sum, variance_sum / (weight_sum * weight_sum));
}

@compute @workgroup_size(8, 8)
fn prefilter(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let index = list_index(group);
    if index >= in_args[0].w {
        return;
    }
    let tile = unpack_tile(in_tiles[index]);
    for (var entry = lane; entry < WINDOW_COUNT; entry += 64u) {
        load_window(tile, entry);
    }
    workgroupBarrier();

    let position = lane_position(lane);
    let pixel = tile * TILE_SIZE + position;
    let center = (position.y + WINDOW_BORDER) * WINDOW_SIZE + position.x + WINDOW_BORDER;
    if any(pixel >= frame.size) || window_depth[center] == 0.0 {
        return;
    }
    var signal = unpack_radiance(window_radiance[center]);
    let roughness = load_guide(pixel).roughness;
    if signal.a > 0.0 && roughness > frame.mirror_roughness {
        signal = prefilter_at(center, sample_average(pixel));
    }
    textureStore(out_prefiltered, pixel, vec4<u32>(pack_radiance(signal.rgb, signal.a), 0u, 0u));
}
