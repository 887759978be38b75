//! Textures and samples of them in double precision, by the formulas of the Vulkan specification.

use limpid_cpu::{AddressMode, BorderColor, Compare, Filter, Sampler, TexelFormat, Texture};

use crate::support::bits;

/// A texture with a mip chain, and what its texels are.
#[derive(Debug, Clone)]
pub(crate) struct Image {
    pub(crate) format: TexelFormat,
    pub(crate) sizes: Vec<[u32; 2]>,
    /// Four components a texel, level after level.
    pub(crate) values: Vec<[f32; 4]>,
}

impl Image {
    /// `numbers` are -4 to 4; bytes hold 0 to 1.
    pub(crate) fn new(format: TexelFormat, size: [u32; 2], levels: u32, numbers: &[f32]) -> Self {
        let sizes: Vec<_> = (0..levels).map(|level| size.map(|size| (size >> level).max(1))).collect();
        let count: u32 = sizes.iter().map(|[width, height]| width * height).sum();
        let number = |i: usize| numbers[i * 7 % numbers.len()];
        let stored = |number: f32| match format {
            TexelFormat::Rgba8Unorm => ((number.abs() / 4.0 * 255.0).round() / 255.0).min(1.0),
            TexelFormat::Rgba16Float => half::f16::from_f32(number).to_f32(),
            _ => number,
        };
        let texel = |i: usize| {
            let one = [0.0, 0.0, 0.0, 1.0];
            [0, 1, 2, 3].map(|c| if c < format.components() { stored(number(4 * i + c)) } else { one[c] })
        };
        Self { format, sizes, values: (0..count as usize).map(texel).collect() }
    }

    pub(crate) fn texture(&self) -> Texture {
        let [width, height] = self.sizes[0];
        let mut texture = Texture::with_levels(self.format, width, height, self.sizes.len() as u32);
        texture.write(self.values.iter().flat_map(|texel| {
            let half = |i: usize| u32::from(half::f16::from_f32(texel[i]).to_bits());
            let byte = |i: usize| (texel[i] * 255.0).round() as u32;
            match self.format {
                TexelFormat::Rgba8Unorm => vec![(0..4).fold(0, |word, i| word | byte(i) << (8 * i))],
                TexelFormat::Rgba16Float => vec![half(0) | half(1) << 16, half(2) | half(3) << 16],
                format => bits(&texel[..format.components()]),
            }
        }));
        texture
    }

    pub(crate) fn texel(&self, level: usize, x: i64, y: i64) -> [f64; 4] {
        let before: u32 = self.sizes[..level].iter().map(|[width, height]| width * height).sum();
        let at = i64::from(before) + y * i64::from(self.sizes[level][0]) + x;
        self.values[at as usize].map(f64::from)
    }
}

/// A sample in double precision.
pub(crate) struct Oracle<'a> {
    pub(crate) image: &'a Image,
    pub(crate) sampler: Sampler,
    pub(crate) offset: [i64; 2],
    pub(crate) reference: Option<f64>,
}

