//! Exponentials, logarithms, powers and the functions that take floats apart by exponent.

use super::{ROUND_MAGIC, horner};

/// `(2^f - 1) / f` for |f| <= 1/2; relative error 2^-28.3 of `2^f`.
const EXP2: [f32; 6] =
    [std::f32::consts::LN_2, 0.240_226_48, 0.055_503_596, 0.009_618_506, 0.001_339_102_4, 0.000_153_267_86];

/// `(e^r - 1 - r) / r^2` for |r| <= ln(2) / 2; relative error 2^-28.2 of `e^r`.
const EXP: [f32; 5] = [0.499_999_94, 0.166_665_21, 0.041_668_29, 0.008_368_704, 0.001_381_893_9];

/// `log2(1 + f) / f - 1` for 1 + f in sqrt(1/2)..sqrt(2); relative error 2^-27.0 of `log2(1 + f)`.
const LOG2: [f32; 10] = [
    0.442_695_05,
    -0.721_347_5,
    0.480_896_5,
    -0.360_682_58,
    0.288_618_8,
    -0.239_952_15,
    0.204_156_77,
    -0.188_254_43,
    0.186_865_33,
    -0.116_394_51,
];

/// `(ln(1 + f) - f + f^2 / 2) / f^3` for 1 + f in sqrt(1/2)..sqrt(2); relative error 2^-27.4 of `ln(1 + f)`.
const LOG: [f32; 8] =
    [0.333_333_3, -0.250_008_2, 0.200_012_42, -0.166_234_09, 0.142_015_8, -0.131_596_1, 0.127_622_13, -0.076_364_28];

/// `log2((1 + s) / (1 - s)) / s` in `s^2`, |s| <= (sqrt(2) - 1) / (sqrt(2) + 1); relative error 2^-37.8.
const POW_LOG2: [f64; 5] =
    [2.8853900817900935, 0.9617966733331327, 0.5770835866913727, 0.4116726104918923, 0.34073220307905383];

/// Upper 15 bits of ln(2), so that its product with any exponent is exact.
const LN2_HI: f32 = f32::from_bits(0x3f31_7200);
/// The rest of ln(2).
const LN2_LO: f32 = (std::f64::consts::LN_2 - LN2_HI as f64) as f32;

/// 1.5 * 2^52: adding it rounds a small f64 to an integer, which then is the low bits of the sum.
const ROUND_MAGIC_64: f64 = 6_755_399_441_055_744.0;

/// `2^n` for n in -126..=127; garbage but no panic otherwise.
#[inline(always)]
fn pow2(n: i32) -> f32 {
    f32::from_bits((n.wrapping_add(127) as u32) << 23)
}

/// `p * 2^n` for |n| <= 252 and p near 1, rounded once even if the result is denormal.
#[inline(always)]
fn scale(p: f32, n: i32) -> f32 {
    let n1 = n >> 1;
    let n2 = n.wrapping_sub(n1);
    p * pow2(n1) * pow2(n2)
}

/// `2^f` for |f| <= 1/2.
#[inline(always)]
fn exp2_fraction(f: f32) -> f32 {
    1.0 + f * horner(f, &EXP2)
}

/// Takes x > 0 apart into `(f, e)` with `x = (1 + f) 2^e` and 1 + f in sqrt(1/2)..sqrt(2); exact, also for denormals.
#[inline(always)]
fn split(x: f32) -> (f32, i32) {
    const SQRT_HALF: u32 = 0x3f35_04f3;
    let tiny = x < f32::MIN_POSITIVE;
    let scaled = x * super::TWO_23;
    let bits = if tiny { scaled } else { x }.to_bits().wrapping_sub(SQRT_HALF);
    let e = ((bits as i32) >> 23) - if tiny { 23 } else { 0 };
    let m = f32::from_bits((bits & 0x007f_ffff) + SQRT_HALF);
    (m - 1.0, e)
}

/// Replaces the result `r` of a logarithm where `x` is not a positive finite number.
#[inline(always)]
fn log_special(x: f32, r: f32) -> f32 {
    let r = if x == f32::INFINITY { x } else { r };
    let r = if x == 0.0 { f32::NEG_INFINITY } else { r };
    if (x < 0.0) | x.is_nan() { f32::NAN } else { r }
}

/// `2^x`; at most 1.07 ulp off. Overflows to infinity, underflows through the denormals to zero.
#[inline(always)]
pub(crate) fn exp2(x: f32) -> f32 {
    let t = if x > 129.0 { 129.0 } else { x };
    let t = if t < -160.0 { -160.0 } else { t };
    let magic = t + ROUND_MAGIC;
    let n = magic.to_bits().wrapping_sub(ROUND_MAGIC.to_bits()) as i32;
    scale(exp2_fraction(t - (magic - ROUND_MAGIC)), n)
}

