//! What can be wrong with a sequence on disk.

use std::io;
use std::path::{Path, PathBuf};

use glam::UVec2;

/// Why a sequence could not be read or written. Each message names the file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SequenceError {
    /// A file that should be there is not.
    #[error("{path}: no such file")]
    Missing {
        /// The file.
        path: PathBuf,
    },
    /// The system refused to read a file.
    #[error("{path}: cannot be read: {reason}")]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        reason: io::Error,
    },
    /// A file could not be written.
    #[error("{path}: cannot be written: {reason}")]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system or the encoder said.
        reason: io::Error,
    },
    /// `camera.json` is not JSON.
    #[error("{path}: not valid JSON: {reason}")]
    Json {
        /// The file.
        path: PathBuf,
        /// What the parser said, with line and column.
        reason: serde_json::Error,
    },
    /// A field of `camera.json` is missing or unusable.
    #[error("{path}: field `{field}`: expected {expected}, found {found}")]
    Field {
        /// The file.
        path: PathBuf,
        /// The field, for example `frames[3].view[0][1]`.
        field: String,
        /// What the field should hold.
        expected: String,
        /// What it holds.
        found: String,
    },
    /// The file does not start as an EXR file does.
    #[error("{path}: not an EXR file: expected the first bytes 76 2f 31 01, found {found}")]
    NotExr {
        /// The file.
        path: PathBuf,
        /// Its first bytes in hexadecimal.
        found: String,
    },
    /// The EXR file ends before its last pixel.
    #[error("{path}: truncated: the file ends before its last pixel")]
    Truncated {
        /// The file.
        path: PathBuf,
    },
    /// The EXR file is damaged, or of a kind that cannot be read (deep data, subsampled channels).
    #[error("{path}: damaged or unsupported EXR file: {reason}")]
    Corrupt {
        /// The file.
        path: PathBuf,
        /// What the decoder said.
        reason: String,
    },
    /// The EXR file lacks a channel.
    #[error(
        "{path}: no channel `{channel}` for {key}; the file has {}; name another one with {key}=NAME",
        available.join(", ")
    )]
    MissingChannel {
        /// The file.
        path: PathBuf,
        /// The channel looked for.
        channel: String,
        /// The option of [`ChannelNames`](super::ChannelNames) that names the channel.
        key: &'static str,
        /// The channels of the file.
        available: Vec<String>,
    },
    /// The EXR file has no colour channels to show or compare.
    #[error(
        "{path}: expected the channels R, G, B (or denoised., color., reflection. or reference. \
         before them), found {}",
        available.join(", ")
    )]
    NoColour {
        /// The file.
        path: PathBuf,
        /// The channels of the file.
        available: Vec<String>,
    },
    /// An image is not of the size it should be.
    #[error("{path}: expected {}x{} pixels, found {}x{}", expected.x, expected.y, found.x, found.y)]
    Size {
        /// The file.
        path: PathBuf,
        /// The size in `camera.json`, or of the frame to be written.
        expected: UVec2,
        /// The size found.
        found: UVec2,
    },
    /// An image to be written does not have one value per pixel.
    #[error("{path}: {image} to be written: expected {expected} pixels, found {found}")]
    Pixels {
        /// The file that was not written.
        path: PathBuf,
        /// The image.
        image: &'static str,
        /// The number of pixels by the frame's size.
        expected: usize,
        /// The number of pixels of the image.
        found: usize,
    },
    /// A sequence to be written has no frames.
    #[error("{path}: expected at least one frame to write, found none")]
    NoFrames {
        /// The sequence's folder.
        path: PathBuf,
    },
    /// A frame was asked for that the sequence does not have.
    #[error("{path}: expected a frame index below {len}, found {index}")]
    NoSuchFrame {
        /// The sequence's folder.
        path: PathBuf,
        /// The index asked for.
        index: usize,
        /// The number of frames.
        len: usize,
    },
}

impl SequenceError {
    pub(super) fn read(path: &Path, reason: io::Error) -> Self {
        let path = path.to_owned();
        match reason.kind() {
            io::ErrorKind::NotFound => Self::Missing { path },
            _ => Self::Read { path, reason },
        }
    }

    pub(super) fn write(path: &Path, reason: io::Error) -> Self {
        let path = path.to_owned();
        Self::Write { path, reason }
    }

    pub(super) fn corrupt(path: &Path, reason: impl Into<String>) -> Self {
        Self::Corrupt { path: path.to_owned(), reason: reason.into() }
    }
}
