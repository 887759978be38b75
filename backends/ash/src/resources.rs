//! Images and buffers of a plan.

use std::sync::Arc;

use ash::vk;
use glam::UVec2;
use limpid::Plan;
use limpid::resource::{Copy, Format, Kind, Lifetime, Resource};

use crate::barrier::{Batch, Side, WHOLE};
use crate::gpu::Shared;
use crate::memory::{MemoryBlock, MemoryRequest};
use crate::{Error, Options};

/// A block of memory, freed when nothing lies in it any more.
struct Block {
    gpu: Arc<Shared>,
    block: MemoryBlock,
    bytes: u64,
}

impl Block {
    fn new(gpu: &Arc<Shared>, request: &MemoryRequest<'_>) -> Result<Arc<Self>, Error> {
        let block = gpu.allocate(request)?;
        Ok(Arc::new(Self { gpu: Arc::clone(gpu), block, bytes: request.requirements.size }))
    }
}

impl Drop for Block {
    fn drop(&mut self) {
        self.gpu.free(self.block);
    }
}

pub(crate) struct Image {
    gpu: Arc<Shared>,
    pub(crate) image: vk::Image,
    pub(crate) view: vk::ImageView,
    memory: Option<Arc<Block>>,
}

impl Drop for Image {
    fn drop(&mut self) {
        // SAFETY: the device has finished with them, which is the contract of dropping a denoiser; null is allowed.
        unsafe {
            self.gpu.device.destroy_image_view(self.view, None);
            self.gpu.device.destroy_image(self.image, None);
        }
    }
}

pub(crate) struct Buffer {
    gpu: Arc<Shared>,
    pub(crate) buffer: vk::Buffer,
    pub(crate) size: u64,
    memory: Option<Arc<Block>>,
}

impl Drop for Buffer {
    fn drop(&mut self) {
        // SAFETY: the device has finished with it.
        unsafe { self.gpu.device.destroy_buffer(self.buffer, None) };
    }
}

/// Something that needs memory.
trait Placed {
    fn requirements(&self) -> vk::MemoryRequirements;
    fn is_linear(&self) -> bool;
    fn bind(&mut self, block: &Arc<Block>) -> Result<(), Error>;
}

impl Placed for Image {
    fn requirements(&self) -> vk::MemoryRequirements {
        // SAFETY: the image is of this device.
        unsafe { self.gpu.device.get_image_memory_requirements(self.image) }
    }

    fn is_linear(&self) -> bool {
        false
    }

    fn bind(&mut self, block: &Arc<Block>) -> Result<(), Error> {
        // SAFETY: the block meets the image's requirements, and the image is not bound yet.
        unsafe { self.gpu.device.bind_image_memory(self.image, block.block.memory, block.block.offset) }
            .map_err(Error::vulkan("binding memory of an image"))?;
        self.memory = Some(Arc::clone(block));
        Ok(())
    }
}

impl Placed for Buffer {
    fn requirements(&self) -> vk::MemoryRequirements {
        // SAFETY: the buffer is of this device.
        unsafe { self.gpu.device.get_buffer_memory_requirements(self.buffer) }
    }

    fn is_linear(&self) -> bool {
        true
    }

    fn bind(&mut self, block: &Arc<Block>) -> Result<(), Error> {
        // SAFETY: the block meets the buffer's requirements, and the buffer is not bound yet.
        unsafe { self.gpu.device.bind_buffer_memory(self.buffer, block.block.memory, block.block.offset) }
            .map_err(Error::vulkan("binding memory of a buffer"))?;
        self.memory = Some(Arc::clone(block));
        Ok(())
    }
}

/// Requirements of several things that lie in the same place.
fn common_requirements(placed: &[&mut dyn Placed]) -> vk::MemoryRequirements {
    let each = placed.iter().map(|placed| placed.requirements());
    each.reduce(|a, b| vk::MemoryRequirements {
        size: a.size.max(b.size),
        alignment: a.alignment.max(b.alignment),
        memory_type_bits: a.memory_type_bits & b.memory_type_bits,
    })
    .unwrap_or_default()
}

/// Allocates one block for all of `placed` and returns whether a type of memory fits them all.
fn place(gpu: &Arc<Shared>, name: &str, is_transient: bool, placed: &mut [&mut dyn Placed]) -> Result<bool, Error> {
    let requirements = common_requirements(placed);
    if requirements.memory_type_bits == 0 {
        return Ok(false);
    }
    let is_linear = placed.iter().all(|placed| placed.is_linear());
    let request = MemoryRequest { name, requirements, is_written_by_cpu: false, is_linear, is_transient };
    let block = Block::new(gpu, &request)?;
    for placed in placed {
        placed.bind(&block)?;
    }
    Ok(true)
}

