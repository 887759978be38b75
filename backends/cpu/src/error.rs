/// Why a kernel cannot be run on the CPU.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CompileError {
    /// The module has no compute entry point of that name.
    #[error("there is no compute entry point `{name}`")]
    EntryPoint {
        /// The name asked for.
        name: String,
    },
    /// The kernel uses something that the executor does not know.
    #[error("the CPU executor does not support {construct}")]
    Unsupported {
        /// What it is.
        construct: String,
    },
}

/// Why a kernel could not be run.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DispatchError {
    /// A binding is missing or holds something else.
    #[error("`{name}` at group {group}, binding {binding} needs {expected}")]
    Binding {
        /// Name of the variable.
        name: String,
        /// Bind group.
        group: u32,
        /// Number in the group.
        binding: u32,
        /// What is expected there.
        expected: &'static str,
    },
}

/// Why the denoiser could not be made or a frame not be denoised.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Settings, size or frame inputs cannot be used.
    #[error(transparent)]
    Limpid(#[from] limpid::Error),
    /// A kernel uses something that the executor does not know.
    #[error("kernel `{kernel}`: {source}")]
    Compile {
        /// Name of the kernel.
        kernel: &'static str,
        /// What it is.
        source: CompileError,
    },
    /// A binding is missing.
    #[error(transparent)]
    Dispatch(#[from] DispatchError),
    /// The settings need an input that was not given.
    #[error("input `{input}` is missing; the settings need it")]
    InputMissing {
        /// Field of [`Inputs`](crate::Inputs).
        input: String,
    },
    /// An input is smaller than the frame.
    #[error("input `{input}` is {actual} pixels, expected at least {expected}")]
    InputSize {
        /// Field of [`Inputs`](crate::Inputs).
        input: String,
        /// Size of its texture.
        actual: glam::UVec2,
        /// Size of the frame.
        expected: glam::UVec2,
    },
}
