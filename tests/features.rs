//! What is switched off costs nothing, and changes nothing where it would not have been used.

use glam::UVec2;
use limpid::emit::SpirvOptions;
use limpid::settings::{Features, Pipeline};
use limpid::{Error, Plan, Settings};
use limpid_harness::strategy::noise;
use limpid_harness::{Case, Executor, Pixel, Snapshot, fastest};

const SIZE: UVec2 = UVec2::new(64, 40);

/// A change of features.
type Change = fn(&mut Features);

/// Each feature that both pipelines have switched off, by name.
const OFF: [(&str, Change); 5] = [
    ("mirror_parallax", |features| features.mirror_parallax = false),
    ("surface_motion", |features| features.surface_motion = false),
    ("spatial_filter", |features| features.spatial_filter = false),
    ("history_clip", |features| features.history_clip = false),
    ("constant_roughness", |features| features.constant_roughness = Some(0.3)),
];

/// What is off costs memory of limpid's, in exchange for reads.
const READ_INSTEAD: [(&str, Change); 3] = [
    ("gbuffer_copy", |features| features.gbuffer_copy = false),
    ("packed_guide", |features| features.packed_guide = false),
    ("both", |features| (features.gbuffer_copy, features.packed_guide) = (false, false)),
];

/// An image less in exchange for instructions.
const DERIVED: Change = |features| features.normal_input = false;

/// Those that one of them has besides.
fn off(pipeline: Pipeline) -> Vec<(&'static str, Change)> {
    let published: [(&str, Change); 3] = [
        ("history_search", |features| features.history_search = false),
        ("edge_repair", |features| features.edge_repair = false),
        ("average_mixing", |features| features.average_mixing = false),
    ];
    let footprint: [(&str, Change); 11] = [
        ("whole_blocks", |features| features.whole_blocks = false),
        ("both_histories", |features| features.both_histories = false),
        ("block_interpolation", |features| features.block_interpolation = false),
        ("hit_motion", |features| features.hit_motion = false),
        ("light_change", |features| features.light_change = false),
        ("outlier_spread", |features| features.outlier_spread = false),
        ("wide_filter", |features| features.wide_filter = false),
        ("near_taps", |features| features.near_taps = 0),
        ("young_taps", |features| features.young_taps = 0),
        ("wide_taps", |features| features.wide_taps = 1),
        ("block_statistics", |features| features.block_statistics = false),
    ];
    let own: &[_] = if pipeline == Pipeline::Published { &published } else { &footprint };
    OFF.iter().chain(own).copied().collect()
}

fn find(pipeline: Pipeline, name: &str) -> Change {
    off(pipeline).into_iter().find(|(n, _)| *n == name).unwrap().1
}

/// Every feature on, and changes of that.
fn with(pipeline: Pipeline, changes: &[Change]) -> Settings {
    let mut settings = Settings::default();
    settings.pipeline = pipeline;
    settings.features.hit_motion = true;
    settings.features.young_taps = 16;
    changes.iter().for_each(|change| change(&mut settings.features));
    settings
}

/// Words of SPIR-V, bindings and bytes of each pass, and bytes in all.
#[derive(Debug)]
struct Cost {
    passes: Vec<(String, usize, usize)>,
    bytes: u64,
}

impl Cost {
    fn of(settings: &Settings) -> Self {
        let (plan, kernels) = Plan::new(settings, SIZE).unwrap();
        let passes = plan.passes.iter().zip(&kernels).map(|(pass, kernel)| {
            let words = kernel.spirv(&SpirvOptions::default()).unwrap().len();
            (pass.kernel.clone(), words, pass.bindings.len())
        });
        Self { passes: passes.collect(), bytes: plan.memory().total() }
    }

    fn words(&self) -> usize {
        self.passes.iter().map(|(_, words, _)| words).sum()
    }

    fn bindings(&self) -> usize {
        self.passes.iter().map(|(_, _, bindings)| bindings).sum()
    }

