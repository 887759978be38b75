//! Mathematical functions against double precision, within the errors that WGSL allows.

mod support;

use support::expression::{TINY, check_close, check_exact, range};

#[test]
fn exponentials_and_logarithms() {
    let scales = || (-120..=120).step_by(3).flat_map(|e| [1.0f32, 1.3, 1.9].map(|s| [s * 2f32.powi(e), 0.0, 0.0]));
    check_close("exp(a)", range(-20.0, 20.0), (10.0, TINY), |a, _, _| a.exp());
    check_close("exp(a)", range(-80.0, 88.0), (100.0, TINY), |a, _, _| a.exp());
    check_close("exp2(a)", range(-20.0, 20.0), (10.0, TINY), |a, _, _| a.exp2());
    check_close("exp2(a)", range(-120.0, 127.0), (100.0, TINY), |a, _, _| a.exp2());
    check_close("log(a)", scales().chain(range(0.4, 2.5)), (3.0, 2f64.powi(-21)), |a, _, _| a.ln());
    check_close("log2(a)", scales().chain(range(0.4, 2.5)), (3.0, 2f64.powi(-21)), |a, _, _| a.log2());
    check_close("inverseSqrt(a)", scales(), (2.0, 0.0), |a, _, _| a.sqrt().recip());
    let powers = range(0.01, 20.0).flat_map(|[a, ..]| [-2.5, -1.0, 0.0, 0.5, 2.0, 3.7].map(|b| [a, b, 0.0]));
    check_close("pow(a, b)", powers, (64.0, TINY), |a, b, _| a.powf(b));
}

#[test]
fn exponentials_and_logarithms_at_special_values() {
    let special = |expression: &str, a: f32, b: f32, expected: f32| {
        check_exact(expression, &[[a, b, 0.0]], |_, _, _| expected);
    };
    special("exp(a)", 0.0, 0.0, 1.0);
    special("exp(a)", f32::NEG_INFINITY, 0.0, 0.0);
    special("exp(a)", f32::INFINITY, 0.0, f32::INFINITY);
    special("exp(a)", 200.0, 0.0, f32::INFINITY);
    special("exp(a)", -200.0, 0.0, 0.0);
    special("exp(a)", f32::NAN, 0.0, f32::NAN);
    special("exp2(a)", f32::NEG_INFINITY, 0.0, 0.0);
    special("exp2(a)", f32::NAN, 0.0, f32::NAN);
    special("log(a)", 0.0, 0.0, f32::NEG_INFINITY);
    special("log(a)", f32::INFINITY, 0.0, f32::INFINITY);
    special("log(a)", -1.0, 0.0, f32::NAN);
    special("log2(a)", 0.0, 0.0, f32::NEG_INFINITY);
    special("log2(a)", f32::NAN, 0.0, f32::NAN);
    special("inverseSqrt(a)", 0.0, 0.0, f32::INFINITY);
    special("inverseSqrt(a)", f32::INFINITY, 0.0, 0.0);
    special("pow(a, b)", 0.0, 2.0, 0.0);
    special("pow(a, b)", 5.0, 0.0, 1.0);
    for exponent in -126..=127 {
        special("exp2(a)", exponent as f32, 0.0, 2f32.powi(exponent));
        special("log2(a)", 2f32.powi(exponent), 0.0, exponent as f32);
    }
}

