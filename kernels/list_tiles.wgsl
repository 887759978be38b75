//! List tiles: makes the lists of 8x8 tiles that are denoised and that are left out, and clears what later passes
//! read in those.
//!
//! in      idle_frames            u32           tile    frames in a row in which nothing was denoised, 0 for listed tiles
//! in/out  counters               4 x u32       listed tiles, left-out tiles that `fill` writes
//! out     tiles                  u32 list      listed tiles from the front; those left-out tiles from the back, with a mark
//!                                              on new ones. Where the fallback is black there are no others
//! out     average                rgba16float   tile    0 in tiles that are left out (published pipeline)
//! out     blocks, other_blocks   rgba32uint    block   the same (footprint pipeline)
//! out     light                  r32uint       block   the same (light change)
//!
//! Grid: one invocation a tile, 8x8 of them a workgroup. Two atomics on memory a workgroup: tile by tile they would cost
//! more than all of `classify`.

import package::shared::frame;
import package::shared::packing;
import package::shared::tiles;
import package::shared::blocks;

// Some later pass uses the 8x8 averages.
override AVERAGE_IS_USED: bool = true;
// Later passes work on blocks, and leave those of tiles alone that are left out.
override BLOCKS_ARE_USED: bool = false;
// Later passes notice where the light changed.
override LIGHT_CHANGE: bool = false;
// Left-out tiles stay as they are once they are no longer new.
override FALLBACK_IS_BLACK: bool = false;

@group(1) @binding(0) var<storage, read> in_idle_frames: array<u32>;
@group(1) @binding(1) var<storage, read_write> out_tiles: array<u32>;
@group(1) @binding(2) var<storage, read_write> inout_counters: array<atomic<u32>, 4>;
@group(1) @binding(3) var out_average: texture_storage_2d<rgba16float, write>;
@group(1) @binding(4) var out_blocks: texture_storage_2d<rgba32uint, write>;
@group(1) @binding(5) var out_other_blocks: texture_storage_2d<rgba32uint, write>;
@group(1) @binding(6) var out_light: texture_storage_2d<r32uint, write>;

// Listed and left-out tiles of the workgroup, and where theirs begin in the lists.
var<workgroup> group_counts: array<atomic<u32>, 2>;
var<workgroup> group_first: array<u32, 2>;

fn clear_tile(tile: vec2<u32>) {
    if AVERAGE_IS_USED {
        textureStore(out_average, tile, vec4<f32>(0.0));
    }
    if BLOCKS_ARE_USED {
        for (var i = 0u; i < 4u; i++) {
            let block = block_of_tile(tile, i);
            if all(vec2<i32>(block) <= last_block()) {
                textureStore(out_blocks, block, vec4<u32>(0u));
                textureStore(out_other_blocks, block, vec4<u32>(0u));
                if LIGHT_CHANGE {
                    textureStore(out_light, block, vec4<u32>(0u));
                }
            }
        }
    }
}

@compute @workgroup_size(8, 8)
fn list_tiles(@builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let tile = id.xy;
    let counts = tile_counts();
    let on_screen = all(tile < counts);
    if lane < 2u {
        atomicStore(&group_counts[lane], 0u);
    }
    workgroupBarrier();
    let idle_frames = in_idle_frames[tile_index(min(tile, counts - 1u))];
    let is_listed = idle_frames == 0u;
    let list = select(1u, 0u, is_listed);
    let is_new = !is_listed && idle_frames <= FRAMES_TO_FILL;
    if on_screen && !is_listed {
        clear_tile(tile);
    }
    var is_noted = on_screen;
    if FALLBACK_IS_BLACK {
        is_noted = on_screen && (is_listed || is_new);
    }
    var index = 0u;
    if is_noted {
        index = atomicAdd(&group_counts[list], 1u);
    }
    workgroupBarrier();
    if lane < 2u {
        group_first[lane] = atomicAdd(&inout_counters[lane], atomicLoad(&group_counts[lane]));
    }
    workgroupBarrier();
    if is_noted {
        index += group_first[list];
        out_tiles[select(counts.x * counts.y - 1u - index, index, is_listed)] = pack_tile(tile) | select(0u, TILE_IS_NEW, is_new);
    }
}
