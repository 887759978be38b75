use std::sync::{Arc, Mutex, mpsc};

use glam::UVec2;
use limpid::{FrameInputs, Settings};
use limpid_wgpu::{Denoiser, Inputs, Options, PrevGbuffer};

use super::Executor;
use crate::{Image, Snapshot, TexelFormat};

/// The wgpu backend on a Vulkan device.
pub struct Wgpu {
    device_name: String,
    device: wgpu::Device,
    queue: wgpu::Queue,
    denoiser: Option<Denoiser>,
    errors: Arc<Mutex<Vec<String>>>,
}

impl Wgpu {
    /// The device of that name, if wgpu can use it.
    pub fn open(device_name: &str) -> Option<Self> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
        let adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::VULKAN));
        let adapter = adapters.into_iter().find(|adapter| adapter.get_info().name == device_name)?;
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor::default())).ok()?;
        let errors = Arc::new(Mutex::new(Vec::new()));
        let log = Arc::clone(&errors);
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| log.lock().unwrap().push(error.to_string())));
        Some(Self { device_name: device_name.to_owned(), device, queue, denoiser: None, errors })
    }

    fn upload(&self, image: &Image) -> wgpu::TextureView {
        let format = match image.format {
            TexelFormat::Rgba16Float => wgpu::TextureFormat::Rgba16Float,
            TexelFormat::Rgba32Float => wgpu::TextureFormat::Rgba32Float,
            TexelFormat::R32Float => wgpu::TextureFormat::R32Float,
            TexelFormat::Rg32Float => wgpu::TextureFormat::Rg32Float,
        };
        let texture = self.device.create_texture(&wgpu::TextureDescriptor {
            label: Some(image.name),
            size: wgpu::Extent3d { width: image.size.x, height: image.size.y, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let bytes_per_row = Some(image.words.len() as u32 * 4 / image.size.y);
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row, rows_per_image: None };
        self.queue.write_texture(texture.as_image_copy(), bytemuck::cast_slice(&image.words), layout, texture.size());
        texture.create_view(&wgpu::TextureViewDescriptor::default())
    }

    /// Runs a copy into a buffer of that size and returns its bytes.
    fn read(&self, size: u64, copy: impl FnOnce(&mut wgpu::CommandEncoder, &wgpu::Buffer)) -> Vec<u8> {
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size,
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        copy(&mut encoder, &buffer);
        self.queue.submit([encoder.finish()]);
        let (sender, receiver) = mpsc::channel();
        buffer.map_async(wgpu::MapMode::Read, .., move |result| sender.send(result).unwrap());
        self.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        receiver.recv().unwrap().unwrap();
        buffer.get_mapped_range(..).unwrap().to_vec()
    }

    fn read_texture(&self, texture: &wgpu::Texture) -> Vec<u32> {
        let row = texture.width() * texture.format().block_copy_size(None).unwrap();
        let padded = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let bytes = self.read(u64::from(padded) * u64::from(texture.height()), |encoder, buffer| {
            let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(padded), rows_per_image: None };
            let target = wgpu::TexelCopyBufferInfo { buffer, layout };
            encoder.copy_texture_to_buffer(texture.as_image_copy(), target, texture.size());
        });
        let rows = bytes.chunks_exact(padded as usize);
        rows.flat_map(|bytes| bytemuck::pod_collect_to_vec::<u8, u32>(&bytes[..row as usize])).collect()
    }

    fn read_buffer(&self, source: &wgpu::Buffer) -> Vec<u32> {
        let size = source.size();
        let bytes = self.read(size, |encoder, buffer| encoder.copy_buffer_to_buffer(source, 0, buffer, 0, size));
        bytemuck::pod_collect_to_vec(&bytes)
    }
}

impl Executor for Wgpu {
    fn backend(&self) -> &'static str {
        "wgpu"
    }

    fn device(&self) -> &str {
        &self.device_name
    }

    fn start(&mut self, core: limpid::Denoiser) {
        let options = Options { readable_intermediates: true, ..Default::default() };
        self.denoiser = Some(Denoiser::with_core(&self.device, core, options).unwrap());
    }

    fn resize(&mut self, size: UVec2) {
        self.denoiser.as_mut().unwrap().resize(size).unwrap();
    }

    fn set_settings(&mut self, settings: &Settings) {
        self.denoiser.as_mut().unwrap().set_settings(settings).unwrap();
    }

    fn frame(&mut self, images: &[Image], frame: &FrameInputs) -> Snapshot {
        let views: Vec<_> = images.iter().map(|image| (image.name, self.upload(image))).collect();
        let find = |name| &views.iter().find(|(n, _)| *n == name).unwrap().1;
        let inputs = Inputs {
            radiance: find("radiance"),
            normal: find("normal"),
            roughness: find("roughness"),
            depth: find("depth"),
            motion: find("motion"),
            hit_motion: Some(find("hit_motion")),
            environment: Some(find("environment")),
            previous: Some(PrevGbuffer {
                normal: find("prev_normal"),
                roughness: find("prev_roughness"),
                depth: find("prev_depth"),
            }),
        };
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let mut denoiser = self.denoiser.take().unwrap();
        denoiser.encode(&self.queue, &mut encoder, &inputs, frame).unwrap();
        self.queue.submit([encoder.finish()]);
        let snapshot = Snapshot::take(
            denoiser.plan(),
            frame.size,
            |_| true,
            |name, copy| self.read_texture(denoiser.intermediate_texture(name, copy).unwrap()),
            |name| self.read_buffer(denoiser.intermediate_buffer(name).unwrap()),
        );
        self.denoiser = Some(denoiser);
        let errors = self.errors.lock().unwrap();
        assert!(errors.is_empty(), "{}", errors.join("\n"));
        snapshot
    }
}
