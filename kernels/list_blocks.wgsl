//! List blocks: divides the blocks of listed tiles into whole ones, which passes over blocks accumulate and filter, and
//! others, whose pixels are looked at one by one.
//!
//! in      blocks          rgba32uint   block   of the input: surface, hit share, whether all pixels show it
//! in      tiles, args     lists                tiles to denoise
//! in/out  block_counters  2 x u32              other blocks, whole blocks
//! out     block_list      u32 list             other blocks from the front, whole ones from the back
//!
//! Grid: one invocation a block, workgroups of the blocks of 16 listed tiles (indirect). Two atomics on memory a workgroup.

import package::shared::frame;
import package::shared::packing;
import package::shared::footprint;
import package::shared::blocks;
import package::shared::whole_blocks;
import package::shared::tiles;

@group(1) @binding(0) var in_blocks: texture_2d<u32>;
@group(1) @binding(1) var<storage, read> in_tiles: array<u32>;
@group(1) @binding(2) var<storage, read> in_args: array<vec4<u32>, 4>;
@group(1) @binding(3) var<storage, read_write> inout_block_counters: array<atomic<u32>, 2>;
@group(1) @binding(4) var<storage, read_write> out_block_list: array<u32>;

// Blocks of the workgroup of either kind, and where theirs begin in the list.
var<workgroup> group_counts: array<atomic<u32>, 2>;
var<workgroup> group_first: array<u32, 2>;

@compute @workgroup_size(64)
fn list_blocks(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    if lane < 2u {
        atomicStore(&group_counts[lane], 0u);
    }
    workgroupBarrier();
    let index = block_list_index(group, lane);
    let length = in_args[0].w;
    let place = block_of_tile(unpack_tile(in_tiles[min(index, length - 1u)]), lane);
    let is_noted = index < length && all(vec2<i32>(place) <= last_block());
    var kind = 0u;
    var offset = 0u;
    if is_noted {
        let block = unpack_block(textureLoad(in_blocks, place, 0));
        kind = select(0u, 1u, is_filtered_whole(block, vec2<i32>(place)));
        offset = atomicAdd(&group_counts[kind], 1u);
    }
    workgroupBarrier();
    if lane < 2u {
        group_first[lane] = atomicAdd(&inout_block_counters[lane], atomicLoad(&group_counts[lane]));
    }
    workgroupBarrier();
    if is_noted {
        offset += group_first[kind];
        out_block_list[select(offset, block_count() - 1u - offset, kind == 1u)] = pack_tile(place);
    }
}
