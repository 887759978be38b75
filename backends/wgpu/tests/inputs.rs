//! Jitter, exposure, and the formats that inputs come in.

mod support;

use glam::{UVec2, Vec2, Vec3};
use half::f16;
use limpid::Settings;
use support::{
    Denoised, Gpu, HALF_STEP, Images, Pixel, Run, Scene, WALL, by_motion_only, jitter_of, linear_settings, noise,
    pipelines, positions, published_settings, still_frame,
};
use wgpu::TextureFormat::{Depth24PlusStencil8, Depth32Float, R8Unorm, Rg16Float, Rgba8Snorm, Rgba16Float};

const SIZE: UVec2 = UVec2::new(72, 56);

#[test]
fn jitter_does_not_move_history() {
    let Some(gpu) = Gpu::open() else { return };
    assert_unmoved(Run::new(&gpu, &published_settings(), SIZE), Scene::noisy_wall);
    // What was accumulated and what is added to it are the same where nothing moves.
    assert_unmoved(Run::new(&gpu, &linear_settings(), SIZE), |size, _| Scene::noisy_wall(size, 0));
}

fn assert_unmoved(mut run: Run<'_>, scene: fn(UVec2, u32) -> Scene) {
    let mut before = None::<Denoised>;
    for index in 0..5 {
        let mut frame = still_frame(SIZE);
        frame.camera.jitter = jitter_of(index);
        let denoised = run.frame(&scene(SIZE, index), &frame);
        for (index, found) in denoised.found.iter().enumerate() {
            let Some(before) = &before else { break };
            let was = before.kept[index];
            for channel in 0..3 {
                // Positions are off by less than 1/1000 pixel, and the result rounds.
                let error = (found[channel] / was[channel] - 1.0).abs();
                assert!(error < 2.0 * HALF_STEP, "{found:?} found for {was:?} at pixel {index}");
            }
        }
        before = Some(denoised);
    }
}

#[test]
fn exposure_scales_and_changes_nothing_else() {
    let Some(gpu) = Gpu::open() else { return };
    let sequence = |settings: &Settings, power: f32| {
        let mut run = Run::new(&gpu, settings, SIZE);
        let frames = (0..4).map(|index| {
            let mut scene = Scene::noisy_wall(SIZE, index);
            scene.pixels.iter_mut().for_each(|pixel| pixel.radiance *= power);
            let mut frame = still_frame(SIZE);
            frame.exposure = 1.0 / power;
            run.frame(&scene, &frame).output
        });
        frames.collect::<Vec<_>>()
    };
    // Powers of two only move exponents, so every bit stays the same.
    for (settings, power) in pipelines().iter().flat_map(|settings| [(settings, 64.0), (settings, 1.0 / 64.0)]) {
        let (expected, scaled) = (sequence(settings, 1.0), sequence(settings, power).concat());
        for (actual, expected) in scaled.iter().zip(expected.concat()) {
            let [r, g, b, variance] = expected;
            assert_eq!(*actual, [r * power, g * power, b * power, variance]);
        }
    }
}

#[test]
fn exposure_may_change_every_frame() {
    let Some(gpu) = Gpu::open() else { return };
    let mut runs = pipelines().map(|settings| Run::new(&gpu, &settings, SIZE));
    let exposures = [1.0, 0.01, 100.0, 0.3, 7.0].into_iter().enumerate();
    for ((index, exposure), run) in exposures.flat_map(|frame| [(frame, 0), (frame, 1)]) {
        let run = &mut runs[run];
        let mut frame = still_frame(SIZE);
        frame.exposure = exposure;
        let denoised = run.frame(&Scene::new(SIZE, |_| WALL), &frame);
        assert!(denoised.length.iter().all(|length| *length == (index + 1) as f32), "frame {index}");
        for [r, g, b, _] in denoised.output {
            // Output, history and input round to halves once each.
            let agrees = [r, g, b].iter().all(|x| (x - 1.0).abs() <= 3.0 * HALF_STEP);
            assert!(agrees, "frame {index}: {r} {g} {b}");
        }
    }
}

/// A depth buffer as a renderer has it, cleared to `depth`.
fn cleared_depth(gpu: &Gpu, format: wgpu::TextureFormat, depth: f32) -> wgpu::TextureView {
    let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::RENDER_ATTACHMENT;
    let texture = gpu.texture(SIZE, format, usage, |_| ());
    let mut encoder = gpu.encoder();
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: &texture.create_view(&wgpu::TextureViewDescriptor::default()),
            depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(depth), store: wgpu::StoreOp::Store }),
            stencil_ops: format
                .has_stencil_aspect()
                .then_some(wgpu::Operations { load: wgpu::LoadOp::Clear(0), store: wgpu::StoreOp::Store }),
        }),
        ..Default::default()
    });
    gpu.queue.submit([encoder.finish()]);
    texture.create_view(&wgpu::TextureViewDescriptor { aspect: wgpu::TextureAspect::DepthOnly, ..Default::default() })
}

#[test]
fn compact_formats_and_depth_buffers_may_be_given() {
    let Some(gpu) = Gpu::open() else { return };
    pipelines().map(by_motion_only).iter().for_each(|settings| assert_may_be_compact(&gpu, settings));
}

fn assert_may_be_compact(gpu: &Gpu, settings: &Settings) {
    let mut wide = Run::new(gpu, settings, SIZE);
    let mut compact = Run::new(gpu, settings, SIZE);
    for (index, format) in [Depth32Float, Depth32Float, Depth24PlusStencil8].into_iter().enumerate() {
        // All of it has an exact equal in the compact formats, but for 0.5 in 24 bits.
        let scene = Scene::new(SIZE, |p| Pixel {
            radiance: Vec3::splat(f16::from_f32(0.5 + noise(index as u32, p)).to_f32()),
            roughness: 0.6,
            depth: 0.5,
            motion: Vec2::new(0.125, 0.0),
            ..WALL
        });
        let halves = |values: &[f32]| values.iter().copied().map(f16::from_f32).collect::<Vec<_>>();
        let texels = |texel: &dyn Fn(&Pixel) -> Vec<f32>| scene.pixels.iter().flat_map(texel).collect::<Vec<_>>();
        let count = scene.pixels.len();
        let images = Images {
            radiance: gpu.upload(
                SIZE,
                Rgba16Float,
                &halves(&texels(&|p| p.radiance.extend(p.hit_distance).to_array().to_vec())),
            ),
            normal: gpu.upload(SIZE, Rgba8Snorm, &[0i8, 0, 127, 55].repeat(count)),
            roughness: gpu.upload(SIZE, R8Unorm, &[153u8].repeat(count)),
            depth: cleared_depth(gpu, format, 0.5),
            motion: gpu.upload(SIZE, Rg16Float, &halves(&texels(&|p| p.motion.to_array().to_vec()))),
            hit_motion: None,
            environment: None,
        };
        let frame = still_frame(SIZE);
        let (expected, actual) = (wide.frame(&scene, &frame), compact.images(&images, &frame));
        if format == Depth32Float {
            assert!(actual == expected, "frame {index}");
        } else {
            assert_eq!(actual.length, expected.length);
        }
        // Far enough from the left edge, where the motion of 9 pixels a frame comes from, there is history.
        let kept = positions(SIZE).all(|p| p.x < 36 || actual.length_at(p) == (index + 1) as f32);
        assert!(kept, "frame {index}");
    }
}
