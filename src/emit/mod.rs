//! Kernels in the languages of graphics APIs.

mod spirv;

pub use spirv::{SpirvOptions, SpirvVersion};

/// What a kernel does where it goes beyond what it may, for example reads outside of a texture.
///
/// limpid's kernels never do, whatever the input; tests show it. Checks are for those who trust nobody.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Checks {
    /// Nothing is checked. Fastest.
    #[default]
    Unchecked,
    /// Indices are limited to what exists, loops are bounded and division by zero is defined.
    Robust,
}
