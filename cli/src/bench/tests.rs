use glam::UVec2;
use limpid::Preset;

use super::accumulate::Accumulation;
use super::compare::{Verdict, compare};
use super::counts::Counts;
use super::error::{Regions, Values};
use super::history::History;
use super::record::{Config, Report, Run, SequenceInfo, Spread, Times, VariantInfo};
use super::table::recovery_of;
use super::variant::Variant;
use crate::cost::{Cost, PassCost, Statistic};
use crate::scene;

const SIZE: UVec2 = UVec2::new(48, 27);

fn frames(name: &str, count: u32, samples: u32) -> Vec<crate::sequence::Frame> {
    let scene = scene::by_name(name).unwrap();
    (0..count).map(|number| scene.render(number, SIZE, samples)).collect()
}

#[test]
fn accumulation_of_a_still_scene_is_the_mean() {
    let frames = frames("still", 5, 0);
    let mut accumulation = Accumulation::default();
    let last = frames.iter().map(|frame| accumulation.add(frame)).last().unwrap();
    for (index, rgb) in last.iter().enumerate().filter(|(index, _)| frames[0].depth[*index] > 0.0) {
        let mean = frames.iter().map(|frame| frame.radiance[index][0]).sum::<f32>() / 5.0;
        assert!((rgb[0] - mean).abs() <= 1e-4 * (1.0 + mean), "{} is not the mean {mean}", rgb[0]);
    }
}

#[test]
fn nothing_is_disoccluded_where_nothing_moves_and_borders_are_where_the_camera_does() {
    let still = frames("still", 2, 0);
    let history = History::new(&still[1], Some(&still[0])).unwrap();
    assert!((0..still[1].pixels()).all(|index| still[1].depth[index] == 0.0 || !history.is_disoccluded(index)));
    // The surface is found at its own depth, wherever the camera went.
    let moving = frames("courtyard", 2, 0);
    let history = History::new(&moving[1], Some(&moving[0])).unwrap();
    let surfaces: Vec<usize> = (0..moving[1].pixels()).filter(|index| moving[1].depth[*index] > 0.0).collect();
    let lost = surfaces.iter().filter(|index| history.is_disoccluded(**index)).count();
    let share = lost as f64 / surfaces.len() as f64;
    assert!((0.005..0.15).contains(&share), "{share} of the pixels");
}

#[test]
fn regions_follow_roughness_and_brightness() {
    let mut frame = frames("still", 1, 1).remove(0);
    frame.reference = Some(vec![[1.0; 3]; frame.pixels()]);
    frame.radiance.fill([1.0; 4]);
    frame.depth.fill(2.0);
    frame.roughness.fill(0.05);
    frame.radiance[10 * 48 + 20] = [100.0; 4];
    let shares = Regions::new(&frame, None, 1.0).shares();
    assert_eq!((shares["mirror"], shares["rough"], shares["disocclusion"]), (1.0, 0.0, 0.0));
    assert_eq!(shares["firefly"], 25.0 / (48.0 * 27.0));
}

#[test]
fn quartiles_are_between_values() {
    let spread = Spread::of(vec![4.0, 1.0, 2.0, 3.0]).unwrap();
    assert_eq!((spread.low, spread.median, spread.high), (1.75, 2.5, 3.25));
    assert_eq!(Spread::of(Vec::new()), None);
}

fn values(rms: f64) -> Values {
    Values([("rms".to_owned(), rms), ("psnr".to_owned(), 20.0 - rms)].into())
}

fn report(rms: &[f64], milliseconds: f64) -> Report {
    let variant = Variant::preset("default", Preset::Default);
    let counts = Counts::new(&Preset::Default.settings(), SIZE).unwrap();
    let statistics = vec![Statistic { name: "VGPRs".to_owned(), value: 77.0 }];
    let pass = PassCost { pass: "fill".to_owned(), executable: String::new(), subgroup_size: 64, statistics };
    let compiled = Cost { gpu: "navi21".to_owned(), passes: vec![pass] };
    let frames: Vec<Values> = rms.iter().copied().map(values).collect();
    let frame = Spread { low: milliseconds, median: milliseconds, high: milliseconds };
    let times = Times {
        frame,
        cpu: frame,
        ratio: milliseconds,
        cpu_ratio: milliseconds,
        samples: 1,
        passes: Default::default(),
    };
    let (sequence, name) = ("still".to_owned(), "default".to_owned());
    let (events, shares) = (Vec::new(), Default::default());
    Report {
        limpid: "0".to_owned(),
        config: Config { size: SIZE, frames: 3, samples: 1, repetitions: 1 },
        device: "none".to_owned(),
        variants: vec![VariantInfo { variant, counts: Some(counts), compiled: Some(compiled) }],
        sequences: vec![SequenceInfo { name: sequence.clone(), size: SIZE, frames: 3, events, limit: None, shares }],
        runs: vec![Run { sequence, variant: name, mean: Values::mean(&frames), frames, times: Some(times) }],
        scaling: Vec::new(),
    }
}

