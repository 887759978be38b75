//! Debug view: shows in colours what the footprint pipeline finds out about each pixel.
//!
//! in   guide          rg32uint      full    packed G-buffer, or normal, roughness, depth
//! in   idle_frames    u32           tile    0 if a pixel of the tile is denoised: elsewhere the guide says nothing
//! in   accumulated    rgba16float   full    this frame's `history` (history length, variance)
//! in   radiance       any float     full    hit distance; all that `accumulate` reads (disocclusion, candidate)
//! in   blocks         rgba32uint    block   as `accumulate` reads them (average, tile classes with whole blocks)
//! in   motion         any float     full    uv motion of the surface (motion error)
//! out  debug_view     rgba16float   full    rgb: linear colour, 0 to 1; a: 1
//!
//! Grid: one 8x8 workgroup per tile. Runs after `accumulate`, while last frame's textures are still what it saw, and
//! contains it: what it looks up again, it looks up with the same functions.

import package::accumulate;
import package::shared::whole_blocks;
import package::shared::debug_view;

@group(1) @binding(9) var in_accumulated: texture_2d<f32>;
@group(1) @binding(10) var<storage, read> in_idle_frames: array<u32>;

fn is_on_prev_screen(prev_uv: vec2<f32>) -> bool {
    let place = prev_uv * vec2<f32>(frame.prev_size);
    return all(place > vec2<f32>(0.0)) && all(place < vec2<f32>(frame.prev_size));
}

// Disocclusion or candidate.
fn history_color(pixel: vec2<u32>, guide: Guide) -> vec3<f32> {
    let subject = subject_of(pixel, guide, quad_of(pixel));
    let candidates = candidates_of(pixel, subject);
    let is_found = chosen(candidates, subject).is_valid;
    if VIEW == DISOCCLUSION {
        var on_screen = is_on_prev_screen(candidates.reflection_uv);
        if SURFACE_MOTION {
            on_screen = on_screen || is_on_prev_screen(candidates.surface_uv);
        }
        return select(select(BLUE, RED, on_screen), FINE, is_found);
    }
    let has_both = candidates.surface.is_valid && candidates.reflection.is_valid;
    let alone = select(1.0, 0.0, candidates.surface.is_valid);
    let by_reflection = select(alone, reflection_weight(candidates, subject), has_both);
    return select(RED, mix(GREEN, BLUE, by_reflection), is_found);
}

fn tile_color(pixel: vec2<u32>, guide: Guide) -> vec3<f32> {
    if WHOLE_BLOCKS {
        let place = pixel / BLOCK_SIZE;
        let is_whole = is_filtered_whole(unpack_block(textureLoad(in_blocks, place, 0)), vec2<i32>(place));
        // Blocks of tiles that are not denoised say nothing.
        return select(tile_class_color(), PALE, guide.denoised && is_whole);
    }
    return tile_class_color();
}

fn view_color(pixel: vec2<u32>, guide: Guide) -> vec3<f32> {
    if VIEW == TILE_CLASSES {
        return tile_color(pixel, guide);
    }
    if VIEW == MOTION_ERROR {
        let texel = textureLoad(in_motion, pixel, 0).xy;
        let color = motion_error_color(pixel, world_position(pixel, guide.depth), texel);
        return select(LEFT_OUT, color, guide.denoised);
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
    return history_color(pixel, guide);
}

@compute @workgroup_size(8, 8)
fn debug_view(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let pixel = group.xy * TILE_SIZE + lane_position(lane);
    let on_screen = all(pixel < frame.size);
    var guide: Guide;
    if on_screen && in_idle_frames[tile_index(group.xy)] == 0u {
        guide = load_guide(pixel);
    }
    if VIEW == TILE_CLASSES {
        gather_tile(lane, guide);
    }
    if on_screen {
        store_view(pixel, view_color(pixel, guide));
    }
}
