use glam::{Mat4, UVec2, Vec2, Vec3};
use limpid::Settings;

use super::*;
use crate::scene;

const SIZE: UVec2 = UVec2::new(160, 90);

/// An analysis of a built-in scene whose data was changed.
fn analysis(name: &str, mut change: impl FnMut(&mut Frame)) -> Analysis {
    let scene = scene::by_name(name).unwrap();
    let mut analyzer = Analyzer::new(SIZE, &Settings::default(), 1.0);
    for number in 0..4 {
        let mut frame = scene.render(number, SIZE, 0);
        change(&mut frame);
        analyzer.add(frame);
    }
    analyzer.finish().unwrap()
}

fn errors(analysis: &Analysis) -> Vec<&str> {
    let findings = analysis.findings.iter().filter(|finding| finding.severity == Severity::Error);
    findings.map(|finding| finding.found.as_str()).collect()
}

#[test]
fn built_in_scenes_are_as_they_should_be() {
    for name in scene::NAMES {
        let analysis = analysis(name, |_| ());
        assert_eq!(errors(&analysis), Vec::<&str>::new(), "{name}\n{analysis}");
        assert!(analysis.geometry.agreement > 0.6, "{name}\n{analysis}");
        assert!(analysis.motion.mismatch < 0.3, "{name}\n{analysis}");
        assert!(!analysis.settings.contains("conventions"), "{}", analysis.settings);
    }
}

/// Motion vectors of another convention, and the scale that leads back.
#[test]
fn other_motion_vectors_are_recognised() {
    let pixels = SIZE.as_vec2();
    let scales = [
        Vec2::NEG_ONE,
        Vec2::new(1.0, -1.0),
        Vec2::new(0.5, -0.5),
        Vec2::new(-0.5, 0.5),
        1.0 / pixels,
        Vec2::new(-1.0, 1.0) / pixels,
    ];
    for scale in scales {
        let analysis = analysis("dolly", |frame| {
            for motion in &mut frame.motion {
                *motion = (Vec2::from(*motion) / scale).to_array();
            }
        });
        assert!((analysis.motion.best_factor - scale).abs().max_element() < 1e-6, "{scale}\n{analysis}");
        assert!(errors(&analysis).iter().any(|found| found.contains("motion vectors")), "{scale}\n{analysis}");
        assert!(analysis.settings.contains("motion_scale"), "{}", analysis.settings);
        // What is recommended can be read back.
        let settings: Settings = toml::from_str(&analysis.settings).unwrap();
        assert!((settings.conventions.motion_scale - scale).abs().max_element() < 1e-6);
    }
}

#[test]
fn other_depths_and_normals_are_recognised() {
    use super::geometry::{DepthMeaning, NormalMeaning};
    let device = |frame: &mut Frame| {
        for depth in frame.depth.iter_mut().filter(|depth| **depth > 0.0) {
            let clip = frame.camera.view_to_clip * Vec3::new(0.0, 0.0, -*depth).extend(1.0);
            *depth = clip.z / clip.w;
        }
    };
    assert_eq!(analysis("gallery", device).geometry.best.depth, DepthMeaning::Device);
    let view = |frame: &mut Frame| {
        for normal in &mut frame.normal {
            *normal = frame.camera.world_to_view.transform_vector3(Vec3::from(*normal)).to_array();
        }
        // The camera of the scene looks nearly along an axis: turn the world.
        frame.camera.world_to_view *= Mat4::from_rotation_y(1.2);
    };
    assert_eq!(analysis("gallery", view).geometry.best.normal, NormalMeaning::View);
    let unsigned = |frame: &mut Frame| frame.normal.iter_mut().flatten().for_each(|x| *x = *x * 0.5 + 0.5);
    assert_eq!(analysis("gallery", unsigned).geometry.best.normal, NormalMeaning::WorldUnsigned);
    let inward = |frame: &mut Frame| frame.normal.iter_mut().flatten().for_each(|x| *x = -*x);
    let analysis = analysis("gallery", inward);
    assert_eq!(analysis.geometry.best.normal, NormalMeaning::Inward);
    assert!(analysis.to_string().contains("error: normals look like normals that point into the surface"));
}

#[test]
fn wrong_cameras_and_cuts_are_recognised() {
    let inverted = analysis("dolly", |frame| frame.camera.world_to_view = frame.camera.world_to_view.inverse());
    assert_eq!(inverted.motion.camera, CameraMeaning::ViewInverted, "{inverted}");
    let down = analysis("dolly", |frame| {
        frame.camera.view_to_clip = Mat4::from_scale(Vec3::new(1.0, -1.0, 1.0)) * frame.camera.view_to_clip;
    });
    assert!(down.geometry.y_down, "{down}");
    // Every frame of another place.
    let scene = [scene::by_name("gallery").unwrap(), scene::by_name("courtyard").unwrap()];
    let mut analyzer = Analyzer::new(SIZE, &Settings::default(), 1.0);
    for number in 0..3 {
        let mut frame = scene[number as usize % 2].render(number, SIZE, 0);
        frame.reset = number == 0;
        analyzer.add(frame);
    }
    assert_eq!(analyzer.finish().unwrap().motion.unmarked_cuts, [1, 2]);
}

