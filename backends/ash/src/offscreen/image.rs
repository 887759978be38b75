use std::rc::Rc;

use ash::vk;
use glam::UVec2;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::Allocation;

use super::context::{Context, OffscreenError, failed};
use crate::Input;

pub(super) const LAYER: vk::ImageSubresourceLayers = vk::ImageSubresourceLayers {
    aspect_mask: vk::ImageAspectFlags::COLOR,
    mip_level: 0,
    base_array_layer: 0,
    layer_count: 1,
};

const WHOLE: vk::ImageSubresourceRange = crate::barrier::WHOLE;

/// How an image is used.
#[derive(Clone, Copy)]
pub(super) struct Use {
    pub(super) layout: vk::ImageLayout,
    accesses: vk::AccessFlags,
    stages: vk::PipelineStageFlags,
}

impl Use {
    /// Its content is no longer needed.
    const DISCARDED: Self = Self {
        layout: vk::ImageLayout::UNDEFINED,
        accesses: vk::AccessFlags::empty(),
        stages: vk::PipelineStageFlags::COMPUTE_SHADER,
    };
    /// Copied to.
    const WRITTEN: Self = Self {
        layout: vk::ImageLayout::TRANSFER_DST_OPTIMAL,
        accesses: vk::AccessFlags::TRANSFER_WRITE,
        stages: vk::PipelineStageFlags::TRANSFER,
    };
    /// Read by kernels.
    const SAMPLED: Self = Self {
        layout: vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL,
        accesses: vk::AccessFlags::SHADER_READ,
        stages: vk::PipelineStageFlags::COMPUTE_SHADER,
    };
    /// Copied from.
    pub(super) const COPIED: Self = Self {
        layout: vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
        accesses: vk::AccessFlags::TRANSFER_READ,
        stages: vk::PipelineStageFlags::TRANSFER,
    };
    /// limpid's own.
    pub(super) const OWN: Self = Self {
        layout: vk::ImageLayout::GENERAL,
        accesses: vk::AccessFlags::from_raw(
            vk::AccessFlags::SHADER_READ.as_raw() | vk::AccessFlags::SHADER_WRITE.as_raw(),
        ),
        stages: vk::PipelineStageFlags::COMPUTE_SHADER,
    };
}

/// Records a change from one use to another.
///
/// # Safety
///
/// `commands` is being recorded, and `image` is used as `before` says.
pub(super) unsafe fn change(
    device: &ash::Device,
    commands: vk::CommandBuffer,
    image: vk::Image,
    before: Use,
    after: Use,
) {
    let barrier = vk::ImageMemoryBarrier::default()
        .old_layout(before.layout)
        .src_access_mask(before.accesses)
        .new_layout(after.layout)
        .dst_access_mask(after.accesses)
        .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .image(image)
        .subresource_range(WHOLE);
    let flags = vk::DependencyFlags::empty();
    // SAFETY: as the caller promises.
    unsafe { device.cmd_pipeline_barrier(commands, before.stages, after.stages, flags, &[], &[], &[barrier]) };
}

/// An image that is filled from memory, for kernels to read.
pub struct UploadedImage {
    context: Rc<Context>,
    image: vk::Image,
    view: vk::ImageView,
    allocation: Option<Allocation>,
    size: UVec2,
    texel_bytes: u64,
}

impl Drop for UploadedImage {
    fn drop(&mut self) {
        // SAFETY: the device has finished with it; null is allowed.
        unsafe {
            self.context.device().destroy_image_view(self.view, None);
            self.context.device().destroy_image(self.image, None);
        }
        if let Some(allocation) = self.allocation.take() {
            self.context.free(allocation);
        }
    }
}

pub(super) fn texel_bytes(format: vk::Format) -> u64 {
    match format {
        vk::Format::R32_SFLOAT | vk::Format::R32_UINT => 4,
        vk::Format::R16G16B16A16_SFLOAT | vk::Format::R32G32_SFLOAT | vk::Format::R32G32_UINT => 8,
        vk::Format::R32G32B32A32_SFLOAT | vk::Format::R32G32B32A32_UINT => 16,
        other => panic!("off-screen images are not of {other:?}"),
    }
}

