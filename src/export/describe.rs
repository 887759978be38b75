//! Fills the manifest.

use super::manifest::{
    Argument, BindingEntry, Constants, DependencyEntry, Descriptor, Field, FileEntry, GlslBinding, GridEntry,
    GroupBinding, Manifest, MemoryEntry, OutputEntry, PassEntry, Register, ResourceEntry, ResourceKind, Shader,
};
use super::{Export, File, Target, formats, sha256};
use crate::FrameConstants;
use crate::kernel::{Binding, BindingKind, Kernel};
use crate::plan::{Bound, Grid, Pass};
use crate::resource::{Access, Count, Extent, Kind, Lifetime, Resource, TILE_SIZE};

/// Texels of an extent in x and y.
fn extent(extent: Extent) -> (&'static str, &'static str) {
    match extent {
        Extent::Full => ("width", "height"),
        Extent::Block => ("(width + 3) / 4", "(height + 3) / 4"),
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

/// Whether a field of the constants is unsigned; the others are floats.
pub(super) fn is_unsigned(name: &str) -> bool {
    matches!(name, "size" | "prev_size")
}

/// Type of a field by its size.
pub(super) fn field_type(name: &str, size: usize) -> String {
    let scalar = if is_unsigned(name) { "uint" } else { "float" };
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
            output: self.output_entry(),
            resources: self.plan.resources.iter().map(|resource| self.resource_entry(resource)).collect(),
            passes: (0..self.plan.passes.len()).map(|index| self.pass_entry(index)).collect(),
            memory: self.memory_entry(),
            files: files.iter().map(file).collect(),
        }
    }

    pub(super) fn output_entry(&self) -> OutputEntry {
        let (resource, copy) = self.plan.output().expect("plans of settings have an output");
        OutputEntry { resource: resource.to_owned(), copy }
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
            pass: self.plan.passes[d.pass].name.clone(),
            frames_ago: d.frames_ago,
            before: d.before,
            after: d.after,
        };
        let targets = Target::ALL.iter().filter(|target| self.options.targets.contains(target));
        let is_hlsl = self.options.targets.contains(&Target::Hlsl);
        PassEntry {
            name: pass.name.clone(),
            stage: pass.stage,
            overrides: pass.overrides.clone(),
            workgroup_size: kernel.workgroup_size,
            grid: match &pass.grid {
                Grid::One => GridEntry::Direct { x: "1".to_owned(), y: "1".to_owned(), z: "1".to_owned() },
                Grid::Squares { side } => {
                    let squares = |pixels| format!("({pixels} + {}) / {side}", side - 1);
                    GridEntry::Direct { x: squares("width"), y: squares("height"), z: "1".to_owned() }
                }
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
            shaders: targets.map(|&target| (target, self.shader_entry(target, pass, kernel))).collect(),
            root_signature: is_hlsl.then(|| self.options.hlsl.root_signature_of(kernel)),
        }
    }

    fn shader_entry(&self, target: Target, pass: &Pass, kernel: &Kernel) -> Shader {
        Shader {
            file: self.path(target, &pass.name),
            entry_point: if target == Target::Glsl { "main".to_owned() } else { kernel.name.to_owned() },
            define: self.options.single_file.then(|| super::pass_macro(&pass.name)),
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
                    crate::resource::Format::Rgba32Uint => "storageTexture: { format: 'rgba32uint' }",
                    crate::resource::Format::Rg32Uint => "storageTexture: { format: 'rg32uint' }",
                    crate::resource::Format::R32Uint => "storageTexture: { format: 'r32uint' }",
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
