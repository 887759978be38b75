//! The wgpu backend: uploads a frame, records, submits, reads back.

use std::sync::mpsc;
use std::time::Duration;

use anyhow::{Context, Result, anyhow};
use glam::UVec2;
use half::f16;
use limpid::{FrameInputs, Plan};
use limpid_wgpu::{Denoiser, Inputs, Options, PassTime, PrevGbuffer};

use super::{Backend, Denoised, ListedRay, Tracer, split, timed, to_half, trace_listed};
use crate::sequence::Frame;

/// An input image on the device.
struct Image {
    texture: wgpu::Texture,
    view: wgpu::TextureView,
}

struct Gbuffer {
    normal: Image,
    roughness: Image,
    depth: Image,
}

/// The images of a frame, and the G-buffer of the last.
struct Images {
    radiance: Image,
    motion: Image,
    hit_motion: Image,
    gbuffer: Gbuffer,
    previous: Gbuffer,
}

pub(super) struct Gpu {
    description: String,
    device: wgpu::Device,
    queue: wgpu::Queue,
    denoiser: Denoiser,
    images: Images,
}

const NO_DEVICE: &str = "no Vulkan, Metal or Direct3D 12 device was found. On Linux without a GPU install a software \
                         Vulkan driver (Debian and Ubuntu: apt-get install mesa-vulkan-drivers)";

fn open_device() -> Result<(String, wgpu::Device, wgpu::Queue)> {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    // Grids come from limpid's own kernels, so checking them before each dispatch would only distort times.
    descriptor.flags = wgpu::InstanceFlags::empty();
    let instance = wgpu::Instance::new(descriptor);
    let options =
        wgpu::RequestAdapterOptions { power_preference: wgpu::PowerPreference::HighPerformance, ..Default::default() };
    let adapter = pollster::block_on(instance.request_adapter(&options)).context(NO_DEVICE)?;
    let info = adapter.get_info();
    let available = adapter.limits();
    let device_descriptor = wgpu::DeviceDescriptor {
        label: Some("limpid"),
        required_features: adapter.features() & wgpu::Features::TIMESTAMP_QUERY,
        // Beyond the defaults only what large images need.
        required_limits: wgpu::Limits {
            max_texture_dimension_2d: available.max_texture_dimension_2d,
            max_buffer_size: available.max_buffer_size,
            max_storage_buffer_binding_size: available.max_storage_buffer_binding_size,
            ..Default::default()
        },
        ..Default::default()
    };
    let (device, queue) = pollster::block_on(adapter.request_device(&device_descriptor))
        .with_context(|| format!("cannot open {} ({:?})", info.name, info.backend))?;
    let kind = match info.device_type {
        wgpu::DeviceType::Cpu => "software, on the CPU",
        wgpu::DeviceType::IntegratedGpu => "integrated GPU",
        wgpu::DeviceType::DiscreteGpu => "discrete GPU",
        wgpu::DeviceType::VirtualGpu | wgpu::DeviceType::Other => "unknown kind",
    };
    Ok((format!("{} through wgpu and {:?} ({kind})", info.name, info.backend), device, queue))
}

fn image(device: &wgpu::Device, name: &str, size: UVec2, format: wgpu::TextureFormat) -> Image {
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some(name),
        size: wgpu::Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
    Image { texture, view }
}

impl Gbuffer {
    fn new(device: &wgpu::Device, size: UVec2) -> Self {
        use wgpu::TextureFormat::{R32Float, Rgba32Float};
        Self {
            normal: image(device, "normal", size, Rgba32Float),
            roughness: image(device, "roughness", size, R32Float),
            depth: image(device, "depth", size, R32Float),
        }
    }
}

impl Images {
    fn new(device: &wgpu::Device, size: UVec2) -> Self {
        use wgpu::TextureFormat::{Rg32Float, Rgba16Float, Rgba32Float};
        Self {
            radiance: image(device, "radiance", size, Rgba16Float),
            motion: image(device, "motion", size, Rg32Float),
            hit_motion: image(device, "hit motion", size, Rgba32Float),
            gbuffer: Gbuffer::new(device, size),
            previous: Gbuffer::new(device, size),
        }
    }

