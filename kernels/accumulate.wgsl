//! Accumulate: finds history where the surface was and where what it reflects was, mixes both softly, and adds this
//! frame's sample with the weight of one frame among many.
//!
//! in   radiance      any float    full    noisy input; a: hit distance
//! in   motion        any float    full    uv motion of the surface (surface motion)
//! in   hit_motion    any float    full    how far what was hit has moved (hit motion)
//! in   guide         rg32uint     full    this frame's packed G-buffer, or normal, roughness, depth
//! in   prev_guide    r32uint      full    last frame's, in fewer bits, or its normal, roughness, depth
//! in   history       rgba16float  full    last frame's `history`
//! in   blocks        rgba32uint   block   of the input: statistics, outliers' excess spread (block statistics)
//! in   samples       rg32uint     block   second and third largest luminance (outlier spread)
//! in   light         r32uint      block   whether the light changed (light change)
//! in   tiles, args   lists                tiles to denoise, or blocks (whole blocks)
//! out  history       rgba16float  full    accumulated radiance, its length, noise and hit share
//!
//! Grid: an invocation for each 2x2 pixels; one workgroup per 4 listed tiles or 16 listed blocks (indirect). Loads for each
//! of them 9 guides, 8 histories (one history: 5 and 4), a radiance and 4 blocks, for all four 16 more radiances at most and,
//! without interpolation, the only block.
//! After: accumulation as in Schied et al. 2017 (SVGF); reflected points after Lagarde and de Rousiers 2014 (dominant
//! direction of the lobe). The two candidates are mixed by how well each fits the blocks of this frame; how far they
//! lie apart, against the footprint, bounds what history is worth.

import package::shared::frame;
import package::shared::packing;
import package::shared::gbuffer;
import package::shared::radiance;
import package::shared::outliers;
import package::shared::listed;
import package::shared::tiles;
import package::shared::footprint;
import package::shared::history;
import package::shared::blocks;
import package::shared::light;

// Looks for history where the reflected point was, seen in the surface.
override MIRROR_PARALLAX: bool = true;
// Looks for history where the surface was.
override SURFACE_MOTION: bool = true;
// Looks in both places for each pixel.
override BOTH_HISTORIES: bool = true;
// Moves the reflected point back to where it was.
override HIT_MOTION: bool = false;
// Clips history of smooth surfaces to what the neighbourhood makes plausible.
override HISTORY_CLIP: bool = false;
// Forgets history where the light changed.
override LIGHT_CHANGE: bool = true;
// Cuts outliers off and adds what was cut off, spread.
override OUTLIER_SPREAD: bool = true;
// There are blocks of this frame's input to compare with.
override BLOCK_STATISTICS: bool = true;
// How many of those around a pixel: all 4, or 1, the one it is in.
override BLOCK_TAPS: u32 = 4u;

@group(0) @binding(5) var in_motion: texture_2d<f32>;
@group(0) @binding(7) var in_hit_motion: texture_2d<f32>;

@group(1) @binding(1) var in_prev_guide: texture_2d<u32>;
@group(1) @binding(2) var in_history: texture_2d<f32>;
@group(1) @binding(3) var in_blocks: texture_2d<u32>;
@group(1) @binding(4) var in_samples: texture_2d<u32>;
@group(1) @binding(5) var in_light: texture_2d<u32>;
@group(1) @binding(6) var out_history: texture_storage_2d<rgba16float, write>;

// Share of the blocks around a pixel that has to show its surface.
const FIT: f32 = 0.2;
// Roughness from and to which the surface's motion takes over from the reflected point's, and beyond which the
// reflected point's alone is worth nothing.
const SURFACE_FROM: f32 = 0.05;
const SURFACE_TO: f32 = 0.4;
const REFLECTION_UP_TO: f32 = 0.6;
// Roughness from which, of the two, history is looked for where the surface was.
const ONE_BY_SURFACE_FROM: f32 = 0.1;
// A sample so many times as bright as its surroundings has hit what few rays hit: that its hit distance is another
// than history's is no reason to forget history.
const RARE: f32 = 2.0;
// Weight of a mirror's own sample against the window that bounds its history, and roughness from which it has none extra:
// lamps in mirrors have edges, and the deviation across an edge bounds nothing.
const MIRROR_WEIGHT: f32 = 2.25;
const MIRROR_UP_TO: f32 = 0.03;

