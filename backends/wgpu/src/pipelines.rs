//! Pipelines and their layouts, from the core's reflection.

use std::borrow::Cow;
use std::convert::Infallible;
use std::sync::Arc;

use limpid::kernel::{Binding, BindingKind, Kernel};
use limpid::resource::Access;
use limpid::variants::Made;

use crate::textures::texture_format;

/// One pass on the device.
#[derive(Debug, Clone)]
pub(crate) struct Pipeline {
    pub(crate) label: String,
    pub(crate) pipeline: wgpu::ComputePipeline,
    /// Layouts of group 0, the caller's resources, and group 1, limpid's; `None` where a group is empty.
    pub(crate) groups: [Option<wgpu::BindGroupLayout>; 2],
}

fn binding_type(kind: BindingKind) -> wgpu::BindingType {
    let texture = |sample_type| wgpu::BindingType::Texture {
        sample_type,
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    match kind {
        BindingKind::Uniform => wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: true,
            min_binding_size: None,
        },
        BindingKind::TextureFloat => texture(wgpu::TextureSampleType::Float { filterable: false }),
        BindingKind::TextureUint => texture(wgpu::TextureSampleType::Uint),
        BindingKind::StorageTexture(format) => wgpu::BindingType::StorageTexture {
            access: wgpu::StorageTextureAccess::WriteOnly,
            format: texture_format(format),
            view_dimension: wgpu::TextureViewDimension::D2,
        },
        BindingKind::StorageBuffer(access) => wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Storage { read_only: access == Access::Read },
            has_dynamic_offset: false,
            min_binding_size: None,
        },
    }
}

fn group_layout(device: &wgpu::Device, label: &str, bindings: &[Binding], group: u32) -> Option<wgpu::BindGroupLayout> {
    let entries: Vec<_> = bindings
        .iter()
        .filter(|binding| binding.group == group)
        .map(|binding| wgpu::BindGroupLayoutEntry {
            binding: binding.binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: binding_type(binding.kind),
            count: None,
        })
        .collect();
    let descriptor = wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries };
    (!entries.is_empty()).then(|| device.create_bind_group_layout(&descriptor))
}

/// The pipelines of kernels: those of `made`, and new ones that are kept there.
pub(crate) fn pipelines(device: &wgpu::Device, kernels: &[Arc<Kernel>], made: &mut Made<Pipeline>) -> Vec<Pipeline> {
    let pipeline = |kernel| {
        let made = made.get_or_make(kernel, |_| true, |kernel| Ok::<_, Infallible>(Pipeline::new(device, kernel)));
        made.unwrap_or_else(|never| match never {})
    };
    kernels.iter().map(pipeline).collect()
}

impl Pipeline {
    fn new(device: &wgpu::Device, kernel: &Kernel) -> Self {
        let label = format!("limpid.{}", kernel.name);
        let groups = [0, 1].map(|group| group_layout(device, &label, &kernel.bindings, group));
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(&label),
            bind_group_layouts: &groups.each_ref().map(Option::as_ref),
            immediate_size: 0,
        });
        let takes_spirv = device.adapter_info().backend == wgpu::Backend::Vulkan;
        let module = if takes_spirv { kernel.module_for_spirv() } else { kernel.module.clone() };
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(&label),
            source: wgpu::ShaderSource::Naga(Cow::Owned(module)),
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(&label),
            layout: Some(&layout),
            module: &module,
            entry_point: Some(kernel.name),
            compilation_options: wgpu::PipelineCompilationOptions {
                constants: &[],
                // Kernels write workgroup memory before they read it.
                zero_initialize_workgroup_memory: false,
            },
            cache: None,
        });
        Self { label, pipeline, groups }
    }
}
