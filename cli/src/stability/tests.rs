use glam::UVec2;
use limpid::Preset;

use super::case::{Case, Criterion, Pixel, noise};
use super::run::run_case;
use super::{Report, Verdict, figure, library};
use crate::backend::Choice;

/// Long enough for history to be full several times over.
const LONG: usize = 200;

fn run(case: &Case) -> Vec<Verdict> {
    run_case(case, ("default", Preset::Default), Choice::Cpu).unwrap()
}

#[test]
fn every_case_holds_or_is_known_not_to() {
    let mut report = Report::default();
    for case in library::all(LONG) {
        for &preset in Preset::ALL {
            report.verdicts.extend(run_case(&case, preset, Choice::Cpu).unwrap());
        }
    }
    let failures: Vec<&Verdict> = report.failures().collect();
    assert!(failures.is_empty(), "{failures:#?}");
    assert_eq!(report.repaired(), Vec::<&str>::new(), "known failures that no longer fail");
}

#[test]
fn cases_have_names_of_their_own() {
    let mut names: Vec<_> = library::all(LONG).into_iter().map(|case| (case.group, case.name)).collect();
    let count = names.len();
    names.sort();
    names.dedup();
    assert_eq!(names.len(), count);
}

/// The criterion fails of a case made to break it, and says where.
fn fails(case: Case, criterion: &str) -> Verdict {
    let verdicts = run(&case);
    let verdict = verdicts.into_iter().find(|verdict| verdict.criterion == criterion).unwrap();
    assert!(!verdict.passed && verdict.known.is_none(), "{verdict:?}");
    verdict
}

fn changing(frame: usize, _: UVec2) -> Pixel {
    Pixel::lit(if frame < 4 { 1e4 } else { 1.0 })
}

/// A dot has the colour of its outcome and lies right of the limit where the verdict does not hold.
#[test]
fn figures_show_what_fails() {
    let case = Case::new("test", "energy", changing).must(Criterion::Energy(0.9, 1.1));
    let mut verdict = fails(case, "energy");
    let x_of_last = |verdict: &Verdict, colour: &str| {
        let svg = figure::svg(&Report { verdicts: vec![verdict.clone()] });
        let dot = svg.lines().rfind(|line| line.starts_with("<circle") && line.contains(colour)).unwrap();
        dot.split('"').nth(1).unwrap().parse::<f64>().unwrap()
    };
    (verdict.limit, verdict.measured) = (0.5, Some(5.0));
    let failed = x_of_last(&verdict, "#b00020");
    (verdict.passed, verdict.measured) = (true, Some(0.05));
    let passed = x_of_last(&verdict, "#0072b2");
    (verdict.passed, verdict.known) = (false, Some("a reason"));
    (verdict.measured, verdict.limit) = (Some(0.5), 0.5);
    let limit = x_of_last(&verdict, "#e69f00");
    assert!(((failed - limit) - (limit - passed)).abs() < 0.2 && failed > limit, "{passed} {limit} {failed}");
}

#[test]
fn criteria_can_fail() {
    let noisy = |frame: usize, p: UVec2| Pixel::lit(noise(frame, p));
    fails(Case::new("test", "energy", changing).must(Criterion::Energy(0.9, 1.1)), "energy");
    // The default preset notices such a change at once.
    let unnoticed = Case::new("test", "settling", changing).with(|settings| settings.features.light_change = false);
    fails(unnoticed.must(Criterion::Settles { from: 4, within: 0 }), "settling");
    fails(Case::new("test", "at rest", noisy).must(Criterion::AtRest), "at rest");
    let drifting = |frame: usize, _: UVec2| Pixel::lit(1.0 + frame as f32 / 100.0);
    fails(
        Case::new("test", "drift", drifting).lasting(200).must(Criterion::NoDrift { from: 100, within: 0.1 }),
        "drift",
    );
    fails(Case::new("test", "refused", noisy).must(Criterion::Refused("camera")), "refused");
    let brighter = Case::new("test", "sensitivity", noisy).against(|frame, p| Pixel::lit(1.5 * noise(frame, p)));
    let verdict = fails(brighter.must(Criterion::Insensitive(0.1)), "sensitivity");
    assert!((verdict.measured.unwrap() - 1.0 / 3.0).abs() < 0.05, "{verdict:?}");
    // A light that stays on is not forgotten, and reaches everywhere.
    let at = UVec2::new(20, 12);
    let spot = |frame: usize, _: UVec2| Pixel::lit(if frame >= 3 { 50.0 } else { 1.0 });
    let contained = |at, reach| Criterion::Contained { at, frame: 3, reach, lifetime: 2 };
    let case = || Case::new("test", "contained", spot).against(|_, _| Pixel::lit(1.0));
    let verdict = fails(case().must(contained(at, 30)), "lifetime");
    assert!(verdict.worst.is_some_and(|worst| worst.frame >= 5), "no place");
    let verdict = fails(case().must(contained(UVec2::ZERO, 3)), "footprint");
    assert!(verdict.worst.is_some_and(|worst| worst.frame == 3), "no place");
}
