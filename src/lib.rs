//! limpid denoises ray-traced reflections: one noisy ray a pixel in, a stable image out, every frame.
//!
//! This crate decides what to run and calls no graphics API. A [`Denoiser`] turns [`Settings`] and a size into
//! a [`Plan`]: resources, passes and bindings as plain data, with a specialised [`Kernel`](kernel::Kernel) for
//! each pass. Each frame, [`Denoiser::next_frame`] gives the constants and which half of each pair of
//! resources is whose. Backends carry that out: `limpid-wgpu` for wgpu.
//!
//! ```
//! use glam::{Mat4, UVec2, Vec2, Vec3, camera::rh};
//! use limpid::{Camera, Denoiser, FrameInputs, Settings};
//!
//! let mut denoiser = Denoiser::new(&Settings::default(), UVec2::new(1920, 1080))?;
//! println!("{}", denoiser.plan());
//! let camera = Camera {
//!     world_to_view: rh::view::look_at_mat4(Vec3::new(0.0, 1.7, 5.0), Vec3::ZERO, Vec3::Y),
//!     view_to_clip: rh::proj::directx::perspective(0.8, 16.0 / 9.0, 0.1, 1000.0),
//!     jitter: Vec2::ZERO,
//! };
//! let frame = denoiser.next_frame(&FrameInputs::new(camera, UVec2::new(1920, 1080)))?;
//! for (pass, kernel) in denoiser.plan().passes.iter().zip(denoiser.kernels()) {
//!     println!("{} {:?} {:?}", kernel.name, kernel.workgroup_size, frame.workgroups(&pass.grid));
//! }
//! # Ok::<(), limpid::Error>(())
//! ```
//!
//! # Conventions
//!
//! What limpid expects of a renderer. Encodings can be chosen in [`Conventions`](settings::Conventions).
//!
//! | | |
//! |---|---|
//! | uv | origin top left, `x` right, `y` down; pixel `(i, j)` is at `((i + 0.5) / width, (j + 0.5) / height)` |
//! | matrices | for column vectors: `clip = view_to_clip * world_to_view * (world, 1)`; without jitter |
//! | view space | either handedness; world axes and units as you like (see `depth_falloff` for units) |
//! | clip space | depth 0 to 1, standard or reversed, far plane finite or infinite, perspective or orthographic; `y` up or down ([`NdcY`](settings::NdcY)) |
//! | radiance | linear, along the reflected ray, **before** it is multiplied by BRDF, Fresnel or albedo; negative counts as 0, NaN and infinity as no light |
//! | hit distance | alpha of `radiance`: world-space distance from the surface to what the ray hit; for a miss a large finite number, such as 10000 |
//! | depth | [`DepthEncoding`](settings::DepthEncoding): device depth, or linear distance along the view axis. Sky is the far plane, or 0 when linear |
//! | normal | world space, [`NormalEncoding`](settings::NormalEncoding); a pixel with a zero or non-finite normal counts as sky. Not without the feature `normal_input` |
//! | roughness | perceptual or GGX alpha (perceptual squared); a pixel where it is not finite counts as sky |
//! | motion | `uv_now - uv_before` of the surface after multiplication by `motion_scale`, object motion included: `previous = uv - motion * scale` |
//! | hit motion | optional: world-space position of what the reflected ray hit, minus its position last frame; 0 for sky and what rests; NaN and infinity count as 0 |
//! | last frame's normal, roughness, depth | only without the feature `gbuffer_copy`: the images of the preceding frame, encoded as this frame's and as large as that frame was. Where there is no history (first frame, reset, resize) they may hold anything, of any size |
//! | jitter | where in the pixel the camera sampled, in pixels from the centre; history is kept at pixel centres |
//! | exposure | [`FrameInputs::exposure`] brings radiance near 1, where the published constants were tuned; images go in and out unexposed |
//! | time | [`FrameInputs::frame_seconds`] is the time since the last frame: settings in seconds hold at any frame rate |
//! | output | `rgb`: denoised radiance, not exposed; `a`: temporal variance, 0 to 1. Pixels that are left out hold the [`Fallback`](settings::Fallback) |
//!
//! ## Are my motion vectors right?
//!
//! Wrong sign or scale is the most common mistake, and it hides: with the camera at rest all is well. Pan the
//! camera slowly. With right vectors reflections on rough surfaces stay sharp-edged and calm. With the sign
//! flipped they smear **in the direction of motion, twice as far as the camera moved**, and borders of objects
//! trail. With `y` flipped only vertical motion smears. With a wrong scale (ndc taken for uv is twice too
//! large, pixels are hundreds of times too large) everything turns noisy while the camera moves,
//! because history is rejected, and calms down as soon as it stops. Mirror-like flat surfaces hide all this:
//! they follow the hit distance and the camera matrices instead; look at rough or curved ones.
//!
//! [`DebugView::MotionError`] shows all of this at a glance: it is black where motion vectors are what the camera's
//! motion makes them. The other [`DebugView`]s show where history is lost, and why.

#![forbid(unsafe_code)]

mod dead_code;
mod debug_view;
mod denoiser;
pub mod emit;
mod error;
#[cfg(feature = "export")]
pub mod export;
mod frame;
pub mod kernel;
pub mod memory;
mod passes;
pub mod plan;
pub mod resource;
pub mod settings;
pub mod synchronization;
pub mod variants;

pub use debug_view::{DebugView, Key, Legend};
pub use denoiser::{Change, Denoiser, FrameSchedule};
pub use error::Error;
pub use frame::{Camera, FrameConstants, FrameInputs};
pub use plan::Plan;
pub use settings::{Preset, Settings};

/// Largest width and height that limpid supports, in pixels.
pub const MAX_SIZE: u32 = 16384;
