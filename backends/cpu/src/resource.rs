//! Buffers and textures in plain memory. Workgroups run in parallel, so words are atomic; ordinary accesses are
//! relaxed, which costs nothing.

use std::sync::atomic::{AtomicU32, Ordering};

use crate::eval;
use crate::op::Unary;

/// A storage or constant buffer.
#[derive(Debug, Default)]
pub struct Buffer {
    pub(crate) words: Vec<AtomicU32>,
}

impl Buffer {
    /// A buffer with this content.
    pub fn new(words: impl IntoIterator<Item = u32>) -> Self {
        Self { words: words.into_iter().map(AtomicU32::new).collect() }
    }

    /// A buffer of `count` words, all zero.
    pub fn zeroed(count: usize) -> Self {
        Self::new(std::iter::repeat_n(0, count))
    }

    /// Replaces the first words.
    pub fn write(&mut self, words: impl IntoIterator<Item = u32>) {
        for (word, value) in self.words.iter_mut().zip(words) {
            *word.get_mut() = value;
        }
    }

    /// The content.
    pub fn read(&self) -> Vec<u32> {
        self.words.iter().map(|word| word.load(Ordering::Relaxed)).collect()
    }

    pub(crate) fn get(&self, address: u32) -> u32 {
        self.words.get(address as usize).map_or(0, |word| word.load(Ordering::Relaxed))
    }

    /// The half of a word at an address in halves.
    pub(crate) fn get_half(&self, address: u32) -> u32 {
        self.get(address / 2) >> (16 * (address % 2)) & 0xffff
    }

    /// Leaves the other half as it is, whoever writes it meanwhile.
    pub(crate) fn set_half(&self, address: u32, half: u32) {
        if let Some(word) = self.words.get(address as usize / 2) {
            let shift = 16 * (address % 2);
            let replaced = |old: u32| Some(old & !(0xffff << shift) | half << shift);
            // The update never declines.
            let _ = word.fetch_update(Ordering::Relaxed, Ordering::Relaxed, replaced);
        }
    }

    pub(crate) fn set(&self, address: u32, value: u32) {
        if let Some(word) = self.words.get(address as usize) {
            word.store(value, Ordering::Relaxed);
        }
    }
}

/// How one component of a texel is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Channel {
    Float32,
    Float16,
    Unorm8,
    Snorm8,
    Uint(u32),
    Sint(u32),
}

impl Channel {
    fn bits(self) -> u32 {
        match self {
            Self::Float32 => 32,
            Self::Float16 => 16,
            Self::Unorm8 | Self::Snorm8 => 8,
            Self::Uint(bits) | Self::Sint(bits) => bits,
        }
    }

    /// What reading alpha gives where there is none.
    pub(crate) fn one(self) -> u32 {
        if matches!(self, Self::Uint(_) | Self::Sint(_)) { 1 } else { 1.0f32.to_bits() }
    }

    /// The value of a component whose bits are at the lower end of `word`.
    #[inline(always)]
    pub(crate) fn decode(self, word: u32) -> u32 {
        match self {
            Self::Float32 => word,
            Self::Float16 => eval::unary(Unary::HalfToFloat, word),
            Self::Unorm8 => eval::unary(Unary::Unorm8(0), word),
            Self::Snorm8 => eval::unary(Unary::Snorm8(0), word),
            Self::Uint(bits) => word & (u32::MAX >> (32 - bits)),
            Self::Sint(bits) => ((word << (32 - bits)).cast_signed() >> (32 - bits)).cast_unsigned(),
        }
    }

    /// The bits of a component, others zero. Floats round to the nearest, ties to even; integers too large for
    /// the format keep their lowest bits.
    #[inline(always)]
    pub(crate) fn encode(self, value: u32) -> u32 {
        match self {
            Self::Float32 => value,
            Self::Float16 => eval::unary(Unary::ToHalf, value),
            Self::Unorm8 => eval::unary(Unary::ToUnorm8, value),
            Self::Snorm8 => eval::unary(Unary::ToSnorm8, value),
            Self::Uint(bits) | Self::Sint(bits) => value & (u32::MAX >> (32 - bits)),
        }
    }
}

