// What is measured on colours.

import package::shared::frame;

// Rec. 601 luma weights, as published.
fn luminance(c: vec3<f32>) -> f32 {
    return max(dot(c, vec3<f32>(0.299, 0.587, 0.114)), 0.001);
}

// How far two colours are apart in brightness, 0..1.
fn temporal_variance(a: vec3<f32>, b: vec3<f32>) -> f32 {
    let la = luminance(a);
    let lb = luminance(b);
    let d = abs(la - lb) / max(max(la, lb), frame.variance_luminance_floor);
    return d * d;
}
