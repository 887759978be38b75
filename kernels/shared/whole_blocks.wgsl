// Which blocks of 4x4 pixels are accumulated and filtered as a whole.

import package::shared::frame;
import package::shared::footprint;
import package::shared::blocks;

// Half axis of the filter, in pixels, from which on its blocks are whole.
const WHOLE_FOOTPRINT: f32 = 4.0;
// And roughness.
const WHOLE_ROUGHNESS: f32 = 0.15;

fn is_filtered_whole(block: Block, place: vec2<i32>) -> bool {
    let footprint = lobe_footprint(position_at(block_place(place), block.guide.depth), block.guide, block.share);
    let is_wide = footprint.along * frame.filter_scale >= WHOLE_FOOTPRINT;
    // Below, history is clipped to each pixel's neighbours.
    let is_rough = block.guide.roughness >= max(WHOLE_ROUGHNESS, frame.accumulate_clip_roughness);
    return block.is_whole && is_wide && is_rough;
}
