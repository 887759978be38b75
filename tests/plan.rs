//! The plan and the kernels say the same, whatever the settings.

use std::collections::{HashMap, HashSet};

use glam::{Mat3, Mat4, UVec2, Vec2, Vec3, camera::rh};
use limpid::emit::{Checks, SpirvOptions, SpirvVersion};
use limpid::kernel::{BindingKind, Kernel, Overrides, names};
use limpid::plan::{Grid, Stage};
use limpid::resource::{Access, Kind};
use limpid::settings::{Fallback, Pipeline, RayList};
use limpid::synchronization::Usage;
use limpid::{Camera, Change, DebugView, Denoiser, Error, FrameInputs, Plan, Preset, Settings};
use proptest::prelude::*;

mod any_settings;
use any_settings::any_settings;

const SIZE: UVec2 = UVec2::new(1920, 1080);

/// Reflection written again from naga's module, not through limpid's own.
fn reflected(kernel: &Kernel) -> HashMap<String, (u32, u32, bool)> {
    let variables = kernel.module.global_variables.iter();
    variables
        .filter_map(|(_, variable)| {
            let at = variable.binding?;
            let writes = match (variable.space, &kernel.module.types[variable.ty].inner) {
                (naga::AddressSpace::Storage { access }, _) => access.contains(naga::StorageAccess::STORE),
                (_, naga::TypeInner::Image { class: naga::ImageClass::Storage { .. }, .. }) => true,
                _ => false,
            };
            Some((variable.name.clone()?, (at.group, at.binding, writes)))
        })
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn bindings_are_those_of_the_kernels(settings in any_settings()) {
        let (plan, kernels) = Plan::new(&settings, SIZE).unwrap();
        let mut used = HashSet::new();
        for (pass, kernel) in plan.passes.iter().zip(&kernels) {
            let bound: HashMap<_, _> = pass
                .bindings
                .iter()
                .map(|b| (b.variable.clone(), (b.group, b.binding, b.access.writes())))
                .collect();
            prop_assert_eq!(&bound, &reflected(kernel), "{}", pass.kernel);
            for b in &pass.bindings {
                let resource = plan.resource(&b.resource).expect("every bound resource is in the plan");
                let binding = kernel.bindings.iter().find(|k| k.name == b.variable).unwrap();
                // The kind of variable fits the kind of resource.
                match (binding.kind, resource.kind) {
                    (BindingKind::Uniform, Kind::Constants)
                    | (BindingKind::TextureFloat, Kind::Input)
                    | (BindingKind::StorageBuffer(_), Kind::Buffer { .. }) => {}
                    (BindingKind::TextureFloat | BindingKind::TextureUint, Kind::Texture { .. }) => {}
                    (BindingKind::StorageTexture(stored), Kind::Texture { format, .. }) => prop_assert_eq!(stored, format),
                    (variable, resource) => prop_assert!(false, "{}: {variable:?} is bound to {resource:?}", b.variable),
                }
                used.insert(b.resource.clone());
            }
            if let Grid::Indirect { resource, .. } = &pass.grid {
                used.insert(resource.clone());
            }
        }
        let listed: HashSet<_> = plan.resources.iter().map(|r| r.name.clone()).collect();
        prop_assert_eq!(listed, used);
        // What is off leaves nothing behind.
        let features = &settings.features;
        prop_assert_eq!(plan.inputs().any(|i| i == "motion"), features.surface_motion);
        let is_published = settings.pipeline == Pipeline::Published;
        let has_input = |name: &str| plan.inputs().any(|input| input == name);
        prop_assert_eq!(has_input("normal"), features.normal_input);
        prop_assert_eq!(has_input("prev_normal"), !features.gbuffer_copy);
        prop_assert_eq!(has_input("prev_depth"), !features.gbuffer_copy);
        let reads_prev_roughness = !features.gbuffer_copy && features.constant_roughness.is_none();
        prop_assert_eq!(has_input("prev_roughness"), reads_prev_roughness);
        prop_assert_eq!(plan.resource("prev_guide").is_some(), !is_published && features.gbuffer_copy);
        let has_guide = features.packed_guide || (is_published && features.gbuffer_copy);
        prop_assert_eq!(plan.resource("guide").is_some(), has_guide);
        for pass in &plan.passes {
            // The least that WebGPU offers a stage.
            let sampled = pass.bindings.iter().filter(|b| b.access == Access::Read);
            let textures = sampled.filter(|b| !matches!(b.variable.as_str(), "frame" | "in_tiles" | "in_args"));
            prop_assert!(textures.count() <= 16, "{}", pass.name);
        }
        let moves_hits = features.hit_motion && features.mirror_parallax && !is_published;
        prop_assert_eq!(plan.inputs().any(|i| i == "hit_motion"), moves_hits);
        let has_pass = |kernel: &str| plan.passes.iter().any(|pass| pass.kernel == kernel);
        prop_assert_eq!(plan.inputs().any(|i| i == "roughness"), features.constant_roughness.is_none());
        prop_assert_eq!(has_pass("prefilter"), is_published && features.spatial_filter);
        let uses_average = is_published && (features.spatial_filter || features.history_clip || features.average_mixing);
        prop_assert_eq!(plan.resource("average").is_some(), uses_average);
        prop_assert_eq!(plan.resource("light").is_some(), !is_published && features.light_change);
        prop_assert_eq!(plan.resource("debug_view").is_some(), features.debug_view.is_some());
        let spreads = usize::from(features.outlier_spread) + usize::from(features.spatial_filter && features.wide_filter);
        let has_wide_filter = features.spatial_filter && features.wide_filter && !is_published;
        let has_statistics = features.block_statistics || features.outlier_spread || features.light_change;
        let has_blocks = has_wide_filter || (has_statistics && !is_published);
        let compares = features.block_statistics || features.outlier_spread;
        let has_whole = features.whole_blocks && compares && has_wide_filter;
        prop_assert_eq!(plan.resource("block_list").is_some(), has_whole);
        prop_assert_eq!(has_pass("accumulate_blocks"), has_whole);
        prop_assert_eq!(plan.resource("blocks").is_some(), has_blocks);
        let uses_samples = features.light_change || features.outlier_spread || has_wide_filter;
        prop_assert_eq!(plan.resource("samples").is_some(), uses_samples && !is_published);
        prop_assert_eq!(has_pass("block_average"), has_blocks);
        prop_assert_eq!(has_pass("block_statistics"), has_statistics && !is_published);
        prop_assert_eq!(has_pass("block_average_accumulated"), has_wide_filter);
        let planned = plan.passes.iter().filter(|pass| pass.kernel == "block_spread").count();
        prop_assert_eq!(planned, if is_published { 0 } else { spreads });
        let names: HashSet<_> = plan.passes.iter().map(|pass| &pass.name).collect();
        prop_assert_eq!(names.len(), plan.passes.len());
        prop_assert_eq!(plan.resource("rays").is_some(), settings.coverage.ray_list.is_some());
        prop_assert_eq!(plan.inputs().any(|i| i == "environment"), settings.coverage.fallback == Fallback::Environment);
    }

    #[test]
    fn settings_and_plans_survive_serialisation(settings in any_settings()) {
        let text = serde_json::to_string(&settings).unwrap();
        prop_assert_eq!(&serde_json::from_str::<Settings>(&text).unwrap(), &settings);
        let (plan, _) = Plan::new(&settings, SIZE).unwrap();
        let text = serde_json::to_string(&plan).unwrap();
        prop_assert_eq!(serde_json::from_str::<Plan>(&text).unwrap(), plan);
    }
}

