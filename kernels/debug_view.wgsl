//! Debug view: shows in colours what the footprint pipeline finds out about each pixel.
//!
//! in   guide          rg32uint      full    packed G-buffer
//! in   accumulated    rgba16float   full    this frame's `history` (history length, variance)
//! in   radiance       any float     full    hit distance; all that `accumulate` reads (disocclusion, candidate)
//! in   blocks         rgba32uint    block   as `accumulate` reads them (average)
//! in   motion         any float     full    uv motion of the surface (motion error)
//! out  debug_view     rgba16float   full    rgb: linear colour, 0 to 1; a: 1
//!
//! Grid: one 8x8 workgroup per tile. Runs after `accumulate`, while last frame's textures are still what it saw, and
//! contains it: what it looks up again, it looks up with the same functions.

import package::accumulate;
import package::shared::debug_view;

@group(1) @binding(9) var in_accumulated: texture_2d<f32>;

// The two histories that `find_history` chooses from.
struct Candidates {
    surface_uv: vec2<f32>,
    surface: Found,
    reflection_uv: vec2<f32>,
    reflection: Found,
}

fn candidates_of(pixel: vec2<u32>, guide: Guide, position: vec3<f32>, share: f32) -> Candidates {
    let static_uv = prev_uv_of(position);
    var candidates = Candidates(static_uv, nothing_found(), vec2<f32>(-1.0), nothing_found());
    var moves = false;
    if SURFACE_MOTION {
        candidates.surface_uv = surface_prev_uv(pixel);
        moves = length((candidates.surface_uv - static_uv) * vec2<f32>(frame.size)) > 0.5;
        let tolerance = Tolerance(select(0.01, 0.1, moves), select(0.9, 0.7, moves));
        candidates.surface = history_at(candidates.surface_uv, guide, position, share, tolerance);
    }
    if MIRROR_PARALLAX {
        let alpha = alpha_of(guide.roughness);
        let dominant = (1.0 - alpha) * (sqrt(1.0 - alpha) + alpha);
        let distance = hit_distance_of(share, camera_distance_of(position)) * dominant;
        let image = position + view_direction(position) * distance;
        candidates.reflection_uv = prev_uv_of(image) + (candidates.surface_uv - static_uv);
        let tolerance = Tolerance(select(0.015, 0.1, moves), select(0.98, 0.95, guide.roughness >= 0.3));
        candidates.reflection = history_at(candidates.reflection_uv, guide, position, share, tolerance);
    }
    return candidates;
}

// How much of the reflected point's history is in the mixture.
fn reflection_weight(candidates: Candidates, guide: Guide, around: Surroundings) -> f32 {
    let fit = misfit(candidates.reflection.radiance, around) - misfit(candidates.surface.radiance, around);
    let favour = min(1.0, 2.0 / (1.0 + exp(clamp(fit, -8.0, 8.0))));
    let mixed = favour * (1.0 - smoothstep(SURFACE_FROM, SURFACE_TO, guide.roughness));
    return select(select(1.0, mixed, candidates.surface.is_valid), 0.0, !candidates.reflection.is_valid);
}

fn is_on_prev_screen(prev_uv: vec2<f32>) -> bool {
    let place = prev_uv * vec2<f32>(frame.prev_size);
    return all(place > vec2<f32>(0.0)) && all(place < vec2<f32>(frame.prev_size));
}

// Disocclusion or candidate.
fn history_color(pixel: vec2<u32>, guide: Guide, position: vec3<f32>) -> vec3<f32> {
    let around = surroundings_of(pixel, plane_of(guide, position));
    let distance = usable_hit_distance(textureLoad(in_radiance, pixel, 0).a);
    let own_share = select(around.share, hit_share(distance, camera_distance_of(position)), distance > 0.0);
    let share = mix(own_share, around.share, smoothstep(0.03, 0.2, guide.roughness) * around.fit);
    let candidates = candidates_of(pixel, guide, position, share);
    let is_found = find_history(pixel, guide, position, share, around).is_valid;
    if VIEW == DISOCCLUSION {
        var on_screen = is_on_prev_screen(candidates.reflection_uv);
        if SURFACE_MOTION {
            on_screen = on_screen || is_on_prev_screen(candidates.surface_uv);
        }
        return select(select(BLUE, RED, on_screen), FINE, is_found);
    }
    return select(RED, mix(GREEN, BLUE, reflection_weight(candidates, guide, around)), is_found);
}

fn view_color(pixel: vec2<u32>, guide: Guide) -> vec3<f32> {
    if VIEW == TILE_CLASSES {
        return tile_class_color();
    }
    if VIEW == MOTION_ERROR {
        let texel = textureLoad(in_motion, pixel, 0).xy;
        let color = motion_error_color(pixel, world_position(pixel, guide.depth), texel);
        return select(color, LEFT_OUT, guide.depth >= SKY_DEPTH);
    }
    if !guide.denoised {
        return LEFT_OUT;
    }
    if VIEW == HISTORY_LENGTH {
        return history_length_color(unpack_history(textureLoad(in_accumulated, pixel, 0)).length);
    }
    if VIEW == VARIANCE {
        return variance_color(unpack_history(textureLoad(in_accumulated, pixel, 0)).noise);
    }
    if VIEW == HIT_DISTANCE {
        return hit_distance_color(textureLoad(in_radiance, pixel, 0).a, guide.depth);
    }
    if VIEW == AVERAGE {
        return radiance_color(unpack_block(textureLoad(in_blocks, pixel / BLOCK_SIZE, 0)).radiance);
    }
    return history_color(pixel, guide, world_position(pixel, guide.depth));
}

@compute @workgroup_size(8, 8)
fn debug_view(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let pixel = group.xy * TILE_SIZE + lane_position(lane);
    let on_screen = all(pixel < frame.size);
    var guide: Guide;
    if on_screen {
        guide = unpack_guide(textureLoad(in_guide, pixel, 0).xy);
    }
    if VIEW == TILE_CLASSES {
        gather_tile(lane, guide);
    }
    if on_screen {
        store_view(pixel, view_color(pixel, guide));
    }
}