    /// Whether nothing costs more than elsewhere.
    fn is_within(&self, more: &Self) -> bool {
        self.bytes <= more.bytes
            && self.words() <= more.words()
            && self.bindings() <= more.bindings()
            && self.passes.iter().all(|(name, ..)| more.passes.iter().any(|(other, ..)| other == name))
    }
}

#[test]
fn what_is_off_costs_nothing() {
    for pipeline in [Pipeline::Footprint, Pipeline::Published] {
        let everything = Cost::of(&with(pipeline, &[]));
        for (name, change) in off(pipeline) {
            let without = Cost::of(&with(pipeline, &[change]));
            println!("{name}: {} of {} words, {} bytes", without.words(), everything.words(), without.bytes);
            assert!(without.is_within(&everything), "{name}: {without:?} and {everything:?}");
            // Numbers of taps are numbers; blocks are there for outliers too.
            let is_same = ["near_taps", "wide_taps", "block_statistics"].contains(&name);
            assert!(without.words() < everything.words() || is_same, "{name}");
            // On top of each other too.
            for (other_name, other) in off(pipeline) {
                let settings = with(pipeline, &[change, other]);
                if settings.validate().is_ok() {
                    assert!(Cost::of(&settings).is_within(&without), "{name} and {other_name}");
                }
            }
        }
    }
}

/// Less is fewer bytes, and no pass that was not there before: instructions and bindings may be more. What else is off costs
/// no more than with everything on, whatever is read.
#[test]
fn what_is_read_instead_of_kept_costs_less_memory() {
    for pipeline in [Pipeline::Footprint, Pipeline::Published] {
        let (everything, bytes) =
            (Cost::of(&with(pipeline, &[])), |pixel: u64| pixel * u64::from(SIZE.element_product()));
        let copy = if pipeline == Pipeline::Footprint { 4 } else { 8 };
        // The copy of the published pipeline is the packed guide.
        let packed = if pipeline == Pipeline::Footprint { 8 } else { 0 };
        for ((name, change), saved) in READ_INSTEAD.into_iter().zip([copy, packed, copy + 8]) {
            let reading = Cost::of(&with(pipeline, &[change]));
            println!("{name}: {} of {} words, {} bytes", reading.words(), everything.words(), reading.bytes);
            assert_eq!(reading.bytes + bytes(saved), everything.bytes, "{name}");
            assert!(reading.passes.iter().map(|(pass, ..)| pass).eq(everything.passes.iter().map(|(pass, ..)| pass)));
            for (other_name, other) in off(pipeline) {
                let without = Cost::of(&with(pipeline, &[change, other]));
                assert!(without.is_within(&reading), "{other_name} with {name}");
            }
        }
    }
}

/// Nothing but the image of normals disappears, and only `classify` grows.
#[test]
fn normals_from_depth_are_an_image_less() {
    for pipeline in [Pipeline::Footprint, Pipeline::Published] {
        let (everything, derived) = (Cost::of(&with(pipeline, &[])), Cost::of(&with(pipeline, &[DERIVED])));
        assert_eq!((derived.bytes, derived.bindings() + 1), (everything.bytes, everything.bindings()));
        for (with, without) in derived.passes.iter().zip(&everything.passes) {
            assert!(with == without || with.0 == "classify", "{with:?} and {without:?}");
        }
        for (name, other) in off(pipeline) {
            assert!(Cost::of(&with(pipeline, &[DERIVED, other])).is_within(&derived), "{name}");
        }
    }
    for (pipeline, index, name) in [
        (Pipeline::Footprint, 0, "gbuffer_copy"),
        (Pipeline::Published, 0, "gbuffer_copy"),
        (Pipeline::Footprint, 1, "packed_guide"),
    ] {
        let error = Plan::new(&with(pipeline, &[DERIVED, READ_INSTEAD[index].1]), SIZE).unwrap_err();
        assert!(matches!(error, Error::Features { .. }) && error.to_string().contains(name), "{error}");
    }
}

