//! Block arguments: turns the counters of `list_blocks` into the grids of the passes over its lists, and resets them for
//! the next frame.
//!
//! in/out  block_counters   2 x u32    other blocks, whole blocks
//! out     block_args       16 x u32   workgroups in x, y, z, and the length of the list: of other blocks by pixel, of whole
//!                                     blocks by quad, of whole blocks, of other blocks
//!
//! Grid: one invocation.

import package::shared::tiles;

@group(1) @binding(0) var<storage, read_write> inout_block_counters: array<u32, 2>;
@group(1) @binding(1) var<storage, read_write> out_block_args: array<vec4<u32>, 4>;

fn grid_of(length: u32, per_group: u32) -> vec4<u32> {
    return list_grid((length + per_group - 1u) / per_group, length);
}

@compute @workgroup_size(1)
fn block_args() {
    out_block_args[0] = grid_of(inout_block_counters[0], BLOCKS_PER_GROUP_OF_QUADS);
    out_block_args[1] = grid_of(inout_block_counters[1], BLOCKS_PER_GROUP_OF_QUADS);
    out_block_args[2] = grid_of(inout_block_counters[1], 64u);
    out_block_args[3] = grid_of(inout_block_counters[0], 64u);
    inout_block_counters[0] = 0u;
    inout_block_counters[1] = 0u;
}
