//! Input that no renderer should give, and every renderer does at times.

mod support;

use glam::{Mat4, UVec2, Vec2, Vec3};
use limpid::settings::Pipeline;
use support::{Denoised, Gpu, Images, POISON, Pixel, Run, Scene, WALL, by_motion_only, noise, pipelines, positions};

const SIZE: UVec2 = UVec2::new(96, 64);
/// In the middle of the image, in the tile from (24, 32).
const BAD: UVec2 = UVec2::new(27, 35);
const BAD_FRAME: usize = 5;
const RECOVERED_FRAME: u32 = 30;

type Spoil = (&'static str, fn(&mut Pixel));

/// Ways in which a pixel goes bad that are not about motion.
fn bad_surfaces() -> Vec<Spoil> {
    vec![
        ("NaN radiance", |p| p.radiance = Vec3::NAN),
        ("NaN in one channel", |p| p.radiance.y = f32::NAN),
        ("infinite radiance", |p| p.radiance = Vec3::INFINITY),
        ("negative infinite radiance", |p| p.radiance = Vec3::NEG_INFINITY),
        ("negative radiance", |p| p.radiance = Vec3::splat(-50.0)),
        ("largest half as radiance", |p| p.radiance = Vec3::splat(65504.0)),
        ("huge radiance", |p| p.radiance = Vec3::splat(1e38)),
        ("denormal radiance", |p| p.radiance = Vec3::splat(1e-40)),
        ("NaN hit distance", |p| p.hit_distance = f32::NAN),
        ("infinite hit distance", |p| p.hit_distance = f32::INFINITY),
        ("negative hit distance", |p| p.hit_distance = -1e9),
        ("huge hit distance", |p| p.hit_distance = 1e38),
        ("no normal", |p| p.normal = Vec3::ZERO),
        ("NaN normal", |p| p.normal = Vec3::NAN),
        ("infinite normal", |p| p.normal = Vec3::INFINITY),
        ("huge normal", |p| p.normal = Vec3::splat(1e30)),
        ("denormal normal", |p| p.normal = Vec3::splat(1e-42)),
        ("NaN depth", |p| p.depth = f32::NAN),
        ("infinite depth", |p| p.depth = f32::INFINITY),
        ("negative depth", |p| p.depth = -4.0),
        ("huge depth", |p| p.depth = 3e38),
        ("far depth", |p| p.depth = 9e29),
        ("denormal depth", |p| p.depth = 1e-41),
        ("NaN roughness", |p| p.roughness = f32::NAN),
        ("infinite roughness", |p| p.roughness = f32::INFINITY),
        ("negative roughness", |p| p.roughness = -3.0),
        ("nothing usable", |p| *p = POISON),
    ]
}

/// Ways in which motion goes bad.
fn bad_motion() -> Vec<Spoil> {
    vec![
        ("NaN motion", |p| p.motion = Vec2::NAN),
        ("infinite motion", |p| p.motion = Vec2::new(f32::INFINITY, f32::NEG_INFINITY)),
        ("huge motion", |p| p.motion = Vec2::new(-1e30, 1e38)),
    ]
}

fn scene(frame: u32) -> Scene {
    let mut scene = Scene::noisy_wall(SIZE, frame);
    for pixel in &mut scene.pixels {
        pixel.hit_distance = 1.0;
    }
    scene
}

/// What a bad pixel may reach in its own frame. Published: the 8x8 average of its tile is looked up between tiles, 4
/// pixels around, and goes from there through the 9x9 statistics, another 4 around. Footprint: passes over 4x4 blocks
/// reach one, three and three blocks, as their grid may be turned, and both lookups between blocks another.
fn in_footprint(pipeline: Pipeline, p: UVec2) -> bool {
    let (side, reach) = if pipeline == Pipeline::Published { (8, 8) } else { (4, 4 * (1 + 3 + 1 + 3 + 1)) };
    let first = (BAD / side * side).as_ivec2() - reach;
    let p = p.as_ivec2();
    p.cmpge(first).all() && p.cmplt(first + side as i32 + 2 * reach).all()
}

fn largest_difference(a: &Denoised, b: &Denoised) -> f32 {
    positions(SIZE).map(|p| ((a.radiance(p) - b.radiance(p)) / b.radiance(p)).abs().max_element()).fold(0.0, f32::max)
}

#[test]
fn a_bad_pixel_stays_contained_and_is_forgotten() {
    let Some(gpu) = Gpu::open() else { return };
    let images: Vec<Images> = (0..=RECOVERED_FRAME).map(|index| scene(index).upload(&gpu)).collect();
    let all = pipelines()
        .into_iter()
        .flat_map(|settings| [(settings.clone(), bad_surfaces()), (by_motion_only(settings), bad_motion())]);
    for (settings, spoils) in all {
        let mut run = Run::new(&gpu, &settings, SIZE);
        let mut sequence = |spoil: Option<fn(&mut Pixel)>| -> Vec<Denoised> {
            let frames = images.iter().enumerate().map(|(index, clean)| {
                let mut frame = support::still_frame(SIZE);
                frame.reset = index == 0;
                match spoil.filter(|_| index == BAD_FRAME) {
                    Some(spoil) => {
                        let mut scene = scene(index as u32);
                        spoil(scene.at(BAD));
                        run.frame(&scene, &frame)
                    }
                    None => run.images(clean, &frame),
                }
            });
            frames.collect()
        };
        let clean = sequence(None);
        for (what, spoil) in spoils {
            let spoilt = sequence(Some(spoil));
            for (index, frame) in spoilt.iter().enumerate() {
                frame.assert_usable(&format!("{what}, frame {index}"));
            }
            for p in positions(SIZE).filter(|p| !in_footprint(settings.pipeline, *p)) {
                let (spoilt, clean) = (spoilt[BAD_FRAME].radiance(p), clean[BAD_FRAME].radiance(p));
                assert_eq!(spoilt, clean, "{what} reaches {p}");
            }
            let difference = |index: usize| largest_difference(&spoilt[index], &clean[index]);
            let (at_once, lasting) = (difference(BAD_FRAME), difference(spoilt.len() - 1));
            // A history that starts anew leaves a little more noise. An outlier is clipped in the published pipeline, to
            // 1/5000 in 25 frames; in the other one what was kept of it stays in the mean of all frames.
            let kept = match settings.pipeline {
                Pipeline::Published => 1.0 / 5000.0,
                _ => 1.1 * (BAD_FRAME + 1) as f32 / (RECOVERED_FRAME + 1) as f32,
            };
            assert!(lasting < 0.02 + at_once * kept, "{what} differs by {at_once} at once, {lasting} at last");
        }
    }
}

#[test]
fn unusable_radiance_counts_as_no_light() {
    let Some(gpu) = Gpu::open() else { return };
    pipelines().iter().for_each(|settings| assert_no_light(Run::new(&gpu, settings, SIZE)));
}

fn assert_no_light(mut run: Run<'_>) {
    let mut with_radiance_at_bad_pixels = |radiance: Vec3| {
        let frames = (0..3).map(|index| {
            let mut scene = scene(index);
            positions(SIZE).filter(|p| noise(index, *p) < 0.1).for_each(|p| scene.at(p).radiance = radiance);
            let mut frame = support::still_frame(SIZE);
            frame.reset = index == 0;
            run.frame(&scene, &frame)
        });
        frames.collect::<Vec<_>>()
    };
    let expected = with_radiance_at_bad_pixels(Vec3::ZERO);
    let one_channel = Vec3::new(3.0, f32::NAN, 5.0);
    for radiance in [Vec3::NAN, one_channel, Vec3::INFINITY, Vec3::NEG_INFINITY, Vec3::splat(-50.0)] {
        assert!(with_radiance_at_bad_pixels(radiance) == expected, "{radiance}");
    }
}

#[test]
fn a_wholly_bad_frame_is_forgotten() {
    let Some(gpu) = Gpu::open() else { return };
    pipelines().iter().for_each(|settings| assert_forgotten(Run::new(&gpu, settings, SIZE)));
}

fn assert_forgotten(mut run: Run<'_>) {
    // The largest radiance is 65504, and less than halves each frame.
    const LAST_FRAME: u32 = 24;
    let bad: [(&str, Pixel); 4] = [
        ("nothing usable", POISON),
        ("NaN radiance", Pixel { radiance: Vec3::NAN, ..WALL }),
        ("largest radiance", Pixel { radiance: Vec3::splat(f32::MAX), ..WALL }),
        ("NaN everywhere but in the surface", Pixel { normal: WALL.normal, depth: 4.0, roughness: 0.5, ..POISON }),
    ];
    for (what, pixel) in bad {
        for bad_frame in [0, 3] {
            for index in 0..=LAST_FRAME {
                let mut frame = support::still_frame(SIZE);
                frame.reset = index == 0;
                let scene = if index == bad_frame { Scene::new(SIZE, |_| pixel) } else { scene(index) };
                let denoised = run.frame(&scene, &frame);
                denoised.assert_usable(&format!("{what}, frame {index}"));
                if index == LAST_FRAME {
                    for p in positions(SIZE) {
                        // All that the scene holds lies between 0.7 and 1.3, and is near 1 in the mean of 8x8.
                        let radiance = denoised.radiance(p);
                        let usual = radiance.min_element() > 0.65 && radiance.max_element() < 1.35;
                        assert!(usual, "{what} in frame {bad_frame}: {radiance} at {p}");
                    }
                }
            }
        }
    }
}

#[test]
fn bad_pixels_everywhere_leave_finite_output() {
    let Some(gpu) = Gpu::open() else { return };
    let spoils: Vec<Spoil> = bad_surfaces().into_iter().chain(bad_motion()).collect();
    for settings in pipelines().into_iter().flat_map(|settings| [settings.clone(), by_motion_only(settings)]) {
        let mut run = Run::new(&gpu, &settings, SIZE);
        for index in 0..8 {
            let mut scene = scene(index);
            for p in positions(SIZE).filter(|p| noise(1000 + index, *p) < 0.3) {
                let (_, spoil) = spoils[(noise(2000 + index, p) * spoils.len() as f32) as usize];
                spoil(scene.at(p));
            }
            let mut frame = support::still_frame(SIZE);
            frame.camera.world_to_view = Mat4::from_translation(Vec3::new(0.02, -0.01, 0.03) * index as f32);
            run.frame(&scene, &frame).assert_usable(&format!("frame {index}"));
        }
    }
}
