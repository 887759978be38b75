//! Which pixels are denoised, and what the others get.

use glam::Mat3;
use serde::{Deserialize, Serialize};

use super::check_range;
use crate::Error;

/// What a pixel holds in the output that is left out: sky, or rougher than the threshold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Fallback {
    /// No radiance. Tiles that are left out altogether are written in two frames only, and cost nothing after.
    #[default]
    Black,
    /// The noisy input as it is. Where only listed rays are traced, that is whatever the renderer left there.
    Input,
    /// Black in the sky; elsewhere the `environment` input in the mirror direction, blurred by roughness.
    Environment,
}

/// Share of pixels that the renderer traces a ray for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RaysPerQuad {
    /// One ray for each 2x2 pixels.
    One,
    /// Two rays on the diagonal of each 2x2 pixels.
    Two,
    /// A ray for every pixel that is denoised.
    #[default]
    Four,
}

/// The list of rays that the classify pass makes for the renderer.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[non_exhaustive]
pub struct RayList {
    /// Rays in each quad. Mirrors always get one of their own.
    pub rays_per_quad: RaysPerQuad,
    /// Pixels whose variance in the last output was above this, 0 to 1, get a ray of their own.
    /// `None` leaves the check out.
    pub variance_threshold: Option<f32>,
}

/// Which pixels are denoised and what the others get.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[non_exhaustive]
pub struct Coverage {
    /// Roughest surface that is denoised: perceptual roughness, 0 to 1. 1 denoises all; the published value is
    /// 0.4472, GGX alpha 0.2.
    pub roughness_threshold: f32,
    /// Surfaces up to this perceptual roughness, 0 to 1, count as mirrors: their rays hold no noise of the
    /// lobe, so the prefilter leaves them alone.
    pub mirror_roughness: f32,
    /// Output of pixels that are left out.
    pub fallback: Fallback,
    /// Level of the environment map's mip chain at GGX alpha 1, 0 to 16. Only for [`Fallback::Environment`].
    pub environment_mip_scale: f32,
    /// Rotation from world space into the axes of the environment map (equirectangular, `y` up, `-z` at the
    /// centre). Only for [`Fallback::Environment`].
    pub environment_from_world: Mat3,
    /// Makes a list of the rays to trace. `None`: the renderer traces every pixel.
    pub ray_list: Option<RayList>,
}

impl Default for Coverage {
    fn default() -> Self {
        Self {
            roughness_threshold: 1.0,
            mirror_roughness: 0.01,
            fallback: Fallback::default(),
            environment_mip_scale: 9.0,
            environment_from_world: Mat3::IDENTITY,
            ray_list: None,
        }
    }
}

impl Coverage {
    pub(super) fn validate(&self) -> Result<(), Error> {
        let unit = "0 to 1";
        check_range("coverage.roughness_threshold", self.roughness_threshold, 0.0, 1.0, unit)?;
        check_range("coverage.mirror_roughness", self.mirror_roughness, 0.0, 1.0, unit)?;
        check_range("coverage.environment_mip_scale", self.environment_mip_scale, 0.0, 16.0, "0 to 16")?;
        for value in self.environment_from_world.to_cols_array() {
            check_range("coverage.environment_from_world", value, -1.001, 1.001, "a rotation")?;
        }
        if let Some(threshold) = self.ray_list.as_ref().and_then(|list| list.variance_threshold) {
            check_range("coverage.ray_list.variance_threshold", threshold, 0.0, 1.0, unit)?;
        }
        Ok(())
    }
}
