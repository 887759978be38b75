// 8x8 tiles and the lists of them that the indirect passes walk.

import package::shared::frame;

const TILE_SIZE: u32 = 8u;
// Workgroups per row of an indirect grid, so that no dimension passes 65535. `limpid::plan` has the same number.
const LIST_GRID_WIDTH: u32 = 4096u;

// Index of the lowest bit that is set: for loops over bits.
fn lowest_bit(bits: u32) -> u32 {
    return countOneBits(~bits & (bits - 1u));
}

fn tile_counts() -> vec2<u32> {
    return (frame.size + (TILE_SIZE - 1u)) / TILE_SIZE;
}

// Position of a tile in buffers that hold something of each.
fn tile_index(tile: vec2<u32>) -> u32 {
    return tile.y * tile_counts().x + tile.x;
}

// Frames in a row after which what a tile that is left out holds lasts: the output may be one of two textures in turn.
const FRAMES_TO_FILL: u32 = 2u;
// Set in the list of tiles that are left out for those in which that does not last yet.
const TILE_IS_NEW: u32 = 0x80000000u;

fn pack_tile(tile: vec2<u32>) -> u32 {
    return tile.x | (tile.y << 16u);
}

fn unpack_tile(packed: u32) -> vec2<u32> {
    return vec2<u32>(packed & 0xffffu, (packed & ~TILE_IS_NEW) >> 16u);
}

// Tiles of their list that a workgroup of 64 invocations handles in `fill` and in passes over blocks of 4x4 pixels, in
// which an invocation handles a block.
const TILES_PER_GROUP: u32 = 16u;

// Position in its list that a workgroup of an indirect grid handles.
fn list_index(group: vec3<u32>) -> u32 {
    return group.y * LIST_GRID_WIDTH + group.x;
}

// Tiles and blocks of their lists that a workgroup of 64 invocations handles in passes over their quads of 2x2 pixels.
const TILES_PER_GROUP_OF_QUADS: u32 = 4u;
const BLOCKS_PER_GROUP_OF_QUADS: u32 = 16u;

// Workgroups in x, y and z that handle a list, and its length.
fn list_grid(groups: u32, length: u32) -> vec4<u32> {
    let rows = (groups + LIST_GRID_WIDTH - 1u) / LIST_GRID_WIDTH;
    return vec4<u32>(min(groups, LIST_GRID_WIDTH), rows, 1u, length);
}

const BLOCK_PIXELS: u32 = 16u;

// How many pixels a block has in rows that are on screen.
fn pixels_in_rows(corner: vec2<u32>) -> u32 {
    return 4u * min(frame.size.y - corner.y, 4u);
}

// Position of a pixel inside a 4x4 block.
fn position_in_block(index: u32) -> vec2<u32> {
    return vec2<u32>(index & 3u, (index >> 2u) & 3u);
}

const QUAD_PIXELS: u32 = 4u;

// Position of a pixel inside a quad.
fn position_in_quad(index: u32) -> vec2<u32> {
    return vec2<u32>(index & 1u, index >> 1u);
}

// Position inside an 8x8 tile of an invocation.
fn lane_position(lane: u32) -> vec2<u32> {
    return vec2<u32>(lane % TILE_SIZE, lane / TILE_SIZE);
}

// Position in its list of the tile that an invocation handles a block of.
fn block_list_index(group: vec3<u32>, lane: u32) -> u32 {
    return list_index(group) * TILES_PER_GROUP + lane / 4u;
}

// Quarter of what four invocations share: of a tile a block, of a block a quad.
fn quarter_of(lane: u32) -> vec2<u32> {
    return vec2<u32>(lane & 1u, (lane >> 1u) & 1u);
}

// That block of the tile.
fn block_of_tile(tile: vec2<u32>, lane: u32) -> vec2<u32> {
    return tile * 2u + quarter_of(lane);
}
