//! A sequence of images that stresses numbers, as functions of frame and pixel.

use glam::{Mat4, UVec2, Vec2, Vec3, camera::rh};
use limpid::settings::{DepthEncoding, Fallback};
use limpid::{Camera, Settings};

use crate::sequence::Frame;

/// What the images of a frame hold at a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pixel {
    /// Noisy radiance and hit distance.
    pub radiance: [f32; 4],
    /// World-space normal.
    pub normal: [f32; 3],
    /// Perceptual roughness.
    pub roughness: f32,
    /// Depth, in the encoding of the case's settings.
    pub depth: f32,
    /// `uv_now - uv_before`.
    pub motion: [f32; 2],
}

impl Pixel {
    /// A rough white wall, 4 units away, that faces a camera which looks along -z. Every preset denoises it.
    pub const WALL: Self =
        Self { radiance: [1.0, 1.0, 1.0, 3.0], normal: [0.0, 0.0, 1.0], roughness: 0.4, depth: 4.0, motion: [0.0; 2] };

    /// The wall with this radiance.
    pub fn lit(radiance: f32) -> Self {
        Self { radiance: [radiance, radiance, radiance, 3.0], ..Self::WALL }
    }
}

/// What a frame has besides images.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// In pixels, at most the case's size.
    pub size: UVec2,
    /// Camera.
    pub camera: Camera,
    /// Whether history is of no use.
    pub reset: bool,
    /// Exposure.
    pub exposure: f32,
}

impl Step {
    /// A still camera at the origin that looks along -z.
    pub fn still(size: UVec2) -> Self {
        let aspect = size.x as f32 / size.y as f32;
        let camera = Camera {
            world_to_view: Mat4::IDENTITY,
            view_to_clip: rh::proj::directx::perspective(1.0, aspect, 0.1, 500.0),
            jitter: Vec2::ZERO,
        };
        Self { size, camera, reset: false, exposure: 1.0 }
    }

    /// The camera somewhere else.
    pub fn at(mut self, eye: Vec3) -> Self {
        self.camera.world_to_view = Mat4::from_translation(-eye);
        self
    }
}

/// What must hold of the output.
#[derive(Debug, Clone, PartialEq)]
pub enum Criterion {
    /// Every value is a finite number. Holds of every case.
    Finite,
    /// Radiance lies between the least and the most that was put in so far, up to rounding. Holds of every case.
    Bounded,
    /// Where the twin differs at one pixel, outputs differ within so many pixels of it and by less than a
    /// twentieth after so many frames.
    Contained {
        /// The pixel that differs.
        at: UVec2,
        /// The frame in which it does.
        frame: usize,
        /// Pixels in each direction.
        reach: u32,
        /// Frames until it is forgotten.
        lifetime: usize,
    },
    /// Outputs of the twin, whose input differs by rounding, differ by at most so much on average, relatively.
    Insensitive(f64),
    /// Mean of the last output over the mean of all inputs.
    Energy(f64, f64),
    /// From this frame on the mean stays within a tenth of the input's, after at most so many frames.
    Settles {
        /// The frame of the change.
        from: usize,
        /// Frames that it may take.
        within: usize,
    },
    /// The last two frames differ by no more than two steps of a half float.
    AtRest,
    /// The mean changes by no more than this share from the given frame to the last.
    NoDrift {
        /// When the beginning is over.
        from: usize,
        /// Share of the mean.
        within: f64,
    },
    /// The last step is refused with a message that contains this.
    Refused(&'static str),
}

/// Images at a frame and pixel.
pub type Paint = Box<dyn Fn(usize, UVec2) -> Pixel + Sync>;

/// Something that may go wrong.
pub struct Case {
    /// What is extreme about it.
    pub group: &'static str,
    /// Unique name.
    pub name: String,
    /// Largest size, in pixels.
    pub size: UVec2,
    /// How many frames.
    pub frames: usize,
    /// Changes of the preset's settings.
    pub settings: fn(&mut Settings),
    /// Images.
    pub paint: Paint,
    /// Almost the same images, to compare with.
    pub twin: Option<Paint>,
    /// Everything else.
    pub step: Box<dyn Fn(usize) -> Step + Sync>,
    /// What must hold, besides what always must.
    pub criteria: Vec<Criterion>,
}

impl Case {
    /// A wall that some function paints, seen by a still camera for 8 frames.
    pub fn new(
        group: &'static str,
        name: impl Into<String>,
        paint: impl Fn(usize, UVec2) -> Pixel + Sync + 'static,
    ) -> Self {
        let size = UVec2::new(40, 24);
        Self {
            group,
            name: name.into(),
            size,
            frames: 8,
            settings: |_| (),
            paint: Box::new(paint),
            twin: None,
            step: Box::new(move |_| Step::still(size)),
            criteria: Vec::new(),
        }
    }

