//! Expressions of floats, evaluated for many inputs.

use super::{bits, floats, run_buffers};

/// What an expression of `a`, `b` and `c` gives for each triple: varying, and as uniform values.
pub(crate) fn evaluate(expression: &str, triples: &[[f32; 3]]) -> [Vec<f32>; 2] {
    let count = triples.len();
    let words: Vec<u32> = triples.iter().flat_map(|[a, b, c]| bits(&[*a, *b, *c, 0.0])).collect();
    [("id.x", 64), ("group.x", 1)].map(|(index, size)| {
        let source = format!(
            "@group(0) @binding(0) var<storage, read_write> out: array<f32>;
            @group(0) @binding(1) var<storage, read> numbers: array<vec4<f32>>;
            @compute @workgroup_size({size}) fn main(
                @builtin(global_invocation_id) id: vec3<u32>, @builtin(workgroup_id) group: vec3<u32>,
            ) {{
                if id.x >= {count}u {{ return; }}
                let n = numbers[{index}];
                let a = n.x; let b = n.y; let c = n.z;
                out[id.x] = {expression};
            }}"
        );
        let groups = [count.div_ceil(size) as u32, 1, 1];
        floats(&run_buffers(&source, groups, &[vec![0; count], words.clone()])[0])
    })
}

pub(crate) fn same(actual: f32, expected: f32) -> bool {
    actual.to_bits() == expected.to_bits() || (actual.is_nan() && expected.is_nan())
}

pub(crate) fn check_exact(expression: &str, triples: &[[f32; 3]], expected: impl Fn(f32, f32, f32) -> f32) {
    for results in evaluate(expression, triples) {
        for (&[a, b, c], actual) in triples.iter().zip(results) {
            let expected = expected(a, b, c);
            assert!(same(actual, expected), "{expression} for {a:e}, {b:e}, {c:e}: {actual:e}, expected {expected:e}");
        }
    }
}

/// Checks against double precision, within `ulp` units in the last place or `absolute`.
pub(crate) fn check_close(
    expression: &str,
    inputs: impl IntoIterator<Item = [f32; 3]>,
    (ulp, absolute): (f64, f64),
    expected: impl Fn(f64, f64, f64) -> f64,
) {
    let triples: Vec<_> = inputs.into_iter().collect();
    for results in evaluate(expression, &triples) {
        for (&[a, b, c], actual) in triples.iter().zip(results) {
            let expected = expected(a.into(), b.into(), c.into());
            if expected.abs() > f64::from(f32::MAX) || !expected.is_finite() {
                continue;
            }
            let nearest = (expected as f32).abs().max(f32::MIN_POSITIVE);
            let error = (f64::from(actual) - expected).abs();
            let allowed = (ulp * f64::from(nearest.next_up() - nearest)).max(absolute);
            assert!(error <= allowed, "{expression} for {a:e}, {b:e}, {c:e}: {actual:e}, expected {expected:e}");
        }
    }
}

pub(crate) fn range(low: f32, high: f32) -> impl Iterator<Item = [f32; 3]> + Clone {
    (0..=500).map(move |step| [low + (high - low) * step as f32 / 500.0, 0.0, 0.0])
}

pub(crate) const TINY: f64 = 1e-37;
