//! How a Vulkan renderer records limpid: the program owns instance, device, images, command buffers and
//! submission, and keeps two frames in flight.
//!
//! `cargo run --release -p limpid-ash --example integration` renders a noisy wall off screen, denoises it, and
//! prints how much noise there was before and after.

use std::error::Error;
use std::sync::{Arc, Mutex};

use glam::{Mat4, UVec2, Vec2, camera::rh};
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme, Allocator, AllocatorCreateDesc};
use half::f16;
use limpid::{Camera, FrameInputs, Settings, settings::DepthEncoding};
use limpid_ash::ash::{self, vk};
use limpid_ash::memory::GpuAllocator;
use limpid_ash::{Denoiser, Gpu, Input, Inputs, Options};

const SIZE: UVec2 = UVec2::new(256, 256);
const FRAMES_IN_FLIGHT: usize = 2;
const FRAMES: u32 = 32;

fn main() -> Result<(), Box<dyn Error>> {
    // SAFETY: a Vulkan program like others: handles are used with the device they come from, in the order that
    // the specification asks for, and everything is destroyed once the device is idle.
    unsafe { run() }
}

unsafe fn run() -> Result<(), Box<dyn Error>> {
    unsafe {
        // What a renderer has: a device, a queue, memory.
        let entry = ash::Entry::load()?;
        let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_1);
        let info = vk::InstanceCreateInfo::default().application_info(&application);
        let instance = entry.create_instance(&info, None)?;
        let physical_device = *instance.enumerate_physical_devices()?.first().ok_or("no Vulkan device")?;
        let families = instance.get_physical_device_queue_family_properties(physical_device);
        let has_compute = |family: &vk::QueueFamilyProperties| family.queue_flags.contains(vk::QueueFlags::COMPUTE);
        let queue_family = families.iter().position(has_compute).ok_or("no compute queue")? as u32;
        let queues = [vk::DeviceQueueCreateInfo::default().queue_family_index(queue_family).queue_priorities(&[1.0])];
        // The one feature that limpid needs: it stores two 32-bit integers a texel.
        let features = vk::PhysicalDeviceFeatures::default().shader_storage_image_extended_formats(true);
        let info = vk::DeviceCreateInfo::default().queue_create_infos(&queues).enabled_features(&features);
        let device = instance.create_device(physical_device, &info, None)?;
        let queue = device.get_device_queue(queue_family, 0);
        let allocator = Arc::new(Mutex::new(Allocator::new(&AllocatorCreateDesc {
            instance: instance.clone(),
            device: device.clone(),
            physical_device,
            debug_settings: Default::default(),
            buffer_device_address: false,
            allocation_sizes: Default::default(),
        })?));

        // The G-buffer: a wall 2 units away, roughness 0.3, nothing moves.
        let renderer = Renderer { device: device.clone(), allocator: Arc::clone(&allocator) };
        let mut radiance = renderer.image(vk::Format::R16G16B16A16_SFLOAT)?;
        let mut normal = renderer.image(vk::Format::R32G32B32A32_SFLOAT)?;
        let mut roughness = renderer.image(vk::Format::R32_SFLOAT)?;
        let mut depth = renderer.image(vk::Format::R32_SFLOAT)?;
        let mut motion = renderer.image(vk::Format::R32G32_SFLOAT)?;
        let texels = SIZE.element_product() as usize;
        let input =
            |image: &Image| Input { view: image.view, layout: vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL, size: SIZE };
        let inputs = Inputs {
            radiance: input(&radiance),
            normal: input(&normal),
            roughness: input(&roughness),
            depth: input(&depth),
            motion: input(&motion),
            hit_motion: None,
            environment: None,
            previous: None,
        };

        // The denoiser. It would like to know which stages read its output: here it is copied.
        let mut settings = Settings::default();
        settings.conventions.depth = DepthEncoding::Linear;
        let options = Options {
            frames_in_flight: FRAMES_IN_FLIGHT,
            reader_stages: vk::PipelineStageFlags::TRANSFER,
            ..Options::default()
        };
        let gpu = Gpu { instance: &instance, physical_device, device: &device, queue_family };
        let memory = Box::new(GpuAllocator::new(Arc::clone(&allocator)));
        let mut denoiser = Denoiser::new(gpu, memory, &settings, SIZE, options)?;
        let view_to_clip = rh::proj::directx::perspective(1.0, 1.0, 0.1, 100.0);
        let camera = Camera { world_to_view: Mat4::IDENTITY, view_to_clip, jitter: Vec2::ZERO };

        // Frames in flight: a command buffer, a fence and room for new radiance each.
        let info = vk::CommandPoolCreateInfo::default()
            .queue_family_index(queue_family)
            .flags(vk::CommandPoolCreateFlags::RESET_COMMAND_BUFFER);
        let pool = device.create_command_pool(&info, None)?;
        let count = FRAMES_IN_FLIGHT as u32;
        let info = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(count);
        let command_buffers = device.allocate_command_buffers(&info)?;
        let signaled = vk::FenceCreateInfo::default().flags(vk::FenceCreateFlags::SIGNALED);
        let mut slots = Vec::new();
        for commands in command_buffers {
            let staging = renderer.buffer(texels * 8, vk::BufferUsageFlags::TRANSFER_SRC, MemoryLocation::CpuToGpu)?;
            slots.push((commands, device.create_fence(&signaled, None)?, staging));
        }
        let mut gbuffer = renderer.buffer(texels * 16, vk::BufferUsageFlags::TRANSFER_SRC, MemoryLocation::CpuToGpu)?;
        let mut result = renderer.buffer(texels * 8, vk::BufferUsageFlags::TRANSFER_DST, MemoryLocation::GpuToCpu)?;

        for frame in 0..FRAMES {
            let (commands, fence, staging) = &mut slots[frame as usize % FRAMES_IN_FLIGHT];
            // limpid relies on this: the frame before last is done.
            device.wait_for_fences(&[*fence], true, u64::MAX)?;
            device.reset_fences(&[*fence])?;
            let noisy: Vec<[f16; 4]> = (0..texels as u32).map(|pixel| noise(frame, pixel)).collect();
            staging.write(bytemuck::cast_slice(&noisy));
            let begin = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
            device.begin_command_buffer(*commands, &begin)?;
            if frame == 0 {
                for (image, texel) in [
                    (&mut normal, &[0.0f32, 0.0, 1.0, 0.0][..]),
                    (&mut roughness, &[0.3]),
                    (&mut depth, &[2.0]),
                    (&mut motion, &[0.0, 0.0]),
                ] {
                    gbuffer.write(bytemuck::cast_slice(&texel.repeat(texels)));
                    renderer.fill_now(queue, *commands, image, &gbuffer)?;
                }
            }
            // Rays are traced: here they arrive from the CPU.
            renderer.record_upload(*commands, &mut radiance, staging);

            denoiser.record(*commands, &inputs, &FrameInputs::new(camera, SIZE))?;

            // Whatever comes next reads the output, in the layout GENERAL. No barrier is needed before it.
            if frame == FRAMES - 1 {
                let (image, layout) = (denoiser.output().image, vk::ImageLayout::GENERAL);
                device.cmd_copy_image_to_buffer(*commands, image, layout, result.buffer, &[region()]);
            }
            device.end_command_buffer(*commands)?;
            let submitted = [*commands];
            device.queue_submit(queue, &[vk::SubmitInfo::default().command_buffers(&submitted)], *fence)?;
        }
        device.device_wait_idle()?;

        let denoised: &[[f16; 4]] = bytemuck::cast_slice(result.allocation.mapped_slice().ok_or("not mapped")?);
        let noisy: Vec<[f16; 4]> = (0..texels as u32).map(|pixel| noise(FRAMES - 1, pixel)).collect();
        println!("{:?}, {} bytes allocated", denoiser.recorded(), denoiser.allocated_bytes());
        println!("standard deviation: {:.4} before, {:.4} after", deviation(&noisy), deviation(&denoised[..texels]));

        // The device is idle: the denoiser goes first, then what it used.
        drop(denoiser);
        for (_, fence, mut staging) in slots {
            device.destroy_fence(fence, None);
            renderer.destroy_buffer(&mut staging);
        }
        renderer.destroy_buffer(&mut gbuffer);
        renderer.destroy_buffer(&mut result);
        for image in [&mut radiance, &mut normal, &mut roughness, &mut depth, &mut motion] {
            renderer.destroy_image(image);
        }
        device.destroy_command_pool(pool, None);
        drop(renderer);
        drop(allocator);
        device.destroy_device(None);
        instance.destroy_instance(None);
        Ok(())
    }
}

