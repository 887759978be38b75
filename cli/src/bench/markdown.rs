//! What a report found as Markdown tables, for documents.

use super::error::{METRICS, REGIONS, Values};
use super::record::Report;
use super::table::{events, recovery_of};
use super::variant::{Group, Variant};

/// Errors that the tables show.
const SHOWN: [&str; 5] = ["psnr", "relmse", "flip", "flicker", "energy"];

fn table(header: &[String], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
    let rule = "|---".repeat(header.len()) + "|\n";
    rows.into_iter().fold(line(header) + &rule, |text, row| text + &line(&row))
}

fn header<'n>(first: &[&'n str], more: impl IntoIterator<Item = &'n str>) -> Vec<String> {
    first.iter().copied().chain(more).map(str::to_owned).collect()
}

/// Decibels with two digits, all else with three.
fn cell(values: &Values, name: &str) -> String {
    let digits = if name == "psnr" { 2 } else { 3 };
    values.get(name).map_or_else(String::new, |value| format!("{value:.digits$}"))
}

fn ratio(ratio: Option<f64>) -> String {
    ratio.map_or_else(String::new, |ratio| format!("{ratio:.2}"))
}

/// All variants over all sequences.
fn overall(report: &Report) -> String {
    let rows = report.variants.iter().map(|info| {
        let (name, values) = (&info.variant.name, report.overall(&info.variant.name));
        let errors = SHOWN.iter().map(|metric| cell(&values, metric));
        let times = [ratio(report.overall_ratio(name)), ratio(report.overall_cpu_ratio(name))];
        std::iter::once(name.clone()).chain(errors).chain(times).collect()
    });
    table(&header(&["variant"], SHOWN.into_iter().chain(["time", "processor time"])), rows)
}

/// A row for each sequence and variant that is no ablation.
fn by_sequence(report: &Report, metrics: &[&str]) -> String {
    let shown: Vec<&Variant> =
        report.variants.iter().map(|info| &info.variant).filter(|v| v.group != Group::Ablation).collect();
    let mut rows = Vec::new();
    for sequence in &report.sequences {
        for run in shown.iter().filter_map(|variant| report.run(&sequence.name, &variant.name)) {
            let values = metrics.iter().map(|metric| cell(&run.mean, metric));
            rows.push([run.sequence.clone(), run.variant.clone()].into_iter().chain(values).collect());
        }
        if metrics == REGIONS {
            let share =
                |name: &&str| sequence.shares.get(*name).map_or_else(String::new, |s| format!("{:.1} %", s * 100.0));
            let shares = metrics.iter().map(share);
            rows.push([sequence.name.clone(), "(share of pixels)".to_owned()].into_iter().chain(shares).collect());
        }
    }
    table(&header(&["sequence", "variant"], metrics.iter().copied()), rows)
}

/// Frames that variants take to recover.
fn recovery(report: &Report) -> String {
    let shown: Vec<&str> = report
        .variants
        .iter()
        .filter(|info| !matches!(info.variant.group, Group::Ablation))
        .map(|info| info.variant.name.as_str())
        .collect();
    let rows = events(report).map(|(sequence, what, first, end)| {
        let frames = shown.iter().map(|name| {
            let found = report.run(sequence, name).and_then(|run| recovery_of(run, first, end));
            found.map_or_else(String::new, |(frames, _)| frames.to_string())
        });
        std::iter::once(what.to_owned()).chain(frames).collect()
    });
    table(&header(&["frames to recover"], shown.iter().copied()), rows.collect::<Vec<_>>())
}

/// What is the same on every machine.
fn counts(report: &Report) -> String {
    let with = || report.variants.iter().filter_map(|info| Some((&info.variant.name, info.counts.as_ref()?.named())));
    // Single kernels are for the page.
    let names: Vec<String> = with().next().into_iter().flat_map(|(_, named)| named).map(|(name, _)| name).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).filter(|name| !name.starts_with("SPIR-V of")).collect();
    let rows = with().map(|(variant, named)| {
        let value = |name: &&str| named.iter().find(|(other, _)| other == name).map_or(0.0, |(_, value)| *value);
        let short = |value: f64| if value.fract() == 0.0 { format!("{value}") } else { format!("{value:.1}") };
        std::iter::once(variant.clone()).chain(names.iter().map(|name| short(value(name)))).collect()
    });
    table(&header(&["variant"], names.iter().copied()), rows)
}

/// All tables with headings.
pub fn markdown(report: &Report) -> String {
    let config = &report.config;
    let errors = METRICS.iter().filter(|metric| SHOWN.contains(&metric.name) || REGIONS.contains(&metric.name));
    let meanings: String = errors.map(|metric| format!("- `{}`: {}\n", metric.name, metric.meaning)).collect();
    format!(
        "# Measured by limpid bench\n\nlimpid {} on {}. {} frames a scene, {} rays a pixel in references, each frame \
         timed {} times; times are over those of Reference in the same run.\n\n{meanings}\n\
         ## Over all sequences\n\nBut `events`, which is for recovery.\n\n{}\n## By sequence\n\n{}\n## By kind of pixel\n\nRoot mean squared errors.\n\n{}\n\
         ## Recovery\n\n{}\n## Costs that are the same everywhere\n\nBytes are a pixel.\n\n{}",
        report.limpid,
        report.device,
        config.frames,
        config.samples,
        config.repetitions,
        overall(report),
        by_sequence(report, &SHOWN),
        by_sequence(report, &REGIONS),
        recovery(report),
        counts(report),
    )
}
