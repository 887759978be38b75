//! Debug views show what they say, in the colours of their legend, and change nothing else.

use std::cell::RefCell;
use std::collections::HashSet;

use glam::{DMat4, DVec3, DVec4, Mat4, Quat, UVec2, Vec3};
use limpid::plan::DEBUG_VIEW;
use limpid::settings::Pipeline;
use limpid::{Camera, DebugView, Error, Legend, Plan, Preset, Settings};
use limpid_harness::executor::{Ash, AshOptions, Cpu};
use limpid_harness::strategy::{any_spec, noise};
use limpid_harness::{Case, Executor, Images, Pixel, Snapshot, Table, executors, fastest, runner, skip};
use proptest::prelude::*;

const SIZE: UVec2 = UVec2::new(45, 29);
const PIPELINES: [Pipeline; 2] = [Pipeline::Footprint, Pipeline::Published];

/// A few steps of half floats.
const TOLERANCE: f32 = 0.004;

fn is_near(a: [f32; 3], b: [f32; 3]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= TOLERANCE)
}

/// The colour that a legend gives to a word.
fn color_of(view: DebugView, label: &str) -> [f32; 3] {
    let legend = view.legend();
    legend.ramp.iter().chain(legend.keys).find(|key| key.label == label).expect(label).color
}

/// The colour at a place of a legend's ramp, 0 to 1.
fn on_ramp(legend: &Legend, t: f32) -> [f32; 3] {
    let last = legend.ramp.len() - 1;
    let place = t.clamp(0.0, 1.0) * last as f32;
    let index = (place as usize).min(last - 1);
    let (from, to) = (legend.ramp[index].color, legend.ramp[index + 1].color);
    std::array::from_fn(|i| from[i] + (to[i] - from[i]) * (place - index as f32))
}

/// Whether a legend explains a colour.
fn is_explained(legend: &Legend, color: [f32; 3]) -> bool {
    let between = |from: [f32; 3], to: [f32; 3]| {
        let along: f32 = (0..3).map(|i| (color[i] - from[i]) * (to[i] - from[i])).sum();
        let squared: f32 = (0..3).map(|i| (to[i] - from[i]).powi(2)).sum();
        let t = (along / squared).clamp(0.0, 1.0);
        is_near(color, std::array::from_fn(|i| from[i] + (to[i] - from[i]) * t))
    };
    legend.keys.iter().any(|key| is_near(color, key.color))
        || legend.ramp.windows(2).any(|pair| between(pair[0].color, pair[1].color))
}

fn colors(snapshot: &Snapshot) -> Vec<[f32; 3]> {
    snapshot.half_texels(DEBUG_VIEW).into_iter().map(|[r, g, b, _]| [r, g, b]).collect()
}

/// A case with a view on in a pipeline.
fn shown(case: &Case, pipeline: Pipeline, view: DebugView) -> Case {
    let mut case = case.clone();
    case.settings.pipeline = pipeline;
    case.settings.features.debug_view = Some(view);
    case
}

/// The view after each frame.
fn run(case: &Case, executor: &mut dyn Executor, pipeline: Pipeline, view: DebugView) -> Vec<Vec<[f32; 3]>> {
    shown(case, pipeline, view).run(executor).iter().map(colors).collect()
}

fn all_views() -> impl Iterator<Item = (Pipeline, DebugView)> {
    let views = DebugView::ALL.iter().map(|(_, view)| *view);
    views.flat_map(|view| PIPELINES.map(|pipeline| (pipeline, view)))
}

