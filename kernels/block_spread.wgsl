//! Block spread: filters blocks over the footprint of the lobe.
//!
//! in   blocks   rgba32uint   block   of the input, or of what was accumulated
//! in   tiles, args   lists           tiles to denoise
//! out  blocks   rgba32uint   block   with its excess, and how far to believe that, or its radiance, filtered
//!
//! Grid: one invocation a block, workgroups of the blocks of 16 listed tiles (indirect).
//! Up to 2 WIDE_TAPS + 1 taps a side, 81 in all, on a grid that stretches with the footprint; narrow ones take fewer.

import package::shared::frame;
import package::shared::packing;
import package::shared::footprint;
import package::shared::blocks;
import package::shared::tiles;

// Filters the radiance that was accumulated, not the excess of the input.
override ACCUMULATED: bool = false;
// Most taps on either side of the centre, along and across.
override WIDE_TAPS: i32 = 4;

// Of how many equally bright blocks the excess has to be the mean to be believed by half.
const EXCESS_DOUBT: f32 = 2.0;
// Neighbouring blocks hold the same outliers: after the mean over 3x3 blocks, so many of them. Blocks further apart hold
// others, and count for more.
const BLOCKS_OF_OUTLIER: f32 = 8.0;

@group(1) @binding(0) var in_blocks: texture_2d<u32>;
@group(1) @binding(1) var out_blocks: texture_storage_2d<rgba32uint, write>;
@group(1) @binding(2) var<storage, read> in_tiles: array<u32>;
@group(1) @binding(3) var<storage, read> in_args: array<vec4<u32>, 4>;

@compute @workgroup_size(64)
fn block_spread(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let index = block_list_index(group, lane);
    if index >= in_args[0].w {
        return;
    }
    let last = last_block();
    let center = vec2<i32>(block_of_tile(unpack_tile(in_tiles[index]), lane));
    if any(center > last) {
        return;
    }
    let texel = textureLoad(in_blocks, center, 0);
    var block = unpack_block(texel);
    if !block.guide.denoised {
        textureStore(out_blocks, center, texel);
        return;
    }
    let position = position_at(block_place(center), block.guide.depth);
    let plane = plane_of(block.guide, position);
    let footprint = lobe_footprint(position, block.guide, block.share);
    var scale = frame.excess_scale;
    if ACCUMULATED {
        scale = frame.filter_scale;
    }
    // In blocks.
    let radius = max(vec2<f32>(footprint.along, footprint.across) * (scale / f32(BLOCK_SIZE)), vec2<f32>(0.5));
    let side = side_of(footprint.axis);
    // Every block within the half axes, or as many taps as there may be.
    let reach = clamp(vec2<i32>(ceil(radius)), vec2<i32>(1), vec2<i32>(WIDE_TAPS));
    let step = max(radius / f32(WIDE_TAPS), vec2<f32>(1.0));
    let taps = (2 * reach.x + 1) * (2 * reach.y + 1);
    let far = vec2<f32>(reach);
    // Steps along and across, on screen; from there to units of the half axes.
    let along = footprint.axis * step.x;
    let across = side * step.y;
    let inverse_radius = 1.0 / radius;
    let rho_x = vec2<f32>(footprint.axis.x, side.x) * inverse_radius;
    let rho_y = vec2<f32>(footprint.axis.y, side.y) * inverse_radius;
    // rgb: radiance or excess; a: weight.
    var sum = vec4<f32>(0.0);
    // Of luminance times weight.
    var squares = 0.0;
    var grid = -far;
    for (var i = 0; i < taps; i++) {
        let offset = round(along * grid.x + across * grid.y);
        let is_end = grid.x >= far.x;
        grid = vec2<f32>(select(grid.x + 1.0, -far.x, is_end), select(grid.y, grid.y + 1.0, is_end));
        let wanted = center + vec2<i32>(offset);
        let at = clamp(wanted, vec2<i32>(0), last);
        let tap = unpack_block(textureLoad(in_blocks, at, 0));
        let rho = offset.x * rho_x + offset.y * rho_y;
        let penalty = plane_penalty(plane, tap.guide, block_place(at)) + 1.2 * dot(rho, rho);
        let fits = tap.guide.denoised && all(at == wanted);
        let apart = (tap.share - block.share) * (1.0 / BLOCK_SHARE_TOLERANCE);
        let w = select(0.0, exp(-penalty - apart * apart), fits);
        if ACCUMULATED {
            sum += vec4<f32>(tap.radiance, 1.0) * w;
        } else {
            sum += vec4<f32>(tap.excess, 1.0) * w;
            let l = luminance(tap.excess) * w;
            squares += l * l;
        }
    }
    let mean = sum.rgb / max(sum.w, 1e-6);
    if ACCUMULATED {
        block.radiance = mean;
    } else {
        // Where the footprint is smaller than a pixel there is nothing to spread over.
        block.excess = select(mean, vec3<f32>(0.0), footprint.along < 0.5);
        let l = luminance(sum.rgb);
        let doubt = EXCESS_DOUBT / min(step.x * step.y, BLOCKS_OF_OUTLIER);
        block.certainty = l * l / max(l * l + doubt * squares, 1e-30);
    }
    textureStore(out_blocks, center, pack_block(block));
}