impl Buffer {
    fn unbound(
        gpu: &Arc<Shared>,
        name: &str,
        size: u64,
        usage: vk::BufferUsageFlags,
        families: &[u32],
    ) -> Result<Self, Error> {
        let info = vk::BufferCreateInfo::default().size(size).usage(usage);
        let info = match families {
            [_, _, ..] => info.sharing_mode(vk::SharingMode::CONCURRENT).queue_family_indices(families),
            _ => info.sharing_mode(vk::SharingMode::EXCLUSIVE),
        };
        // SAFETY: the description is complete, the size is not 0.
        let buffer =
            unsafe { gpu.device.create_buffer(&info, None) }.map_err(Error::vulkan(format!("creating {name}")))?;
        gpu.name(buffer, name);
        Ok(Self { gpu: Arc::clone(gpu), buffer, size, memory: None })
    }

    /// A buffer that the CPU writes.
    pub(crate) fn for_upload(
        gpu: &Arc<Shared>,
        name: &str,
        size: u64,
        usage: vk::BufferUsageFlags,
    ) -> Result<Self, Error> {
        let mut buffer = Self::unbound(gpu, name, size, usage, &[])?;
        let requirements = buffer.requirements();
        let request =
            MemoryRequest { name, requirements, is_written_by_cpu: true, is_linear: true, is_transient: false };
        buffer.bind(&Block::new(gpu, &request)?)?;
        Ok(buffer)
    }

    /// Writes to a buffer made with [`for_upload`](Self::for_upload).
    ///
    /// # Safety
    ///
    /// The device does not read that part of it.
    pub(crate) unsafe fn write(&self, offset: u64, bytes: &[u8]) {
        assert!(offset + bytes.len() as u64 <= self.size, "written beyond the end of a buffer");
        let mapped = self.memory.as_ref().and_then(|memory| memory.block.mapped);
        let mapped = mapped.expect("a MemorySource maps what the CPU writes");
        // SAFETY: within the block, which is at least as large as the buffer and coherent.
        unsafe { std::ptr::copy_nonoverlapping(bytes.as_ptr(), mapped.as_ptr().add(offset as usize), bytes.len()) };
    }
}

pub(crate) fn image_format(format: Format) -> vk::Format {
    match format {
        Format::Rgba16Float => vk::Format::R16G16B16A16_SFLOAT,
        Format::Rgba32Uint => vk::Format::R32G32B32A32_UINT,
        Format::Rg32Uint => vk::Format::R32G32_UINT,
        Format::R32Uint => vk::Format::R32_UINT,
    }
}

impl Image {
    fn unbound(
        gpu: &Arc<Shared>,
        name: &str,
        format: Format,
        size: UVec2,
        usage: vk::ImageUsageFlags,
        families: &[u32],
    ) -> Result<Self, Error> {
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(image_format(format))
            .extent(vk::Extent3D { width: size.x, height: size.y, depth: 1 })
            .mip_levels(1)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .tiling(vk::ImageTiling::OPTIMAL)
            .usage(usage)
            .initial_layout(vk::ImageLayout::UNDEFINED);
        let info = match families {
            [_, _, ..] => info.sharing_mode(vk::SharingMode::CONCURRENT).queue_family_indices(families),
            _ => info.sharing_mode(vk::SharingMode::EXCLUSIVE),
        };
        // SAFETY: the description is complete; size and format were checked.
        let image =
            unsafe { gpu.device.create_image(&info, None) }.map_err(Error::vulkan(format!("creating {name}")))?;
        gpu.name(image, name);
        Ok(Self { gpu: Arc::clone(gpu), image, view: vk::ImageView::null(), memory: None })
    }

    fn create_view(&mut self, name: &str, format: Format) -> Result<(), Error> {
        let info = vk::ImageViewCreateInfo::default()
            .image(self.image)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(image_format(format))
            .subresource_range(WHOLE);
        // SAFETY: the image has memory.
        self.view = unsafe { self.gpu.device.create_image_view(&info, None) }
            .map_err(Error::vulkan(format!("creating a view of {name}")))?;
        self.gpu.name(self.view, name);
        Ok(())
    }
}

