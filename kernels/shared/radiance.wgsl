// The noisy input and what is measured on colours.

import package::shared::frame;
import package::shared::packing;

// rgb: linear radiance along the reflected ray; a: hit distance in world units.
@group(0) @binding(1) var in_radiance: texture_2d<f32>;

// Rec. 601 luma weights, as published.
fn luminance(c: vec3<f32>) -> f32 {
    return max(dot(c, vec3<f32>(0.299, 0.587, 0.114)), 0.001);
}

// Radiance without values that no later operation could contain: NaN and infinities count as no light.
fn clean_radiance(c: vec3<f32>) -> vec3<f32> {
    return select(vec3<f32>(0.0), clamp(c, vec3<f32>(0.0), vec3<f32>(HALF_MAX)), all_finite(c));
}

// Noisy radiance in the exposure that the filters work in.
fn load_radiance(pixel: vec2<u32>) -> vec3<f32> {
    return clean_radiance(textureLoad(in_radiance, pixel, 0).rgb * frame.exposure);
}

// How far two colours are apart in brightness, 0..1.
fn temporal_variance(a: vec3<f32>, b: vec3<f32>) -> f32 {
    let la = luminance(a);
    let lb = luminance(b);
    let d = abs(la - lb) / max(max(la, lb), frame.variance_luminance_floor);
    return d * d;
}