// Outliers of which there are two count up to so many times what bounds single ones, against the third sample of their
// block and history. What is above is lost.
const PAIR_FACTOR: f32 = 12.0;
// Luminance up to which, exposed, both are as good as black, and nothing to count against: twice the least that `luminance`
// says.
const BLACK: f32 = 0.002;
// History counts up to so many times what bounds single outliers, against the blocks around, for each frame that it
// holds, from this roughness on: below, what lobes see has edges.
const UNSEEN_FACTOR: f32 = 2.0;
const UNSEEN_FROM: f32 = 0.1;
// Deviation that a sample counts as having of which no block says one.
const ALONE_DEVIATION: f32 = 0.1;

// What the blocks around a pixel say about its surface.
struct Surroundings {
    mean: vec3<f32>,
    share: f32,
    // What may come back of outliers, and how far one frame's is to be believed.
    excess: vec3<f32>,
    certainty: f32,
    deviation: f32,
    // How well they fit, 0 to 1.
    fit: f32,
}

fn surroundings_of(pixel: vec2<u32>, plane: Plane, own: vec4<u32>) -> Surroundings {
    var sum: Surroundings;
    var weight = 1e-6;
    for (var i = 0u; i < BLOCK_TAPS; i++) {
        var corner = Corner(vec2<i32>(pixel / BLOCK_SIZE), 1.0);
        var texel = own;
        if BLOCK_TAPS == 4u {
            corner = corner_of(pixel, i);
            texel = textureLoad(in_blocks, corner.block, 0);
        }
        let tap = unpack_block(texel);
        // The least weights are for pixels whose surface no block shows.
        let fit = exp(-plane_penalty(plane, tap.guide, block_place(corner.block))) + 1e-5;
        let w = select(0.0, (corner.weight + 1e-3) * fit, tap.guide.denoised);
        sum.mean += tap.radiance * w;
        sum.share += tap.share * w;
        sum.excess += tap.excess * w;
        sum.certainty += tap.certainty * w;
        sum.deviation += tap.deviation * w;
        weight += w;
    }
    let normalization = 1.0 / weight;
    sum.mean *= normalization;
    sum.share *= normalization;
    sum.excess *= normalization;
    sum.certainty *= normalization;
    sum.deviation *= normalization;
    sum.fit = smoothstep(0.0, FIT, weight);
    if OUTLIER_SPREAD {
        sum.excess *= sum.fit * min(1.0, frame.excess_limit * luminance(sum.mean) / luminance(sum.excess));
    }
    return sum;
}

// What the pixels of a quad share.
struct Quad {
    // Texel of the block that it is in.
    block: vec4<u32>,
    // The second and third largest luminance there.
    peaks: vec2<f32>,
}

fn quad_of(pixel: vec2<u32>) -> Quad {
    let place = pixel / BLOCK_SIZE;
    var quad: Quad;
    if BLOCK_STATISTICS {
        quad.block = textureLoad(in_blocks, place, 0);
    }
    if OUTLIER_SPREAD {
        quad.peaks = unpack_samples(textureLoad(in_samples, place, 0).xy).peaks;
    }
    return quad;
}

// The sample of this frame, exposed, without what makes it an outlier.
fn sample_of(pixel: vec2<u32>, guide: Guide, quad: Quad) -> vec3<f32> {
    let radiance = load_radiance(pixel);
    if OUTLIER_SPREAD {
        return without_outlier(radiance, quad.peaks.x, guide.roughness);
    }
    return radiance;
}

// What comes back of the outliers around. What is rare would come back as blotches, and does so as frames bear it out.
fn returned_excess(around: Surroundings, length: f32, roughness: f32) -> vec3<f32> {
    let borne_out = around.certainty * (length + 1.0) / (around.certainty * length + 1.0);
    return select(around.excess * borne_out, vec3<f32>(0.0), roughness < OUTLIER_ROUGHNESS);
}

// What last frame had at some place.
struct Found {
    radiance: vec3<f32>,
    length: f32,
    share: f32,
    is_valid: bool,
}

fn nothing_found() -> Found {
    return Found(vec3<f32>(0.0), 0.0, 0.0, false);
}

