//! A device, scenes as plain vectors, and denoised frames read back as plain vectors.

#![allow(dead_code, reason = "each test file uses a part of it")]

use std::io::Write;
use std::sync::{Arc, Mutex, mpsc};

use glam::{Mat4, UVec2, Vec2, Vec3, camera::rh};
use half::f16;
use limpid::resource::Copy;
use limpid::settings::DepthEncoding;
use limpid::{Camera, FrameInputs, Preset, Settings};
use limpid_wgpu::{Denoiser, Inputs, Options};
use wgpu::TextureFormat::{R32Float, Rg32Float, Rgba32Float};

/// One half-float step, relative: what one rounding of a stored value can cost. Drivers may round towards zero.
pub(crate) const HALF_STEP: f32 = 1.0 / 1024.0;

/// A device with default WebGPU limits. A test fails at its end when anything was not valid.
pub(crate) struct Gpu {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    errors: Arc<Mutex<Vec<String>>>,
}

impl Gpu {
    pub(crate) fn open() -> Option<Self> {
        Self::open_with(wgpu::Features::empty())
    }

    /// `None`, with the reason on stderr, where there is no such device.
    pub(crate) fn open_with(features: wgpu::Features) -> Option<Self> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
        let opened = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()))
            .map_err(|error| error.to_string())
            .and_then(|adapter| {
                let descriptor = wgpu::DeviceDescriptor {
                    required_features: features,
                    required_limits: wgpu::Limits::default(),
                    ..Default::default()
                };
                pollster::block_on(adapter.request_device(&descriptor)).map_err(|error| error.to_string())
            });
        match opened {
            Ok((device, queue)) => {
                let errors = Arc::new(Mutex::new(Vec::new()));
                let log = Arc::clone(&errors);
                device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
                    log.lock().unwrap().push(error.to_string());
                }));
                Some(Self { device, queue, errors })
            }
            Err(reason) => {
                assert!(std::env::var_os("LIMPID_REQUIRE_DEVICE").is_none(), "{reason}");
                // Past the harness, which keeps to itself what a passing test prints.
                let _ = writeln!(std::io::stderr(), "SKIPPED: {reason}");
                None
            }
        }
    }

    pub(crate) fn texture(
        &self,
        size: UVec2,
        format: wgpu::TextureFormat,
        usage: wgpu::TextureUsages,
        change: impl FnOnce(&mut wgpu::TextureDescriptor<'_>),
    ) -> wgpu::Texture {
        let mut descriptor = wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage,
            view_formats: &[],
        };
        change(&mut descriptor);
        self.device.create_texture(&descriptor)
    }

    pub(crate) fn write_level<T: bytemuck::NoUninit>(
        &self,
        texture: &wgpu::Texture,
        level: u32,
        size: UVec2,
        texels: &[T],
    ) {
        self.queue.write_texture(
            wgpu::TexelCopyTextureInfo { mip_level: level, ..texture.as_image_copy() },
            bytemuck::cast_slice(texels),
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(size_of_val(texels) as u32 / size.y),
                rows_per_image: None,
            },
            wgpu::Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 },
        );
    }

    pub(crate) fn upload<T: bytemuck::NoUninit>(
        &self,
        size: UVec2,
        format: wgpu::TextureFormat,
        texels: &[T],
    ) -> wgpu::TextureView {
        let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST;
        let texture = self.texture(size, format, usage, |_| ());
        self.write_level(&texture, 0, size, texels);
        texture.create_view(&wgpu::TextureViewDescriptor::default())
    }

    pub(crate) fn encoder(&self) -> wgpu::CommandEncoder {
        self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default())
    }

    fn readback(&self, size: u64) -> wgpu::Buffer {
        self.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size,
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        })
    }

    pub(crate) fn wait(&self) {
        self.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
    }

    fn map(&self, buffer: &wgpu::Buffer) -> Vec<u8> {
        let (sender, receiver) = mpsc::channel();
        buffer.map_async(wgpu::MapMode::Read, .., move |result| sender.send(result).unwrap());
        self.wait();
        receiver.recv().unwrap().unwrap();
        buffer.get_mapped_range(..).unwrap().to_vec()
    }

    /// Words of a buffer after everything that was submitted.
    pub(crate) fn read_words(&self, buffer: &wgpu::Buffer) -> Vec<u32> {
        let copy = self.readback(buffer.size());
        let mut encoder = self.encoder();
        encoder.copy_buffer_to_buffer(buffer, 0, &copy, 0, buffer.size());
        self.queue.submit([encoder.finish()]);
        bytemuck::pod_collect_to_vec(&self.map(&copy))
    }

    /// Records a copy of a texture with 8 bytes a texel, to be read once it was submitted.
    pub(crate) fn copy_out(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        texture: &wgpu::Texture,
        size: UVec2,
    ) -> TextureCopy {
        let row = (size.x * 8).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = self.readback(u64::from(row * size.y));
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None },
            },
            wgpu::Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 },
        );
        TextureCopy { buffer, row, size }
    }

    pub(crate) fn read_texels<T: bytemuck::Pod>(&self, copy: &TextureCopy) -> Vec<T> {
        let bytes = self.map(&copy.buffer);
        let rows = bytes.chunks_exact(copy.row as usize);
        rows.flat_map(|row| bytemuck::pod_collect_to_vec::<u8, T>(&row[..copy.size.x as usize * 8])).collect()
    }
}

