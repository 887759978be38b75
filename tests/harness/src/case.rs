use std::fmt;

use glam::{Mat4, UVec2, Vec2, Vec3, camera::rh};
use half::f16;
use limpid::settings::DepthEncoding;
use limpid::{Camera, FrameInputs, Settings};

use crate::{Executor, Snapshot};

/// Formats of the harness' images.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TexelFormat {
    /// Four half floats.
    Rgba16Float,
    /// Four floats.
    Rgba32Float,
    /// One float.
    R32Float,
    /// Two floats.
    Rg32Float,
}

/// An image as it lies in memory.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    /// Name of the input.
    pub name: &'static str,
    /// Format.
    pub format: TexelFormat,
    /// Size in texels.
    pub size: UVec2,
    /// Texels, row by row.
    pub words: Vec<u32>,
}

/// What the images of a frame hold at a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pixel {
    /// Noisy radiance and hit distance, kept in half floats.
    pub radiance: [f32; 4],
    /// World-space normal.
    pub normal: [f32; 3],
    /// Perceptual roughness.
    pub roughness: f32,
    /// Linear depth; 0 is sky.
    pub depth: f32,
    /// `uv_now - uv_before`.
    pub motion: [f32; 2],
    /// World-space motion of what was hit.
    pub hit_motion: [f32; 3],
}

impl Pixel {
    /// A rough white wall, 4 units away, that faces a camera which looks along -z.
    pub const WALL: Self = Self {
        radiance: [1.0; 4],
        normal: [0.0, 0.0, 1.0],
        roughness: 0.5,
        depth: 4.0,
        motion: [0.0; 2],
        hit_motion: [0.0; 3],
    };
}

/// The caller's images of a frame.
#[derive(Clone, PartialEq)]
pub struct Images {
    /// Size of all but the environment.
    pub size: UVec2,
    /// Row by row.
    pub pixels: Vec<Pixel>,
}

impl fmt::Debug for Images {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{} ", self.size.x, self.size.y)?;
        f.debug_list().entries(&self.pixels[..self.pixels.len().min(64)]).finish()
    }
}

/// Bits of the nearest half float; what is too large becomes the largest finite one, as renderers store it.
pub fn half_bits(value: f32) -> u16 {
    if value.is_finite() { f16::from_f32(value.clamp(-65504.0, 65504.0)) } else { f16::from_f32(value) }.to_bits()
}

fn half_words(texel: [f32; 4]) -> [u32; 2] {
    let [r, g, b, a] = texel.map(|value| u32::from(half_bits(value)));
    [r | g << 16, b | a << 16]
}

impl Images {
    /// Images whose pixels are given by a function of their position.
    pub fn new(size: UVec2, pixel: impl Fn(UVec2) -> Pixel) -> Self {
        let positions = (0..size.y).flat_map(|y| (0..size.x).map(move |x| UVec2::new(x, y)));
        Self { size, pixels: positions.map(pixel).collect() }
    }

    /// The images of all inputs of a frame, environment and last frame's G-buffer included.
    pub fn images(&self, previous: &Self) -> Vec<Image> {
        let mut images = self.own_images();
        let renamed = |image: Image| {
            let name = match image.name {
                "normal" => "prev_normal",
                "roughness" => "prev_roughness",
                "depth" => "prev_depth",
                _ => return None,
            };
            Some(Image { name, ..image })
        };
        images.extend(previous.own_images().into_iter().filter_map(renamed));
        images
    }

    fn own_images(&self) -> Vec<Image> {
        let image = |name, format, words| Image { name, format, size: self.size, words };
        let pixels = || self.pixels.iter();
        let normal = |p: &Pixel| [p.normal[0], p.normal[1], p.normal[2], 0.0].map(f32::to_bits);
        let hit_motion = |p: &Pixel| [p.hit_motion[0], p.hit_motion[1], p.hit_motion[2], 0.0].map(f32::to_bits);
        vec![
            image("radiance", TexelFormat::Rgba16Float, pixels().flat_map(|p| half_words(p.radiance)).collect()),
            image("normal", TexelFormat::Rgba32Float, pixels().flat_map(normal).collect()),
            image("roughness", TexelFormat::R32Float, pixels().map(|p| p.roughness.to_bits()).collect()),
            image("depth", TexelFormat::R32Float, pixels().map(|p| p.depth.to_bits()).collect()),
            image("motion", TexelFormat::Rg32Float, pixels().flat_map(|p| p.motion.map(f32::to_bits)).collect()),
            image("hit_motion", TexelFormat::Rgba32Float, pixels().flat_map(hit_motion).collect()),
            environment(),
        ]
    }
}

