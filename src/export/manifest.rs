//! The manifest: the whole plan in the terms of every exported language.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

use super::formats::FormatNames;
use super::{Options, Target};
use crate::Settings;
use crate::kernel::Overrides;
use crate::plan::Stage;
use crate::resource::{Access, Copy, Lifetime};
use crate::synchronization::{Barrier, Usage};

/// All that an export says about itself. Enough to write a backend from.
///
/// Expressions are of non-negative integers `width` and `height`, the largest image in pixels; division rounds down.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(title = "limpid manifest")]
pub struct Manifest {
    /// Version of this layout.
    pub manifest_version: u32,
    /// Version of limpid that wrote it.
    pub limpid_version: &'static str,
    /// Licence of all files.
    pub licence: &'static str,
    /// Settings that were exported.
    #[schemars(with = "serde_json::Value")]
    pub settings: Settings,
    /// Short hash of them, also at the top of every shader.
    pub settings_hash: String,
    /// Options that were given.
    pub options: Options,
    /// Width and height of tiles in pixels.
    pub tile_size: u32,
    /// The constant buffer.
    pub constants: Constants,
    /// The denoised image.
    pub output: OutputEntry,
    /// Textures and buffers to supply or to allocate.
    pub resources: Vec<ResourceEntry>,
    /// Dispatches, in order.
    pub passes: Vec<PassEntry>,
    /// Memory that limpid's resources take.
    pub memory: MemoryEntry,
    /// The other files of the export.
    pub files: Vec<FileEntry>,
}

/// Layout of the constant buffer, the same in every language.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Constants {
    /// Bytes.
    pub size: usize,
    /// Fields in order. Matrices are column by column.
    pub fields: Vec<Field>,
}

/// A field of the constant buffer.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Field {
    /// Name.
    pub name: &'static str,
    /// Offset in bytes.
    pub offset: usize,
    /// Size in bytes.
    pub size: usize,
    /// `float`, `uint2`, `float4`, `float4x4`...
    pub r#type: String,
}

/// Where the denoised image is when all passes of a frame have run, until the next frame's second stage begins.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct OutputEntry {
    /// Name of the resource.
    pub resource: String,
    /// Which copy of it.
    pub copy: Copy,
}

/// What a resource is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ResourceKind {
    /// The constant buffer; fill it every frame.
    Constants,
    /// A texture of yours, of any format whose texels are read as floats.
    Input,
    /// A texture to allocate.
    Texture,
    /// A buffer to allocate.
    Buffer,
}

/// A texture or buffer.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct ResourceEntry {
    /// Name, unique.
    pub name: String,
    /// What it is.
    pub kind: ResourceKind,
    /// External: yours. Persistent: kept between frames, zero at first. Transient: used within a frame.
    pub lifetime: Lifetime,
    /// 2 for a pair that changes roles: in frame `n` the current copy is `n % 2`, the previous one the other.
    pub copies: u32,
    /// Texel format.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub format: Option<FormatNames>,
    /// Width in texels, an expression.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub width: Option<&'static str>,
    /// Height in texels, an expression.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub height: Option<&'static str>,
    /// Bytes of an element of a buffer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stride: Option<u64>,
    /// Bytes of one copy without padding, an expression.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bytes: Option<String>,
    /// Whether kernels read it as a texture or read-only buffer.
    pub is_read: bool,
    /// Whether kernels write it, as a storage texture or buffer.
    pub is_written: bool,
    /// Whether grids are read from it.
    pub is_indirect: bool,
}

/// A dispatch.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct PassEntry {
    /// Name, also of the entry point except in GLSL.
    pub name: String,
    /// Before or after the renderer traces rays.
    pub stage: Stage,
    /// Overrides that the kernel was specialised with.
    pub overrides: Overrides,
    /// Invocations of a workgroup.
    pub workgroup_size: [u32; 3],
    /// Workgroups.
    pub grid: GridEntry,
    /// Resources, by group and number.
    pub bindings: Vec<BindingEntry>,
    /// The barrier before the pass, if it needs one: on all memory, what was recorded before it first.
    pub barrier: Option<Barrier>,
    /// What the pass waits for, of which the barriers are the sum.
    pub dependencies: Vec<DependencyEntry>,
    /// File and entry point in each language.
    pub shaders: BTreeMap<Target, Shader>,
    /// Root signature of the HLSL.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub root_signature: Option<String>,
}

