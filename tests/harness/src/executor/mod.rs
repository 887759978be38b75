//! Backends, one like the other.

mod ash;
mod cpu;
mod wgpu;

use glam::UVec2;
use limpid::{FrameInputs, Settings};

pub use self::ash::{Ash, AshOptions};
pub use self::cpu::Cpu;
pub use self::wgpu::Wgpu;
use crate::{Image, Snapshot};

/// Something that carries out plans. Panics where a denoiser would report an error.
pub trait Executor {
    /// Backend and device.
    fn name(&self) -> &str;

    /// Begins anew with a plan.
    fn start(&mut self, core: limpid::Denoiser);

    /// Changes the largest size.
    fn resize(&mut self, size: UVec2);

    /// Changes settings.
    fn set_settings(&mut self, settings: &Settings);

    /// Denoises a frame and reads everything back.
    fn frame(&mut self, images: &[Image], frame: &FrameInputs) -> Snapshot;
}

/// Every executor on this machine: the CPU, then wgpu and ash on each Vulkan device.
pub fn executors() -> Vec<Box<dyn Executor>> {
    let mut all: Vec<Box<dyn Executor>> = vec![Box::new(Cpu::new())];
    for device in limpid_ash::offscreen::device_names() {
        if let Some(wgpu) = Wgpu::open(&device) {
            all.push(Box::new(wgpu));
        }
        all.push(Box::new(Ash::open(&AshOptions { device, ..AshOptions::default() })));
    }
    all
}