impl Drop for Gpu {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            let errors = self.errors.lock().unwrap();
            assert!(errors.is_empty(), "the device reported errors:\n{}", errors.join("\n"));
        }
    }
}

pub(crate) struct TextureCopy {
    buffer: wgpu::Buffer,
    row: u32,
    size: UVec2,
}

/// Default settings for linear depth.
pub(crate) fn linear_settings() -> Settings {
    let mut settings = Settings::default();
    settings.conventions.depth = DepthEncoding::Linear;
    settings
}

/// The same for the published pipeline, which denoises all surfaces.
pub(crate) fn published_settings() -> Settings {
    let mut settings = linear_settings();
    settings.pipeline = Preset::Reference.settings().pipeline;
    settings
}

/// Both.
pub(crate) fn pipelines() -> [Settings; 2] {
    [linear_settings(), published_settings()]
}

/// Settings with history found by motion vectors alone and whatever its colour, for each pixel.
pub(crate) fn by_motion_only(mut settings: Settings) -> Settings {
    settings.features.mirror_parallax = false;
    settings.features.light_change = false;
    settings.features.whole_blocks = false;
    settings.reproject.surface_color_gate = 10_000.0;
    settings
}

/// At the origin, looking along -z.
pub(crate) fn still_camera(size: UVec2) -> Camera {
    let aspect = size.x as f32 / size.y as f32;
    let view_to_clip = rh::proj::directx::perspective(1.0, aspect, 0.1, 500.0);
    Camera { world_to_view: Mat4::IDENTITY, view_to_clip, jitter: Vec2::ZERO }
}

pub(crate) fn still_frame(size: UVec2) -> FrameInputs {
    FrameInputs::new(still_camera(size), size)
}

/// Repeatable noise, uniform in 0 to 1.
pub(crate) fn noise(seed: u32, p: UVec2) -> f32 {
    let mut state = seed.wrapping_mul(0x9e37_79b9) ^ p.x.wrapping_mul(0x85eb_ca6b) ^ p.y.wrapping_mul(0xc2b2_ae35);
    for _ in 0..3 {
        state = (state ^ (state >> 15)).wrapping_mul(0x2c1b_3c6d).rotate_left(11);
    }
    (state >> 8) as f32 / (1 << 24) as f32
}

/// Where in its pixel a jittered camera samples.
pub(crate) fn jitter_of(frame: u32) -> Vec2 {
    Vec2::new(noise(1, UVec2::splat(frame)), noise(2, UVec2::splat(frame))) - 0.5
}

/// What the textures of a scene hold at a pixel, as they hold it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pixel {
    pub(crate) radiance: Vec3,
    pub(crate) hit_distance: f32,
    pub(crate) normal: Vec3,
    pub(crate) roughness: f32,
    pub(crate) depth: f32,
    pub(crate) motion: Vec2,
}

/// A rough white wall, 4 units away, that faces the camera.
pub(crate) const WALL: Pixel =
    Pixel { radiance: Vec3::ONE, hit_distance: 0.0, normal: Vec3::Z, roughness: 0.8, depth: 4.0, motion: Vec2::ZERO };

/// No surface, in linear depth.
pub(crate) const SKY: Pixel = Pixel { depth: 0.0, ..WALL };

