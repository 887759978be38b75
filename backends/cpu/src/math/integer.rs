//! Integer built-ins with WGSL semantics: nothing here panics or is undefined.

/// Number of one bits.
#[inline(always)]
pub(crate) fn count_one_bits(x: u32) -> u32 {
    x.count_ones()
}

/// Number of zero bits above the highest one; 32 for zero.
#[inline(always)]
pub(crate) fn count_leading_zeros(x: u32) -> u32 {
    x.leading_zeros()
}

/// Number of zero bits below the lowest one; 32 for zero.
#[inline(always)]
pub(crate) fn count_trailing_zeros(x: u32) -> u32 {
    x.trailing_zeros()
}

/// Bits in reverse order.
#[inline(always)]
pub(crate) fn reverse_bits(x: u32) -> u32 {
    x.reverse_bits()
}

/// Position of the highest one bit; all ones (-1) for zero.
#[inline(always)]
pub(crate) fn first_leading_bit_u32(x: u32) -> u32 {
    31u32.wrapping_sub(x.leading_zeros())
}

/// Position of the highest bit that differs from the sign; -1 for 0 and -1.
#[inline(always)]
pub(crate) fn first_leading_bit_i32(x: i32) -> i32 {
    first_leading_bit_u32((x ^ (x >> 31)) as u32) as i32
}

/// Position of the lowest one bit; all ones (-1) for zero.
#[inline(always)]
pub(crate) fn first_trailing_bit(x: u32) -> u32 {
    first_leading_bit_u32(x & x.wrapping_neg())
}

/// Quotient; `x / 0 = x`. Goes through f64 (exact for 32 bit operands), as there are no vector integer divisions.
#[inline(always)]
pub(crate) fn div_u32(x: u32, y: u32) -> u32 {
    const TWO_52: f64 = 4_503_599_627_370_496.0;
    let y = if y == 0 { 1 } else { y };
    // The distance of an inexact quotient to the next integer is at least 1/y, far above its rounding error.
    let quotient = x as f64 / y as f64;
    let rounded = quotient + TWO_52;
    let lower = rounded - 1.0;
    let floor = if rounded - TWO_52 > quotient { lower } else { rounded };
    floor.to_bits() as u32
}

/// Remainder; `x % 0 = 0`.
#[inline(always)]
pub(crate) fn rem_u32(x: u32, y: u32) -> u32 {
    let r = x.wrapping_sub(div_u32(x, y).wrapping_mul(y));
    if y == 0 { 0 } else { r }
}

/// Quotient, rounded toward zero; `x / 0 = x` and `i32::MIN / -1 = i32::MIN`.
#[inline(always)]
pub(crate) fn div_i32(x: i32, y: i32) -> i32 {
    let q = div_u32(x.unsigned_abs(), y.unsigned_abs()) as i32;
    // x's own sign if y is zero.
    let sign = (x ^ y) >> 31;
    (q ^ sign).wrapping_sub(sign)
}

/// Remainder with the sign of `x`; `x % 0 = 0` and `i32::MIN % -1 = 0`.
#[inline(always)]
pub(crate) fn rem_i32(x: i32, y: i32) -> i32 {
    let r = x.wrapping_sub(div_i32(x, y).wrapping_mul(y));
    if y == 0 { 0 } else { r }
}
