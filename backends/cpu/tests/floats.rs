//! Float arithmetic, exactly, at special values too.

mod support;

use half::f16;
use support::expression::{check_exact, evaluate, same};

/// Numbers of all sizes, special ones among them.
fn numbers() -> Vec<f32> {
    let mut numbers = vec![0.0, f32::INFINITY, f32::NAN, f32::MAX, f32::MIN_POSITIVE, 1e-40, f32::from_bits(1)];
    numbers.extend([1.0, 0.5, 1.5, 2.0, 2.5, 3.0, 0.1, 0.499_999_97, 0.999_999_94, 1.000_000_1, 10.0, 100.25, 1e-3]);
    numbers.extend([8_388_607.5, 8_388_609.0, 16_777_215.0, 1e9, 3e9, 1e20, 1e-20, 1e38, std::f32::consts::PI, 88.0]);
    let negative: Vec<f32> = numbers.iter().map(|number| -number).collect();
    [numbers, negative].concat()
}

fn singles() -> Vec<[f32; 3]> {
    numbers().into_iter().map(|number| [number, 0.0, 0.0]).collect()
}

fn pairs() -> Vec<[f32; 3]> {
    let numbers = numbers();
    numbers.iter().flat_map(|&a| numbers.iter().map(move |&b| [a, b, 0.0])).collect()
}

#[test]
fn arithmetic_rounds_to_nearest_and_keeps_what_is_special() {
    check_exact("a + b", &pairs(), |a, b, _| a + b);
    check_exact("a - b", &pairs(), |a, b, _| a - b);
    check_exact("a * b", &pairs(), |a, b, _| a * b);
    check_exact("a / b", &pairs(), |a, b, _| a / b);
    check_exact("a * b + c", &pairs(), |a, b, c| a * b + c);
    check_exact("-a", &singles(), |a, _, _| -a);
}

#[test]
fn remainder_has_the_sign_of_the_dividend() {
    let small: Vec<_> =
        pairs().into_iter().filter(|[a, b, _]| *b != 0.0 && b.is_finite() && (a / b).abs() < 1e6).collect();
    // As WGSL defines it.
    check_exact("a % b", &small, |a, b, _| a - b * (a / b).trunc());
}

#[test]
fn comparisons_with_nan_are_false() {
    let code = "f32(u32(a < b) + 2u * u32(a <= b) + 4u * u32(a > b) + 8u * u32(a >= b) + 16u * u32(a == b)
        + 32u * u32(a != b) + 64u * u32(!(a < b)))";
    check_exact(code, &pairs(), |a, b, _| {
        let below = a < b;
        let set = [below, a <= b, a > b, a >= b, a == b, a != b, !below];
        set.into_iter().enumerate().map(|(bit, set)| u32::from(set) << bit).sum::<u32>() as f32
    });
}

#[test]
fn rounding_functions() {
    check_exact("floor(a)", &singles(), |a, _, _| a.floor());
    check_exact("ceil(a)", &singles(), |a, _, _| a.ceil());
    check_exact("trunc(a)", &singles(), |a, _, _| a.trunc());
    check_exact("round(a)", &singles(), |a, _, _| a.round_ties_even());
    check_exact("abs(a)", &singles(), |a, _, _| a.abs());
    check_exact("sqrt(a)", &singles(), |a, _, _| a.sqrt());
    let finite: Vec<_> = singles().into_iter().filter(|[a, ..]| a.is_finite()).collect();
    check_exact("fract(a)", &finite, |a, _, _| a - a.floor());
    let numbers: Vec<_> = singles().into_iter().filter(|[a, ..]| !a.is_nan() && *a != 0.0).collect();
    check_exact("sign(a)", &numbers, |a, _, _| a.signum());
    check_exact("abs(sign(a * 0.0))", &finite, |_, _, _| 0.0);
}

