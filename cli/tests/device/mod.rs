//! A device to run tests on.

use std::io::Write;
use std::sync::mpsc;

use glam::UVec2;

/// A device of wgpu, if there is one.
pub(crate) struct Device {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
}

impl Device {
    pub(crate) fn open() -> Option<Self> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
        let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()));
        let adapter = match adapter {
            Ok(adapter) => adapter,
            Err(error) => {
                assert!(std::env::var_os("LIMPID_REQUIRE_DEVICE").is_none(), "{error}");
                // Past the harness, which keeps to itself what a passing test prints.
                let _ = writeln!(std::io::stderr(), "SKIPPED: {error}");
                return None;
            }
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor::default())).unwrap();
        Some(Self { device, queue })
    }

    /// An image as a texture.
    pub(crate) fn upload(&self, size: UVec2, format: wgpu::TextureFormat, words: &[u32]) -> wgpu::TextureView {
        let texture = self.device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let bytes_per_row = Some(words.len() as u32 * 4 / size.y);
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row, rows_per_image: None };
        self.queue.write_texture(texture.as_image_copy(), bytemuck::cast_slice(words), layout, texture.size());
        texture.create_view(&wgpu::TextureViewDescriptor::default())
    }

    /// The texels of a texture.
    pub(crate) fn words(&self, texture: &wgpu::Texture) -> Vec<u32> {
        let row = texture.width() * texture.format().block_copy_size(None).unwrap();
        let padded = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(padded) * u64::from(texture.height()),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(padded), rows_per_image: None };
        let target = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
        encoder.copy_texture_to_buffer(texture.as_image_copy(), target, texture.size());
        self.queue.submit([encoder.finish()]);
        let (sender, receiver) = mpsc::channel();
        buffer.map_async(wgpu::MapMode::Read, .., move |result| sender.send(result).unwrap());
        self.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        receiver.recv().unwrap().unwrap();
        let bytes = buffer.get_mapped_range(..).unwrap().to_vec();
        bytes
            .chunks_exact(padded as usize)
            .flat_map(|r| bytemuck::pod_collect_to_vec::<u8, u32>(&r[..row as usize]))
            .collect()
    }
}
