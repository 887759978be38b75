//! All backends leave the same in memory, whatever the input: a random sequence of frames after the other, on
//! every executor there is. `PROPTEST_CASES` says how many; `--nocapture` shows the table.

use std::cell::RefCell;
use std::collections::BTreeMap;

use glam::UVec2;
use limpid::Preset;
use limpid::kernel::Kernel;
use limpid::resource::Copy;
use limpid::settings::Fallback;
use limpid_harness::executor::Cpu;
use limpid_harness::strategy::{Field, FrameSpec, Motion, Normals, Spec, any_spec, set_number};
use limpid_harness::{Executor, Snapshot, Table, executors, runner};
use proptest::prelude::*;

/// Two devices agree in a frame if no more than this share of a resource's values is more than two half-float steps
/// apart, or so few values as may be so however small the image is. Divisions, exponentials, logarithms and roots
/// differ by units in the last place between devices, and the power of 512 of a cosine makes that a thousand times
/// more; `precision.rs` shows what comes of it.
const MAX_FAR_SHARE: f64 = 0.03;
const MAX_FAR_VALUES: usize = 64;
/// Nor must they decide differently, at a threshold, whether there is history for more than this share of pixels.
const MAX_DECISION_SHARE: f64 = 0.01;
const MAX_DECISIONS: usize = 8;
/// Values of the output that a pixel's decision reaches through the 8x8 average: 3x3 tiles.
const DECISION_FOOTPRINT: usize = 24 * 24 * 4;
/// Share of random cases in which they may not agree: where everything is constant, all pixels can be at the same
/// threshold at once.
const MAX_DISAGREEING_CASES: f64 = 0.01;
/// Largest share of values that are far apart in all other cases together.
const MAX_FAR_SHARE_OVERALL: f64 = 0.0003;

/// What was compared of a pair of executors.
#[derive(Default)]
struct Tally {
    table: Table,
    decisions: usize,
    disagreeing_cases: usize,
}

/// By numbers of the executors.
type Tallies = BTreeMap<(usize, usize), Tally>;

/// Compares frame by frame until histories differ. Why they do not agree, if they do not.
fn compare(a: &[Snapshot], b: &[Snapshot], tally: &mut Tally) -> Result<(), String> {
    for (frame, (a, b)) in a.iter().zip(b).enumerate() {
        let mut table = Table::default();
        table.add(a, b);
        let pixels = Table::pixels(a);
        let decisions = Table::decisions(a, b).len();
        if decisions > MAX_DECISIONS.max((MAX_DECISION_SHARE * pixels as f64) as usize) {
            return Err(format!("frame {frame}: {decisions} decisions of {pixels}"));
        }
        for (name, agreement) in &table.0 {
            let allowed = MAX_FAR_VALUES.max((MAX_FAR_SHARE * agreement.values as f64) as usize);
            if agreement.far > allowed + DECISION_FOOTPRINT * decisions {
                let (far, values) = (agreement.far, agreement.values);
                return Err(format!("frame {frame}: {far} of {values} values of {name} are far apart"));
            }
        }
        tally.decisions += decisions;
        if decisions > 0 {
            break;
        }
        tally.table.merge(&table);
    }
    Ok(())
}

/// What two executors on the same device leave is the same to the last bit.
fn check_identical(a: &[Snapshot], b: &[Snapshot]) -> Result<(), TestCaseError> {
    for (frame, (a, b)) in a.iter().zip(b).enumerate() {
        for (name, words) in &a.0 {
            let differing = words.iter().zip(&b.0[name]).position(|(a, b)| a != b);
            prop_assert_eq!(differing, None, "{} of frame {} differs first at this word", name, frame);
        }
    }
    Ok(())
}

fn is_first_on_device(all: &[Box<dyn Executor>], index: usize) -> bool {
    all[..index].iter().all(|other| other.device() != all[index].device())
}

fn check_spec(spec: &Spec, all: &mut [Box<dyn Executor>], tallies: &mut Tallies) -> Result<(), TestCaseError> {
    let case = spec.case();
    let runs: Vec<_> = all.iter_mut().map(|executor| case.run(executor.as_mut())).collect();
    for (run, executor) in runs.iter().zip(all.iter()) {
        prop_assert!(run.iter().all(Snapshot::is_finite), "{}: the output is not finite", executor.name());
    }
    for i in 0..runs.len() {
        for j in 0..i {
            let pair = |error: TestCaseError| match error {
                TestCaseError::Fail(reason) => {
                    TestCaseError::fail(format!("{} and {}: {reason}", all[i].name(), all[j].name()))
                }
                reject => reject,
            };
            if all[i].device() == all[j].device() {
                check_identical(&runs[i], &runs[j]).map_err(pair)?;
                continue;
            }
            // Other backends on the same device add nothing.
            if !(is_first_on_device(all, i) && is_first_on_device(all, j)) {
                continue;
            }
            let tally = tallies.entry((i, j)).or_default();
            if let Err(reason) = compare(&runs[i], &runs[j], tally) {
                println!("{} and {}: {reason}, size {}", all[i].name(), all[j].name(), spec.size);
                tally.disagreeing_cases += 1;
            }
        }
    }
    Ok(())
}

