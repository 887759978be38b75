//! Settings that together switch everything on and off that changes code.

use glam::UVec2;
use limpid::settings::{Fallback, NormalEncoding, Pipeline, RayList, RaysPerQuad, RoughnessEncoding};
use limpid::{DebugView, Plan, Preset, Settings};
use limpid_harness::strategy::any_features;
use proptest::strategy::{Strategy, ValueTree};
use proptest::test_runner::TestRunner;

/// The preset with each feature of its pipeline turned the other way, one at a time.
fn toggled(name: &str, preset: &Settings) -> Vec<(String, Settings)> {
    let json = serde_json::to_value(preset).unwrap();
    let plan = |settings: &Settings| Plan::new(settings, UVec2::ONE).map(|(plan, _)| plan).ok();
    let whole = plan(preset);
    let features = json["features"].as_object().unwrap();
    let toggle = |(feature, value): (&String, &serde_json::Value)| {
        let mut json = json.clone();
        json["features"][feature] = (!value.as_bool()?).into();
        let settings: Settings = serde_json::from_value(json).unwrap();
        // Of some features one has to be on; those of the other pipeline change nothing.
        let other = plan(&settings);
        (other.is_some() && other != whole).then(|| (format!("{name}, other {feature}"), settings))
    };
    features.iter().filter_map(toggle).collect()
}

/// Other conventions, fallbacks and ray lists, and a few features at random.
fn mixed() -> Vec<Settings> {
    let mut mirrored = Preset::Reference.settings();
    mirrored.coverage.fallback = Fallback::Environment;
    mirrored.conventions.roughness = RoughnessEncoding::Alpha;
    let mut sparse = Settings::default();
    sparse.coverage.fallback = Fallback::Black;
    sparse.coverage.roughness_threshold = 0.5;
    sparse.conventions.normal = NormalEncoding::Unsigned;
    let list = |rays, threshold| {
        let mut list = RayList::default();
        (list.rays_per_quad, list.variance_threshold) = (rays, threshold);
        Some(list)
    };
    sparse.coverage.ray_list = list(RaysPerQuad::One, Some(0.05));
    let mut paired = Settings::default();
    paired.conventions.normal = NormalEncoding::OctahedralUnsigned;
    paired.coverage.ray_list = list(RaysPerQuad::Two, None);
    let mut random = TestRunner::deterministic();
    for settings in [&mut mirrored, &mut sparse, &mut paired] {
        settings.features = any_features().new_tree(&mut random).unwrap().current();
    }
    // All of one roughness, it could be that nothing is denoised.
    sparse.features.constant_roughness = None;
    paired.features.constant_roughness = Some(0.3);
    paired.pipeline = Pipeline::Published;
    let mut footprints = paired.clone();
    footprints.pipeline = Pipeline::Footprint;
    vec![mirrored, sparse, paired, footprints]
}

/// Debug views that look for history again, and others.
fn with_views() -> impl Iterator<Item = (String, Settings)> {
    let views = [
        (Preset::Default, DebugView::Candidate),
        (Preset::Reference, DebugView::Candidate),
        (Preset::Default, DebugView::TileClasses),
        (Preset::Reference, DebugView::MotionError),
    ];
    views.into_iter().map(|(preset, view)| {
        let mut settings = preset.settings();
        settings.features.debug_view = Some(view);
        (format!("{preset:?} with {view:?}"), settings)
    })
}

/// Every preset, every preset with each feature turned, debug views, and mixtures.
pub(crate) fn covering_settings() -> Vec<(String, Settings)> {
    let presets = Preset::ALL.iter().map(|(name, preset)| (name.to_string(), preset.settings()));
    let toggled = presets.clone().flat_map(|(name, settings)| toggled(&name, &settings));
    let mixed = mixed().into_iter().enumerate().map(|(number, settings)| (format!("mixture {number}"), settings));
    presets.chain(toggled).chain(with_views()).chain(mixed).collect()
}