impl Oracle<'_> {
    /// By reflections and shifts, one at a time.
    fn wrap(mode: AddressMode, mut index: i64, count: i64) -> Option<i64> {
        while !(0..count).contains(&index) {
            index = match mode {
                AddressMode::ClampToEdge => {
                    if index < 0 {
                        0
                    } else {
                        count - 1
                    }
                }
                AddressMode::Repeat => {
                    if index < 0 {
                        index + count
                    } else {
                        index - count
                    }
                }
                AddressMode::MirrorRepeat => {
                    if index < 0 {
                        -1 - index
                    } else {
                        2 * count - 1 - index
                    }
                }
                AddressMode::ClampToBorder => return None,
            };
        }
        Some(index)
    }

    pub(crate) fn texel(&self, level: usize, i: i64, j: i64) -> [f64; 4] {
        let [width, height] = self.image.sizes[level].map(i64::from);
        let [x, y] = self.sampler.address;
        let place = Self::wrap(x, i + self.offset[0], width).zip(Self::wrap(y, j + self.offset[1], height));
        let texel = match (place, self.sampler.border) {
            (Some((x, y)), _) => self.image.texel(level, x, y),
            (None, border) => {
                let color = if border == BorderColor::OpaqueWhite { 1.0 } else { 0.0 };
                let alpha = if border == BorderColor::TransparentBlack { 0.0 } else { 1.0 };
                let full = [color, color, color, alpha];
                let one = [0.0, 0.0, 0.0, 1.0];
                [0, 1, 2, 3].map(|c| if c < self.image.format.components() { full[c] } else { one[c] })
            }
        };
        let Some((reference, compare)) = self.reference.zip(self.sampler.compare) else { return texel };
        let passes = match compare {
            Compare::Never => false,
            Compare::Less => reference < texel[0],
            Compare::Equal => reference == texel[0],
            Compare::LessEqual => reference <= texel[0],
            Compare::Greater => reference > texel[0],
            Compare::NotEqual => reference != texel[0],
            Compare::GreaterEqual => reference >= texel[0],
            Compare::Always => true,
        };
        [f64::from(u8::from(passes)); 4]
    }

    fn level(&self, level: usize, filter: Filter, at: [f64; 2]) -> [f64; 4] {
        let size = self.image.sizes[level].map(f64::from);
        let [u, v] = [at[0] * size[0], at[1] * size[1]];
        if filter == Filter::Nearest {
            return self.texel(level, u.floor() as i64, v.floor() as i64);
        }
        let (i, j) = ((u - 0.5).floor(), (v - 0.5).floor());
        let (alpha, beta) = (u - 0.5 - i, v - 0.5 - j);
        let mut sum = [0.0; 4];
        for (x, y, weight) in [
            (0, 0, (1.0 - alpha) * (1.0 - beta)),
            (1, 0, alpha * (1.0 - beta)),
            (0, 1, (1.0 - alpha) * beta),
            (1, 1, alpha * beta),
        ] {
            let texel = self.texel(level, i as i64 + x, j as i64 + y);
            (0..4).for_each(|c| sum[c] += weight * texel[c]);
        }
        sum
    }

    pub(crate) fn sample(&self, at: [f64; 2], lod: f64) -> [f64; 4] {
        let lod = lod.max(self.sampler.lod[0].into()).min(self.sampler.lod[1].into());
        let filter = if lod <= 0.0 { self.sampler.magnify } else { self.sampler.minify };
        let last = (self.image.sizes.len() - 1) as f64;
        let level = lod.clamp(0.0, last);
        if self.sampler.mip == Filter::Nearest {
            return self.level((level + 0.5).ceil() as usize - 1, filter, at);
        }
        let (low, high) = (level.floor(), (level.floor() + 1.0).min(last));
        let (a, b) = (self.level(low as usize, filter, at), self.level(high as usize, filter, at));
        [0, 1, 2, 3].map(|c| a[c] * (1.0 - (level - low)) + b[c] * (level - low))
    }

    /// Whether a value is what exact arithmetic gives at the coordinate or as near to it as rounding may move it.
    pub(crate) fn accepts(&self, actual: [f32; 4], at: [f32; 2], lod: f64) -> bool {
        let steps = [0.0, -1.0, 1.0];
        let moved = |s: f32, step: f64| f64::from(s) + step * 3e-7 * f64::from(s.abs().max(0.1));
        let near = |expected: [f64; 4]| (0..4).all(|c| (f64::from(actual[c]) - expected[c]).abs() < 2e-3);
        steps.iter().any(|x| {
            steps.iter().any(|y| {
                let at = [moved(at[0], *x), moved(at[1], *y)];
                steps.iter().any(|step| near(self.sample(at, lod * (1.0 + step * 1e-5))))
            })
        })
    }
}
