//! Reproject: finds where each reflection was last frame, how far that history can be trusted, how long it is
//! and how much it varies; averages each 8x8 tile.
//!
//! in   radiance       any float     full   noisy input; a: hit distance
//! in   motion         any float     full   uv motion of the surface
//! in   guide          rg32uint      full   this frame's packed G-buffer, or normal, roughness, depth
//! in   prev_guide     rg32uint      full   last frame's, or its normal, roughness, depth
//! in   history        rgba16float   full   last frame's output; a: variance
//! in   prev_signal    rg32uint      full   last frame's `reprojected`, for the history length
//! in   tiles, args    lists         tiles to denoise
//! out  reprojected    rg32uint      full   packed history radiance, its length and variance
//! out  average        rgba16float   tile   rgb: average radiance; a: 1
//!
//! Grid: one 8x8 workgroup per listed tile (indirect). 18 taps of workgroup memory for the 9x9 statistics;
//! 8 guide, 4 history and 4 length loads; where the first guess fails 36 to 40 more guide and 4 to 8 more
//! history loads.
//! After: reprojection of the AMD FidelityFX denoiser 1.2 (2021). Differs: see "Deviations" in docs/reference.md.

import package::shared::frame;
import package::shared::packing;
import package::shared::gbuffer;
import package::shared::radiance;
import package::shared::tiles;
import package::shared::neighborhood;

// Looks for history where the reflected point was, seen in the surface.
override MIRROR_PARALLAX: bool = true;
// Looks for history where the surface was.
override SURFACE_MOTION: bool = true;
// Looks around a place that does not fit well.
override HISTORY_SEARCH: bool = true;
// Takes those of four texels that fit where not all do.
override EDGE_REPAIR: bool = true;
// Some later pass uses the 8x8 averages.
override AVERAGE_IS_USED: bool = true;

@group(0) @binding(5) var in_motion: texture_2d<f32>;

@group(1) @binding(1) var in_prev_guide: texture_2d<u32>;
@group(1) @binding(2) var in_history: texture_2d<f32>;
@group(1) @binding(3) var in_prev_signal: texture_2d<u32>;
@group(1) @binding(4) var<storage, read> in_tiles: array<u32>;
@group(1) @binding(5) var<storage, read> in_args: array<vec4<u32>, 4>;
@group(1) @binding(6) var out_reprojected: texture_storage_2d<rg32uint, write>;
@group(1) @binding(7) var out_average: texture_storage_2d<rgba16float, write>;

// The four texels around a place in last frame's image.
struct Footprint {
    base: vec2<i32>,
    weights: vec4<f32>,
}

fn footprint_at(prev_uv: vec2<f32>) -> Footprint {
    let texel = prev_uv * vec2<f32>(frame.prev_size) - 0.5;
    let f = texel - floor(texel);
    var footprint: Footprint;
    footprint.base = vec2<i32>(floor(texel));
    footprint.weights = vec4<f32>((1.0 - f.x) * (1.0 - f.y), f.x * (1.0 - f.y), (1.0 - f.x) * f.y, f.x * f.y);
    return footprint;
}

fn footprint_texel(footprint: Footprint, corner: u32) -> vec2<i32> {
    let texel = footprint.base + vec2<i32>(vec2<u32>(corner & 1u, corner >> 1u));
    return clamp(texel, vec2<i32>(0), vec2<i32>(frame.prev_size) - 1);
}

// Whether last frame shows a place. Never when there is no usable history: its size is 0 then. (A branch on
// constants alone would make Mesa's lavapipe compile the kernel anew in every frame.)
fn is_on_prev_screen(prev_uv: vec2<f32>) -> bool {
    let size = vec2<f32>(frame.prev_size);
    let position = prev_uv * size;
    return all(position > vec2<f32>(0.0)) && all(position < size);
}

fn load_prev_guide(texel: vec2<i32>) -> Guide {
    if GBUFFER_IS_COPIED {
        return unpack_guide(textureLoad(in_prev_guide, texel, 0).xy);
    }
    return decode_prev_guide(texel);
}