#[test]
fn the_plan_as_text() {
    for (name, preset) in Preset::ALL {
        let (plan, _) = Plan::new(&preset.settings(), SIZE).unwrap();
        insta::assert_snapshot!(*name, plan);
    }
}

#[test]
fn memory_stays_within_the_published_figure() {
    let (plan, _) = Plan::new(&Preset::Reference.settings(), SIZE).unwrap();
    // As published: 32.25 bytes a pixel, without the copies of last frame's G-buffer.
    let prev_guide = 8.0;
    // Whatever the size.
    let counters_and_grids = 96;
    let pixels = f64::from(SIZE.x) * f64::from(SIZE.y);
    let bytes_per_pixel = (plan.memory().total() - counters_and_grids) as f64 / pixels;
    assert!(bytes_per_pixel - prev_guide <= 32.25, "{bytes_per_pixel}");
    // 24.25 with last frame's G-buffer from the renderer, and this frame's read where it is.
    let mut settings = Preset::Reference.settings();
    (settings.features.gbuffer_copy, settings.features.packed_guide) = (false, false);
    let (plan, _) = Plan::new(&settings, SIZE).unwrap();
    assert!((plan.memory().total() - counters_and_grids) as f64 / pixels <= 24.25);
    // The smallest set: a pair for history, and lists of tiles.
    let mut settings = Settings::default();
    let features = &mut settings.features;
    (features.gbuffer_copy, features.packed_guide, features.light_change) = (false, false, false);
    (features.outlier_spread, features.block_statistics, features.wide_filter) = (false, false, false);
    let (plan, _) = Plan::new(&settings, SIZE).unwrap();
    assert!((plan.memory().total() - counters_and_grids) as f64 / pixels <= 16.125);
    // 32.25 at most with all that is kept of last frame's G-buffer.
    let (plan, _) = Plan::new(&Settings::default(), SIZE).unwrap();
    assert!(plan.bytes_per_pixel() <= 32.25, "{}", plan.bytes_per_pixel());
    let (fast, _) = Plan::new(&Preset::Fast.settings(), SIZE).unwrap();
    assert!(fast.bytes_per_pixel() <= 24.25, "{}", fast.bytes_per_pixel());
    assert_eq!(plan.output(), Some(("history", limpid::resource::Copy::Previous)));
    let memory = plan.memory();
    assert_eq!(memory.total(), plan.resources.iter().map(|r| r.bytes(SIZE)).sum::<u64>());
}

