//! Block statistics: smooths blocks over their neighbours, and notices where the light changed.
//!
//! in   blocks       rgba32uint    block   of the input
//! in   samples      rg32uint      block   mean brightness, which pixels show the surface
//! in   motion       any float     full    uv motion of the surface (light change, surface motion)
//! in   prev_light   r32uint       block   last frame's `light`
//! in   tiles, args   lists                tiles to denoise
//! out  blocks       rgba32uint    block   mean over 3x3 blocks, deviation between them
//! out  light        r32uint       block   brightness of a sample over time, its deviation, and whether it changed
//!
//! Grid: one invocation a block, workgroups of the blocks of 16 listed tiles (indirect).
//! 9 taps.
//! What is compared over time is the mean of squeezed brightness, not of radiance: single bright samples, which come
//! and go, hardly move it, and what all samples agree on does.

import package::shared::frame;
import package::shared::packing;
import package::shared::footprint;
import package::shared::history;
import package::shared::blocks;
import package::shared::light;
import package::shared::tiles;

// Notices where the light changed.
override LIGHT_CHANGE: bool = true;
// The motion of surfaces is known.
override SURFACE_MOTION: bool = true;

@group(0) @binding(5) var in_motion: texture_2d<f32>;

@group(1) @binding(0) var in_blocks: texture_2d<u32>;
@group(1) @binding(1) var in_samples: texture_2d<u32>;
@group(1) @binding(2) var in_prev_light: texture_2d<u32>;
@group(1) @binding(3) var out_blocks: texture_storage_2d<rgba32uint, write>;
@group(1) @binding(4) var out_light: texture_storage_2d<r32uint, write>;
@group(1) @binding(5) var<storage, read> in_tiles: array<u32>;
@group(1) @binding(6) var<storage, read> in_args: array<vec4<u32>, 4>;

// A change counts beyond this, standard errors and a share of the brightness.
const LIGHT_FLOOR: f32 = 0.01;
// What is known of the light errs too: the variance of both together, over that of a frame alone.
const KNOWN_VARIANCE: f32 = 1.33;

// What last frames had, where the surface was; brightness is 0 where it is not known.
fn known_light(block: vec2<i32>, position: vec3<f32>) -> Light {
    var prev_uv = vec2<f32>(0.0);
    if SURFACE_MOTION {
        let pixel = vec2<u32>(block_place(block));
        let motion = textureLoad(in_motion, pixel, 0).xy * frame.motion_scale + frame.motion_offset;
        prev_uv = pixel_uv(pixel) - motion;
    } else {
        prev_uv = prev_uv_of(position);
    }
    let place = prev_uv * vec2<f32>(frame.prev_size);
    // Not a number fails the comparison.
    let on_screen = all(place >= vec2<f32>(0.0)) && all(place < vec2<f32>(frame.prev_size));
    let prev_block = vec2<i32>(select(vec2<f32>(0.0), place, on_screen)) / i32(BLOCK_SIZE);
    var light = unpack_light(textureLoad(in_prev_light, prev_block, 0).x);
    light.brightness = select(0.0, light.brightness, on_screen);
    return light;
}

@compute @workgroup_size(64)
fn block_statistics(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let index = block_list_index(group, lane);
    if index >= in_args[0].w {
        return;
    }
    let last = last_block();
    let center = vec2<i32>(block_of_tile(unpack_tile(in_tiles[index]), lane));
    if any(center > last) {
        return;
    }
    var block = unpack_block(textureLoad(in_blocks, center, 0));
    if !block.guide.denoised {
        textureStore(out_blocks, center, vec4<u32>(0u));
        if LIGHT_CHANGE {
            textureStore(out_light, center, vec4<u32>(0u));
        }
        return;
    }
    let position = position_at(block_place(center), block.guide.depth);
    let plane = plane_of(block.guide, position);
    // a: weight.
    var radiance = vec4<f32>(0.0);
    var excess = vec3<f32>(0.0);
    var share = 0.0;
    // Of blocks, and of samples.
    var moments = vec2<f32>(0.0);
    var sample_moments = vec2<f32>(0.0);
    var squared_weight = 0.0;
    var i = 0;
    loop {
        let offset = vec2<i32>(i % 3, i / 3) - 1;
        let at = clamp(center + offset, vec2<i32>(0), last);
        let tap = unpack_block(textureLoad(in_blocks, at, 0));
        let penalty = plane_penalty(plane, tap.guide, block_place(at)) + 0.4 * dot(vec2<f32>(offset), vec2<f32>(offset));
        let w = select(0.0, exp(-penalty), tap.guide.denoised && all(at == center + offset));
        radiance += vec4<f32>(tap.radiance, 1.0) * w;
        excess += tap.excess * w;
        share += tap.share * w;
        let b = brightness(tap.radiance);
        moments += vec2<f32>(b, b * b) * w;
        if LIGHT_CHANGE {
            // Blocks that show no reflection have none.
            let samples = unpack_samples(textureLoad(in_samples, at, 0).xy);
            let mean = samples.brightness;
            let second_moment = tap.deviation * tap.deviation + mean * mean;
            sample_moments += select(vec2<f32>(0.0), vec2<f32>(mean, second_moment) * w, tap.guide.denoised);
            squared_weight += select(0.0, w * w / f32(countOneBits(samples.shown)), tap.guide.denoised);
        }
        i += 1;
        if i >= 9 {
            break;
        }
    }
    let normalization = 1.0 / max(radiance.w, 1e-6);
    moments *= normalization;
    block.radiance = radiance.rgb * normalization;
    block.excess = excess * normalization;
    block.share = share * normalization;
    block.deviation = sqrt(max(moments.y - moments.x * moments.x, 0.0));
    textureStore(out_blocks, center, pack_block(block));

    if LIGHT_CHANGE {
        sample_moments *= normalization;
        let known = known_light(center, position);
        let variance = max(sample_moments.y - sample_moments.x * sample_moments.x, 0.0);
        // Of the calmer frames: those without the lamp, before it is switched on and after it is switched off.
        let calmer = min(variance, known.deviation * known.deviation);
        let error = sqrt(calmer * squared_weight * KNOWN_VARIANCE) * normalization;
        let tolerance = frame.light_change_sigma * error + frame.light_change_share * known.brightness + LIGHT_FLOOR;
        let change = abs(sample_moments.x - known.brightness) / tolerance;
        let is_known = known.brightness > 0.0;
        var light: Light;
        light.changed = select(0.0, smoothstep(1.0, 2.0, change), is_known);
        let rate = select(1.0, max(frame.light_change_rate, light.changed), is_known);
        light.brightness = mix(known.brightness, sample_moments.x, rate);
        light.deviation = sqrt(mix(known.deviation * known.deviation, variance, rate));
        textureStore(out_light, center, vec4<u32>(pack_light(light), 0u, 0u, 0u));
    }
}