#[test]
fn no_way_to_find_history_is_refused() {
    let settings = with(Pipeline::Footprint, &[OFF[0].1, OFF[1].1]);
    let error = Plan::new(&settings, SIZE).unwrap_err();
    assert!(matches!(error, Error::Features { .. }) && error.to_string().contains("surface_motion"), "{error}");
    let mut settings = Settings::default();
    settings.features.constant_roughness = Some(1.5);
    let message = settings.validate().unwrap_err().to_string();
    assert_eq!(message, "setting `features.constant_roughness` is 1.5, expected 0 to 1");
}

/// A still wall, noisy, seen straight on.
fn wall(roughness: f32) -> Case {
    Case::still(SIZE, 5, |frame, p| {
        let value = 0.5 + noise(frame, p);
        Pixel { radiance: [value, 0.5 * value, 0.25, 3.0], roughness, ..Pixel::WALL }
    })
}

fn run(case: &Case, executor: &mut dyn Executor, off: &[Change]) -> Vec<Snapshot> {
    let mut case = case.clone();
    off.iter().for_each(|change| change(&mut case.settings.features));
    case.run(executor)
}

fn assert_same(name: &str, full: &[Snapshot], reduced: &[Snapshot]) {
    for (frame, (full, reduced)) in full.iter().zip(reduced).enumerate() {
        for (pixel, (full, reduced)) in full.output().into_iter().zip(reduced.output()).enumerate() {
            assert_eq!(full[..3], reduced[..3], "{name}: pixel {pixel} of frame {frame}");
        }
    }
}

/// A still wall for the published pipeline.
fn published(roughness: f32) -> Case {
    let mut case = wall(roughness);
    case.settings.pipeline = Pipeline::Published;
    case
}

#[test]
fn what_a_scene_does_not_use_changes_nothing() {
    let executor = &mut *fastest();
    let rough = published(0.3);
    let full = run(&rough, executor, &[]);
    // Seen straight on, the reflected point is found where the surface is, and every history fits.
    for name in ["surface_motion", "history_search", "edge_repair", "constant_roughness"] {
        assert_same(name, &full, &run(&rough, executor, &[find(Pipeline::Published, name)]));
    }
    // Mirrors are not filtered.
    let mirror = published(0.005);
    let no_filter = find(Pipeline::Published, "spatial_filter");
    assert_same("spatial_filter", &run(&mirror, executor, &[]), &run(&mirror, executor, &[no_filter]));
    // No cosine is above 1.
    let mut by_motion = published(0.3);
    by_motion.settings.reproject.parallax_normal_cosine = 1.0;
    let no_parallax = find(Pipeline::Published, "mirror_parallax");
    assert_same("mirror_parallax", &run(&by_motion, executor, &[]), &run(&by_motion, executor, &[no_parallax]));
    // A box that holds everything clips nothing.
    let mut roomy = published(0.3);
    roomy.settings.resolve.clip_extent_floor = 60_000.0;
    let no_clip = find(Pipeline::Published, "history_clip");
    assert_same("history_clip", &run(&roomy, executor, &[]), &run(&roomy, executor, &[no_clip]));
    // The comparison notices what is used.
    let filtered = run(&rough, executor, &[no_filter]);
    assert!(full.iter().zip(&filtered).any(|(a, b)| a.output() != b.output()));
}

