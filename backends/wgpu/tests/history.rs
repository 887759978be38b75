//! What is kept from frame to frame: how long, from where, and when it is dropped.

mod support;

use glam::{IVec2, Mat4, UVec2, Vec2, Vec3};
use limpid::FrameInputs;
use support::{
    Denoised, Gpu, HALF_STEP, Pixel, Run, Scene, WALL, by_motion_only, linear_settings, noise, pipelines, positions,
    published_settings, still_camera, still_frame,
};

fn mean(values: impl Iterator<Item = f32>) -> f32 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + f64::from(value), count + 1.0));
    (sum / count) as f32
}

#[test]
fn history_grows_by_a_frame_up_to_the_cap_of_its_roughness() {
    let Some(gpu) = Gpu::open() else { return };
    let size = UVec2::new(24, 16);
    // Columns of tiles: GGX alpha 0, 0.01 and 0.64.
    let published = [8.0, 32.0 * (1.0 - (-1.0f32).exp()), 32.0];
    // History is of 0.13 to 0.5 seconds of 60 frames each, and this frame is added; of two thirds of the way to the
    // roughness from which on it may be longest, the smooth step is 20 / 27.
    let footprint = [8.8, 8.8 + 22.2 * 20.0 / 27.0, 31.0];
    for (settings, caps, tolerance) in [(published_settings(), published, 0.2), (linear_settings(), footprint, 0.7)] {
        assert_grows(Run::new(&gpu, &settings, size), size, caps, tolerance);
    }
}

fn assert_grows(mut run: Run<'_>, size: UVec2, caps: [f32; 3], tolerance: f32) {
    for frame in 1..=36 {
        let mut scene = Scene::noisy_wall(size, frame);
        for p in positions(size) {
            scene.at(p).roughness = [0.0, 0.1, 0.8][p.x as usize / 8];
        }
        let denoised = run.still(&scene);
        for p in positions(size) {
            let (length, cap) = (denoised.length_at(p), caps[p.x as usize / 8]);
            // Whole frames are stored exactly, the cap in between to a seventh of a frame or to a frame. Roughness
            // is stored in 1/1023, which moves that cap by another 0.1.
            let expected = (frame as f32).min(cap);
            let tolerance = if expected.fract() == 0.0 { 0.0 } else { tolerance };
            assert!((length - expected).abs() <= tolerance, "length {length} at {p} in frame {frame}");
        }
    }
}

#[test]
fn noise_fades_while_nothing_moves() {
    let Some(gpu) = Gpu::open() else { return };
    let size = UVec2::new(64, 64);
    pipelines().iter().for_each(|settings| assert_fades(Run::new(&gpu, settings, size), size));
}

fn assert_fades(mut run: Run<'_>, size: UVec2) {
    // The published filter darkens what varies, by about 0.3 times the variance of the noise, which here is
    // 0.03: the error of the first frame is well above that bias, the one of the last frame is mostly it.
    let errors: Vec<f32> = (0..32)
        .map(|frame| {
            let denoised =
                run.still(&Scene::new(size, |p| Pixel { radiance: Vec3::splat(0.7 + 0.6 * noise(frame, p)), ..WALL }));
            mean(denoised.output.iter().map(|texel| (texel[0] - 1.0).abs()))
        })
        .collect();
    // The first frame is left out: half of it is the average of 8x8 pixels, which later frames lean on less.
    let blocks: Vec<f32> = [1..2, 2..4, 4..8, 8..16, 16..32].map(|block| mean(errors[block].iter().copied())).to_vec();
    assert!(blocks.is_sorted_by(|before, after| after < before), "{blocks:?}, frames {errors:?}");
    assert!(blocks[4] < 0.5 * blocks[0], "{blocks:?}");
}

#[test]
fn storing_history_does_not_darken_it() {
    let Some(gpu) = Gpu::open() else { return };
    let size = UVec2::new(64, 64);
    pipelines().iter().for_each(|settings| assert_keeps_brightness(Run::new(&gpu, settings, size), size));
}

fn assert_keeps_brightness(mut run: Run<'_>, size: UVec2) {
    let mut brightness = 0.0;
    for frame in 0..100 {
        let scene = Scene::new(size, |p| Pixel { radiance: Vec3::splat(0.95 + 0.1 * noise(frame, p)), ..WALL });
        brightness = mean(run.still(&scene).output.iter().map(|texel| texel[0]));
    }
    // The noise has variance 0.0008, of which the filter takes 0.3 times. Halves are 0.0005 apart: if each frame
    // lost half of that to rounding, history of 32 frames would lose 0.008.
    assert!((brightness - 1.0).abs() < 0.001, "{brightness}");
}

#[test]
fn a_reset_frame_is_the_first_frame_of_a_fresh_denoiser() {
    let Some(gpu) = Gpu::open() else { return };
    let size = UVec2::new(45, 38);
    for settings in pipelines() {
        assert_forgets(Run::new(&gpu, &settings, size), Run::new(&gpu, &settings, size), size);
    }
}

fn assert_forgets(mut used: Run<'_>, mut fresh: Run<'_>, size: UVec2) {
    for seed in 0..5 {
        used.still(&Scene::noisy_wall(size, seed));
    }
    // Two frames, so that nothing old comes back in the second one either.
    for seed in 10..12 {
        let mut frame = still_frame(size);
        frame.reset = seed == 10;
        let scene = Scene::noisy_wall(size, seed);
        let after_reset = used.frame(&scene, &frame);
        assert!(after_reset == fresh.still(&scene), "frame {seed}");
        assert!(after_reset.length.iter().all(|length| *length == (seed - 9) as f32), "frame {seed}");
    }
}

