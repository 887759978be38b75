// Samples far above the others of their block.

import package::shared::frame;
import package::shared::color;

// Reflections of mirrors hold no noise of the lobe: what is bright there is so.
const OUTLIER_ROUGHNESS: f32 = 0.015;

// Radiance cut off far above the rest of its block. `peaks`: the block's largest luminance and the next.
fn without_outlier(radiance: vec3<f32>, peaks: vec2<f32>, roughness: f32) -> vec3<f32> {
    let l = luminance(radiance);
    // Peaks are kept as half floats: the largest is only nearly equal to its sample.
    let others = select(peaks.x, peaks.y, l >= 0.998 * peaks.x);
    return radiance * select(min(1.0, frame.outlier_factor * others / l), 1.0, roughness < OUTLIER_ROUGHNESS);
}