/// `e^x 2^shift` for |shift| <= 1, without overflow in between.
#[inline(always)]
pub(super) fn exp_scaled(x: f32, shift: i32) -> f32 {
    let t = if x > 90.0 { 90.0 } else { x };
    let t = if t < -110.0 { -110.0 } else { t };
    let magic = t * std::f32::consts::LOG2_E + ROUND_MAGIC;
    let n = magic.to_bits().wrapping_sub(ROUND_MAGIC.to_bits()) as i32;
    let k = magic - ROUND_MAGIC;
    let r = (t - k * LN2_HI) - k * LN2_LO;
    let p = 1.0 + (r + r * r * horner(r, &EXP));
    scale(p, n.wrapping_add(shift))
}

/// `e^x`; at most 0.98 ulp off. Overflows to infinity, underflows through the denormals to zero.
#[inline(always)]
pub(crate) fn exp(x: f32) -> f32 {
    exp_scaled(x, 0)
}

/// Base 2 logarithm; at most 1.31 ulp off, exact at powers of two. -infinity at zero, NaN below it.
#[inline(always)]
pub(crate) fn log2(x: f32) -> f32 {
    let (f, e) = split(x);
    let r = e as f32 + (f + f * horner(f, &LOG2));
    log_special(x, r)
}

/// Natural logarithm; at most 0.85 ulp off. -infinity at zero, NaN below it.
#[inline(always)]
pub(crate) fn log(x: f32) -> f32 {
    let (f, e) = split(x);
    let e = e as f32;
    let z = f * f;
    let tail = f * z * horner(f, &LOG) + e * LN2_LO;
    let r = e * LN2_HI + (f + (tail - 0.5 * z));
    log_special(x, r)
}

/// `x^y` as `exp2(y * log2(x))` with the exponent carried in double precision; at most 1.17 ulp off.
///
/// NaN if `x` is negative (whatever `y`) or either is NaN; -0 counts as 0. 1 if `y` is zero, also for x = 0 and
/// x = infinity; 0 or infinity for x = 0 as `y` is positive or negative; NaN for 1 to an infinite power.
#[inline(always)]
pub(crate) fn pow(x: f32, y: f32) -> f32 {
    let (f, e) = split(x);
    let e = if x == f32::INFINITY { x } else { e as f32 };
    let e = if x == 0.0 { f32::NEG_INFINITY } else { e };
    let f = f as f64;
    let s = f / (2.0 + f);
    let z = s * s;
    let [c0, c1, c2, c3, c4] = POW_LOG2;
    let log = e as f64 + s * (c0 + z * (c1 + z * (c2 + z * (c3 + z * c4))));
    let t = y as f64 * log;
    let t = if t > 129.0 { 129.0 } else { t };
    let t = if t < -160.0 { -160.0 } else { t };
    let magic = t + ROUND_MAGIC_64;
    let n = magic.to_bits() as i32;
    let r = scale(exp2_fraction((t - (magic - ROUND_MAGIC_64)) as f32), n);
    let r = if y == 0.0 { 1.0 } else { r };
    if (x < 0.0) | x.is_nan() { f32::NAN } else { r }
}

/// `ln(1 + v)` for v >= 0 or NaN; about 2 ulp off.
#[inline(always)]
pub(super) fn log1p(v: f32) -> f32 {
    let u = 1.0 + v;
    let lost = if v < 1.0 { v - (u - 1.0) } else { 1.0 - (u - v) };
    let correction = lost / u;
    let r = log(u);
    let corrected = r + correction;
    if u == f32::INFINITY { r } else { corrected }
}

/// Mantissa in 1/2..1 with the sign of `x`, and exponent; for finite x other than 0.
#[inline(always)]
fn mantissa_exponent(x: f32) -> (f32, i32) {
    let tiny = x.abs() < f32::MIN_POSITIVE;
    let scaled = x * super::TWO_23;
    let bits = if tiny { scaled } else { x }.to_bits();
    let e = ((bits >> 23) & 0xff) as i32 - if tiny { 126 + 23 } else { 126 };
    (f32::from_bits((bits & 0x807f_ffff) | 0x3f00_0000), e)
}

/// `x 2^e`, correctly rounded for all `x` and `e`: saturates to infinity or (signed) zero, denormals included.
#[inline(always)]
pub(crate) fn ldexp(x: f32, e: i32) -> f32 {
    let (m, own) = mantissa_exponent(x);
    let n = (own + e.clamp(-400, 400)).clamp(-200, 200);
    let r = scale(m, n);
    let special = (x == 0.0) | (x.abs() == f32::INFINITY) | x.is_nan();
    if special { x } else { r }
}

/// `(fraction, exponent)` with `x = fraction * 2^exponent`, fraction in 1/2..1 (with sign); exact, also for denormals.
/// Zeros, infinities and NaN come back as they are with exponent 0.
#[inline(always)]
pub(crate) fn frexp(x: f32) -> (f32, i32) {
    let (m, e) = mantissa_exponent(x);
    let special = (x == 0.0) | (x.abs() == f32::INFINITY) | x.is_nan();
    (if special { x } else { m }, if special { 0 } else { e })
}
