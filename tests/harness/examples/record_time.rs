//! How long it takes the CPU to record a frame with wgpu and with ash, in one run on one device.
//!
//! `cargo run --release -p limpid-harness --example record_time`

use std::rc::Rc;
use std::time::{Duration, Instant};

use glam::UVec2;
use limpid::{FrameInputs, Settings};
use limpid_ash::ash::vk::Format;
use limpid_ash::offscreen::{Context, ContextOptions, UploadedImage};
use limpid_harness::Case;

const SIZE: UVec2 = UVec2::new(64, 64);
const FRAMES: usize = 400;

type Failure = Box<dyn std::error::Error>;

fn median(mut times: Vec<Duration>) -> f64 {
    times.sort_unstable();
    times[times.len() / 2].as_secs_f64() * 1e6
}

fn with_ash(settings: &Settings, frame: &FrameInputs) -> Result<(f64, limpid_ash::Recorded, u64, u64), Failure> {
    let context = Rc::new(Context::open(&ContextOptions::default())?);
    println!("{}", context.name());
    let image = |format, bytes: usize| {
        UploadedImage::new(&context, format, SIZE, &vec![0; bytes * SIZE.element_product() as usize])
    };
    let (wide, single) = (image(Format::R32G32B32A32_SFLOAT, 16)?, image(Format::R32_SFLOAT, 4)?);
    let inputs = limpid_ash::Inputs {
        radiance: wide.input(),
        normal: wide.input(),
        roughness: single.input(),
        depth: single.input(),
        motion: wide.input(),
        hit_motion: None,
        environment: None,
        previous: None,
    };
    let options = limpid_ash::Options { synchronization: context.synchronization(), ..limpid_ash::Options::default() };
    // SAFETY: the context's handles belong together and outlive the denoiser.
    let mut denoiser = unsafe { limpid_ash::Denoiser::new(context.gpu(), context.memory(), settings, SIZE, options) }?;
    let mut times = Vec::new();
    for _ in 0..FRAMES {
        times.push(context.run(|commands| {
            let start = Instant::now();
            // SAFETY: `run` records, submits and waits; uploading left the images readable.
            unsafe { denoiser.record(commands, &inputs, frame) }?;
            Ok(start.elapsed())
        })?);
    }
    let memory = denoiser.plan().memory().total();
    Ok((median(times), denoiser.recorded(), denoiser.allocated_bytes(), memory))
}

fn with_wgpu(settings: &Settings, frame: &FrameInputs) -> Result<f64, Failure> {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::VULKAN;
    let instance = wgpu::Instance::new(descriptor);
    let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()))?;
    let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor::default()))?;
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width: SIZE.x, height: SIZE.y, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba32Float,
        usage: wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    });
    let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
    let inputs = limpid_wgpu::Inputs {
        radiance: &view,
        normal: &view,
        roughness: &view,
        depth: &view,
        motion: &view,
        hit_motion: None,
        environment: None,
        previous: None,
    };
    let mut denoiser = limpid_wgpu::Denoiser::new(&device, settings, SIZE, limpid_wgpu::Options::default())?;
    let mut times = Vec::new();
    for _ in 0..FRAMES {
        let start = Instant::now();
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        denoiser.encode(&queue, &mut encoder, &inputs, frame)?;
        let commands = encoder.finish();
        times.push(start.elapsed());
        queue.submit([commands]);
        device.poll(wgpu::PollType::wait_indefinitely())?;
    }
    Ok(median(times))
}

fn main() -> Result<(), Failure> {
    let settings = Settings::default();
    let frame = FrameInputs::new(Case::camera(SIZE), SIZE);
    let (ash, recorded, allocated, planned) = with_ash(&settings, &frame)?;
    let wgpu = with_wgpu(&settings, &frame)?;
    println!("{recorded:?}");
    println!("ash {ash:.1} us a frame, wgpu {wgpu:.1} us: wgpu takes {:.1} times as long", wgpu / ash);
    println!("{allocated} bytes allocated through ash, {planned} by the plan");
    Ok(())
}