#[test]
fn random_sequences_are_the_same_everywhere() {
    let state = RefCell::new((executors(), Tallies::new()));
    let (mut runner, cases) = runner(file!(), 48);
    let result = runner.run(&any_spec(), |spec| {
        let (all, tallies) = &mut *state.borrow_mut();
        check_spec(&spec, all, tallies)
    });
    let (all, tallies) = state.into_inner();
    for ((i, j), tally) in &tallies {
        let Tally { table, decisions, disagreeing_cases } = tally;
        println!(
            "{} and {}, {cases} cases, {decisions} decisions, {disagreeing_cases} cases set aside\n{table}",
            all[*i].name(),
            all[*j].name()
        );
    }
    if let Err(error) = result {
        panic!("{error}");
    }
    for tally in tallies.values() {
        assert!(tally.disagreeing_cases <= 2 + (MAX_DISAGREEING_CASES * f64::from(cases)) as usize);
        for (name, agreement) in &tally.table.0 {
            assert!((agreement.far as f64) < MAX_FAR_SHARE_OVERALL * agreement.values as f64, "{name}");
        }
    }
}

/// A frame in which nothing is remarkable.
const CALM: FrameSpec = FrameSpec {
    scale: (1.0, 1.0),
    seed: 1,
    radiance: Field::Noise(0.0, 1.0),
    hit_distance: Field::Constant(1.0),
    depth: Field::Constant(4.0),
    roughness: Field::Constant(0.5),
    normals: Normals::Facing,
    normal_length: Field::Constant(1.0),
    motion: Motion::Uniform(0.0, 0.0),
    hit_motion: Field::Constant(0.0),
    camera_shift: 0.0,
    camera_turn: 0.0,
    jitter: (0.0, 0.0),
    exposure: 1.0,
    seconds: 1.0 / 60.0,
    reset: false,
    resize: None,
};

/// What random sequences once found, made small.
#[test]
fn what_was_found_before() {
    // The direction to a surface so near that the square of its distance is 0 was not a number.
    let mut near = Spec {
        size: UVec2::ONE,
        settings: Preset::Reference.settings(),
        later_settings: None,
        frames: vec![FrameSpec { depth: Field::Constant(1e-30), ..CALM }],
    };
    near.settings.conventions.depth = limpid::settings::DepthEncoding::Linear;
    near.settings.coverage.roughness_threshold = 0.4;
    near.settings.coverage.fallback = Fallback::Environment;
    // The largest falloff by depth times the largest depth was infinite, and infinity times no difference no number.
    let mut far = Spec {
        size: UVec2::new(1, 2),
        settings: near.settings.clone(),
        later_settings: None,
        frames: vec![FrameSpec { depth: Field::Constant(5e29), ..CALM }],
    };
    far.settings.coverage.roughness_threshold = 1.0;
    far.settings.prefilter.depth_falloff = 1e12;
    for spec in [near, far] {
        check_spec(&spec, &mut executors(), &mut Tallies::new()).unwrap();
    }
}

/// Moving, noisy surfaces of all kinds, as the teeth of the comparison bite into.
fn lively(preset: Preset) -> Spec {
    // Filters that reach over noise average it, whatever their width; edges show it.
    let edges = Field::Blocks(7, 0.1, 3.0);
    let frame = |seed| FrameSpec {
        seed,
        radiance: if preset == Preset::Default { edges } else { Field::Noise(0.1, 3.0) },
        hit_distance: Field::Noise(0.5, 5.0),
        depth: Field::Blocks(11, 3.0, 4.0),
        roughness: Field::Gradient(0.0, 1.0),
        normals: Normals::Curved,
        motion: Motion::Uniform(1.25, -0.5),
        camera_shift: seed as f32 * 0.01,
        ..CALM
    };
    let mut settings = preset.settings();
    settings.coverage.roughness_threshold = 1.0;
    settings.conventions.depth = limpid::settings::DepthEncoding::Linear;
    Spec { size: UVec2::new(72, 40), settings, later_settings: None, frames: (0..5).map(frame).collect() }
}

fn run_with(preset: Preset, change: impl FnOnce(&mut limpid::Settings)) -> Vec<Snapshot> {
    let mut spec = lively(preset);
    change(&mut spec.settings);
    spec.case().run(&mut Cpu::new())
}