// Surface of last frame around a place. Inverse depth is blended, being linear on screen.
struct PrevSurface {
    normal: vec3<f32>,
    depth: f32,
    alpha: f32,
    // The texels around the place; those without a reflection have no weight.
    reflections: Footprint,
}

fn prev_surface_at(prev_uv: vec2<f32>) -> PrevSurface {
    let footprint = footprint_at(prev_uv);
    var reflections = footprint;
    var normal = vec3<f32>(0.0);
    var inverse_depth = 0.0;
    var alpha = 0.0;
    for (var i = 0u; i < 4u; i++) {
        let tap = load_prev_guide(footprint_texel(footprint, i));
        let w = footprint.weights[i];
        // The sky has no normal.
        normal += select(w, 0.0, tap.depth >= SKY_DEPTH) * tap.normal;
        inverse_depth += w / tap.depth;
        alpha += w * alpha_of(tap.roughness);
        reflections.weights[i] = select(0.0, w, tap.denoised);
    }
    return PrevSurface(normal * inverseSqrt(max(dot(normal, normal), 1e-12)), 1.0 / inverse_depth, alpha, reflections);
}

// rgb: history radiance, exposed; a: its variance.
fn history_at(reflections: Footprint) -> vec4<f32> {
    var sum = vec4<f32>(0.0);
    for (var i = 0u; i < 4u; i++) {
        // Multiplying would let whatever a texel without a reflection holds through, if that is not finite.
        if reflections.weights[i] > 0.0 {
            sum += reflections.weights[i] * textureLoad(in_history, footprint_texel(reflections, i), 0);
        }
    }
    let history = sum / max(dot(reflections.weights, vec4<f32>(1.0)), 1e-6);
    return vec4<f32>(history.rgb * frame.exposure, history.a);
}

fn history_length_at(reflections: Footprint) -> f32 {
    var sum = 0.0;
    for (var i = 0u; i < 4u; i++) {
        let texel = textureLoad(in_prev_signal, footprint_texel(reflections, i), 0).xy;
        sum += reflections.weights[i] * unpack_reprojected(texel).length;
    }
    return sum;
}

// Keeps coordinates that are NaN or far off screen from reaching integer conversion.
fn contained_uv(uv: vec2<f32>) -> vec2<f32> {
    return select(vec2<f32>(-1.0), clamp(uv, vec2<f32>(-1.0), vec2<f32>(2.0)), is_finite(uv.x) && is_finite(uv.y));
}

// Where the surface was.
fn surface_prev_uv(pixel: vec2<u32>) -> vec2<f32> {
    let motion = textureLoad(in_motion, pixel, 0).xy * frame.motion_scale + frame.motion_offset;
    return contained_uv(pixel_uv(pixel) - motion);
}

// Where the reflected point was, as if it lay straight behind the surface by the hit distance.
fn parallax_prev_uv(pixel: vec2<u32>, guide: Guide, hit_distance: f32) -> vec2<f32> {
    let surface = world_position(pixel, guide.depth);
    let image = surface + view_direction(surface) * hit_distance;
    let projected = frame.prev_uv_from_world * vec4<f32>(image, 1.0);
    if !(projected.w > 0.0) {
        return vec2<f32>(-1.0);
    }
    return contained_uv(projected.xy / projected.w - frame.jitter_uv);
}

// 1 where history belongs to the same surface, towards 0 as normal and depth disagree.
fn disocclusion_factor(guide: Guide, normal: vec3<f32>, depth: f32) -> f32 {
    let normal_error = abs(1.0 - max(0.0, dot(guide.normal, normal)));
    let depth_error = abs(depth - guide.depth) / guide.depth;
    return exp(-frame.disocclusion_normal_falloff * normal_error) * exp(-frame.disocclusion_depth_falloff * depth_error);
}

struct Match {
    prev_uv: vec2<f32>,
    // Trust, 0 to 1; negative when there is no match.
    factor: f32,
    reflections: Footprint,
    // rgb: radiance; a: variance.
    history: vec4<f32>,
}