#[test]
fn a_view_is_one_pass_and_one_texture_more_and_none_costs_nothing() {
    for (pipeline, view) in all_views() {
        let mut settings = Settings::default();
        settings.pipeline = pipeline;
        let (off, off_kernels) = Plan::new(&settings, SIZE).unwrap();
        settings.features.debug_view = Some(view);
        let (mut on, mut on_kernels) = Plan::new(&settings, SIZE).unwrap();
        let index = on.passes.iter().position(|pass| pass.name == DEBUG_VIEW).unwrap();
        let (pass, _) = (on.passes.remove(index), on_kernels.remove(index));
        on.resources.retain(|resource| resource.name != DEBUG_VIEW);
        assert_eq!(on, off, "{view:?}");
        for (on, off) in on_kernels.iter().zip(&off_kernels) {
            let words = |kernel: &limpid::kernel::Kernel| kernel.spirv(&Default::default()).unwrap();
            assert_eq!(words(on), words(off), "{view:?} {}", on.name);
        }
        // It binds what the view reads alone.
        let reads: HashSet<_> = pass.bindings.iter().map(|bound| bound.resource.as_str()).collect();
        assert!(reads.contains("frame") && reads.contains("guide") && reads.contains(DEBUG_VIEW));
        let looks_again = matches!(view, DebugView::Disocclusion | DebugView::Candidate);
        assert!(looks_again || reads.len() <= 5, "{view:?} {reads:?}");
    }
}

#[test]
fn views_that_have_nothing_to_show_are_refused() {
    let mut settings = Settings::default();
    settings.features.surface_motion = false;
    settings.features.debug_view = Some(DebugView::MotionError);
    let error = Plan::new(&settings, SIZE).unwrap_err();
    assert!(matches!(error, Error::Features { .. }) && error.to_string().contains("motion-error"), "{error}");
    settings = Preset::Reference.settings();
    settings.features.debug_view = Some(DebugView::Average);
    assert!(settings.validate().is_ok());
    (settings.features.spatial_filter, settings.features.history_clip) = (false, false);
    settings.features.average_mixing = false;
    assert!(settings.validate().unwrap_err().to_string().contains("debug view average"));
}

#[test]
fn names_are_those_of_settings_and_numbers_those_of_the_kernels() {
    for (index, (name, view)) in DebugView::ALL.iter().enumerate() {
        assert_eq!(serde_json::to_value(view).unwrap(), *name);
        assert_eq!(*view as usize, index);
    }
    let text = std::fs::read_to_string("kernels/shared/debug_view.wgsl").unwrap();
    for (name, view) in DebugView::ALL {
        let constant = format!("const {}: u32 = {}u;", name.to_uppercase().replace('-', "_"), *view as u32);
        assert!(text.contains(&constant), "{constant}");
    }
}

/// A still wall, noisy, seen straight on. No history is rejected by its colour.
fn wall(roughness: f32, frames: u32) -> Case {
    let mut case = Case::still(SIZE, frames, |frame, p| {
        let value = 0.9 + 0.2 * noise(frame, p);
        Pixel { radiance: [value, value, value, 3.0], roughness, ..Pixel::WALL }
    });
    case.settings.reproject.surface_color_gate = 10_000.0;
    case
}

#[test]
fn history_is_red_at_the_beginning_and_after_a_cut() {
    let executor = &mut *fastest();
    let mut case = wall(0.5, 6);
    case.steps[4].frame.reset = true;
    let view = DebugView::HistoryLength;
    for pipeline in PIPELINES {
        for (frame, colors) in run(&case, executor, pipeline, view).into_iter().enumerate() {
            let length = if frame < 4 { frame + 1 } else { frame - 3 } as f32;
            let grown = on_ramp(&view.legend(), (length.log2() - 1.0) / 4.0);
            let expected = if length == 1.0 { color_of(view, "begins anew") } else { grown };
            // Lengths are stored in steps, and trust in history is a little below 1.
            let near = |color: &[f32; 3]| color.iter().zip(expected).all(|(a, b)| (a - b).abs() < 0.05);
            assert!(colors.iter().all(near), "{pipeline:?}, frame {frame}: {:?} {expected:?}", colors[0]);
        }
    }
}