fn mix_found(a: Found, b: Found, t: f32) -> Found {
    return Found(blend(a.radiance, b.radiance, t), mix(a.length, b.length, t), mix(a.share, b.share, t), true);
}

// How far a tap may be from the surface it is history of.
struct Tolerance {
    // Distance from its plane, as a share of depth.
    plane: f32,
    // Least cosine between normals.
    cosine: f32,
    // Difference of hit share.
    share: f32,
}

fn load_prev_guide(texel: vec2<i32>) -> Guide {
    if GBUFFER_IS_COPIED {
        return unpack_prev_guide(textureLoad(in_prev_guide, texel, 0).x);
    }
    return decode_prev_guide(texel);
}

fn squeezed(c: vec3<f32>) -> vec3<f32> {
    return c / (1.0 + c);
}

// Distance of history from what the blocks show, in their deviations.
fn misfit(history: vec3<f32>, around: Surroundings) -> f32 {
    let d = abs(squeezed(history) - squeezed(around.mean));
    return (d.x + d.y + d.z) / (around.deviation + 0.02);
}

// Weights of the pixels of a window together.
const WINDOW_WEIGHT: f32 = 64.0;

// Squeezed radiance of the 4x4 pixels around a quad, those of the quad most.
struct Window {
    is_known: bool,
    mean: vec3<f32>,
    mean_square: vec3<f32>,
}

// Looked at once for all pixels of a quad, whose first is `pixel`, if one is smooth.
fn window_around(pixel: vec2<u32>, is_wanted: bool, known: Window) -> Window {
    var window = known;
    let count = select(0u, BLOCK_PIXELS, is_wanted && !known.is_known);
    let corner = vec2<i32>(pixel) - 1;
    for (var i = 0u; i < count; i++) {
        let place = position_in_block(i);
        let at = clamp(corner + vec2<i32>(place), vec2<i32>(0), vec2<i32>(frame.size) - 1);
        let c = squeezed(load_radiance(vec2<u32>(at)));
        // 1 at the sides, 3 within.
        let w = vec2<f32>(1u + ((place + 1u) & vec2<u32>(2u)));
        let share = w.x * w.y / WINDOW_WEIGHT;
        window.mean += c * share;
        window.mean_square += c * c * share;
    }
    window.is_known = known.is_known || is_wanted;
    return window;
}

// Moves history towards the mean of a window where it is beyond its deviation.
fn clipped(history: vec3<f32>, own: vec3<f32>, window: Window, roughness: f32) -> vec3<f32> {
    let weight = MIRROR_WEIGHT * (1.0 - smoothstep(0.0, MIRROR_UP_TO, roughness));
    let c_own = squeezed(own);
    let normalization = 1.0 / (1.0 + weight);
    let mean = (window.mean + c_own * weight) * normalization;
    let variance = max((window.mean_square + c_own * c_own * weight) * normalization - mean * mean, vec3<f32>(0.0));
    let extent = sqrt(variance) * frame.accumulate_clip_scale + 0.02;
    let c = clamp(squeezed(history), max(mean - extent, vec3<f32>(0.0)), min(mean + extent, vec3<f32>(0.9999)));
    return c / (1.0 - c);
}

// Where the surface was.
fn surface_prev_uv(pixel: vec2<u32>) -> vec2<f32> {
    let motion = textureLoad(in_motion, pixel, 0).xy * frame.motion_scale + frame.motion_offset;
    let uv = pixel_uv(pixel) - motion;
    let usable = is_finite(uv.x) && is_finite(uv.y);
    return select(vec2<f32>(-4.0), clamp(uv, vec2<f32>(-4.0), vec2<f32>(4.0)), usable);
}

// How far the reflected point moved, behind its surface. The closer the lobe's dominant direction is to the normal, the
// less what moves along the normal moves the image.
fn image_motion(pixel: vec2<u32>, normal: vec3<f32>, dominant: f32) -> vec3<f32> {
    let moved = textureLoad(in_hit_motion, pixel, 0).xyz;
    let usable = select(vec3<f32>(0.0), moved, all_finite(moved));
    return usable - normal * ((1.0 + dominant) * dot(usable, normal));
}

