//! A Vulkan device without a window, with images that are filled from memory and read back: what tests and tools
//! need around a denoiser. An engine has all this already.

mod context;
mod image;
mod instance;
mod session;

pub use crate::statistics::PassStatistics;
pub use context::{Context, ContextOptions, OffscreenError};
pub use image::UploadedImage;
pub use instance::device_names;
pub use session::{Session, UploadedInputs};