#[test]
fn what_is_uncovered_is_red_and_what_is_outside_blue() {
    let executor = &mut *fastest();
    // A near wall over the left half goes away, and the camera looks further to the right.
    let is_left = |p: UVec2| p.x < SIZE.x / 2;
    let near = |frame: u32, p: UVec2| is_left(p) && frame < 2;
    let mut case = wall(0.5, 4);
    for (frame, step) in case.steps.iter_mut().enumerate() {
        let motion = if frame == 3 { [-0.5, 0.0] } else { [0.0; 2] };
        let depth = |p| if near(frame as u32, p) { 1.0 } else { 4.0 };
        let radiance = |p| [noise(frame as u32, p); 4];
        let pixel = |p| Pixel { depth: depth(p), motion, radiance: radiance(p), ..Pixel::WALL };
        step.images = Images::new(SIZE, pixel);
    }
    case.settings.features.mirror_parallax = false;
    let view = DebugView::Disocclusion;
    let (found, covered, outside) = (
        color_of(view, "has history"),
        color_of(view, "something else was there"),
        color_of(view, "outside, or no last frame"),
    );
    for pipeline in PIPELINES {
        let frames = run(&case, executor, pipeline, view);
        let candidates = run(&case, executor, pipeline, DebugView::Candidate);
        let none = color_of(DebugView::Candidate, "none found");
        // Around the seam both can be.
        let clear = |index: &usize| (*index as u32 % SIZE.x).abs_diff(SIZE.x / 2) > 2;
        for index in (0..frames[0].len()).filter(clear) {
            let left = is_left(UVec2::new(index as u32 % SIZE.x, 0));
            let expected = [outside, found, if left { covered } else { found }, if left { found } else { outside }];
            for frame in 0..4 {
                assert!(is_near(frames[frame][index], expected[frame]), "{pipeline:?}, {frame}, {index}");
                let has_none = is_near(candidates[frame][index], none);
                assert_eq!(has_none, expected[frame] != found, "{pipeline:?}, {frame}, {index}");
            }
        }
    }
}

#[test]
fn the_candidate_of_mirrors_is_what_they_reflect() {
    let executor = &mut *fastest();
    let view = DebugView::Candidate;
    for (roughness, expected) in [(0.5, "surface"), (0.005, "reflection")] {
        let last = run(&wall(roughness, 2), executor, Pipeline::Footprint, view).pop().unwrap();
        assert!(last.iter().all(|&color| is_near(color, color_of(view, expected))), "{roughness} {:?}", last[0]);
    }
    // One of the two alone, by roughness.
    for (roughness, expected) in [(0.3, "surface"), (0.11, "surface"), (0.09, "reflection")] {
        let mut case = wall(roughness, 2);
        case.settings.features.both_histories = false;
        let last = run(&case, executor, Pipeline::Footprint, view).pop().unwrap();
        assert!(last.iter().all(|&color| is_near(color, color_of(view, expected))), "{roughness} {:?}", last[0]);
    }
    for (off, expected) in [("surface_motion", "reflection"), ("mirror_parallax", "surface")] {
        let mut case = wall(0.3, 2);
        case.settings.features.surface_motion = off != "surface_motion";
        case.settings.features.mirror_parallax = off != "mirror_parallax";
        for pipeline in PIPELINES {
            let last = run(&case, executor, pipeline, view).pop().unwrap();
            assert!(last.iter().all(|&color| is_near(color, color_of(view, expected))), "{off} {:?}", last[0]);
        }
    }
}

/// A camera that goes and turns, over a wall of some depth at every pixel; motion by projecting with last frame's
/// matrices in 64 bits, times a factor.
fn moving(factor: f32) -> Case {
    let camera = |frame: u32| {
        let turn = Quat::from_rotation_y(0.02 * frame as f32) * Quat::from_rotation_x(-0.01 * frame as f32);
        let world_to_view = Mat4::from_quat(turn) * Mat4::from_translation(Vec3::new(-0.1, 0.03, 0.05) * frame as f32);
        Camera { world_to_view, ..Case::camera(SIZE) }
    };
    let mut case = wall(0.5, 3);
    for (frame, step) in (0..).zip(&mut case.steps) {
        step.frame.camera = camera(frame);
        let (now, before) = (camera(frame), camera(frame.max(1) - 1));
        let to_clip = |camera: &Camera| camera.view_to_clip.as_dmat4() * camera.world_to_view.as_dmat4();
        step.images = Images::new(SIZE, |p| {
            let depth = 3.0 + noise(9, p);
            let uv = (p.as_dvec2() + 0.5) / SIZE.as_dvec2();
            let motion = uv - uv_of(to_clip(&before), world_at(&now, uv.extend(depth.into())));
            Pixel { depth, motion: (motion.as_vec2() * factor).to_array(), ..Pixel::WALL }
        });
    }
    case
}

