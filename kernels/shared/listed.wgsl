// Pixels of a list: of the tiles to denoise or, where whole blocks have passes of their own, of the other blocks.

import package::shared::frame;
import package::shared::tiles;
import package::shared::blocks;

// Whole blocks have a pass of their own, and the list of blocks holds the others.
override WHOLE_BLOCKS: bool = false;

@group(1) @binding(7) var<storage, read> in_tiles: array<u32>;
@group(1) @binding(8) var<storage, read> in_args: array<vec4<u32>, 4>;
@group(1) @binding(9) var<storage, read> in_block_list: array<u32>;
@group(1) @binding(10) var<storage, read> in_block_args: array<vec4<u32>, 4>;

// Where there is no pixel.
const NO_PIXEL: vec2<u32> = vec2<u32>(0xffffffffu);

// The first of the 2x2 pixels that an invocation of a workgroup of 64 handles; off screen where the list has none for it.
fn listed_quad(group: vec3<u32>, lane: u32) -> vec2<u32> {
    if WHOLE_BLOCKS {
        let index = list_index(group) * BLOCKS_PER_GROUP_OF_QUADS + lane / 4u;
        if index >= in_block_args[0].w {
            return NO_PIXEL;
        }
        return unpack_tile(in_block_list[index]) * BLOCK_SIZE + quarter_of(lane) * 2u;
    }
    let index = list_index(group) * TILES_PER_GROUP_OF_QUADS + lane / 16u;
    if index >= in_args[0].w {
        return NO_PIXEL;
    }
    return unpack_tile(in_tiles[index]) * TILE_SIZE + position_in_block(lane) * 2u;
}

// The block that an invocation of a workgroup of 64 handles; off screen where the list has none for it.
fn listed_block(group: vec3<u32>, lane: u32) -> vec2<u32> {
    if WHOLE_BLOCKS {
        let index = list_index(group) * 64u + lane;
        if index >= in_block_args[0].w {
            return NO_PIXEL;
        }
        return unpack_tile(in_block_list[index]);
    }
    let index = block_list_index(group, lane);
    if index >= in_args[0].w {
        return NO_PIXEL;
    }
    return block_of_tile(unpack_tile(in_tiles[index]), lane);
}
