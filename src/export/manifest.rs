//! The manifest: the whole plan in the terms of every exported language.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

use super::formats::{self, FormatNames};
use super::{Export, File, Options, Target, sha256};
use crate::kernel::{Binding, BindingKind, Kernel, Overrides};
use crate::plan::{Bound, Grid, Pass, Stage};
use crate::resource::{Access, Copy, Count, Extent, Kind, Lifetime, Resource, TILE_SIZE};
use crate::synchronization::{Barrier, Usage};
use crate::{FrameConstants, Settings};

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
    /// Name of the kernel.
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
        x: &'static str,
        /// In y.
        y: &'static str,
        /// In z.
        z: &'static str,
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

/// Texels of an extent in x and y.
fn extent(extent: Extent) -> (&'static str, &'static str) {
    match extent {
        Extent::Full => ("width", "height"),
        Extent::Tile => ("(width + 7) / 8", "(height + 7) / 8"),
    }
}

fn bytes(resource: &Resource) -> Option<String> {
    let of = |size: u64, at: Extent| {
        let (x, y) = extent(at);
        let part = |text: &str| if text.contains(' ') { format!("({text})") } else { text.to_owned() };
        format!("{} * {} * {size}", part(x), part(y))
    };
    match resource.kind {
        Kind::Constants | Kind::Input => None,
        Kind::Texture { format, extent } => Some(of(format.bytes(), extent)),
        Kind::Buffer { stride, count: Count::Per(extent), .. } => Some(of(stride, extent)),
        Kind::Buffer { stride, count: Count::Fixed(count), .. } => Some((stride * count).to_string()),
    }
}

/// Type of a field by its size; sizes in pixels are unsigned.
pub(super) fn field_type(name: &str, size: usize) -> String {
    let scalar = if name == "size" || name == "prev_size" { "uint" } else { "float" };
    match size {
        4 => scalar.to_owned(),
        64 => "float4x4".to_owned(),
        _ => format!("{scalar}{}", size / 4),
    }
}