/// What was denoised in the last frame is read from its G-buffer: by other rules it would be something else.
#[test]
fn history_is_lost_where_last_frames_gbuffer_would_say_otherwise() {
    let projection = rh::proj::directx::perspective(1.0, 1.5, 0.1, 100.0);
    let camera = Camera { world_to_view: Mat4::IDENTITY, view_to_clip: projection, jitter: Vec2::ZERO };
    let frame = FrameInputs::new(camera, UVec2::new(640, 480));
    for gbuffer_copy in [true, false] {
        let mut settings = Settings::default();
        settings.features.gbuffer_copy = gbuffer_copy;
        let mut denoiser = Denoiser::new(&settings, SIZE).unwrap();
        let run = |denoiser: &mut Denoiser| {
            let expected = denoiser.prev_size(&frame);
            let constants = denoiser.next_frame(&frame).unwrap().constants;
            assert_eq!(UVec2::from_array(constants.prev_size), expected);
            expected
        };
        assert_eq!(run(&mut denoiser), UVec2::ZERO);
        // Not finished: none to follow.
        assert_eq!(run(&mut denoiser), UVec2::ZERO);
        // Between the stages of a frame, which goes on as it was begun.
        settings.coverage.roughness_threshold = 0.5;
        assert_eq!(denoiser.set_settings(&settings).unwrap(), Change::Constants);
        assert!(denoiser.started_frame().is_ok());
        denoiser.finish_frame();
        assert_eq!(run(&mut denoiser), if gbuffer_copy { frame.size } else { UVec2::ZERO });
        denoiser.finish_frame();
        settings.accumulate.clip_scale = 2.0;
        assert_eq!(denoiser.set_settings(&settings).unwrap(), Change::Constants);
        assert_eq!(run(&mut denoiser), frame.size);
        denoiser.finish_frame();
        let mut cut = frame.clone();
        cut.reset = true;
        assert_eq!(denoiser.prev_size(&cut), UVec2::ZERO);
    }
}

