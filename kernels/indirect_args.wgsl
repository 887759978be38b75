//! Indirect arguments: turns the counters of classify into the grids of the passes that follow, and resets
//! them for the next frame.
//!
//! in/out  counters   4 x u32    listed tiles, left-out tiles that `fill` writes, rays
//! out     args       20 x u32   per list: workgroups in x, y, z, and the length of the list
//!
//! Grid: one invocation. After: the same pass of the AMD FidelityFX denoiser 1.2 (2021). Differs: grids have
//! two dimensions, as one may not exceed 65535 workgroups and 4K has 129600 tiles.

import package::shared::tiles;

// Rays that one workgroup of the renderer's tracer handles.
const RAY_GROUP_SIZE: u32 = 64u;

@group(1) @binding(0) var<storage, read_write> inout_counters: array<u32, 4>;
@group(1) @binding(1) var<storage, read_write> out_args: array<vec4<u32>, 5>;

@compute @workgroup_size(1)
fn indirect_args() {
    let rays = inout_counters[2];
    let listed = inout_counters[0];
    out_args[0] = list_grid(listed, listed);
    out_args[1] = list_grid((inout_counters[1] + TILES_PER_GROUP - 1u) / TILES_PER_GROUP, inout_counters[1]);
    out_args[2] = list_grid((rays + RAY_GROUP_SIZE - 1u) / RAY_GROUP_SIZE, rays);
    out_args[3] = list_grid((listed + TILES_PER_GROUP - 1u) / TILES_PER_GROUP, listed);
    out_args[4] = list_grid((listed + TILES_PER_GROUP_OF_QUADS - 1u) / TILES_PER_GROUP_OF_QUADS, listed);
    inout_counters[0] = 0u;
    inout_counters[1] = 0u;
    inout_counters[2] = 0u;
}
