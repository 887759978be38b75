//! The least a wgpu renderer needs: a device, five textures, a denoiser, and one call a frame.
//!
//! `cargo run --release -p limpid-wgpu --example minimal` denoises a noisy wall and prints what was
//! allocated and dispatched for it.

use glam::{Mat4, UVec2, Vec2, camera::rh};
use half::f16;
use limpid::{Camera, FrameInputs, Settings, settings::DepthEncoding};
use limpid_wgpu::{Denoiser, Inputs, Options};
use wgpu::TextureFormat::{R32Float, Rg32Float, Rgba16Float, Rgba32Float};

const SIZE: UVec2 = UVec2::new(256, 256);

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()))?;
    let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor::default()))?;

    // What your renderer has: here a wall 2 units away, roughness 0.3, nothing moves.
    let radiance = texture(&device, Rgba16Float);
    let (normal, roughness) = (texture(&device, Rgba32Float), texture(&device, R32Float));
    let (depth, motion) = (texture(&device, R32Float), texture(&device, Rg32Float));
    upload(&queue, &normal, &[0.0f32, 0.0, 1.0, 0.0]);
    upload(&queue, &roughness, &[0.3f32]);
    upload(&queue, &depth, &[2.0f32]);
    upload(&queue, &motion, &[0.0f32, 0.0]);
    let views = [&radiance, &normal, &roughness, &depth, &motion].map(|t| t.create_view(&Default::default()));
    let [radiance_view, normal, roughness, depth, motion] = &views;
    let inputs = Inputs {
        radiance: radiance_view,
        normal,
        roughness,
        depth,
        motion,
        hit_motion: None,
        environment: None,
        previous: None,
    };

    let mut settings = Settings::default();
    settings.conventions.depth = DepthEncoding::Linear;
    let mut denoiser = Denoiser::new(&device, &settings, SIZE, Options::default())?;
    let view_to_clip = rh::proj::directx::perspective(1.0, 1.0, 0.1, 100.0);
    let camera = Camera { world_to_view: Mat4::IDENTITY, view_to_clip, jitter: Vec2::ZERO };

    for frame in 0..32u32 {
        let seed = |pixel: u32| (pixel ^ frame.wrapping_mul(0x9e37_79b9)).wrapping_mul(0x85eb_ca6b);
        let noisy: Vec<f16> = (0..SIZE.element_product())
            .flat_map(|pixel| {
                let hash = (seed(pixel) ^ seed(pixel) >> 13).wrapping_mul(0xc2b2_ae35);
                let value = f16::from_f32((hash >> 8) as f32 / (1 << 24) as f32);
                [value, value, value, f16::from_f32(3.0)]
            })
            .collect();
        upload(&queue, &radiance, &noisy);
        let mut encoder = device.create_command_encoder(&Default::default());
        denoiser.encode(&queue, &mut encoder, &inputs, &FrameInputs::new(camera, SIZE))?;
        queue.submit([encoder.finish()]);
    }
    let _shade_with: &wgpu::TextureView = denoiser.output();
    println!("{}", denoiser.plan());
    Ok(())
}

fn texture(device: &wgpu::Device, format: wgpu::TextureFormat) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width: SIZE.x, height: SIZE.y, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    })
}

/// Repeats `texels` until the texture is full.
fn upload<T: bytemuck::NoUninit>(queue: &wgpu::Queue, texture: &wgpu::Texture, texels: &[T]) {
    let bytes_per_texel = texture.format().block_copy_size(None).unwrap_or(0) as usize;
    let bytes = bytemuck::cast_slice::<T, u8>(texels)
        .repeat(bytes_per_texel * SIZE.element_product() as usize / size_of_val(texels));
    let layout = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some(bytes_per_texel as u32 * SIZE.x),
        rows_per_image: None,
    };
    queue.write_texture(texture.as_image_copy(), &bytes, layout, texture.size());
}
