use glam::{Mat4, UVec2, Vec2, Vec3};
use limpid::Settings;

use super::*;
use crate::scene;

const SIZE: UVec2 = UVec2::new(160, 90);

/// An analysis of a built-in scene whose data was changed.
fn analysis(name: &str, mut change: impl FnMut(&mut Frame)) -> Analysis {
    let scene = scene::by_name(name).unwrap();
    let mut analyzer = Analyzer::new(SIZE, &Settings::default().conventions, 1.0);
    for number in 0..4 {
        let mut frame = scene.render(number, SIZE, 0);
        change(&mut frame);
        analyzer.add(frame);
    }
    analyzer.finish()
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
        assert_eq!(analysis.settings, "");
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
    let mut analyzer = Analyzer::new(SIZE, &Settings::default().conventions, 1.0);
    for number in 0..3 {
        let mut frame = scene[number as usize % 2].render(number, SIZE, 0);
        frame.reset = number == 0;
        analyzer.add(frame);
    }
    assert_eq!(analyzer.finish().motion.unmarked_cuts, [1, 2]);
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
