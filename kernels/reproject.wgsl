//! Reproject: finds where each reflection was last frame, how far that history can be trusted, how long it is
//! and how much it varies; averages each 8x8 tile.
//!
//! in   radiance       any float     full   noisy input; a: hit distance
//! in   motion         any float     full   uv motion of the surface
//! in   guide          rg32uint      full   this frame's packed G-buffer
//! in   prev_guide     rg32uint      full   last frame's
//! in   history        rgba16float   full   last frame's output; a: variance
//! in   prev_signal    rg32uint      full   last frame's `reprojected`, for the history length
//! in   tiles, args    lists         tiles to denoise
//! out  reprojected    rg32uint      full   packed history radiance, its length and variance
//! out  average        rgba16float   tile   rgb: average radiance; a: 1
//!
//! Grid: one 8x8 workgroup per listed tile (indirect). 18 taps of workgroup memory for the 9x9 statistics;
//! 8 guide loads, 4 to 8 history loads, 36 more guide loads where the first guess fails.
//! After: reprojection of the AMD FidelityFX denoiser 1.2 (2021). Differs: see "Deviations" in docs/reference.md.

import package::shared::frame;
import package::shared::packing;
import package::shared::radiance;
import package::shared::tiles;
import package::shared::neighborhood;

@group(0) @binding(5) var in_motion: texture_2d<f32>;

@group(1) @binding(0) var in_guide: texture_2d<u32>;
@group(1) @binding(1) var in_prev_guide: texture_2d<u32>;
@group(1) @binding(2) var in_history: texture_2d<f32>;
@group(1) @binding(3) var in_prev_signal: texture_2d<u32>;
@group(1) @binding(4) var<storage, read> in_tiles: array<u32>;
@group(1) @binding(5) var<storage, read> in_args: array<vec4<u32>, 3>;
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

// Surface of last frame around a place. Inverse depth is blended, being linear on screen.
struct PrevSurface {
    normal: vec3<f32>,
    depth: f32,
    alpha: f32,
}

fn prev_surface_at(prev_uv: vec2<f32>) -> PrevSurface {
    let footprint = footprint_at(prev_uv);
    var normal = vec3<f32>(0.0);
    var inverse_depth = 0.0;
    var alpha = 0.0;
    for (var i = 0u; i < 4u; i++) {
        let tap = unpack_guide(textureLoad(in_prev_guide, footprint_texel(footprint, i), 0).xy);
        let w = footprint.weights[i];
        // The sky has no normal.
        normal += select(w, 0.0, tap.depth >= SKY_DEPTH) * tap.normal;
        inverse_depth += w / tap.depth;
        alpha += w * alpha_of(tap.roughness);
    }
    var surface: PrevSurface;
    surface.normal = normal * inverseSqrt(max(dot(normal, normal), 1e-12));
    surface.depth = 1.0 / inverse_depth;
    surface.alpha = alpha;
    return surface;
}

// rgb: history radiance, exposed; a: its variance.
fn history_at(prev_uv: vec2<f32>) -> vec4<f32> {
    let footprint = footprint_at(prev_uv);
    var sum = vec4<f32>(0.0);
    for (var i = 0u; i < 4u; i++) {
        sum += footprint.weights[i] * textureLoad(in_history, footprint_texel(footprint, i), 0);
    }
    return vec4<f32>(sum.rgb * frame.exposure, sum.a);
}