impl Export<'_> {
    pub(super) fn manifest(&self, files: &[File]) -> Manifest {
        let file =
            |file: &File| FileEntry { path: file.path.clone(), size: file.bytes.len(), sha256: sha256(&file.bytes) };
        let field = |&(name, offset, size): &(&'static str, usize, usize)| Field {
            name,
            offset,
            size,
            r#type: field_type(name, size),
        };
        Manifest {
            manifest_version: 1,
            limpid_version: env!("CARGO_PKG_VERSION"),
            licence: "MIT OR Apache-2.0",
            settings: self.settings.clone(),
            settings_hash: self.settings_hash.clone(),
            options: self.options.clone(),
            tile_size: TILE_SIZE,
            constants: Constants {
                size: size_of::<FrameConstants>(),
                fields: FrameConstants::FIELDS.iter().map(field).collect(),
            },
            resources: self.plan.resources.iter().map(|resource| self.resource_entry(resource)).collect(),
            passes: (0..self.plan.passes.len()).map(|index| self.pass_entry(index)).collect(),
            memory: self.memory_entry(),
            files: files.iter().map(file).collect(),
        }
    }

    fn resource_entry(&self, resource: &Resource) -> ResourceEntry {
        let name = &resource.name;
        let uses = || self.plan.passes.iter().flat_map(|pass| &pass.bindings).filter(|bound| bound.resource == *name);
        let size = if let Kind::Texture { extent: at, .. } = resource.kind { Some(extent(at)) } else { None };
        let is_grid = |pass: &Pass| matches!(&pass.grid, Grid::Indirect { resource, .. } if resource == name);
        ResourceEntry {
            name: name.clone(),
            kind: match resource.kind {
                Kind::Constants => ResourceKind::Constants,
                Kind::Input => ResourceKind::Input,
                Kind::Texture { .. } => ResourceKind::Texture,
                Kind::Buffer { .. } => ResourceKind::Buffer,
            },
            lifetime: resource.lifetime,
            copies: 1 + u32::from(resource.ping_pong),
            format: if let Kind::Texture { format, .. } = resource.kind { Some(formats::names(format)) } else { None },
            width: size.map(|(x, _)| x),
            height: size.map(|(_, y)| y),
            stride: if let Kind::Buffer { stride, .. } = resource.kind { Some(stride) } else { None },
            bytes: bytes(resource),
            is_read: uses().any(|bound| bound.access == Access::Read),
            is_written: uses().any(|bound| bound.access.writes()),
            is_indirect: self.plan.passes.iter().any(is_grid),
        }
    }

    fn memory_entry(&self) -> MemoryEntry {
        let sum = |lifetime| {
            let resources = self.plan.resources.iter().filter(|resource| resource.lifetime == lifetime);
            let parts = resources.filter_map(|resource| {
                let factor = if resource.ping_pong { "2 * " } else { "" };
                Some(format!("{factor}{}", bytes(resource)?))
            });
            let text = parts.collect::<Vec<_>>().join(" + ");
            if text.is_empty() { "0".to_owned() } else { text }
        };
        MemoryEntry {
            persistent: sum(Lifetime::Persistent),
            transient: sum(Lifetime::Transient),
            bytes_per_pixel: self.plan.bytes_per_pixel(),
        }
    }

    fn pass_entry(&self, index: usize) -> PassEntry {
        let (pass, kernel) = (&self.plan.passes[index], &self.kernels[index]);
        let dependency = |d: crate::synchronization::Dependency| DependencyEntry {
            resource: d.resource,
            copy: d.copy,
            pass: self.plan.passes[d.pass].kernel.clone(),
            frames_ago: d.frames_ago,
            before: d.before,
            after: d.after,
        };
        let targets = Target::ALL.iter().filter(|target| self.options.targets.contains(target));
        let is_hlsl = self.options.targets.contains(&Target::Hlsl);
        PassEntry {
            name: pass.kernel.clone(),
            stage: pass.stage,
            overrides: pass.overrides.clone(),
            workgroup_size: kernel.workgroup_size,
            grid: match &pass.grid {
                Grid::One => GridEntry::Direct { x: "1", y: "1", z: "1" },
                Grid::Tiles => GridEntry::Direct { x: "(width + 7) / 8", y: "(height + 7) / 8", z: "1" },
                Grid::Indirect { resource, offset } => {
                    GridEntry::Indirect { resource: resource.clone(), offset: *offset }
                }
            },
            bindings: pass
                .bindings
                .iter()
                .zip(&kernel.bindings)
                .map(|(bound, binding)| self.binding_entry(kernel, bound, binding))
                .collect(),
            barrier: self.plan.barriers()[index],
            dependencies: self.plan.dependencies()[index].iter().cloned().map(dependency).collect(),
            shaders: targets.map(|&target| (target, self.shader_entry(target, kernel))).collect(),
            root_signature: is_hlsl.then(|| self.options.hlsl.root_signature_of(kernel)),
        }
    }

    fn shader_entry(&self, target: Target, kernel: &Kernel) -> Shader {
        Shader {
            file: self.path(target, kernel.name),
            entry_point: if target == Target::Glsl { "main".to_owned() } else { kernel.name.to_owned() },
            define: self.options.single_file.then(|| super::pass_macro(kernel.name)),
        }
    }

    fn binding_entry(&self, kernel: &Kernel, bound: &Bound, binding: &Binding) -> BindingEntry {
        let has = |target| self.options.targets.contains(&target);
        let options = self.options;
        let usage = Usages::of(binding.kind);
        let is_grid =
            |pass: &Pass| matches!(&pass.grid, Grid::Indirect { resource, .. } if *resource == bound.resource);
        let is_read_grid = bound.access == Access::Read && self.plan.passes.iter().any(is_grid);
        let state = if is_read_grid { SRV_AND_INDIRECT } else { usage.state };
        let (class, register, space) = options.hlsl.register(binding);
        let (table, index) = options.msl.slot_of(kernel, binding);
        let (set, number) = options.glsl.slot_of(kernel, binding);
        let (group, group_number) = options.wgsl.slot_of(binding);
        BindingEntry {
            variable: bound.variable.clone(),
            resource: bound.resource.clone(),
            copy: bound.copy,
            access: bound.access,
            hlsl: has(Target::Hlsl).then_some(Register { class, register, space, view: usage.view, state }),
            spirv: has(Target::Spirv).then_some(Descriptor {
                set: options.spirv.first_set + binding.group,
                binding: options.spirv.first_binding + binding.binding,
                r#type: usage.descriptor,
                layout: usage.layout,
                access: usage.access,
            }),
            msl: has(Target::Msl).then_some(Argument { table, index, usage: usage.metal }),
            glsl: has(Target::Glsl).then_some(GlslBinding { set, binding: number, unit: usage.unit }),
            wgsl: has(Target::Wgsl).then_some(GroupBinding {
                group,
                binding: group_number,
                layout: usage.layout_entry,
            }),
        }
    }
}

