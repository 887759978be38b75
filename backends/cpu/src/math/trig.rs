//! Circular functions and their inverses.

use super::{ROUND_MAGIC, horner};
use std::f32::consts::{FRAC_2_PI, FRAC_PI_2, PI};

/// `(sin(r) - r) / r^3` in `r^2`, |r| <= pi/4; relative error 2^-27.8 of the sine.
const SIN: [f32; 3] = [-0.166_666_54, 0.008_332_106, -0.000_195_078_74];
/// `(cos(r) - 1 + r^2 / 2) / r^4` in `r^2`, |r| <= pi/4; relative error 2^-33 of the cosine.
const COS: [f32; 3] = [0.041_666_646, -0.001_388_730_8, 0.000_024_432_102];
/// `(atan(t) - t) / t^3` in `t^2`, |t| <= 1; relative error 2^-28.5.
const ATAN: [f32; 9] = [
    -0.333_333,
    0.199_985_3,
    -0.142_640_14,
    0.109_508_61,
    -0.083_992_09,
    0.057_878_915,
    -0.031_093_631,
    0.010_866_363,
    -0.001_782_176,
];
/// `(asin(s) - s) / s^3` in `s^2`, |s| <= 1/2; relative error 2^-27.6.
const ASIN: [f32; 5] = [0.166_667_52, 0.074_953_064, 0.045_469_77, 0.024_180_81, 0.042_166_322];

/// pi/2 in three pieces of eight bits (their products with 16 bit integers are exact) and a rest.
const HALF_PI: [f32; 4] = [
    f32::from_bits(0x3fc9_0000),
    f32::from_bits(0x39fe_0000),
    f32::from_bits(0xb52c_0000),
    f32::from_bits(0x3088_5a31),
];
/// pi/2 minus its f32 value.
const HALF_PI_LO: f32 = -4.371_139e-8;
/// pi minus its f32 value.
const PI_LO: f32 = -8.742_278e-8;

/// Cosine and sine of x reduced by the nearest multiple of pi/2, and that multiple modulo 4 (in the low two bits).
///
/// Beyond about 1e5 the reduction loses accuracy; the clamp keeps the polynomials within -1..=1 even then.
#[inline(always)]
fn reduced(x: f32) -> (f32, f32, u32) {
    let magic = x * FRAC_2_PI + ROUND_MAGIC;
    let k = magic - ROUND_MAGIC;
    let r = x - k * HALF_PI[0];
    let r = r - k * HALF_PI[1];
    let r = r - k * HALF_PI[2];
    let r = r - k * HALF_PI[3];
    let r = if r > 0.8 { 0.8 } else { r };
    let r = if r < -0.8 { -0.8 } else { r };
    let z = r * r;
    let sin = r + r * z * horner(z, &SIN);
    let cos = (1.0 - 0.5 * z) + z * z * horner(z, &COS);
    (cos, sin, magic.to_bits())
}

/// Sine; at most 2.27 ulp off for |x| <= 100, absolute error below 1.1e-7 up to 1e5. Beyond that some number in
/// -1..=1, NaN for infinities. The sign of a zero is lost.
#[inline(always)]
pub(crate) fn sin(x: f32) -> f32 {
    let (cos, sin, n) = reduced(x);
    let r = if n & 1 == 0 { sin } else { cos };
    f32::from_bits(r.to_bits() ^ ((n & 2) << 30))
}

/// Cosine; at most 2.51 ulp off for |x| <= 100, absolute error below 1.2e-7 up to 1e5. Beyond that some number in
/// -1..=1, NaN for infinities.
#[inline(always)]
pub(crate) fn cos(x: f32) -> f32 {
    let (cos, sin, n) = reduced(x);
    let r = if n & 1 == 0 { cos } else { sin };
    f32::from_bits(r.to_bits() ^ ((n.wrapping_add(1) & 2) << 30))
}

/// Tangent; at most 4.36 ulp off for |x| <= 100, good to 1e5 like the sine. Some number beyond, NaN for infinities.
#[inline(always)]
pub(crate) fn tan(x: f32) -> f32 {
    let (cos, sin, n) = reduced(x);
    let odd = n & 1 != 0;
    let numerator = if odd { -cos } else { sin };
    let denominator = if odd { sin } else { cos };
    numerator / denominator
}

/// Arcsine of |x| if that is at most 1/2, else the half of arccos(|x|); and whether it is the latter. NaN above 1.
#[inline(always)]
fn asin_reduced(x: f32) -> (f32, bool) {
    let a = x.abs();
    let big = a > 0.5;
    let half = 0.5 * (1.0 - a);
    let root = half.sqrt();
    let square = a * a;
    let z = if big { half } else { square };
    let s = if big { root } else { a };
    (s + s * z * horner(z, &ASIN), big)
}

/// Arcsine; at most 2.36 ulp off. NaN outside of -1..=1.
#[inline(always)]
pub(crate) fn asin(x: f32) -> f32 {
    let (p, big) = asin_reduced(x);
    let complement = FRAC_PI_2 - (2.0 * p - HALF_PI_LO);
    if big { complement } else { p }.copysign(x)
}

/// Arccosine; at most 1.13 ulp off. NaN outside of -1..=1.
#[inline(always)]
pub(crate) fn acos(x: f32) -> f32 {
    let (p, big) = asin_reduced(x);
    let small = FRAC_PI_2 - (p.copysign(x) - HALF_PI_LO);
    let double = 2.0 * p;
    let opposite = PI - (double - PI_LO);
    let far = if x < 0.0 { opposite } else { double };
    if big { far } else { small }
}

/// Arctangent of t in 0..=1.
#[inline(always)]
fn atan_unit(t: f32) -> f32 {
    let z = t * t;
    t + t * z * horner(z, &ATAN)
}

/// Arctangent; at most 1.46 ulp off.
#[inline(always)]
pub(crate) fn atan(x: f32) -> f32 {
    let a = x.abs();
    let big = a > 1.0;
    let inverse = 1.0 / a;
    let p = atan_unit(if big { inverse } else { a });
    let complement = FRAC_PI_2 - (p - HALF_PI_LO);
    if big { complement } else { p }.copysign(x)
}

/// Angle of the point (x, y); at most 1.51 ulp off. Zeros and infinities as in IEEE 754 (so 0 for two positive zeros).
#[inline(always)]
pub(crate) fn atan2(y: f32, x: f32) -> f32 {
    let (ax, ay) = (x.abs(), y.abs());
    let steep = ay > ax;
    let small = if steep { ax } else { ay };
    let large = if steep { ay } else { ax };
    let quotient = small / large;
    let diagonal = if large == 0.0 { 0.0 } else { 1.0 };
    let p = atan_unit(if small == large { diagonal } else { quotient });
    let complement = FRAC_PI_2 - (p - HALF_PI_LO);
    let p = if steep { complement } else { p };
    let opposite = PI - (p - PI_LO);
    let p = if x.is_sign_negative() { opposite } else { p };
    p.copysign(y)
}
