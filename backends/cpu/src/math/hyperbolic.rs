//! Hyperbolic functions and their inverses.

use super::exp::{exp_scaled, log1p};
use super::{horner, sqrt};
use std::f32::consts::LN_2;

/// `(sinh(x) - x) / x^3` in `x^2`, |x| <= 1; relative error 2^-31.6.
const SINH: [f32; 4] = [0.166_666_67, 0.008_333_310_5, 0.000_198_428_96, 0.000_002_782_213_2];
/// `(tanh(x) - x) / x^3` in `x^2`, x^2 <= 0.4; relative error 2^-27.5.
const TANH: [f32; 5] = [-0.333_332_75, 0.133_312_37, -0.053_722_013, 0.020_579_651, -0.005_636_983];

/// Above this the squares in the inverse functions would overflow, and adding 1 makes no difference.
const HUGE: f32 = 1e18;

/// Hyperbolic sine; at most 1.62 ulp off.
#[inline(always)]
pub(crate) fn sinh(x: f32) -> f32 {
    let a = x.abs();
    let z = a * a;
    let small = a + a * z * horner(z, &SINH);
    let half_exp = exp_scaled(a, -1);
    let large = half_exp - 0.25 / half_exp;
    if a < 1.0 { small } else { large }.copysign(x)
}

/// Hyperbolic cosine; at most 1.43 ulp off.
#[inline(always)]
pub(crate) fn cosh(x: f32) -> f32 {
    let half_exp = exp_scaled(x.abs(), -1);
    half_exp + 0.25 / half_exp
}

/// Hyperbolic tangent; at most 1.33 ulp off.
#[inline(always)]
pub(crate) fn tanh(x: f32) -> f32 {
    let a = x.abs();
    let z = a * a;
    let small = a + a * z * horner(z, &TANH);
    let large = 1.0 - 2.0 / (exp_scaled(2.0 * a, 0) + 1.0);
    if a < 0.625 { small } else { large }.copysign(x)
}

/// Inverse hyperbolic sine; at most 2.08 ulp off.
#[inline(always)]
pub(crate) fn asinh(x: f32) -> f32 {
    let a = x.abs();
    let z = a * a;
    let huge = a > HUGE;
    let v = a + z / (1.0 + sqrt(z + 1.0));
    let r = log1p(if huge { a } else { v });
    if huge { r + LN_2 } else { r }.copysign(x)
}

/// Inverse hyperbolic cosine; at most 2.56 ulp off. NaN below 1.
#[inline(always)]
pub(crate) fn acosh(x: f32) -> f32 {
    let t = x - 1.0;
    let huge = t > HUGE;
    let v = t + sqrt(t * (t + 2.0));
    let r = log1p(if huge { t } else { v });
    let r = if huge { r + LN_2 } else { r };
    if x < 1.0 { f32::NAN } else { r }
}

/// Inverse hyperbolic tangent; at most 2.49 ulp off. Infinite at 1 and -1, NaN outside of that.
#[inline(always)]
pub(crate) fn atanh(x: f32) -> f32 {
    let a = x.abs();
    let r = 0.5 * log1p((a + a) / (1.0 - a));
    if a > 1.0 { f32::NAN } else { r.copysign(x) }
}
