// Pixels of a list: of the tiles to denoise or, where whole blocks have passes of their own, of the other blocks.

import package::shared::frame;
import package::shared::tiles;
import package::shared::blocks;

// Whole blocks have a pass of their own, and the list of blocks holds the others.
override WHOLE_BLOCKS: bool = false;

@group(1) @binding(7) var<storage, read> in_tiles: array<u32>;
@group(1) @binding(8) var<storage, read> in_args: array<vec4<u32>, 4>;
@group(1) @binding(9) var<storage, read> in_block_list: array<u32>;
@group(1) @binding(10) var<storage, read> in_block_args: array<vec4<u32>, 3>;

// Where there is no pixel.
const NO_PIXEL: vec2<u32> = vec2<u32>(0xffffffffu);

// The pixel of an invocation of a workgroup of 64; off screen where the list has none for it.
fn listed_pixel(group: vec3<u32>, lane: u32) -> vec2<u32> {
    if WHOLE_BLOCKS {
        let index = listed_block_index(group, lane);
        if index >= in_block_args[0].w {
            return NO_PIXEL;
        }
        return unpack_tile(in_block_list[index]) * BLOCK_SIZE + position_in_block(lane);
    }
    let index = list_index(group);
    if index >= in_args[0].w {
        return NO_PIXEL;
    }
    return unpack_tile(in_tiles[index]) * TILE_SIZE + lane_position(lane);
}
