//! Conversions between floats, half floats and integers, and WGSL's packing functions.

use super::ROUND_MAGIC;

/// Smallest normal half, 2^-14.
const HALF_MIN_NORMAL: f32 = 6.103_515_6e-5;

/// Value of the half float in the low 16 bits; exact, NaN keeps its payload.
#[inline(always)]
pub(crate) fn half_to_float(h: u32) -> f32 {
    let magnitude = (h & 0x7fff) << 13;
    let normal = magnitude + (112 << 23);
    let special = magnitude + (224 << 23);
    // A denormal's bits under the exponent of 2^-14, minus that 2^-14.
    let denormal = (f32::from_bits(magnitude + (113 << 23)) - HALF_MIN_NORMAL).to_bits();
    let r = if magnitude < (1 << 23) { denormal } else { normal };
    let r = if magnitude >= (31 << 23) { special } else { r };
    f32::from_bits(r | ((h & 0x8000) << 16))
}

/// Nearest half float, ties to even, overflow to infinity; NaN becomes the quiet NaN 0x7e00 (with sign).
#[inline(always)]
pub(crate) fn float_to_half_nearest(x: f32) -> u32 {
    let sign = (x.to_bits() >> 16) & 0x8000;
    let a = x.to_bits() & 0x7fff_ffff;
    // Adding 1/2 leaves the multiple of 2^-24 in the low bits, rounded by the addition.
    let denormal = (f32::from_bits(a) + 0.5).to_bits().wrapping_sub(0.5f32.to_bits());
    let odd = (a >> 13) & 1;
    let normal = a.wrapping_sub((112 << 23) - 0xfff).wrapping_add(odd) >> 13;
    let special = if a > 0x7f80_0000 { 0x7e00 } else { 0x7c00 };
    let r = if a < (113 << 23) { denormal } else { normal };
    let r = if a >= (143 << 23) { special } else { r };
    r | sign
}

/// WGSL's `quantizeToF16`: to the nearest half float and back, overflow to infinity.
#[inline(always)]
pub(crate) fn quantize_to_f16(x: f32) -> f32 {
    half_to_float(float_to_half_nearest(x))
}

/// Integer part of a in 0.0..2^32; garbage outside. (A cast compiles to scalar code, since it saturates.)
#[inline(always)]
fn integer_part(a: f32) -> u32 {
    let upper = a * (1.0 / 65536.0) + ROUND_MAGIC;
    let lower = a - (upper - ROUND_MAGIC) * 65536.0;
    let rounded = lower + ROUND_MAGIC;
    let excess = (rounded - ROUND_MAGIC > lower) as u32;
    let upper = upper.to_bits() << 16;
    upper.wrapping_add(rounded.to_bits()).wrapping_sub(ROUND_MAGIC.to_bits()).wrapping_sub(excess)
}

/// Rounds toward zero, saturates at i32::MIN and i32::MAX, 0 for NaN.
///
/// What naga generates for other backends (following the WGSL specification) clamps to representable floats, so to
/// 2147483520 rather than i32::MAX.
#[inline(always)]
pub(crate) fn float_to_i32(x: f32) -> i32 {
    let a = x.abs();
    let sign = (x.to_bits() as i32) >> 31;
    let part = integer_part(a) as i32;
    let r = if a < 2_147_483_648.0 { part } else { i32::MAX };
    let negative = if a < 2_147_483_648.0 { r.wrapping_neg() } else { i32::MIN };
    let r = if sign != 0 { negative } else { r };
    if x.is_nan() { 0 } else { r }
}

/// Rounds toward zero, saturates at 0 and u32::MAX, 0 for NaN.
///
/// What naga generates for other backends clamps to 4294967040 rather than u32::MAX.
#[inline(always)]
pub(crate) fn float_to_u32(x: f32) -> u32 {
    let part = integer_part(x);
    let r = if x < 4_294_967_296.0 { part } else { u32::MAX };
    if x > 0.0 { r } else { 0 }
}