/// The place in the world at a uv and a linear depth.
fn world_at(camera: &Camera, place: DVec3) -> DVec3 {
    let clip = camera.view_to_clip.as_dmat4();
    let ndc = DVec3::new(place.x * 2.0 - 1.0, 1.0 - place.y * 2.0, 0.0);
    let view = DVec3::new(ndc.x / clip.x_axis.x, ndc.y / clip.y_axis.y, -1.0) * place.z;
    camera.world_to_view.as_dmat4().inverse().transform_point3(view)
}

fn uv_of(to_clip: DMat4, world: DVec3) -> glam::DVec2 {
    let clip: DVec4 = to_clip * world.extend(1.0);
    glam::DVec2::new(0.5 + 0.5 * clip.x / clip.w, 0.5 - 0.5 * clip.y / clip.w)
}

#[test]
fn right_motion_is_black_and_wrong_motion_shows_by_how_much() {
    let executor = &mut *fastest();
    let view = DebugView::MotionError;
    let (fine, unknown) = (color_of(view, "as in a static scene"), color_of(view, "no surface or no last frame"));
    for pipeline in PIPELINES {
        let right = run(&moving(1.0), executor, pipeline, view);
        assert!(right[0].iter().all(|&color| is_near(color, unknown)));
        assert!(right[1..].iter().flatten().all(|&color| is_near(color, fine)), "{pipeline:?}");
        let case = moving(-1.0);
        let flipped = run(&case, executor, pipeline, view);
        for (step, colors) in case.steps.iter().zip(&flipped).skip(1) {
            for (pixel, color) in step.images.pixels.iter().zip(colors) {
                let error = 2.0 * (glam::Vec2::from(pixel.motion) * SIZE.as_vec2()).length();
                assert!(error > 1.0, "the camera moves everywhere");
                let expected = on_ramp(&view.legend(), (error.log2() + 3.0) / 8.0);
                assert!(is_near(*color, expected), "{pipeline:?}: {error} pixels, {color:?}, {expected:?}");
            }
        }
    }
}

#[test]
fn inputs_are_shown_as_they_are_and_what_is_no_number_magenta() {
    let executor = &mut *fastest();
    let distances = [2.0, 4.0, 12.0, f32::INFINITY, 0.0, -1.0, f32::NAN];
    let mut case = wall(0.5, 2);
    for step in &mut case.steps {
        step.images = Images::new(SIZE, |p| {
            let motion = if p.y == 3 { [f32::NAN, 0.0] } else { [0.0; 2] };
            let distance = distances[p.x as usize % distances.len()];
            Pixel { radiance: [0.5, 1.0, 3.0, distance], motion, ..Pixel::WALL }
        });
    }
    for pipeline in PIPELINES {
        let view = DebugView::HitDistance;
        let bad = color_of(view, "0, negative or no number");
        for (index, &color) in run(&case, executor, pipeline, view)[1].iter().enumerate() {
            let distance = distances[index % SIZE.x as usize % distances.len()];
            let share = if distance.is_infinite() { 1.0 } else { distance / (distance + 4.0) };
            let expected = if distance > 0.0 { on_ramp(&view.legend(), share) } else { bad };
            assert!(is_near(color, expected), "{pipeline:?} {distance} {color:?} {expected:?}");
        }
        let view = DebugView::MotionError;
        for (index, &color) in run(&case, executor, pipeline, view)[1].iter().enumerate() {
            let expected = if index / SIZE.x as usize == 3 { "no number" } else { "as in a static scene" };
            assert!(is_near(color, color_of(view, expected)), "{pipeline:?} {index}");
        }
        let average = [1.0 / 3.0, 0.5, 0.75];
        let all = run(&case, executor, pipeline, DebugView::Average);
        assert!(all.iter().flatten().all(|&color| is_near(color, average)), "{pipeline:?} {:?}", all[0][0]);
    }
}

