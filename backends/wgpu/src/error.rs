use glam::UVec2;

/// Why the denoiser could not be made or a frame not be recorded. Nothing was recorded then.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Settings, size or frame inputs cannot be used.
    #[error(transparent)]
    Limpid(#[from] limpid::Error),
    /// The settings need an input that was not given.
    #[error("input `{input}` is missing; the settings need it")]
    InputMissing {
        /// Field of [`Inputs`](crate::Inputs).
        input: &'static str,
    },
    /// An input is smaller than the frame.
    #[error("input `{input}` is {actual} pixels, expected at least {expected}")]
    InputSize {
        /// Field of [`Inputs`](crate::Inputs).
        input: &'static str,
        /// Size of its texture.
        actual: UVec2,
        /// Size of the frame.
        expected: UVec2,
    },
    /// An input has a format that does not fit.
    #[error("input `{input}` has format {actual:?}, expected {expected}")]
    InputFormat {
        /// Field of [`Inputs`](crate::Inputs).
        input: &'static str,
        /// Format of its texture.
        actual: wgpu::TextureFormat,
        /// What is accepted.
        expected: String,
    },
    /// An input is not a plain two-dimensional texture.
    #[error("input `{input}` is {actual}, expected a two-dimensional texture with one sample per texel")]
    InputShape {
        /// Field of [`Inputs`](crate::Inputs).
        input: &'static str,
        /// What it is.
        actual: String,
    },
    /// An input lacks `TEXTURE_BINDING`.
    #[error("input `{input}` has usage {actual:?}, expected TEXTURE_BINDING among it")]
    InputUsage {
        /// Field of [`Inputs`](crate::Inputs).
        input: &'static str,
        /// Usage of its texture.
        actual: wgpu::TextureUsages,
    },
    /// The device was made without a feature that an option needs.
    #[error("option `{option}` needs a device with {feature:?}")]
    Feature {
        /// Field of [`Options`](crate::Options).
        option: &'static str,
        /// What the device lacks.
        feature: wgpu::Features,
    },
    /// The size exceeds what the device can hold.
    #[error("resource `{resource}` would need {needed} {unit}, the device's `{limit}` is {available}")]
    Limit {
        /// Name of the resource in the plan.
        resource: String,
        /// Name of the limit.
        limit: &'static str,
        /// What is needed.
        needed: u64,
        /// What the device offers.
        available: u64,
        /// Unit of both.
        unit: &'static str,
    },
}
