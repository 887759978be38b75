//! Fill: gives the tiles that are left out altogether their fallback value. Black ones keep it: of those only tiles that
//! were denoised one or two frames ago are filled.
//!
//! in   guide      rg32uint      full   packed G-buffer, or normal, roughness, depth (environment fallback)
//! in   radiance   any float     full   input fallback only
//! out  output     rgba16float   full   rgb: fallback radiance; a: 0
//! out  prev_guide r32uint       full   0 (footprint pipeline, G-buffer copy)
//! out  guide      rg32uint      full   0 beside tiles that are denoised, unless it is complete
//!
//! Grid: one 8x8 workgroup per 16 left-out tiles with something to write (indirect), an invocation handles a pixel of each.
//! Touches that only.

import package::shared::frame;
import package::shared::packing;
import package::shared::gbuffer;
import package::shared::radiance;
import package::shared::tiles;
import package::shared::fallback;

// Its copy for the next frame is the footprint pipeline's.
override PREV_GUIDE_IS_KEPT: bool = false;
// Filters look beside tiles that are denoised, where `classify` wrote no guide.
override FRINGE_IS_CLEARED: bool = false;

@group(1) @binding(1) var<storage, read> in_tiles: array<u32>;
@group(1) @binding(2) var<storage, read> in_args: array<vec4<u32>, 4>;
@group(1) @binding(3) var out_output: texture_storage_2d<rgba16float, write>;
@group(1) @binding(4) var out_prev_guide: texture_storage_2d<r32uint, write>;
@group(1) @binding(5) var out_guide: texture_storage_2d<rg32uint, write>;

fn fill_pixel(pixel: vec2<u32>) {
    if any(pixel >= frame.size) {
        return;
    }
    // Only the environment needs the surface.
    var guide: Guide;
    if FALLBACK == 2u {
        guide = load_guide(pixel);
    }
    textureStore(out_output, pixel, rounded_to_half(vec4<f32>(fallback_radiance(pixel, guide), 0.0)));
    if PREV_GUIDE_IS_KEPT {
        textureStore(out_prev_guide, pixel, vec4<u32>(0u));
    }
}

// An entry of the list of tiles that are left out.
fn entry_at(index: u32) -> u32 {
    let counts = tile_counts();
    return in_tiles[counts.x * counts.y - 1u - index];
}

// The pixel that a lane handles in a tile of the list.
fn pixel_of(entry: u32, lane: u32) -> vec2<u32> {
    return unpack_tile(entry) * TILE_SIZE + lane_position(lane);
}

@compute @workgroup_size(8, 8)
fn fill(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let first = list_index(group) * TILES_PER_GROUP;
    let count = min(TILES_PER_GROUP, in_args[1].w - min(first, in_args[1].w));
    // A bit for each tile.
    var unfilled = 0u;
    var fringe = 0u;
    for (var i = 0u; i < count; i++) {
        let entry = entry_at(first + i);
        fringe |= select(0u, 1u << i, (entry & TILE_IS_FRINGE) != 0u);
        // What is not black changes in every frame.
        if FALLBACK == 0u {
            unfilled |= select(0u, 1u << i, (entry & TILE_IS_UNFILLED) != 0u);
        } else {
            fill_pixel(pixel_of(entry, lane));
        }
    }
    if FALLBACK == 0u {
        for (var left = unfilled; left != 0u; left &= left - 1u) {
            fill_pixel(pixel_of(entry_at(first + lowest_bit(left)), lane));
        }
    }
    if FRINGE_IS_CLEARED {
        for (var left = fringe; left != 0u; left &= left - 1u) {
            let pixel = pixel_of(entry_at(first + lowest_bit(left)), lane);
            if all(pixel < frame.size) {
                textureStore(out_guide, pixel, vec4<u32>(0u));
            }
        }
    }
}
