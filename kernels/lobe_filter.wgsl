//! Lobe filter: smooths accumulated radiance over the footprint of the specular lobe: the blocks around a pixel where
//! the footprint is wide, a few pixels where it is narrow, and for mirrors those that differ by noise alone.
//!
//! in   history       rgba16float   full    this frame's accumulated radiance
//! in   guide         rg32uint      full    packed G-buffer, or normal, roughness, depth
//! in   blocks        rgba32uint    block   accumulated radiance filtered over the footprint, its deviation
//! in   tiles, args   lists                 tiles to denoise, or blocks (whole blocks)
//! in   radiance      any float     full    input fallback
//! out  output        rgba16float   full    rgb: denoised radiance; a: variance of its brightness, 0..1
//! out  prev_guide    r32uint       full    what the next frame wants to know of the G-buffer (G-buffer copy)
//!
//! Grid: an invocation for each 2x2 pixels, which are between the same 4 blocks; one workgroup per 4 listed tiles or 16
//! listed blocks (indirect). Loads those blocks and, for each pixel, a history and a guide for each near tap.
//! Weights depend on the surface, on hit distance and on how settled tap and pixel are; on colour for mirrors only, as
//! elsewhere bright samples are rare and that would darken.

import package::shared::frame;
import package::shared::packing;
import package::shared::gbuffer;
import package::shared::radiance;
import package::shared::listed;
import package::shared::tiles;
import package::shared::footprint;
import package::shared::outliers;
import package::shared::history;
import package::shared::blocks;
import package::shared::fallback;

// Near taps.
override NEAR_TAPS: u32 = 12u;
// Those of pixels without history, as many at least, on the same disk.
override YOUNG_TAPS: u32 = 12u;
// There are filtered blocks.
override WIDE_FILTER: bool = true;

@group(1) @binding(2) var in_history: texture_2d<f32>;
@group(1) @binding(3) var in_blocks: texture_2d<u32>;
@group(1) @binding(4) var out_output: texture_storage_2d<rgba16float, write>;
@group(1) @binding(5) var out_prev_guide: texture_storage_2d<r32uint, write>;

// Least half axes, in pixels, over which the weight of near taps falls.
const NEAR_LEAST: f32 = 1.7;
// Pixels that near taps reach. That grows with their number, so that few of them meet in a pixel.
const NEAR_REACH: f32 = 1.4;
const REACH_OF_TAP: f32 = 0.05;
const NEAR_MOST: f32 = 3.0;
// The variance of what was accumulated for few frames is high and taps may fit worse: differences count for a share of
// what they do, for a frame and for each one more, and what fits no tap takes a little of all. How far the filter reaches
// does not depend on frames.
const YOUNG_DIFFERENCE: f32 = 0.2;
const DIFFERENCE_OF_FRAME: f32 = 0.1;
const YOUNG_FIT: f32 = 0.05;
// Frames accumulated below which there are `YOUNG_TAPS`.
const YOUNG_LENGTH: f32 = 1.5;
// Turns that none reaches: more than there can be taps.
const TURNS: u32 = 256u;
// As `NORMAL_TOLERANCE` between single pixels.
const PIXEL_NORMAL_TOLERANCE: f32 = 0.02;
// Half axis of the filter, in pixels, from and to which blocks take over.
const WIDE_FROM: f32 = 0.7;
const WIDE_TO: f32 = 2.5;
// How well they have to fit for that, from and to.
const WIDE_FIT_FROM: f32 = 0.2;
const WIDE_FIT_TO: f32 = 0.6;
// Half axis below which, and from which no longer, taps may differ by noise alone.
const SHARP_TO: f32 = 0.3;
const SHARP_FROM: f32 = 0.7;
// Weight of squared differences of brightness against their variance.
const NOISE_FALLOFF: f32 = 0.1;
// Taps count as at most so many times as bright as the pixel and a constant, times squared half axes of
// `GLINT_AXIS` pixels: what is bright in narrow lobes has edges. New pixels, which know little, allow more.
const GLINT_LIMIT: f32 = 4.0;
const GLINT_FLOOR: f32 = 0.1;
const GLINT_AXIS: f32 = 0.5;
const GLINT_FRAMES: f32 = 4.0;

// What the blocks around a pixel agree on.
struct Wide {
    radiance: vec3<f32>,
    // How well they fit, 0 to 1.
    fit: f32,
    // Variance of accumulated brightness.
    variance: f32,
}

// One of them.
struct BlockTap {
    // Radiance, and 1, times how well the block fits.
    fitting: vec4<f32>,
    variance: f32,
}

fn block_tap(block: vec2<i32>, texel: vec4<u32>, plane: Plane, own_share: f32) -> BlockTap {
    let tap = unpack_block(texel);
    let apart = (tap.share - own_share) * (1.0 / BLOCK_SHARE_TOLERANCE);
    let penalty = plane_penalty(plane, tap.guide, block_place(block)) + apart * apart;
    let fit = select(0.0, exp(-penalty), tap.guide.denoised);
    return BlockTap(vec4<f32>(tap.radiance, 1.0) * fit, select(0.0, tap.deviation * tap.deviation, tap.guide.denoised));
}

