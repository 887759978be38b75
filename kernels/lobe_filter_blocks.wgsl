//! Lobe filter for blocks: `lobe_filter` for the pixels of whole blocks, for which filtered blocks decide alone.
//!
//! in   guide             rg32uint      full    packed G-buffer, or normal, roughness, depth
//! in   blocks            rgba32uint    block   accumulated radiance filtered over the footprint, its deviation
//! in   block_list, args  lists                 whole blocks
//! out  output            rgba16float   full    rgb: denoised radiance; a: variance of its brightness, 0..1
//! out  prev_guide        r32uint       full    what the next frame wants to know of the G-buffer (G-buffer copy)
//!
//! Grid: an invocation for each 2x2 pixels, which are between the same blocks; one workgroup per 16 listed blocks
//! (indirect). Loads 5 blocks, 4 guides.

import package::lobe_filter;

@compute @workgroup_size(64)
fn lobe_filter_blocks(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let index = list_index(group) * BLOCKS_PER_GROUP_OF_QUADS + lane / 4u;
    if index >= in_block_args[1].w {
        return;
    }
    let place = unpack_tile(in_block_list[block_count() - 1u - index]);
    let own = unpack_block(textureLoad(in_blocks, place, 0));
    let quarter = quarter_of(lane);
    let first = place * BLOCK_SIZE + quarter * 2u;
    // The surface next to the other blocks: what they are to it, it is to them.
    let outer = place * BLOCK_SIZE + quarter * 3u;
    let guide = load_guide(outer);
    let plane = plane_within(guide, world_position(outer, guide.depth), PIXEL_NORMAL_TOLERANCE);
    let taps = block_taps(corners_of(first), first, plane, own.share);
    var i = 0u;
    loop {
        let pixel = first + position_in_quad(i);
        let wide = wide_at(pixel, taps);
        store_result(pixel, without_exposure(vec4<f32>(wide.radiance, wide.variance)));
        i += 1u;
        if i >= QUAD_PIXELS {
            break;
        }
    }
}
