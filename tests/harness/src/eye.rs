//! A camera in 64 bits, to know independently what each pixel shows.

use glam::{DMat4, DQuat, DVec2, DVec3, UVec2};
use limpid::{Camera, FrameInputs};
use proptest::prelude::*;

use crate::Case;

/// Where a camera is, which way it looks (along -z before it turns), and what it makes of that.
#[derive(Debug, Clone, Copy)]
pub struct Eye {
    /// Position in the world.
    pub position: DVec3,
    /// World from view.
    pub rotation: DQuat,
    /// Clip from view, depth 0 to 1.
    pub projection: DMat4,
    /// Pixels.
    pub size: UVec2,
}

impl Eye {
    /// One with the harness' perspective.
    pub fn new(position: DVec3, rotation: DQuat, size: UVec2) -> Self {
        Self { position, rotation, projection: Case::camera(size).view_to_clip.as_dmat4(), size }
    }

    /// What limpid is told of it.
    pub fn frame(&self) -> FrameInputs {
        let world_to_view = DMat4::from_quat(self.rotation.inverse()) * DMat4::from_translation(-self.position);
        let camera = Camera {
            world_to_view: world_to_view.as_mat4(),
            view_to_clip: self.projection.as_mat4(),
            ..Case::camera(self.size)
        };
        FrameInputs::new(camera, self.size)
    }

    /// Where the line through the centre of a pixel begins, and its unit direction.
    pub fn ray(&self, pixel: UVec2) -> (DVec3, DVec3) {
        let uv = (pixel.as_dvec2() + 0.5) / self.size.as_dvec2();
        let at =
            |depth| self.projection.inverse().project_point3(DVec3::new(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y, depth));
        // Rays of a perspective meet in the camera, parallel ones in no point.
        let (near, far) = (at(0.25), at(0.75));
        let is_perspective = self.projection.w_axis.w == 0.0;
        let origin = if is_perspective { DVec3::ZERO } else { DVec3::new(near.x, near.y, 0.0) };
        let away = (far - near) * (near.z - far.z).signum();
        (self.position + self.rotation * origin, self.rotation * away.normalize())
    }

    /// Where a point is on screen, in pixels, unless it is behind the camera.
    pub fn place(&self, point: DVec3) -> Option<DVec2> {
        let ndc = self.projection.project_point3(self.in_view(point));
        (self.depth(point) > 0.1).then(|| DVec2::new(0.5 + 0.5 * ndc.x, 0.5 - 0.5 * ndc.y) * self.size.as_dvec2())
    }

    /// Linear depth.
    pub fn depth(&self, point: DVec3) -> f64 {
        -self.in_view(point).z
    }

    /// Depth as a depth buffer holds it.
    pub fn device_depth(&self, point: DVec3) -> f64 {
        self.projection.project_point3(self.in_view(point)).z
    }

    fn in_view(&self, point: DVec3) -> DVec3 {
        self.rotation.inverse() * (point - self.position)
    }
}

/// Any vector whose components are below `reach`.
pub fn any_vector(reach: f64) -> impl Strategy<Value = DVec3> {
    prop::array::uniform3(-reach..reach).prop_map(DVec3::from)
}

/// Any rotation by less than about `reach` radians.
pub fn any_turn(reach: f64) -> impl Strategy<Value = DQuat> {
    any_vector(reach).prop_map(DQuat::from_scaled_axis)
}