/// Light of a random brightness; the wall is hit again 3 units away.
fn noise(frame: u32, pixel: u32) -> [f16; 4] {
    let seed = (pixel ^ frame.wrapping_mul(0x9e37_79b9)).wrapping_mul(0x85eb_ca6b);
    let hash = (seed ^ seed >> 13).wrapping_mul(0xc2b2_ae35);
    let value = f16::from_f32((hash >> 8) as f32 / (1 << 24) as f32);
    [value, value, value, f16::from_f32(3.0)]
}

fn deviation(texels: &[[f16; 4]]) -> f32 {
    let mean = texels.iter().map(|t| t[0].to_f32()).sum::<f32>() / texels.len() as f32;
    (texels.iter().map(|t| (t[0].to_f32() - mean).powi(2)).sum::<f32>() / texels.len() as f32).sqrt()
}

fn region() -> vk::BufferImageCopy {
    let layer = vk::ImageSubresourceLayers::default().aspect_mask(vk::ImageAspectFlags::COLOR).layer_count(1);
    let extent = vk::Extent3D { width: SIZE.x, height: SIZE.y, depth: 1 };
    vk::BufferImageCopy::default().image_subresource(layer).image_extent(extent)
}

struct Image {
    image: vk::Image,
    view: vk::ImageView,
    layout: vk::ImageLayout,
    allocation: Allocation,
}

