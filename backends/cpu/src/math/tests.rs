//! Sweeps against f64 and straightforward definitions. `--nocapture` prints the largest errors found; the environment
//! variable `MATH_STRIDE` sets the step between the bit patterns tried (1 is exhaustive, and slow).

use super::*;
use proptest::prelude::*;

const INF: f32 = f32::INFINITY;
const TAU: f64 = std::f64::consts::TAU;

fn stride() -> usize {
    let default = if cfg!(debug_assertions) { 20_011 } else { 1009 };
    std::env::var("MATH_STRIDE").ok().and_then(|s| s.parse().ok()).unwrap_or(default)
}

/// Bit patterns of all kinds of floats: a sweep and everything near to the special ones.
fn floats() -> impl Iterator<Item = f32> {
    let near = [0u32, 0x7f80_0000, 0x0080_0000, 0x3f80_0000, 0x3f00_0000, 0x4b00_0000, 0x4f00_0000, 0x4f80_0000]
        .into_iter()
        .flat_map(|b| (0..200).map(move |i| b.wrapping_add(i).wrapping_sub(100)))
        .flat_map(|b| [b, b ^ 0x8000_0000]);
    near.chain((0..=u32::MAX).step_by(stride())).map(f32::from_bits)
}

/// Distance from `want` in its units in the last place, as if there were no largest float; infinite if only one is NaN.
fn ulps(got: f32, want: f64) -> f64 {
    const LIMIT: f64 = 340_282_366_920_938_463_463_374_607_431_768_211_456.0;
    if got.is_nan() || want.is_nan() {
        return if got.is_nan() == want.is_nan() { 0.0 } else { f64::INFINITY };
    }
    let want = want.clamp(-LIMIT, LIMIT);
    let got = if got.is_infinite() { LIMIT.copysign(got as f64) } else { got as f64 };
    let exponent = ((want.abs().to_bits() >> 52) as i32 - 1023).clamp(-126, 127);
    (got - want).abs() / 2f64.powi(exponent - 23)
}

#[track_caller]
fn sweep(name: &str, f: impl Fn(f32) -> f32, oracle: impl Fn(f64) -> f64, domain: impl Fn(f32) -> bool, bound: f64) {
    let (mut worst, mut at) = (0.0, 0.0);
    for x in floats().filter(|&x| domain(x)) {
        let e = ulps(f(x), oracle(x as f64));
        if e > worst {
            (worst, at) = (e, x);
        }
    }
    println!("{name}: {worst:.3} ulp at {at:?}");
    assert!(worst <= bound, "{name}: {worst} ulp at {at:?}: {:?}, should be {}", f(at), oracle(at as f64));
}

#[track_caller]
fn sweep_absolute(name: &str, f: impl Fn(f32) -> f32, oracle: impl Fn(f64) -> f64, limit: f32, bound: f64) {
    let worst =
        floats().filter(|x| x.abs() <= limit).map(|x| (f(x) as f64 - oracle(x as f64)).abs()).fold(0.0, f64::max);
    println!("{name}, |x| <= {limit}: {worst:.3e} absolute (2^{:.1})", worst.log2());
    assert!(worst <= bound);
}

fn any(_: f32) -> bool {
    true
}

fn same(a: f32, b: f32) -> bool {
    a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan())
}

#[test]
fn exponentials() {
    sweep("exp2", exp2, f64::exp2, any, 1.2);
    sweep("exp", exp, f64::exp, any, 1.1);
    for n in -149..128 {
        assert_eq!(exp2(n as f32), 2f64.powi(n) as f32);
    }
    assert_eq!(exp2(-149.0).to_bits(), 1);
    assert_eq!([exp2(128.0), exp2(INF), exp2(-151.0), exp2(-INF)], [INF, INF, 0.0, 0.0]);
    assert_eq!([exp(89.0), exp(INF), exp(-104.0), exp(-INF), exp(0.0)], [INF, INF, 0.0, 0.0, 1.0]);
}

#[test]
fn logarithms() {
    sweep("log2", log2, f64::log2, any, 1.4);
    sweep("log", log, f64::ln, any, 1.1);
    sweep("log2 near 1", log2, f64::log2, |x| (0.7..1.5).contains(&x), 1.5);
    for n in -149..128 {
        assert_eq!(log2(2f64.powi(n) as f32), n as f32);
    }
    for f in [log, log2] {
        assert_eq!([f(0.0), f(-0.0), f(INF), f(1.0)], [-INF, -INF, INF, 0.0]);
        assert!(f(-1.0).is_nan() && f(-INF).is_nan() && f(-1e-40).is_nan() && f(f32::NAN).is_nan());
    }
}

