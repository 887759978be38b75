//! What the commands run a plan on.

mod cpu;
mod gpu;
mod vulkan;

use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use clap::ValueEnum;
use cpu_time::ProcessTime;
use glam::UVec2;
use half::f16;
use limpid::settings::DepthEncoding;
use limpid::{Plan, Settings};

use crate::sequence::Frame;
pub(crate) use cpu::Cpu;

/// A denoised frame and what it took.
#[derive(Debug, Clone)]
pub struct Denoised {
    /// Linear radiance, row by row.
    pub radiance: Vec<[f32; 3]>,
    /// Temporal variance, 0 to 1, row by row.
    pub variance: Vec<f32>,
    /// Linear colours of the debug view, 0 to 1, row by row, where the settings ask for one.
    pub debug_view: Option<Vec<[f32; 3]>>,
    /// From submission until the device was done, uploads and read-back excluded.
    pub time: Duration,
    /// Time that all processors together spent on it, for devices that are processors.
    pub cpu_time: Duration,
    /// Time of each pass by the device's own clock, in the order of the plan. Empty where it has none.
    pub pass_times: Vec<(String, Duration)>,
    /// Rays that were traced for it.
    pub rays: u64,
    /// The noisy radiance that the listed rays stand for, when a tracer was given.
    pub traced: Option<Vec<[f32; 4]>>,
}

/// Traces the reflection rays of some pixels: `rgb` radiance and `a` hit distance for each.
pub type Tracer<'a> = &'a dyn Fn(&[UVec2]) -> Vec<[f32; 4]>;

/// Something that denoises frames of a sequence one after another.
pub trait Backend {
    /// The device, in a few words.
    fn device(&self) -> &str;

    /// What it runs.
    fn plan(&self) -> &Plan;

    /// Denoises the frame that follows the last one. With a tracer, `frame.radiance` is not looked at: the rays
    /// that the classify pass lists are traced instead.
    ///
    /// # Errors
    ///
    /// For frames that the library refuses and for a device that fails.
    fn denoise(&mut self, frame: &Frame, exposure: f32, tracer: Option<Tracer<'_>>) -> Result<Denoised>;
}

/// Normals in four channels.
fn normals(plan: &Plan, frame: &Frame) -> Result<Vec<[f32; 4]>> {
    let are_there = !plan.inputs().any(|input| input == "normal") || frame.has_normals() || !frame.has_surfaces();
    ensure!(
        are_there,
        "there are no normals, which the feature normal_input reads: expected channels normal.X, .Y and .Z, or other ones \
         named with --channel normal=NAME, or --features=-normal_input, with which they are derived from depth"
    );
    Ok(frame.normal.iter().map(|&[x, y, z]| [x, y, z, 0.0]).collect())
}

/// The motion of what was hit, in four channels, where a plan wants it.
fn hit_motion(plan: &Plan, frame: &Frame) -> Result<Option<Vec<[f32; 4]>>> {
    if !plan.inputs().any(|input| input == "hit_motion") {
        return Ok(None);
    }
    let motion = frame.hit_motion.as_ref().context(
        "there is no hit motion, which the feature hit_motion needs: expected channels hit_motion.X, .Y and .Z, or other \
         ones named with --channel hit_motion=NAME",
    )?;
    Ok(Some(motion.iter().map(|&[x, y, z]| [x, y, z, 0.0]).collect()))
}

/// Runs `work` and adds its duration and processor time.
fn timed<T>(time: &mut Duration, cpu_time: &mut Duration, work: impl FnOnce() -> T) -> T {
    let (start, cpu_start) = (Instant::now(), ProcessTime::now());
    let result = work();
    *time += start.elapsed();
    *cpu_time += cpu_start.elapsed();
    result
}

/// Which backend to run on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum Choice {
    /// A device through wgpu if there is one, else the CPU.
    #[default]
    Auto,
    /// wgpu: Vulkan, Metal or Direct3D 12.
    Wgpu,
    /// ash: Vulkan alone.
    Ash,
    /// The CPU alone, without any driver.
    Cpu,
}

impl Choice {
    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Wgpu => "wgpu",
            Self::Ash => "ash",
            Self::Cpu => "cpu",
        }
    }
}

