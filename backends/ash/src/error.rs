use ash::vk;
use glam::UVec2;

/// Why the denoiser could not be made or a frame not be recorded.
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
        /// Its size as the caller stated it.
        actual: UVec2,
        /// Size of the frame.
        expected: UVec2,
    },
    /// An input is in a layout that kernels cannot read from.
    #[error(
        "input `{input}` is in {actual:?}, expected a layout that can be sampled, such as SHADER_READ_ONLY_OPTIMAL"
    )]
    InputLayout {
        /// Field of [`Inputs`](crate::Inputs).
        input: &'static str,
        /// Its layout as the caller stated it.
        actual: vk::ImageLayout,
    },
    /// The device cannot do what limpid needs.
    #[error("the device lacks what limpid needs: {what}")]
    Unsupported {
        /// What it lacks.
        what: String,
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
    /// Memory is exhausted. Nothing leaks: what was made before is destroyed.
    #[error("out of memory in {during}: {source}")]
    OutOfMemory {
        /// What was being done.
        during: String,
        /// What Vulkan or the allocator said.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// The device was lost. The denoiser can only be dropped.
    #[error("the device was lost in {during}")]
    DeviceLost {
        /// What was being done.
        during: String,
    },
    /// Vulkan refused something else.
    #[error("{during} failed: {result}")]
    Vulkan {
        /// What was being done.
        during: String,
        /// What Vulkan said.
        result: vk::Result,
    },
}

impl Error {
    pub(crate) fn vulkan(during: impl Into<String>) -> impl FnOnce(vk::Result) -> Self {
        let during = during.into();
        move |result| match result {
            vk::Result::ERROR_DEVICE_LOST => Self::DeviceLost { during },
            vk::Result::ERROR_OUT_OF_HOST_MEMORY
            | vk::Result::ERROR_OUT_OF_DEVICE_MEMORY
            | vk::Result::ERROR_OUT_OF_POOL_MEMORY
            | vk::Result::ERROR_FRAGMENTATION => Self::OutOfMemory { during, source: Box::new(result) },
            result => Self::Vulkan { during, result },
        }
    }
}
