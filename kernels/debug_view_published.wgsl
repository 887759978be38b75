//! Debug view: shows in colours what the published pipeline finds out about each pixel.
//!
//! in   guide          rg32uint      full   packed G-buffer, or normal, roughness, depth
//! in   reprojected    rg32uint      full   what `reproject` wrote (history length, variance)
//! in   radiance       any float     full   hit distance; all that `reproject` reads (disocclusion, candidate)
//! in   average        rgba16float   tile   (average)
//! in   motion         any float     full   uv motion of the surface (motion error)
//! out  debug_view     rgba16float   full   rgb: linear colour, 0 to 1; a: 1
//!
//! Grid: one 8x8 workgroup per tile. Runs after `reproject`, while last frame's textures are still what it saw, and
//! contains it: what it looks up again, it looks up with the same functions.

import package::reproject;
import package::shared::debug_view;

@group(1) @binding(9) var in_reprojected: texture_2d<u32>;
@group(1) @binding(10) var in_average: texture_2d<f32>;

// Which of the two places the first guess was.
fn is_reflection(pixel: vec2<u32>, guide: Guide, hit_distance: f32, guess: Match) -> bool {
    var from_surface = 1e9;
    var from_reflection = 1e9;
    if SURFACE_MOTION {
        from_surface = distance(guess.prev_uv, surface_prev_uv(pixel));
    }
    if MIRROR_PARALLAX {
        from_reflection = distance(guess.prev_uv, parallax_prev_uv(pixel, guide, hit_distance));
    }
    return from_reflection <= from_surface;
}

fn is_either_on_prev_screen(pixel: vec2<u32>, guide: Guide, hit_distance: f32) -> bool {
    var on_screen = false;
    if SURFACE_MOTION {
        on_screen = is_on_prev_screen(surface_prev_uv(pixel));
    }
    if MIRROR_PARALLAX {
        on_screen = on_screen || is_on_prev_screen(parallax_prev_uv(pixel, guide, hit_distance));
    }
    return on_screen;
}

// Disocclusion or candidate.
fn history_color(pixel: vec2<u32>, lane: u32, guide: Guide) -> vec3<f32> {
    let hit_distance = textureLoad(in_radiance, pixel, 0).a;
    let is_found = find_history(pixel, lane, guide, hit_distance).factor >= 0.0;
    if VIEW == DISOCCLUSION {
        let on_screen = is_either_on_prev_screen(pixel, guide, hit_distance);
        return select(select(BLUE, RED, on_screen), FINE, is_found);
    }
    let guess = choose_candidate(pixel, lane, guide, hit_distance);
    let place = select(GREEN, BLUE, is_reflection(pixel, guide, hit_distance, guess));
    return select(RED, select(place, YELLOW, guess.factor < frame.disocclusion_threshold), is_found);
}

fn view_color(pixel: vec2<u32>, lane: u32, guide: Guide) -> vec3<f32> {
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
        return history_length_color(unpack_reprojected(textureLoad(in_reprojected, pixel, 0).xy).length);
    }
    if VIEW == VARIANCE {
        return variance_color(unpack_reprojected(textureLoad(in_reprojected, pixel, 0).xy).variance);
    }
    if VIEW == HIT_DISTANCE {
        return hit_distance_color(textureLoad(in_radiance, pixel, 0).a, guide.depth);
    }
    if VIEW == AVERAGE {
        return radiance_color(textureLoad(in_average, pixel / TILE_SIZE, 0).rgb);
    }
    return history_color(pixel, lane, guide);
}

// The neighbourhood that the colour of surface motion is compared with, as `reproject` gathers it.
fn gather_neighborhood(tile: vec2<u32>, lane: u32) {
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

@compute @workgroup_size(8, 8)
fn debug_view_published(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let pixel = group.xy * TILE_SIZE + lane_position(lane);
    let on_screen = all(pixel < frame.size);
    var guide: Guide;
    if on_screen {
        guide = load_guide(pixel);
    }
    if VIEW == TILE_CLASSES {
        gather_tile(lane, guide);
    }
    if VIEW >= DISOCCLUSION {
        if SURFACE_MOTION {
            gather_neighborhood(group.xy, lane);
        }
    }
    if on_screen {
        store_view(pixel, view_color(pixel, lane, guide));
    }
}