impl UploadedImage {
    /// An image with `bytes` as its texels, row by row.
    ///
    /// # Errors
    ///
    /// [`OffscreenError`].
    ///
    /// # Panics
    ///
    /// When `bytes` are not as many as the image has, or for formats other than `R32_SFLOAT`, `R32G32_SFLOAT`,
    /// `R16G16B16A16_SFLOAT` and `R32G32B32A32_SFLOAT`.
    pub fn new(context: &Rc<Context>, format: vk::Format, size: UVec2, bytes: &[u8]) -> Result<Self, OffscreenError> {
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(format)
            .extent(vk::Extent3D { width: size.x, height: size.y, depth: 1 })
            .mip_levels(1)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .usage(vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST);
        let device = context.device();
        // SAFETY: the description is complete.
        let image = unsafe { device.create_image(&info, None) }.map_err(failed("creating an image"))?;
        let mut this = Self {
            context: Rc::clone(context),
            image,
            view: vk::ImageView::null(),
            allocation: None,
            size,
            texel_bytes: texel_bytes(format),
        };
        // SAFETY: the image is of this device.
        let requirements = unsafe { device.get_image_memory_requirements(image) };
        let allocation = context.allocate("image", requirements, MemoryLocation::GpuOnly, false)?;
        // SAFETY: the allocation meets the image's requirements.
        let bound = unsafe { device.bind_image_memory(image, allocation.memory(), allocation.offset()) };
        this.allocation = Some(allocation);
        bound.map_err(failed("binding memory"))?;
        let info = vk::ImageViewCreateInfo::default()
            .image(image)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(format)
            .subresource_range(WHOLE);
        // SAFETY: the image has memory.
        this.view = unsafe { device.create_image_view(&info, None) }.map_err(failed("creating a view"))?;
        this.write(bytes)?;
        Ok(this)
    }

    /// Replaces all texels. The device must have finished with the image.
    ///
    /// # Errors
    ///
    /// [`OffscreenError`].
    ///
    /// # Panics
    ///
    /// When `bytes` are not as many as the image has.
    pub fn write(&self, bytes: &[u8]) -> Result<(), OffscreenError> {
        let usage = vk::BufferUsageFlags::TRANSFER_SRC;
        let expected = u64::from(self.size.x) * u64::from(self.size.y) * self.texel_bytes;
        assert_eq!(bytes.len() as u64, expected, "an image of {} texels, {} bytes each", self.size, self.texel_bytes);
        let (buffer, mut allocation) =
            self.context.staging_buffer(bytes.len() as u64, usage, MemoryLocation::CpuToGpu)?;
        let mapped = allocation.mapped_slice_mut().expect("what the CPU writes is mapped");
        mapped[..bytes.len()].copy_from_slice(bytes);
        let done = self.context.run(|commands| {
            self.record_copy(commands, buffer);
            Ok(())
        });
        self.context.destroy_buffer(buffer, allocation);
        done
    }

    fn record_copy(&self, commands: vk::CommandBuffer, buffer: vk::Buffer) {
        let region = vk::BufferImageCopy::default().image_subresource(LAYER).image_extent(vk::Extent3D {
            width: self.size.x,
            height: self.size.y,
            depth: 1,
        });
        let device = self.context.device();
        // SAFETY: commands are being recorded; the buffer holds as many bytes as the image.
        unsafe {
            change(device, commands, self.image, Use::DISCARDED, Use::WRITTEN);
            device.cmd_copy_buffer_to_image(commands, buffer, self.image, Use::WRITTEN.layout, &[region]);
            change(device, commands, self.image, Use::WRITTEN, Use::SAMPLED);
        }
    }

    /// The image as an input of a denoiser.
    pub fn input(&self) -> Input {
        Input { view: self.view, layout: vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL, size: self.size }
    }
}