/// A packed guide rounds normals, and the footprint pipeline's copy of the G-buffer everything: as little as that is what
/// comes out may differ. Which tiles are denoised is the same to the bit.
#[test]
fn a_gbuffer_read_where_it_is_says_what_a_kept_one_says() {
    let executor = &mut *fastest();
    for pipeline in [Pipeline::Footprint, Pipeline::Published] {
        let mut case = Case::still(SIZE, 6, |frame, p| {
            let value = 0.5 + noise(frame, p);
            let tilt = [0.3 * noise(7, p / 16), 0.1, 1.0];
            // Where the ray of the pixel meets the plane of that normal that is 4 ahead, so that no pixel is next to
            // showing the surface of its block.
            let [x, y] = [p.x, p.y].map(|i| 2.0 * (i as f32 + 0.5));
            let half_side = 0.5_f32.tan();
            let ray = [(x - SIZE.x as f32), (SIZE.y as f32 - y)].map(|side| side * half_side / SIZE.y as f32);
            let plane = 4.0 / (1.0 - tilt[0] * ray[0] - tilt[1] * ray[1]);
            // Blocks of sky, and of surfaces beyond the threshold.
            let depth = if noise(9, p / 8) < 0.1 { 0.0 } else { plane };
            let roughness = noise(8, p / 12);
            Pixel { radiance: [value, 0.5 * value, 0.25, 3.0], normal: tilt, roughness, depth, ..Pixel::WALL }
        });
        case.settings.pipeline = pipeline;
        case.settings.coverage.roughness_threshold = 0.8;
        let full = run(&case, executor, &[]);
        for (name, change) in READ_INSTEAD {
            let reading = run(&case, executor, &[change]);
            for (full, reading) in full.iter().zip(&reading) {
                assert_eq!(full.0["idle_frames"], reading.0["idle_frames"], "{name}");
                for (a, b) in full.output().into_iter().zip(reading.output()) {
                    let apart = (a[0] - b[0]).abs();
                    assert!(apart <= 0.01 * a[0], "{name}: {a:?} and {b:?}");
                }
            }
        }
        // The comparison notices a G-buffer that is another frame's.
        let off = READ_INSTEAD[2].1;
        let mut other = case.clone();
        other.steps[4].images.pixels.iter_mut().for_each(|pixel| pixel.depth *= 2.0);
        let (a, b) = (run(&case, executor, &[off]), run(&other, executor, &[off]));
        let differs = a[5].output().into_iter().zip(b[5].output()).any(|(a, b)| (a[0] - b[0]).abs() > 0.01 * a[0]);
        assert!(differs);
    }
}

#[test]
fn what_a_scene_does_not_use_changes_nothing_over_footprints() {
    let executor = &mut *fastest();
    let rough = wall(0.3);
    let full = run(&rough, executor, &[]);
    // History of surfaces this rough is not clipped, and the input has no outliers and no change of light.
    for name in ["history_clip", "outlier_spread", "light_change", "constant_roughness"] {
        assert_same(name, &full, &run(&rough, executor, &[find(Pipeline::Footprint, name)]));
    }
    // Footprints of mirrors are no wider than a pixel: what the blocks add is how much of a difference is noise.
    let mirror = wall(0.005);
    let full = run(&mirror, executor, &[]);
    assert_same("whole_blocks", &full, &run(&mirror, executor, &[find(Pipeline::Footprint, "whole_blocks")]));
    assert_same("outlier_spread", &full, &run(&mirror, executor, &[find(Pipeline::Footprint, "outlier_spread")]));
    // The comparison notices what is used.
    let filtered = run(&rough, executor, &[find(Pipeline::Footprint, "wide_filter")]);
    assert!(full.iter().zip(&filtered).any(|(a, b)| a.output() != b.output()));
}

#[test]
fn new_pixels_have_taps_of_their_own() {
    let executor = &mut *fastest();
    let smooth = wall(0.1);
    let few = run(&smooth, executor, &[|features| (features.near_taps, features.young_taps) = (4, 0)]);
    let young = run(&smooth, executor, &[|features| (features.near_taps, features.young_taps) = (4, 8)]);
    // Of what is the same everywhere but for noise.
    let variance = |snapshot: &Snapshot| {
        let output = snapshot.output();
        let mean = output.iter().map(|texel| texel[0]).sum::<f32>() / output.len() as f32;
        output.iter().map(|texel| (texel[0] - mean).powi(2)).sum::<f32>()
    };
    // All are new in the first frame, and none is later.
    let (less, more) = (variance(&young[0]), variance(&few[0]));
    assert!(less < 0.9 * more, "{less} and {more}");
    assert_same("near taps", &few[1..], &young[1..]);
}