// Texels of the blocks that the pixels of a quad lie between.
struct Corners {
    top_left: vec4<u32>,
    top_right: vec4<u32>,
    bottom_left: vec4<u32>,
    bottom_right: vec4<u32>,
}

fn corners_of(pixel: vec2<u32>) -> Corners {
    return Corners(
        textureLoad(in_blocks, corner_of(pixel, 0u).block, 0),
        textureLoad(in_blocks, corner_of(pixel, 1u).block, 0),
        textureLoad(in_blocks, corner_of(pixel, 2u).block, 0),
        textureLoad(in_blocks, corner_of(pixel, 3u).block, 0),
    );
}

// What a surface takes them for.
struct BlockTaps {
    top_left: BlockTap,
    top_right: BlockTap,
    bottom_left: BlockTap,
    bottom_right: BlockTap,
}

fn block_taps(corners: Corners, pixel: vec2<u32>, plane: Plane, own_share: f32) -> BlockTaps {
    return BlockTaps(
        block_tap(corner_of(pixel, 0u).block, corners.top_left, plane, own_share),
        block_tap(corner_of(pixel, 1u).block, corners.top_right, plane, own_share),
        block_tap(corner_of(pixel, 2u).block, corners.bottom_left, plane, own_share),
        block_tap(corner_of(pixel, 3u).block, corners.bottom_right, plane, own_share),
    );
}

fn wide_at(pixel: vec2<u32>, taps: BlockTaps) -> Wide {
    let after = between_blocks(pixel).fraction;
    let before = 1.0 - after;
    let w = vec4<f32>(before.x, after.x, before.x, after.x) * vec4<f32>(before.y, before.y, after.y, after.y);
    let top = taps.top_left.fitting * w.x + taps.top_right.fitting * w.y;
    let bottom = taps.bottom_left.fitting * w.z + taps.bottom_right.fitting * w.w;
    let variances = vec4<f32>(taps.top_left.variance, taps.top_right.variance, taps.bottom_left.variance, taps.bottom_right.variance);
    let fitting = top + bottom;
    return Wide(fitting.rgb / max(fitting.a, 1e-6), fitting.a, dot(variances, w));
}

// Trust in what has been accumulated for few frames.
fn trust(length: f32) -> f32 {
    return 0.2 + 0.8 * min(1.0, length * 0.25);
}

// Vogel's disk: each tap is turned against the one before by the golden angle.
fn turned(direction: vec2<f32>) -> vec2<f32> {
    return vec2<f32>(direction.x * -0.737368878 - direction.y * 0.675490294, direction.x * 0.675490294 - direction.y * 0.737368878);
}

