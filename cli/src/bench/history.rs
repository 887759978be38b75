//! Where surfaces were in the frame before, from motion vectors and depth alone.

use glam::{Mat4, UVec2, Vec2, Vec3, Vec4};
use limpid::Camera;

use crate::sequence::Frame;

/// Relative difference of depth up to which two pixels show the same surface.
const SAME_DEPTH: f32 = 0.05;

/// A place in the frame before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// In pixels, centres at .5.
    pub position: Vec2,
    /// Linear depth there, were the surface still.
    pub depth: f32,
}

/// View-space position at a uv and a linear depth, for any camera that limpid accepts.
fn view_position(camera: &Camera, inverse: Mat4, uv: Vec2, depth: f32) -> Vec3 {
    let ndc = Vec2::new(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y);
    // Two points of the ray, neither of them on a plane that may be infinitely far.
    let near = inverse.project_point3(ndc.extend(0.25));
    let far = inverse.project_point3(ndc.extend(0.75));
    let forward = if camera.view_to_clip.z_axis.w == 0.0 { camera.view_to_clip.z_axis.z } else { near.z };
    let way = far - near;
    near + way * ((depth * forward.signum() - near.z) / way.z)
}

/// Finds places in a previous frame for the pixels of a frame.
pub struct History<'f> {
    frame: &'f Frame,
    previous: &'f Frame,
    inverse: Mat4,
    to_previous_view: Mat4,
}

impl<'f> History<'f> {
    /// From a frame to the one before it; `None` at a reset or where sizes differ.
    pub fn new(frame: &'f Frame, previous: Option<&'f Frame>) -> Option<Self> {
        let previous = previous.filter(|previous| !frame.reset && previous.size == frame.size)?;
        let to_previous_view = previous.camera.world_to_view * frame.camera.world_to_view.inverse();
        Some(Self { frame, previous, inverse: frame.camera.view_to_clip.inverse(), to_previous_view })
    }

    /// Where the surface of a pixel was; `None` off screen and for the sky.
    pub fn place(&self, index: usize) -> Option<Place> {
        let size = self.frame.size;
        let depth = self.frame.depth[index];
        let pixel = UVec2::new(index as u32 % size.x, index as u32 / size.x);
        let uv = (pixel.as_vec2() + 0.5) / size.as_vec2();
        let position = (uv - Vec2::from(self.frame.motion[index])) * size.as_vec2();
        let on_screen = position.cmpge(Vec2::ZERO).all() && position.cmplt(size.as_vec2()).all();
        if !on_screen || depth <= 0.0 {
            return None;
        }
        let view = view_position(&self.frame.camera, self.inverse, uv, depth);
        let depth = (self.to_previous_view * Vec4::from((view, 1.0))).z.abs();
        Some(Place { position, depth })
    }

    /// Bilinear taps around a place that show the surface: index and weight.
    pub fn taps(&self, place: Place) -> impl Iterator<Item = (usize, f32)> {
        let corner = (place.position - 0.5).floor();
        let f = place.position - 0.5 - corner;
        let last = self.frame.size.as_ivec2() - 1;
        let taps = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(x, y)| {
            let at = (corner.as_ivec2() + glam::IVec2::new(x, y)).clamp(glam::IVec2::ZERO, last);
            let weight = (if x == 0 { 1.0 - f.x } else { f.x }) * (if y == 0 { 1.0 - f.y } else { f.y });
            ((at.y * self.frame.size.x as i32 + at.x) as usize, weight)
        });
        taps.into_iter().filter(move |&(index, weight)| weight > 0.0 && self.shows(index, place.depth))
    }

    /// Whether a pixel and its neighbours in the frame before show nothing of the surface.
    pub fn is_disoccluded(&self, index: usize) -> bool {
        let Some(place) = self.place(index) else { return true };
        let (x, y) = (place.position.x as i32, place.position.y as i32);
        let size = self.frame.size.as_ivec2();
        let around = (y - 1..=y + 1).flat_map(|y| (x - 1..=x + 1).map(move |x| (x, y)));
        let mut inside = around.filter(|&(x, y)| x >= 0 && y >= 0 && x < size.x && y < size.y);
        !inside.any(|(x, y)| self.shows((y * size.x + x) as usize, place.depth))
    }

    fn shows(&self, index: usize, depth: f32) -> bool {
        let found = self.previous.depth[index];
        found > 0.0 && (found - depth).abs() <= SAME_DEPTH * depth
    }
}
