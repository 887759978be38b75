//! Resolve temporal: clips history to what this frame makes plausible and blends both by the history's length.
//!
//! in   prefiltered    rg32uint      full   packed radiance and variance (with the spatial filter)
//! in   reprojected    rg32uint      full   packed history radiance and length
//! in   guide          rg32uint      full   packed G-buffer, or normal, roughness, depth: what is left out
//! in   average        rgba16float   tile   (history clip or average mixing)
//! in   tiles, args    lists         tiles to denoise
//! in   radiance       any float     full   input fallback, or no spatial filter
//! out  output         rgba16float   full   rgb: denoised radiance; a: variance, 0..1. Next frame's history.
//!
//! Grid: one 8x8 workgroup per listed tile (indirect). 18 taps of workgroup memory for the 9x9 statistics.
//! After: temporal resolve of the AMD FidelityFX denoiser 1.2 (2021). Differs: reads this frame's history
//! length, and only pixels on screen that are denoised enter the statistics.

import package::shared::frame;
import package::shared::packing;
import package::shared::gbuffer;
import package::shared::radiance;
import package::shared::tiles;
import package::shared::neighborhood;
import package::shared::average;
import package::shared::fallback;

// The prefilter has run.
override SPATIAL_FILTER: bool = true;
// History and this frame's colour are clipped to what the neighbourhood makes plausible.
override HISTORY_CLIP: bool = true;
// The 8x8 average is mixed into the colour where history is short.
override AVERAGE_MIXING: bool = true;
// One of these two.
override AVERAGE_IS_READ: bool = true;

@group(1) @binding(2) var in_reprojected: texture_2d<u32>;
@group(1) @binding(3) var in_prefiltered: texture_2d<u32>;
@group(1) @binding(4) var<storage, read> in_tiles: array<u32>;
@group(1) @binding(5) var<storage, read> in_args: array<vec4<u32>, 4>;
@group(1) @binding(6) var out_output: texture_storage_2d<rgba16float, write>;

// The nearest colour to `center` on the way to `color` that lies in the box of half size `extent` around it.
fn clip_to_box(color: vec3<f32>, center: vec3<f32>, extent: vec3<f32>) -> vec3<f32> {
    let offset = color - center;
    let reach = abs(offset) / (extent + frame.clip_extent_floor);
    let farthest = max(reach.x, max(reach.y, reach.z));
    return select(color, center + offset / max(farthest, 1.0), farthest > 1.0);
}

// rgb: this frame's radiance, exposed; a: its variance.
fn current_signal(pixel: vec2<u32>, reprojected: Reprojected) -> vec4<f32> {
    if SPATIAL_FILTER {
        return unpack_radiance(textureLoad(in_prefiltered, pixel, 0).xy);
    }
    return vec4<f32>(load_radiance(pixel), reprojected.variance);
}

// rgb: denoised radiance, exposed; a: variance.
fn resolve(pixel: vec2<u32>, lane: u32) -> vec4<f32> {
    let reprojected = unpack_reprojected(textureLoad(in_reprojected, pixel, 0).xy);
    let signal = current_signal(pixel, reprojected);
    var average = vec3<f32>(0.0);
    if AVERAGE_IS_READ {
        average = sample_average(pixel);
    }
    var history = reprojected.radiance;
    var current = signal.rgb;
    if AVERAGE_MIXING {
        current = mix(current, average, 1.0 / max(reprojected.length + 1.0, 1.0));
    }
    if HISTORY_CLIP {
        let statistics = neighborhood_statistics(lane);
        let spread = sqrt(statistics.variance) + length(statistics.mean - average);
        let extent = spread * frame.stability * frame.clip_scale;
        let center = mix(statistics.mean, average, frame.clip_average_pull);
        history = clip_to_box(history, center, extent);
        current = clip_to_box(current, average, extent);
    }
    let weight = 1.0 - 1.0 / max(reprojected.length, 1.0);
    let radiance = mix(current, history, weight);
    let variance = mix(temporal_variance(radiance, history), signal.a, weight);
    return vec4<f32>(radiance, variance);
}

@compute @workgroup_size(8, 8)
fn resolve_temporal(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let index = list_index(group);
    if index >= in_args[0].w {
        return;
    }
    let tile = unpack_tile(in_tiles[index]);
    let pixel = tile * TILE_SIZE + lane_position(lane);
    if HISTORY_CLIP {
        for (var i = 0u; i < 4u; i++) {
            let entry = lane + 64u * i;
            let p = window_pixel(tile, entry);
            var radiance = vec3<f32>(0.0);
            var counts = false;
            if all(p >= vec2<i32>(0)) && all(p < vec2<i32>(frame.size)) {
                counts = is_denoised(vec2<u32>(p));
                if SPATIAL_FILTER {
                    radiance = unpack_radiance(textureLoad(in_prefiltered, p, 0).xy).rgb;
                } else {
                    radiance = load_radiance(vec2<u32>(p));
                }
            }
            store_window(entry, radiance, counts);
        }
        workgroupBarrier();
        sum_rows(lane);
        workgroupBarrier();
    }

    if any(pixel >= frame.size) {
        return;
    }
    let guide = load_guide(pixel);
    var result: vec4<f32>;
    if guide.denoised {
        result = resolve(pixel, lane);
        result = vec4<f32>(min(result.rgb * frame.inverse_exposure, vec3<f32>(HALF_MAX)), result.a);
    } else {
        result = vec4<f32>(fallback_radiance(pixel, guide), 0.0);
    }
    textureStore(out_output, pixel, rounded_to_half(result));
}