/// Declares the formats: name, channel, components.
macro_rules! texel_formats {
    ($($(#[$doc:meta])* $name:ident = $channel:expr, $components:literal;)*) => {
        /// How a texel is kept: components side by side from the lowest bit, in as many 32-bit words as they
        /// need.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        #[non_exhaustive]
        pub enum TexelFormat {
            $($(#[$doc])* $name,)*
        }

        impl TexelFormat {
            /// All formats.
            pub const ALL: &[TexelFormat] = &[$(Self::$name,)*];

            pub(crate) fn channel(self) -> Channel {
                match self {
                    $(Self::$name => $channel,)*
                }
            }

            /// Number of components; reading others gives 0, or 1 for alpha.
            pub fn components(self) -> usize {
                match self {
                    $(Self::$name => $components,)*
                }
            }
        }
    };
}

texel_formats! {
    /// One float.
    R32Float = Channel::Float32, 1;
    /// Two floats.
    Rg32Float = Channel::Float32, 2;
    /// Four floats.
    Rgba32Float = Channel::Float32, 4;
    /// One half float.
    R16Float = Channel::Float16, 1;
    /// Two half floats.
    Rg16Float = Channel::Float16, 2;
    /// Four half floats.
    Rgba16Float = Channel::Float16, 4;
    /// One byte, 0 to 1.
    R8Unorm = Channel::Unorm8, 1;
    /// Two bytes, 0 to 1.
    Rg8Unorm = Channel::Unorm8, 2;
    /// Four bytes, 0 to 1.
    Rgba8Unorm = Channel::Unorm8, 4;
    /// Four bytes, -1 to 1.
    Rgba8Snorm = Channel::Snorm8, 4;
    /// One unsigned integer.
    R32Uint = Channel::Uint(32), 1;
    /// Two unsigned integers.
    Rg32Uint = Channel::Uint(32), 2;
    /// Four unsigned integers.
    Rgba32Uint = Channel::Uint(32), 4;
    /// Four 16-bit unsigned integers.
    Rgba16Uint = Channel::Uint(16), 4;
    /// Four bytes, unsigned integers.
    Rgba8Uint = Channel::Uint(8), 4;
    /// One signed integer.
    R32Sint = Channel::Sint(32), 1;
    /// Two signed integers.
    Rg32Sint = Channel::Sint(32), 2;
    /// Four signed integers.
    Rgba32Sint = Channel::Sint(32), 4;
    /// Four 16-bit signed integers.
    Rgba16Sint = Channel::Sint(16), 4;
    /// Four bytes, signed integers.
    Rgba8Sint = Channel::Sint(8), 4;
}

impl TexelFormat {
    /// Words of a texel.
    pub fn words(self) -> usize {
        (self.components() * self.channel().bits() as usize).div_ceil(32)
    }

    /// Which word of a texel holds a component, and from which bit.
    pub(crate) fn position(self, component: usize) -> (usize, u32) {
        let bit = component as u32 * self.channel().bits();
        (bit as usize / 32, bit % 32)
    }
}

/// A level of a texture's mip chain.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Level {
    pub(crate) first_word: u32,
    pub(crate) width: u32,
    pub(crate) height: u32,
}

/// A two-dimensional texture. A depth texture of a kernel looks at its first component.
#[derive(Debug)]
pub struct Texture {
    format: TexelFormat,
    pub(crate) levels: Vec<Level>,
    pub(crate) words: Vec<AtomicU32>,
}

impl Texture {
    /// A texture of one level, all zero.
    pub fn new(format: TexelFormat, width: u32, height: u32) -> Self {
        Self::with_levels(format, width, height, 1)
    }

    /// A texture with a mip chain of `level_count` levels, all zero.
    pub fn with_levels(format: TexelFormat, width: u32, height: u32, level_count: u32) -> Self {
        let mut levels = Vec::new();
        let mut count = 0;
        for level in 0..level_count.max(1) {
            let [width, height] = [width, height].map(|size| size.checked_shr(level).unwrap_or(0).max(1));
            levels.push(Level { first_word: count as u32, width, height });
            count += width as usize * height as usize * format.words();
        }
        Self { format, levels, words: std::iter::repeat_with(AtomicU32::default).take(count).collect() }
    }

    /// How texels are kept.
    pub fn format(&self) -> TexelFormat {
        self.format
    }

    /// Width and height of the first level.
    pub fn size(&self) -> [u32; 2] {
        [self.levels[0].width, self.levels[0].height]
    }

    /// Where a texel inside of a level begins, in words.
    pub(crate) fn first_word(&self, level: &Level, x: u32, y: u32) -> u32 {
        level.first_word + (y * level.width + x) * self.format.words() as u32
    }

    /// The components of the texel that begins at a word, as bits; those that the format lacks are 0, or 1 for alpha.
    pub(crate) fn texel(&self, first_word: u32) -> [u32; 4] {
        let channel = self.format.channel();
        [0, 1, 2, 3].map(|component| {
            if component >= self.format.components() {
                return if component == 3 { channel.one() } else { 0 };
            }
            let (offset, shift) = self.format.position(component);
            let word = self.words.get(first_word as usize + offset);
            channel.decode(word.map_or(0, |word| word.load(Ordering::Relaxed)) >> shift)
        })
    }

    /// Replaces the first words, texel by texel and row by row, levels one after another.
    pub fn write(&mut self, words: impl IntoIterator<Item = u32>) {
        for (word, value) in self.words.iter_mut().zip(words) {
            *word.get_mut() = value;
        }
    }

    /// The words of all texels, as [`write`](Self::write) takes them.
    pub fn read(&self) -> Vec<u32> {
        self.words.iter().map(|word| word.load(Ordering::Relaxed)).collect()
    }
}