// What history is looked for: a pixel, or a whole block.
struct Subject {
    guide: Guide,
    position: vec3<f32>,
    around: Surroundings,
    // This frame's sample, exposed.
    radiance: vec3<f32>,
    // Hit share.
    share: f32,
    is_whole: bool,
}

// Blends those of four texels that show the surface. The plane test is done with last frame's depths where that camera
// saw them, so that a camera that moves forward does not fail it.
fn history_at(prev_uv: vec2<f32>, subject: Subject, tolerance: Tolerance) -> Found {
    let guide = subject.guide;
    let size = vec2<f32>(frame.prev_size);
    let place = prev_uv * size;
    if !(all(place > vec2<f32>(0.0)) && all(place < size)) {
        return nothing_found();
    }
    // Distance from the plane of the surface of a place in last frame's pixels.
    let offset_of_plane = vec4<f32>(0.0, 0.0, 0.0, dot(guide.normal, subject.position));
    let plane = vec4<f32>(guide.normal, 0.0) * frame.world_from_prev_pixel - offset_of_plane;
    // Of whole blocks, the mean of where their quarters were: history that is the same over a block moves by part of one.
    let stride = select(1.0, 2.0, subject.is_whole);
    let base = floor(place - 0.5 * stride);
    // In steps: of a still image the rest is rounding, which would leak light from lamps.
    let fraction = select(round((place - 0.5 - base) * 256.0) * (1.0 / 256.0), vec2<f32>(0.5), subject.is_whole);
    let last = vec2<i32>(frame.prev_size) - 1;
    var radiance = vec3<f32>(0.0);
    var length_and_share = vec2<f32>(0.0);
    var weight = 0.0;
    for (var i = 0u; i < 4u; i++) {
        let offset = vec2<u32>(i & 1u, i >> 1u);
        let texel = clamp(vec2<i32>(base) + vec2<i32>(vec2<f32>(offset) * stride), vec2<i32>(0), last);
        let tap = load_prev_guide(texel);
        let history = unpack_history(textureLoad(in_history, texel, 0));
        let w_of_tap = frame.prev_clip_w.x + frame.prev_clip_w.y * tap.depth;
        let from_plane = dot(plane, vec4<f32>((vec2<f32>(texel) + 0.5) * w_of_tap, tap.depth, 1.0));
        let is_same = tap.denoised
            && abs(from_plane) < tolerance.plane * guide.depth
            && dot(tap.normal, guide.normal) > tolerance.cosine
            && abs(tap.roughness - guide.roughness) <= 0.5 * guide.roughness + 0.15
            && abs(history.share - subject.share) < tolerance.share
            && history.length > 0.0;
        let bilinear = select(1.0 - fraction, fraction, offset == vec2<u32>(1u));
        let w = select(0.0, bilinear.x * bilinear.y, is_same);
        radiance += select(vec3<f32>(0.0), history.radiance, is_same) * w;
        length_and_share += vec2<f32>(history.length, history.share) * w;
        weight += w;
    }
    if weight < 0.02 {
        return nothing_found();
    }
    let normalization = 1.0 / weight;
    let exposed = min(radiance * (normalization * frame.exposure), vec3<f32>(HALF_MAX));
    return Found(exposed, length_and_share.x * normalization, length_and_share.y * normalization, true);
}

// What a pixel knows of its surroundings by itself: the sample, and nothing about hit distances.
fn alone(pixel: vec2<u32>) -> Surroundings {
    return Surroundings(load_radiance(pixel), 0.5, vec3<f32>(0.0), 0.0, ALONE_DEVIATION, 0.0);
}

fn subject_of(pixel: vec2<u32>, guide: Guide, quad: Quad) -> Subject {
    let position = world_position(pixel, guide.depth);
    var around: Surroundings;
    if BLOCK_STATISTICS {
        around = surroundings_of(pixel, plane_of(guide, position), quad.block);
    } else {
        around = alone(pixel);
    }
    let distance = usable_hit_distance(textureLoad(in_radiance, pixel, 0).a);
    let own_share = select(around.share, hit_share(distance, camera_distance_of(position)), distance > 0.0);
    // Single hit distances of rough surfaces say little, and go with the colour of their sample.
    let share = mix(own_share, around.share, smoothstep(0.03, 0.2, guide.roughness) * around.fit);
    return Subject(guide, position, around, sample_of(pixel, guide, quad), share, false);
}