/// What a resource of the plan is on the device, an image for each copy.
enum Entry {
    Images(Vec<Image>),
    Buffer(Buffer),
    External,
}

/// All resources of a plan, in its order.
pub(crate) struct Resources {
    entries: Vec<Entry>,
    /// Images that share memory with others, by the pass that uses them first in a frame.
    shared_images: Vec<(usize, vk::Image)>,
    bytes: u64,
}

fn check_limits(gpu: &Shared, resource: &Resource, size: UVec2) -> Result<(), Error> {
    let fail = |limit, needed, available: u32, unit| {
        Err(Error::Limit { resource: resource.name.clone(), limit, needed, available: available.into(), unit })
    };
    match resource.kind {
        Kind::Texture { extent, .. } => {
            let largest = extent.of(size).max_element();
            let available = gpu.limits.max_image_dimension2_d;
            if largest > available {
                return fail("maxImageDimension2D", largest.into(), available, "pixels");
            }
        }
        Kind::Buffer { stride, count, .. } => {
            let bytes = stride * count.of(size);
            let available = gpu.limits.max_storage_buffer_range;
            if bytes > available.into() {
                return fail("maxStorageBufferRange", bytes, available, "bytes");
            }
        }
        Kind::Constants | Kind::Input => {}
    }
    Ok(())
}

fn create(gpu: &Arc<Shared>, resource: &Resource, size: UVec2, options: &Options) -> Result<Entry, Error> {
    let name = format!("limpid.{}", resource.name);
    let families = &options.queue_families[..];
    match resource.kind {
        Kind::Texture { format, extent } => {
            let mut usage =
                vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::STORAGE | vk::ImageUsageFlags::TRANSFER_DST;
            if resource.exported || options.readable_intermediates {
                usage |= vk::ImageUsageFlags::TRANSFER_SRC;
            }
            let families = if resource.exported { families } else { &[] };
            let image = |_| Image::unbound(gpu, &name, format, extent.of(size), usage, families);
            Ok(Entry::Images((0..=usize::from(resource.ping_pong)).map(image).collect::<Result<_, _>>()?))
        }
        Kind::Buffer { stride, count, indirect } => {
            let mut usage = vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::TRANSFER_DST;
            if indirect {
                usage |= vk::BufferUsageFlags::INDIRECT_BUFFER;
            }
            if resource.exported || options.readable_intermediates {
                usage |= vk::BufferUsageFlags::TRANSFER_SRC;
            }
            let families = if resource.exported { families } else { &[] };
            Ok(Entry::Buffer(Buffer::unbound(gpu, &name, stride * count.of(size), usage, families)?))
        }
        Kind::Constants | Kind::Input => Ok(Entry::External),
    }
}

impl Entry {
    fn placed(&mut self) -> Vec<&mut dyn Placed> {
        match self {
            Self::Images(images) => images.iter_mut().map(|image| image as &mut dyn Placed).collect(),
            Self::Buffer(buffer) => vec![buffer],
            Self::External => Vec::new(),
        }
    }
}

impl Resources {
    /// Allocates everything; [`clear`](Self::clear) has to be recorded before it is used.
    pub(crate) fn new(gpu: &Arc<Shared>, plan: &Plan, options: &Options) -> Result<Self, Error> {
        for resource in &plan.resources {
            check_limits(gpu, resource, plan.size)?;
        }
        let mut entries = Vec::new();
        for resource in &plan.resources {
            entries.push(create(gpu, resource, plan.size, options)?);
        }
        let mut resources = Self { entries, shared_images: Vec::new(), bytes: 0 };
        let slots = plan.memory_slots();
        // What is to be read after the frame must still be there.
        let own = || slots.iter().flatten().map(|&index| vec![index]).collect();
        for slot in if options.readable_intermediates { own() } else { slots.clone() } {
            resources.place_slot(gpu, plan, &slot)?;
        }
        for (resource, entry) in plan.resources.iter().zip(&mut resources.entries) {
            if let (Kind::Texture { format, .. }, Entry::Images(images)) = (resource.kind, entry) {
                for image in images {
                    image.create_view(&format!("limpid.{}", resource.name), format)?;
                }
            }
        }
        resources.bytes = resources.allocated();
        Ok(resources)
    }

