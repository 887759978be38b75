// Samples far above the others of their block.

import package::shared::frame;
import package::shared::color;

// Reflections of mirrors hold no noise of the lobe: what is bright there is so.
const OUTLIER_ROUGHNESS: f32 = 0.015;

// Radiance cut off far above the rest of its block, whose second largest luminance is `second`.
fn without_outlier(radiance: vec3<f32>, second: f32, roughness: f32) -> vec3<f32> {
    let l = luminance(radiance);
    return radiance * select(min(1.0, frame.outlier_factor * second / l), 1.0, roughness < OUTLIER_ROUGHNESS);
}
