//! Operations on single values, as the lanes compute them.

use crate::math;
use crate::op::{Binary, Unary};

#[inline(always)]
pub(crate) fn f(bits: u32) -> f32 {
    f32::from_bits(bits)
}

#[inline(always)]
pub(crate) fn truth(condition: bool) -> u32 {
    if condition { u32::MAX } else { 0 }
}

/// Calls `$apply` with the function on bits that an operation stands for.
macro_rules! with_unary {
    ($op:expr, $apply:ident) => {{
        use $crate::op::Unary as U;
        use $crate::{eval, math};
        match $op {
            U::Copy => $apply!(|a: u32| a),
            U::Not => $apply!(|a: u32| !a),
            U::NegF => $apply!(|a: u32| a ^ 0x8000_0000),
            U::NegI => $apply!(|a: u32| a.wrapping_neg()),
            U::AbsF => $apply!(|a: u32| a & 0x7fff_ffff),
            U::AbsI => $apply!(|a: u32| a.cast_signed().wrapping_abs().cast_unsigned()),
            U::SignF => $apply!(|a: u32| eval::sign(eval::f(a)).to_bits()),
            U::SignI => $apply!(|a: u32| a.cast_signed().signum().cast_unsigned()),
            U::Floor => $apply!(|a: u32| math::floor(eval::f(a)).to_bits()),
            U::Ceil => $apply!(|a: u32| math::ceil(eval::f(a)).to_bits()),
            U::Round => $apply!(|a: u32| math::round_ties_even(eval::f(a)).to_bits()),
            U::Trunc => $apply!(|a: u32| math::trunc(eval::f(a)).to_bits()),
            U::Fract => $apply!(|a: u32| math::fract(eval::f(a)).to_bits()),
            U::Sqrt => $apply!(|a: u32| math::sqrt(eval::f(a)).to_bits()),
            U::InverseSqrt => $apply!(|a: u32| math::inverse_sqrt(eval::f(a)).to_bits()),
            U::Exp => $apply!(|a: u32| math::exp(eval::f(a)).to_bits()),
            U::Exp2 => $apply!(|a: u32| math::exp2(eval::f(a)).to_bits()),
            U::Log => $apply!(|a: u32| math::log(eval::f(a)).to_bits()),
            U::Log2 => $apply!(|a: u32| math::log2(eval::f(a)).to_bits()),
            U::Sin => $apply!(|a: u32| math::sin(eval::f(a)).to_bits()),
            U::Cos => $apply!(|a: u32| math::cos(eval::f(a)).to_bits()),
            U::Tan => $apply!(|a: u32| math::tan(eval::f(a)).to_bits()),
            U::Asin => $apply!(|a: u32| math::asin(eval::f(a)).to_bits()),
            U::Acos => $apply!(|a: u32| math::acos(eval::f(a)).to_bits()),
            U::Atan => $apply!(|a: u32| math::atan(eval::f(a)).to_bits()),
            U::Sinh => $apply!(|a: u32| math::sinh(eval::f(a)).to_bits()),
            U::Cosh => $apply!(|a: u32| math::cosh(eval::f(a)).to_bits()),
            U::Tanh => $apply!(|a: u32| math::tanh(eval::f(a)).to_bits()),
            U::Asinh => $apply!(|a: u32| math::asinh(eval::f(a)).to_bits()),
            U::Acosh => $apply!(|a: u32| math::acosh(eval::f(a)).to_bits()),
            U::Atanh => $apply!(|a: u32| math::atanh(eval::f(a)).to_bits()),
            U::SaturateF => $apply!(|a: u32| math::saturate(eval::f(a)).to_bits()),
            U::IntToFloat => $apply!(|a: u32| (a.cast_signed() as f32).to_bits()),
            U::UintToFloat => $apply!(|a: u32| (a as f32).to_bits()),
            U::FloatToInt => {
                $apply!(|a: u32| math::float_to_i32(eval::at_most(eval::f(a), 2_147_483_500.0)).cast_unsigned())
            }
            U::FloatToUint => $apply!(|a: u32| math::float_to_u32(eval::at_most(eval::f(a), 4_294_967_000.0))),
            U::BoolToInt => $apply!(|a: u32| a & 1),
            U::BoolToFloat => $apply!(|a: u32| a & 0x3f80_0000),
            U::IntToBool => $apply!(|a: u32| eval::truth(a != 0)),
            U::FloatToBool => $apply!(|a: u32| eval::truth(eval::f(a) != 0.0)),
            U::IsNan => $apply!(|a: u32| eval::truth(a & 0x7fff_ffff > 0x7f80_0000)),
            U::IsInf => $apply!(|a: u32| eval::truth(a & 0x7fff_ffff == 0x7f80_0000)),
            U::CountOneBits => $apply!(|a: u32| math::count_one_bits(a)),
            U::CountLeadingZeros => $apply!(|a: u32| math::count_leading_zeros(a)),
            U::CountTrailingZeros => $apply!(|a: u32| math::count_trailing_zeros(a)),
            U::ReverseBits => $apply!(|a: u32| math::reverse_bits(a)),
            U::FirstLeadingBitI => $apply!(|a: u32| math::first_leading_bit_i32(a.cast_signed()).cast_unsigned()),
            U::FirstLeadingBitU => $apply!(|a: u32| math::first_leading_bit_u32(a)),
            U::FirstTrailingBit => $apply!(|a: u32| math::first_trailing_bit(a)),
            U::FrexpFraction => $apply!(|a: u32| math::frexp(eval::f(a)).0.to_bits()),
            U::FrexpExponent => $apply!(|a: u32| math::frexp(eval::f(a)).1.cast_unsigned()),
            U::QuantizeToF16 => $apply!(|a: u32| math::quantize_to_f16(eval::f(a)).to_bits()),
            U::HalfToFloat => $apply!(|a: u32| math::half_to_float(a & 0xffff).to_bits()),
            U::HighHalfToFloat => $apply!(|a: u32| math::half_to_float(a >> 16).to_bits()),
            U::LowSnorm16 => $apply!(|a: u32| eval::snorm(a << 16, 16, 32767.0).to_bits()),
            U::HighSnorm16 => $apply!(|a: u32| eval::snorm(a, 16, 32767.0).to_bits()),
            U::LowUnorm16 => $apply!(|a: u32| ((a & 0xffff) as f32 / 65535.0).to_bits()),
            U::HighUnorm16 => $apply!(|a: u32| ((a >> 16) as f32 / 65535.0).to_bits()),
            U::Unorm8(byte) => $apply!(|a: u32| ((a >> (8 * u32::from(byte)) & 0xff) as f32 / 255.0).to_bits()),
            U::Snorm8(byte) => $apply!(|a: u32| eval::snorm(a << (24 - 8 * u32::from(byte)), 24, 127.0).to_bits()),
            U::Int8(byte) => $apply!(|a: u32| ((a << (24 - 8 * u32::from(byte))).cast_signed() >> 24).cast_unsigned()),
            U::Uint8(byte) => $apply!(|a: u32| a >> (8 * u32::from(byte)) & 0xff),
            U::ToSnorm16 => $apply!(|a: u32| eval::to_snorm(eval::f(a), 32767.0) & 0xffff),
            U::ToUnorm16 => $apply!(|a: u32| eval::to_unorm(eval::f(a), 65535.0)),
            U::ToSnorm8 => $apply!(|a: u32| eval::to_snorm(eval::f(a), 127.0) & 0xff),
            U::ToUnorm8 => $apply!(|a: u32| eval::to_unorm(eval::f(a), 255.0)),
            U::ToHalf => $apply!(|a: u32| math::float_to_half_nearest(eval::f(a))),
        }
    }};
}
pub(crate) use with_unary;

