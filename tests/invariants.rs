//! What must hold whatever the backend, on the fastest one there is.

use glam::{Mat4, UVec2, Vec3};
use limpid::Preset;
use limpid::settings::{DepthEncoding, Fallback, Pipeline};
use limpid_harness::executor::Cpu;
use limpid_harness::strategy::{any_spec, noise};
use limpid_harness::{Case, Executor, Images, Pixel, Snapshot, Step, for_all, runner};
use proptest::prelude::*;

/// One rounding of a half float, relative.
const HALF_STEP: f32 = 1.0 / 1024.0;

/// A still scene of some size, roughness and noise seed.
fn any_still() -> impl Strategy<Value = (UVec2, f32, u32)> {
    ((1u32..50, 1u32..50).prop_map(UVec2::from), 0.05f32..1.0, 0u32..1000)
}

/// Every texel of the output of the last frame within the size of the image.
fn last_output(run: &[Snapshot]) -> Vec<[f32; 4]> {
    run.last().map(Snapshot::output).unwrap_or_default()
}

#[test]
fn constant_radiance_stays_what_it_is() {
    let radiance = prop::array::uniform3(0.0f32..100.0);
    for_all(
        file!(),
        24,
        (any_still(), radiance, any::<bool>()),
        |executor, ((size, roughness, _), radiance, is_reference)| {
            let [r, g, b] = radiance;
            let mut case = Case::still(size, 4, |_, _| Pixel { radiance: [r, g, b, 3.0], roughness, ..Pixel::WALL });
            if is_reference {
                case.settings = Preset::Reference.settings();
                case.settings.conventions.depth = DepthEncoding::Linear;
            }
            for output in case.run(executor).iter().map(Snapshot::output) {
                for texel in output {
                    for (out, expected) in texel.into_iter().zip(radiance) {
                        // Rounded when it is stored as input, history, average and output, and by the clip's floor; blocks
                        // keep 9 bits of the largest of the three.
                        let block = if is_reference { 0.0 } else { r.max(g).max(b) / 512.0 };
                        let allowed = 4.0 * HALF_STEP * expected + 0.0011 + block;
                        prop_assert!((out - expected).abs() <= allowed, "{} became {}", expected, out);
                    }
                }
            }
            Ok(())
        },
    );
}

#[test]
fn brightness_and_exposure_cancel() {
    for_all(file!(), 16, (any_still(), -6i32..=6), |executor, ((size, roughness, seed), stops)| {
        let factor = 2.0f32.powi(stops);
        let case = |factor: f32| {
            let mut case = Case::still(size, 4, |frame, p| {
                let value = 0.25 + noise(seed + frame, p);
                Pixel { radiance: [value * factor, 0.5 * factor, factor, 3.0], roughness, ..Pixel::WALL }
            });
            case.steps.iter_mut().for_each(|step| step.frame.exposure = 1.0 / factor);
            case
        };
        let plain = last_output(&case(1.0).run(executor));
        let scaled = last_output(&case(factor).run(executor));
        for (plain, scaled) in plain.iter().zip(&scaled) {
            // A power of two changes no digit.
            let expected = [plain[0] * factor, plain[1] * factor, plain[2] * factor, plain[3]];
            prop_assert_eq!(&expected, scaled);
        }
        Ok(())
    });
}

#[test]
fn world_units_do_not_matter() {
    for_all(
        file!(),
        16,
        (any_still(), -12i32..=12, -0.2f32..0.2),
        |executor, ((size, roughness, seed), exponent, step)| {
            let unit = 2.0f32.powi(exponent);
            let case = |unit: f32| {
                let mut case = Case::still(size, 4, |frame, p| Pixel {
                    radiance: [noise(seed + frame, p), 0.5, 1.0, unit * (1.0 + noise(seed, p))],
                    roughness,
                    depth: unit * (4.0 + 0.1 * noise(7, p)),
                    ..Pixel::WALL
                });
                for (frame, frame_step) in case.steps.iter_mut().enumerate() {
                    let moved = Vec3::new(step * frame as f32, 0.0, -0.5 * step) * unit;
                    frame_step.frame.camera.world_to_view = Mat4::from_translation(moved);
                }
                case
            };
            // A power of two changes no digit.
            prop_assert_eq!(last_output(&case(1.0).run(executor)), last_output(&case(unit).run(executor)));
            Ok(())
        },
    );
}

