use std::cell::Cell;
use std::marker::PhantomData;
use std::sync::{Arc, Mutex, PoisonError};

use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme, Allocator, AllocatorCreateDesc};
use limpid::variants::Made;

use super::image::{LAYER, Use, change, texel_bytes};
use super::instance::{DeviceRequest, Instance, device_name, open_device};
use crate::gpu::Shared;
use crate::memory::{GpuAllocator, MemorySource};
use crate::pipelines::Pipelines;
use crate::statistics::PassStatistics;
use crate::{Gpu, Options, OwnImage, Synchronization};

/// Why there is no device, or why it did not do what was asked.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OffscreenError {
    /// There is no Vulkan on this machine.
    #[error("no Vulkan loader was found: {0}. On Debian and Ubuntu: apt-get install libvulkan1 mesa-vulkan-drivers")]
    Loader(#[from] ash::LoadingError),
    /// No device of Vulkan 1.1 with compute, or none of the name asked for.
    #[error("no Vulkan device{wanted} was found, only {found:?}")]
    NoDevice {
        /// What was asked for.
        wanted: String,
        /// Names of all devices.
        found: Vec<String>,
    },
    /// A Vulkan call failed.
    #[error("{during} failed: {result}")]
    Vulkan {
        /// What was being done.
        during: &'static str,
        /// What Vulkan said.
        result: vk::Result,
    },
    /// The denoiser could not be made or a frame not be recorded.
    #[error(transparent)]
    Denoiser(#[from] crate::Error),
    /// There is no memory for an image or a copy.
    #[error("no memory for an off-screen image: {0}")]
    Memory(#[from] gpu_allocator::AllocationError),
}

pub(super) fn failed(during: &'static str) -> impl FnOnce(vk::Result) -> OffscreenError {
    move |result| OffscreenError::Vulkan { during, result }
}

/// Which device, and how.
#[derive(Debug, Clone, Default)]
pub struct ContextOptions {
    /// The first device whose name contains this; the most capable one if empty.
    pub device: String,
    /// Whether the Khronos validation layer watches: core, synchronization and GPU-assisted. It must be
    /// installed. Messages are collected, see [`Context::messages`].
    pub validation: bool,
    /// Whether the driver's compiler is to be asked what it makes of passes, see [`Context::statistics`]. It must
    /// offer `VK_KHR_pipeline_executable_properties`.
    pub statistics: bool,
}

/// A device with one queue.
pub struct Context {
    physical_device: vk::PhysicalDevice,
    device: ash::Device,
    queue: vk::Queue,
    queue_family: u32,
    command_pool: vk::CommandPool,
    /// Taken when the context is dropped.
    allocator: Option<Arc<Mutex<Allocator>>>,
    debug_device: Option<ash::ext::debug_utils::Device>,
    statistics: Option<ash::khr::pipeline_executable_properties::Device>,
    name: String,
    has_timestamps: bool,
    has_synchronization2: bool,
    /// Commands are recorded from one pool, by one thread at a time.
    _not_sync: PhantomData<Cell<()>>,
    /// Last, because it is dropped last.
    instance: Instance,
}

impl Context {
    /// Opens a device.
    ///
    /// # Errors
    ///
    /// When there is none, or no validation layer.
    pub fn open(options: &ContextOptions) -> Result<Self, OffscreenError> {
        let instance = Instance::new(options.validation)?;
        let found = instance.devices()?;
        let is_wanted = |(_, properties): &&(_, _)| device_name(properties).contains(&options.device);
        let Some(&(physical_device, properties)) = found.iter().find(is_wanted) else {
            let wanted = if options.device.is_empty() { String::new() } else { format!(" named {:?}", options.device) };
            let found = found.iter().map(|(_, properties)| device_name(properties)).collect();
            return Err(OffscreenError::NoDevice { wanted, found });
        };
        // SAFETY: the physical device is of this instance.
        let families = unsafe { instance.instance.get_physical_device_queue_family_properties(physical_device) };
        let has_compute = |family: &vk::QueueFamilyProperties| family.queue_flags.contains(vk::QueueFlags::COMPUTE);
        let queue_family = families.iter().position(has_compute).unwrap_or(0);
        let (device, has_synchronization2) = open_device(
            &instance.instance,
            &DeviceRequest {
                physical_device,
                properties: &properties,
                queue_family: queue_family as u32,
                statistics: options.statistics,
            },
        )?;
        // SAFETY: the device was made with one queue of that family.
        let queue = unsafe { device.get_device_queue(queue_family as u32, 0) };
        let debug_device = options.validation.then(|| ash::ext::debug_utils::Device::new(&instance.instance, &device));
        let statistics = options
            .statistics
            .then(|| ash::khr::pipeline_executable_properties::Device::new(&instance.instance, &device));
        let mut context = Self {
            physical_device,
            device,
            queue,
            queue_family: queue_family as u32,
            command_pool: vk::CommandPool::null(),
            allocator: None,
            debug_device,
            statistics,
            name: device_name(&properties),
            has_timestamps: families[queue_family].timestamp_valid_bits > 0,
            has_synchronization2,
            _not_sync: PhantomData,
            instance,
        };
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: context.instance.instance.clone(),
            device: context.device.clone(),
            physical_device,
            debug_settings: Default::default(),
            buffer_device_address: false,
            allocation_sizes: Default::default(),
        })?;
        context.allocator = Some(Arc::new(Mutex::new(allocator)));
        let info = vk::CommandPoolCreateInfo::default().queue_family_index(context.queue_family);
        // SAFETY: the device has that family.
        context.command_pool =
            unsafe { context.device.create_command_pool(&info, None) }.map_err(failed("creating a command pool"))?;
        Ok(context)
    }

    /// Name of the device.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Whether passes can be timed.
    pub fn has_timestamps(&self) -> bool {
        self.has_timestamps
    }

    /// Barriers as the device can do them best.
    pub fn synchronization(&self) -> Synchronization {
        if self.has_synchronization2 { Synchronization::Core1_3 } else { Synchronization::Core1_0 }
    }

    /// Names and labels for debuggers, when the validation layer watches.
    pub fn debug_utils(&self) -> Option<ash::ext::debug_utils::Device> {
        self.debug_device.clone()
    }

    /// What the driver's compiler makes of each pass: registers, instructions and the like, in the driver's own terms.
    /// Makes pipelines and nothing else, so that drivers which only pretend to have a device can be asked. Nothing
    /// unless [`ContextOptions::statistics`] asked for it.
    ///
    /// # Errors
    ///
    /// [`OffscreenError::Denoiser`].
    pub fn statistics(&self, core: &limpid::Denoiser) -> Result<Vec<PassStatistics>, OffscreenError> {
        let Some(extension) = &self.statistics else { return Ok(Vec::new()) };
        let mut shared = Shared::new(self.gpu(), self.memory(), self.synchronization(), self.debug_utils())?;
        shared.statistics = Some(extension.clone());
        let (shared, options, mut made) = (Arc::new(shared), Options::default(), Made::default());
        let pipelines = Pipelines::new(&shared, core.plan(), core.kernels(), &options, &mut made)?;
        let passes = pipelines.passes.iter().map(|pipeline| pipeline.statistics(extension));
        Ok(passes.collect::<Result<Vec<_>, _>>()?.concat())
    }

    /// The device, for [`Denoiser::new`](crate::Denoiser::new).
    pub fn gpu(&self) -> Gpu<'_> {
        Gpu {
            instance: &self.instance.instance,
            physical_device: self.physical_device,
            device: &self.device,
            queue_family: self.queue_family,
        }
    }

    /// The device.
    pub fn device(&self) -> &ash::Device {
        &self.device
    }

    fn allocator(&self) -> &Arc<Mutex<Allocator>> {
        self.allocator.as_ref().expect("taken on drop only")
    }

    /// Memory for a denoiser.
    pub fn memory(&self) -> Box<dyn MemorySource> {
        Box::new(GpuAllocator::new(Arc::clone(self.allocator())))
    }

    /// What the validation layer said so far.
    pub fn messages(&self) -> Vec<String> {
        self.instance.messages()
    }

    /// Bytes that are allocated and were not freed yet.
    pub fn allocated_bytes(&self) -> u64 {
        self.allocator().lock().unwrap_or_else(PoisonError::into_inner).generate_report().total_allocated_bytes
    }

    pub(super) fn allocate(
        &self,
        name: &str,
        requirements: vk::MemoryRequirements,
        location: MemoryLocation,
        linear: bool,
    ) -> Result<Allocation, OffscreenError> {
        let allocation_scheme = AllocationScheme::GpuAllocatorManaged;
        let descriptor = AllocationCreateDesc { name, requirements, location, linear, allocation_scheme };
        Ok(self.allocator().lock().unwrap_or_else(PoisonError::into_inner).allocate(&descriptor)?)
    }

    pub(super) fn free(&self, allocation: Allocation) {
        // It fails only for allocations of another allocator.
        let _ = self.allocator().lock().unwrap_or_else(PoisonError::into_inner).free(allocation);
    }

    /// Runs commands and waits until the device has finished them. `record` says what it made of it.
    ///
    /// # Errors
    ///
    /// What `record` returns, or [`OffscreenError::Vulkan`].
    pub fn run<T>(
        &self,
        record: impl FnOnce(vk::CommandBuffer) -> Result<T, OffscreenError>,
    ) -> Result<T, OffscreenError> {
        let device = &self.device;
        let info = vk::CommandBufferAllocateInfo::default().command_pool(self.command_pool).command_buffer_count(1);
        // SAFETY: the pool is alive and used by this thread alone, as `Context` is not `Sync`.
        let buffers = unsafe { device.allocate_command_buffers(&info) }.map_err(failed("allocating commands"))?;
        let begin = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: as above.
        unsafe { device.begin_command_buffer(buffers[0], &begin) }.map_err(failed("beginning commands"))?;
        let recorded = record(buffers[0]);
        // SAFETY: the buffer is submitted once and the queue idle before it is freed.
        let submitted = unsafe {
            device.end_command_buffer(buffers[0]).map_err(failed("ending commands")).and_then(|()| {
                if recorded.is_err() {
                    return Ok(());
                }
                let submit = vk::SubmitInfo::default().command_buffers(&buffers);
                device.queue_submit(self.queue, &[submit], vk::Fence::null()).map_err(failed("submitting"))?;
                device.queue_wait_idle(self.queue).map_err(failed("waiting for the device"))
            })
        };
        // SAFETY: as above.
        unsafe { device.free_command_buffers(self.command_pool, &buffers) };
        submitted?;
        recorded
    }

    /// The content of an image with 8 bytes a texel, row by row, that is in the layout `GENERAL`.
    ///
    /// # Errors
    ///
    /// [`OffscreenError`].
    pub fn read_image(&self, image: &OwnImage) -> Result<Vec<u8>, OffscreenError> {
        self.read(u64::from(image.size.x) * u64::from(image.size.y) * texel_bytes(image.format), |commands, buffer| {
            let region = vk::BufferImageCopy::default().image_subresource(LAYER).image_extent(vk::Extent3D {
                width: image.size.x,
                height: image.size.y,
                depth: 1,
            });
            let (device, layout) = (&self.device, Use::COPIED.layout);
            // SAFETY: the image has that size and format, and is not in use.
            unsafe {
                change(device, commands, image.image, Use::OWN, Use::COPIED);
                device.cmd_copy_image_to_buffer(commands, image.image, layout, buffer, &[region]);
                change(device, commands, image.image, Use::COPIED, Use::OWN);
            }
        })
    }

    /// The content of a buffer.
    ///
    /// # Errors
    ///
    /// [`OffscreenError`].
    pub fn read_buffer(&self, buffer: vk::Buffer, size: u64) -> Result<Vec<u8>, OffscreenError> {
        self.read(size, |commands, target| {
            let region = vk::BufferCopy::default().size(size);
            // SAFETY: both buffers have that size, and are not in use.
            unsafe { self.device.cmd_copy_buffer(commands, buffer, target, &[region]) };
        })
    }

    fn read(&self, size: u64, copy: impl FnOnce(vk::CommandBuffer, vk::Buffer)) -> Result<Vec<u8>, OffscreenError> {
        let usage = vk::BufferUsageFlags::TRANSFER_DST;
        let (buffer, allocation) = self.staging_buffer(size, usage, MemoryLocation::GpuToCpu)?;
        let done = self.run(|commands| {
            copy(commands, buffer);
            let barrier = vk::MemoryBarrier::default()
                .src_access_mask(vk::AccessFlags::TRANSFER_WRITE)
                .dst_access_mask(vk::AccessFlags::HOST_READ);
            let (before, after) = (vk::PipelineStageFlags::TRANSFER, vk::PipelineStageFlags::HOST);
            // SAFETY: commands are being recorded.
            unsafe {
                let flags = vk::DependencyFlags::empty();
                self.device.cmd_pipeline_barrier(commands, before, after, flags, &[barrier], &[], &[]);
            }
            Ok(())
        });
        let bytes = allocation.mapped_slice().map(|bytes| bytes[..size as usize].to_vec()).unwrap_or_default();
        self.destroy_buffer(buffer, allocation);
        done.map(|()| bytes)
    }

    pub(super) fn staging_buffer(
        &self,
        size: u64,
        usage: vk::BufferUsageFlags,
        location: MemoryLocation,
    ) -> Result<(vk::Buffer, Allocation), OffscreenError> {
        let info = vk::BufferCreateInfo::default().size(size).usage(usage);
        // SAFETY: the description is complete.
        let buffer = unsafe { self.device.create_buffer(&info, None) }.map_err(failed("creating a buffer"))?;
        // SAFETY: the buffer is of this device.
        let requirements = unsafe { self.device.get_buffer_memory_requirements(buffer) };
        let allocation = self.allocate("staging", requirements, location, true);
        let allocation = match allocation {
            Ok(allocation) => allocation,
            Err(error) => {
                // SAFETY: it was never used.
                unsafe { self.device.destroy_buffer(buffer, None) };
                return Err(error);
            }
        };
        // SAFETY: the allocation meets the buffer's requirements.
        let bound = unsafe { self.device.bind_buffer_memory(buffer, allocation.memory(), allocation.offset()) };
        match bound {
            Ok(()) => Ok((buffer, allocation)),
            Err(result) => {
                self.destroy_buffer(buffer, allocation);
                Err(failed("binding memory")(result))
            }
        }
    }

    pub(super) fn destroy_buffer(&self, buffer: vk::Buffer, allocation: Allocation) {
        // SAFETY: the device has finished with it.
        unsafe { self.device.destroy_buffer(buffer, None) };
        self.free(allocation);
    }
}

impl Drop for Context {
    fn drop(&mut self) {
        // SAFETY: whatever was submitted was waited for. Denoisers and images are gone by contract.
        unsafe {
            self.device.destroy_command_pool(self.command_pool, None);
            drop(self.allocator.take());
            self.device.destroy_device(None);
        }
    }
}
