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
    /// See [`Executor::with_subgroup_size`](crate::Executor::with_subgroup_size).
    #[error("a subgroup of {size} invocations, expected 4, 8, 16, 32 or 64")]
    SubgroupSize {
        /// The size asked for.
        size: u32,
    },
    /// The kernel uses something that the executor does not know.
    #[error("the CPU executor does not support {construct}")]
    Unsupported {
        /// What it is.
        construct: String,
        /// Where it is in the source that the module was parsed from, in bytes; none if the module does not know.
        /// [`naga::Span::location`] turns it into a line:
        ///
        /// ```
        /// # let (source, offset) = ("var a: u32;\nvar b: u64;", 12);
        /// let place = naga::Span::new(offset as u32, offset as u32).location(source);
        /// assert_eq!(place.line_number, 2);
        /// ```
        offset: Option<usize>,
    },
}

impl CompileError {
    /// The same with its place, if it has none yet.
    pub(crate) fn at(mut self, span: naga::Span) -> Self {
        if let Self::Unsupported { offset: offset @ None, .. } = &mut self {
            *offset = span.to_range().map(|range| range.start);
        }
        self
    }
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
    #[error("kernel `{kernel}`, {place}: {source}")]
    Compile {
        /// Name of the kernel.
        kernel: &'static str,
        /// Where in its source, as `file:line`, or the file if the line is not known.
        place: String,
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
