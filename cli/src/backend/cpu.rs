//! The CPU backend: the same kernels, no driver.

use std::time::Duration;

use anyhow::{Context, Result};
use glam::UVec2;
use half::f16;
use limpid::{FrameInputs, Plan, Settings};
use limpid_cpu::{Denoiser, Inputs, PrevGbuffer, TexelFormat, Texture};

use super::{Backend, Denoised, ListedRay, Tracer, split, timed, to_half, trace_listed};
use crate::sequence::Frame;

pub(crate) struct Cpu {
    description: String,
    denoiser: Denoiser,
    /// Normal, roughness and depth of the last frame.
    last: Option<[Texture; 3]>,
}

impl Cpu {
    pub(super) fn open(core: limpid::Denoiser) -> Result<Self> {
        let denoiser = Denoiser::with_core(core)?;
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        Ok(Self { description: format!("the CPU ({threads} threads, no driver)"), denoiser, last: None })
    }

    /// The same, watching what happens to numbers.
    pub(crate) fn open_probed(settings: &Settings, size: UVec2) -> Result<Self> {
        let mut cpu = Self::open(limpid::Denoiser::new(settings, size)?)?;
        cpu.denoiser.probe();
        Ok(cpu)
    }

    pub(crate) fn denoiser(&self) -> &Denoiser {
        &self.denoiser
    }
}

/// A texture from scalars, texel by texel.
fn texture(format: TexelFormat, size: UVec2, scalars: impl IntoIterator<Item = f32>) -> Texture {
    let mut texture = Texture::new(format, size.x, size.y);
    texture.write(scalars.into_iter().map(f32::to_bits));
    texture
}

/// Radiance in half floats, as renderers keep it.
fn radiance_texture(size: UVec2, radiance: &[[f32; 4]]) -> Texture {
    let mut texture = Texture::new(TexelFormat::Rgba16Float, size.x, size.y);
    let word = |low: f32, high: f32| u32::from(to_half(low).to_bits()) | u32::from(to_half(high).to_bits()) << 16;
    texture.write(radiance.iter().flat_map(|&[r, g, b, a]| [word(r, g), word(b, a)]));
    texture
}

fn all_inputs<'a>(
    radiance: &'a Texture,
    motion: &'a Texture,
    hit_motion: Option<&'a Texture>,
    [normal, roughness, depth]: &'a [Texture; 3],
    [prev_normal, prev_roughness, prev_depth]: &'a [Texture; 3],
) -> Inputs<'a> {
    let previous = Some(PrevGbuffer { normal: prev_normal, roughness: prev_roughness, depth: prev_depth });
    Inputs { radiance, normal, roughness, depth, motion, hit_motion, environment: None, previous }
}

/// The first three channels and the fourth.
fn read_halves(texture: &Texture, size: UVec2) -> (Vec<[f32; 3]>, Vec<f32>) {
    let words = texture.read();
    let row = texture.size()[0] as usize * 2;
    let rows = words.chunks_exact(row).take(size.y as usize);
    let texels = rows.flat_map(|row| row[..size.x as usize * 2].chunks_exact(2));
    let half = |bits: u32| f16::from_bits(bits as u16);
    split(texels.map(|texel| [half(texel[0]), half(texel[0] >> 16), half(texel[1]), half(texel[1] >> 16)]))
}

impl Backend for Cpu {
    fn device(&self) -> &str {
        &self.description
    }

    fn plan(&self) -> &Plan {
        self.denoiser.plan()
    }

    fn denoise(&mut self, frame: &Frame, exposure: f32, tracer: Option<Tracer<'_>>) -> Result<Denoised> {
        let size = frame.size;
        let mut frame_inputs = FrameInputs::new(frame.camera, size);
        frame_inputs.reset = frame.reset;
        frame_inputs.frame_seconds = frame.seconds;
        frame_inputs.exposure = exposure;
        let normals = super::normals(self.plan(), frame)?;
        let normal = texture(TexelFormat::Rgba32Float, size, normals.into_iter().flatten());
        let roughness = texture(TexelFormat::R32Float, size, frame.roughness.iter().copied());
        let depth = texture(TexelFormat::R32Float, size, frame.depth.iter().copied());
        let motion = texture(TexelFormat::Rg32Float, size, frame.motion.iter().flatten().copied());
        let hit_motion = super::hit_motion(self.plan(), frame)?;
        let hit_motion = hit_motion.map(|m| texture(TexelFormat::Rgba32Float, size, m.into_iter().flatten()));
        let mut radiance = radiance_texture(size, &frame.radiance);
        let gbuffer = [normal, roughness, depth];
        let previous = self.last.as_ref().unwrap_or(&gbuffer);

        let inputs = all_inputs(&radiance, &motion, hit_motion.as_ref(), &gbuffer, previous);
        let (mut time, mut cpu_time) = (Duration::ZERO, Duration::ZERO);
        timed(&mut time, &mut cpu_time, || self.denoiser.run_classify(&inputs, &frame_inputs))?;
        let mut rays = frame.depth.iter().filter(|depth| **depth > 0.0).count() as u64;
        let mut traced = None;
        if let Some(tracer) = tracer {
            let words = self.denoiser.ray_list().context("the settings ask for no ray list")?;
            let listed: Vec<_> = words.into_iter().map(ListedRay::unpack).collect();
            rays = listed.len() as u64;
            let values = trace_listed(&listed, size, tracer);
            radiance = radiance_texture(size, &values);
            traced = Some(values);
        }
        let inputs = all_inputs(&radiance, &motion, hit_motion.as_ref(), &gbuffer, previous);
        timed(&mut time, &mut cpu_time, || self.denoiser.run_denoise(&inputs))?;
        self.last = Some(gbuffer);
        let (radiance, variance) = read_halves(self.denoiser.output(), size);
        let debug_view = self.denoiser.debug_view().map(|texture| read_halves(texture, size).0);
        Ok(Denoised { radiance, variance, debug_view, time, cpu_time, pass_times: Vec::new(), rays, traced })
    }
}