#[test]
fn comparisons_see_errors_and_counts_but_neither_times_nor_noise() {
    let before = report(&[0.10, 0.12, 0.11, 0.13], 1.0);
    let after = |rms: &[f64]| compare(&before, &report(rms, 9.0));
    assert_eq!(after(&[0.10, 0.12, 0.11, 0.13]).changes, []);
    // Up here, down there.
    assert_eq!(after(&[0.08, 0.14, 0.09, 0.16]).changes, []);
    assert_eq!(after(&[0.12, 0.14, 0.13, 0.15]).worse(), 1);
    let better = after(&[0.08, 0.10, 0.09, 0.11]);
    assert_eq!((better.worse(), better.changes[0].verdict), (0, Verdict::Better));

    let mut heavier = before.clone();
    heavier.variants[0].counts.as_mut().unwrap().barriers += 1;
    assert_eq!(compare(&before, &heavier).worse(), 1);
    assert_eq!(compare(&heavier, &before).worse(), 0);
    let mut empty = before.clone();
    empty.runs.clear();
    assert_eq!(compare(&before, &empty).worse(), 2);
}

/// Every feature that the default preset has is left out by one variant, and its code with it.
#[test]
fn features_are_left_out_one_by_one() {
    let load = |options: &[String]| {
        let mut settings = serde_json::to_value(Preset::Default.settings())?;
        for option in options {
            let (path, value) = option.split_once('=').unwrap();
            let place = settings.pointer_mut(&format!("/{}", path.replace('.', "/"))).unwrap();
            *place = serde_json::from_str(value)?;
        }
        Ok(serde_json::from_value(settings)?)
    };
    let costs = |settings: &limpid::Settings| {
        let counts = Counts::new(settings, SIZE).unwrap();
        let (plan, _) = limpid::Plan::new(settings, SIZE).unwrap();
        (counts.instructions.values().sum::<u64>(), counts.bytes_allocated, plan.inputs().count())
    };
    let whole = Preset::Default.settings();
    let ablations = Variant::ablations(load).unwrap();
    let features: Vec<&Variant> = ablations.iter().filter(|v| v.note.starts_with("compiled without")).collect();
    // Three are of the published pipeline, and blocks are there for outliers too.
    let flags = serde_json::to_string(&whole.features).unwrap().matches(":true").count();
    let others = ["history_search", "edge_repair", "average_mixing", "block_statistics"];
    assert!(features.iter().all(|v| !others.iter().any(|name| v.note.contains(name))));
    assert!(flags > others.len() && features.len() + others.len() == flags, "{flags} flags");
    let (instructions, bytes, inputs) = costs(&whole);
    for variant in features {
        let (fewer_instructions, fewer_bytes, fewer_inputs) = costs(variant.settings.as_ref().unwrap());
        // What is not kept is read, and what is not read is derived.
        let is_less = match variant.name.as_str() {
            "no-gbuffer-copy" | "no-packed-guide" => fewer_bytes < bytes,
            "no-normal-input" => fewer_inputs < inputs,
            _ => fewer_instructions < instructions,
        };
        assert!(is_less, "{}", variant.name);
    }
}

#[test]
fn recovery_is_counted_from_the_event() {
    let run = &report(&[9.0, 9.0, 5.0, 3.0, 2.0, 1.05, 0.9, 1.0, 1.0, 1.0], 1.0).runs[0];
    let (frames, settled) = recovery_of(run, 2, 10).unwrap();
    assert_eq!((frames, settled), (3, 1.0));
    assert_eq!(recovery_of(run, 8, 10).unwrap().0, 0);
}

#[test]
fn reports_survive_their_file_and_resume_only_what_fits() {
    let report = report(&[0.1, 0.2], 1.0);
    let read: Report = serde_json::from_str(&serde_json::to_string(&report).unwrap()).unwrap();
    assert_eq!(read, report);
    let mut fresh = Report { runs: Vec::new(), sequences: Vec::new(), ..report.clone() };
    fresh.resume(read.clone()).unwrap();
    assert_eq!(fresh, report);
    let other = Report { device: "another".to_owned(), ..read };
    let message = fresh.resume(other).unwrap_err().to_string();
    assert!(message.contains("device was another, now it is none"), "{message}");
}

#[test]
fn pages_load_nothing() {
    let page = super::page(&report(&[0.1, 0.2], 1.0), &[("picture".to_owned(), vec![1, 2, 3])]);
    let links = page.replace("http://www.w3.org/2000/svg", "");
    assert!(!links.contains("http") && !links.contains("src=\"/"), "{links}");
    assert!(page.contains("<svg") && page.contains("AQID"));
    assert!(page.contains("fill VGPRs") && page.contains("77"), "{page}");
}