// The two histories that a pixel can have, and where they were last frame.
struct Candidates {
    surface_uv: vec2<f32>,
    surface: Found,
    reflection_uv: vec2<f32>,
    reflection: Found,
}

fn candidates_of(pixel: vec2<u32>, subject: Subject) -> Candidates {
    let r = subject.guide.roughness;
    let static_uv = prev_uv_of(subject.position);
    let is_rare = r >= OUTLIER_ROUGHNESS && luminance(subject.radiance) > RARE * luminance(subject.around.mean);
    let share_tolerance = select(0.08 + 6.0 * r, 1.0, is_rare);
    var found = Candidates(static_uv, nothing_found(), vec2<f32>(-1.0), nothing_found());
    // Where it is not where the camera's motion alone would put it, something else moved the surface.
    var moves = false;
    var by_surface: Tolerance;
    if SURFACE_MOTION {
        found.surface_uv = surface_prev_uv(pixel);
        moves = length((found.surface_uv - static_uv) * vec2<f32>(frame.size)) > 0.5;
        by_surface = Tolerance(select(0.01, 0.1, moves), select(0.9, 0.7, moves), share_tolerance);
        if BOTH_HISTORIES || !MIRROR_PARALLAX {
            found.surface = history_at(found.surface_uv, subject, by_surface);
        }
    }
    if MIRROR_PARALLAX {
        let alpha = alpha_of(r);
        // The lobe's dominant direction is nearer to the normal the rougher the surface is.
        let dominant = (1.0 - alpha) * (sqrt(1.0 - alpha) + alpha);
        let distance = hit_distance_of(subject.share, camera_distance_of(subject.position)) * dominant;
        let image = subject.position + view_direction(subject.position) * distance;
        let surface_moved = found.surface_uv - static_uv;
        found.reflection_uv = prev_uv_of(image) + surface_moved;
        if HIT_MOTION {
            found.reflection_uv = prev_uv_of(image - image_motion(pixel, subject.guide.normal, dominant)) + surface_moved;
        }
        var place = found.reflection_uv;
        var tolerance = Tolerance(select(0.015, 0.1, moves), select(0.98, 0.95, r >= 0.3), share_tolerance);
        let is_by_surface = SURFACE_MOTION && !BOTH_HISTORIES && r >= ONE_BY_SURFACE_FROM;
        if is_by_surface {
            place = found.surface_uv;
            tolerance = by_surface;
        }
        let history = history_at(place, subject, tolerance);
        if is_by_surface {
            found.surface = history;
        } else {
            found.reflection = history;
        }
    }
    return found;
}

// How much of the reflected point's history is in the mixture where there are both.
fn reflection_weight(candidates: Candidates, subject: Subject) -> f32 {
    let difference = misfit(candidates.reflection.radiance, subject.around) - misfit(candidates.surface.radiance, subject.around);
    let favour = min(1.0, 2.0 / (1.0 + exp(clamp(difference, -8.0, 8.0))));
    return favour * (1.0 - smoothstep(SURFACE_FROM, SURFACE_TO, subject.guide.roughness));
}

// History by both motions, its length bounded by what it is worth.
fn chosen(candidates: Candidates, subject: Subject) -> Found {
    let r = subject.guide.roughness;
    let surface = candidates.surface;
    var cap = mix(frame.accumulate_mirror_history, frame.accumulate_max_history, smoothstep(0.0, frame.accumulate_clip_roughness, r));
    var found = surface;
    if MIRROR_PARALLAX {
        let reflection = candidates.reflection;
        let apart = max(length((candidates.reflection_uv - candidates.surface_uv) * vec2<f32>(frame.size)), 1e-3);
        let radius = lobe_footprint(subject.position, subject.guide, subject.share).along;
        let worth = 1.0 + frame.disagreement_limit * (radius + 1.0) / apart;
        if !surface.is_valid {
            found = reflection;
            found.is_valid = reflection.is_valid && r < REFLECTION_UP_TO;
            cap = select(cap, min(cap, worth), SURFACE_MOTION && !BOTH_HISTORIES);
        } else if !BOTH_HISTORIES {
            cap = min(cap, worth);
        } else if reflection.is_valid {
            found = mix_found(surface, reflection, reflection_weight(candidates, subject));
            cap = min(cap, worth);
        } else {
            cap = min(cap, (radius + 0.5) / apart);
        }
    }
    found.length = select(0.0, min(found.length, cap), found.is_valid);
    return found;
}

