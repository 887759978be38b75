use glam::UVec2;

/// Why a denoiser could not be built or a frame not planned.
///
/// Only what a caller cannot rule out beforehand; each message names what was found and what was expected.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A setting lies outside its documented range or is not a number.
    #[error("setting `{field}` is {value}, expected {expected}")]
    Setting {
        /// Path of the setting, such as `reproject.max_history`.
        field: &'static str,
        /// The value found.
        value: f32,
        /// The range it must lie in.
        expected: &'static str,
    },
    /// Features that make no sense together.
    #[error("these features cannot be combined: {reason}")]
    Features {
        /// Why not.
        reason: &'static str,
    },
    /// A size is zero or larger than limpid supports.
    #[error("{what} is {size} pixels, expected 1 to {limit} in each direction")]
    Size {
        /// Which size.
        what: &'static str,
        /// The size found.
        size: UVec2,
        /// The largest one supported.
        limit: UVec2,
    },
    /// A camera matrix cannot be used.
    #[error("camera `{matrix}` {problem}:\n{value}")]
    Camera {
        /// Field of [`Camera`](crate::Camera).
        matrix: &'static str,
        /// What is wrong with it.
        problem: &'static str,
        /// The matrix found.
        value: glam::Mat4,
    },
    /// A number among the frame inputs cannot be used.
    #[error("frame input `{field}` is {value}, expected {expected}")]
    FrameInput {
        /// Field of [`FrameInputs`](crate::FrameInputs) or [`Camera`](crate::Camera).
        field: &'static str,
        /// The value found.
        value: f32,
        /// What it must be.
        expected: &'static str,
    },
    /// The passes after ray tracing were asked for before those in front of it.
    #[error("the denoise stage was asked for, but no frame was classified since the last one")]
    Order,
    /// Options of an export do not go together.
    #[error("cannot export: {option}: {report}")]
    Export {
        /// Which option.
        option: &'static str,
        /// What was found and what was expected.
        report: String,
    },
    /// A kernel failed to parse, validate or specialise. This is a defect of limpid, not of the caller.
    #[error("kernel `{kernel}` failed to {stage}: {report}")]
    Kernel {
        /// Name of the kernel.
        kernel: &'static str,
        /// What was being done.
        stage: &'static str,
        /// Message, with file and line where they are known.
        report: String,
    },
}
