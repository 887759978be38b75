//! Block average: averages radiance over the part of each 4x4 block that shows one surface.
//!
//! in   guide      rg32uint      full    packed G-buffer, or normal, roughness, depth
//! in   radiance   any float     full    noisy input; a: hit distance (not when ACCUMULATED)
//! in   history    rgba16float   full    this frame's accumulated radiance (when ACCUMULATED)
//! in   tiles, args   lists             tiles to denoise
//! out  blocks     rgba32uint    block   surface, mean radiance, hit share; what was cut off from outliers
//! out  samples    rg32uint      block   second and third largest luminance, mean brightness, what one sample counts for (not
//!                                       when ACCUMULATED)
//!
//! Grid: one invocation a block, workgroups of the blocks of 16 listed tiles (indirect).
//! Each pixel is read twice.
//! After: outliers are set aside, not lost, as in DeCoro et al. 2010; here their excess is spread by `block_spread`
//! and comes back in `accumulate`.

import package::shared::frame;
import package::shared::packing;
import package::shared::gbuffer;
import package::shared::radiance;
import package::shared::outliers;
import package::shared::footprint;
import package::shared::history;
import package::shared::blocks;
import package::shared::tiles;

// Averages what was accumulated, not the input.
override ACCUMULATED: bool = false;
// Cuts outliers off.
override OUTLIER_SPREAD: bool = true;
// Later passes work on whole blocks.
override WHOLE_BLOCKS: bool = false;
// Some later pass uses `samples`.
override SAMPLES_ARE_USED: bool = false;

@group(1) @binding(1) var in_history: texture_2d<f32>;
@group(1) @binding(2) var out_blocks: texture_storage_2d<rgba32uint, write>;
@group(1) @binding(3) var out_samples: texture_storage_2d<rg32uint, write>;
@group(1) @binding(4) var<storage, read> in_tiles: array<u32>;
@group(1) @binding(5) var<storage, read> in_args: array<vec4<u32>, 4>;

// Weight that the surface of the least fitting pixel of a whole block has.
const WHOLE_WEIGHT: f32 = 0.37;

// What stands for a block.
struct Choice {
    guide: Guide,
    pixel: vec2<u32>,
    // The three largest luminances of its samples.
    peaks: vec3<f32>,
}

// Pixels of a block on screen.
fn pixel_count(corner: vec2<u32>) -> vec2<u32> {
    return min(frame.size - corner, vec2<u32>(BLOCK_SIZE));
}

// The denoised pixel nearest to the centre of a block.
fn choose(corner: vec2<u32>) -> Choice {
    var choice: Choice;
    var nearest = 1e9;
    var count = 0u;
    let size = pixel_count(corner);
    for (var i = 0u; i < 4u * size.y; i++) {
        let pixel = corner + vec2<u32>(i & 3u, i >> 2u);
        if (i & 3u) >= size.x {
            continue;
        }
        let denoised = is_denoised(pixel);
        // A little off the centre, so that no two are as near.
        let offset = vec2<f32>(pixel - corner) - vec2<f32>(1.4, 1.45);
        let distance = dot(offset, offset);
        if denoised && distance < nearest {
            nearest = distance;
            choice.pixel = pixel;
        }
        count += select(0u, 1u, denoised);
        if !ACCUMULATED {
            let l = select(0.0, luminance(load_radiance(pixel)), denoised);
            let p = choice.peaks;
            choice.peaks = vec3<f32>(max(p.x, l), max(p.y, min(p.x, l)), max(p.z, min(p.y, l)));
        }
    }
    if count > 0u {
        choice.guide = load_guide(choice.pixel);
    }
    // A sample on its own is above no other.
    choice.peaks.y = select(choice.peaks.y, choice.peaks.x, count < 2u);
    choice.peaks.z = select(choice.peaks.z, choice.peaks.y, count < 3u);
    return choice;
}

