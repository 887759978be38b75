//! Settings that change code or bindings, at random.

use limpid::settings::{Channel, Fallback, NormalEncoding, Pipeline, RayList, RaysPerQuad, RoughnessEncoding};
use limpid::{DebugView, Settings};
use limpid_harness::strategy::any_features;
use proptest::prelude::*;

pub(crate) fn any_settings() -> impl Strategy<Value = Settings> {
    use NormalEncoding::{Octahedral, OctahedralUnsigned, Signed, Unsigned};
    let rays = prop::sample::select(vec![RaysPerQuad::One, RaysPerQuad::Two, RaysPerQuad::Four]);
    let ray_list = prop::option::of((rays, prop::option::of(0.0f32..=1.0)));
    (
        prop::sample::select(vec![Signed, Unsigned, Octahedral, OctahedralUnsigned]),
        prop::sample::select(vec![Channel::Red, Channel::Green, Channel::Blue, Channel::Alpha]),
        prop::sample::select(vec![RoughnessEncoding::Perceptual, RoughnessEncoding::Alpha]),
        prop::sample::select(vec![Fallback::Black, Fallback::Input, Fallback::Environment]),
        ray_list,
        (any_features(), prop::option::of(prop::sample::select(DebugView::ALL))),
        prop::sample::select(vec![Pipeline::Footprint, Pipeline::Published]),
    )
        .prop_map(|(normal, channel, roughness, fallback, ray_list, (features, view), pipeline)| {
            let mut settings = Settings::default();
            settings.pipeline = pipeline;
            settings.features = features;
            settings.conventions.normal = normal;
            settings.conventions.roughness_channel = channel;
            settings.conventions.roughness = roughness;
            settings.coverage.fallback = fallback;
            settings.coverage.ray_list = ray_list.map(|(rays_per_quad, variance_threshold)| {
                let mut list = RayList::default();
                list.rays_per_quad = rays_per_quad;
                list.variance_threshold = variance_threshold;
                list
            });
            settings.features.debug_view = view.map(|(_, view)| view);
            // Some views need a feature.
            settings.features.debug_view = settings.features.debug_view.filter(|_| settings.validate().is_ok());
            settings
        })
}