/// Splits texels into radiance and variance.
fn split(texels: impl Iterator<Item = [f16; 4]>) -> (Vec<[f32; 3]>, Vec<f32>) {
    texels.map(|[r, g, b, a]| ([r.to_f32(), g.to_f32(), b.to_f32()], a.to_f32())).unzip()
}

/// What automatic choice comes to on this machine, said on standard error where that is the CPU; other choices as
/// they are.
pub fn settle(choice: Choice) -> Choice {
    if choice != Choice::Auto {
        return choice;
    }
    match limpid::Denoiser::new(&Settings::default(), UVec2::ONE).map_err(Into::into).and_then(gpu::Gpu::open) {
        Ok(_) => Choice::Wgpu,
        Err(error) => {
            eprintln!("note: running on the CPU, because {error:#}");
            Choice::Cpu
        }
    }
}

/// Opens a backend for images of up to `size` pixels.
///
/// # Errors
///
/// When settings or size are refused, or there is no device of the kind asked for.
pub fn open(choice: Choice, settings: &Settings, size: UVec2) -> Result<Box<dyn Backend>> {
    // Sequences hold linear depth.
    let mut settings = settings.clone();
    settings.conventions.depth = DepthEncoding::Linear;
    open_encoded(choice, &settings, size)
}

/// Opens a backend for frames whose depth is encoded as the settings say.
///
/// # Errors
///
/// As [`open`].
pub fn open_encoded(choice: Choice, settings: &Settings, size: UVec2) -> Result<Box<dyn Backend>> {
    open_core(choice, limpid::Denoiser::new(settings, size)?)
}

/// Opens a backend that carries out a plan that is ready.
///
/// # Errors
///
/// When there is no device of the kind asked for.
pub fn open_core(choice: Choice, core: limpid::Denoiser) -> Result<Box<dyn Backend>> {
    match choice {
        Choice::Ash => Ok(Box::new(vulkan::Vulkan::open(core)?)),
        Choice::Wgpu => Ok(Box::new(gpu::Gpu::open(core)?)),
        Choice::Cpu => Ok(Box::new(cpu::Cpu::open(core)?)),
        Choice::Auto => match gpu::Gpu::open(core.clone()) {
            Ok(gpu) => Ok(Box::new(gpu)),
            Err(error) => {
                eprintln!("note: running on the CPU, because {error:#}");
                Ok(Box::new(cpu::Cpu::open(core)?))
            }
        },
    }
}

/// Half floats, with finite numbers that are too large as the largest there is.
pub(crate) fn to_half(value: f32) -> f16 {
    let clamped = if value.is_finite() { value.clamp(-65504.0, 65504.0) } else { value };
    f16::from_f32(clamped)
}

/// An entry of the ray list: where to trace, and which neighbours in the 2x2 quad get a copy.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ListedRay {
    /// Pixel to trace.
    pub pixel: UVec2,
    /// Copy to the other pixel of its row, of its column, and on the diagonal.
    pub copies: [bool; 3],
}

impl ListedRay {
    /// Decodes what `kernels/classify.wgsl` writes.
    pub fn unpack(word: u32) -> Self {
        let bit = |index: u32| word >> index & 1 == 1;
        Self { pixel: UVec2::new(word & 0x3fff, word >> 14 & 0x3fff), copies: [bit(28), bit(29), bit(30)] }
    }

    /// The pixels that its radiance goes to, its own first.
    pub fn targets(self) -> impl Iterator<Item = UVec2> {
        let others = [UVec2::new(1, 0), UVec2::new(0, 1), UVec2::ONE];
        let copied = others.into_iter().zip(self.copies).filter(|(_, wanted)| *wanted);
        std::iter::once(self.pixel).chain(copied.map(move |(other, _)| self.pixel ^ other))
    }
}

/// The radiance image that a ray list stands for; pixels without a ray stay 0.
pub fn trace_listed(rays: &[ListedRay], size: UVec2, tracer: Tracer<'_>) -> Vec<[f32; 4]> {
    let mut radiance = vec![[0.0; 4]; (size.x * size.y) as usize];
    let pixels: Vec<UVec2> = rays.iter().map(|ray| ray.pixel).collect();
    for (ray, value) in rays.iter().zip(tracer(&pixels)) {
        for target in ray.targets() {
            radiance[(target.y * size.x + target.x) as usize] = value;
        }
    }
    radiance
}