// History, as far as this frame bears it out.
fn believed(history: Found, subject: Subject, light_change: f32, window: Window) -> Found {
    let roughness = subject.guide.roughness;
    var found = history;
    if LIGHT_CHANGE {
        found.length *= 1.0 - light_change * smoothstep(0.05, 0.2, roughness);
    }
    if HISTORY_CLIP {
        let bounded = clipped(found.radiance, subject.radiance, window, roughness);
        found.radiance = select(found.radiance, bounded, roughness < frame.accumulate_clip_roughness);
    }
    if OUTLIER_SPREAD {
        // What one frame saw, and none sees again.
        let seen = UNSEEN_FACTOR * frame.outlier_factor * found.length * luminance(subject.around.mean);
        let bound = min(1.0, seen / luminance(found.radiance));
        found.radiance *= select(1.0, bound, roughness >= UNSEEN_FROM);
    }
    return found;
}

// Luminance above which a sample is one of two outliers in a block, which hide each other.
fn pair_limit(quad: Quad, found: Found) -> f32 {
    let known = max(quad.peaks.y, luminance(found.radiance));
    return select(HALF_MAX, PAIR_FACTOR * frame.outlier_factor * known, known > BLACK);
}

fn without_pair(radiance: vec3<f32>, pair_limit: f32, roughness: f32) -> vec3<f32> {
    let limit = min(1.0, pair_limit / luminance(radiance));
    return radiance * select(1.0, limit, roughness >= OUTLIER_ROUGHNESS);
}

fn squared_residual(radiance: vec3<f32>, found: Found) -> f32 {
    let residual = brightness(radiance) - brightness(found.radiance);
    return residual * residual;
}

// History with this frame's radiance.
fn continued(found: Found, radiance: vec3<f32>, share: f32, squared_residual: f32) -> History {
    let rate = 1.0 / (found.length + 1.0);
    var history: History;
    history.radiance = blend(found.radiance, radiance, rate) * frame.inverse_exposure;
    history.length = found.length + 1.0;
    history.share = select(share, mix(found.share, share, max(rate, 0.1)), found.length > 0.0);
    // The residual has the variance of the sample and of the history; what is left of both after mixing.
    history.noise = select(-1.0, squared_residual * found.length * rate * rate, found.length >= 0.5);
    return history;
}

fn accumulated(pixel: vec2<u32>, guide: Guide, quad: Quad, light_change: f32, window: Window) -> History {
    let subject = subject_of(pixel, guide, quad);
    let found = believed(chosen(candidates_of(pixel, subject), subject), subject, light_change, window);
    var radiance = subject.radiance;
    if OUTLIER_SPREAD {
        radiance += returned_excess(subject.around, found.length, guide.roughness);
        radiance = without_pair(radiance, pair_limit(quad, found), guide.roughness);
    }
    return continued(found, radiance, subject.share, squared_residual(radiance, found));
}

// Whether the light changed around a pixel, 0 to 1.
fn light_change_at(pixel: vec2<u32>) -> f32 {
    if LIGHT_CHANGE {
        return unpack_light(textureLoad(in_light, pixel / BLOCK_SIZE, 0).x).changed;
    }
    return 0.0;
}

@compute @workgroup_size(64)
fn accumulate(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let first = listed_quad(group, lane);
    if any(first >= frame.size) {
        return;
    }
    let quad = quad_of(first);
    let light_change = light_change_at(first);
    var window: Window;
    var i = 0u;
    loop {
        let pixel = min(first + position_in_quad(i), frame.size - 1u);
        let guide = load_guide(pixel);
        if HISTORY_CLIP {
            let is_clipped = guide.denoised && guide.roughness < frame.accumulate_clip_roughness;
            window = window_around(first, is_clipped, window);
        }
        var history = History(vec3<f32>(0.0), 0.0, 0.0, -1.0);
        if guide.denoised {
            history = accumulated(pixel, guide, quad, light_change, window);
        }
        textureStore(out_history, pixel, pack_history(history));
        i += 1u;
        if i >= QUAD_PIXELS {
            break;
        }
    }
}
