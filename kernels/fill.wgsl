//! Fill: gives the tiles that are left out altogether their fallback value.
//!
//! in   guide      rg32uint      full   packed G-buffer, or normal, roughness, depth (environment fallback)
//! in   radiance   any float     full   input fallback only
//! out  output     rgba16float   full   rgb: fallback radiance; a: 0
//! out  prev_guide r32uint       full   0 (footprint pipeline, G-buffer copy)
//!
//! Grid: one 8x8 workgroup per left-out tile (indirect). Touches its own pixel only.

import package::shared::frame;
import package::shared::packing;
import package::shared::gbuffer;
import package::shared::radiance;
import package::shared::tiles;
import package::shared::fallback;

// Its copy for the next frame is the footprint pipeline's.
override PREV_GUIDE_IS_KEPT: bool = false;

@group(1) @binding(1) var<storage, read> in_tiles: array<u32>;
@group(1) @binding(2) var<storage, read> in_args: array<vec4<u32>, 4>;
@group(1) @binding(3) var out_output: texture_storage_2d<rgba16float, write>;
@group(1) @binding(4) var out_prev_guide: texture_storage_2d<r32uint, write>;

@compute @workgroup_size(8, 8)
fn fill(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let index = list_index(group);
    if index >= in_args[1].w {
        return;
    }
    let counts = tile_counts();
    let tile = unpack_tile(in_tiles[counts.x * counts.y - 1u - index]);
    let pixel = tile * TILE_SIZE + lane_position(lane);
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
