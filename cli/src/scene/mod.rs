//! Procedural scenes with a small path tracer: animated G-buffers, one-sample reflections and
//! their converged mean, without a file to load.
//!
//! The signal is that of a real-time reflections pass: per pixel one ray in the GGX lobe of
//! visible normals, its radiance **not** multiplied by any material term of the surface the
//! camera sees. World units are metres, time runs at [`Scene::frames_per_second`]. Everything is a
//! function of scene, frame number and pixel, whatever the number of threads.
//!
//! ```
//! # use limpid_cli::scene::{REFERENCE_SAMPLES, by_name};
//! let scene = by_name("gallery").expect("a built-in scene");
//! let frame = scene.render(0, glam::UVec2::new(32, 18), 4);
//! assert!(frame.reset && frame.reference.is_some());
//! assert!(REFERENCE_SAMPLES > 4);
//! ```

mod bounds;
mod camera;
mod gbuffer;
mod library;
mod light;
mod lobe;
mod object;
mod sampler;
mod shape;
mod sky;
#[cfg(test)]
mod tests;
mod texture;
mod transport;
mod world;

pub use camera::Shot;
pub use library::{NAMES, all, by_name};
pub use object::{Material, Movement, Object, Pose};
pub use shape::Shape;
pub use sky::{Sky, Sun};
pub use texture::{Finish, Pattern};

use crate::sequence::Frame;
use camera::View;
use gbuffer::Surface;
use glam::{UVec2, Vec3};
use limpid::Camera;
use rayon::prelude::*;
use sampler::{Sampler, hash};
use world::World;

/// Frame rate of the scenes in [`all`]; [`by_name`] has them at others too.
pub const FRAMES_PER_SECOND: f32 = 60.0;

/// Reference samples that leave an error below 40 dB (PSNR of `x / (1 + x)`) in every scene.
pub const REFERENCE_SAMPLES: u32 = 96;

/// A scene as plain data: what is there, how it moves, and from where it is seen.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Identifier, as in [`NAMES`].
    pub name: &'static str,
    /// One sentence about what the scene shows and stresses.
    pub description: &'static str,
    /// Everything rays can hit, lamps included.
    pub objects: Vec<Object>,
    /// What rays see that hit nothing.
    pub sky: Sky,
    /// Radiance that stands in for light scattered more than once, linear RGB.
    pub ambient: Vec3,
    /// Camera movement, by ascending first frame. Each shot begins with a cut.
    pub shots: Vec<Shot>,
    /// What the time between two frames follows from, `> 0.0`.
    pub frames_per_second: f32,
}

impl Scene {
    /// The same movement at another frame rate. Cuts fall on the frame nearest to their time.
    pub fn at_rate(mut self, frames_per_second: f32) -> Self {
        for shot in &mut self.shots {
            shot.first = (shot.first as f32 * frames_per_second / self.frames_per_second).round() as u32;
        }
        self.frames_per_second = frames_per_second;
        self
    }

    /// Seconds from frame 0 to a frame.
    fn time(&self, frame: u32) -> f32 {
        frame as f32 / self.frames_per_second
    }

    /// The camera of a frame, without jitter.
    pub fn camera(&self, frame: u32, size: UVec2) -> Camera {
        let shot = self.shots.iter().rev().find(|shot| shot.first <= frame);
        let shot = shot.or(self.shots.first()).copied().unwrap_or_default();
        shot.camera(self.time(frame.saturating_sub(shot.first)), size)
    }

    /// G-buffer, one-sample radiance of every pixel and, if `reference_samples` is not zero, the
    /// reference. [`REFERENCE_SAMPLES`] is enough for most uses.
    pub fn render(&self, frame: u32, size: UVec2, reference_samples: u32) -> Frame {
        let mut image = self.gbuffer(frame, size);
        let pixels: Vec<_> = pixels(size).collect();
        image.radiance = self.trace(frame, &image, &pixels);
        image.reference = (reference_samples > 0).then(|| self.reference(frame, &image, reference_samples));
        image
    }