/// Nothing in it can be used.
pub(crate) const POISON: Pixel = Pixel {
    radiance: Vec3::NAN,
    hit_distance: f32::NAN,
    normal: Vec3::NAN,
    roughness: f32::NAN,
    depth: f32::NAN,
    motion: Vec2::NAN,
};

/// The images of a frame, and which channel holds the roughness: the others hold NaN.
#[derive(Debug, Clone)]
pub(crate) struct Scene {
    pub(crate) size: UVec2,
    pub(crate) pixels: Vec<Pixel>,
    pub(crate) roughness_channel: usize,
}

/// Those images on the device.
#[derive(Clone)]
pub(crate) struct Images {
    pub(crate) radiance: wgpu::TextureView,
    pub(crate) normal: wgpu::TextureView,
    pub(crate) roughness: wgpu::TextureView,
    pub(crate) depth: wgpu::TextureView,
    pub(crate) motion: wgpu::TextureView,
    pub(crate) hit_motion: Option<wgpu::TextureView>,
    pub(crate) environment: Option<wgpu::TextureView>,
}

impl Images {
    pub(crate) fn inputs(&self) -> Inputs<'_> {
        Inputs {
            radiance: &self.radiance,
            normal: &self.normal,
            roughness: &self.roughness,
            depth: &self.depth,
            motion: &self.motion,
            hit_motion: self.hit_motion.as_ref(),
            environment: self.environment.as_ref(),
            previous: None,
        }
    }
}

/// Every position of an image, row by row.
pub(crate) fn positions(size: UVec2) -> impl Iterator<Item = UVec2> + Clone {
    (0..size.y).flat_map(move |y| (0..size.x).map(move |x| UVec2::new(x, y)))
}

impl Scene {
    pub(crate) fn new(size: UVec2, pixel: impl FnMut(UVec2) -> Pixel) -> Self {
        Self { size, pixels: positions(size).map(pixel).collect(), roughness_channel: 0 }
    }

    /// A wall with a texture of low contrast, that noise of low contrast changes every frame.
    pub(crate) fn noisy_wall(size: UVec2, seed: u32) -> Self {
        Self::new(size, |p| {
            let shade = |channel| 0.7 + 0.3 * noise(7 + channel, p / 4) + 0.3 * noise(seed * 3 + 100 + channel, p);
            Pixel { radiance: Vec3::new(shade(0), shade(1), shade(2)), ..WALL }
        })
    }

    pub(crate) fn at(&mut self, p: UVec2) -> &mut Pixel {
        &mut self.pixels[(p.y * self.size.x + p.x) as usize]
    }

    /// The same frame at the top left of larger images that hold `rest` elsewhere.
    pub(crate) fn inside(&self, allocated: UVec2, rest: Pixel) -> Self {
        let pixel = |p: UVec2| if p.cmplt(self.size).all() { self.pixel_at(p) } else { rest };
        Self { roughness_channel: self.roughness_channel, ..Self::new(allocated, pixel) }
    }

    fn pixel_at(&self, p: UVec2) -> Pixel {
        self.pixels[(p.y * self.size.x + p.x) as usize]
    }

    pub(crate) fn upload(&self, gpu: &Gpu) -> Images {
        fn each<T>(pixels: &[Pixel], texel: impl Fn(&Pixel) -> T) -> Vec<T> {
            pixels.iter().map(texel).collect()
        }
        let roughness = |p: &Pixel| {
            let mut texel = [f32::NAN; 4];
            texel[self.roughness_channel] = p.roughness;
            texel
        };
        Images {
            radiance: gpu.upload(
                self.size,
                Rgba32Float,
                &each(&self.pixels, |p| p.radiance.extend(p.hit_distance).to_array()),
            ),
            normal: gpu.upload(self.size, Rgba32Float, &each(&self.pixels, |p| p.normal.extend(f32::NAN).to_array())),
            roughness: gpu.upload(self.size, Rgba32Float, &each(&self.pixels, roughness)),
            depth: gpu.upload(self.size, R32Float, &each(&self.pixels, |p| p.depth)),
            motion: gpu.upload(self.size, Rg32Float, &each(&self.pixels, |p| p.motion.to_array())),
            hit_motion: None,
            environment: None,
        }
    }
}

