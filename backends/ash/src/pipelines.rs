//! Pipelines, and the layouts of what is bound to them.

use std::sync::Arc;

use ash::vk;
use limpid::emit::SpirvOptions;
use limpid::kernel::{Binding, BindingKind, Kernel};
use limpid::plan::{Plan, Stage};
use limpid::variants::Made;

use crate::gpu::Shared;
use crate::{Error, Options};

pub(crate) fn descriptor_type(kind: BindingKind) -> vk::DescriptorType {
    match kind {
        BindingKind::Uniform => vk::DescriptorType::UNIFORM_BUFFER,
        BindingKind::TextureFloat | BindingKind::TextureUint => vk::DescriptorType::SAMPLED_IMAGE,
        BindingKind::StorageTexture(_) => vk::DescriptorType::STORAGE_IMAGE,
        BindingKind::StorageBuffer(_) => vk::DescriptorType::STORAGE_BUFFER,
    }
}

/// Layout of a descriptor set and what it holds.
pub(crate) struct SetLayout {
    gpu: Arc<Shared>,
    pub(crate) layout: vk::DescriptorSetLayout,
    pub(crate) bindings: Vec<Binding>,
}

impl SetLayout {
    fn new(gpu: &Arc<Shared>, name: &str, bindings: Vec<Binding>) -> Result<Self, Error> {
        let entries: Vec<_> = bindings
            .iter()
            .map(|binding| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(binding.binding)
                    .descriptor_type(descriptor_type(binding.kind))
                    .descriptor_count(1)
                    .stage_flags(vk::ShaderStageFlags::COMPUTE)
            })
            .collect();
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&entries);
        // SAFETY: bindings are distinct.
        let layout = unsafe { gpu.device.create_descriptor_set_layout(&info, None) }
            .map_err(Error::vulkan(format!("creating a descriptor set layout of {name}")))?;
        gpu.name(layout, name);
        Ok(Self { gpu: Arc::clone(gpu), layout, bindings })
    }
}

impl Drop for SetLayout {
    fn drop(&mut self) {
        // SAFETY: layouts are not used by commands that are being executed.
        unsafe { self.gpu.device.destroy_descriptor_set_layout(self.layout, None) };
    }
}

/// One pass on the device.
pub(crate) struct Pipeline {
    gpu: Arc<Shared>,
    pub(crate) pass: &'static str,
    pub(crate) label: String,
    pub(crate) pipeline: vk::Pipeline,
    pub(crate) layout: vk::PipelineLayout,
    /// Layout of set 1, limpid's own resources.
    pub(crate) own: SetLayout,
    /// What the layout of set 0 holds.
    inputs: Vec<Binding>,
}

impl Drop for Pipeline {
    fn drop(&mut self) {
        // SAFETY: the device has finished with them; null is allowed.
        unsafe {
            self.gpu.device.destroy_pipeline(self.pipeline, None);
            self.gpu.device.destroy_pipeline_layout(self.layout, None);
        }
    }
}

impl Pipeline {
    fn new(gpu: &Arc<Shared>, kernel: &Kernel, inputs: &SetLayout, options: &Options) -> Result<Self, Error> {
        let label = format!("limpid.{}", kernel.name);
        let own = kernel.bindings.iter().filter(|binding| binding.group == 1).cloned().collect();
        let own = SetLayout::new(gpu, &label, own)?;
        let set_layouts = [inputs.layout, own.layout];
        let info = vk::PipelineLayoutCreateInfo::default().set_layouts(&set_layouts);
        // SAFETY: both layouts are alive.
        let layout = unsafe { gpu.device.create_pipeline_layout(&info, None) }
            .map_err(Error::vulkan(format!("creating the pipeline layout of {label}")))?;
        let mut pipeline = Self {
            gpu: Arc::clone(gpu),
            pass: kernel.name,
            label,
            pipeline: vk::Pipeline::null(),
            layout,
            own,
            inputs: inputs.bindings.clone(),
        };
        let words = match &options.spirv {
            Some(source) => source(kernel)?,
            None => {
                let debug_names = gpu.debug_utils.is_some();
                kernel.spirv(&SpirvOptions { debug_names, ..SpirvOptions::default() })?
            }
        };
        let info = vk::ShaderModuleCreateInfo::default().code(&words);
        // SAFETY: naga wrote valid SPIR-V 1.3, which Vulkan 1.1 accepts, or the caller promises as much.
        let module = unsafe { gpu.device.create_shader_module(&info, None) }
            .map_err(Error::vulkan(format!("creating the shader module of {}", pipeline.label)))?;
        let entry_point = std::ffi::CString::new(kernel.name).unwrap_or_default();
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::COMPUTE)
            .module(module)
            .name(&entry_point);
        let flags = match gpu.statistics {
            Some(_) => vk::PipelineCreateFlags::CAPTURE_STATISTICS_KHR,
            None => vk::PipelineCreateFlags::empty(),
        };
        let info = vk::ComputePipelineCreateInfo::default().stage(stage).layout(layout).flags(flags);
        // SAFETY: module and layout are alive, and the layout has every binding of the kernel.
        let created = unsafe { gpu.device.create_compute_pipelines(options.pipeline_cache, &[info], None) };
        // SAFETY: pipelines do not need their module any more.
        unsafe { gpu.device.destroy_shader_module(module, None) };
        let created = created
            .map_err(|(_, result)| Error::vulkan(format!("creating the pipeline {}", pipeline.label))(result))?;
        pipeline.pipeline = created[0];
        gpu.name(pipeline.pipeline, &pipeline.label);
        Ok(pipeline)
    }
}

/// All pipelines of a plan.
pub(crate) struct Pipelines {
    /// In the order of the passes.
    pub(crate) passes: Vec<Arc<Pipeline>>,
    /// Layout of set 0, the constants and the caller's images, of each stage.
    pub(crate) inputs: [SetLayout; 2],
}

pub(crate) fn stage_index(stage: Stage) -> usize {
    match stage {
        Stage::Classify => 0,
        Stage::Denoise => 1,
    }
}

impl Pipelines {
    /// Takes pipelines from `made`, and keeps new ones there.
    pub(crate) fn new(
        gpu: &Arc<Shared>,
        plan: &Plan,
        kernels: &[Arc<Kernel>],
        options: &Options,
        made: &mut Made<Arc<Pipeline>>,
    ) -> Result<Self, Error> {
        let inputs = |stage| {
            let mut bindings: Vec<Binding> = Vec::new();
            let of_stage = plan.passes.iter().zip(kernels).filter(|(pass, _)| pass.stage == stage);
            for binding in of_stage.flat_map(|(_, kernel)| &kernel.bindings).filter(|binding| binding.group == 0) {
                if bindings.iter().all(|known| known.binding != binding.binding) {
                    bindings.push(binding.clone());
                }
            }
            SetLayout::new(gpu, &format!("limpid inputs {stage:?}"), bindings)
        };
        let inputs = [inputs(Stage::Classify)?, inputs(Stage::Denoise)?];
        let mut passes = Vec::new();
        for (pass, kernel) in plan.passes.iter().zip(kernels) {
            let inputs = &inputs[stage_index(pass.stage)];
            let fits = |pipeline: &Arc<Pipeline>| pipeline.inputs == inputs.bindings;
            let make = |kernel: &Kernel| Pipeline::new(gpu, kernel, inputs, options).map(Arc::new);
            passes.push(made.get_or_make(kernel, fits, make)?);
        }
        Ok(Self { passes, inputs })
    }
}