/// Radiance that jumps, seen at two frame rates, is as far on its way after the same time.
#[test]
fn frame_rates_do_not_matter() {
    let any = (0.05f32..1.0, 0.0f32..4.0, 10u32..=60, 10u32..=60, 0.1f32..0.6);
    for_all(file!(), 16, any, |executor, (roughness, after, slow, fast, time)| {
        let mut reached = |rate: u32| {
            // History is as long as it gets after half a second.
            let before = rate;
            let count = before + (time * rate as f32).round() as u32;
            let mut case = Case::still(UVec2::splat(8), count, |frame, _| {
                let value = if frame < before { 1.0 } else { after };
                Pixel { radiance: [value, value, value, 3.0], roughness, ..Pixel::WALL }
            });
            case.settings.features.light_change = false;
            case.settings.features.history_clip = false;
            case.steps.iter_mut().for_each(|step| step.frame.frame_seconds = 1.0 / rate as f32);
            last_output(&case.run(executor))[27][0]
        };
        let (slow, fast) = (reached(slow), reached(fast));
        prop_assert!((slow - fast).abs() <= 0.08 * (after - 1.0).abs() + 0.01, "{} and {}", slow, fast);
        Ok(())
    });
}

/// Filters are as wide in radians at any resolution: a blurred edge looks the same at twice the resolution. Were they as
/// wide in pixels, the mean difference would be 0.02 to 0.05.
#[test]
fn resolution_does_not_matter() {
    let sizes = (32u32..80, 16u32..40).prop_map(UVec2::from);
    for_all(
        file!(),
        16,
        (sizes, 0.7f32..1.0, 0.5f32..4.0, 0.3f32..0.7),
        |executor, (size, roughness, distance, edge)| {
            let edge = (edge * size.x as f32) as u32;
            let mut run = |scale: u32| {
                let case = Case::still(scale * size, 6, |_, p| {
                    let value = if p.x < scale * edge { 0.1 } else { 1.0 };
                    Pixel { radiance: [value, value, value, distance], roughness, ..Pixel::WALL }
                });
                last_output(&case.run(executor))
            };
            let (coarse, fine) = (run(1), run(2));
            let mut difference = 0.0;
            for (index, texel) in coarse.iter().enumerate() {
                let (x, y) = (2 * (index as u32 % size.x), 2 * (index as u32 / size.x));
                let at = |dx: u32, dy: u32| fine[((y + dy) * 2 * size.x + x + dx) as usize][0];
                let mean = (at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1)) / 4.0;
                difference += (mean - texel[0]).abs() / coarse.len() as f32;
            }
            prop_assert!(difference <= 0.015, "{}", difference);
            Ok(())
        },
    );
}

