//! Pixels that are not denoised: sky, and surfaces that are too rough.

mod support;

use glam::{Mat3, UVec2, Vec2, Vec3};
use half::f16;
use limpid::settings::{Fallback, Settings};
use support::{Gpu, Images, Pixel, Run, SKY, Scene, WALL, noise, pipelines, positions, still_camera};

const SIZE: UVec2 = UVec2::new(75, 43);
const THRESHOLD: f32 = 0.5;

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Sky,
    TooRough,
    Denoised,
}

/// Whole tiles of each kind and mixed ones; sky is marked by depth or by a normal without direction.
fn kind_at(p: UVec2) -> Kind {
    match p.x / 16 {
        0 => Kind::Sky,
        1 => Kind::TooRough,
        2 => Kind::Denoised,
        _ => match (3.0 * noise(5, p)) as u32 {
            0 => Kind::Sky,
            1 => Kind::TooRough,
            _ => Kind::Denoised,
        },
    }
}

fn mixed_scene(seed: u32, kind: impl Fn(UVec2) -> Kind) -> Scene {
    Scene::new(SIZE, |p| {
        // Representable as halves, so that the input fallback can be compared exactly.
        let half = |channel| f16::from_f32(0.5 + noise(seed * 4 + channel, p)).to_f32();
        let pixel = Pixel { radiance: Vec3::new(half(0), half(1), half(2)), roughness: 0.3, ..WALL };
        match kind(p) {
            Kind::Sky if p.y % 2 == 0 => Pixel { depth: SKY.depth, ..pixel },
            Kind::Sky => Pixel { normal: Vec3::ZERO, ..pixel },
            Kind::TooRough => Pixel {
                roughness: 0.55 + 0.45 * noise(9, p),
                normal: Vec3::new(noise(10, p) - 0.5, noise(11, p) - 0.5, noise(12, p)),
                depth: 1.0 + 5.0 * noise(13, p),
                ..pixel
            },
            Kind::Denoised => pixel,
        }
    })
}

fn settings(fallback: Fallback) -> [Settings; 2] {
    pipelines().map(|mut settings| {
        settings.coverage.roughness_threshold = THRESHOLD;
        settings.coverage.fallback = fallback;
        settings
    })
}

fn frame() -> limpid::FrameInputs {
    support::still_frame(SIZE)
}

#[test]
fn left_out_pixels_are_black_or_as_they_came() {
    let Some(gpu) = Gpu::open() else { return };
    let all = [Fallback::Black, Fallback::Input].into_iter().flat_map(settings);
    for settings in all {
        let fallback = settings.coverage.fallback;
        let mut run = Run::new(&gpu, &settings, SIZE);
        for seed in 0..3 {
            let mut scene = mixed_scene(seed, kind_at);
            // The input is passed on as far as it is usable.
            scene.at(UVec2::new(3, 3)).radiance = Vec3::new(-1.0, 1e9, 0.5);
            scene.at(UVec2::new(20, 3)).radiance = Vec3::new(f32::NAN, 1.0, 1.0);
            let denoised = run.frame(&scene, &frame());
            denoised.assert_usable("mixed scene");
            for p in positions(SIZE) {
                let expected = match (kind_at(p), fallback) {
                    (Kind::Denoised, _) => continue,
                    (_, Fallback::Black) => Vec3::ZERO,
                    _ if p == UVec2::new(3, 3) => Vec3::new(0.0, 65504.0, 0.5),
                    _ if p == UVec2::new(20, 3) => Vec3::ZERO,
                    _ => scene.at(p).radiance,
                };
                assert_eq!(denoised.output[denoised.index(p)], expected.extend(0.0).to_array(), "{fallback:?} at {p}");
                assert_eq!(denoised.length_at(p), 0.0);
            }
        }
    }
}

#[test]
fn an_image_without_any_reflection_is_all_fallback() {
    let Some(gpu) = Gpu::open() else { return };
    let all = [Fallback::Black, Fallback::Input].into_iter().flat_map(settings);
    all.for_each(|settings| assert_is_all_fallback(&gpu, &settings));
}

fn assert_is_all_fallback(gpu: &Gpu, settings: &Settings) {
    let mut run = Run::new(gpu, settings, SIZE);
    use Kind::{Denoised, Sky, TooRough};
    // Everything denoised, then nothing, and everything again: history starts anew. So it does after nothing but sky.
    for (seed, kind) in [Denoised, TooRough, Denoised, TooRough, Sky, Denoised].into_iter().enumerate() {
        let scene = mixed_scene(seed as u32, |_| kind);
        let denoised = run.frame(&scene, &frame());
        if kind == Denoised {
            denoised.assert_usable("everything denoised");
            assert!(denoised.length.iter().all(|length| *length == 1.0), "frame {seed}");
        } else {
            for (texel, pixel) in denoised.output.iter().zip(&scene.pixels) {
                let is_black = settings.coverage.fallback == Fallback::Black;
                let expected = if is_black { Vec3::ZERO } else { pixel.radiance };
                assert_eq!(*texel, expected.extend(0.0).to_array(), "frame {seed}");
            }
        }
    }
}