fn is_caught(a: &[Snapshot], b: &[Snapshot]) -> bool {
    compare(a, b, &mut Tally::default()).is_err()
}

#[test]
fn a_wrong_sign_of_motion_is_caught() {
    for preset in [Preset::Default, Preset::Reference] {
        let run = |scale: f32| {
            run_with(preset, |settings| {
                settings.conventions.motion_scale *= scale;
                // History is found by motion vectors alone, whatever its colour.
                settings.features.mirror_parallax = false;
                settings.reproject.surface_color_gate = 10_000.0;
            })
        };
        assert!(!is_caught(&run(1.0), &run(1.0)));
        assert!(is_caught(&run(1.0), &run(-1.0)));
    }
}

#[test]
fn swapped_history_is_caught() {
    let swaps =
        [(Preset::Default, "accumulate", &["history"][..]), (Preset::Reference, "reproject", &["guide", "signal"])];
    for (preset, kernel, pairs) in swaps {
        let case = lively(preset).case();
        let right = case.run(&mut Cpu::new());
        for &resource in pairs {
            let (mut plan, kernels) = limpid::Plan::new(&case.settings, case.size).unwrap();
            let passes = plan.passes.iter_mut().filter(|pass| pass.kernel == kernel);
            for bound in passes.flat_map(|pass| &mut pass.bindings).filter(|bound| bound.resource == resource) {
                bound.copy = match bound.copy {
                    Copy::Current => Copy::Previous,
                    Copy::Previous => Copy::Current,
                };
            }
            let core = limpid::Denoiser::with_plan(&case.settings, plan, kernels);
            assert!(is_caught(&right, &case.run_plan(&mut Cpu::new(), core)), "{resource}");
        }
    }
}

/// The kernel without its barriers.
fn without_barriers(kernel: &Kernel) -> Kernel {
    fn strip(block: &naga::Block) -> naga::Block {
        let mut stripped = naga::Block::new();
        for (statement, span) in block.clone().span_into_iter() {
            match statement {
                naga::Statement::ControlBarrier(_) => {}
                naga::Statement::Loop { body, continuing, break_if } => {
                    let body = strip(&body);
                    stripped.push(naga::Statement::Loop { body, continuing, break_if }, span);
                }
                other => stripped.push(other, span),
            }
        }
        stripped
    }
    let mut module = kernel.module.clone();
    let function = &mut module.entry_points[0].function;
    function.body = strip(&function.body);
    Kernel { module, ..kernel.clone() }
}

#[test]
fn a_missing_workgroup_barrier_is_caught() {
    // Kernels of the other pipeline have no workgroup memory.
    let case = lively(Preset::Reference).case();
    let (plan, kernels) = limpid::Plan::new(&case.settings, case.size).unwrap();
    for wrong in ["reproject", "resolve_temporal"] {
        let broken = |kernel: &Kernel| if kernel.name == wrong { without_barriers(kernel) } else { kernel.clone() };
        let kernels = kernels.iter().map(broken).collect();
        let mut watched = Cpu::watched();
        case.run_plan(&mut watched, limpid::Denoiser::with_plan(&case.settings, plan.clone(), kernels));
        let faults = watched.faults();
        assert!(faults.iter().any(|fault| fault.contains(wrong) && fault.contains("Race")), "{wrong}: {faults:?}");
    }
}

/// Which settings change bits when they are one percent off, and which of those would be noticed between devices.
fn noticed(preset: Preset, groups: &[&str]) -> (usize, Vec<&'static str>) {
    let right = run_with(preset, |_| ());
    let (mut differing, mut caught) = (0, Vec::new());
    for number in limpid::Settings::numbers().filter(|n| groups.iter().any(|group| n.path.starts_with(group))) {
        let value = number.default * 1.01;
        let value = if value > number.high { number.default * 0.99 } else { value };
        let wrong = run_with(preset, |settings| *settings = set_number(settings, number, value));
        differing += usize::from(check_identical(&right, &wrong).is_err());
        if is_caught(&right, &wrong) {
            caught.push(number.path);
        }
    }
    println!("{differing} constants change bits; between different devices these would be noticed: {caught:?}");
    (differing, caught)
}

#[test]
fn a_constant_that_is_one_percent_off_is_caught() {
    let (differing, caught) = noticed(Preset::Reference, &["reproject.", "prefilter.", "resolve."]);
    // The others decide at thresholds that this scene does not come near to.
    assert!(differing >= 15);
    for path in ["reproject.neighborhood_falloff", "prefilter.normal_power", "resolve.stability", "resolve.clip_scale"]
    {
        assert!(caught.contains(&path), "{path}");
    }
    let (differing, caught) = noticed(Preset::Default, &["accumulate.", "footprint."]);
    assert!(differing >= 5);
    assert!(caught.contains(&"footprint.filter_scale"));
}
