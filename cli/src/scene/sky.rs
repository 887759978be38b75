//! What rays see that leave the scene: a gradient and, on request, a sun.

use glam::Vec3;

/// A distant disc of light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sun {
    /// Unit vector towards the sun.
    pub direction: Vec3,
    /// Angular radius, radians.
    pub radius: f32,
    /// Radiance of the disc, linear RGB, on top of the gradient.
    pub radiance: Vec3,
}

/// Radiance from infinity, linear RGB.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sky {
    /// Straight up.
    pub zenith: Vec3,
    /// Just above the horizon.
    pub horizon: Vec3,
    /// Below the horizon.
    pub ground: Vec3,
    /// The sun, if it shines.
    pub sun: Option<Sun>,
}

impl Sky {
    /// Radiance of the gradient along a unit direction, without the sun.
    pub(super) fn gradient(&self, direction: Vec3) -> Vec3 {
        let height = direction.y;
        if height >= 0.0 {
            self.horizon.lerp(self.zenith, height.sqrt())
        } else {
            self.horizon.lerp(self.ground, (-height * 8.0).min(1.0))
        }
    }
}
