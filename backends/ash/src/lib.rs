//! Records the limpid reflections denoiser into a Vulkan command buffer.
//!
//! The caller owns instance, device, queues, command buffers, images and submission; limpid owns its pipelines,
//! descriptor sets and the textures that live from frame to frame. `examples/integration.rs` is a whole program.
//!
//! # What limpid asks of Vulkan
//!
//! Version 1.1, a queue with compute, and the feature `shaderStorageImageExtendedFormats`, which every desktop GPU
//! has, enabled on the device. No extension, no sampler, no push constant, two descriptor sets. With `synchronization2` enabled, [`Options::synchronization`] makes use of it.
//!
//! # A frame
//!
//! 1. Bring the images of [`Inputs`] into a layout that can be sampled and make them visible to `COMPUTE_SHADER`,
//!    `SHADER_READ`.
//! 2. [`Denoiser::record`]; or [`Denoiser::record_classify`], trace [`Denoiser::ray_list`], make the radiance
//!    visible, [`Denoiser::record_denoise`].
//! 3. Read [`Denoiser::output`] in [`Options::reader_stages`], in the layout `GENERAL`.
//!
//! | what | who |
//! |---|---|
//! | inputs visible to limpid | caller |
//! | between passes, output to [`Options::reader_stages`], those before the next frame | limpid |
//! | next frame's writes to the inputs after limpid's reads | caller: `COMPUTE_SHADER` of the frame comes first |
//! | constants, descriptor sets | limpid, for [`Options::frames_in_flight`] frames; the caller waits for older ones |
//!
//! # Asynchronous compute
//!
//! Record into a command buffer of a compute family and order its submission with semaphores: after the G-buffer
//! and the rays, before whatever reads the output. Semaphores make everything visible, so
//! [`Options::reader_stages`] may then be `COMPUTE_SHADER`. Name all families that touch the output in
//! [`Options::queue_families`]; inputs that are exclusive to another family need a transfer of ownership by the
//! caller.
//!
//! # Destroying
//!
//! See [`Denoiser`]. Everything is destroyed on drop, also what was made before an error.

#![deny(clippy::undocumented_unsafe_blocks)]

mod barrier;
mod denoiser;
mod descriptors;
mod error;
mod gpu;
mod inputs;
pub mod memory;
#[cfg(feature = "offscreen")]
pub mod offscreen;
mod options;
mod pipelines;
mod resources;
#[cfg(feature = "offscreen")]
mod statistics;
mod timing;

pub use ash;
pub use denoiser::{Denoiser, OwnImage, RayList, Recorded};
pub use error::Error;
pub use gpu::{Gpu, Synchronization};
pub use inputs::{Input, Inputs, PrevGbuffer};
pub use options::{Options, SpirvSource};
pub use timing::PassTime;