#[test]
fn minimum_maximum_clamp_and_saturate() {
    // Zeros of different signs may be taken for each other, and what a NaN gives is not defined.
    let plain: Vec<_> =
        pairs().into_iter().filter(|[a, b, _]| !a.is_nan() && !b.is_nan() && (*a != 0.0 || *b != 0.0)).collect();
    check_exact("min(a, b)", &plain, |a, b, _| a.min(b));
    check_exact("max(a, b)", &plain, |a, b, _| a.max(b));
    let numbers: Vec<_> = singles().into_iter().filter(|[a, ..]| !a.is_nan() && *a != 0.0).collect();
    check_exact("clamp(a, -2.5, 3.0)", &numbers, |a, _, _| a.clamp(-2.5, 3.0));
    check_exact("abs(saturate(a))", &numbers, |a, _, _| a.clamp(0.0, 1.0).abs());
    check_exact("step(a, b)", &plain, |a, b, _| if a <= b { 1.0 } else { 0.0 });
}

#[test]
fn fma_rounds_once() {
    let ulp = f32::EPSILON;
    let triples = [
        [1.0 + ulp, 1.0 - ulp, -1.0],
        [1.0 + ulp, 1.0 + ulp, -1.0 - 2.0 * ulp],
        [1e20, 1e20, -1e38],
        [3.0, 1.0 / 3.0, -1.0],
        [0.1, 10.0, -1.0],
    ];
    let allowed = |a: f32, b: f32, c: f32| [a.mul_add(b, c), a * b + c];
    for results in evaluate("fma(a, b, c)", &triples) {
        for (&[a, b, c], actual) in triples.iter().zip(results) {
            assert!(allowed(a, b, c).iter().any(|allowed| same(actual, *allowed)), "fma({a}, {b}, {c}) = {actual}");
        }
    }
}

#[test]
fn scaling_by_powers_of_two_and_taking_numbers_apart() {
    let mut triples = Vec::new();
    for number in [1.0f32, -1.5, 0.75, 1.999_999_9, 3e-39, f32::MAX] {
        triples.extend((-150..=128).map(|exponent| [number, exponent as f32, 0.0]));
    }
    // The exact product where it can be held, and neither denormal nor too large, of which WGSL promises nothing.
    let normal = |number: f64| number.abs() >= f64::from(f32::MIN_POSITIVE) && number.abs() <= f64::from(f32::MAX);
    let scaled = |a: f32, b: f32| f64::from(a) * 2f64.powi(b as i32);
    let held: Vec<_> = triples.iter().copied().filter(|[a, b, _]| normal(scaled(*a, *b)) && *b < 128.0).collect();
    check_exact("ldexp(a, i32(b))", &held, |a, b, _| scaled(a, b) as f32);
    let normal: Vec<_> = singles().into_iter().filter(|[a, ..]| a.is_normal()).collect();
    check_exact("ldexp(frexp(a).fract, frexp(a).exp)", &normal, |a, _, _| a);
    check_exact("modf(a).fract + modf(a).whole", &normal, |a, _, _| a);
    check_exact("modf(a).whole", &normal, |a, _, _| a.trunc());
}

#[test]
fn quantizing_to_half_floats() {
    let triples: Vec<_> = (-20..16)
        .flat_map(|exponent| {
            [1.0, 1.0 + 1.0 / 2048.0, 1.0 + 3.0 / 2048.0, -1.7, 1.999_9].map(|s| s * 2f32.powi(exponent))
        })
        .chain([0.0, -0.0, 65504.0])
        .filter(|number| number.abs() <= 65504.0 && (*number == 0.0 || number.abs() >= 2f32.powi(-14)))
        .map(|number| [number, 0.0, 0.0])
        .collect();
    check_exact("quantizeToF16(a)", &triples, |a, _, _| f16::from_f32(a).to_f32());
}

