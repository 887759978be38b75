//! Fill: gives the tiles that are left out altogether their fallback value. Black lasts: such tiles are filled in the first
//! two frames in a row alone, since there may be two outputs in turn.
//!
//! in   guide      rg32uint      full   packed G-buffer, or normal, roughness, depth (environment fallback)
//! in   radiance   any float     full   input fallback only
//! out  output     rgba16float   full   rgb: fallback radiance; a: 0
//! out  prev_guide r32uint       full   0 in new tiles (footprint pipeline, G-buffer copy)
//! out  guide      rg32uint      full   the same, unless it is complete: in other tiles the history, which was the output
//!                                      a frame ago, has no length
//!
//! Grid: one 8x8 workgroup per 16 tiles of the list (indirect), an invocation handles a pixel of each. Touches that only.

import package::shared::frame;
import package::shared::packing;
import package::shared::gbuffer;
import package::shared::radiance;
import package::shared::tiles;
import package::shared::fallback;

// Its copy for the next frame is the footprint pipeline's.
override PREV_GUIDE_IS_KEPT: bool = false;
// Filters look at tiles that are left out, where `classify` wrote no guide.
override GUIDE_IS_CLEARED: bool = false;

@group(1) @binding(1) var<storage, read> in_tiles: array<u32>;
@group(1) @binding(2) var<storage, read> in_args: array<vec4<u32>, 4>;
@group(1) @binding(3) var out_output: texture_storage_2d<rgba16float, write>;
@group(1) @binding(4) var out_prev_guide: texture_storage_2d<r32uint, write>;
@group(1) @binding(5) var out_guide: texture_storage_2d<rg32uint, write>;

fn fill_pixel(pixel: vec2<u32>) {
    // Only the environment needs the surface.
    var guide: Guide;
    if FALLBACK == 2u {
        guide = load_guide(pixel);
    }
    textureStore(out_output, pixel, rounded_to_half(vec4<f32>(fallback_radiance(pixel, guide), 0.0)));
}

// Later passes and the next frame find no surface there.
fn clear_pixel(pixel: vec2<u32>) {
    if PREV_GUIDE_IS_KEPT {
        textureStore(out_prev_guide, pixel, vec4<u32>(0u));
    }
    if GUIDE_IS_CLEARED {
        textureStore(out_guide, pixel, vec4<u32>(0u));
    }
}

// An entry of the list of tiles that are left out.
fn entry_at(index: u32) -> u32 {
    let counts = tile_counts();
    return in_tiles[counts.x * counts.y - 1u - index];
}

@compute @workgroup_size(8, 8)
fn fill(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let first = list_index(group) * TILES_PER_GROUP;
    let count = min(TILES_PER_GROUP, in_args[1].w - min(first, in_args[1].w));
    // A bit for each new tile.
    var new_tiles = 0u;
    for (var i = 0u; i < count; i++) {
        let entry = entry_at(first + i);
        new_tiles |= select(0u, 1u << i, (entry & TILE_IS_NEW) != 0u);
        let pixel = unpack_tile(entry) * TILE_SIZE + lane_position(lane);
        if all(pixel < frame.size) {
            fill_pixel(pixel);
        }
    }
    for (var left = new_tiles; left != 0u; left &= left - 1u) {
        let pixel = unpack_tile(entry_at(first + lowest_bit(left))) * TILE_SIZE + lane_position(lane);
        if all(pixel < frame.size) {
            clear_pixel(pixel);
        }
    }
}