/// Radiance that is fixed to the surface, with detail of pixel size.
fn glued(p: IVec2) -> Vec3 {
    let detail = |channel| 0.5 + noise(channel, (p + 10_000).as_uvec2());
    Vec3::new(detail(0), detail(1), detail(2))
}

/// Frame 12 and the one before, of a wall that moves `step` pixels a frame, and its motion in uv.
fn glide(run: &mut Run<'_>, size: UVec2, step: IVec2, frame: impl Fn(i32) -> FrameInputs) -> [Denoised; 2] {
    let mut last_two = [None, None];
    for index in 0..12 {
        let scene = Scene::new(size, |p| Pixel {
            radiance: glued(p.as_ivec2() - step * index),
            motion: step.as_vec2() / size.as_vec2(),
            ..WALL
        });
        last_two = [run.frame(&scene, &frame(index)).into(), last_two[0].take()];
    }
    last_two.map(|denoised| denoised.unwrap())
}

fn assert_glued_history([now, before]: &[Denoised; 2], step: IVec2) {
    let (size, margin) = (now.size.as_ivec2(), 12 * step.abs() + 1);
    let interior = positions(now.size).filter(|p| {
        let p = p.as_ivec2();
        p.cmpge(margin).all() && p.cmplt(size - margin).all()
    });
    assert!(interior.clone().count() > 500);
    for p in interior {
        assert_eq!(now.length_at(p), 12.0, "at {p}");
        let was = Vec3::from_array(before.kept[before.index((p.as_ivec2() - step).as_uvec2())]);
        let found = Vec3::from_array(now.found[now.index(p)]);
        // Positions are off by rounding, at most 1/1000 of the neighbour's difference, and the result rounds.
        let error = (found / was - 1.0).abs().max_element();
        assert!(error < 2.0 * HALF_STEP, "{found} found for {was} at {p}");
    }
}

#[test]
fn history_follows_a_moving_surface() {
    let Some(gpu) = Gpu::open() else { return };
    let size = UVec2::new(96, 80);
    for settings in pipelines().map(by_motion_only) {
        for step in [IVec2::new(2, 0), IVec2::new(-1, 2)] {
            let mut run = Run::new(&gpu, &settings, size);
            let frames = glide(&mut run, size, step, |_| still_frame(size));
            assert_glued_history(&frames, step);
        }
    }
}

#[test]
fn history_follows_a_moving_camera() {
    let Some(gpu) = Gpu::open() else { return };
    let size = UVec2::new(96, 80);
    let step = IVec2::new(-2, 1);
    // By hit distance and camera, not by motion vectors.
    for mut settings in pipelines() {
        settings.features.whole_blocks = false;
        // Two motions that disagree would shorten it.
        settings.accumulate.disagreement_limit = 1000.0;
        assert_follows(Run::new(&gpu, &settings, size), size, step);
    }
}

fn assert_follows(mut run: Run<'_>, size: UVec2, step: IVec2) {
    let camera = still_camera(size);
    // The height of a pixel on the wall; the wall moves on screen against the camera.
    let pixel = WALL.depth * 2.0 / (camera.view_to_clip.y_axis.y * size.y as f32);
    let frames = glide(&mut run, size, step, |index| {
        let wall = step.as_vec2() * Vec2::new(1.0, -1.0) * pixel * index as f32;
        let world_to_view = Mat4::from_translation(wall.extend(0.0));
        FrameInputs::new(limpid::Camera { world_to_view, ..camera }, size)
    });
    assert_glued_history(&frames, step);
}

#[test]
fn what_a_moving_box_uncovers_has_no_history() {
    let Some(gpu) = Gpu::open() else { return };
    let size = UVec2::new(128, 48);
    pipelines()
        .map(by_motion_only)
        .iter()
        .for_each(|settings| assert_uncovers(Run::new(&gpu, settings, size), size, 1));
    // Whole blocks take what a part of them has.
    let mut settings = by_motion_only(linear_settings());
    settings.features.whole_blocks = true;
    assert_uncovers(Run::new(&gpu, &settings, size), size, 4);
}

/// Pixels so near to ones that were visible may have theirs.
fn assert_uncovers(mut run: Run<'_>, size: UVec2, near: u32) {
    let step = 6;
    for index in 0..8u32 {
        let box_left = 20 + step * index;
        let in_box = |p: UVec2, left: u32| p.x >= left && p.x < left + 40 && (12..36).contains(&p.y);
        let scene = Scene::new(size, |p| {
            if in_box(p, box_left) {
                let on_box = p.as_ivec2() - IVec2::new(box_left as i32, 0);
                let motion = Vec2::new(step as f32 / size.x as f32, 0.0);
                Pixel { radiance: glued(on_box), depth: 2.0, motion, ..WALL }
            } else {
                Pixel { radiance: 2.0 * glued(p.as_ivec2()), ..WALL }
            }
        });
        let denoised = run.still(&scene);
        if index == 0 {
            continue;
        }
        for p in positions(size) {
            let length = denoised.length_at(p);
            let frames = (index + 1) as f32;
            if in_box(p, box_left) {
                assert_eq!(length, frames, "on the box at {p} in frame {index}");
            } else if in_box(p, box_left - step) {
                // By the search in 3x3 pixels.
                let beside_visible = p.x < box_left - step + near || p.y < 12 + near || p.y > 35 - near;
                assert!(length == 1.0 || beside_visible, "uncovered at {p}: length {length} in frame {index}");
            } else if !(12..36).contains(&p.y) || p.x < 20 || p.x >= box_left + 40 {
                assert_eq!(length, frames, "never covered at {p} in frame {index}");
            }
        }
    }
}