#[test]
fn values_that_mean_nothing_are_counted() {
    let analysis = analysis("gallery", |frame| {
        let surface = frame.depth.iter().position(|depth| *depth > 0.0).unwrap();
        frame.radiance[surface] = [f32::NAN, -1.0, 0.0, 0.0];
        frame.roughness[surface + 1] = 3.0;
        frame.normal[surface + 2] = [0.0; 3];
    });
    assert_eq!(analysis.content.not_finite, 4);
    assert!(analysis.content.negative_radiance > 0.0 && analysis.content.roughness_out_of_range > 0.0);
    assert!(analysis.content.normals_zero > 0.0);
    let text = analysis.to_string();
    assert!(["NaN", "negative", "not within 0 and 1", "length 0"].iter().all(|part| text.contains(part)), "{text}");
}

#[test]
fn normals_that_are_not_there_are_left_out() {
    let without = analysis("gallery", |frame| frame.normal.fill([0.0; 3]));
    assert_eq!(errors(&without), ["there are no normals"], "{without}");
    assert!(!without.to_string().contains("of length 0") && !without.to_string().contains("not of unit length"));
    assert!(without.settings.contains("normal_input = false"), "{}", without.settings);
}

/// Frames of a scene in which every surface is a perfect mirror, and nothing moves.
fn mirrors_at_rest(count: u32, traced: bool) -> Vec<Frame> {
    let scene = scene::by_name("still").unwrap();
    let pixels: Vec<UVec2> = (0..SIZE.y).flat_map(|y| (0..SIZE.x).map(move |x| UVec2::new(x, y))).collect();
    let mut reference = None;
    let render = |number| {
        let mut frame = scene.gbuffer(number, SIZE);
        frame.roughness.fill(0.0);
        frame.radiance = scene.trace(number, &frame, &pixels);
        let reference = reference.get_or_insert_with(|| scene.reference(0, &frame, 64));
        if !traced {
            for (radiance, [r, g, b]) in frame.radiance.iter_mut().zip(reference.iter()) {
                *radiance = [*r, *g, *b, radiance[3]];
            }
        }
        frame.reference = Some(reference.clone());
        frame
    };
    (0..count).map(render).collect()
}

fn analysis_of(frames: &[Frame], settings: &Settings) -> Analysis {
    let mut analyzer = Analyzer::new(SIZE, settings, 1.0);
    frames.iter().for_each(|frame| analyzer.add(frame.clone()));
    analyzer.finish().unwrap()
}

struct Patient;

impl crate::bench::measure::Observer for Patient {
    fn denoised(&mut self, _: &crate::bench::Subject, _: &crate::bench::Variant, _: usize, _: &[[f32; 3]]) -> bool {
        true
    }
}

fn verified(frames: Vec<Frame>, changes: &mut Vec<Change>) -> Verification {
    let given = Settings::default();
    let trial = Trial::new("test", 1.0, frames, &given, crate::backend::Choice::Cpu).unwrap();
    trial.verify(changes, 0, &mut Patient).unwrap().expect("nobody stopped it")
}

fn names(changes: &[Change]) -> Vec<String> {
    changes.iter().map(|change| change.setting.replace("features.", "")).collect()
}

/// Converged mirrors need next to nothing, and what is left of the pipeline does as well.
#[test]
fn mirrors_at_rest_need_little() {
    let frames = mirrors_at_rest(6, false);
    let analysis = analysis_of(&frames, &Settings::default());
    let mut changes = analysis.changes.clone();
    let expected = [
        "constant_roughness",
        "spatial_filter",
        "light_change",
        "whole_blocks",
        "outlier_spread",
        "history_clip",
        "surface_motion",
    ];
    assert_eq!(names(&changes), expected, "{analysis}");
    let [given, recommended] = &analysis.predicted;
    assert!(recommended.bytes < given.bytes && recommended.passes + 3 <= given.passes, "{analysis}");
    assert!(recommended.bindings < given.bindings && recommended.inputs < given.inputs, "{analysis}");
    assert!(recommended.instructions * 3 < given.instructions * 2, "{analysis}");
    let verification = verified(frames, &mut changes);
    assert_eq!((verification.withdrawn.len(), changes.len()), (0, expected.len()), "{verification}");
    assert!(verification.recommended.holds() && verification.has_reference, "{verification}");
    // The file says all of it.
    let read: Settings = toml::from_str(&analysis.settings).unwrap();
    assert_eq!(read, apply(&Settings::default(), &changes).unwrap());
}