struct Buffer {
    buffer: vk::Buffer,
    allocation: Allocation,
}

impl Buffer {
    fn write(&mut self, bytes: &[u8]) {
        let mapped = self.allocation.mapped_slice_mut().expect("the CPU writes it");
        mapped[..bytes.len()].copy_from_slice(bytes);
    }
}

/// What stands for a renderer here.
struct Renderer {
    device: ash::Device,
    allocator: Arc<Mutex<Allocator>>,
}

impl Renderer {
    fn allocate(
        &self,
        requirements: vk::MemoryRequirements,
        location: MemoryLocation,
        linear: bool,
    ) -> Result<Allocation, Box<dyn Error>> {
        let allocation_scheme = AllocationScheme::GpuAllocatorManaged;
        let descriptor = AllocationCreateDesc { name: "renderer", requirements, location, linear, allocation_scheme };
        Ok(self.allocator.lock().map_err(|_| "poisoned")?.allocate(&descriptor)?)
    }

    unsafe fn image(&self, format: vk::Format) -> Result<Image, Box<dyn Error>> {
        unsafe {
            let info = vk::ImageCreateInfo::default()
                .image_type(vk::ImageType::TYPE_2D)
                .format(format)
                .extent(vk::Extent3D { width: SIZE.x, height: SIZE.y, depth: 1 })
                .mip_levels(1)
                .array_layers(1)
                .samples(vk::SampleCountFlags::TYPE_1)
                .usage(vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST);
            let image = self.device.create_image(&info, None)?;
            let requirements = self.device.get_image_memory_requirements(image);
            let allocation = self.allocate(requirements, MemoryLocation::GpuOnly, false)?;
            self.device.bind_image_memory(image, allocation.memory(), allocation.offset())?;
            let info = vk::ImageViewCreateInfo::default()
                .image(image)
                .view_type(vk::ImageViewType::TYPE_2D)
                .format(format)
                .subresource_range(whole());
            let view = self.device.create_image_view(&info, None)?;
            Ok(Image { image, view, layout: vk::ImageLayout::UNDEFINED, allocation })
        }
    }

