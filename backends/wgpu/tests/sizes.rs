//! Any size of image, and sizes that change from frame to frame.

mod support;

use glam::{UVec2, Vec2, Vec3};
use limpid::settings::Fallback;
use support::{Gpu, HALF_STEP, POISON, Pixel, Run, SKY, Scene, WALL, noise, pipelines, still_frame};

const SIZES: [UVec2; 5] =
    [UVec2::new(1, 1), UVec2::new(7, 5), UVec2::new(1, 2000), UVec2::new(333, 217), UVec2::new(16, 16)];

/// Radiance over six decades, surfaces of all kinds, motion and normals without any order.
fn chaos(size: UVec2, seed: u32) -> Scene {
    Scene::new(size, |p| {
        let random = |channel| noise(seed * 16 + channel, p);
        let signed = |channel| 2.0 * random(channel) - 1.0;
        Pixel {
            radiance: Vec3::new(random(0), random(1), random(2)) * 10f32.powf(6.0 * random(3) - 2.0),
            hit_distance: 100.0 * random(4) * random(4),
            normal: Vec3::new(signed(5), signed(6), signed(7)),
            roughness: random(8),
            depth: if random(9) < 0.1 { 0.0 } else { 1.0 + 20.0 * random(10) },
            motion: Vec2::new(signed(11), signed(12)) * 0.3,
        }
    })
}

#[test]
fn any_size_gives_finite_output_of_chaos() {
    let Some(gpu) = Gpu::open() else { return };
    pipelines().iter().for_each(|settings| assert_finite(Run::new(&gpu, settings, UVec2::ONE)));
}

fn assert_finite(mut run: Run<'_>) {
    for size in SIZES {
        run.denoiser.resize(size).unwrap();
        for seed in 0..3 {
            run.still(&chaos(size, seed)).assert_usable(&format!("{size}, frame {seed}"));
        }
    }
}

#[test]
fn constant_radiance_stays_what_it_is_in_every_pixel() {
    let Some(gpu) = Gpu::open() else { return };
    for mut settings in pipelines() {
        settings.coverage.fallback = Fallback::Input;
        settings.coverage.roughness_threshold = 0.9;
        assert_constant(Run::new(&gpu, &settings, UVec2::ONE));
    }
}

fn assert_constant(mut run: Run<'_>) {
    // The last one has more tiles than a row of an indirect grid.
    for size in SIZES.into_iter().chain([UVec2::new(1100, 300)]) {
        run.denoiser.resize(size).unwrap();
        // Some pixels and some whole tiles are left out, and hold the same as the denoised ones.
        let scene = Scene::new(size, |p| {
            let (tile, pixel) = (noise(1, p / 8), noise(2, p));
            let roughness = if tile < 0.2 || pixel < 0.1 { 1.0 } else { noise(3, p) * 0.9 };
            let surface = if tile > 0.8 || pixel > 0.9 { SKY } else { WALL };
            Pixel { radiance: Vec3::new(1.0, 0.25, 8.0), roughness, ..surface }
        });
        for frame in 0..4 {
            let denoised = run.still(&scene);
            for (index, texel) in denoised.output.iter().enumerate() {
                for (value, expected) in texel.iter().zip([1.0, 0.25, 8.0]) {
                    // Sums of weights round, and output and history are halves: a step for each.
                    let error = (value / expected - 1.0).abs();
                    assert!(error <= 2.0 * HALF_STEP, "{size}, frame {frame}, pixel {index}: {texel:?}");
                }
            }
        }
    }
}

#[test]
fn nothing_outside_the_frame_is_read() {
    let Some(gpu) = Gpu::open() else { return };
    for settings in pipelines() {
        assert_reads_inside(Run::new(&gpu, &settings, UVec2::ONE), Run::new(&gpu, &settings, UVec2::ONE));
    }
}

fn assert_reads_inside(mut exact: Run<'_>, mut roomy: Run<'_>) {
    for (size, allocated) in [
        (UVec2::new(1, 1), UVec2::new(9, 1)),
        (UVec2::new(33, 17), UVec2::new(64, 64)),
        (UVec2::new(61, 40), UVec2::new(62, 99)),
    ] {
        exact.denoiser.resize(size).unwrap();
        roomy.denoiser.resize(allocated).unwrap();
        // Leaves something in all of limpid's own textures and buffers.
        roomy.still(&Scene::new(allocated, |p| Pixel { radiance: Vec3::splat(1000.0) * noise(0, p), ..WALL }));
        for seed in 0..4 {
            let scene = if seed < 2 { Scene::noisy_wall(size, seed) } else { chaos(size, seed) };
            let mut frame = still_frame(size);
            frame.reset = seed == 0;
            let expected = exact.frame(&scene, &frame);
            let actual = roomy.frame(&scene.inside(allocated, POISON), &frame);
            assert!(actual == expected, "{size} in {allocated}, frame {seed}");
        }
    }
}

#[test]
fn history_survives_a_size_that_changes_every_frame() {
    let Some(gpu) = Gpu::open() else { return };
    let allocated = UVec2::new(120, 90);
    pipelines().iter().for_each(|settings| assert_survives(Run::new(&gpu, settings, allocated), allocated));
}

fn assert_survives(mut run: Run<'_>, allocated: UVec2) {
    let sizes = [(120, 90), (80, 60), (96, 72), (61, 45), (120, 90), (40, 30), (120, 90), (101, 77)];
    // Dark to bright from left to right, as a function of uv, so that it is the same at every size.
    let shade = |uv: Vec2| Vec3::new(1.0 + uv.x, 2.0 - uv.x, 1.0 + uv.y);
    for (index, size) in sizes.map(UVec2::from).into_iter().enumerate() {
        let scene = Scene::new(size, |p| {
            let uv = (p.as_vec2() + 0.5) / size.as_vec2();
            Pixel { radiance: shade(uv) * (0.95 + 0.1 * noise(index as u32, p)), ..WALL }
        });
        let mut frame = still_frame(size);
        frame.camera = support::still_camera(allocated);
        let denoised = run.frame(&scene.inside(allocated, POISON), &frame);
        denoised.assert_usable(&format!("frame {index}"));
        for p in support::positions(size) {
            let uv = (p.as_vec2() + 0.5) / size.as_vec2();
            if (uv - 0.5).abs().max_element() < 0.3 {
                // The wall is flat: nothing but rounding lowers the trust in its history.
                let length = denoised.length_at(p);
                assert!((length - (index + 1) as f32).abs() < 0.5, "length {length} at {p} of {size}, frame {index}");
                // The noise is 5 %, and the blurs reach over at most a sixth of the ramp.
                let error = (denoised.radiance(p) / shade(uv) - 1.0).abs().max_element();
                assert!(error < 0.08, "{} for {} at {p} of {size}", denoised.radiance(p), shade(uv));
            }
        }
    }
}