    fn place_slot(&mut self, gpu: &Arc<Shared>, plan: &Plan, slot: &[usize]) -> Result<(), Error> {
        let is_transient = |index: usize| plan.resources[index].lifetime == Lifetime::Transient;
        if let [_, _, ..] = slot {
            let names: Vec<_> = slot.iter().map(|&index| plan.resources[index].name.as_str()).collect();
            let mut entries: Vec<_> = self.entries.iter_mut().enumerate().filter(|(i, _)| slot.contains(i)).collect();
            let mut placed: Vec<_> = entries.iter_mut().flat_map(|(_, entry)| entry.placed()).collect();
            if place(gpu, &format!("limpid.{}", names.join("+")), true, &mut placed)? {
                for &index in slot {
                    let first = plan.life(&plan.resources[index].name).map_or(0, |life| *life.start());
                    if let Entry::Images(images) = &self.entries[index] {
                        self.shared_images.extend(images.iter().map(|image| (first, image.image)));
                    }
                }
                return Ok(());
            }
        }
        for &index in slot {
            let name = format!("limpid.{}", plan.resources[index].name);
            for placed in self.entries[index].placed() {
                if !place(gpu, &name, is_transient(index), &mut [placed])? {
                    return Err(Error::Unsupported { what: format!("memory that can hold {name}") });
                }
            }
        }
        Ok(())
    }

    /// Bytes of all blocks of memory, each counted once.
    fn allocated(&self) -> u64 {
        let mut blocks: Vec<&Arc<Block>> = Vec::new();
        for entry in &self.entries {
            let memories: Vec<_> = match entry {
                Entry::Images(images) => images.iter().filter_map(|image| image.memory.as_ref()).collect(),
                Entry::Buffer(buffer) => buffer.memory.iter().collect(),
                Entry::External => Vec::new(),
            };
            for memory in memories {
                if !blocks.iter().any(|block| Arc::ptr_eq(block, memory)) {
                    blocks.push(memory);
                }
            }
        }
        blocks.iter().map(|block| block.bytes).sum()
    }

    pub(crate) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Records that everything becomes zero, and images `GENERAL`.
    ///
    /// # Safety
    ///
    /// `commands` is being recorded, outside of a render pass.
    pub(crate) unsafe fn clear(&self, gpu: &Shared, commands: vk::CommandBuffer) {
        let images: Vec<_> = self.images().map(|image| image.image).collect();
        let mut batch = Batch::default();
        batch.add(Side::default(), Side::TRANSFER);
        images.iter().for_each(|&image| batch.discard(image));
        // SAFETY: the caller's promise; images and buffers are bound and can be written to by transfers.
        unsafe {
            batch.record(gpu, commands);
            for (index, image) in images.iter().enumerate() {
                // What shares memory is not read before it is written, and must not be cleared at once.
                if self.shared_images.iter().any(|(_, shared)| shared == image) {
                    continue;
                }
                let zero = vk::ClearColorValue::default();
                let layout = vk::ImageLayout::GENERAL;
                gpu.device.cmd_clear_color_image(commands, images[index], layout, &zero, &[WHOLE]);
            }
            for buffer in self.entries.iter().filter_map(Entry::buffer) {
                gpu.device.cmd_fill_buffer(commands, buffer.buffer, 0, vk::WHOLE_SIZE, 0);
            }
        }
    }

    fn images(&self) -> impl Iterator<Item = &Image> {
        self.entries.iter().flat_map(|entry| match entry {
            Entry::Images(images) => &images[..],
            _ => &[],
        })
    }

    /// Images whose content was another resource's before the pass.
    pub(crate) fn first_used_by(&self, pass: usize) -> impl Iterator<Item = vk::Image> {
        self.shared_images.iter().filter(move |(first, _)| *first == pass).map(|(_, image)| *image)
    }

    fn find(&self, plan: &Plan, name: &str) -> Option<(&Entry, bool)> {
        let index = plan.resources.iter().position(|resource| resource.name == name)?;
        Some((&self.entries[index], plan.resources[index].ping_pong))
    }

    /// The image of a resource in a frame of the given phase.
    pub(crate) fn image(&self, plan: &Plan, name: &str, copy: Copy, phase: usize) -> Option<&Image> {
        match self.find(plan, name)? {
            (Entry::Images(images), ping_pong) => images.get(copy.index(ping_pong, phase)),
            _ => None,
        }
    }

    /// The buffer of a resource.
    pub(crate) fn buffer(&self, plan: &Plan, name: &str) -> Option<&Buffer> {
        self.find(plan, name)?.0.buffer()
    }
}

impl Entry {
    fn buffer(&self) -> Option<&Buffer> {
        match self {
            Self::Buffer(buffer) => Some(buffer),
            _ => None,
        }
    }
}
