//! The GGX lobe of visible normals, in which the reflected ray is drawn.
//!
//! Heitz 2018, "Sampling the GGX Distribution of Visible Normals", JCGT 7(4).

use glam::{Mat3, Vec2, Vec3};
use std::f32::consts::{PI, TAU};

/// Roughness below which a surface is a perfect mirror.
pub(super) const MIRROR_ROUGHNESS: f32 = 0.01;

/// Directions in which a surface point reflects the camera.
pub(super) struct Lobe {
    /// Tangent space to world; Z is the normal.
    frame: Mat3,
    /// Unit vector to the camera, tangent space, z > 0.
    view: Vec3,
    /// GGX width, or zero for a perfect mirror.
    alpha: f32,
}

impl Lobe {
    /// `normal` and `view` are unit vectors in world space on the same side of the surface.
    pub(super) fn new(normal: Vec3, view: Vec3, roughness: f32) -> Self {
        let frame = frame_around(normal);
        let view = frame.transpose() * view;
        Self {
            frame,
            view: view.with_z(view.z.max(1e-4)).normalize(),
            alpha: if roughness < MIRROR_ROUGHNESS { 0.0 } else { roughness * roughness },
        }
    }

    /// Whether all light comes from a single direction.
    pub(super) fn is_mirror(&self) -> bool {
        self.alpha == 0.0
    }

    /// Reflects the view about a random visible normal (Heitz 2018, section 3). `None` if the
    /// reflection points into the surface.
    pub(super) fn sample(&self, random: Vec2) -> Option<Vec3> {
        let normal = if self.is_mirror() { Vec3::Z } else { self.visible_normal(random) };
        let light = 2.0 * self.view.dot(normal) * normal - self.view;
        (light.z > 0.0).then(|| (self.frame * light).normalize())
    }

    fn visible_normal(&self, random: Vec2) -> Vec3 {
        let stretch = Vec3::new(self.alpha, self.alpha, 1.0);
        // Stretched, the lobe is a hemisphere: draw a point of the disc it projects to along the
        // view, of which the tilt squeezes one half.
        let view = (stretch * self.view).normalize();
        let across = Vec3::Z.cross(view).normalize_or(Vec3::X);
        let along = view.cross(across);
        let (radius, angle) = (random.x.sqrt(), TAU * random.y);
        let x = radius * angle.cos();
        let lean = 0.5 * (1.0 + view.z);
        let y = (1.0 - lean) * (1.0 - x * x).max(0.0).sqrt() + lean * radius * angle.sin();
        let z = (1.0 - x * x - y * y).max(0.0).sqrt();
        let normal = x * across + y * along + z * view;
        (stretch * normal.with_z(normal.z.max(0.0))).normalize_or(Vec3::Z)
    }

    /// Probability density of [`Lobe::sample`] per solid angle about a unit direction in world
    /// space; zero below the surface and for mirrors.
    ///
    /// With the visible-normal density `G1 D max(0, v.h) / v.z` and the Jacobian `1 / (4 v.h)`
    /// of the reflection it is `G1 D / (4 v.z)`.
    pub(super) fn density(&self, direction: Vec3) -> f32 {
        let light = self.frame.transpose() * direction;
        if self.is_mirror() || light.z <= 0.0 {
            return 0.0;
        }
        let half = (self.view + light).normalize();
        let square = self.alpha * self.alpha;
        // 1 - h.z^2 is written as h.x^2 + h.y^2, which keeps its digits in narrow lobes.
        let spread = square * half.z * half.z + half.x * half.x + half.y * half.y;
        let distribution = square / (PI * spread * spread);
        let cosine = self.view.z;
        distribution / (2.0 * (cosine + (square + (1.0 - square) * cosine * cosine).sqrt()))
    }
}

/// Cosine-distributed unit direction about a normal, world space.
pub(super) fn cosine_direction(normal: Vec3, random: Vec2) -> Vec3 {
    let (radius, angle) = (random.x.sqrt(), TAU * random.y);
    let local = Vec3::new(radius * angle.cos(), radius * angle.sin(), (1.0 - random.x).sqrt());
    (frame_around(normal) * local).normalize()
}

/// Rotation that takes +Z to a unit vector.
pub(super) fn frame_around(normal: Vec3) -> Mat3 {
    let (tangent, bitangent) = normal.any_orthonormal_pair();
    Mat3::from_cols(tangent, bitangent, normal)
}