/// The same for two values.
macro_rules! with_binary {
    ($op:expr, $apply:ident) => {{
        use $crate::op::Binary as B;
        use $crate::{eval, math};
        match $op {
            B::AddF => $apply!(|a: u32, b: u32| (eval::f(a) + eval::f(b)).to_bits()),
            B::SubF => $apply!(|a: u32, b: u32| (eval::f(a) - eval::f(b)).to_bits()),
            B::MulF => $apply!(|a: u32, b: u32| (eval::f(a) * eval::f(b)).to_bits()),
            B::DivF => $apply!(|a: u32, b: u32| (eval::f(a) / eval::f(b)).to_bits()),
            B::RemF => {
                $apply!(|a: u32, b: u32| math::float_remainder(eval::f(a), eval::f(b)).to_bits())
            }
            B::MinF => $apply!(|a: u32, b: u32| math::min(eval::f(a), eval::f(b)).to_bits()),
            B::MaxF => $apply!(|a: u32, b: u32| math::max(eval::f(a), eval::f(b)).to_bits()),
            B::AddI => $apply!(|a: u32, b: u32| a.wrapping_add(b)),
            B::SubI => $apply!(|a: u32, b: u32| a.wrapping_sub(b)),
            B::MulI => $apply!(|a: u32, b: u32| a.wrapping_mul(b)),
            B::DivI => $apply!(|a: u32, b: u32| math::div_i32(a.cast_signed(), b.cast_signed()).cast_unsigned()),
            B::RemI => $apply!(|a: u32, b: u32| math::rem_i32(a.cast_signed(), b.cast_signed()).cast_unsigned()),
            B::MinI => $apply!(|a: u32, b: u32| a.cast_signed().min(b.cast_signed()).cast_unsigned()),
            B::MaxI => $apply!(|a: u32, b: u32| a.cast_signed().max(b.cast_signed()).cast_unsigned()),
            B::DivU => $apply!(|a: u32, b: u32| math::div_u32(a, b)),
            B::RemU => $apply!(|a: u32, b: u32| math::rem_u32(a, b)),
            B::MinU => $apply!(|a: u32, b: u32| a.min(b)),
            B::MaxU => $apply!(|a: u32, b: u32| a.max(b)),
            B::And => $apply!(|a: u32, b: u32| a & b),
            B::AndNot => $apply!(|a: u32, b: u32| a & !b),
            B::Or => $apply!(|a: u32, b: u32| a | b),
            B::Xor => $apply!(|a: u32, b: u32| a ^ b),
            B::ShiftLeft => $apply!(|a: u32, b: u32| a << (b & 31)),
            B::ShiftRightI => $apply!(|a: u32, b: u32| (a.cast_signed() >> (b & 31)).cast_unsigned()),
            B::ShiftRightU => $apply!(|a: u32, b: u32| a >> (b & 31)),
            B::EqF => $apply!(|a: u32, b: u32| eval::truth(eval::f(a) == eval::f(b))),
            B::NeF => $apply!(|a: u32, b: u32| eval::truth(eval::f(a) != eval::f(b))),
            B::LtF => $apply!(|a: u32, b: u32| eval::truth(eval::f(a) < eval::f(b))),
            B::LeF => $apply!(|a: u32, b: u32| eval::truth(eval::f(a) <= eval::f(b))),
            B::EqI => $apply!(|a: u32, b: u32| eval::truth(a == b)),
            B::NeI => $apply!(|a: u32, b: u32| eval::truth(a != b)),
            B::LtI => $apply!(|a: u32, b: u32| eval::truth(a.cast_signed() < b.cast_signed())),
            B::LeI => $apply!(|a: u32, b: u32| eval::truth(a.cast_signed() <= b.cast_signed())),
            B::LtU => $apply!(|a: u32, b: u32| eval::truth(a < b)),
            B::LeU => $apply!(|a: u32, b: u32| eval::truth(a <= b)),
            B::Pow => $apply!(|a: u32, b: u32| math::pow(eval::f(a), eval::f(b)).to_bits()),
            B::Atan2 => $apply!(|a: u32, b: u32| math::atan2(eval::f(a), eval::f(b)).to_bits()),
            B::Step => $apply!(|a: u32, b: u32| if eval::f(a) <= eval::f(b) { 0x3f80_0000 } else { 0 }),
            B::Ldexp => $apply!(|a: u32, b: u32| math::ldexp(eval::f(a), b.cast_signed()).to_bits()),
            B::Pack16 => $apply!(|a: u32, b: u32| (a & 0xffff) | (b << 16)),
        }
    }};
}
pub(crate) use with_binary;