#[test]
fn powers() {
    let mut worst = (0.0, 0.0, 0.0);
    let mut check = |x: f32, y: f32| {
        let e = ulps(pow(x, y), (x as f64).powf(y as f64));
        if e > worst.0 {
            worst = (e, x, y);
        }
    };
    let step = stride().div_ceil(500).max(4);
    for bits in (0x3f66_6666..0x3f80_0000).step_by(step) {
        check(f32::from_bits(bits), 512.0);
        check(f32::from_bits(bits + 0x0020_0000), 7.3);
    }
    for y in [-30.5, -2.0, -0.5, 1e-3, 1.0 / 2.4, 0.5, 1.0, 2.0, 2.2, 3.0, 11.7, 1e5] {
        for x in floats().step_by(4).map(f32::abs).filter(|x| x.is_finite() && *x > 0.0) {
            check(x, y);
        }
    }
    // Exponents that bring the result anywhere into the range of floats.
    for (i, x) in floats().step_by(2).map(f32::abs).filter(|x| x.is_finite() && *x > 0.0 && *x != 1.0).enumerate() {
        let target = (i as f64 * 0.618).fract() * 277.0 - 149.0;
        check(x, (target / (x as f64).log2()) as f32);
    }
    println!("pow: {:.3} ulp at {:?}^{:?}", worst.0, worst.1, worst.2);
    assert!(worst.0 <= 1.2);

    for y in [1e-3, 0.5, 1.0, 2.0, 1e30, INF] {
        assert_eq!([pow(0.0, y), pow(-0.0, y), pow(INF, y)], [0.0, 0.0, INF]);
        assert_eq!([pow(0.0, -y), pow(-0.0, -y), pow(INF, -y)], [INF, INF, 0.0]);
        assert!(pow(-1.0, y).is_nan() && pow(f32::NAN, y).is_nan() && pow(-INF, y).is_nan());
    }
    for x in [0.0, -0.0, 1e-45, 0.3, 1.0, 1e30, INF] {
        assert_eq!([pow(x, 0.0), pow(x, -0.0)], [1.0, 1.0]);
        assert!(pow(x, f32::NAN).is_nan());
    }
    assert_eq!([pow(2.0, INF), pow(2.0, -INF), pow(0.5, INF), pow(0.5, -INF)], [INF, 0.0, 0.0, INF]);
    assert!(pow(-2.0, 0.0).is_nan() && pow(f32::NAN, 0.0).is_nan() && pow(1.0, INF).is_nan());
    assert_eq!([pow(2.0, -149.0).to_bits(), pow(2.0, 10.0) as u32, pow(9.0, 0.5) as u32], [1, 1024, 3]);
}

#[test]
fn roots() {
    sweep("sqrt", sqrt, f64::sqrt, any, 0.5);
    sweep("inverse_sqrt", inverse_sqrt, |x| 1.0 / x.sqrt(), any, 1.5);
}

#[test]
fn circular() {
    let small = |x: f32| x.abs() <= 100.0;
    sweep("sin", sin, f64::sin, small, 2.6);
    sweep("cos", cos, f64::cos, small, 2.6);
    sweep("tan", tan, f64::tan, small, 4.5);
    for (name, f, oracle) in [("sin", sin as fn(f32) -> f32, f64::sin as fn(f64) -> f64), ("cos", cos, f64::cos)] {
        sweep_absolute(name, f, oracle, std::f32::consts::PI, 2e-7);
        sweep_absolute(name, f, oracle, 1e5, 2e-7);
        for x in floats() {
            let r = f(x);
            assert!(if x.is_finite() { r.abs() <= 1.0 } else { r.is_nan() }, "{name}({x:?}) = {r:?}");
        }
    }
    // Closest to multiples of pi/2, where the reduction loses most.
    let mut worst = 0.0f64;
    for k in 1..100 {
        let x = (k as f64 * TAU / 4.0) as f32;
        if x <= 100.0 {
            worst = worst.max(ulps(sin(x), (x as f64).sin())).max(ulps(cos(x), (x as f64).cos()));
        }
    }
    println!("sin, cos at zeros up to 100: {worst:.3} ulp");
    assert!(worst <= 4.0);
    assert_eq!([sin(0.0), cos(0.0), tan(0.0)], [0.0, 1.0, 0.0]);
    assert!(tan(INF).is_nan() && tan(f32::NAN).is_nan());
}

