//! Kernels in the languages of graphics APIs: SPIR-V by naga, texts for people by limpid itself.

mod constants;
mod spirv;
mod text;

pub use spirv::{SpirvOptions, SpirvVersion};
#[cfg(feature = "export")]
pub(crate) use text::Note;
pub use text::{GlslDialect, GlslOptions, HlslOptions, MslOptions, ShaderModel, WgslOptions};

/// What a kernel does where it goes beyond what it may, for example reads outside of a texture.
///
/// limpid's kernels never do, whatever the input; tests show it. Checks are for those who trust nobody.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "export", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Checks {
    /// Nothing is checked. Fastest.
    #[default]
    Unchecked,
    /// Indices are limited to what exists, loops are bounded and division by zero is defined.
    Robust,
}
