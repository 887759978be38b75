//! Texture filtering, as the Vulkan specification has it ("Image Operations": normalized texel coordinate
//! operations, level-of-detail operation, image sample operations).

use crate::math;
use crate::resource::{Level, Texture};

/// How the texels around a coordinate, or two levels, become one value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Filter {
    /// The one that is nearest.
    #[default]
    Nearest,
    /// Blended by distance.
    Linear,
}

/// What lies outside of 0 to 1 along an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum AddressMode {
    /// The texels at the edge.
    #[default]
    ClampToEdge,
    /// The texture again.
    Repeat,
    /// The texture again, every other time mirrored.
    MirrorRepeat,
    /// The border colour.
    ClampToBorder,
}

/// Colour of texels outside with [`AddressMode::ClampToBorder`]. Components that the format lacks stay 0, or 1 for
/// alpha.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum BorderColor {
    /// 0, 0, 0, 0.
    #[default]
    TransparentBlack,
    /// 0, 0, 0, 1.
    OpaqueBlack,
    /// 1, 1, 1, 1.
    OpaqueWhite,
}

/// How a reference value must compare to a texel to give 1; else it gives 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Compare {
    /// Always 0.
    Never,
    /// Less than the texel.
    Less,
    /// Equal to the texel.
    Equal,
    /// Less than or equal to the texel.
    LessEqual,
    /// Greater than the texel.
    Greater,
    /// Not equal to the texel.
    NotEqual,
    /// Greater than or equal to the texel.
    GreaterEqual,
    /// Always 1.
    Always,
}

impl Compare {
    fn passes(self, reference: f32, texel: f32) -> bool {
        match self {
            Self::Never => false,
            Self::Less => reference < texel,
            Self::Equal => reference == texel,
            Self::LessEqual => reference <= texel,
            Self::Greater => reference > texel,
            Self::NotEqual => reference != texel,
            Self::GreaterEqual => reference >= texel,
            Self::Always => true,
        }
    }
}

/// How a texture is sampled. The default takes the nearest texel of the nearest level and clamps to the edge.
///
/// Coordinates, weights and blends are `f32`, `a + (b - a) * weight` along `x`, then `y`, then levels; devices often
/// have 8 bits for a weight. A coordinate that is NaN, or infinite where the texture repeats, counts as 0; so does a
/// level of detail that is NaN. There is no anisotropy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sampler {
    /// What lies outside along `x` and `y`.
    pub address: [AddressMode; 2],
    /// For a level of detail of at most 0.
    pub magnify: Filter,
    /// For a level of detail above 0.
    pub minify: Filter,
    /// Between levels.
    pub mip: Filter,
    /// Least and greatest level of detail.
    pub lod: [f32; 2],
    /// For [`AddressMode::ClampToBorder`].
    pub border: BorderColor,
    /// Makes it a `sampler_comparison`: each texel's first component is compared before texels are blended.
    pub compare: Option<Compare>,
}

impl Default for Sampler {
    fn default() -> Self {
        Self {
            address: Default::default(),
            magnify: Filter::Nearest,
            minify: Filter::Nearest,
            mip: Filter::Nearest,
            lod: [0.0, 32.0],
            border: BorderColor::TransparentBlack,
            compare: None,
        }
    }
}

/// Where the level of detail comes from.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Lod {
    Exact(f32),
    /// Derivatives of the coordinate along `x` and `y` of the screen.
    Gradient([[f32; 2]; 2]),
}

/// Largest distance from the texture, in texels: beyond, nothing changes, and an index still is an `i32`.
const FAR: f32 = 16_777_216.0;

impl AddressMode {
    /// A coordinate in texels; outside only as far as an index can be.
    fn position(self, coordinate: f32, count: u32) -> f32 {
        let count = count as f32;
        let position = match self {
            Self::ClampToEdge | Self::ClampToBorder => (coordinate * count).clamp(-FAR, FAR),
            Self::Repeat => (coordinate - math::floor(coordinate)) * count,
            Self::MirrorRepeat => (coordinate - 2.0 * math::floor(0.5 * coordinate)) * count,
        };
        if position.is_nan() { 0.0 } else { position }
    }

    /// Which texel an index means; none on the border.
    fn wrap(self, index: i32, count: u32) -> Option<u32> {
        let count = count.cast_signed();
        let inside = match self {
            Self::ClampToEdge => index.clamp(0, count - 1),
            Self::Repeat => index.rem_euclid(count),
            Self::MirrorRepeat => {
                let index = index.rem_euclid(2 * count);
                index.min(2 * count - 1 - index)
            }
            Self::ClampToBorder if (0..count).contains(&index) => index,
            Self::ClampToBorder => return None,
        };
        Some(inside.cast_unsigned())
    }
}

/// Two neighbouring texels along an axis, and the weight of the second.
struct Pair {
    texels: [Option<u32>; 2],
    weight: f32,
}

