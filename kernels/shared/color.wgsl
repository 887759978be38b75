// What is measured on colours, and how they are mixed.

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

// From `a` at 0 to `b` at 1. What `mix` is on some devices, a + (b - a) t, leaves the rounding error of an `a` that is
// far larger than `b` even where t is 1.
fn blend(a: vec3<f32>, b: vec3<f32>, t: f32) -> vec3<f32> {
    return a * (1.0 - t) + b * t;
}