#[test]
fn tiles_are_those_of_the_list() {
    let executor = &mut *fastest();
    let roughness = |p: UVec2| match noise(5, p / 4) {
        value if value < 0.4 => 0.003,
        value if value < 0.6 => 0.3,
        _ => 0.9,
    };
    let mut case = wall(0.5, 1);
    case.steps[0].images = Images::new(SIZE, |p| Pixel { roughness: roughness(p), ..Pixel::WALL });
    case.settings.coverage.roughness_threshold = 0.5;
    case.settings.features.whole_blocks = false;
    let view = DebugView::TileClasses;
    for pipeline in PIPELINES {
        let snapshot = shown(&case, pipeline, view).run(executor).remove(0);
        let listed: HashSet<_> = snapshot.0["tiles"][..snapshot.0["args"][3] as usize].iter().copied().collect();
        let mut seen = HashSet::new();
        for (index, color) in (0..).zip(colors(&snapshot)) {
            let p = UVec2::new(index % SIZE.x, index / SIZE.x);
            let tile = p / 8;
            let inside = (0..64).map(|i| tile * 8 + UVec2::new(i % 8, i / 8)).filter(|p| p.cmplt(SIZE).all());
            let denoised: Vec<_> = inside.map(roughness).filter(|r| *r <= 0.5).collect();
            let mirrors = denoised.iter().filter(|r| **r < 0.01).count();
            let expected = match denoised.len() {
                0 => "nothing to denoise",
                count if mirrors == count => "mirrors",
                _ if mirrors == 0 => "rougher surfaces",
                _ => "both",
            };
            assert!(is_near(color, color_of(view, expected)), "{p}: {color:?}, {expected}");
            assert_eq!(listed.contains(&(tile.x | tile.y << 16)), expected != "nothing to denoise");
            seen.insert(expected);
        }
        assert_eq!(seen.len(), 4, "{seen:?}");
    }
}

#[test]
fn pale_blocks_are_those_of_the_list_of_whole_ones() {
    let case = Case::still(SIZE, 2, |frame, p| {
        let value = 0.5 + noise(frame, p);
        let depth = if noise(4, p / 16) < 0.2 { 0.0 } else { Pixel::WALL.depth };
        let roughness = if noise(6, p / 4) < 0.4 { 0.02 } else { 0.8 };
        Pixel { radiance: [value, value, value, 30.0], roughness, depth, ..Pixel::WALL }
    });
    let view = DebugView::TileClasses;
    let pale = color_of(view, "4x4 pixels as a whole");
    for snapshot in shown(&case, Pipeline::Footprint, view).run(&mut *fastest()) {
        let [others, whole] = snapshot.block_lists(SIZE);
        assert!(whole.len() > 5 && others.len() > 5, "{} and {}", whole.len(), others.len());
        for (index, color) in (0..).zip(colors(&snapshot)) {
            let block = UVec2::new(index % SIZE.x, index / SIZE.x) / 4;
            assert_eq!(is_near(color, pale), whole.contains(&block), "{block}");
        }
    }
}

#[test]
fn kernels_keep_the_rules_and_views_are_kept_where_memory_is_shared() {
    let mut sharing = match Ash::try_open(&AshOptions { shared_memory: true, ..AshOptions::default() }) {
        Ok(ash) => Some((ash, fastest())),
        Err(error) => {
            skip(&error.to_string());
            None
        }
    };
    let mut case = wall(0.02, 3);
    case.steps[2].images = Images::new(SIZE, |p| Pixel { depth: (p.x % 20) as f32, ..Pixel::WALL });
    for (pipeline, view) in all_views() {
        let case = shown(&case, pipeline, view);
        let mut watched = Cpu::watched();
        case.run(&mut watched);
        assert_eq!(watched.faults(), Vec::<String>::new(), "{pipeline:?} {view:?}");
        if let Some((sharing, own)) = &mut sharing {
            let view_of = |executor: &mut dyn Executor| case.run(executor).iter().map(colors).collect::<Vec<_>>();
            assert_eq!(view_of(sharing), view_of(own.as_mut()), "{pipeline:?} {view:?}");
        }
    }
}