    /// G-buffer and the motion of what reflected rays hit: the radiance is zero and there
    /// is no reference.
    pub fn gbuffer(&self, frame: u32, size: UVec2) -> Frame {
        let cut = frame == 0 || self.shots.iter().any(|shot| shot.first == frame);
        let previous = (!cut).then(|| World::new(self, frame - 1));
        let mut image = gbuffer::gbuffer(&World::new(self, frame), previous.as_ref(), frame, size);
        image.hit_motion = Some(self.hit_motion(frame, &image));
        image
    }

    /// How far what [`Scene::trace`] hits in each pixel has moved since the last frame, world units; zero after a cut, at
    /// sky and where nothing is hit.
    fn hit_motion(&self, frame: u32, gbuffer: &Frame) -> Vec<[f32; 3]> {
        let (world, view) = (World::new(self, frame), View::new(&gbuffer.camera));
        let previous = World::new(self, if gbuffer.reset { frame } else { frame - 1 });
        let pixels: Vec<_> = pixels(gbuffer.size).collect();
        if world.poses == previous.poses {
            return vec![[0.0; 3]; pixels.len()];
        }
        let motion = |&pixel: &UVec2| {
            let surface = Surface::read(gbuffer, &view, pixel)?;
            let key = self.key(&[pixel.x, pixel.y, frame]);
            let hit = transport::first_hit(&world, &surface, &mut Sampler::independent(key))?;
            let [now, then] = [&world, &previous].map(|world| world.poses[hit.object].to_world(hit.local));
            Some((now - then).to_array())
        };
        pixels.par_iter().with_min_len(64).map(|pixel| motion(pixel).unwrap_or_default()).collect()
    }

    /// The noisy signal of some pixels: radiance of one reflected ray and its hit distance, as
    /// in [`Frame::radiance`]. Each value depends on scene, frame and pixel only, and is the one
    /// that [`Scene::render`] finds. Sky and pixels outside of the image are zero.
    pub fn trace(&self, frame: u32, gbuffer: &Frame, pixels: &[UVec2]) -> Vec<[f32; 4]> {
        let (world, view) = (World::new(self, frame), View::new(&gbuffer.camera));
        let one_ray = |&pixel: &UVec2| match Surface::read(gbuffer, &view, pixel) {
            Some(surface) => {
                let key = self.key(&[pixel.x, pixel.y, frame]);
                transport::one_ray(&world, &surface, &mut Sampler::independent(key))
            }
            None => [0.0; 4],
        };
        pixels.par_iter().with_min_len(64).map(one_ray).collect()
    }

    /// The mean of the noisy signal in every pixel, linear RGB; zero at sky and for no
    /// `samples`. Its small error is nearly the same in every frame, so it does not flicker.
    pub fn reference(&self, frame: u32, gbuffer: &Frame, samples: u32) -> Vec<[f32; 3]> {
        let (world, view) = (World::new(self, frame), View::new(&gbuffer.camera));
        let mean = |pixel: UVec2| match Surface::read(gbuffer, &view, pixel) {
            Some(surface) => {
                let key = self.key(&[pixel.x, pixel.y]);
                transport::mean(&world, &surface, key, samples)
            }
            None => [0.0; 3],
        };
        let pixels: Vec<_> = pixels(gbuffer.size).collect();
        pixels.into_par_iter().map(mean).collect()
    }

    /// Seeds differ by scene, so that noise is not shared.
    fn key(&self, words: &[u32]) -> u32 {
        let name = self.name.bytes().map(u32::from);
        hash(name.chain(words.iter().copied()))
    }
}

/// All pixels of an image in storage order.
fn pixels(size: UVec2) -> impl Iterator<Item = UVec2> {
    (0..size.y).flat_map(move |y| (0..size.x).map(move |x| UVec2::new(x, y)))
}
