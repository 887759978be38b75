//! The ash backend under the Khronos validation layer: core, synchronization and GPU-assisted checks. Any message
//! fails a test.

use glam::UVec2;
use limpid::plan::Plan;
use limpid::resource::Access;
use limpid::settings::{Fallback, Pipeline, RayList};
use limpid::{DebugView, Denoiser, Preset, Settings};
use limpid_harness::executor::{Ash, AshOptions};
use limpid_harness::strategy::noise;
use limpid_harness::{Case, Change, Pixel, skip};

const SIZE: UVec2 = UVec2::new(40, 24);

fn open(old_barriers: bool, shared_memory: bool) -> Option<Ash> {
    let options = AshOptions { validation: true, old_barriers, shared_memory, ..AshOptions::default() };
    Ash::try_open(&options).map_err(|error| skip(&error.to_string())).ok()
}

fn noisy(frame: u32, p: UVec2) -> Pixel {
    let sky = if p.x < 9 && p.y < 9 { 0.0 } else { 4.0 };
    Pixel { radiance: [noise(frame, p), 0.5, 0.25, 3.0], depth: sky, ..Pixel::WALL }
}

fn assert_silent(ash: &Ash) {
    let messages = ash.messages();
    assert!(messages.is_empty(), "{}", messages.join("\n\n"));
}

#[test]
fn frames_sizes_and_settings_change_without_a_message() {
    for old_barriers in [false, true] {
        let Some(mut ash) = open(old_barriers, !old_barriers) else { return };
        let mut case = Case::still(SIZE, 10, noisy);
        case.settings.coverage.ray_list = Some(RayList::default());
        case.steps[2].frame.size = UVec2::new(17, 23);
        case.steps[3].change = Change::Resize(UVec2::new(64, 33));
        let mut other = case.settings.clone();
        other.coverage.fallback = Fallback::Environment;
        other.features.debug_view = Some(DebugView::Candidate);
        case.steps[5].change = Change::Settings(Box::new(other.clone()));
        other.footprint.filter_scale = 0.2;
        case.steps[6].change = Change::Settings(Box::new(other.clone()));
        other.features.near_taps = 3;
        case.steps[7].change = Change::Settings(Box::new(other.clone()));
        other.pipeline = Pipeline::Published;
        case.steps[8].change = Change::Settings(Box::new(other));
        case.run(&mut ash);
        assert_silent(&ash);
        // What is kept for frames in flight is freed with the rest.
        assert_eq!(ash.leaked_bytes(), 0);
        assert_silent(&ash);
    }
}

#[test]
fn a_frame_has_few_barriers_and_its_passes_have_times() {
    for (preset, dispatches, barriers, descriptor_writes) in
        [(Preset::Default, 15, 14, 5), (Preset::Reference, 7, 7, 5)]
    {
        let Some(mut ash) = open(false, false) else { return };
        let mut case = Case::still(SIZE, 3, noisy);
        case.settings.pipeline = preset.settings().pipeline;
        case.run(&mut ash);
        let denoiser = ash.denoiser().unwrap();
        let recorded = denoiser.recorded();
        // One of them for whoever reads the output.
        let counts = (recorded.dispatches, recorded.barriers, recorded.descriptor_writes);
        assert_eq!(counts, (dispatches, barriers, descriptor_writes));
        let times = denoiser.read_times().unwrap().expect("the device has finished");
        let passes = denoiser.plan().passes.iter().map(|pass| pass.name.as_str());
        assert!(times.iter().map(|time| time.pass.as_str()).eq(passes));
        assert!(times.iter().any(|time| !time.duration.is_zero()));
    }
}

/// A plan in which two transient textures are not used at the same time.
fn sharing_plan(settings: &Settings) -> Denoiser {
    let (mut plan, kernels) = Plan::new(settings, SIZE).unwrap();
    let mut scratch = plan.resource("average").unwrap().clone();
    scratch.name = "scratch".to_owned();
    plan.resources.push(scratch);
    // What the first pass that writes it says of tiles that are left out; here there are none.
    let mut bindings = plan.passes.iter_mut().flat_map(|pass| &mut pass.bindings);
    let bound = bindings.find(|bound| bound.resource == "average").unwrap();
    bound.resource = "scratch".to_owned();
    Denoiser::with_plan(settings, plan, kernels)
}

#[test]
fn shared_memory_changes_nothing() {
    let Some(mut ash) = open(false, true) else { return };
    let mut case = Case::still(SIZE, 5, |frame, p| Pixel { depth: 4.0, ..noisy(frame, p) });
    case.settings.pipeline = Pipeline::Published;
    let own = case.run(&mut ash);
    let bytes = ash.denoiser().unwrap().allocated_bytes();
    let core = sharing_plan(&case.settings);
    let (memory, shared) = (core.plan().memory(), core.plan().shared_memory());
    assert!(shared.total() < memory.total());
    let sharing = case.run_plan(&mut ash, core);
    assert_eq!(ash.denoiser().unwrap().allocated_bytes(), bytes);
    for (own, sharing) in own.iter().zip(&sharing) {
        assert_eq!(own.0["output"], sharing.0["output"]);
    }
    assert_silent(&ash);
}

/// The layer has to find what is missing, or its silence means nothing.
#[test]
fn a_missing_barrier_is_reported() {
    let Some(mut ash) = open(false, false) else { return };
    let mut case = Case::still(SIZE, 3, noisy);
    case.settings.pipeline = Pipeline::Published;
    let (mut plan, kernels) = Plan::new(&case.settings, SIZE).unwrap();
    // The plan says that prefilter and fill write nothing, so resolve_temporal does not wait for them.
    for pass in plan.passes.iter_mut().filter(|pass| ["prefilter", "fill"].contains(&pass.kernel.as_str())) {
        for bound in pass.bindings.iter_mut().filter(|bound| bound.access.writes()) {
            bound.access = Access::Read;
        }
    }
    case.run_plan(&mut ash, Denoiser::with_plan(&case.settings, plan, kernels));
    let messages = ash.messages();
    assert!(messages.iter().any(|message| message.contains("HAZARD")), "{}", messages.join("\n\n"));
}