@compute @workgroup_size(64)
fn block_average(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let index = block_list_index(group, lane);
    if index >= in_args[0].w {
        return;
    }
    let block_index = block_of_tile(unpack_tile(in_tiles[index]), lane);
    if any(vec2<i32>(block_index) > last_block()) {
        return;
    }
    let corner = block_index * BLOCK_SIZE;
    let choice = choose(corner);
    if !choice.guide.denoised {
        textureStore(out_blocks, block_index, vec4<u32>(0u));
        return;
    }
    let position = world_position(choice.pixel, choice.guide.depth);
    let camera_distance = camera_distance_of(position);
    let plane = plane_of(choice.guide, position);
    // a: weight.
    var radiance = vec4<f32>(0.0);
    var excess = vec3<f32>(0.0);
    // x: weighted sum, y: weight of those that know.
    var share = vec2<f32>(0.0);
    var noise = vec2<f32>(0.0);
    var moments = vec2<f32>(0.0);
    var squared_weight = 0.0;
    var least_weight = 1.0;
    let size = pixel_count(corner);
    for (var i = 0u; i < 4u * size.y; i++) {
        let pixel = corner + vec2<u32>(i & 3u, i >> 2u);
        if (i & 3u) >= size.x {
            continue;
        }
        let guide = load_guide(pixel);
        let w = select(0.0, exp(-plane_penalty(plane, guide, vec2<f32>(pixel) + 0.5)), guide.denoised);
        var c = vec3<f32>(0.0);
        if ACCUMULATED {
            let history = unpack_history(textureLoad(in_history, pixel, 0));
            c = min(history.radiance * frame.exposure, vec3<f32>(HALF_MAX));
            share += select(vec2<f32>(0.0), vec2<f32>(history.share, 1.0) * w, guide.denoised);
            noise += select(vec2<f32>(0.0), vec2<f32>(history.noise, 1.0) * w, guide.denoised && history.noise >= 0.0);
        } else {
            c = load_radiance(pixel);
            let distance = usable_hit_distance(textureLoad(in_radiance, pixel, 0).a);
            share += select(vec2<f32>(0.0), vec2<f32>(hit_share(distance, camera_distance), 1.0) * w, distance > 0.0);
            if OUTLIER_SPREAD {
                let kept = without_outlier(c, choice.peaks.y, choice.guide.roughness);
                excess += select(vec3<f32>(0.0), (c - kept) * w, guide.denoised);
                c = kept;
            }
        }
        c = select(vec3<f32>(0.0), c, guide.denoised);
        radiance += vec4<f32>(c, 1.0) * w;
        let b = brightness(c);
        moments += vec2<f32>(b, b * b) * w;
        squared_weight += w * w;
        least_weight = min(least_weight, w);
    }
    let normalization = 1.0 / max(radiance.w, 1e-6);
    moments *= normalization;
    var block: Block;
    block.guide = choice.guide;
    block.radiance = radiance.rgb * normalization;
    block.excess = excess * normalization;
    // Weights next to nothing say nothing, and some devices round them to 0.
    block.share = select(0.5, share.x / max(share.y, 1e-6), share.y > 1e-6);
    var variance = max(moments.y - moments.x * moments.x, 0.0);
    if ACCUMULATED {
        // Variance over time where most pixels know it, else variance over the block.
        variance = mix(variance, noise.x / max(noise.y, 1e-6), smoothstep(0.0, 0.5, noise.y * normalization));
    }
    block.deviation = sqrt(variance);
    if WHOLE_BLOCKS {
        block.is_whole = least_weight >= WHOLE_WEIGHT && all(size == vec2<u32>(BLOCK_SIZE));
    }
    if SAMPLES_ARE_USED {
        let peaks = min(vec2<f32>(choice.peaks.y, choice.peaks.z), vec2<f32>(HALF_MAX));
        let brightness_and_weight = vec2<f32>(moments.x, squared_weight * normalization * normalization);
        textureStore(out_samples, block_index, vec4<u32>(pack2x16float(peaks), pack2x16float(brightness_and_weight), 0u, 0u));
    }
    textureStore(out_blocks, block_index, pack_block(block));
}