/// One sample of a texture.
pub(crate) struct Sampling<'a> {
    pub(crate) sampler: Sampler,
    pub(crate) texture: &'a Texture,
    pub(crate) at: [f32; 2],
    pub(crate) offset: [i32; 2],
    pub(crate) reference: Option<f32>,
    /// First words of the texels that were read.
    pub(crate) reads: &'a mut Vec<u32>,
}

fn blend(a: [f32; 4], b: [f32; 4], weight: f32) -> [f32; 4] {
    [0, 1, 2, 3].map(|i| a[i] + (b[i] - a[i]) * weight)
}

impl Sampling<'_> {
    /// The filtered value, or what comparisons give.
    pub(crate) fn sample(&mut self, lod: Lod) -> [f32; 4] {
        let [width, height] = self.texture.size().map(|size| size as f32);
        let lod = match lod {
            Lod::Exact(lod) => lod,
            Lod::Gradient(axes) => {
                let length = |[x, y]: [f32; 2]| {
                    let (x, y) = (x * width, y * height);
                    (x * x + y * y).sqrt()
                };
                math::log2(length(axes[0]).max(length(axes[1])))
            }
        };
        let lod = if lod.is_nan() { 0.0 } else { lod };
        let lod = lod.max(self.sampler.lod[0]).min(self.sampler.lod[1]);
        let filter = if lod <= 0.0 { self.sampler.magnify } else { self.sampler.minify };
        let last = self.texture.levels.len() - 1;
        let level = lod.clamp(0.0, last as f32);
        if self.sampler.mip == Filter::Nearest {
            return self.level((math::ceil(level + 0.5) - 1.0) as usize, filter);
        }
        let low = math::floor(level);
        let first = self.level(low as usize, filter);
        let second = self.level((low as usize + 1).min(last), filter);
        blend(first, second, level - low)
    }

    fn level(&mut self, index: usize, filter: Filter) -> [f32; 4] {
        let level = self.texture.levels[index.min(self.texture.levels.len() - 1)];
        let [x, y] = self.footprint(&level, filter);
        let mut texel = |i: usize, j: usize| self.texel(&level, x.texels[i], y.texels[j]);
        match filter {
            Filter::Nearest => texel(0, 0),
            Filter::Linear => {
                let rows = [0, 1].map(|j| blend(texel(0, j), texel(1, j), x.weight));
                blend(rows[0], rows[1], y.weight)
            }
        }
    }

    fn footprint(&self, level: &Level, filter: Filter) -> [Pair; 2] {
        [(0, level.width), (1, level.height)].map(|(axis, count)| {
            let mode = self.sampler.address[axis];
            let position = mode.position(self.at[axis], count) - if filter == Filter::Linear { 0.5 } else { 0.0 };
            let first = math::floor(position);
            let index = (first as i32).wrapping_add(self.offset[axis]);
            Pair { texels: [0, 1].map(|i| mode.wrap(index.wrapping_add(i), count)), weight: position - first }
        })
    }

    /// The bits of a texel's components.
    fn bits(&mut self, level: &Level, x: Option<u32>, y: Option<u32>) -> [u32; 4] {
        let format = self.texture.format();
        let Some((x, y)) = x.zip(y) else {
            let one = format.channel().one();
            let [color, alpha] = match self.sampler.border {
                BorderColor::TransparentBlack => [0, 0],
                BorderColor::OpaqueBlack => [0, one],
                BorderColor::OpaqueWhite => [one, one],
            };
            let missing = [0, 0, 0, one];
            let border = [color, color, color, alpha];
            return [0, 1, 2, 3].map(|i| if i < format.components() { border[i] } else { missing[i] });
        };
        let first = self.texture.first_word(level, x, y);
        self.reads.push(first);
        self.texture.texel(first)
    }

    fn texel(&mut self, level: &Level, x: Option<u32>, y: Option<u32>) -> [f32; 4] {
        let texel = self.bits(level, x, y).map(f32::from_bits);
        match (self.sampler.compare, self.reference) {
            (Some(compare), Some(reference)) => {
                let passes = f32::from(u8::from(compare.passes(reference, texel[0])));
                [passes; 4]
            }
            _ => texel,
        }
    }

    /// A component, or what comparisons give, of the four texels that a linear filter blends: as bits,
    /// counter-clockwise from the one at lower `x` and greater `y`.
    pub(crate) fn gather(&mut self, component: usize) -> [u32; 4] {
        let level = self.texture.levels[0];
        let [x, y] = self.footprint(&level, Filter::Linear);
        [(0, 1), (1, 1), (1, 0), (0, 0)].map(|(i, j)| {
            if self.reference.is_some() {
                self.texel(&level, x.texels[i], y.texels[j])[0].to_bits()
            } else {
                self.bits(&level, x.texels[i], y.texels[j])[component]
            }
        })
    }
}