#[test]
fn a_mirrored_scene_gives_a_mirrored_image() {
    let sizes = (1u32..5, 1u32..40).prop_map(|(tiles, height)| UVec2::new(8 * tiles, height));
    for_all(file!(), 16, (sizes, 0.1f32..1.0, 0u32..1000), |executor, (size, roughness, seed)| {
        let pixel = |frame: u32, p: UVec2| {
            let value = 1.0 + 0.2 * noise(seed + frame, p);
            let depth = if p.x < size.x / 3 { 3.0 } else { 4.0 };
            Pixel { radiance: [value, value, value, 3.0], roughness, depth, motion: [0.01, 0.0], ..Pixel::WALL }
        };
        let mirrored = |frame: u32, p: UVec2| {
            let pixel = pixel(frame, UVec2::new(size.x - 1 - p.x, p.y));
            Pixel { motion: [-pixel.motion[0], pixel.motion[1]], ..pixel }
        };
        let plain = last_output(&Case::still(size, 4, pixel).run(executor));
        let flipped = last_output(&Case::still(size, 4, mirrored).run(executor));
        let row = |output: &[[f32; 4]], y: u32| output[(y * size.x) as usize..((y + 1) * size.x) as usize].to_vec();
        let mut difference = 0.0;
        for y in 0..size.y {
            let (plain, mut flipped) = (row(&plain, y), row(&flipped, y));
            flipped.reverse();
            for (a, b) in plain.iter().zip(&flipped) {
                // The taps of the published prefilter are not symmetric: of noise of 20 % a part is left, that differs.
                prop_assert!((a[0] - b[0]).abs() < 0.08, "{} and {}", a[0], b[0]);
                difference += f64::from(a[0] - b[0]);
            }
        }
        // On average both are the same.
        prop_assert!((difference / f64::from(size.element_product())).abs() < 0.004);
        Ok(())
    });
}

#[test]
fn a_still_image_comes_to_rest() {
    for_all(file!(), 8, any_still(), |executor, (size, roughness, seed)| {
        let case = Case::still(size, 60, |_, p| {
            let value = noise(seed, p);
            Pixel { radiance: [value, value * 0.5, 1.0, 3.0], roughness, ..Pixel::WALL }
        });
        let run = case.run(executor);
        let change = |a: &Snapshot, b: &Snapshot| {
            let pairs = a.output().into_iter().zip(b.output());
            pairs.map(|(a, b)| (a[0] - b[0]).abs()).fold(0.0f32, f32::max)
        };
        let early = change(&run[1], &run[2]);
        let late = change(&run[58], &run[59]);
        prop_assert!(late <= 2.0 * HALF_STEP, "still moves by {}, at first by {}", late, early);
        Ok(())
    });
}

/// Pixels around one that a single frame's value can reach: three tiles for the 8x8 average, then what the next
/// frames' neighbourhoods add.
const FOOTPRINT: i32 = 24;

#[test]
fn what_is_no_number_counts_as_black_and_is_soon_forgotten() {
    let poison = prop::sample::select(vec![f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0]);
    let place = (0.0f32..1.0, 0.0f32..1.0);
    for_all(file!(), 12, (any_still(), poison, place), |executor, ((size, roughness, seed), poison, place)| {
        let at = (size.as_vec2() * glam::Vec2::from(place)).as_uvec2().min(size - 1);
        let run = |executor: &mut dyn Executor, value: Option<f32>| {
            let case = Case::still(size, 40, |frame, p| {
                let mut radiance = [0.5 + noise(seed + frame, p), 0.5, 1.0, 3.0];
                if let Some(value) = value.filter(|_| frame == 2 && p == at) {
                    radiance = [value, value, value, 3.0];
                }
                Pixel { radiance, roughness, ..Pixel::WALL }
            });
            case.run(executor)
        };
        let (poisoned, black, clean) = (run(executor, Some(poison)), run(executor, Some(0.0)), run(executor, None));
        for (poisoned, black) in poisoned.iter().zip(&black) {
            prop_assert_eq!(poisoned.output(), black.output());
        }
        let outputs = poisoned[2].output().into_iter().zip(clean[2].output());
        for (index, _) in outputs.enumerate().filter(|(_, (a, b))| a != b) {
            let p = glam::IVec2::new(index as i32 % size.x as i32, index as i32 / size.x as i32);
            let reach = (p - at.as_ivec2()).abs().max_element();
            prop_assert!(reach <= FOOTPRINT, "reaches {} pixels", reach);
        }
        let last = last_output(&poisoned).into_iter().zip(last_output(&clean));
        for (a, b) in last {
            prop_assert!((a[0] - b[0]).abs() <= 0.05 * b[0], "{} instead of {}", a[0], b[0]);
        }
        Ok(())
    });
}