#[test]
fn every_hazard_has_a_barrier() {
    let mut settings = Preset::Reference.settings();
    settings.coverage.ray_list = Some(RayList::default());
    let (plan, _) = Plan::new(&settings, SIZE).unwrap();
    let barriers = plan.dependencies();
    let has = |kernel: &str, resource: &str| {
        let index = plan.passes.iter().position(|pass| pass.kernel == kernel).unwrap();
        barriers[index].iter().any(|barrier| barrier.resource == resource)
    };
    // Written, then read.
    assert!(has("indirect_args", "counters"));
    assert!(has("reproject", "guide") && has("reproject", "args") && has("reproject", "tiles"));
    assert!(has("prefilter", "signal") && has("prefilter", "average"));
    assert!(has("resolve_temporal", "signal"));
    // Read, then written: last frame's passes still read the lists when the next frame begins.
    assert!(has("list_tiles", "tiles") && has("classify", "guide"));
    // Read by both: no barrier.
    assert!(!has("prefilter", "guide") && !has("resolve_temporal", "average") && !has("resolve_temporal", "tiles"));
    // Grids wait for their buffer too, once: later passes read it behind the same barrier.
    let grids = barriers.iter().flatten().filter(|barrier| barrier.after == Usage::Indirect);
    assert_eq!(grids.map(|barrier| barrier.resource.as_str()).collect::<Vec<_>>(), ["args"]);
    assert!(has("indirect_args", "args"));
    for barrier in barriers.iter().flatten() {
        let writes = |usage| matches!(usage, Usage::Kernel(Access::Write | Access::ReadWrite));
        assert!(writes(barrier.before) || writes(barrier.after), "{barrier:?}");
    }
}

#[test]
fn the_tracer_runs_between_the_stages() {
    let (plan, _) = Plan::new(&Settings::default(), SIZE).unwrap();
    let first_denoise = plan.passes.iter().position(|pass| pass.stage == Stage::Denoise).unwrap();
    for (index, pass) in plan.passes.iter().enumerate() {
        assert_eq!(pass.stage == Stage::Denoise, index >= first_denoise);
        let needs_rays = pass.bindings.iter().any(|b| b.resource == "radiance");
        assert!(!(needs_rays && pass.stage == Stage::Classify), "{}", pass.kernel);
    }
}

#[test]
fn kernels_are_all_used() {
    let plans = Preset::ALL.iter().map(|(_, preset)| {
        let mut settings = preset.settings();
        settings.features.debug_view = Some(DebugView::HistoryLength);
        Plan::new(&settings, SIZE).unwrap().0
    });
    let planned: HashSet<_> = plans.flat_map(|plan| plan.passes).map(|pass| pass.kernel).collect();
    assert_eq!(planned, names().map(str::to_owned).collect());
    assert!(Kernel::new("no_such_kernel", &Overrides::new()).is_err());
}

fn camera() -> Camera {
    Camera {
        world_to_view: rh::view::look_at_mat4(Vec3::new(1.0, 2.0, 5.0), Vec3::ZERO, Vec3::Y),
        view_to_clip: rh::proj::directx::perspective(1.0, 16.0 / 9.0, 0.1, 100.0),
        jitter: Vec2::ZERO,
    }
}

#[test]
fn bad_input_is_refused_by_name_and_changes_nothing() {
    let mut denoiser = Denoiser::new(&Settings::default(), UVec2::new(64, 64)).unwrap();
    let good = FrameInputs::new(camera(), UVec2::new(64, 64));
    let mut refuse = |change: &dyn Fn(&mut FrameInputs), expected: &str| {
        let mut inputs = good.clone();
        change(&mut inputs);
        let message = denoiser.next_frame(&inputs).unwrap_err().to_string();
        assert!(message.contains(expected), "{message}");
    };
    refuse(&|i| i.size = UVec2::new(65, 64), "`size` is [65, 64]");
    refuse(&|i| i.size = UVec2::ZERO, "expected 1 to [64, 64]");
    refuse(&|i| i.exposure = 0.0, "`exposure` is 0");
    refuse(&|i| i.exposure = f32::NAN, "`exposure` is NaN");
    refuse(&|i| i.frame_seconds = 0.0, "`frame_seconds` is 0");
    refuse(&|i| i.camera.jitter.x = f32::INFINITY, "jitter.x");
    refuse(&|i| i.camera.world_to_view = Mat4::ZERO, "world_to_view` is not a rigid motion");
    refuse(&|i| i.camera.world_to_view.x_axis.x = f32::NAN, "world_to_view` has entries");
    refuse(&|i| i.camera.view_to_clip.x_axis.x = 0.0, "view_to_clip` is singular");
    refuse(&|i| i.camera.view_to_clip.x_axis.z = 0.1, "oblique");
    // Still at the first frame.
    let schedule = denoiser.next_frame(&good).unwrap();
    assert_eq!((schedule.phase, schedule.constants.prev_size), (0, [0, 0]));
    denoiser.finish_frame();
    assert_eq!(denoiser.next_frame(&good).unwrap().constants.prev_size, [64, 64]);
    // A frame that was never finished left no history.
    assert_eq!(denoiser.next_frame(&good).unwrap().constants.prev_size, [0, 0]);

    let mut settings = Settings::default();
    settings.reproject.max_history = 0.5;
    let message = denoiser.set_settings(&settings).unwrap_err().to_string();
    assert_eq!(message, "setting `reproject.max_history` is 0.5, expected 1.0 to 255.0");
    settings = Settings::default();
    settings.coverage.environment_from_world = Mat3::NAN;
    assert!(matches!(denoiser.set_settings(&settings), Err(Error::Setting { .. })));
    assert!(Denoiser::new(&Settings::default(), UVec2::new(0, 5)).is_err());
    assert!(Denoiser::new(&Settings::default(), UVec2::new(16385, 5)).is_err());
}

