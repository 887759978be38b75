//! Random numbers: a counter-based hash for the noisy signal, scrambled Sobol' points for the
//! reference.

use glam::Vec2;

/// One PCG output step as a hash of 32 bits (Jarzynski and Olano 2020, "Hash Functions for GPU
/// Rendering").
pub(super) fn pcg(value: u32) -> u32 {
    let state = value.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}

/// Hashes a list of words into one, sensitive to their order.
pub(super) fn hash(words: impl IntoIterator<Item = u32>) -> u32 {
    words.into_iter().fold(0x9e37_79b9, |key, word| pcg(key.wrapping_add(pcg(word)).rotate_left(7)))
}

/// Uniform float in `0.0..1.0` from the high 24 bits.
pub(super) fn unit_float(bits: u32) -> f32 {
    (bits >> 8) as f32 / 16_777_216.0
}

/// A source of points in the unit square; every decision of a path takes its own pair.
pub(super) enum Sampler {
    /// Independent numbers: `key` names the path, `counter` the draw.
    Independent {
        /// Hash of scene, frame and pixel.
        key: u32,
        /// Draws so far.
        counter: u32,
    },
    /// Point `index` of a set whose members are well spread together.
    Spread {
        /// Hash of scene and pixel, the same for all members of the set.
        key: u32,
        /// Which member.
        index: u32,
        /// Draws so far.
        counter: u32,
    },
}

impl Sampler {
    /// Independent numbers for one path.
    pub(super) fn independent(key: u32) -> Self {
        Self::Independent { key, counter: 0 }
    }

    /// Path `index` of a set of paths that share `key`.
    pub(super) fn spread(key: u32, index: u32) -> Self {
        Self::Spread { key, index, counter: 0 }
    }

    /// The next point of the unit square.
    pub(super) fn pair(&mut self) -> Vec2 {
        match self {
            Self::Independent { key, counter } => {
                let bits = [*counter, *counter + 1].map(|n| pcg(key.wrapping_add(pcg(n))));
                *counter += 2;
                Vec2::new(unit_float(bits[0]), unit_float(bits[1]))
            }
            Self::Spread { key, index, counter } => {
                *counter += 1;
                sobol_pair(*index, pcg(key.wrapping_add(pcg(*counter))))
            }
        }
    }
}

/// Sets longer than two to this power continue with a fresh scramble.
const SOBOL_BITS: u32 = 12;

/// Direction numbers of the second Sobol' dimension: Pascal's triangle modulo two, of which each
/// column follows from the one before.
const SECOND_DIMENSION: [u32; SOBOL_BITS as usize] = {
    let mut column = [0x8000_0000_u32; SOBOL_BITS as usize];
    let mut k = 1;
    while k < column.len() {
        column[k] = column[k - 1] ^ (column[k - 1] >> 1);
        k += 1;
    }
    column
};

/// Point `index` of a shuffled, Owen-scrambled two-dimensional Sobol' sequence (Burley 2020,
/// "Practical Hash-based Owen Scrambling"). Different seeds give independent sequences, so pairs
/// can be padded to paths of any length.
fn sobol_pair(index: u32, seed: u32) -> Vec2 {
    let seed = seed ^ pcg(index >> SOBOL_BITS);
    let mask = (1 << SOBOL_BITS) - 1;
    let order = owen_scramble(index & mask, pcg(seed)) & mask;
    let (mut y, mut rest) = (0, order);
    while rest != 0 {
        y ^= SECOND_DIMENSION[rest.trailing_zeros() as usize];
        rest &= rest - 1;
    }
    Vec2::new(
        unit_float(owen_scramble(order.reverse_bits(), pcg(seed ^ 0x68bc_21eb))),
        unit_float(owen_scramble(y, pcg(seed ^ 0x02e5_be93))),
    )
}

/// Flips each bit by a hash of the bits above it (Burley 2020, after Laine and Karras 2011).
fn owen_scramble(bits: u32, seed: u32) -> u32 {
    let mut low_first = bits.reverse_bits().wrapping_add(seed);
    for factor in [0x6c50_b47c, 0xb82f_1e52, 0xc7af_e638, 0x8d22_f6e6] {
        low_first ^= low_first.wrapping_mul(factor);
    }
    low_first.reverse_bits()
}
