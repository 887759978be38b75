//! Textures and buffers as data.

use glam::UVec2;
use serde::{Deserialize, Serialize};

/// Width and height of the tiles that work is skipped by, in pixels.
pub const TILE_SIZE: u32 = 8;

/// Width and height of the blocks that radiance is averaged over for wide filters, in pixels.
pub const BLOCK_SIZE: u32 = 4;

/// How a pass uses a resource.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "export", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Access {
    /// Reads only.
    Read,
    /// Writes only.
    Write,
    /// Reads and writes.
    ReadWrite,
}

impl Access {
    /// Whether it writes.
    pub fn writes(self) -> bool {
        self != Self::Read
    }
}

/// Texel formats that limpid stores. WebGPU can write all of them without optional features.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "export", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Format {
    /// Four half floats.
    Rgba16Float,
    /// Two 32-bit unsigned integers.
    Rg32Uint,
    /// Four 32-bit unsigned integers.
    Rgba32Uint,
    /// A 32-bit unsigned integer.
    R32Uint,
}

impl Format {
    /// Bytes of a texel.
    pub fn bytes(self) -> u64 {
        match self {
            Self::R32Uint => 4,
            Self::Rgba16Float | Self::Rg32Uint => 8,
            Self::Rgba32Uint => 16,
        }
    }

    pub(crate) fn from_naga(format: naga::StorageFormat) -> Option<Self> {
        match format {
            naga::StorageFormat::Rgba16Float => Some(Self::Rgba16Float),
            naga::StorageFormat::Rg32Uint => Some(Self::Rg32Uint),
            naga::StorageFormat::Rgba32Uint => Some(Self::Rgba32Uint),
            naga::StorageFormat::R32Uint => Some(Self::R32Uint),
            _ => None,
        }
    }
}

/// Size of a texture relative to the image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "export", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Extent {
    /// One texel a pixel.
    Full,
    /// One texel a 4x4 block, rounded up.
    Block,
    /// One texel an 8x8 tile, rounded up.
    Tile,
}

impl Extent {
    /// Size in texels for an image of `size` pixels.
    pub fn of(self, size: UVec2) -> UVec2 {
        match self {
            Self::Full => size,
            Self::Block => (size + (BLOCK_SIZE - 1)) / BLOCK_SIZE,
            Self::Tile => (size + (TILE_SIZE - 1)) / TILE_SIZE,
        }
    }
}

/// Size in pixels that an input has to have at least in a frame of `size` pixels after one of `prev_size` (zero where
/// there is no history).
pub fn input_size(input: &str, size: UVec2, prev_size: UVec2) -> UVec2 {
    match input {
        "environment" => UVec2::ONE,
        "prev_normal" | "prev_roughness" | "prev_depth" => prev_size.max(UVec2::ONE),
        _ => size,
    }
}

/// Number of elements of a buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Count {
    /// One element a pixel or a tile.
    Per(Extent),
    /// So many elements.
    Fixed(u64),
}

impl Count {
    /// Elements for an image of `size` pixels.
    pub fn of(self, size: UVec2) -> u64 {
        match self {
            Self::Per(extent) => {
                let size = extent.of(size);
                u64::from(size.x) * u64::from(size.y)
            }
            Self::Fixed(count) => count,
        }
    }
}

/// What a resource is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// The frame's constants, [`FrameConstants`](crate::FrameConstants).
    Constants,
    /// An image of the caller, any format with float texels (depth included).
    Input,
    /// A texture of limpid.
    Texture {
        /// Texel format.
        format: Format,
        /// Size.
        extent: Extent,
    },
    /// A buffer of limpid.
    Buffer {
        /// Bytes of an element.
        stride: u64,
        /// Number of elements.
        count: Count,
        /// Whether grids of passes are read from it.
        indirect: bool,
    },
}

/// How long content lives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "export", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Lifetime {
    /// The caller's.
    External,
    /// Kept from one frame to the next. Must be zero when first used.
    Persistent,
    /// Used within one frame: its memory may serve others before and after.
    Transient,
}

/// A texture or buffer, or a pair of them that changes roles every frame.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Resource {
    /// Name, unique in the plan.
    pub name: String,
    /// What it is made of.
    pub kind: Kind,
    /// How long its content lives.
    pub lifetime: Lifetime,
    /// A pair: this frame's copy is last frame's of the next.
    pub ping_pong: bool,
    /// The caller reads it too, after the stage that writes it and before the next stage does.
    pub exported: bool,
}

impl Resource {
    /// Bytes that limpid allocates for it, both copies together, at an image size.
    pub fn bytes(&self, size: UVec2) -> u64 {
        let single = match self.kind {
            Kind::Constants | Kind::Input => 0,
            Kind::Texture { format, extent } => format.bytes() * Count::Per(extent).of(size),
            Kind::Buffer { stride, count, .. } => stride * count.of(size),
        };
        if self.ping_pong { 2 * single } else { single }
    }
}

/// Which copy of a resource.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "export", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Copy {
    /// This frame's, or the only one.
    Current,
    /// Last frame's.
    Previous,
}

impl Copy {
    /// Index of the copy in a frame of the given phase (0 or 1), for a resource that is a pair or not.
    pub fn index(self, ping_pong: bool, phase: usize) -> usize {
        match (ping_pong, self) {
            (false, _) => 0,
            (true, Self::Current) => phase,
            (true, Self::Previous) => 1 - phase,
        }
    }
}