/// A case for which the renderer supplies last frame's G-buffer.
fn supplied(mut case: Case, pipeline: Pipeline) -> Case {
    case.settings.pipeline = pipeline;
    (case.settings.features.gbuffer_copy, case.settings.features.packed_guide) = (false, false);
    case
}

fn any_pipeline() -> impl Strategy<Value = Pipeline> {
    prop::sample::select(vec![Pipeline::Footprint, Pipeline::Published])
}

/// Runs a case with other images in the place of last frame's G-buffer, in some frames.
fn run_with_prev(case: &Case, executor: &mut dyn Executor, prev: impl Fn(usize) -> Option<Images>) -> Vec<Snapshot> {
    executor.start(case.core());
    let frame = |(index, step): (usize, &Step)| {
        let mut images = case.images(index);
        if let Some(prev) = prev(index) {
            images = step.images.images(&prev);
        }
        executor.frame(&images, &step.frame)
    };
    case.steps.iter().enumerate().map(frame).collect()
}

#[test]
fn what_is_supplied_of_last_frame_matters_only_where_there_is_history() {
    let anything = prop::sample::select(vec![0.0, 1.0, 4.0, -1.0, f32::NAN, f32::INFINITY, 3e38]);
    let any = (any_still(), any_pipeline(), anything, 1usize..4);
    for_all(file!(), 12, any, |executor, ((size, roughness, seed), pipeline, value, cut)| {
        let mut case = Case::still(size, 5, |frame, p| Pixel {
            radiance: [0.5 + noise(seed + frame, p), 0.5, 1.0, 3.0],
            roughness,
            ..Pixel::WALL
        });
        case.steps[cut].frame.reset = true;
        let case = supplied(case, pipeline);
        let nonsense =
            |size| Images::new(size, |_| Pixel { normal: [value; 3], roughness: value, depth: value, ..Pixel::WALL });
        let right = case.run(executor);
        // Where there is no history a texel will do.
        let other = run_with_prev(&case, executor, |index| (index == 0 || index == cut).then(|| nonsense(UVec2::ONE)));
        for (right, other) in right.iter().zip(&other) {
            prop_assert_eq!(&right.0["output"], &other.0["output"]);
        }
        // Elsewhere it is the difference between history and none.
        let other = run_with_prev(&case, executor, |index| (index == 4).then(|| nonsense(size)));
        prop_assert!(other[4].is_finite());
        let is_surface = value == 4.0;
        prop_assert!(is_surface || right[4].output() != other[4].output(), "{} is as good", value);
        Ok(())
    });
}

#[test]
fn what_is_no_surface_in_last_frames_gbuffer_costs_history_there_alone() {
    let poison = prop::sample::select(vec![f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 0.0]);
    let place = (0.0f32..1.0, 0.0f32..1.0);
    let any = (any_still(), any_pipeline(), poison, 0usize..3, place);
    for_all(file!(), 12, any, |executor, ((size, roughness, seed), pipeline, poison, which, place)| {
        let at = (size.as_vec2() * glam::Vec2::from(place)).as_uvec2().min(size - 1);
        let case = Case::still(size, 3, |frame, p| Pixel {
            radiance: [0.5 + noise(seed + frame, p), 0.5, 1.0, 3.0],
            roughness,
            ..Pixel::WALL
        });
        let case = supplied(case, pipeline);
        let poisoned = run_with_prev(&case, executor, |index| {
            (index == 2).then(|| {
                Images::new(size, |p| match (p == at, which) {
                    (false, _) => Pixel { roughness, ..Pixel::WALL },
                    (true, 0) => Pixel { normal: [poison; 3], roughness, ..Pixel::WALL },
                    // No roughness is no surface, but 0 is one.
                    (true, 1) => Pixel { roughness: if poison == 0.0 { f32::NAN } else { poison }, ..Pixel::WALL },
                    (true, _) => Pixel { depth: poison, roughness, ..Pixel::WALL },
                })
            })
        });
        prop_assert!(poisoned[2].is_finite());
        for (index, (a, b)) in poisoned[2].output().into_iter().zip(case.run(executor)[2].output()).enumerate() {
            let p = glam::IVec2::new(index as i32 % size.x as i32, index as i32 / size.x as i32);
            prop_assert!(a == b || (p - at.as_ivec2()).abs().max_element() <= FOOTPRINT, "reaches {}", p);
        }
        Ok(())
    });
}