#[test]
fn packing_and_unpacking_of_halves() {
    let numbers = [0.0, -0.0, 1.0, -2.5, 65504.0, 6e-8, 1e-5, 0.1, 3.140_6, 1.0 + 1.0 / 2048.0, 1.0 + 3.0 / 2048.0];
    let triples: Vec<_> = numbers.iter().flat_map(|&a| numbers.map(|b| [a, b, 0.0])).collect();
    let half = |number: f32| u32::from(f16::from_f32(number).to_bits());
    check_exact("bitcast<f32>(pack2x16float(vec2(a, b)))", &triples, |a, b, _| f32::from_bits(half(a) | half(b) << 16));
    let halves: Vec<_> = (0..=u32::from(u16::MAX))
        .step_by(7)
        .map(|half| [f32::from_bits(half | 0x3c00_0000), f32::from_bits(half << 16 | 0x1234), 0.0])
        .filter(|[a, b, _]| !a.is_nan() && !b.is_nan())
        .collect();
    let low = |number: f32| f16::from_bits(number.to_bits() as u16).to_f32();
    let high = |number: f32| f16::from_bits((number.to_bits() >> 16) as u16).to_f32();
    check_exact("unpack2x16float(bitcast<u32>(a)).x", &halves, |a, _, _| low(a));
    check_exact("unpack2x16float(bitcast<u32>(b)).y", &halves, |_, b, _| high(b));
}

#[test]
fn packing_of_normalized_numbers() {
    let numbers: Vec<f32> = (-30..=30).map(|n| n as f32 / 24.0).chain([1e9, -1e9, 0.002, -0.003]).collect();
    let triples: Vec<_> = numbers.windows(2).map(|pair| [pair[0], pair[1], 0.0]).collect();
    let signed = |number: f32, scale: f32| (0.5 + scale * number.clamp(-1.0, 1.0)).floor() as i32 as u32;
    let unsigned = |number: f32, scale: f32| (0.5 + scale * number.clamp(0.0, 1.0)).floor() as u32;
    // Divided by a power of two as a float would lose bits, so bit by bit.
    let check = |expression: &str, expected: &dyn Fn(f32, f32) -> u32| {
        for part in [0, 1] {
            let code = format!("f32(({expression} >> {}u) & 0xffffu)", 16 * part);
            check_exact(&code, &triples, |a, b, _| (expected(a, b) >> (16 * part) & 0xffff) as f32);
        }
    };
    let halves = |a: u32, b: u32| (a & 0xffff) | b << 16;
    let bytes = |words: [u32; 4]| u32::from_le_bytes(words.map(|word| word as u8));
    check("pack2x16snorm(vec2(a, b))", &|a, b| halves(signed(a, 32767.0), signed(b, 32767.0)));
    check("pack2x16unorm(vec2(a, b))", &|a, b| halves(unsigned(a, 65535.0), unsigned(b, 65535.0)));
    check("pack4x8snorm(vec4(a, b, -b, a))", &|a, b| {
        bytes([signed(a, 127.0), signed(b, 127.0), signed(-b, 127.0), signed(a, 127.0)])
    });
    check("pack4x8unorm(vec4(a, b, -b, a))", &|a, b| {
        bytes([unsigned(a, 255.0), unsigned(b, 255.0), unsigned(-b, 255.0), unsigned(a, 255.0)])
    });
}

#[test]
fn unpacking_of_normalized_numbers() {
    let triples: Vec<_> = (0..=255u32)
        .map(|n| (n * 0x0101_0101) ^ 0x0010_7f00)
        .map(f32::from_bits)
        .filter(|number| !number.is_nan())
        .map(|number| [number, 0.0, 0.0])
        .collect();
    let byte = |number: f32, index: u32| (number.to_bits() >> (8 * index)) as u8;
    let half = |number: f32, index: u32| (number.to_bits() >> (16 * index)) as u16;
    for index in 0..4 {
        check_exact(&format!("unpack4x8unorm(bitcast<u32>(a))[{index}]"), &triples, |a, _, _| {
            f32::from(byte(a, index)) / 255.0
        });
        check_exact(&format!("unpack4x8snorm(bitcast<u32>(a))[{index}]"), &triples, |a, _, _| {
            (f32::from(byte(a, index) as i8) / 127.0).max(-1.0)
        });
    }
    for index in 0..2 {
        check_exact(&format!("unpack2x16unorm(bitcast<u32>(a))[{index}]"), &triples, |a, _, _| {
            f32::from(half(a, index)) / 65535.0
        });
        check_exact(&format!("unpack2x16snorm(bitcast<u32>(a))[{index}]"), &triples, |a, _, _| {
            (f32::from(half(a, index) as i16) / 32767.0).max(-1.0)
        });
    }
}