/// Turns a view on in settings of any kind, with the features that it needs.
fn turn_on(settings: &Settings, view: DebugView) -> Settings {
    let mut settings = settings.clone();
    settings.features.debug_view = Some(view);
    if settings.validate().is_err() {
        let features = &mut settings.features;
        (features.surface_motion, features.spatial_filter, features.block_statistics) = (true, true, true);
    }
    settings
}

/// Pixels that were compared between devices, and those that look different.
#[derive(Default)]
struct Compared {
    pixels: usize,
    different: usize,
}

fn check_view(
    spec: &limpid_harness::strategy::Spec,
    view: DebugView,
    all: &mut [Box<dyn Executor>],
    compared: &mut Compared,
) -> Result<(), TestCaseError> {
    let mut spec = spec.clone();
    spec.settings = turn_on(&spec.settings, view);
    spec.later_settings = spec.later_settings.map(|settings| turn_on(&settings, view));
    let case = spec.case();
    spec.settings.features.debug_view = None;
    spec.later_settings.iter_mut().for_each(|settings| settings.features.debug_view = None);
    let plain = spec.case();
    let mut runs: Vec<(String, Vec<Snapshot>)> = Vec::new();
    for executor in all.iter_mut() {
        let run = case.run(executor.as_mut());
        for (frame, (on, off)) in run.iter().zip(plain.run(executor.as_mut())).enumerate() {
            for (name, words) in &off.0 {
                prop_assert!(on.0[name] == *words, "{}: {name} of frame {frame} changes", executor.name());
            }
            let legend = view.legend();
            // Texels outside of the frame's rectangle may never have been written.
            let written = on.half_texels(DEBUG_VIEW).into_iter().filter(|texel| texel[3] == 1.0);
            let written: Vec<_> = written.map(|[r, g, b, _]| [r, g, b]).collect();
            prop_assert!(written.len() as u32 >= case.steps[frame].frame.size.element_product());
            for color in written {
                let explained = match view {
                    DebugView::Average => color.iter().all(|c| (0.0..=1.0).contains(c)),
                    _ => is_explained(&legend, color),
                };
                prop_assert!(explained, "{}: {view:?} of frame {frame} has {color:?}", executor.name());
            }
        }
        if let Some((_, same)) = runs.iter().find(|(device, _)| device == executor.device()) {
            prop_assert!(*same == run, "{} shows something else than another backend", executor.name());
        }
        runs.push((executor.device().to_owned(), run));
    }
    for (_, other) in &runs[1..] {
        for (a, b) in runs[0].1.iter().zip(other) {
            if !Table::decisions(a, b).is_empty() {
                break;
            }
            let different = |(a, b): (&[f32; 3], &[f32; 3])| a.iter().zip(b).any(|(a, b)| (a - b).abs() > 0.1);
            let (a, b) = (colors(a), colors(b));
            compared.pixels += a.len();
            compared.different += a.iter().zip(&b).filter(|pair| different(*pair)).count();
        }
    }
    Ok(())
}

#[test]
fn every_backend_shows_the_same_and_nothing_else_changes() {
    let views = prop::sample::select(DebugView::ALL);
    let state = RefCell::new((executors(), Compared::default()));
    let (mut runner, _) = runner(file!(), 32);
    let result = runner.run(&(any_spec(), views), |(spec, (_, view))| {
        let (all, compared) = &mut *state.borrow_mut();
        check_view(&spec, view, all, compared)
    });
    if let Err(error) = result {
        panic!("{error}");
    }
    let (_, compared) = state.into_inner();
    println!("{} of {} pixels look different", compared.different, compared.pixels);
    assert!(compared.different * 200 <= compared.pixels, "{} of {}", compared.different, compared.pixels);
}
