//! Barriers of the plan and of the caller's uses, as Vulkan has them.

use ash::vk;
use limpid::synchronization::{Barrier, Scope};

use crate::gpu::{Shared, Synchronization};

/// Pipeline stages and accesses on one side of a barrier.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Side {
    pub(crate) stages: vk::PipelineStageFlags,
    pub(crate) accesses: vk::AccessFlags,
}

impl Side {
    pub(crate) fn and(self, other: Self) -> Self {
        Self { stages: self.stages | other.stages, accesses: self.accesses | other.accesses }
    }

    /// Kernels that read or write.
    pub(crate) const KERNEL: Self = Self {
        stages: vk::PipelineStageFlags::COMPUTE_SHADER,
        accesses: vk::AccessFlags::from_raw(
            vk::AccessFlags::SHADER_READ.as_raw() | vk::AccessFlags::SHADER_WRITE.as_raw(),
        ),
    };

    /// Clears.
    pub(crate) const TRANSFER: Self =
        Self { stages: vk::PipelineStageFlags::TRANSFER, accesses: vk::AccessFlags::TRANSFER_WRITE };

    /// Readers outside of limpid.
    pub(crate) fn readers(stages: vk::PipelineStageFlags) -> Self {
        Self { stages, accesses: vk::AccessFlags::MEMORY_READ }
    }

    fn of(scope: Scope) -> Self {
        let mut side = Self::default();
        if scope.kernel_reads || scope.kernel_writes {
            side.stages |= vk::PipelineStageFlags::COMPUTE_SHADER;
        }
        if scope.kernel_reads {
            side.accesses |= vk::AccessFlags::SHADER_READ;
        }
        if scope.kernel_writes {
            side.accesses |= vk::AccessFlags::SHADER_WRITE;
        }
        if scope.indirect {
            side.stages |= vk::PipelineStageFlags::DRAW_INDIRECT;
            side.accesses |= vk::AccessFlags::INDIRECT_COMMAND_READ;
        }
        side
    }
}

/// A barrier on all memory, and changes of layout that go with it.
#[derive(Debug, Clone, Default)]
pub(crate) struct Batch {
    before: Side,
    after: Side,
    /// Images whose content is not needed, to come into `GENERAL`.
    discarded: Vec<vk::Image>,
}

pub(crate) const WHOLE: vk::ImageSubresourceRange = vk::ImageSubresourceRange {
    aspect_mask: vk::ImageAspectFlags::COLOR,
    base_mip_level: 0,
    level_count: 1,
    base_array_layer: 0,
    layer_count: 1,
};

impl Batch {
    pub(crate) fn add(&mut self, before: Side, after: Side) {
        self.before = self.before.and(before);
        self.after = self.after.and(after);
    }

    pub(crate) fn add_planned(&mut self, barrier: Barrier) {
        self.add(Side::of(barrier.before), Side::of(barrier.after));
    }

    pub(crate) fn discard(&mut self, image: vk::Image) {
        self.discarded.push(image);
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.after.stages.is_empty()
    }

    /// Records it, unless there is nothing to wait for.
    ///
    /// # Safety
    ///
    /// `commands` is being recorded, outside of a render pass; images belong to the device.
    pub(crate) unsafe fn record(self, gpu: &Shared, commands: vk::CommandBuffer) {
        if self.is_empty() {
            return;
        }
        // An empty stage mask is none at all before synchronization2.
        let before_stages =
            if self.before.stages.is_empty() { vk::PipelineStageFlags::TOP_OF_PIPE } else { self.before.stages };
        // What only reads has nothing that could be made visible.
        let writes = self.before.accesses & (vk::AccessFlags::SHADER_WRITE | vk::AccessFlags::TRANSFER_WRITE);
        if let Synchronization::Core1_0 = gpu.synchronization {
            let memory = vk::MemoryBarrier::default().src_access_mask(writes).dst_access_mask(self.after.accesses);
            let images: Vec<_> = self
                .discarded
                .iter()
                .map(|&image| {
                    vk::ImageMemoryBarrier::default()
                        .src_access_mask(writes)
                        .dst_access_mask(self.after.accesses)
                        .old_layout(vk::ImageLayout::UNDEFINED)
                        .new_layout(vk::ImageLayout::GENERAL)
                        .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
                        .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
                        .image(image)
                        .subresource_range(WHOLE)
                })
                .collect();
            let flags = vk::DependencyFlags::empty();
            // SAFETY: as the caller promises.
            unsafe {
                gpu.device.cmd_pipeline_barrier(
                    commands,
                    before_stages,
                    self.after.stages,
                    flags,
                    &[memory],
                    &[],
                    &images,
                );
            }
            return;
        }
        let stages = |stages: vk::PipelineStageFlags| vk::PipelineStageFlags2::from_raw(stages.as_raw().into());
        let memory = [vk::MemoryBarrier2::default()
            .src_stage_mask(stages(before_stages))
            .src_access_mask(accesses2(writes))
            .dst_stage_mask(stages(self.after.stages))
            .dst_access_mask(accesses2(self.after.accesses))];
        let images: Vec<_> = self
            .discarded
            .iter()
            .map(|&image| {
                vk::ImageMemoryBarrier2::default()
                    .src_stage_mask(stages(before_stages))
                    .src_access_mask(accesses2(writes))
                    .dst_stage_mask(stages(self.after.stages))
                    .dst_access_mask(accesses2(self.after.accesses))
                    .old_layout(vk::ImageLayout::UNDEFINED)
                    .new_layout(vk::ImageLayout::GENERAL)
                    .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
                    .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
                    .image(image)
                    .subresource_range(WHOLE)
            })
            .collect();
        let dependency = vk::DependencyInfo::default().memory_barriers(&memory).image_memory_barriers(&images);
        // SAFETY: as the caller promises.
        unsafe {
            match &gpu.synchronization {
                Synchronization::Extension(extension) => extension.cmd_pipeline_barrier2(commands, &dependency),
                Synchronization::Core1_0 | Synchronization::Core1_3 => {
                    gpu.device.cmd_pipeline_barrier2(commands, &dependency);
                }
            }
        }
    }
}

/// Accesses of kernels without those that limpid's never make.
fn accesses2(accesses: vk::AccessFlags) -> vk::AccessFlags2 {
    let mut exact = vk::AccessFlags2::from_raw(accesses.as_raw().into());
    if accesses.contains(vk::AccessFlags::SHADER_READ) {
        exact &= !vk::AccessFlags2::SHADER_READ;
        exact |= vk::AccessFlags2::SHADER_SAMPLED_READ | vk::AccessFlags2::SHADER_STORAGE_READ;
    }
    if accesses.contains(vk::AccessFlags::SHADER_WRITE) {
        exact &= !vk::AccessFlags2::SHADER_WRITE;
        exact |= vk::AccessFlags2::SHADER_STORAGE_WRITE;
    }
    exact
}