#[test]
fn constants_change_without_a_new_plan() {
    let size = UVec2::new(64, 64);
    let mut denoiser = Denoiser::new(&Settings::default(), size).unwrap();
    denoiser.next_frame(&FrameInputs::new(camera(), size)).unwrap();
    denoiser.finish_frame();
    let mut settings = Settings::default();
    settings.resolve.stability = 0.25;
    assert_eq!(denoiser.set_settings(&settings).unwrap(), Change::Constants);
    let constants = denoiser.next_frame(&FrameInputs::new(camera(), size)).unwrap().constants;
    assert_eq!((constants.stability, constants.prev_size), (0.25, size.to_array()));
    denoiser.finish_frame();
    settings.features.near_taps = 3;
    assert_eq!(denoiser.set_settings(&settings).unwrap(), Change::Kernels);
    assert_eq!(denoiser.next_frame(&FrameInputs::new(camera(), size)).unwrap().constants.prev_size, size.to_array());
    denoiser.finish_frame();
    settings.coverage.fallback = Fallback::Input;
    assert_eq!(denoiser.set_settings(&settings).unwrap(), Change::Plan);
    assert_eq!(denoiser.next_frame(&FrameInputs::new(camera(), size)).unwrap().constants.prev_size, [0, 0]);
}

#[test]
fn spirv_has_the_version_and_the_bindings_asked_for() {
    let (_, kernels) = Plan::new(&Settings::default(), SIZE).unwrap();
    for kernel in &kernels {
        let versions = [SpirvVersion::V1_0, SpirvVersion::V1_1, SpirvVersion::V1_2, SpirvVersion::V1_3];
        for (minor, version) in versions.into_iter().enumerate() {
            for debug_names in [false, true] {
                let options = SpirvOptions { version, debug_names, ..SpirvOptions::default() };
                let words = kernel.spirv(&options).unwrap();
                assert_eq!(words[..2], [0x0723_0203, 0x10000 + 0x100 * minor as u32]);
                // Instructions: 5 names an id, 71 decorates one, among other things with its binding (33).
                let mut names = 0;
                let mut bindings = Vec::new();
                let mut rest = &words[5..];
                while let [head, ..] = *rest {
                    let (instruction, tail) = rest.split_at((head >> 16) as usize);
                    names += usize::from(head & 0xffff == 5);
                    if head & 0xffff == 71 && instruction[2] == 33 {
                        bindings.push(instruction[3]);
                    }
                    rest = tail;
                }
                assert_eq!(names > 0, debug_names, "{}", kernel.name);
                bindings.sort_unstable();
                let mut expected: Vec<_> = kernel.bindings.iter().map(|binding| binding.binding).collect();
                expected.sort_unstable();
                assert_eq!(bindings, expected, "{}", kernel.name);
            }
        }
        let robust = SpirvOptions { checks: Checks::Robust, ..SpirvOptions::default() };
        assert!(kernel.spirv(&robust).unwrap().len() > kernel.spirv(&SpirvOptions::default()).unwrap().len());
    }
}
