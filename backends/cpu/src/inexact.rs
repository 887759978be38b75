//! Functions as inexact as Vulkan lets them be, to find out what hangs on their last digits.

use crate::math;
use crate::op::{Binary, Unary};

/// Adds errors within the bounds of "Precision and Operation of SPIR-V Instructions" in the Vulkan specification.
/// The error depends on the result, so that the same input gives the same output, as on a device.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Inexact {
    pub(crate) seed: u32,
}

/// Distance from a number to the next one.
fn ulp(value: f32) -> f32 {
    let exponent = (value.to_bits() >> 23 & 0xff).max(24);
    f32::from_bits((exponent - 23) << 23)
}

impl Inexact {
    /// -1 to 1, by the number that is to be disturbed.
    fn sign(self, bits: u32) -> f32 {
        let mut state = bits ^ self.seed.wrapping_mul(0x9e37_79b9);
        for _ in 0..2 {
            state = (state ^ state >> 16).wrapping_mul(0x7feb_352d);
        }
        (state >> 8) as f32 * (2.0 / 16_777_216.0) - 1.0
    }

    /// `value` with an error of up to `bound`.
    fn disturb(self, value: f32, bound: f32) -> f32 {
        // What is exact everywhere stays so.
        if !value.is_finite() || value == 0.0 || value == 1.0 {
            return value;
        }
        value + (self.sign(value.to_bits()) * bound / ulp(value)).round() * ulp(value)
    }

    /// The result of a function of one number, disturbed.
    pub(crate) fn unary(self, op: Unary, bits: u32) -> u32 {
        let value = f32::from_bits(bits);
        let bound = match op {
            // 3 + 2 |x| units in the last place for exp2(x).
            Unary::Exp | Unary::Exp2 => (3.0 + 2.0 * math::log2(value).abs()) * ulp(value),
            Unary::Log | Unary::Log2 if value.abs() <= 1.0 => 1.0 / 2_097_152.0,
            Unary::Log | Unary::Log2 => 3.0 * ulp(value),
            Unary::InverseSqrt => 2.0 * ulp(value),
            // That of 1 / inverseSqrt(x).
            Unary::Sqrt => 4.5 * ulp(value),
            Unary::Acos | Unary::Asin | Unary::Atan => 4096.0 * ulp(value),
            Unary::Sin | Unary::Cos => 1.0 / 2048.0,
            _ => return bits,
        };
        self.disturb(value, bound).to_bits()
    }

    /// Whether [`binary`](Self::binary) changes an operation.
    pub(crate) fn concerns(op: Binary) -> bool {
        matches!(op, Binary::DivF | Binary::Pow | Binary::Atan2)
    }

    /// A quotient, power or angle, disturbed.
    pub(crate) fn binary(self, op: Binary, a: u32, b: u32) -> u32 {
        let (a, b) = (f32::from_bits(a), f32::from_bits(b));
        let disturbed = match op {
            Binary::Pow => {
                let logarithm = self.unary(Unary::Log2, math::log2(a).to_bits());
                let power = math::exp2(b * f32::from_bits(logarithm));
                // Roots of 0 and the like are what they are.
                if power.is_finite() {
                    f32::from_bits(self.unary(Unary::Exp2, power.to_bits()))
                } else {
                    math::pow(a, b)
                }
            }
            Binary::Atan2 => self.disturb(math::atan2(a, b), 4096.0 * ulp(math::atan2(a, b))),
            _ => self.disturb(a / b, 2.5 * ulp(a / b)),
        };
        disturbed.to_bits()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_within_bounds_and_are_made() {
        let mut differing = 0;
        for (i, seed) in (0..4000u32).map(|i| (i, i % 7)) {
            let inexact = Inexact { seed };
            let x = 0.01 + i as f32 * 0.003;
            let exact = (1.0 / f64::from(x).sqrt()) as f32;
            let error = f32::from_bits(inexact.unary(Unary::InverseSqrt, exact.to_bits())) - exact;
            assert!(error.abs() <= 2.0 * ulp(exact));
            differing += u32::from(error != 0.0);
            let quotient = f32::from_bits(inexact.binary(Binary::DivF, x.to_bits(), 3.0f32.to_bits()));
            assert!((quotient - x / 3.0).abs() <= 2.5 * ulp(x / 3.0));
            let power = f32::from_bits(inexact.binary(Binary::Pow, x.to_bits(), 2.0f32.to_bits()));
            assert!((power / (x * x) - 1.0).abs() < 1e-5, "{x} to the power of 2 became {power}");
        }
        assert!(differing > 2000);
        assert_eq!(Inexact { seed: 1 }.unary(Unary::Exp, 0), 0);
        assert_eq!(Inexact { seed: 1 }.unary(Unary::AbsF, 0x3f80_0001), 0x3f80_0001);
    }
}