    unsafe fn buffer(
        &self,
        size: usize,
        usage: vk::BufferUsageFlags,
        location: MemoryLocation,
    ) -> Result<Buffer, Box<dyn Error>> {
        unsafe {
            let info = vk::BufferCreateInfo::default().size(size as u64).usage(usage);
            let buffer = self.device.create_buffer(&info, None)?;
            let requirements = self.device.get_buffer_memory_requirements(buffer);
            let allocation = self.allocate(requirements, location, true)?;
            self.device.bind_buffer_memory(buffer, allocation.memory(), allocation.offset())?;
            Ok(Buffer { buffer, allocation })
        }
    }

    /// Copies into an image and makes it visible to limpid: this is the barrier that limpid asks for.
    unsafe fn record_upload(&self, commands: vk::CommandBuffer, image: &mut Image, from: &Buffer) {
        use vk::{AccessFlags as Access, ImageLayout as Layout, PipelineStageFlags as Stage};
        unsafe {
            let change = |old, new, before: (Stage, Access), after: (Stage, Access)| {
                let barrier = vk::ImageMemoryBarrier::default()
                    .old_layout(old)
                    .new_layout(new)
                    .src_access_mask(before.1)
                    .dst_access_mask(after.1)
                    .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
                    .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
                    .image(image.image)
                    .subresource_range(whole());
                let flags = vk::DependencyFlags::empty();
                self.device.cmd_pipeline_barrier(commands, before.0, after.0, flags, &[], &[], &[barrier]);
            };
            let (copied, read) = (Layout::TRANSFER_DST_OPTIMAL, Layout::SHADER_READ_ONLY_OPTIMAL);
            let copy = (Stage::TRANSFER, Access::TRANSFER_WRITE);
            let kernel = (Stage::COMPUTE_SHADER, Access::SHADER_READ);
            // Last frame's kernels have read it before it is overwritten.
            change(image.layout, copied, (Stage::COMPUTE_SHADER, Access::empty()), copy);
            self.device.cmd_copy_buffer_to_image(commands, from.buffer, image.image, copied, &[region()]);
            change(copied, read, copy, kernel);
        }
        image.layout = vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL;
    }

    /// Uploads at once, with commands that are then begun anew.
    unsafe fn fill_now(
        &self,
        queue: vk::Queue,
        commands: vk::CommandBuffer,
        image: &mut Image,
        from: &Buffer,
    ) -> Result<(), Box<dyn Error>> {
        unsafe {
            self.record_upload(commands, image, from);
            self.device.end_command_buffer(commands)?;
            let submitted = [commands];
            let submit = vk::SubmitInfo::default().command_buffers(&submitted);
            self.device.queue_submit(queue, &[submit], vk::Fence::null())?;
            self.device.device_wait_idle()?;
            Ok(self.device.begin_command_buffer(commands, &vk::CommandBufferBeginInfo::default())?)
        }
    }

    unsafe fn destroy_image(&self, image: &mut Image) {
        unsafe {
            self.device.destroy_image_view(image.view, None);
            self.device.destroy_image(image.image, None);
        }
        self.free(&mut image.allocation);
    }

    unsafe fn destroy_buffer(&self, buffer: &mut Buffer) {
        unsafe { self.device.destroy_buffer(buffer.buffer, None) };
        self.free(&mut buffer.allocation);
    }

    fn free(&self, allocation: &mut Allocation) {
        if let Ok(mut allocator) = self.allocator.lock() {
            // It fails only for allocations of another allocator.
            let _ = allocator.free(std::mem::take(allocation));
        }
    }
}

fn whole() -> vk::ImageSubresourceRange {
    vk::ImageSubresourceRange::default().aspect_mask(vk::ImageAspectFlags::COLOR).level_count(1).layer_count(1)
}