#[test]
fn trigonometry() {
    let pi = std::f32::consts::PI;
    check_close("sin(a)", range(-pi, pi), (0.0, 2f64.powi(-11)), |a, _, _| a.sin());
    check_close("cos(a)", range(-pi, pi), (0.0, 2f64.powi(-11)), |a, _, _| a.cos());
    check_close("sin(a)", range(-200.0, 200.0), (0.0, 2f64.powi(-11)), |a, _, _| a.sin());
    check_close("tan(a)", range(-1.5, 1.5), (64.0, 2f64.powi(-10)), |a, _, _| a.tan());
    check_close("asin(a)", range(-1.0, 1.0), (4096.0, 6.81e-5), |a, _, _| a.asin());
    check_close("acos(a)", range(-1.0, 1.0), (4096.0, 6.81e-5), |a, _, _| a.acos());
    check_close("atan(a)", range(-50.0, 50.0), (4096.0, 0.0), |a, _, _| a.atan());
    let circle = range(-pi, pi).flat_map(|[a, ..]| [0.1, 1.0, 300.0].map(|r| [a.sin() * r, a.cos() * r, 0.0]));
    check_close("atan2(a, b)", circle, (4096.0, 0.0), |a, b, _| a.atan2(b));
}

#[test]
fn hyperbolic_functions() {
    check_close("sinh(a)", range(-10.0, 10.0), (64.0, 1e-6), |a, _, _| a.sinh());
    check_close("cosh(a)", range(-10.0, 10.0), (64.0, 0.0), |a, _, _| a.cosh());
    check_close("tanh(a)", range(-10.0, 10.0), (64.0, 1e-5), |a, _, _| a.tanh());
    check_close("asinh(a)", range(-10.0, 10.0), (64.0, 1e-5), |a, _, _| a.asinh());
    check_close("acosh(a)", range(1.0, 20.0), (64.0, 1e-4), |a, _, _| a.acosh());
    check_close("atanh(a)", range(-0.98, 0.98), (64.0, 1e-5), |a, _, _| a.atanh());
}

#[test]
fn geometric_functions() {
    let triples = || range(-4.0, 4.0).map(|[a, ..]| [a, 1.5 - a * a, a * 0.3 + 2.0]);
    let length = |a: f64, b: f64, c: f64| (a * a + b * b + c * c).sqrt();
    check_close("length(vec3(a, b, c))", triples(), (4.0, 0.0), length);
    check_close("distance(vec3(a, b, c), vec3(c, a, b))", triples(), (8.0, 1e-6), |a, b, c| {
        length(a - c, b - a, c - b)
    });
    check_close("normalize(vec3(a, b, c)).y", triples(), (8.0, 0.0), |a, b, c| b / length(a, b, c));
    check_close("dot(vec4(a, b, c, 1.0), vec4(b, c, 2.0, c))", triples(), (4.0, 1e-5), |a, b, c| {
        a * b + b * c + 3.0 * c
    });
    check_close("cross(vec3(a, b, c), vec3(1.0, a, b)).z", triples(), (4.0, 1e-5), |a, b, _| a * a - b);
    check_close("mix(a, b, 0.25) + mix(vec2(a), vec2(b), c).y", triples(), (8.0, 1e-5), |a, b, c| {
        a * 0.75 + b * 0.25 + a * (1.0 - c) + b * c
    });
    check_close("smoothstep(-1.0, 3.0, a)", triples(), (8.0, 1e-6), |a, _, _| {
        let t = ((a + 1.0) / 4.0).clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t)
    });
    check_close("reflect(vec2(a, b), vec2(0.6, 0.8)).x", triples(), (8.0, 1e-5), |a, b, _| {
        a - 1.2 * (0.6 * a + 0.8 * b)
    });
    check_close("faceForward(vec2(a, b), vec2(c, a), vec2(b, 1.0)).x", triples(), (0.0, 0.0), |a, b, c| {
        if ((c * b + a) as f32) < 0.0 { a } else { -a }
    });
    check_close("degrees(a) + radians(b)", triples(), (8.0, 1e-5), |a, b, _| a.to_degrees() + b.to_radians());
}

#[test]
fn refraction() {
    let triples = range(-4.0, 4.0);
    check_close("refract(vec2(0.6, -0.8), vec2(0.0, 1.0), 0.5 + abs(a) * 0.1).x", triples, (16.0, 1e-6), |a, _, _| {
        let eta = 0.5 + a.abs() * 0.1;
        if eta * eta * 0.36 > 1.0 { 0.0 } else { 0.6 * eta }
    });
}