#[test]
fn the_sky_keeps_its_fallback() {
    for_all(file!(), 12, (any_still(), any::<bool>()), |executor, ((size, roughness, seed), is_black)| {
        let is_sky = |p: UVec2| noise(seed ^ 77, p / 5) < 0.5;
        let mut case = Case::still(size, 3, |frame, p| {
            let depth = if is_sky(p) { 0.0 } else { 4.0 };
            // Exact in half floats.
            let value = (noise(seed + frame, p) * 64.0).floor() / 64.0;
            Pixel { radiance: [value; 4], roughness, depth, ..Pixel::WALL }
        });
        case.settings.coverage.fallback = if is_black { Fallback::Black } else { Fallback::Input };
        let run = case.run(executor);
        for (step, snapshot) in case.steps.iter().zip(&run) {
            for (index, texel) in snapshot.output().into_iter().enumerate() {
                let p = UVec2::new(index as u32 % size.x, index as u32 / size.x);
                if is_sky(p) {
                    let [r, g, b, _] = step.images.pixels[index].radiance;
                    let expected = if is_black { [0.0; 4] } else { [r, g, b, 0.0] };
                    prop_assert_eq!(texel, expected);
                }
            }
        }
        Ok(())
    });
}

/// What happens before a frame of a random sequence, or in it.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Event {
    Nothing,
    Reset,
    /// A frame is classified and never denoised.
    Abandoned,
    /// The frame uses a part of its textures.
    Part,
    Resize,
    /// Settings that keep history: kernels, and what is left out.
    NearTaps,
    Threshold,
    /// The other fallback.
    Fallback,
}

/// Tiles of sky that come and go, each in its time.
fn comes_and_goes(seed: u32, frame: u32, p: UVec2) -> bool {
    let tile = p / 8;
    let time = frame + (7.0 * noise(seed, tile)) as u32;
    noise(seed + time / (1 + (4.0 * noise(seed ^ 99, tile)) as u32), tile) < 0.6
}

/// A texel of the output, and what it has to be if nothing is denoised there.
type Texel = ([f32; 4], Option<[f32; 4]>);

/// The texels of each frame of a sequence that begins with a fallback.
fn run_of_events(pipeline: Pipeline, is_black: bool, seed: u32, events: &[Event]) -> Vec<Vec<Texel>> {
    const SIZE: UVec2 = UVec2::new(45, 27);
    const ROUGHNESS: f32 = 0.25;
    let mut case = Case::still(SIZE, events.len() as u32, |frame, p| {
        // The surface of `WALL_WORD`, which memory holds in one of two runs.
        let depth = if comes_and_goes(seed, frame, p) { 0.0 } else { 2.5 };
        // Exact in half floats.
        let value = 1.0 + (noise(seed + frame, p) * 64.0).floor() / 64.0;
        Pixel { radiance: [value; 4], roughness: ROUGHNESS, depth, ..Pixel::WALL }
    });
    case.settings.pipeline = pipeline;
    let mut executor = Cpu::overwritten(if is_black { WALL_WORD } else { 0 });
    executor.start(case.core());
    let frame = |(index, event): (usize, &Event)| {
        let mut settings = case.settings.clone();
        let is_black = is_black != (*event == Event::Fallback);
        settings.coverage.fallback = if is_black { Fallback::Black } else { Fallback::Input };
        let (images, mut frame) = (case.images(index), case.steps[index].frame.clone());
        match event {
            Event::Nothing | Event::Fallback => {}
            Event::Reset => frame.reset = true,
            Event::Abandoned => executor.abandon(&images, &frame),
            Event::Part => frame.size = UVec2::new(34, 20),
            Event::Resize => executor.resize(SIZE),
            Event::NearTaps => settings.features.near_taps = 4,
            Event::Threshold => settings.coverage.roughness_threshold = 0.2,
        }
        executor.set_settings(&settings);
        let output = executor.frame(&images, &frame).output();
        let expected = case.steps[index].images.pixels.iter().map(|pixel| {
            let is_left_out = pixel.depth == 0.0 || ROUGHNESS > settings.coverage.roughness_threshold;
            let [r, g, b, _] = pixel.radiance;
            is_left_out.then_some(if is_black { [0.0; 4] } else { [r, g, b, 0.0] })
        });
        let texels = (0..).zip(output.into_iter().zip(expected));
        let is_inside = |i: u32| UVec2::new(i % SIZE.x, i / SIZE.x).cmplt(frame.size).all();
        texels.filter(|(index, _)| is_inside(*index)).map(|(_, texel)| texel).collect()
    };
    events.iter().enumerate().map(frame).collect()
}