/// A sky that differs everywhere.
fn environment() -> Image {
    let size = UVec2::new(16, 8);
    let texel = |i: u32| half_words([i as f32 / 128.0, (i % 16) as f32 / 4.0, (i / 16) as f32, 1.0]);
    let words = (0..size.x * size.y).flat_map(texel).collect();
    Image { name: "environment", format: TexelFormat::Rgba16Float, size, words }
}

/// What happens before a frame.
#[derive(Debug, Clone, PartialEq)]
pub enum Change {
    /// Nothing.
    None,
    /// Memory for another largest size.
    Resize(UVec2),
    /// Other settings.
    Settings(Box<Settings>),
}

/// A frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// What happens before it.
    pub change: Change,
    /// Camera, size and the like.
    pub frame: FrameInputs,
    /// The caller's images.
    pub images: Images,
}

/// Settings and a sequence of frames.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// Settings to begin with.
    pub settings: Settings,
    /// Largest size to begin with.
    pub size: UVec2,
    /// Frames.
    pub steps: Vec<Step>,
}

impl Case {
    /// A still camera at the origin that looks along -z, default settings, linear depth.
    pub fn still(size: UVec2, frames: u32, pixel: impl Fn(u32, UVec2) -> Pixel) -> Self {
        let mut settings = Settings::default();
        settings.conventions.depth = DepthEncoding::Linear;
        let step = |frame| Step {
            change: Change::None,
            frame: FrameInputs::new(Self::camera(size), size),
            images: Images::new(size, |p| pixel(frame, p)),
        };
        Self { settings, size, steps: (0..frames).map(step).collect() }
    }

    /// A camera at the origin that looks along -z.
    pub fn camera(size: UVec2) -> Camera {
        let aspect = size.x as f32 / size.y as f32;
        let view_to_clip = rh::proj::directx::perspective(1.0, aspect, 0.1, 500.0);
        let world_to_view = rh::view::look_to_mat4(Vec3::ZERO, Vec3::NEG_Z, Vec3::Y);
        debug_assert!(world_to_view.abs_diff_eq(Mat4::IDENTITY, 1e-6));
        Camera { world_to_view, view_to_clip, jitter: Vec2::ZERO }
    }

    /// The plan of the settings and size to begin with.
    ///
    /// # Panics
    ///
    /// When they cannot be used.
    pub fn core(&self) -> limpid::Denoiser {
        limpid::Denoiser::new(&self.settings, self.size).unwrap()
    }

    /// The images of all inputs of a frame. The first one is given its own G-buffer as last frame's: history that should
    /// not be there would be found.
    pub fn images(&self, index: usize) -> Vec<Image> {
        self.steps[index].images.images(&self.steps[index.saturating_sub(1)].images)
    }

    /// What an executor leaves in memory after each frame.
    pub fn run(&self, executor: &mut dyn Executor) -> Vec<Snapshot> {
        self.run_plan(executor, self.core())
    }

    /// The same for a plan that is not the settings' own.
    pub fn run_plan(&self, executor: &mut dyn Executor, core: limpid::Denoiser) -> Vec<Snapshot> {
        executor.start(core);
        let mut size = self.size;
        let frame = |(index, step): (usize, &Step)| {
            match &step.change {
                Change::None => {}
                Change::Resize(to) => {
                    size = *to;
                    executor.resize(size);
                }
                Change::Settings(settings) => executor.set_settings(settings),
            }
            let mut snapshot = executor.frame(&self.images(index), &step.frame);
            snapshot.note_listed(size, step.frame.size);
            snapshot
        };
        self.steps.iter().enumerate().map(frame).collect()
    }
}