    /// Lasts so many frames.
    pub fn lasting(mut self, frames: usize) -> Self {
        self.frames = frames;
        self
    }

    /// Has this size, and a still camera for it.
    pub fn sized(mut self, x: u32, y: u32) -> Self {
        self.size = UVec2::new(x, y);
        let size = self.size;
        self.step = Box::new(move |_| Step::still(size));
        self
    }

    /// Has these cameras, sizes and the like.
    pub fn stepped(mut self, step: impl Fn(usize) -> Step + Sync + 'static) -> Self {
        self.step = Box::new(step);
        self
    }

    /// Changes settings.
    pub fn with(mut self, settings: fn(&mut Settings)) -> Self {
        self.settings = settings;
        self
    }

    /// Has a twin.
    pub fn against(mut self, twin: impl Fn(usize, UVec2) -> Pixel + Sync + 'static) -> Self {
        self.twin = Some(Box::new(twin));
        self
    }

    /// Must fulfil this too.
    pub fn must(mut self, criterion: Criterion) -> Self {
        self.criteria.push(criterion);
        self
    }

    /// The preset's settings as this case has them; depth is linear unless the case says otherwise, and what is left out
    /// keeps its input, so that bounds of radiance say something of it too.
    pub fn settings_of(&self, preset: limpid::Preset) -> Settings {
        let mut settings = preset.settings();
        settings.coverage.fallback = Fallback::Input;
        settings.conventions.depth = DepthEncoding::Linear;
        (self.settings)(&mut settings);
        settings
    }

    /// The images of a frame, or those of the twin.
    pub fn frame(&self, number: usize, paint: &Paint) -> (Frame, f32) {
        let Step { size, camera, reset, exposure } = (self.step)(number);
        let positions = (0..size.y).flat_map(|y| (0..size.x).map(move |x| UVec2::new(x, y)));
        let pixels: Vec<Pixel> = positions.map(|p| paint(number, p)).collect();
        let frame = Frame {
            number: number as u32,
            size,
            reset,
            seconds: 1.0 / 60.0,
            camera,
            radiance: pixels.iter().map(|p| p.radiance).collect(),
            normal: pixels.iter().map(|p| p.normal).collect(),
            roughness: pixels.iter().map(|p| p.roughness).collect(),
            depth: pixels.iter().map(|p| p.depth).collect(),
            motion: pixels.iter().map(|p| p.motion).collect(),
            hit_motion: None,
            reference: None,
        };
        (frame, exposure)
    }
}

/// Repeatable noise, uniform in 0 to 1.
pub(super) fn noise(frame: usize, p: UVec2) -> f32 {
    let mut state =
        (frame as u32).wrapping_mul(0x9e37_79b9) ^ p.x.wrapping_mul(0x85eb_ca6b) ^ p.y.wrapping_mul(0xc2b2_ae35);
    for _ in 0..3 {
        state = (state ^ (state >> 15)).wrapping_mul(0x2c1b_3c6d).rotate_left(11);
    }
    (state >> 8) as f32 / (1 << 24) as f32
}
