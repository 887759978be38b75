//! What is switched off costs nothing, and changes nothing where it would not have been used.

use glam::UVec2;
use limpid::emit::SpirvOptions;
use limpid::settings::Features;
use limpid::{Error, Plan, Settings};
use limpid_harness::strategy::noise;
use limpid_harness::{Case, Executor, Pixel, Snapshot, fastest};

const SIZE: UVec2 = UVec2::new(64, 40);

/// A change of features.
type Change = fn(&mut Features);

/// Each feature switched off, by name.
const OFF: &[(&str, Change)] = &[
    ("mirror_parallax", |features| features.mirror_parallax = false),
    ("surface_motion", |features| features.surface_motion = false),
    ("history_search", |features| features.history_search = false),
    ("edge_repair", |features| features.edge_repair = false),
    ("spatial_filter", |features| features.spatial_filter = false),
    ("history_clip", |features| features.history_clip = false),
    ("average_mixing", |features| features.average_mixing = false),
    ("constant_roughness", |features| features.constant_roughness = Some(0.3)),
];

fn with(changes: &[Change]) -> Settings {
    let mut settings = Settings::default();
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
    let everything = Cost::of(&with(&[]));
    for (name, off) in OFF {
        let without = Cost::of(&with(&[*off]));
        println!("{name}: {} of {} words, {} bytes", without.words(), everything.words(), without.bytes);
        assert!(without.is_within(&everything), "{name}: {without:?} and {everything:?}");
        assert!(without.words() < everything.words(), "{name}");
        // On top of each other too.
        for (other_name, other) in OFF {
            let settings = with(&[*off, *other]);
            if settings.validate().is_ok() {
                assert!(Cost::of(&settings).is_within(&without), "{name} and {other_name}");
            }
        }
    }
}

#[test]
fn no_way_to_find_history_is_refused() {
    let settings = with(&[OFF[0].1, OFF[1].1]);
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

#[test]
fn what_a_scene_does_not_use_changes_nothing() {
    let executor = &mut *fastest();
    let rough = wall(0.3);
    let full = run(&rough, executor, &[]);
    // Seen straight on, the reflected point is found where the surface is, and every history fits.
    for name in ["surface_motion", "history_search", "edge_repair", "constant_roughness"] {
        let (_, off) = OFF.iter().find(|(n, _)| *n == name).unwrap();
        assert_same(name, &full, &run(&rough, executor, &[*off]));
    }
    // Mirrors are not filtered.
    let mirror = wall(0.005);
    let (_, off) = OFF[4];
    assert_same("spatial_filter", &run(&mirror, executor, &[]), &run(&mirror, executor, &[off]));
    // No cosine is above 1.
    let mut by_motion = wall(0.3);
    by_motion.settings.reproject.parallax_normal_cosine = 1.0;
    assert_same("mirror_parallax", &run(&by_motion, executor, &[]), &run(&by_motion, executor, &[OFF[0].1]));
    // A box that holds everything clips nothing.
    let mut roomy = wall(0.3);
    roomy.settings.resolve.clip_extent_floor = 60_000.0;
    assert_same("history_clip", &run(&roomy, executor, &[]), &run(&roomy, executor, &[OFF[5].1]));
    // The comparison notices what is used.
    let (_, off) = OFF[4];
    let filtered = run(&rough, executor, &[off]);
    assert!(full.iter().zip(&filtered).any(|(a, b)| a.output() != b.output()));
}
