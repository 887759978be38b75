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
    fn name(&self) -> String {
        format!("{} on {}", self.backend(), self.device())
    }

    /// Name of the backend.
    fn backend(&self) -> &'static str;

    /// Name of the device: executors on the same one leave the same bits.
    fn device(&self) -> &str;

    /// Begins anew with a plan.
    fn start(&mut self, core: limpid::Denoiser);

    /// Changes the largest size.
    fn resize(&mut self, size: UVec2);

    /// Changes settings.
    fn set_settings(&mut self, settings: &Settings);

    /// Denoises a frame and reads everything back.
    fn frame(&mut self, images: &[Image], frame: &FrameInputs) -> Snapshot;
}

/// Every executor on this machine: the CPU, then ash and wgpu on each Vulkan device. Says so where there is none.
pub fn executors() -> Vec<Box<dyn Executor>> {
    let mut all: Vec<Box<dyn Executor>> = vec![Box::new(Cpu::new())];
    let devices = limpid_ash::offscreen::device_names();
    if devices.is_empty() {
        crate::skip("no Vulkan device: only the CPU takes part");
    }
    for device in devices {
        let wgpu = Wgpu::open(&device);
        all.push(Box::new(Ash::open(&AshOptions { device, ..AshOptions::default() })));
        all.extend(wgpu.map(|wgpu| Box::new(wgpu) as Box<dyn Executor>));
    }
    all
}

/// The fastest executor on this machine: the most capable Vulkan device, else the CPU.
pub fn fastest() -> Box<dyn Executor> {
    match Ash::try_open(&AshOptions::default()) {
        Ok(ash) => Box::new(ash),
        Err(_) => Box::new(Cpu::new()),
    }
}
