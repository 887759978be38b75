//! Scalar building blocks of the lane-wise WGSL interpreter.
//!
//! Every function here is branchless and `#[inline(always)]`, so that a loop such as
//! `for i in 0..64 { dst[i] = exp2(f32::from_bits(a[i])).to_bits() }` is vectorised by LLVM, with AVX2 as well as with
//! baseline SSE2. No function relies on fused multiply-add, on the platform's libm or on the rounding instructions of
//! SSE4.1, so results are the same bits on every target and at every vector width.
//!
//! Unless a doc comment says otherwise: NaN in gives NaN out, denormals are handled (not flushed), and the stated error
//! is the largest one measured against a double precision oracle, in units in the last place of the exact result (over
//! every seventh bit pattern of the argument; for functions of two arguments, over some millions of pairs).
//! Polynomial coefficients are minimax fits made for this module (Lawson iteration, rounded to f32 one by one).

mod convert;
mod exp;
mod hyperbolic;
mod integer;
#[cfg(test)]
mod tests;
mod trig;

pub(crate) use convert::*;
pub(crate) use exp::*;
pub(crate) use hyperbolic::*;
pub(crate) use integer::*;
pub(crate) use trig::*;

/// 2^23: from here on every f32 is an integer.
const TWO_23: f32 = 8_388_608.0;

/// 1.5 * 2^23: adding it rounds |x| < 2^22 to an integer, which then is the low bits of the sum.
const ROUND_MAGIC: f32 = 12_582_912.0;

/// Evaluates `c[0] + c[1] x + c[2] x^2 + ...` by Horner's rule; unrolled by the compiler.
#[inline(always)]
fn horner<const N: usize>(x: f32, c: &[f32; N]) -> f32 {
    let mut p = c[N - 1];
    let mut i = N - 1;
    while i > 0 {
        i -= 1;
        p = p * x + c[i];
    }
    p
}

/// Square root; correctly rounded, NaN below zero.
#[inline(always)]
pub(crate) fn sqrt(x: f32) -> f32 {
    x.sqrt()
}

/// `1 / sqrt(x)`; at most 1.5 ulp off. Infinity at zero (with the sign of the zero), NaN below it.
#[inline(always)]
pub(crate) fn inverse_sqrt(x: f32) -> f32 {
    1.0 / x.sqrt()
}

/// Rounds to the nearest integer, halfway cases to the even one; exact, keeps the sign of zero.
#[inline(always)]
pub(crate) fn round_ties_even(x: f32) -> f32 {
    let a = x.abs();
    let r = (a + TWO_23) - TWO_23;
    let r = if a < TWO_23 { r } else { a };
    r.copysign(x)
}

/// Largest integer not above `x`; exact, keeps the sign of zero.
#[inline(always)]
pub(crate) fn floor(x: f32) -> f32 {
    let r = round_ties_even(x);
    let down = r - 1.0;
    if r > x { down } else { r }
}

/// Smallest integer not below `x`; exact, keeps the sign of zero.
#[inline(always)]
pub(crate) fn ceil(x: f32) -> f32 {
    let r = round_ties_even(x);
    let up = r + 1.0;
    let r = if r < x { up } else { r };
    r.copysign(x)
}

/// Rounds toward zero; exact, keeps the sign of zero.
#[inline(always)]
pub(crate) fn trunc(x: f32) -> f32 {
    let a = x.abs();
    let r = (a + TWO_23) - TWO_23;
    let down = r - 1.0;
    let r = if r > a { down } else { r };
    let r = if a < TWO_23 { r } else { a };
    r.copysign(x)
}

/// `x - floor(x)`, correctly rounded: so 1 for tiny negative numbers, as in WGSL; NaN for infinities.
#[inline(always)]
pub(crate) fn fract(x: f32) -> f32 {
    x - floor(x)
}

/// WGSL's float `%`: literally `x - y * trunc(x / y)`, rounded after each step.
#[inline(always)]
pub(crate) fn float_remainder(x: f32, y: f32) -> f32 {
    x - y * trunc(x / y)
}

/// The smaller operand, or the other one if one is NaN.
#[inline(always)]
pub(crate) fn min(x: f32, y: f32) -> f32 {
    let m = if x < y { x } else { y };
    if y.is_nan() { x } else { m }
}

/// The larger operand, or the other one if one is NaN.
#[inline(always)]
pub(crate) fn max(x: f32, y: f32) -> f32 {
    let m = if x > y { x } else { y };
    if y.is_nan() { x } else { m }
}

/// Clamps to 0..=1; zero for NaN.
#[inline(always)]
pub(crate) fn saturate(x: f32) -> f32 {
    let x = if x > 0.0 { x } else { 0.0 };
    if x < 1.0 { x } else { 1.0 }
}
