//! Cameras: shots as data, matrices from them, and rays from matrices.

use glam::camera::rh::proj::directx::perspective;
use glam::camera::rh::view;
use glam::{Mat4, Quat, UVec2, Vec2, Vec3, Vec4};
use limpid::Camera;

/// Near and far plane of every scene, world units.
const CLIP_RANGE: [f32; 2] = [0.1, 1000.0];

/// A stretch of camera movement that begins at a cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shot {
    /// First frame of the shot.
    pub first: u32,
    /// Where the camera stands on the first frame.
    pub eye: Vec3,
    /// What it looks at on the first frame.
    pub target: Vec3,
    /// Movement of eye and target together, world units per second.
    pub travel: Vec3,
    /// Turn of the eye about the vertical through the target, radians per second.
    pub turn: f32,
    /// Vertical field of view, radians.
    pub fov_y: f32,
}

/// A resting camera at eye height, five units from the origin.
impl Default for Shot {
    fn default() -> Self {
        Self {
            first: 0,
            eye: Vec3::new(0.0, 1.6, 5.0),
            target: Vec3::Y,
            travel: Vec3::ZERO,
            turn: 0.0,
            fov_y: 50_f32.to_radians(),
        }
    }
}

impl Shot {
    /// The camera `time` seconds into this shot. An empty image counts as square.
    pub(super) fn camera(&self, time: f32, size: UVec2) -> Camera {
        let target = self.target + self.travel * time;
        let eye = target + Quat::from_rotation_y(self.turn * time) * (self.eye - self.target);
        let size = size.max(UVec2::ONE).as_vec2();
        let [near, far] = CLIP_RANGE;
        Camera {
            world_to_view: view::look_at_mat4(eye, target, Vec3::Y),
            view_to_clip: perspective(self.fov_y, size.x / size.y, near, far),
            jitter: Vec2::ZERO,
        }
    }
}

/// A camera with its inverse at hand.
pub(super) struct View {
    camera: Camera,
    view_to_world: Mat4,
    /// Camera position in world space.
    pub(super) eye: Vec3,
    /// Unit vector along which depth is measured.
    pub(super) forward: Vec3,
}

impl View {
    pub(super) fn new(camera: &Camera) -> Self {
        let view_to_world = camera.world_to_view.inverse();
        Self {
            camera: *camera,
            view_to_world,
            eye: view_to_world.w_axis.truncate(),
            forward: -view_to_world.z_axis.truncate(),
        }
    }

    /// Unit direction through a uv, whose origin is the top left of the image.
    pub(super) fn direction(&self, uv: Vec2) -> Vec3 {
        let ndc = Vec2::new(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y);
        let projection = &self.camera.view_to_clip;
        let ray = Vec3::new(ndc.x / projection.x_axis.x, ndc.y / projection.y_axis.y, -1.0);
        self.view_to_world.transform_vector3(ray).normalize()
    }

    /// Where a homogeneous world position appears (w = 0: a direction at infinity), or `None`
    /// behind the camera.
    pub(super) fn project(&self, world: Vec4) -> Option<Vec2> {
        let clip = self.camera.view_to_clip * (self.camera.world_to_view * world);
        let ndc = Vec2::new(clip.x, clip.y) / clip.w;
        (clip.w > 0.0).then(|| Vec2::new(0.5 + 0.5 * ndc.x, 0.5 - 0.5 * ndc.y))
    }
}

/// uv of a pixel's centre.
pub(super) fn pixel_uv(pixel: UVec2, size: UVec2) -> Vec2 {
    (pixel.as_vec2() + 0.5) / size.as_vec2()
}