/// Tiles that stay left out are not written again: nothing that comes between may make them stale, or let what they hold
/// reach what is denoised.
#[test]
fn what_is_left_out_holds_its_fallback_whatever_happens() {
    use Event::{Abandoned, Fallback, NearTaps, Nothing, Part, Reset, Resize, Threshold};
    let event = prop_oneof![
        4 => Just(Nothing),
        1 => prop::sample::select(vec![Reset, Abandoned, Part, Resize, NearTaps, Threshold, Fallback]),
    ];
    let any = (any_pipeline(), 0u32..1000, prop::collection::vec(event, 8..20));
    let (mut runner, _) = runner(file!(), 24);
    let result = runner.run(&any, |(pipeline, seed, events)| {
        let [black, input] = [true, false].map(|is_black| run_of_events(pipeline, is_black, seed, &events));
        for (frame, (black, input)) in black.iter().zip(&input).enumerate() {
            for (index, (black, input)) in black.iter().zip(input).enumerate() {
                let is_as_expected = match (black, input) {
                    ((a, Some(black)), (b, Some(input))) => a == black && b == input,
                    ((a, _), (b, _)) => a == b,
                };
                prop_assert!(is_as_expected, "frame {}, texel {}: {:?}, {:?}", frame, index, black, input);
            }
        }
        Ok(())
    });
    if let Err(error) = result {
        panic!("{error}");
    }
}

#[test]
fn the_output_stays_between_the_darkest_and_the_brightest_input() {
    for_all(
        file!(),
        16,
        (any_still(), 0.0f32..10.0, 0.01f32..1000.0),
        |executor, ((size, roughness, seed), low, range)| {
            let mut case = Case::still(size, 6, |frame, p| {
                let value = low + range * noise(seed + frame, p);
                Pixel { radiance: [value, value, value, 3.0], roughness, ..Pixel::WALL }
            });
            case.settings = Preset::Reference.settings();
            case.settings.conventions.depth = DepthEncoding::Linear;
            case.settings.coverage.roughness_threshold = 1.0;
            for texel in case.run(executor).iter().flat_map(Snapshot::output) {
                let slack = 0.002 + 4.0 * HALF_STEP * texel[0];
                prop_assert!(texel[0] >= low - slack && texel[0] <= low + range + slack, "{}", texel[0]);
            }
            Ok(())
        },
    );
}

/// As a packed guide a wall 2.5 units away that faces a camera which looks along -z, of roughness 0.25.
const WALL_WORD: u32 = 0x4020_0400;