/// Noise keeps the filters, and what acts on rough surfaces alone can go without any change of the output.
#[test]
fn noisy_mirrors_keep_their_filters() {
    let frames = mirrors_at_rest(6, true);
    let mut changes = analysis_of(&frames, &Settings::default()).changes;
    let found = names(&changes);
    let has = |name: &str| found.contains(&name.to_owned());
    assert!(has("light_change") && has("outlier_spread") && !has("spatial_filter"), "{found:?}");
    let verification = verified(frames, &mut changes);
    for one in verification.single.iter().filter(|one| one.settings[0].contains("light_change")) {
        assert!(one.differences.iter().all(|d| d.given == d.changed), "{one:?}");
    }
    assert!(verification.withdrawn.is_empty(), "{verification}");
}

/// What loses more than the bound is named and withdrawn; the same without references, against the full output.
#[test]
fn what_loses_too_much_is_withdrawn() {
    let scene = scene::by_name("gallery").unwrap();
    for samples in [32, 0] {
        let frames: Vec<Frame> = (0..5).map(|number| scene.render(number, SIZE, samples)).collect();
        let off = |name: &str| Change::new(&format!("features.{name}"), false.into(), "a guess", "it is");
        let mut changes = vec![off("spatial_filter"), off("light_change")];
        let verification = verified(frames, &mut changes);
        assert_eq!(verification.has_reference, samples > 0);
        assert!(verification.withdrawn[0].starts_with("features.spatial_filter = false: psnr"), "{verification}");
        assert!(!names(&changes).contains(&"spatial_filter".to_owned()), "{verification}");
        assert!(verification.recommended.holds(), "{verification}");
    }
}

/// Everything that can be tried is accepted by the library, alone and with what is recommended, and changes the plan.
#[test]
fn what_is_tried_changes_something() {
    for preset in [limpid::Preset::Default, limpid::Preset::Reference] {
        let settings = preset.settings();
        let tried = untried(&settings, &[]);
        assert!(tried.len() > 5, "{tried:?}");
        for change in &tried {
            assert_ne!(apply(&settings, [change]).unwrap(), settings);
            let read: Settings = toml::from_str(&toml_of(&apply(&settings, [change]).unwrap()).unwrap()).unwrap();
            assert_eq!(read, apply(&settings, [change]).unwrap());
        }
    }
    assert_eq!(toml_of(&Settings::default()).unwrap(), "");
    // The motion of what was hit is of no use without the lookup that it leads.
    let hit_motion = Change::new("features.hit_motion", true.into(), "reflected things move", "they do");
    let tries_parallax = |recommended: &[Change]| {
        let tried = untried(&Settings::default(), recommended);
        tried.iter().any(|change| change.setting == "features.mirror_parallax")
    };
    assert!(tries_parallax(&[]) && !tries_parallax(&[hit_motion]));
}

/// Where rough surfaces are not traced, they are left out of denoising.
#[test]
fn surfaces_that_are_not_traced_are_left_out() {
    let found = analysis("gallery", |frame| {
        for (radiance, roughness) in frame.radiance.iter_mut().zip(&frame.roughness) {
            *radiance = if *roughness > 0.3 { [0.0; 4] } else { *radiance };
        }
    });
    let settings: Settings = toml::from_str(&found.settings).unwrap();
    assert!((0.25..0.36).contains(&settings.coverage.roughness_threshold), "{found}");
}

#[test]
fn hit_motion_is_recommended_where_reflected_things_move() {
    let recommended = |name: &str, change: fn(&mut Frame)| {
        let scene = scene::by_name(name).unwrap();
        let mut analyzer = Analyzer::new(SIZE / 2, &Settings::default(), 1.0);
        for number in 0..6 {
            let mut frame = scene.render(number, SIZE / 2, 0);
            change(&mut frame);
            analyzer.add(frame);
        }
        let analysis = analyzer.finish().unwrap();
        assert_eq!(errors(&analysis), Vec::<&str>::new(), "{name}\n{analysis}");
        let features = toml::from_str::<Settings>(&analysis.settings).unwrap().features;
        (features.hit_motion, features.mirror_parallax)
    };
    assert_eq!(recommended("mirrors", |_| ()), (true, true));
    // With the camera at rest only motion leads elsewhere than to where reflected points are seen now.
    assert_eq!(recommended("carousel", |_| ()), (true, true));
    assert_eq!(recommended("carousel", |frame| frame.hit_motion = None), (false, false));
    let nothing: fn(&mut Frame) =
        |frame| frame.hit_motion.iter_mut().flatten().for_each(|motion| *motion = [f32::NAN; 3]);
    assert_eq!(recommended("carousel", nothing), (false, false));
    assert!(!recommended("still", |_| ()).0);
}
