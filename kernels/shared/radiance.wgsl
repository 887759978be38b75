// The noisy input.

import package::shared::frame;
import package::shared::packing;
import package::shared::color;

// rgb: linear radiance along the reflected ray; a: hit distance in world units.
@group(0) @binding(1) var in_radiance: texture_2d<f32>;

// Radiance without values that no later operation could contain: NaN and infinities count as no light.
fn clean_radiance(c: vec3<f32>) -> vec3<f32> {
    return select(vec3<f32>(0.0), clamp(c, vec3<f32>(0.0), vec3<f32>(HALF_MAX)), all_finite(c));
}

// Noisy radiance in the exposure that the filters work in.
fn load_radiance(pixel: vec2<u32>) -> vec3<f32> {
    return clean_radiance(textureLoad(in_radiance, pixel, 0).rgb * frame.exposure);
}
