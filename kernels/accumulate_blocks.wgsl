//! Accumulate blocks: `accumulate` for whole blocks of 4x4 pixels, whose light is the same but for noise: one lookup of
//! history for all of a block, and all of its samples.
//!
//! in   radiance          any float     full    noisy input; a: hit distance
//! in   motion            any float     full    uv motion of the surface (surface motion)
//! in   hit_motion        any float     full    how far what was hit has moved (hit motion)
//! in   guide             rg32uint      full    this frame's packed G-buffer, or normal, roughness, depth
//! in   prev_guide        r32uint       full    last frame's, in fewer bits, or its normal, roughness, depth
//! in   history           rgba16float   full    last frame's `history`
//! in   blocks            rgba32uint    block   of the input: statistics, outliers' excess spread
//! in   samples           rg32uint      block   second and third largest luminance (outlier spread)
//! in   light             r32uint       block   whether the light changed (light change)
//! in   block_list, args  lists                 whole blocks
//! out  history           rgba16float   full    accumulated radiance, its length, noise and hit share
//! out  blocks            rgba32uint    block   surface, accumulated radiance, hit share; deviation over time
//!
//! Grid: one invocation a block, 64 listed blocks a workgroup (indirect). Loads 4 blocks (without interpolation 1),
//! 9 guides, 8 histories (one history: 5 and 4), 16 radiances, stores 16 histories and a block.

import package::accumulate;

@group(1) @binding(11) var out_blocks: texture_storage_2d<rgba32uint, write>;

@compute @workgroup_size(64)
fn accumulate_blocks(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let index = list_index(group) * 64u + lane;
    if index >= in_block_args[2].w {
        return;
    }
    let place = unpack_tile(in_block_list[block_count() - 1u - index]);
    let corner = place * BLOCK_SIZE;
    let pixel = corner + 1u;
    let guide = load_guide(pixel);
    let position = world_position(pixel, guide.depth);
    let quad = quad_of(pixel);
    let around = surroundings_of(pixel, plane_of(guide, position), quad.block);
    let subject = Subject(guide, position, around, around.mean, around.share, true);
    // Too rough to be clipped.
    var window: Window;
    let found = believed(chosen(candidates_of(pixel, subject), subject), subject, light_change_at(pixel), window);
    var limit = 0.0;
    var excess = vec3<f32>(0.0);
    if OUTLIER_SPREAD {
        limit = pair_limit(quad, found);
        excess = returned_excess(around, found.length, guide.roughness);
    }
    var radiance = vec3<f32>(0.0);
    var residuals = 0.0;
    var i = 0u;
    loop {
        var sample = sample_of(corner + position_in_block(i), guide, quad);
        if OUTLIER_SPREAD {
            sample = without_pair(sample + excess, limit, guide.roughness);
        }
        radiance += sample;
        residuals += squared_residual(sample, found);
        i += 1u;
        if i >= BLOCK_PIXELS {
            break;
        }
    }
    let share_of_pixel = 1.0 / f32(BLOCK_PIXELS);
    let history = continued(found, radiance * share_of_pixel, around.share, residuals * share_of_pixel);
    let texel = pack_history(history);
    for (var i = 0u; i < BLOCK_PIXELS; i++) {
        textureStore(out_history, corner + position_in_block(i), texel);
    }
    // What `block_average_accumulated` would make of these pixels.
    var block = unpack_block(textureLoad(in_blocks, place, 0));
    block.radiance = history.radiance * frame.exposure;
    block.share = history.share;
    block.deviation = sqrt(max(history.noise, 0.0));
    textureStore(out_blocks, place, pack_block(block));
}