    fn inputs(&self) -> Inputs<'_> {
        let Gbuffer { normal, roughness, depth } = &self.previous;
        Inputs {
            radiance: &self.radiance.view,
            normal: &self.gbuffer.normal.view,
            roughness: &self.gbuffer.roughness.view,
            depth: &self.gbuffer.depth.view,
            motion: &self.motion.view,
            hit_motion: Some(&self.hit_motion.view),
            environment: None,
            previous: Some(PrevGbuffer { normal: &normal.view, roughness: &roughness.view, depth: &depth.view }),
        }
    }

    /// This frame's G-buffer is last frame's from now on.
    fn advance(&mut self) {
        std::mem::swap(&mut self.gbuffer, &mut self.previous);
    }
}

impl Gpu {
    pub(super) fn open(core: limpid::Denoiser) -> Result<Self> {
        let size = core.plan().size;
        let (description, device, queue) = open_device()?;
        let timestamps = device.features().contains(wgpu::Features::TIMESTAMP_QUERY);
        let options = Options { timestamps, ..Default::default() };
        let denoiser = Denoiser::with_core(&device, core, options)?;
        let images = Images::new(&device, size);
        Ok(Self { description, device, queue, denoiser, images })
    }

    fn upload<T: bytemuck::NoUninit>(&self, image: &Image, size: UVec2, texels: &[T]) {
        self.queue.write_texture(
            image.texture.as_image_copy(),
            bytemuck::cast_slice(texels),
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(size.x * size_of::<T>() as u32),
                rows_per_image: None,
            },
            wgpu::Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 },
        );
    }

    fn upload_radiance(&self, size: UVec2, radiance: &[[f32; 4]]) {
        let halves: Vec<[f16; 4]> = radiance.iter().map(|texel| texel.map(to_half)).collect();
        self.upload(&self.images.radiance, size, &halves);
    }

    fn upload_gbuffer(&self, frame: &Frame) -> Result<()> {
        let normals = super::normals(self.denoiser.plan(), frame)?;
        self.upload(&self.images.gbuffer.normal, frame.size, &normals);
        self.upload(&self.images.gbuffer.roughness, frame.size, &frame.roughness);
        self.upload(&self.images.gbuffer.depth, frame.size, &frame.depth);
        self.upload(&self.images.motion, frame.size, &frame.motion);
        if let Some(motion) = super::hit_motion(self.denoiser.plan(), frame)? {
            self.upload(&self.images.hit_motion, frame.size, &motion);
        }
        Ok(())
    }

    fn readback_buffer(&self, size: u64) -> wgpu::Buffer {
        self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("readback"),
            size,
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        })
    }

    fn wait(&self) -> Result<()> {
        self.device.poll(wgpu::PollType::wait_indefinitely()).context("the device was lost")?;
        Ok(())
    }

    /// Waits for everything submitted and returns the content of a readback buffer.
    fn read(&self, buffer: &wgpu::Buffer) -> Result<Vec<u8>> {
        let (sender, receiver) = mpsc::channel();
        buffer.map_async(wgpu::MapMode::Read, .., move |result| {
            // Nobody listens any more once waiting has failed.
            let _ = sender.send(result);
        });
        self.wait()?;
        receiver.recv().context("the device did not answer")?.context("cannot read back from the device")?;
        let bytes = buffer.get_mapped_range(..).map_err(|e| anyhow!("cannot read back from the device: {e}"))?.to_vec();
        buffer.unmap();
        Ok(bytes)
    }

    fn encoder(&self) -> wgpu::CommandEncoder {
        self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default())
    }

    /// Runs what was recorded and adds how long that took, waiting included.
    fn run(&self, encoder: wgpu::CommandEncoder, time: &mut Duration, cpu_time: &mut Duration) -> Result<()> {
        // Uploads are not part of it.
        self.queue.submit([]);
        self.wait()?;
        timed(time, cpu_time, || {
            self.queue.submit([encoder.finish()]);
            self.wait()
        })
    }

    fn classified_rays(&self) -> Result<Vec<ListedRay>> {
        let list = self.denoiser.ray_list().context("the settings ask for no ray list")?;
        let mut encoder = self.encoder();
        let rays = self.readback_buffer(list.rays.size());
        let count = self.readback_buffer(4);
        encoder.copy_buffer_to_buffer(list.rays, 0, &rays, 0, rays.size());
        encoder.copy_buffer_to_buffer(list.args, list.args_offset + 12, &count, 0, 4);
        self.queue.submit([encoder.finish()]);
        let count: Vec<u32> = bytemuck::pod_collect_to_vec(&self.read(&count)?);
        let words: Vec<u32> = bytemuck::pod_collect_to_vec(&self.read(&rays)?);
        Ok(words.into_iter().take(count[0] as usize).map(ListedRay::unpack).collect())
    }

    /// The first three channels and the fourth.
    fn read_halves(&self, texture: &wgpu::Texture, size: UVec2) -> Result<(Vec<[f32; 3]>, Vec<f32>)> {
        let mut encoder = self.encoder();
        let row = (size.x * 8).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = self.readback_buffer(u64::from(row) * u64::from(size.y));
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None };
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo { buffer: &buffer, layout },
            wgpu::Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 },
        );
        self.queue.submit([encoder.finish()]);
        let bytes = self.read(&buffer)?;
        let rows = bytes.chunks_exact(row as usize);
        let texels = rows.flat_map(|row| bytemuck::pod_collect_to_vec::<u8, [f16; 4]>(&row[..size.x as usize * 8]));
        Ok(split(texels))
    }

    fn read_times(&self) -> Result<Vec<(String, Duration)>> {
        let (sender, receiver) = mpsc::channel();
        self.denoiser.read_times(move |times: Vec<PassTime>| {
            // Nobody listens any more once waiting has failed.
            let _ = sender.send(times);
        });
        self.wait()?;
        let times = receiver.try_recv().unwrap_or_default();
        Ok(times.into_iter().map(|time| (time.pass, time.duration)).collect())
    }
}