/// How APIs name a kind of binding.
struct Usages {
    view: &'static str,
    state: &'static str,
    descriptor: &'static str,
    layout: Option<&'static str>,
    access: &'static str,
    metal: &'static str,
    unit: &'static str,
    layout_entry: &'static str,
}

const UAV: &str = "D3D12_RESOURCE_STATE_UNORDERED_ACCESS";
/// Of a buffer that grids are read from while kernels read it too.
const SRV_AND_INDIRECT: &str =
    "D3D12_RESOURCE_STATE_NON_PIXEL_SHADER_RESOURCE | D3D12_RESOURCE_STATE_INDIRECT_ARGUMENT";
const SRV: &str = "D3D12_RESOURCE_STATE_NON_PIXEL_SHADER_RESOURCE";

impl Usages {
    fn of(kind: BindingKind) -> Self {
        match kind {
            BindingKind::Uniform => Self {
                view: "ConstantBuffer",
                state: "D3D12_RESOURCE_STATE_VERTEX_AND_CONSTANT_BUFFER",
                descriptor: "VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER",
                layout: None,
                access: "VK_ACCESS_UNIFORM_READ_BIT",
                metal: "MTLResourceUsageRead",
                unit: "uniform-buffer",
                layout_entry: "buffer: { type: 'uniform' }",
            },
            BindingKind::TextureFloat | BindingKind::TextureUint => Self {
                view: "Texture2D",
                state: SRV,
                descriptor: "VK_DESCRIPTOR_TYPE_SAMPLED_IMAGE",
                layout: Some("VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL or VK_IMAGE_LAYOUT_GENERAL"),
                access: "VK_ACCESS_SHADER_READ_BIT",
                metal: "MTLResourceUsageRead",
                unit: "texture",
                layout_entry: if kind == BindingKind::TextureFloat {
                    "texture: { sampleType: 'unfilterable-float' }"
                } else {
                    "texture: { sampleType: 'uint' }"
                },
            },
            BindingKind::StorageTexture(format) => Self {
                view: "RWTexture2D",
                state: UAV,
                descriptor: "VK_DESCRIPTOR_TYPE_STORAGE_IMAGE",
                layout: Some("VK_IMAGE_LAYOUT_GENERAL"),
                access: "VK_ACCESS_SHADER_WRITE_BIT",
                metal: "MTLResourceUsageWrite",
                unit: "image",
                layout_entry: match format {
                    crate::resource::Format::Rgba16Float => "storageTexture: { format: 'rgba16float' }",
                    crate::resource::Format::Rg32Uint => "storageTexture: { format: 'rg32uint' }",
                },
            },
            BindingKind::StorageBuffer(Access::Read) => Self {
                view: "StructuredBuffer",
                state: SRV,
                descriptor: "VK_DESCRIPTOR_TYPE_STORAGE_BUFFER",
                layout: None,
                access: "VK_ACCESS_SHADER_READ_BIT",
                metal: "MTLResourceUsageRead",
                unit: "storage-buffer",
                layout_entry: "buffer: { type: 'read-only-storage' }",
            },
            BindingKind::StorageBuffer(_) => Self {
                view: "RWStructuredBuffer",
                state: UAV,
                descriptor: "VK_DESCRIPTOR_TYPE_STORAGE_BUFFER",
                layout: None,
                access: "VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT",
                metal: "MTLResourceUsageRead | MTLResourceUsageWrite",
                unit: "storage-buffer",
                layout_entry: "buffer: { type: 'storage' }",
            },
        }
    }
}
