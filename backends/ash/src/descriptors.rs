//! Descriptor sets: those of limpid's resources, written once, and those of the caller's images, written each frame.

use std::collections::BTreeMap;
use std::sync::Arc;

use ash::vk;
use limpid::kernel::Binding;
use limpid::plan::{Bound, Plan};

use crate::Error;
use crate::gpu::Shared;
use crate::inputs::Inputs;
use crate::pipelines::{Pipelines, SetLayout, descriptor_type};
use crate::resources::{Buffer, Resources};

/// A pool that is as large as the sets that are taken from it.
struct Pool {
    gpu: Arc<Shared>,
    pool: vk::DescriptorPool,
}

impl Drop for Pool {
    fn drop(&mut self) {
        // SAFETY: the device has finished with its sets.
        unsafe { self.gpu.device.destroy_descriptor_pool(self.pool, None) };
    }
}

/// Allocates a set of each layout.
fn allocate(gpu: &Arc<Shared>, name: &str, layouts: &[&SetLayout]) -> Result<(Pool, Vec<vk::DescriptorSet>), Error> {
    let mut counts = BTreeMap::<vk::DescriptorType, u32>::new();
    for binding in layouts.iter().flat_map(|layout| &layout.bindings) {
        *counts.entry(descriptor_type(binding.kind)).or_default() += 1;
    }
    let size = |(&ty, &descriptor_count): (&_, &_)| vk::DescriptorPoolSize { ty, descriptor_count };
    let sizes: Vec<_> = counts.iter().map(size).collect();
    let info = vk::DescriptorPoolCreateInfo::default().max_sets(layouts.len() as u32).pool_sizes(&sizes);
    // SAFETY: there is at least one set with at least one descriptor.
    let pool = unsafe { gpu.device.create_descriptor_pool(&info, None) }
        .map_err(Error::vulkan(format!("creating the descriptor pool {name}")))?;
    let pool = Pool { gpu: Arc::clone(gpu), pool };
    gpu.name(pool.pool, name);
    let layouts: Vec<_> = layouts.iter().map(|layout| layout.layout).collect();
    let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool.pool).set_layouts(&layouts);
    // SAFETY: the pool is large enough.
    let sets = unsafe { gpu.device.allocate_descriptor_sets(&info) }
        .map_err(Error::vulkan(format!("allocating descriptor sets of {name}")))?;
    Ok((pool, sets))
}

/// What one descriptor refers to.
enum Target {
    Image(vk::DescriptorImageInfo),
    Buffer(vk::DescriptorBufferInfo),
}

fn write(gpu: &Shared, set: vk::DescriptorSet, targets: &[(&Binding, Target)]) {
    let writes: Vec<_> = targets
        .iter()
        .map(|(binding, target)| {
            let write = vk::WriteDescriptorSet::default()
                .dst_set(set)
                .dst_binding(binding.binding)
                .descriptor_type(descriptor_type(binding.kind));
            match target {
                Target::Image(image) => write.image_info(std::slice::from_ref(image)),
                Target::Buffer(buffer) => write.buffer_info(std::slice::from_ref(buffer)),
            }
        })
        .collect();
    // SAFETY: nothing that is being executed uses the set; targets are alive and of the binding's kind.
    unsafe { gpu.device.update_descriptor_sets(&writes, &[]) };
}

/// Set 1 of each pass, for both phases.
pub(crate) struct OwnSets {
    sets: Vec<vk::DescriptorSet>,
    _pool: Pool,
}

impl OwnSets {
    pub(crate) fn new(
        gpu: &Arc<Shared>,
        plan: &Plan,
        pipelines: &Pipelines,
        resources: &Resources,
    ) -> Result<Self, Error> {
        let layouts: Vec<_> = pipelines.passes.iter().flat_map(|pipeline| [&pipeline.own; 2]).collect();
        let (pool, sets) = allocate(gpu, "limpid own", &layouts)?;
        for (index, &set) in sets.iter().enumerate() {
            let (pass, phase) = (&plan.passes[index / 2], index % 2);
            let target = |binding: &Binding| {
                let is_it = |bound: &&Bound| bound.group == 1 && bound.binding == binding.binding;
                let bound = pass.bindings.iter().find(is_it)?;
                if let Some(buffer) = resources.buffer(plan, &bound.resource) {
                    let info = vk::DescriptorBufferInfo::default().buffer(buffer.buffer).range(vk::WHOLE_SIZE);
                    return Some(Target::Buffer(info));
                }
                let image = resources.image(plan, &bound.resource, bound.copy, phase)?;
                let info = vk::DescriptorImageInfo::default().image_view(image.view);
                Some(Target::Image(info.image_layout(vk::ImageLayout::GENERAL)))
            };
            let bindings = &pipelines.passes[index / 2].own.bindings;
            let targets: Vec<_> = bindings.iter().filter_map(|b| Some((b, target(b)?))).collect();
            write(gpu, set, &targets);
        }
        Ok(Self { sets, _pool: pool })
    }

    pub(crate) fn get(&self, pass: usize, phase: usize) -> vk::DescriptorSet {
        self.sets[2 * pass + phase]
    }
}

/// Set 0 of both stages, for each frame in flight.
pub(crate) struct InputSets {
    sets: Vec<vk::DescriptorSet>,
    _pool: Pool,
}

impl InputSets {
    /// Sets whose constants lie in `constants`, `stride` bytes for each frame in flight.
    pub(crate) fn new(
        gpu: &Arc<Shared>,
        pipelines: &Pipelines,
        constants: &Buffer,
        stride: u64,
        frames: usize,
    ) -> Result<Self, Error> {
        let [classify, denoise] = &pipelines.inputs;
        let layouts: Vec<_> = (0..frames).flat_map(|_| [classify, denoise]).collect();
        let (pool, sets) = allocate(gpu, "limpid inputs", &layouts)?;
        for (index, &set) in sets.iter().enumerate() {
            let info = vk::DescriptorBufferInfo::default()
                .buffer(constants.buffer)
                .offset(stride * (index / 2) as u64)
                .range(size_of::<limpid::FrameConstants>() as u64);
            let uniforms = layouts[index].bindings.iter().filter(|binding| is_constants(binding));
            let targets: Vec<_> = uniforms.map(|binding| (binding, Target::Buffer(info))).collect();
            write(gpu, set, &targets);
        }
        Ok(Self { sets, _pool: pool })
    }

    pub(crate) fn get(&self, slot: usize, stage: usize) -> vk::DescriptorSet {
        self.sets[2 * slot + stage]
    }

    /// Writes the caller's images of a stage and returns how many descriptors that were.
    pub(crate) fn update(
        &self,
        gpu: &Shared,
        slot: usize,
        stage: usize,
        layout: &SetLayout,
        resource_of: impl Fn(&Binding) -> Option<String>,
        inputs: &Inputs,
    ) -> usize {
        let target = |binding: &Binding| {
            let (_, input) = inputs.find(&resource_of(binding)?)?;
            let input = input?;
            let info = vk::DescriptorImageInfo::default().image_view(input.view).image_layout(input.layout);
            Some(Target::Image(info))
        };
        let images = layout.bindings.iter().filter(|binding| !is_constants(binding));
        let targets: Vec<_> = images.filter_map(|b| Some((b, target(b)?))).collect();
        write(gpu, self.get(slot, stage), &targets);
        targets.len()
    }
}

fn is_constants(binding: &Binding) -> bool {
    binding.kind == limpid::kernel::BindingKind::Uniform
}