/// WGSL converts what is too large to the largest integer that a float can hold. NaN stays.
#[inline(always)]
pub(crate) fn at_most(x: f32, largest: f32) -> f32 {
    if x > largest { largest } else { x }
}

/// -1, 0 or 1; 0 for NaN.
#[inline(always)]
pub(crate) fn sign(x: f32) -> f32 {
    f32::from(i8::from(x > 0.0) - i8::from(x < 0.0))
}

/// A signed number in the highest bits of a word, as -1 to 1.
#[inline(always)]
pub(crate) fn snorm(word: u32, shift: u32, scale: f32) -> f32 {
    ((word.cast_signed() >> shift) as f32 / scale).max(-1.0)
}

#[inline(always)]
pub(crate) fn to_snorm(value: f32, scale: f32) -> u32 {
    math::float_to_i32(math::floor(0.5 + scale * math::min(math::max(value, -1.0), 1.0))).cast_unsigned()
}

#[inline(always)]
pub(crate) fn to_unorm(value: f32, scale: f32) -> u32 {
    math::float_to_u32(math::floor(0.5 + scale * math::saturate(value)))
}

/// One operation on one value.
#[inline(always)]
pub(crate) fn unary(op: Unary, a: u32) -> u32 {
    macro_rules! apply {
        ($function:expr) => {{
            let function = $function;
            function(a)
        }};
    }
    with_unary!(op, apply)
}

/// One operation on two values.
pub(crate) fn binary(op: Binary, a: u32, b: u32) -> u32 {
    macro_rules! apply {
        ($function:expr) => {{
            let function = $function;
            function(a, b)
        }};
    }
    with_binary!(op, apply)
}