const ENVIRONMENT_SIZE: UVec2 = UVec2::new(64, 32);
const ENVIRONMENT_LEVELS: u32 = 6;
const MIP_SCALE: f32 = 7.0;

/// What a texel of a level of the environment map holds: the direction that it lies in, and its level as
/// brightness.
fn environment_texel(level: u32, texel: UVec2) -> Vec3 {
    let uv = (texel.as_vec2() + 0.5) / (ENVIRONMENT_SIZE >> level).max(UVec2::ONE).as_vec2();
    // From -z at the centre to +x at three quarters; from +y at the top to -y at the bottom.
    let (around, down) = ((uv.x - 0.5) * std::f32::consts::TAU, uv.y * std::f32::consts::PI);
    let direction = Vec3::new(down.sin() * around.sin(), down.cos(), -down.sin() * around.cos());
    (1.5 + direction) * (1.0 + level as f32)
}

fn environment_map(gpu: &Gpu) -> wgpu::TextureView {
    let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST;
    let texture = gpu.texture(ENVIRONMENT_SIZE, wgpu::TextureFormat::Rgba32Float, usage, |descriptor| {
        descriptor.mip_level_count = ENVIRONMENT_LEVELS;
    });
    for level in 0..ENVIRONMENT_LEVELS {
        let size = (ENVIRONMENT_SIZE >> level).max(UVec2::ONE);
        let texels: Vec<_> = positions(size).map(|p| environment_texel(level, p).extend(f32::NAN).to_array()).collect();
        gpu.write_level(&texture, level, size, &texels);
    }
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

/// Bilinear lookup in a level; around the horizon it goes on at the other end.
fn look_up(level: u32, direction: Vec3) -> Vec3 {
    let size = (ENVIRONMENT_SIZE >> level).max(UVec2::ONE).as_ivec2();
    let u = 0.5 + direction.x.atan2(-direction.z) / std::f32::consts::TAU;
    let v = direction.y.clamp(-1.0, 1.0).acos() / std::f32::consts::PI;
    let place = Vec2::new(u, v) * size.as_vec2() - 0.5;
    let (base, f) = (place.floor().as_ivec2(), place - place.floor());
    let texel = |x: i32, y: i32| {
        let (x, y) = ((base.x + x).rem_euclid(size.x), (base.y + y).clamp(0, size.y - 1));
        environment_texel(level, UVec2::new(x as u32, y as u32))
    };
    texel(0, 0).lerp(texel(1, 0), f.x).lerp(texel(0, 1).lerp(texel(1, 1), f.x), f.y)
}

#[test]
fn left_out_surfaces_mirror_the_environment() {
    let Some(gpu) = Gpu::open() else { return };
    let environment_from_world = Mat3::from_rotation_y(2.2) * Mat3::from_rotation_x(0.4);
    for mut settings in settings(Fallback::Environment) {
        settings.coverage.environment_mip_scale = MIP_SCALE;
        settings.coverage.environment_from_world = environment_from_world;
        assert_mirrors(&gpu, &settings, environment_from_world);
    }
}

fn assert_mirrors(gpu: &Gpu, settings: &Settings, environment_from_world: Mat3) {
    let mut run = Run::new(gpu, settings, SIZE);
    let scene = mixed_scene(0, kind_at);
    let images = Images { environment: Some(environment_map(gpu)), ..scene.upload(gpu) };
    let denoised = run.images(&images, &frame());
    denoised.assert_usable("environment");
    let projection = still_camera(SIZE).view_to_clip;
    for p in positions(SIZE) {
        let pixel = scene.pixels[denoised.index(p)];
        if kind_at(p) == Kind::Sky {
            assert_eq!(denoised.output[denoised.index(p)], [0.0; 4], "sky at {p}");
        }
        if kind_at(p) != Kind::TooRough {
            continue;
        }
        let uv = (p.as_vec2() + 0.5) / SIZE.as_vec2();
        let view = Vec3::new((2.0 * uv.x - 1.0) / projection.x_axis.x, (1.0 - 2.0 * uv.y) / projection.y_axis.y, -1.0);
        let mirrored = environment_from_world * view.normalize().reflect(pixel.normal.normalize());
        let level = (pixel.roughness.powi(2) * MIP_SCALE).min((ENVIRONMENT_LEVELS - 1) as f32);
        let [sharp, blurry] = [level.floor(), level.ceil()].map(|level| look_up(level as u32, mirrored));
        let expected = sharp.lerp(blurry, level.fract());
        // Normals are kept in 2 x 11 bits, which turns a mirrored direction by up to 0.003; roughness in 10
        // bits, which moves the level by up to 0.007, of values that at level 1 are half as large again.
        let error = ((denoised.radiance(p) - expected) / expected).abs().max_element();
        assert!(error < 0.015, "{} for {expected} at {p}, level {level}", denoised.radiance(p));
    }
}
