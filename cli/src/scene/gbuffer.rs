//! What the camera sees: the G-buffer, and surfaces read back from it.

use super::camera::{View, pixel_uv};
use super::transport::lift;
use super::world::World;
use crate::sequence::Frame;
use glam::{UVec2, Vec2, Vec3};
use rayon::prelude::*;

/// What a G-buffer tells about the surface in a pixel, in world space.
pub(super) struct Surface {
    /// Position, moved off the surface so that rays can start here.
    pub(super) origin: Vec3,
    /// Unit normal on the camera's side.
    pub(super) normal: Vec3,
    /// Unit direction to the camera.
    pub(super) view: Vec3,
    /// Perceptual roughness.
    pub(super) roughness: f32,
}

impl Surface {
    /// Reads a pixel; `None` for sky and for pixels outside of the image.
    pub(super) fn read(gbuffer: &Frame, view: &View, pixel: UVec2) -> Option<Self> {
        let inside = pixel.cmplt(gbuffer.size).all();
        let index = inside.then(|| (pixel.y * gbuffer.size.x + pixel.x) as usize)?;
        let (depth, normal) = (*gbuffer.depth.get(index)?, *gbuffer.normal.get(index)?);
        let roughness = *gbuffer.roughness.get(index)?;
        let direction = view.direction(pixel_uv(pixel, gbuffer.size));
        let position = view.eye + direction * (depth / direction.dot(view.forward));
        let normal = Vec3::from_array(normal);
        (depth > 0.0).then(|| Self { origin: lift(position, normal), normal, view: -direction, roughness })
    }
}

/// One pixel of a G-buffer; the default is sky that does not move.
struct Pixel {
    normal: [f32; 3],
    roughness: f32,
    depth: f32,
    motion: [f32; 2],
}

/// The G-buffer of a frame. `previous` is the world one frame ago, or `None` after a cut.
pub(super) fn gbuffer(world: &World, previous: Option<&World>, number: u32, size: UVec2) -> Frame {
    let camera = world.scene.camera(number, size);
    let before = world.scene.camera(number.saturating_sub(1), size);
    let (view, before) = (View::new(&camera), View::new(&before));
    let pixels: Vec<Pixel> = (0..size.y)
        .into_par_iter()
        .flat_map_iter(|y| (0..size.x).map(move |x| UVec2::new(x, y)))
        .map(|pixel| see(world, previous, &view, &before, pixel_uv(pixel, size)))
        .collect();
    Frame {
        number,
        size,
        reset: previous.is_none(),
        seconds: 1.0 / world.scene.frames_per_second,
        camera,
        radiance: vec![[0.0; 4]; pixels.len()],
        normal: pixels.iter().map(|p| p.normal).collect(),
        roughness: pixels.iter().map(|p| p.roughness).collect(),
        depth: pixels.iter().map(|p| p.depth).collect(),
        motion: pixels.iter().map(|p| p.motion).collect(),
        hit_motion: None,
        reference: None,
    }
}

/// Shoots the ray of one pixel.
fn see(world: &World, previous: Option<&World>, view: &View, before: &View, uv: Vec2) -> Pixel {
    let direction = view.direction(uv);
    let hit = world.hit(view.eye, direction);
    // A point that was behind the camera, or a frame without a past, has no motion.
    let motion = previous.and_then(|previous| {
        let then = match &hit {
            Some(hit) => previous.poses[hit.object].to_world(hit.local).extend(1.0),
            None => direction.extend(0.0),
        };
        before.project(then)
    });
    let motion = motion.map_or(Vec2::ZERO, |then| uv - then).to_array();
    match hit {
        Some(hit) => Pixel {
            normal: hit.normal.normalize().to_array(),
            roughness: world.roughness(&hit),
            depth: hit.distance * direction.dot(view.forward),
            motion,
        },
        None => Pixel { normal: [0.0; 3], roughness: 1.0, depth: 0.0, motion },
    }
}