#[test]
fn inverse_circular() {
    sweep("asin", asin, f64::asin, any, 3.0);
    sweep("acos", acos, f64::acos, any, 3.0);
    sweep("atan", atan, f64::atan, any, 3.0);
    let mut worst = 0.0f64;
    let scales = [1.0, 1e-3, 1e3, 1e-30, 1e30, 1e-42, 1e8];
    for (i, x) in floats().enumerate() {
        let y = ((i as f32 * 0.618).fract() * 3.0 - 1.5) * scales[i % 7] * if i % 2 == 0 { x } else { 1.0 };
        worst = worst.max(ulps(atan2(y, x), (y as f64).atan2(x as f64)));
        worst = worst.max(ulps(atan2(x, y), (x as f64).atan2(y as f64)));
    }
    println!("atan2: {worst:.3} ulp");
    assert!(worst <= 3.0);
    let special = [0.0, -0.0, 1.0, -1.0, 1e-45, -1e-45, 3e38, -3e38, INF, -INF, f32::NAN];
    for (y, x) in special.iter().flat_map(|&y| special.iter().map(move |&x| (y, x))) {
        let (got, want) = (atan2(y, x), (y as f64).atan2(x as f64));
        assert!(ulps(got, want) <= 1.0, "atan2({y:?}, {x:?}) = {got:?}, should be {want:?}");
        assert!(got.is_nan() || got.is_sign_negative() == want.is_sign_negative(), "atan2({y:?}, {x:?})");
    }
}

#[test]
fn hyperbolic_functions() {
    sweep("sinh", sinh, f64::sinh, any, 3.0);
    sweep("cosh", cosh, f64::cosh, any, 3.0);
    sweep("tanh", tanh, f64::tanh, any, 3.0);
    sweep("asinh", asinh, |x| x.abs().asinh().copysign(x), any, 4.0);
    sweep("acosh", acosh, f64::acosh, any, 3.0);
    sweep("atanh", atanh, f64::atanh, any, 3.0);
    assert_eq!(
        [sinh(89.0), sinh(INF), sinh(-INF), cosh(-INF), tanh(INF), tanh(-INF)],
        [89f64.sinh() as f32, INF, -INF, INF, 1.0, -1.0]
    );
    assert_eq!([atanh(1.0), atanh(-1.0), acosh(1.0), acosh(INF), asinh(-INF)], [INF, -INF, 0.0, INF, -INF]);
    assert!(acosh(0.5).is_nan() && acosh(-2.0).is_nan() && atanh(1.5).is_nan());
}

#[test]
fn rounding() {
    let halves = (-2000..2000).map(|i| i as f32 / 4.0);
    for x in floats().chain(halves) {
        assert!(same(round_ties_even(x), x.round_ties_even()), "{x:?}");
        assert!(same(floor(x), x.floor()), "{x:?}: {:?}", floor(x));
        assert!(same(ceil(x), x.ceil()), "{x:?}: {:?}", ceil(x));
        assert!(same(trunc(x), x.trunc()), "{x:?}: {:?}", trunc(x));
        assert!(same(fract(x), x - x.floor()), "{x:?}");
    }
}

#[test]
fn smaller_and_larger() {
    let nan = f32::NAN;
    assert_eq!(
        [min(1.0, 2.0), min(2.0, 1.0), min(nan, 1.0), min(1.0, nan), min(-INF, INF)],
        [1.0, 1.0, 1.0, 1.0, -INF]
    );
    assert_eq!([max(1.0, 2.0), max(2.0, 1.0), max(nan, 1.0), max(1.0, nan), max(-INF, INF)], [2.0, 2.0, 1.0, 1.0, INF]);
    assert!(min(nan, nan).is_nan() && max(nan, nan).is_nan());
    assert_eq!([saturate(nan), saturate(-1.0), saturate(0.25), saturate(INF)], [0.0, 0.0, 0.25, 1.0]);
    assert_eq!([float_remainder(-7.5, 2.0), float_remainder(7.5, -2.0)], [-1.5, 1.5]);
    assert!(float_remainder(1.0, 0.0).is_nan());
}

#[test]
fn halves_to_floats() {
    for h in 0..=u16::MAX {
        let want = half::f16::from_bits(h).to_f32();
        let got = half_to_float(h as u32 | 0xabcd_0000);
        assert!(same(got, want), "{h:04x}: {got:?}, should be {want:?}");
        assert_eq!(got.is_sign_negative(), want.is_sign_negative());
        if !want.is_nan() {
            assert_eq!(float_to_half_nearest(got), h as u32);
            assert!(same(quantize_to_f16(got), got));
        }
    }
}