impl Backend for Gpu {
    fn device(&self) -> &str {
        &self.description
    }

    fn plan(&self) -> &Plan {
        self.denoiser.plan()
    }

    fn denoise(&mut self, frame: &Frame, exposure: f32, tracer: Option<Tracer<'_>>) -> Result<Denoised> {
        let mut inputs = FrameInputs::new(frame.camera, frame.size);
        inputs.reset = frame.reset;
        inputs.frame_seconds = frame.seconds;
        inputs.exposure = exposure;
        self.images.advance();
        self.upload_gbuffer(frame)?;
        if tracer.is_none() {
            self.upload_radiance(frame.size, &frame.radiance);
        }
        let mut encoder = self.encoder();
        self.denoiser.encode_classify(&self.queue, &mut encoder, &self.images.inputs(), &inputs)?;
        let mut rays = frame.depth.iter().filter(|depth| **depth > 0.0).count() as u64;
        let (mut time, mut cpu_time) = (Duration::ZERO, Duration::ZERO);
        let mut traced = None;
        if let Some(tracer) = tracer {
            self.run(encoder, &mut time, &mut cpu_time)?;
            let listed = self.classified_rays()?;
            rays = listed.len() as u64;
            let radiance = trace_listed(&listed, frame.size, tracer);
            self.upload_radiance(frame.size, &radiance);
            traced = Some(radiance);
            encoder = self.encoder();
        }
        self.denoiser.encode_denoise(&mut encoder, &self.images.inputs())?;
        self.run(encoder, &mut time, &mut cpu_time)?;
        let (radiance, variance) = self.read_halves(self.denoiser.output_texture(), frame.size)?;
        let view = self.denoiser.debug_view_texture();
        let debug_view = view.map(|texture| anyhow::Ok(self.read_halves(texture, frame.size)?.0)).transpose()?;
        let pass_times = self.read_times()?;
        Ok(Denoised { radiance, variance, debug_view, time, cpu_time, pass_times, rays, traced })
    }
}
