//! What got better or worse between two reports.

use std::fmt;

use super::error::{Better, METRICS, Metric};
use super::record::{Report, Run};

/// How a value changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verdict {
    /// Beyond noise, in the wrong direction; or gone.
    Worse,
    /// Beyond noise, in the right direction.
    Better,
}

/// A value that changed beyond noise.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// Which way.
    pub verdict: Verdict,
    /// Variant, and sequence if it is an error.
    pub place: String,
    /// Name of the metric or count.
    pub what: String,
    /// Before and after; `None` where there is no such value any more.
    pub values: (f64, Option<f64>),
}

/// All changes of errors and counts. Times never take part.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Comparison {
    /// Worse ones first.
    pub changes: Vec<Change>,
    /// Values compared.
    pub compared: usize,
}

impl Comparison {
    /// How many got worse.
    pub fn worse(&self) -> usize {
        self.changes.iter().filter(|change| change.verdict == Verdict::Worse).count()
    }

    fn note(&mut self, verdict: Verdict, place: &str, what: &str, values: (f64, Option<f64>)) {
        self.changes.push(Change { verdict, place: place.to_owned(), what: what.to_owned(), values });
    }
}

/// Whether a metric's mean changed by more than its tolerance, and by more than twice the standard error of the
/// frames' differences: the same frames are in both, so what they differ by is no matter of the scene.
fn verdict(metric: &Metric, before: &Run, after: &Run) -> Option<Verdict> {
    let pairs = before.frames.iter().zip(&after.frames);
    let differences: Vec<f64> = pairs
        .filter_map(|(a, b)| Some(metric.badness(b.get(metric.name)?) - metric.badness(a.get(metric.name)?)))
        .collect();
    let count = differences.len() as f64;
    let mean = differences.iter().sum::<f64>() / count;
    let variance = differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
    let size = before.mean.get(metric.name)?.abs();
    let tolerance = if metric.better == Better::Lower { metric.tolerance * size } else { metric.tolerance };
    let is_beyond_noise = mean.abs() > tolerance && mean.abs() > 2.0 * (variance / count).sqrt();
    is_beyond_noise.then_some(if mean > 0.0 { Verdict::Worse } else { Verdict::Better })
}

fn compare_runs(comparison: &mut Comparison, before: &Run, after: Option<&Run>) {
    let place = format!("{} on {}", before.variant, before.sequence);
    for metric in METRICS {
        let Some(old) = before.mean.get(metric.name) else { continue };
        comparison.compared += 1;
        let new = after.and_then(|run| run.mean.get(metric.name));
        let verdict = match (after, new) {
            (Some(after), Some(_)) => verdict(metric, before, after),
            _ => Some(Verdict::Worse),
        };
        if let Some(verdict) = verdict {
            comparison.note(verdict, &place, metric.name, (old, new));
        }
    }
}

/// Relative growth of SPIR-V that is no change worth a stop: naga and a repaired corner case both move it a little.
const INSTRUCTION_TOLERANCE: f64 = 0.05;

fn count_verdict(what: &str, old: f64, new: f64) -> Option<Verdict> {
    let tolerance = if what.starts_with("SPIR-V") { INSTRUCTION_TOLERANCE * old } else { 1e-9 };
    let verdict = if new > old { Verdict::Worse } else { Verdict::Better };
    ((new - old).abs() > tolerance).then_some(verdict)
}

/// Compares every error and count of `before` with that of the same name in `after`.
pub fn compare(before: &Report, after: &Report) -> Comparison {
    let mut comparison = Comparison::default();
    for info in &before.variants {
        let name = &info.variant.name;
        let new = after.variants.iter().find(|v| v.variant.name == *name).and_then(|v| v.counts.as_ref());
        let new = new.map(|counts| counts.named()).unwrap_or_default();
        for (what, old) in info.counts.iter().flat_map(|counts| counts.named()) {
            comparison.compared += 1;
            match new.iter().find(|(name, _)| *name == what) {
                Some(&(_, new)) => {
                    if let Some(verdict) = count_verdict(&what, old, new) {
                        comparison.note(verdict, name, &what, (old, Some(new)));
                    }
                }
                None => comparison.note(Verdict::Worse, name, &what, (old, None)),
            }
        }
    }
    for run in &before.runs {
        compare_runs(&mut comparison, run, after.run(&run.sequence, &run.variant));
    }
    comparison.changes.sort_by_key(|change| change.verdict);
    comparison
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for change in &self.changes {
            let verdict = match change.verdict {
                Verdict::Worse => "worse ",
                Verdict::Better => "better",
            };
            let (old, new) = change.values;
            let new = new.map_or_else(|| "gone".to_owned(), |new| format!("{new:.6}"));
            writeln!(f, "{verdict}  {:<24}{:<40}{old:.6} -> {new}", change.what, change.place)?;
        }
        let better = self.changes.len() - self.worse();
        writeln!(f, "{} values compared: {} worse, {better} better beyond noise", self.compared, self.worse())
    }
}
