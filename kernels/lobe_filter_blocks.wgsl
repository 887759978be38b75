//! Lobe filter for blocks: `lobe_filter` for the pixels of whole blocks, for which filtered blocks decide alone.
//!
//! in   guide             rg32uint      full    packed G-buffer, or normal, roughness, depth
//! in   blocks            rgba32uint    block   accumulated radiance filtered over the footprint, its deviation
//! in   block_list, args  lists                 whole blocks
//! out  output            rgba16float   full    rgb: denoised radiance; a: variance of its brightness, 0..1
//! out  prev_guide        r32uint       full    what the next frame wants to know of the G-buffer (G-buffer copy)
//!
//! Grid: one workgroup per four listed blocks (indirect). Loads 5 blocks.

import package::lobe_filter;

@compute @workgroup_size(8, 8)
fn lobe_filter_blocks(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let index = listed_block_index(group, lane);
    if index >= in_block_args[1].w {
        return;
    }
    let place = unpack_tile(in_block_list[block_count() - 1u - index]);
    let pixel = place * BLOCK_SIZE + position_in_block(lane);
    let guide = load_guide(pixel);
    let own = unpack_block(textureLoad(in_blocks, place, 0));
    let wide = blocks_around(pixel, pixel_plane_of(guide, world_position(pixel, guide.depth)), own.share);
    store_result(pixel, guide, without_exposure(vec4<f32>(wide.radiance, wide.variance)));
}
