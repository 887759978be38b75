//! Reports as text: a summary for the terminal, CSV for spreadsheets.

use std::fmt::Write;

use super::error::METRICS;
use super::record::{Report, Run};
use super::variant::Group;

fn cell(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.4}"))
}

/// A row for each variant: errors over all sequences and time relative to Reference.
pub fn summary(report: &Report) -> String {
    let shown = ["psnr", "relmse", "flip", "flicker", "energy", "p99"];
    let width = report.variants.iter().map(|v| v.variant.name.len()).max().unwrap_or(0) + 2;
    let mut text = format!("{:<width$}", "variant");
    for name in shown {
        let _ = write!(text, "{name:>10}");
    }
    let _ = write!(text, "{:>10}{:>10}{:>12}{:>12}", "time", "cpu", "bytes/px", "dispatches");
    let yardstick = report.variants.iter().find(|info| info.variant.group == Group::Yardstick);
    for what in ["time", "cpu"] {
        let _ = yardstick.map(|info| write!(text, "{:>14}", format!("{what}/{}", info.variant.name)));
    }
    text.push('\n');
    for info in &report.variants {
        let mean = report.overall(&info.variant.name);
        let _ = write!(text, "{:<width$}", info.variant.name);
        for name in shown {
            let _ = write!(text, "{:>10}", cell(mean.get(name)));
        }
        let times = |ratio: Option<f64>| ratio.map_or_else(|| "-".to_owned(), |ratio| format!("{ratio:.2} x"));
        let name = &info.variant.name;
        let _ = write!(text, "{:>10}{:>10}", times(report.overall_ratio(name)), times(report.overall_cpu_ratio(name)));
        let _ = match &info.counts {
            Some(counts) => write!(text, "{:>12.1}{:>12}", counts.bytes_allocated, counts.dispatches),
            None => write!(text, "{:>12}{:>12}", "-", "-"),
        };
        if yardstick.is_some() {
            let ratios = report.ratio_to_yardstick(name);
            [0, 1].into_iter().for_each(|k| text = format!("{text}{:>14}", times(ratios.map(|ratios| ratios[k]))));
        }
        text.push('\n');
    }
    let _ = writeln!(text, "\n{} sequences; times relative to `reference` in the same run", report.sequences.len());
    let _ = writeln!(text, "on {}", report.device);
    text + &recovery(report)
}

/// Frames that a run takes after the event at `first` until its error is no more than a tenth above what it
/// settles at before `end`, the mean of the last quarter; and that error.
pub fn recovery_of(run: &Run, first: usize, end: usize) -> Option<(usize, f64)> {
    let errors: Vec<f64> = run.frames.get(first..end)?.iter().map(|values| values.get("rms")).collect::<Option<_>>()?;
    let quarter = &errors[errors.len() * 3 / 4..];
    let settled = quarter.iter().sum::<f64>() / quarter.len().max(1) as f64;
    let unsettled = errors.iter().rposition(|error| *error > 1.1 * settled);
    Some((unsettled.map_or(0, |last| last + 1), settled))
}

/// Sequence, event, and its first and last frame.
pub(super) fn events(report: &Report) -> impl Iterator<Item = (&str, &str, usize, usize)> {
    report.sequences.iter().flat_map(|sequence| {
        sequence.events.iter().enumerate().map(|(index, event)| {
            let end = sequence.events.get(index + 1).map_or(sequence.frames, |next| next.frame);
            (sequence.name.as_str(), event.what.as_str(), event.frame, end)
        })
    })
}

fn recovery(report: &Report) -> String {
    let mut text = String::new();
    for (sequence, what, first, end) in events(report) {
        let _ = writeln!(text, "\n{what} (frame {first} of {sequence}): frames to within 10 % of the settled error");
        for info in report.variants.iter().filter(|info| info.variant.group != Group::Ablation) {
            let run = report.run(sequence, &info.variant.name);
            if let Some((frames, settled)) = run.and_then(|run| recovery_of(run, first, end)) {
                let _ = writeln!(text, "  {:<30}{frames:>4}   settled at rms {settled:.4}", info.variant.name);
            }
        }
    }
    text
}

fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}

/// A line for each variant on each sequence, with a header.
pub fn csv(report: &Report) -> String {
    let mut text = "sequence,variant".to_owned();
    METRICS.iter().for_each(|metric| text = format!("{text},{}", metric.name));
    text += ",ms_median,ms_low,ms_high,cpu_ms_median,time_ratio,cpu_ratio\n";
    for run in &report.runs {
        let _ = write!(text, "{},{}", quoted(&run.sequence), quoted(&run.variant));
        for metric in METRICS {
            let _ = write!(text, ",{}", run.mean.get(metric.name).map_or_else(String::new, |value| value.to_string()));
        }
        match &run.times {
            Some(times) => {
                let frame = times.frame;
                let _ = write!(text, ",{},{},{}", frame.median, frame.low, frame.high);
                let _ = writeln!(text, ",{},{},{}", times.cpu.median, times.ratio, times.cpu_ratio);
            }
            None => text += ",,,,,,\n",
        }
    }
    text
}