// rgb: filtered radiance, exposed; a: variance of the accumulated brightness.
fn filtered(pixel: vec2<u32>, guide: Guide, corners: Corners) -> vec4<f32> {
    let own = unpack_history(textureLoad(in_history, pixel, 0));
    let own_radiance = min(own.radiance * frame.exposure, vec3<f32>(HALF_MAX));
    let position = world_position(pixel, guide.depth);
    let plane = plane_within(guide, position, PIXEL_NORMAL_TOLERANCE);
    let footprint = lobe_footprint(position, guide, own.share);
    let radius = vec2<f32>(footprint.along, footprint.across) * frame.filter_scale;
    var wide: Wide;
    if WIDE_FILTER {
        wide = wide_at(pixel, block_taps(corners, pixel, plane, own.share));
    }

    let sharp = 1.0 - smoothstep(SHARP_TO, SHARP_FROM, radius.x);
    let noise_falloff = sharp * (NOISE_FALLOFF / (wide.variance + 1e-5));
    let is_noisy = guide.roughness >= OUTLIER_ROUGHNESS;
    let difference = select(1.0, min(1.0, YOUNG_DIFFERENCE + DIFFERENCE_OF_FRAME * (own.length - 1.0)), is_noisy);
    let least_fit = select(0.0, YOUNG_FIT / (own.length * own.length), is_noisy);
    let glint_axes = radius.x * (1.0 / GLINT_AXIS);
    let glint = (GLINT_LIMIT * luminance(own_radiance) + GLINT_FLOOR) * max(1.0, glint_axes * glint_axes)
        * max(1.0, GLINT_FRAMES / own.length);
    let own_brightness = brightness(own_radiance);
    var taps = NEAR_TAPS;
    if YOUNG_TAPS != NEAR_TAPS {
        taps = select(NEAR_TAPS, YOUNG_TAPS, own.length < YOUNG_LENGTH);
    }
    // A disk, of which weights make an ellipse: no axis decides between two pixels.
    let reach = min(NEAR_REACH + REACH_OF_TAP * f32(NEAR_TAPS), NEAR_MOST) * inverseSqrt(max(f32(taps), 1.0));
    // From pixels to half axes.
    let falloff = 1.0 / max(radius, vec2<f32>(NEAR_LEAST));
    let side = side_of(footprint.axis);
    let rho_x = vec2<f32>(footprint.axis.x, side.x) * falloff;
    let rho_y = vec2<f32>(footprint.axis.y, side.y) * falloff;
    var direction = vec2<f32>(1.0, 0.0);
    let by_blocks = smoothstep(WIDE_FROM, WIDE_TO, radius.x) * smoothstep(WIDE_FIT_FROM, WIDE_FIT_TO, wide.fit);
    // a: weight.
    var sum = vec4<f32>(0.0);
    // The largest luminance of taps, and the next.
    var brightest = 0.0;
    var next = 0.0;
    // Where blocks decide alone, taps would count for nothing.
    taps = select(taps, 0u, by_blocks >= 1.0);
    if taps != 0u {
        var i = 0u;
        loop {
            if YOUNG_TAPS != NEAR_TAPS {
                // None does: what Mesa needs where numbers of turns differ (kernels/README.md).
                if i >= TURNS {
                    break;
                }
            }
            i += 1u;
            let offset = round(direction * (reach * sqrt(f32(i))));
            direction = turned(direction);
            let at = vec2<i32>(pixel) + vec2<i32>(offset);
            let texel = clamp(at, vec2<i32>(0), vec2<i32>(frame.size) - 1);
            let tap = load_guide(vec2<u32>(texel));
            let history = unpack_history(textureLoad(in_history, texel, 0));
            let radiance = min(history.radiance * frame.exposure, vec3<f32>(HALF_MAX));
            let l = luminance(radiance);
            let kept = radiance * min(1.0, glint / l);
            let rho = offset.x * rho_x + offset.y * rho_y;
            let apart = (history.share - own.share) * (1.0 / SHARE_TOLERANCE);
            let brighter = brightness(radiance) - own_brightness;
            let penalty = plane_penalty(plane, tap, vec2<f32>(texel) + 0.5) + apart * apart + noise_falloff * brighter * brighter;
            // Without a length it is what `fill` left in a tile in which the guide may say anything.
            let counts = tap.denoised && history.length > 0.0 && all(at == texel) && any(at != vec2<i32>(pixel));
            let fit = exp(-penalty * difference) + least_fit;
            let w = select(0.0, trust(history.length) * exp(-dot(rho, rho)) * fit, counts);
            sum += vec4<f32>(select(vec3<f32>(0.0), kept, counts), 1.0) * w;
            let counted = select(0.0, l, counts);
            next = max(next, min(brightest, counted));
            brightest = max(brightest, counted);
            if i >= taps {
                break;
            }
        }
    }
    // What stands out alone, or in a pair, has to last: above the other taps it counts as so many times as bright as
    // frames saw it.
    let limit = min(1.0, own.length * next / luminance(own_radiance));
    let alone = select(1.0, limit, next > 0.0 && is_noisy);
    sum += vec4<f32>(own_radiance * alone, 1.0) * trust(own.length);
    let near = sum.rgb / sum.a;
    return vec4<f32>(blend(near, wide.radiance, by_blocks), wide.variance);
}

// As the caller has it.
fn without_exposure(filtered: vec4<f32>) -> vec4<f32> {
    return vec4<f32>(min(filtered.rgb * frame.inverse_exposure, vec3<f32>(HALF_MAX)), filtered.a);
}

fn store_result(pixel: vec2<u32>, result: vec4<f32>) {
    textureStore(out_output, pixel, rounded_to_half(result));
    if GBUFFER_IS_COPIED {
        var word = 0u;
        if GUIDE_IS_PACKED {
            word = repack_prev_guide(textureLoad(in_guide, pixel, 0).xy);
        } else {
            word = pack_prev_guide(load_guide(pixel));
        }
        textureStore(out_prev_guide, pixel, vec4<u32>(word, 0u, 0u, 0u));
    }
}

fn filter_pixel(pixel: vec2<u32>, corners: Corners) {
    let guide = load_guide(pixel);
    var result: vec4<f32>;
    if guide.denoised {
        result = without_exposure(filtered(pixel, guide, corners));
    } else {
        result = vec4<f32>(fallback_radiance(pixel, guide), 0.0);
    }
    store_result(pixel, result);
}

@compute @workgroup_size(64)
fn lobe_filter(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let first = listed_quad(group, lane);
    if any(first >= frame.size) {
        return;
    }
    var corners: Corners;
    if WIDE_FILTER {
        corners = corners_of(first);
    }
    var i = 0u;
    loop {
        filter_pixel(min(first + position_in_quad(i), frame.size - 1u), corners);
        i += 1u;
        if i >= QUAD_PIXELS {
            break;
        }
    }
}
