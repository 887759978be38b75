//! Block average of what was accumulated: over the pixels of each 4x4 block that show its surface.
//!
//! in   history       rgba16float   full    this frame's accumulated radiance
//! in   blocks        rgba32uint    block   of the input: surface
//! in   samples       rg32uint      block   which pixels show it
//! in   tiles, args   lists                 tiles to denoise, or blocks (whole blocks)
//! out  blocks        rgba32uint    block   surface, mean radiance, hit share; deviation over time, or over the block
//!
//! Grid: one invocation a block, workgroups of the blocks of 16 listed tiles or of 64 listed blocks (indirect). Each pixel
//! is read once. Whole blocks are not among them: `accumulate_blocks` writes theirs.

import package::shared::frame;
import package::shared::packing;
import package::shared::color;
import package::shared::listed;
import package::shared::history;
import package::shared::blocks;

@group(1) @binding(1) var in_history: texture_2d<f32>;
@group(1) @binding(2) var in_blocks: texture_2d<u32>;
@group(1) @binding(3) var in_samples: texture_2d<u32>;
@group(1) @binding(4) var out_blocks: texture_storage_2d<rgba32uint, write>;

@compute @workgroup_size(64)
fn block_average_accumulated(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let place = listed_block(group, lane);
    if any(place > vec2<u32>(last_block())) {
        return;
    }
    var block = unpack_block(textureLoad(in_blocks, place, 0));
    if !block.guide.denoised {
        textureStore(out_blocks, place, vec4<u32>(0u));
        return;
    }
    let shown = unpack_samples(textureLoad(in_samples, place, 0).xy).shown;
    let corner = place * BLOCK_SIZE;
    // a: how many.
    var radiance = vec4<f32>(0.0);
    // Of brightness.
    var moments = vec2<f32>(0.0);
    var share = 0.0;
    // y: how many know it.
    var noise = vec2<f32>(0.0);
    for (var i = 0u; i < pixels_in_rows(corner); i++) {
        let pixel = min(corner + position_in_block(i), frame.size - 1u);
        let history = unpack_history(textureLoad(in_history, pixel, 0));
        let w = f32((shown >> i) & 1u);
        let c = min(history.radiance * frame.exposure, vec3<f32>(HALF_MAX));
        let b = brightness(c);
        radiance += vec4<f32>(c, 1.0) * w;
        moments += vec2<f32>(b, b * b) * w;
        share += history.share * w;
        noise += select(vec2<f32>(0.0), vec2<f32>(history.noise, 1.0) * w, history.noise >= 0.0);
    }
    let normalization = 1.0 / radiance.a;
    moments *= normalization;
    block.radiance = radiance.rgb * normalization;
    block.share = share * normalization;
    // Over time where most pixels know it.
    let over_block = max(moments.y - moments.x * moments.x, 0.0);
    let over_time = noise.x / max(noise.y, 1.0);
    block.deviation = sqrt(mix(over_block, over_time, smoothstep(0.0, 0.5, noise.y * normalization)));
    textureStore(out_blocks, place, pack_block(block));
}