fn check_to_half(x: f32) {
    let want = half::f16::from_f32(x);
    let nearest = float_to_half_nearest(x);
    if x.is_nan() {
        assert!(nearest & 0x7fff == 0x7e00, "{x:?}");
        return;
    }
    assert_eq!(nearest, want.to_bits() as u32, "{x:?}");
}

#[test]
fn floats_to_halves() {
    floats().for_each(check_to_half);
    // Every half, every middle between two, and the floats next to these.
    for h in 0..=0x7c00u32 {
        let (a, b) = (half_to_float(h), half_to_float((h + 1).min(0x7bff)));
        for centre in [a, (a + b) / 2.0, 65520.0, 65536.0] {
            for delta in [-2i32, -1, 0, 1, 2] {
                let x = f32::from_bits(centre.to_bits().wrapping_add_signed(delta));
                check_to_half(x);
                check_to_half(-x);
            }
        }
    }
    assert_eq!([float_to_half_nearest(65519.996), float_to_half_nearest(65520.0)], [0x7bff, 0x7c00]);
}

#[test]
fn floats_to_integers() {
    for x in floats().chain((-2000..2000).map(|i| i as f32 / 4.0)) {
        assert_eq!(float_to_i32(x), x as i32, "{x:?}");
        assert_eq!(float_to_u32(x), x as u32, "{x:?}");
    }
}

#[test]
fn exponents() {
    for x in floats() {
        let (m, e) = frexp(x);
        if x == 0.0 || !x.is_finite() {
            assert!(same(m, x) && e == 0, "{x:?}");
        } else {
            assert!((0.5..1.0).contains(&m.abs()) && m as f64 * 2f64.powi(e) == x as f64, "{x:?}: {m:?} {e}");
        }
        for n in [0, 1, -1, 23, -30, 127, -127, 149, -149, 277, -277, 1000, -1000, i32::MAX, i32::MIN] {
            // Powers of two far enough out for any float, and within f64.
            let want = (x as f64 * 2f64.powi(n.clamp(-600, 600))) as f32;
            assert!(same(ldexp(x, n), want), "ldexp({x:?}, {n}) = {:?}, should be {want:?}", ldexp(x, n));
        }
    }
}

/// Any integer, with the interesting ones more often.
fn int() -> impl Strategy<Value = u32> {
    prop_oneof![
        any_int(),
        0u32..40,
        (0u32..40).prop_map(|x| x.wrapping_neg()),
        Just(1 << 31),
        (0u32..32).prop_map(|s| 1 << s)
    ]
}

fn any_int() -> impl Strategy<Value = u32> {
    (proptest::num::u32::ANY, 0u32..32).prop_map(|(x, s)| x >> s)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(20_000))]

    #[test]
    fn division(x in int(), y in int()) {
        prop_assert_eq!(div_u32(x, y), x.checked_div(y).unwrap_or(x));
        prop_assert_eq!(rem_u32(x, y), x.checked_rem(y).unwrap_or(0));
        let (x, y) = (x as i32, y as i32);
        prop_assert_eq!(div_i32(x, y), if y == 0 { x } else { x.wrapping_div(y) });
        prop_assert_eq!(rem_i32(x, y), if y == 0 { 0 } else { x.wrapping_rem(y) });
    }

    #[test]
    fn division_near_multiples(q in int(), y in int(), d in 0u32..3) {
        let x = q.wrapping_mul(y).wrapping_add(d).wrapping_sub(1);
        prop_assert_eq!(div_u32(x, y), x.checked_div(y).unwrap_or(x));
        prop_assert_eq!(rem_i32(x as i32, y as i32), if y == 0 { 0 } else { (x as i32).wrapping_rem(y as i32) });
    }

    #[test]
    fn single_bits(x in int()) {
        let ones: Vec<u32> = (0..32).filter(|i| x >> i & 1 != 0).collect();
        let lowest = ones.first().copied();
        let highest = ones.last().copied();
        prop_assert_eq!(count_one_bits(x), ones.len() as u32);
        prop_assert_eq!(count_leading_zeros(x), highest.map_or(32, |i| 31 - i));
        prop_assert_eq!(count_trailing_zeros(x), lowest.unwrap_or(32));
        prop_assert_eq!(first_leading_bit_u32(x), highest.unwrap_or(u32::MAX));
        prop_assert_eq!(first_trailing_bit(x), lowest.unwrap_or(u32::MAX));
        prop_assert_eq!(reverse_bits(x), ones.iter().map(|i| 1 << (31 - i)).sum::<u32>());
        let sign = x >> 31;
        let differing = (0..32).rev().find(|i| x >> i & 1 != sign);
        prop_assert_eq!(first_leading_bit_i32(x as i32), differing.map_or(-1, |i| i));
    }
}
