use glam::UVec2;
use limpid::{FrameInputs, Settings};
use limpid_cpu::{Denoiser, Inputs, PrevGbuffer, Texture};

use super::Executor;
use crate::{Image, Snapshot, TexelFormat};

/// The CPU backend.
#[derive(Default)]
pub struct Cpu {
    denoiser: Option<Denoiser>,
    is_watched: bool,
    inexact: Option<u32>,
    overwritten: Option<u32>,
}

impl Cpu {
    /// At full speed.
    pub fn new() -> Self {
        Self::default()
    }

    /// In checked mode; see [`faults`](Self::faults).
    pub fn watched() -> Self {
        Self { is_watched: true, ..Self::default() }
    }

    /// With functions as inexact as Vulkan lets devices be.
    pub fn inexact(seed: u32) -> Self {
        Self { inexact: Some(seed), ..Self::default() }
    }

    /// With a word in all memory that lives within a frame, before each frame.
    pub fn overwritten(word: u32) -> Self {
        Self { overwritten: Some(word), ..Self::default() }
    }

    /// Classifies a frame that is never denoised.
    pub fn abandon(&mut self, images: &[Image], frame: &FrameInputs) {
        let denoiser = self.denoiser.as_mut().unwrap();
        with_inputs(images, |inputs| denoiser.run_classify(inputs, frame).unwrap());
    }

    /// What kernels did that they must not, as text.
    pub fn faults(&self) -> Vec<String> {
        let faults = self.denoiser.iter().flat_map(Denoiser::faults);
        faults.map(|(kernel, place, fault)| format!("{kernel} {place} {fault:?}")).collect()
    }
}

fn with_inputs(images: &[Image], run: impl FnOnce(&Inputs<'_>)) {
    let textures: Vec<_> = images.iter().map(|image| (image.name, texture(image))).collect();
    let find = |name| &textures.iter().find(|(n, _)| *n == name).unwrap().1;
    run(&Inputs {
        radiance: find("radiance"),
        normal: find("normal"),
        roughness: find("roughness"),
        depth: find("depth"),
        motion: find("motion"),
        hit_motion: Some(find("hit_motion")),
        environment: Some(find("environment")),
        previous: Some(PrevGbuffer {
            normal: find("prev_normal"),
            roughness: find("prev_roughness"),
            depth: find("prev_depth"),
        }),
    });
}

fn texture(image: &Image) -> Texture {
    let format = match image.format {
        TexelFormat::Rgba16Float => limpid_cpu::TexelFormat::Rgba16Float,
        TexelFormat::Rgba32Float => limpid_cpu::TexelFormat::Rgba32Float,
        TexelFormat::R32Float => limpid_cpu::TexelFormat::R32Float,
        TexelFormat::Rg32Float => limpid_cpu::TexelFormat::Rg32Float,
    };
    let mut texture = Texture::new(format, image.size.x, image.size.y);
    texture.write(image.words.iter().copied());
    texture
}

impl Executor for Cpu {
    fn backend(&self) -> &'static str {
        "cpu"
    }

    fn device(&self) -> &str {
        "the CPU"
    }

    fn start(&mut self, core: limpid::Denoiser) {
        let mut denoiser = Denoiser::with_core(core).unwrap();
        if self.is_watched {
            denoiser.watch();
        }
        if let Some(seed) = self.inexact {
            denoiser.make_inexact(seed);
        }
        self.denoiser = Some(denoiser);
    }

    fn resize(&mut self, size: UVec2) {
        self.denoiser.as_mut().unwrap().resize(size).unwrap();
    }

    fn set_settings(&mut self, settings: &Settings) {
        let denoiser = self.denoiser.as_mut().unwrap();
        denoiser.set_settings(settings).unwrap();
        // Kernels that settings change are made anew.
        if let Some(seed) = self.inexact {
            denoiser.make_inexact(seed);
        }
    }

    fn frame(&mut self, images: &[Image], frame: &FrameInputs) -> Snapshot {
        let denoiser = self.denoiser.as_mut().unwrap();
        if let Some(word) = self.overwritten {
            denoiser.overwrite_transient(word);
        }
        with_inputs(images, |inputs| denoiser.denoise(inputs, frame).unwrap());
        Snapshot::take(
            denoiser.plan(),
            frame.size,
            |_| true,
            |name, copy| denoiser.intermediate_texture(name, copy).unwrap().read(),
            |name| denoiser.intermediate_buffer(name).unwrap().read(),
        )
    }
}