/// How many workgroups a pass has.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case", tag = "kind")]
pub enum GridEntry {
    /// Counts, expressions of the **frame's** width and height.
    Direct {
        /// In x.
        x: String,
        /// In y.
        y: String,
        /// In z.
        z: String,
    },
    /// Three `u32` in a buffer.
    Indirect {
        /// Name of the buffer.
        resource: String,
        /// Where in it, in bytes.
        offset: u64,
    },
}

/// A resource bound to a variable of a kernel.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct BindingEntry {
    /// Name of the variable in every language.
    pub variable: String,
    /// Name of the resource.
    pub resource: String,
    /// Which copy of a pair.
    pub copy: Copy,
    /// How the kernel uses it.
    pub access: Access,
    /// HLSL register.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hlsl: Option<Register>,
    /// Descriptor in SPIR-V.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spirv: Option<Descriptor>,
    /// Argument in Metal.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub msl: Option<Argument>,
    /// Binding in GLSL.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub glsl: Option<GlslBinding>,
    /// Binding in WGSL.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wgsl: Option<GroupBinding>,
}

/// An HLSL register and the state that Direct3D 12 wants the resource in.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Register {
    /// `b`, `t` or `u`.
    pub class: char,
    /// Number.
    pub register: u32,
    /// Space.
    pub space: u32,
    /// Type of the view.
    pub view: &'static str,
    /// `D3D12_RESOURCE_STATES`.
    pub state: &'static str,
}

/// A Vulkan descriptor and how the resource is used.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Descriptor {
    /// Set.
    pub set: u32,
    /// Binding.
    pub binding: u32,
    /// `VkDescriptorType`.
    pub r#type: &'static str,
    /// `VkImageLayout`, for images.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub layout: Option<&'static str>,
    /// `VkAccessFlags` at `VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT`.
    pub access: &'static str,
}

/// An argument of a Metal kernel.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Argument {
    /// `buffer` or `texture`.
    pub table: &'static str,
    /// Index.
    pub index: u32,
    /// `MTLResourceUsage`.
    pub usage: &'static str,
}

/// A binding in GLSL.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct GlslBinding {
    /// Set, in the Vulkan dialect.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub set: Option<u32>,
    /// Number.
    pub binding: u32,
    /// What is bound: `uniform-buffer`, `texture`, `image` or `storage-buffer`, which OpenGL numbers apart.
    pub unit: &'static str,
}

/// A binding in WGSL.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct GroupBinding {
    /// Bind group.
    pub group: u32,
    /// Number.
    pub binding: u32,
    /// Member of `GPUBindGroupLayoutEntry` that describes it.
    pub layout: &'static str,
}

/// An earlier use that a pass waits for.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct DependencyEntry {
    /// Name of the resource.
    pub resource: String,
    /// Which copy, named as in the later frame.
    pub copy: Copy,
    /// The earlier pass.
    pub pass: String,
    /// How many frames before.
    pub frames_ago: usize,
    /// The earlier use.
    pub before: Usage,
    /// The later use.
    pub after: Usage,
}

/// Where a pass is in one language.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Shader {
    /// Path of the file.
    pub file: String,
    /// Entry point.
    pub entry_point: String,
    /// Macro to define, in a single file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub define: Option<String>,
}

/// Memory without alignment and aliasing.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct MemoryEntry {
    /// Bytes kept between frames, an expression.
    pub persistent: String,
    /// Bytes used within a frame, an expression.
    pub transient: String,
    /// All together for each pixel of 1920x1080, in bytes.
    pub bytes_per_pixel: f64,
}

/// A file of the export.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct FileEntry {
    /// Path below the folder of the manifest.
    pub path: String,
    /// Bytes.
    pub size: usize,
    /// SHA-256.
    pub sha256: String,
}

/// The JSON schema of [`Manifest`].
pub fn manifest_schema() -> String {
    let schema = schemars::schema_for!(Manifest);
    // A schema is plain data.
    serde_json::to_string_pretty(&schema).unwrap_or_default() + "\n"
}