fn no_match() -> Match {
    return Match(vec2<f32>(-1.0), -1.0, Footprint(vec2<i32>(0), vec4<f32>(0.0)), vec4<f32>(0.0));
}

fn match_at(prev_uv: vec2<f32>, guide: Guide, surface: PrevSurface) -> Match {
    let factor = disocclusion_factor(guide, surface.normal, surface.depth);
    return Match(prev_uv, factor, surface.reflections, history_at(surface.reflections));
}

// One of the two candidates, or none, by last frame's normal, roughness and colour.
fn choose_candidate(pixel: vec2<u32>, lane: u32, guide: Guide, hit_distance: f32) -> Match {
    let alpha = alpha_of(guide.roughness);
    var surface_uv = vec2<f32>(-1.0);
    var surface: PrevSurface;
    // Off screen it fits as badly as can be.
    var surface_cosine = -1.0;
    var surface_alpha_error = 1.0;
    if SURFACE_MOTION {
        surface_uv = surface_prev_uv(pixel);
        if is_on_prev_screen(surface_uv) {
            surface = prev_surface_at(surface_uv);
            surface_cosine = dot(guide.normal, surface.normal);
            surface_alpha_error = abs(surface.alpha - alpha);
        }
    }
    if MIRROR_PARALLAX {
        let parallax_uv = parallax_prev_uv(pixel, guide, hit_distance);
        if is_on_prev_screen(parallax_uv) {
            let parallax = prev_surface_at(parallax_uv);
            let parallax_cosine = dot(guide.normal, parallax.normal);
            if parallax_cosine > frame.parallax_normal_cosine
                && parallax_cosine + frame.parallax_normal_margin > surface_cosine
                && abs(parallax.alpha - alpha) < surface_alpha_error + frame.parallax_roughness_margin {
                return match_at(parallax_uv, guide, parallax);
            }
        }
    }
    if SURFACE_MOTION {
        if is_on_prev_screen(surface_uv) {
            let found = match_at(surface_uv, guide, surface);
            let statistics = neighborhood_statistics(lane);
            let difference = found.history.rgb - statistics.mean;
            if dot(difference, difference) < frame.surface_color_gate * length(statistics.variance) {
                return found;
            }
        }
    }
    return no_match();
}

// The best of the 3x3 places around a match.
fn search_around(guide: Guide, found: Match) -> Match {
    var best = found;
    for (var i = 0; i < 9; i++) {
        let offset = vec2<f32>(vec2<i32>(i % 3, i / 3) - 1);
        let uv = found.prev_uv + offset / vec2<f32>(frame.prev_size);
        let surface = prev_surface_at(uv);
        let factor = disocclusion_factor(guide, surface.normal, surface.depth);
        if factor > best.factor {
            best.factor = factor;
            best.prev_uv = uv;
            best.reflections = surface.reflections;
        }
    }
    best.history = history_at(best.reflections);
    return best;
}

// Only those of the four texels that show the same surface.
fn repair_edge(guide: Guide, found: Match) -> Match {
    let footprint = footprint_at(found.prev_uv);
    var fitting = found.reflections;
    var weight_sum = 0.0;
    var normal = vec3<f32>(0.0);
    var depth = 0.0;
    for (var i = 0u; i < 4u; i++) {
        let tap = load_prev_guide(footprint_texel(footprint, i));
        let factor = disocclusion_factor(guide, tap.normal, tap.depth);
        if factor > frame.disocclusion_threshold * frame.disocclusion_tap_fraction {
            let w = footprint.weights[i];
            weight_sum += w;
            normal += w * tap.normal;
            depth += w * tap.depth;
        } else {
            fitting.weights[i] = 0.0;
        }
    }
    let normalization = 1.0 / max(weight_sum, 0.001);
    var repaired = found;
    repaired.history = vec4<f32>(history_at(fitting).rgb, found.history.a);
    repaired.factor = disocclusion_factor(guide, normal * normalization, depth * normalization);
    return repaired;
}