/// A frame as the denoiser left it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Denoised {
    pub(crate) size: UVec2,
    /// `rgb`: radiance, `a`: variance.
    pub(crate) output: Vec<[f32; 4]>,
    /// Radiance that was found in history; in the footprint pipeline, with this frame's added to it.
    pub(crate) found: Vec<[f32; 3]>,
    /// Radiance that the next frame finds.
    pub(crate) kept: Vec<[f32; 3]>,
    /// Frames that the history holds.
    pub(crate) length: Vec<f32>,
}

impl Denoised {
    pub(crate) fn index(&self, p: UVec2) -> usize {
        (p.y * self.size.x + p.x) as usize
    }

    pub(crate) fn radiance(&self, p: UVec2) -> Vec3 {
        let [r, g, b, _] = self.output[self.index(p)];
        Vec3::new(r, g, b)
    }

    pub(crate) fn length_at(&self, p: UVec2) -> f32 {
        self.length[self.index(p)]
    }

    /// Fails unless every number is finite and not negative, and variance at most 1.
    pub(crate) fn assert_usable(&self, what: &str) {
        for (p, texel) in positions(self.size).zip(&self.output) {
            let usable = texel.iter().all(|x| x.is_finite() && *x >= 0.0) && texel[3] <= 1.0;
            assert!(usable, "{what}: output {texel:?} at {p}");
        }
    }
}

/// A denoiser and what it takes to read its results.
pub(crate) struct Run<'g> {
    pub(crate) gpu: &'g Gpu,
    pub(crate) denoiser: Denoiser,
}

impl<'g> Run<'g> {
    pub(crate) fn new(gpu: &'g Gpu, settings: &Settings, size: UVec2) -> Self {
        let options = Options { readable_intermediates: true, ..Default::default() };
        Self { gpu, denoiser: Denoiser::new(&gpu.device, settings, size, options).unwrap() }
    }

    /// Denoises a frame from images that fit exactly, with a camera at rest.
    pub(crate) fn still(&mut self, scene: &Scene) -> Denoised {
        self.frame(scene, &still_frame(scene.size))
    }

    pub(crate) fn frame(&mut self, scene: &Scene, frame: &FrameInputs) -> Denoised {
        self.images(&scene.upload(self.gpu), frame)
    }

    pub(crate) fn images(&mut self, images: &Images, frame: &FrameInputs) -> Denoised {
        let mut encoder = self.gpu.encoder();
        self.denoiser.encode(&self.gpu.queue, &mut encoder, &images.inputs(), frame).unwrap();
        let copies = self.copy_out(&mut encoder, frame.size);
        self.gpu.queue.submit([encoder.finish()]);
        self.read(&copies)
    }

    fn is_published(&self) -> bool {
        self.denoiser.plan().resource("signal").is_some()
    }

    /// Records copies of the output and of what there is of history.
    pub(crate) fn copy_out(&self, encoder: &mut wgpu::CommandEncoder, size: UVec2) -> [TextureCopy; 2] {
        let name = if self.is_published() { "signal" } else { "history" };
        let history = self.denoiser.intermediate_texture(name, Copy::Current).unwrap();
        [self.denoiser.output_texture(), history].map(|texture| self.gpu.copy_out(encoder, texture, size))
    }

    pub(crate) fn read(&self, [output, history]: &[TextureCopy; 2]) -> Denoised {
        let texels = self.gpu.read_texels::<[f16; 4]>(output);
        let output_radiance = texels.iter().map(|&[r, g, b, _]| [r, g, b].map(f16::to_f32));
        let words: Vec<[u32; 2]> = self.gpu.read_texels(history);
        let half = |word: u32| f16::from_bits(word as u16).to_f32();
        let found: Vec<_> = words.iter().map(|&[rg, b]| [half(rg), half(rg >> 16), half(b)]).collect();
        let is_published = self.is_published();
        let length_of = |word: u32| match is_published {
            // In steps of a seventh of a frame, as the longest history is 32 frames.
            true => ((word >> 16) & 255) as f32 / 7.0,
            false => ((word >> 16) & 31) as f32,
        };
        Denoised {
            size: output.size,
            kept: if is_published { output_radiance.collect() } else { found.clone() },
            output: texels.iter().map(|texel| texel.map(f16::to_f32)).collect(),
            found,
            length: words.iter().map(|&[_, word]| length_of(word)).collect(),
        }
    }
}
