//! Block average: averages radiance over the part of each 4x4 block that shows one surface.
//!
//! in   guide      rg32uint      full    packed G-buffer, or normal, roughness, depth
//! in   radiance   any float     full    noisy input; a: hit distance
//! in   tiles, args   lists             tiles to denoise
//! out  blocks     rgba32uint    block   surface, mean radiance, hit share; what was cut off from outliers
//! out  samples    rg32uint      block   second and third largest luminance, mean brightness, which pixels show the surface
//!
//! Grid: one invocation a block, workgroups of the blocks of 16 listed tiles (indirect).
//! Each pixel is read once, the one in the middle twice.
//! After: outliers are set aside, not lost, as in DeCoro et al. 2010; here their excess is spread by `block_spread`
//! and comes back in `accumulate`.

import package::shared::frame;
import package::shared::packing;
import package::shared::gbuffer;
import package::shared::radiance;
import package::shared::outliers;
import package::shared::footprint;
import package::shared::blocks;
import package::shared::tiles;

// Cuts outliers off.
override OUTLIER_SPREAD: bool = true;
// Later passes work on whole blocks.
override WHOLE_BLOCKS: bool = false;
// Some later pass uses `samples`.
override SAMPLES_ARE_USED: bool = false;

@group(1) @binding(2) var out_blocks: texture_storage_2d<rgba32uint, write>;
@group(1) @binding(3) var out_samples: texture_storage_2d<rg32uint, write>;
@group(1) @binding(4) var<storage, read> in_tiles: array<u32>;
@group(1) @binding(5) var<storage, read> in_args: array<vec4<u32>, 4>;

// Weight from which on a pixel shows the surface of its block, as `block_average_accumulated` asks, and whole blocks do of
// all their pixels.
const SHOWN_WEIGHT: f32 = 0.15;

// Pixels of a block, from its centre outwards: a digit is a pixel's place in its row, and four times that row.
const FROM_CENTER: array<u32, 2> = array<u32, 2>(0x2184a695u, 0xf3c0b7edu);

// The denoised pixel nearest to the centre of a block, which stands for it; some other one where none is.
fn central_pixel(corner: vec2<u32>) -> vec2<u32> {
    var pixel = corner;
    for (var i = 0u; i < 16u; i++) {
        let place = (FROM_CENTER[i >> 3u] >> (4u * (i & 7u))) & 15u;
        pixel = min(corner + vec2<u32>(place & 3u, place >> 2u), frame.size - 1u);
        if is_denoised(pixel) {
            break;
        }
    }
    return pixel;
}

struct Sample {
    radiance: vec3<f32>,
    luminance: f32,
    weight: f32,
}

// Over the samples of a block.
struct Sums {
    // a: weight.
    radiance: vec4<f32>,
    // Of brightness.
    moments: vec2<f32>,
}

fn with_sample(sums: Sums, radiance: vec3<f32>, weight: f32) -> Sums {
    let b = brightness(radiance);
    return Sums(sums.radiance + vec4<f32>(radiance, 1.0) * weight, sums.moments + vec2<f32>(b, b * b) * weight);
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
    let central = central_pixel(corner);
    let surface = load_guide(central);
    if !surface.denoised {
        textureStore(out_blocks, block_index, vec4<u32>(0u));
        return;
    }
    let position = world_position(central, surface.depth);
    let camera_distance = camera_distance_of(position);
    let plane = plane_of(surface, position);
    var sums: Sums;
    // The brightest sample is not in the sums until it is known whether it is an outlier.
    var brightest: Sample;
    // The next largest luminances.
    var next = vec2<f32>(0.0);
    var count = 0u;
    // x: weighted sum, y: weight of those that know.
    var share = vec2<f32>(0.0);
    // A bit for each pixel that shows the surface.
    var shown = 0u;
    for (var i = 0u; i < pixels_in_rows(corner); i++) {
        let wanted = corner + position_in_block(i);
        let pixel = min(wanted, frame.size - 1u);
        let guide = load_guide(pixel);
        let counts = guide.denoised && all(pixel == wanted);
        let w = select(0.0, exp(-plane_penalty(plane, guide, vec2<f32>(pixel) + 0.5)), counts);
        let texel = textureLoad(in_radiance, pixel, 0);
        let c = select(vec3<f32>(0.0), clean_radiance(texel.rgb * frame.exposure), counts);
        let sample = Sample(c, select(0.0, luminance(c), counts), w);
        let is_brighter = sample.luminance > brightest.luminance;
        let darker = min(sample.luminance, brightest.luminance);
        next = vec2<f32>(max(next.x, darker), max(next.y, min(next.x, darker)));
        sums = with_sample(
            sums,
            select(sample.radiance, brightest.radiance, is_brighter),
            select(sample.weight, brightest.weight, is_brighter),
        );
        brightest.radiance = select(brightest.radiance, sample.radiance, is_brighter);
        brightest.weight = select(brightest.weight, sample.weight, is_brighter);
        brightest.luminance = max(brightest.luminance, sample.luminance);
        let distance = usable_hit_distance(texel.a);
        share += select(vec2<f32>(0.0), vec2<f32>(hit_share(distance, camera_distance), 1.0) * w, distance > 0.0);
        count += select(0u, 1u, counts);
        shown |= select(0u, 1u << i, w >= SHOWN_WEIGHT);
    }
    // A sample on its own is above no other.
    next.x = select(next.x, brightest.luminance, count < 2u);
    next.y = select(next.y, next.x, count < 3u);
    var excess = vec3<f32>(0.0);
    var kept = brightest.radiance;
    if OUTLIER_SPREAD {
        kept = without_outlier(brightest.radiance, next.x, surface.roughness);
        excess = (brightest.radiance - kept) * brightest.weight;
    }
    sums = with_sample(sums, kept, brightest.weight);
    let normalization = 1.0 / max(sums.radiance.w, 1e-6);
    let moments = sums.moments * normalization;
    var block: Block;
    block.guide = surface;
    block.radiance = sums.radiance.rgb * normalization;
    block.excess = excess * normalization;
    // Weights next to nothing say nothing, and some devices round them to 0.
    block.share = select(0.5, share.x / max(share.y, 1e-6), share.y > 1e-6);
    block.deviation = sqrt(max(moments.y - moments.x * moments.x, 0.0));
    if WHOLE_BLOCKS {
        block.is_whole = shown == ALL_PIXELS;
    }
    if SAMPLES_ARE_USED {
        let samples = Samples(next, moments.x, shown);
        textureStore(out_samples, block_index, vec4<u32>(pack_samples(samples), 0u, 0u));
    }
    textureStore(out_blocks, block_index, pack_block(block));
}