/// Whether the output is the same when transient memory holds a word before each frame.
fn memory_does_not_matter(case: &Case, word: u32) -> Result<(), TestCaseError> {
    let (run, overwritten) = (case.run(&mut Cpu::new()), case.run(&mut Cpu::overwritten(word)));
    for (frame, (run, overwritten)) in run.iter().zip(&overwritten).enumerate() {
        prop_assert!(run.output() == overwritten.output(), "frame {}, {:x}", frame, word);
    }
    Ok(())
}

/// Other work may use the memory of what lives within a frame: nothing reads there what it has not written, not even in
/// tiles that nothing is denoised in.
#[test]
fn memory_that_lives_within_a_frame_may_hold_anything_before_it() {
    /// NaN as a float and as two half floats, and depths at which something is denoised.
    const WORDS: [u32; 3] = [0x7fc0_7e00, 0x4040_4040, WALL_WORD];
    let (mut runner, _) = runner(file!(), 24);
    let result = runner.run(&any_spec(), |spec| {
        let case = spec.case();
        WORDS.iter().try_for_each(|word| memory_does_not_matter(&case, *word))
    });
    if let Err(error) = result {
        panic!("{error}");
    }
}

/// The surface of [`WALL_WORD`] beside tiles of sky, of which nothing but filters of the tiles around could tell.
#[test]
fn filters_do_not_see_what_memory_held_in_tiles_that_are_left_out() {
    for preset in [Preset::Default, Preset::Fast, Preset::Reference] {
        for fallback in [Fallback::Black, Fallback::Input, Fallback::Environment] {
            let mut case = Case::still(UVec2::new(61, 40), 3, |frame, p| {
                let depth = if noise(11, p / 8) < 0.5 { 0.0 } else { 2.5 };
                Pixel { radiance: [noise(frame, p), 0.5, 1.0, 3.0], roughness: 0.25, depth, ..Pixel::WALL }
            });
            case.settings = preset.settings();
            case.settings.conventions.depth = DepthEncoding::Linear;
            case.settings.coverage.fallback = fallback;
            memory_does_not_matter(&case, WALL_WORD).unwrap();
        }
    }
}

/// The checked mode of the CPU runs workgroups one after the other, the other mode as threads come.
#[test]
fn the_order_of_workgroups_does_not_matter() {
    let (mut runner, _) = runner(file!(), 16);
    let result = runner.run(&any_spec(), |spec| {
        let case = spec.case();
        let mut watched = Cpu::watched();
        prop_assert_eq!(case.run(&mut watched), case.run(&mut Cpu::new()));
        prop_assert_eq!(watched.faults(), Vec::<String>::new());
        Ok(())
    });
    if let Err(error) = result {
        panic!("{error}");
    }
}

#[test]
fn pairs_of_outliers_are_bounded_from_the_first_frame_unless_all_else_is_black() {
    let mut executor = limpid_harness::fastest();
    let size = UVec2::splat(32);
    // Pixel by pixel, without the filter, which does not trust what stands out in a narrow footprint; and by whole blocks.
    for (roughness, is_filtered) in [(0.1, false), (0.9, true)] {
        let mut brightest_and_mean = |others: f32| {
            let mut case = Case::still(size, 1, |_, p| {
                let is_bright = p.y % 4 == 1 && p.x % 4 / 2 == 0;
                let value = if is_bright { 1000.0 } else { others };
                Pixel { radiance: [value, value, value, 3.0], roughness, ..Pixel::WALL }
            });
            case.settings.features.spatial_filter = is_filtered;
            let output = last_output(&case.run(&mut *executor));
            let values = output.iter().map(|texel| texel[0]);
            (values.clone().fold(0.0, f32::max), values.sum::<f32>() / output.len() as f32)
        };
        // 12 times 6 times the third brightest.
        let (brightest, _) = brightest_and_mean(0.05);
        assert!(brightest < 1.1 * 72.0 * 0.05, "roughness {roughness}: {brightest}");
        let (_, mean) = brightest_and_mean(0.0);
        assert!(mean > 0.9 * 125.0, "roughness {roughness}: {mean}");
    }
}
