//! How the data of the caller is encoded.

use glam::Vec2;
use serde::{Deserialize, Serialize};

use super::check_range;
use crate::Error;

/// How the caller's `depth` is to be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DepthEncoding {
    /// Depth buffer, 0 at the near plane, 1 at the far plane (which may be infinite). 1 is sky.
    #[default]
    Device,
    /// Depth buffer, 1 at the near plane, 0 at the far plane (which may be infinite). 0 is sky.
    ReversedDevice,
    /// Distance along the view direction in world units, positive. 0 or less is sky.
    Linear,
}

/// How the caller's `normal` is to be read. Normals are in world space and need not have unit length.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NormalEncoding {
    /// `xyz` as they are, from a float or snorm format.
    #[default]
    Signed,
    /// `xyz * 2 - 1`, from a unorm format.
    Unsigned,
    /// Octahedral map in `xy`, -1 to 1.
    Octahedral,
    /// Octahedral map in `xy`, 0 to 1.
    OctahedralUnsigned,
}

/// How the caller's `roughness` is to be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RoughnessEncoding {
    /// Perceptual roughness, the square root of GGX alpha.
    #[default]
    Perceptual,
    /// GGX alpha.
    Alpha,
}

/// Channel of a texture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Channel {
    /// First.
    #[default]
    Red,
    /// Second.
    Green,
    /// Third.
    Blue,
    /// Fourth.
    Alpha,
}

/// Direction of `y` in normalised device coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NdcY {
    /// Up, as in Direct3D, Metal and WebGPU.
    #[default]
    Up,
    /// Down, as in Vulkan with a viewport of positive height.
    Down,
}

/// How the caller's data is encoded. See the crate documentation for spaces and signs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[non_exhaustive]
pub struct Conventions {
    /// Encoding of `depth`.
    pub depth: DepthEncoding,
    /// Linear depth from which a pixel is sky, in world units, above 0. Only for [`DepthEncoding::Linear`].
    pub sky_distance: f32,
    /// Encoding of `normal`.
    pub normal: NormalEncoding,
    /// Encoding of `roughness`.
    pub roughness: RoughnessEncoding,
    /// Channel of the `roughness` texture that holds it.
    pub roughness_channel: Channel,
    /// Factor from the caller's `motion` to `uv_now - uv_before`, uv with its origin at the top left and `y`
    /// down. `(1, 1)` for exactly that; `(0.5, -0.5)` for `ndc_now - ndc_before`; `(-1, -1)` for vectors that
    /// point to where the surface was; `1 / size` for vectors in pixels.
    pub motion_scale: Vec2,
    /// Whether `motion` contains the difference of the two frames' jitter.
    pub motion_includes_jitter: bool,
    /// Direction of `y` in clip space.
    pub ndc_y: NdcY,
}

impl Default for Conventions {
    fn default() -> Self {
        Self {
            depth: DepthEncoding::default(),
            sky_distance: f32::MAX,
            normal: NormalEncoding::default(),
            roughness: RoughnessEncoding::default(),
            roughness_channel: Channel::default(),
            motion_scale: Vec2::ONE,
            motion_includes_jitter: false,
            ndc_y: NdcY::default(),
        }
    }
}

impl Conventions {
    pub(super) fn validate(&self) -> Result<(), Error> {
        check_range("conventions.sky_distance", self.sky_distance, f32::MIN_POSITIVE, f32::MAX, "above 0")?;
        for scale in self.motion_scale.to_array() {
            check_range("conventions.motion_scale", scale, f32::MIN, f32::MAX, "a finite number")?;
        }
        Ok(())
    }
}
