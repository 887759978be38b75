//! Runs the limpid reflections denoiser on wgpu: records into the caller's command encoder, from the caller's
//! textures, and neither submits nor waits.
//!
//! ```no_run
//! # fn render(device: &wgpu::Device, queue: &wgpu::Queue, view: &wgpu::TextureView, camera: limpid::Camera)
//! # -> Result<(), limpid_wgpu::Error> {
//! use glam::UVec2;
//! use limpid::{FrameInputs, Settings};
//! use limpid_wgpu::{Denoiser, Inputs, Options};
//!
//! // Once.
//! let size = UVec2::new(1920, 1080);
//! let mut denoiser = Denoiser::new(device, &Settings::default(), size, Options::default())?;
//!
//! // Every frame, after the G-buffer and the reflection rays.
//! let (radiance, normal, roughness, depth, motion) = (view, view, view, view, view);
//! let mut encoder = device.create_command_encoder(&Default::default());
//! let inputs = Inputs { radiance, normal, roughness, depth, motion, hit_motion: None, environment: None, previous: None };
//! denoiser.encode(queue, &mut encoder, &inputs, &FrameInputs::new(camera, size))?;
//! let denoised: &wgpu::TextureView = denoiser.output();
//! // ... shade with `denoised` in the same encoder or a later one, then
//! queue.submit([encoder.finish()]);
//! # Ok(()) }
//! ```
//!
//! Default WebGPU limits suffice and no feature is needed. [`Options::timestamps`] wants
//! `wgpu::Features::TIMESTAMP_QUERY`.

mod denoiser;
mod error;
mod inputs;
mod pipelines;
mod textures;
mod timing;

pub use denoiser::{Denoiser, FRAMES_BEFORE_SUBMIT, Options, RayList};
pub use error::Error;
pub use inputs::{Inputs, PrevGbuffer};
pub use timing::PassTime;
