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
    let plane = pixel_plane_of(guide, world_position(outer, guide.depth));
    let top_left = block_tap(corner_of(first, 0u).block, plane, own.share);
    let top_right = block_tap(corner_of(first, 1u).block, plane, own.share);
    let bottom_left = block_tap(corner_of(first, 2u).block, plane, own.share);
    let bottom_right = block_tap(corner_of(first, 3u).block, plane, own.share);
    for (var i = 0u; i < 4u; i++) {
        let pixel = first + vec2<u32>(i & 1u, i >> 1u);
        let after = between_blocks(pixel).fraction;
        let before = 1.0 - after;
        let w = vec4<f32>(before.x, after.x, before.x, after.x) * vec4<f32>(before.y, before.y, after.y, after.y);
        let top = top_left.fitting * w.x + top_right.fitting * w.y;
        let bottom = bottom_left.fitting * w.z + bottom_right.fitting * w.w;
        let variances = vec4<f32>(top_left.variance, top_right.variance, bottom_left.variance, bottom_right.variance);
        let wide = wide_of(top + bottom, dot(variances, w));
        store_result(pixel, without_exposure(vec4<f32>(wide.radiance, wide.variance)));
    }
}