fn history_length_at(prev_uv: vec2<f32>) -> f32 {
    let footprint = footprint_at(prev_uv);
    var sum = 0.0;
    for (var i = 0u; i < 4u; i++) {
        let texel = footprint_texel(footprint, i);
        // Pixels that were left out hold nothing that counts.
        if packed_guide_is_denoised(textureLoad(in_prev_guide, texel, 0).xy) {
            sum += footprint.weights[i] * unpack_reprojected(textureLoad(in_prev_signal, texel, 0).xy).length;
        }
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
fn parallax_prev_uv(pixel: vec2<u32>, guide: Guide) -> vec2<f32> {
    let surface = world_position(pixel, guide.depth);
    let hit_distance = textureLoad(in_radiance, pixel, 0).a;
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
    // rgb: radiance; a: variance.
    history: vec4<f32>,
    // 0 when there is no history.
    factor: f32,
}

fn no_match() -> Match {
    return Match(vec2<f32>(-1.0), vec4<f32>(0.0), 0.0);
}

// One of the two candidates, or none, by last frame's normal, roughness and colour.
fn choose_candidate(pixel: vec2<u32>, guide: Guide, statistics: Statistics) -> Match {
    let parallax_uv = parallax_prev_uv(pixel, guide);
    let surface_uv = surface_prev_uv(pixel);
    let parallax = prev_surface_at(parallax_uv);
    let surface = prev_surface_at(surface_uv);
    let parallax_cosine = dot(guide.normal, parallax.normal);
    let surface_cosine = dot(guide.normal, surface.normal);
    let alpha = alpha_of(guide.roughness);
    if parallax_cosine > frame.parallax_normal_cosine
        && parallax_cosine + frame.parallax_normal_margin > surface_cosine
        && abs(parallax.alpha - alpha) < abs(surface.alpha - alpha) + frame.parallax_roughness_margin {
        let factor = disocclusion_factor(guide, parallax.normal, parallax.depth);
        return Match(parallax_uv, history_at(parallax_uv), factor);
    }
    let history = history_at(surface_uv);
    let difference = history.rgb - statistics.mean;
    if dot(difference, difference) < frame.surface_color_gate * length(statistics.variance) {
        return Match(surface_uv, history, disocclusion_factor(guide, surface.normal, surface.depth));
    }
    return no_match();
}

// The best of the 3x3 places around a match.
fn search_around(guide: Guide, found: Match) -> Match {
    var best = found;
    for (var y = -1; y <= 1; y++) {
        for (var x = -1; x <= 1; x++) {
            let uv = found.prev_uv + vec2<f32>(vec2<i32>(x, y)) / vec2<f32>(frame.prev_size);
            let surface = prev_surface_at(uv);
            let factor = disocclusion_factor(guide, surface.normal, surface.depth);
            if factor > best.factor {
                best.factor = factor;
                best.prev_uv = uv;
            }
        }
    }
    best.history = history_at(best.prev_uv);
    return best;
}

// Only those of the four texels that show the same surface.
fn repair_edge(guide: Guide, found: Match) -> Match {
    let footprint = footprint_at(found.prev_uv);
    var weight_sum = 0.0;
    var radiance = vec3<f32>(0.0);
    var normal = vec3<f32>(0.0);
    var depth = 0.0;
    for (var i = 0u; i < 4u; i++) {
        let texel = footprint_texel(footprint, i);
        let tap = unpack_guide(textureLoad(in_prev_guide, texel, 0).xy);
        let factor = disocclusion_factor(guide, tap.normal, tap.depth);
        if factor > frame.disocclusion_threshold * frame.disocclusion_tap_fraction {
            let w = footprint.weights[i];
            weight_sum += w;
            radiance += w * textureLoad(in_history, texel, 0).rgb;
            normal += w * tap.normal;
            depth += w * tap.depth;
        }
    }
    let normalization = 1.0 / max(weight_sum, 0.001);
    var repaired = found;
    repaired.history = vec4<f32>(radiance * normalization * frame.exposure, found.history.a);
    repaired.factor = disocclusion_factor(guide, normal * normalization, depth * normalization);
    return repaired;
}

fn find_history(pixel: vec2<u32>, guide: Guide, statistics: Statistics) -> Match {
    var found = choose_candidate(pixel, guide, statistics);
    if found.factor > 0.0 && found.factor < frame.disocclusion_threshold {
        found = search_around(guide, found);
        if found.factor < frame.disocclusion_threshold {
            found = repair_edge(guide, found);
        }
    }
    let on_screen = all(found.prev_uv > vec2<f32>(0.0)) && all(found.prev_uv < vec2<f32>(1.0));
    if !on_screen || found.factor < frame.disocclusion_threshold {
        return no_match();
    }
    return found;
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
    for (var i = 0u; i < 4u; i++) {
        let entry = lane + 64u * i;
        let p = window_pixel(tile, entry);
        var radiance = vec3<f32>(0.0);
        var counts = false;
        if all(p >= vec2<i32>(0)) && all(p < vec2<i32>(frame.size)) {
            counts = packed_guide_is_denoised(textureLoad(in_guide, p, 0).xy);
            radiance = load_radiance(vec2<u32>(p));
        }
        store_window(entry, radiance, counts);
    }
    workgroupBarrier();
    sum_rows(lane);
    workgroupBarrier();

    let statistics = neighborhood_statistics(lane);
    // rgb: weighted radiance, a: weight in the average of the tile.
    var contribution = vec4<f32>(0.0);
    if all(pixel < frame.size) {
        let guide = unpack_guide(textureLoad(in_guide, pixel, 0).xy);
        var reprojected = Reprojected(vec3<f32>(0.0), 0.0, 0.0);
        if guide.denoised {
            var radiance = load_radiance(pixel);
            reprojected.length = 1.0;
            reprojected.variance = 1.0;
            var found = no_match();
            // Mesa's lavapipe compiles a kernel anew in every frame in which a branch depends on constants
            // alone, so this one depends on the pixel too.
            if guide.denoised & (frame.history_valid != 0u) {
                found = find_history(pixel, guide, statistics);
            }
            if found.factor > 0.0 {
                let length = history_length_at(found.prev_uv) * found.factor;
                reprojected.length = min(history_cap(alpha_of(guide.roughness)), length + 1.0);
                reprojected.radiance = found.history.rgb;
                let spread = temporal_variance(radiance, found.history.rgb);
                reprojected.variance = mix(spread, found.history.a, 1.0 / reprojected.length);
                radiance = mix(radiance, found.history.rgb, frame.average_history_blend);
            }
            let weight = max(exp(-frame.average_luminance_falloff * luminance(radiance)), frame.average_weight_floor);
            contribution = vec4<f32>(radiance * weight, weight);
        }
        textureStore(out_reprojected, pixel, vec4<u32>(pack_reprojected(reprojected), 0u, 0u));
    }

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
        let average = min(total.rgb / max(total.a, 0.001), vec3<f32>(HALF_MAX));
        textureStore(out_average, tile, vec4<f32>(average, 1.0));
    }
}
