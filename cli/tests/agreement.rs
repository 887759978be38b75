//! The CPU and a device give the same, resource by resource, over the built-in scenes.

use std::collections::BTreeMap;

use glam::UVec2;
use half::f16;
use limpid::resource::{Copy, Format, Kind};
use limpid::settings::DepthEncoding;
use limpid::{FrameInputs, Plan, Settings};
use limpid_cli::scene;
use limpid_cli::sequence::Frame;
use limpid_cpu::{TexelFormat, Texture};

mod device;
use device::Device;

const SIZE: UVec2 = UVec2::new(120, 68);
const FRAMES: u32 = 6;

/// The images of a frame as words, with their formats: (device, CPU).
fn images(frame: &Frame) -> Vec<(wgpu::TextureFormat, TexelFormat, Vec<u32>)> {
    let half_words = |texel: &[f32; 4]| {
        let half = |value: f32| u32::from(f16::from_f32(value).to_bits());
        [half(texel[0]) | half(texel[1]) << 16, half(texel[2]) | half(texel[3]) << 16]
    };
    let bits = |values: &[f32]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
    let normals: Vec<f32> = frame.normal.iter().flat_map(|&[x, y, z]| [x, y, z, 0.0]).collect();
    let radiance = frame.radiance.iter().flat_map(half_words).collect();
    vec![
        (wgpu::TextureFormat::Rgba16Float, TexelFormat::Rgba16Float, radiance),
        (wgpu::TextureFormat::Rgba32Float, TexelFormat::Rgba32Float, bits(&normals)),
        (wgpu::TextureFormat::R32Float, TexelFormat::R32Float, bits(&frame.roughness)),
        (wgpu::TextureFormat::R32Float, TexelFormat::R32Float, bits(&frame.depth)),
        (wgpu::TextureFormat::Rg32Float, TexelFormat::Rg32Float, bits(frame.motion.as_flattened())),
    ]
}

/// Agreement of one resource.
#[derive(Default)]
struct Agreement {
    values: usize,
    identical: usize,
    /// Sum of differences, in steps of a half float.
    steps: f64,
    largest: u32,
    /// Values that differ by more than two steps.
    far: usize,
}

/// Half floats as integers in their order.
fn ordered(bits: u16) -> i32 {
    let magnitude = i32::from(bits & 0x7fff);
    if bits & 0x8000 == 0 { magnitude } else { -magnitude }
}

impl Agreement {
    fn add(&mut self, a: u32, b: u32) {
        for shift in [0, 16] {
            let (a, b) = ((a >> shift) as u16, (b >> shift) as u16);
            let steps = ordered(a).abs_diff(ordered(b));
            self.values += 1;
            self.identical += usize::from(steps == 0);
            self.steps += f64::from(steps);
            self.largest = self.largest.max(steps);
            self.far += usize::from(steps > 2);
        }
    }
}

fn compare(
    plan: &Plan,
    device: &Device,
    gpu: &limpid_wgpu::Denoiser,
    cpu: &limpid_cpu::Denoiser,
    into: &mut BTreeMap<String, Agreement>,
) {
    for resource in &plan.resources {
        let Kind::Texture { format, .. } = resource.kind else { continue };
        let copies: &[Copy] = if resource.ping_pong { &[Copy::Current, Copy::Previous] } else { &[Copy::Current] };
        for &copy in copies {
            let a = device.words(gpu.intermediate_texture(&resource.name, copy).unwrap());
            let b = cpu.intermediate_texture(&resource.name, copy).unwrap().read();
            assert_eq!(a.len(), b.len());
            let agreement = into.entry(format!("{} {copy:?} {format:?}", resource.name)).or_default();
            for (index, (a, b)) in a.into_iter().zip(b).enumerate() {
                match (resource.name.as_str(), format, copy) {
                    // A guide holds a float and integers: whole words count.
                    ("guide", ..) => agreement.add(u32::from(a != b), 0),
                    // The upper half of the second word holds length and variance in 8 bits each.
                    ("signal", Format::Rg32Uint, Copy::Current) if index % 2 == 1 => {
                        agreement.add(a & 0xffff, b & 0xffff)
                    }
                    _ => agreement.add(a, b),
                }
            }
        }
    }
}

#[test]
fn the_cpu_and_a_device_agree_in_every_resource() {
    let Some(device) = Device::open() else { return };
    let mut settings = Settings::default();
    settings.conventions.depth = DepthEncoding::Linear;
    let mut table = BTreeMap::new();
    for name in ["gallery", "courtyard", "mirrors", "dolly"] {
        let scene = scene::by_name(name).unwrap();
        let options = limpid_wgpu::Options { readable_intermediates: true, ..Default::default() };
        let mut gpu = limpid_wgpu::Denoiser::new(&device.device, &settings, SIZE, options).unwrap();
        let mut cpu = limpid_cpu::Denoiser::new(&settings, SIZE).unwrap();
        for number in 0..FRAMES {
            let frame = scene.render(number, SIZE, 0);
            let mut inputs = FrameInputs::new(frame.camera, SIZE);
            inputs.reset = frame.reset;
            let images = images(&frame);
            let views: Vec<_> = images.iter().map(|(format, _, words)| device.upload(SIZE, *format, words)).collect();
            let textures: Vec<_> = images
                .into_iter()
                .map(|(_, format, words)| {
                    let mut texture = Texture::new(format, SIZE.x, SIZE.y);
                    texture.write(words);
                    texture
                })
                .collect();
            let [radiance, normal, roughness, depth, motion] = &views[..] else { panic!("five images") };
            let on_device = limpid_wgpu::Inputs { radiance, normal, roughness, depth, motion, environment: None };
            let mut encoder = device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            gpu.encode(&device.queue, &mut encoder, &on_device, &inputs).unwrap();
            device.queue.submit([encoder.finish()]);
            let [radiance, normal, roughness, depth, motion] = &textures[..] else { panic!("five images") };
            let in_memory = limpid_cpu::Inputs { radiance, normal, roughness, depth, motion, environment: None };
            cpu.denoise(&in_memory, &inputs).unwrap();
            compare(&gpu.plan().clone(), &device, &gpu, &cpu, &mut table);
        }
    }
    println!("{:<32}{:>10}{:>10}{:>12}{:>10}", "resource", "identical", "mean", "largest", "above 2");
    for (name, a) in &table {
        let share = |count: usize| 100.0 * count as f64 / a.values as f64;
        let (identical, far) = (share(a.identical), share(a.far));
        println!("{name:<32}{identical:>9.3}%{:>10.5}{:>12}{far:>9.4}%", a.steps / a.values as f64, a.largest);
    }
    for (name, a) in &table {
        // Exponentials, logarithms and roots differ by a few units in the last place between implementations,
        // which turns into a step of a half float now and then, and flips a decision at a threshold now and then.
        assert!(a.identical as f64 > 0.99 * a.values as f64, "{name}");
        assert!((a.far as f64) < 0.0015 * a.values as f64, "{name}");
    }
}