fn find_history(pixel: vec2<u32>, lane: u32, guide: Guide, hit_distance: f32) -> Match {
    var found = choose_candidate(pixel, lane, guide, hit_distance);
    if found.factor >= 0.0 && found.factor < frame.disocclusion_threshold {
        if HISTORY_SEARCH {
            found = search_around(guide, found);
        }
        if EDGE_REPAIR {
            if found.factor < frame.disocclusion_threshold {
                found = repair_edge(guide, found);
            }
        }
    }
    let has_reflection = dot(found.reflections.weights, vec4<f32>(1.0)) > 0.001;
    if found.factor >= frame.disocclusion_threshold && has_reflection && is_on_prev_screen(found.prev_uv) {
        return found;
    }
    return no_match();
}

// Frames of history that are worth keeping: fewer on smoother surfaces.
fn history_cap(alpha: f32) -> f32 {
    return max(frame.min_history_cap, frame.max_history * (1.0 - exp(-frame.history_roughness_falloff * alpha)));
}

@compute @workgroup_size(8, 8)
fn reproject(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let index = list_index(group);
    if index >= in_args[0].w {
        return;
    }
    let tile = unpack_tile(in_tiles[index]);
    let pixel = tile * TILE_SIZE + lane_position(lane);
    // Only the colour of surface motion is compared with the neighbourhood's.
    if SURFACE_MOTION {
        for (var i = 0u; i < 4u; i++) {
            let entry = lane + 64u * i;
            let p = window_pixel(tile, entry);
            var radiance = vec3<f32>(0.0);
            var counts = false;
            if all(p >= vec2<i32>(0)) && all(p < vec2<i32>(frame.size)) {
                counts = is_denoised(vec2<u32>(p));
                radiance = load_radiance(vec2<u32>(p));
            }
            store_window(entry, radiance, counts);
        }
        workgroupBarrier();
        sum_rows(lane);
        workgroupBarrier();
    }

    // rgb: weighted radiance, a: weight in the average of the tile.
    var contribution = vec4<f32>(0.0);
    if all(pixel < frame.size) {
        let guide = load_guide(pixel);
        var reprojected = Reprojected(vec3<f32>(0.0), 0.0, 0.0);
        if guide.denoised {
            var radiance = load_radiance(pixel);
            let hit_distance = textureLoad(in_radiance, pixel, 0).a;
            reprojected.length = 1.0;
            reprojected.variance = 1.0;
            let found = find_history(pixel, lane, guide, hit_distance);
            if found.factor >= 0.0 {
                let length = history_length_at(found.reflections) * found.factor;
                reprojected.length = min(history_cap(alpha_of(guide.roughness)), length + 1.0);
                reprojected.radiance = found.history.rgb;
                let spread = temporal_variance(radiance, found.history.rgb);
                reprojected.variance = mix(spread, found.history.a, 1.0 / reprojected.length);
                radiance = mix(radiance, found.history.rgb, frame.average_history_blend);
            }
            if AVERAGE_IS_USED {
                let weight = max(exp(-frame.average_luminance_falloff * luminance(radiance)), frame.average_weight_floor);
                contribution = vec4<f32>(radiance * weight, weight);
            }
        }
        textureStore(out_reprojected, pixel, vec4<u32>(pack_reprojected(reprojected), 0u, 0u));
    }

    if AVERAGE_IS_USED {
        // The row sums have been read by all: their memory serves the average.
        workgroupBarrier();
        row_sum[lane] = contribution;
        workgroupBarrier();
        for (var stride = 32u; stride > 0u; stride >>= 1u) {
            if lane < stride {
                row_sum[lane] += row_sum[lane + stride];
            }
            workgroupBarrier();
        }
        if lane == 0u {
            let total = row_sum[0];
            let average = min(total.rgb / max(total.a, 1e-12), vec3<f32>(HALF_MAX));
            textureStore(out_average, tile, rounded_to_half(vec4<f32>(average, 1.0)));
        }
    }
}
