//! Sequences of ray-traced frames: a folder with one EXR file per frame and a `camera.json`.
//!
//! [`Sequence::open`] reads the cameras, [`Sequence::load`] one frame's images; [`write_sequence`]
//! writes such a folder and [`write_exr`] a single result. All pixel data is row by row, top row
//! first.

mod atomic;
mod camera;
mod channels;
mod dwa;
mod error;
mod exr_file;
mod frame;
mod metadata;
mod read;
#[cfg(test)]
mod tests;
mod warnings;
mod write;

pub(crate) use atomic::write_atomically;
pub use channels::{ChannelNames, ChannelOptionError};
pub use error::SequenceError;
pub use frame::Frame;
pub use metadata::Metadata;
pub use read::{Sequence, read_rgb};
pub use warnings::InputWarnings;
pub use write::{write_exr, write_sequence};

/// The largest image width and height accepted, in pixels: a guard against damaged files.
const MAX_SIDE: u32 = 16384;
