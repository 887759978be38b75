//! Whether recommended settings keep what they promise: both run on the same frames in turn.

use std::collections::HashSet;
use std::fmt::{self, Write};

use anyhow::{Context, Result};
use limpid::Settings;
use serde::Serialize;

use super::percent;
use super::recommend::{Change, apply};
use crate::backend::{self, Choice};
use crate::bench::error::{Better, METRICS, Values};
use crate::bench::measure::{Observer, run_group};
use crate::bench::variant::{Group, Variant};
use crate::bench::{Run, Subject};
use crate::sequence::Frame;

/// By how much a metric may get worse: the larger of an amount and a share.
struct Bound {
    metric: &'static str,
    amount: f64,
    share: f64,
}

/// What recommended settings may lose.
const BOUNDS: [Bound; 4] = [
    Bound { metric: "psnr", amount: 0.1, share: 0.0 },
    Bound { metric: "relmse", amount: 1e-3, share: 0.05 },
    Bound { metric: "flip", amount: 2e-3, share: 0.0 },
    Bound { metric: "flicker", amount: 3e-4, share: 0.05 },
];

/// PSNR from which on a loss is not seen, in dB.
const UNSEEN: f64 = 45.0;

/// The bounds in words.
const BOUND_TEXT: &str = "PSNR 0.1 dB lower, unless it is above 45; relMSE 5 % or 0.001, FLIP 0.002, flicker 5 % or \
                              0.0003 higher";

/// What one metric came to.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Difference {
    /// Name of the metric, of `limpid bench`.
    pub metric: &'static str,
    /// With the settings given.
    pub given: f64,
    /// With the change.
    pub changed: f64,
    /// Whether it is worse by more than the bound.
    pub beyond_bound: bool,
}

/// Settings that were measured against those given.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Measured {
    /// What was changed.
    pub settings: Vec<String>,
    /// Median ratio of processor time to the settings given, frame by frame in turn; `None` where it was not timed.
    pub cpu_ratio: Option<f64>,
    /// The same of time from submission to completion.
    pub time_ratio: Option<f64>,
    /// Metrics with a bound.
    pub differences: Vec<Difference>,
}

impl Measured {
    fn new(changes: &[&Change], run: &Run, given: &Run) -> Self {
        let times = run.times.as_ref();
        Self {
            settings: changes.iter().map(|change| change.to_string()).collect(),
            cpu_ratio: times.map(|times| times.cpu_ratio),
            time_ratio: times.map(|times| times.ratio),
            differences: BOUNDS.iter().filter_map(|bound| bound.difference(&run.mean, &given.mean)).collect(),
        }
    }

    /// Whether no metric is worse by more than its bound.
    pub fn holds(&self) -> bool {
        self.differences.iter().all(|difference| !difference.beyond_bound)
    }

    /// What it loses in PSNR, in dB.
    fn loss(&self) -> f64 {
        self.differences.iter().find(|d| d.metric == "psnr").map_or(0.0, |d| d.given - d.changed)
    }

    /// Metrics beyond their bound, in words.
    fn complaint(&self) -> String {
        let beyond = self.differences.iter().filter(|difference| difference.beyond_bound);
        let words = beyond.map(|d| format!("{} {:.4} instead of {:.4}", d.metric, d.changed, d.given));
        words.collect::<Vec<_>>().join(", ")
    }
}

impl Bound {
    fn difference(&self, changed: &Values, given: &Values) -> Option<Difference> {
        let metric = METRICS.iter().find(|metric| metric.name == self.metric)?;
        let (changed, given) = (changed.get(self.metric)?, given.get(self.metric)?);
        let (worse, unseen) = match metric.better {
            Better::Higher => (given - changed, changed >= UNSEEN),
            _ => (changed - given, false),
        };
        let beyond_bound = !unseen && worse > self.amount.max(self.share * given.abs());
        Some(Difference { metric: metric.name, given, changed, beyond_bound })
    }
}

/// What running both settings found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verification {
    /// Whether the frames have references. Without, the output with the settings given stands for them.
    pub has_reference: bool,
    /// What it ran on.
    pub device: String,
    /// What remains recommended, measured together.
    pub recommended: Measured,
    /// Each recommendation alone.
    pub single: Vec<Measured>,
    /// Changes that lost more than the bound, with what they lost; they are not recommended.
    pub withdrawn: Vec<String>,
}

/// Frames to measure settings on, against those given.
pub struct Trial<'g> {
    choice: Choice,
    subject: Subject,
    has_reference: bool,
    given: &'g Settings,
}

/// Settings in memory at the same time, besides those given.
const GROUP: usize = 4;

impl<'g> Trial<'g> {
    /// A trial on frames; where they have no references, the output with the settings given stands for them.
    ///
    /// # Errors
    ///
    /// When there is no frame, or the backend fails.
    pub fn new(name: &str, exposure: f32, mut frames: Vec<Frame>, given: &'g Settings, choice: Choice) -> Result<Self> {
        let first = frames.first().context("there is no frame to verify on")?;
        let has_reference = frames.iter().all(|frame| frame.reference.is_some());
        if !has_reference {
            let mut backend = backend::open(choice, given, first.size)?;
            for frame in &mut frames {
                frame.reference = Some(backend.denoise(frame, exposure, None)?.radiance);
            }
        }
        let subject = Subject::new(name, exposure, frames, Vec::new(), None);
        Ok(Self { choice, subject, has_reference, given })
    }

    /// Each set of changes in turn with the settings given; `None` when the observer stopped it.
    fn measure(
        &self,
        sets: &[Vec<&Change>],
        repetitions: u32,
        observer: &mut dyn Observer,
    ) -> Result<Option<Vec<Measured>>> {
        let variant = |name: String, changes: &[&Change]| {
            let settings = Some(apply(self.given, changes.iter().copied())?);
            anyhow::Ok(Variant { name, group: Group::Chosen, note: String::new(), settings })
        };
        let mut variants = vec![variant("given".to_owned(), &[])?];
        for (index, changes) in sets.iter().enumerate() {
            variants.push(variant(format!("changed {index}"), changes)?);
        }
        let variants: Vec<&Variant> = variants.iter().collect();
        let runs = run_group(self.choice, &self.subject, &variants, repetitions, observer)?;
        Ok(runs.map(|runs| {
            let (given, changed) = runs.split_first().expect("the settings given take part");
            sets.iter().zip(changed).map(|(changes, run)| Measured::new(changes, run, given)).collect()
        }))
    }

    /// Measures recommended changes alone and together, and withdraws those that lose more than the bound. `changes`
    /// is left with what remains; `None` when the observer stopped it.
    ///
    /// # Errors
    ///
    /// When a backend cannot be opened or fails.
    pub fn verify(
        &self,
        changes: &mut Vec<Change>,
        repetitions: u32,
        observer: &mut dyn Observer,
    ) -> Result<Option<Verification>> {
        let mut single = Vec::new();
        for group in changes.chunks(GROUP) {
            let sets: Vec<Vec<&Change>> = group.iter().map(|change| vec![change]).collect();
            let Some(measured) = self.measure(&sets, 0, observer)? else { return Ok(None) };
            single.extend(measured);
        }
        let alone = |change: &Change| single.iter().find(|one| one.settings == [change.to_string()]);
        let mut withdrawn = Vec::new();
        changes.retain(|change| {
            let Some(one) = alone(change).filter(|one| !one.holds()) else { return true };
            withdrawn.push(format!("{change}: {}", one.complaint()));
            false
        });
        // Of several values of a setting, the leanest comes first.
        let mut known = HashSet::new();
        changes.retain(|change| known.insert(change.setting.clone()));
        // Two that are refused together: the one that the data says less about comes last.
        while apply(self.given, changes.iter()).is_err() && changes.pop().is_some() {}
        // What does no harm alone can do so together: what loses most goes first.
        let recommended = loop {
            let sets = [changes.iter().collect()];
            let Some(measured) = self.measure(&sets, repetitions, observer)? else { return Ok(None) };
            let Some(together) = measured.into_iter().next() else { return Ok(None) };
            let loss = |change: &Change| alone(change).map_or(0.0, Measured::loss);
            let worst = (0..changes.len()).max_by(|&a, &b| loss(&changes[a]).total_cmp(&loss(&changes[b])));
            match worst.filter(|_| !together.holds()) {
                Some(worst) => {
                    let change = changes.remove(worst);
                    withdrawn.push(format!("{change}, with the others: {}", together.complaint()));
                }
                None => break together,
            }
        };
        let device = backend::open(self.choice, self.given, glam::UVec2::splat(8))?.device().to_owned();
        Ok(Some(Verification { has_reference: self.has_reference, device, recommended, single, withdrawn }))
    }
}

impl fmt::Display for Verification {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Measured { cpu_ratio, time_ratio, differences, .. } = &self.recommended;
        let mut text = format!("    {:<26}{:>10}{:>14}\n", "measured", "given", "recommended");
        for Difference { metric, given, changed, .. } in differences {
            let _ = writeln!(text, "    {metric:<26}{given:>10.4}{changed:>14.4}");
        }
        for (what, ratio) in [("processor time", cpu_ratio), ("time", time_ratio)] {
            if let Some(ratio) = ratio {
                let _ = writeln!(text, "    {what:<26}{:>10.3}{ratio:>14.3}{:>9}", 1.0, percent(1.0 - ratio));
            }
        }
        text += "\n    each alone, PSNR in dB\n";
        for one in &self.single {
            let _ = writeln!(text, "    {:<40}{:>+10.3}", one.settings.join(", "), -one.loss());
        }
        if !self.withdrawn.is_empty() {
            text += "\n    not recommended, worse than the bound\n";
        }
        for withdrawn in &self.withdrawn {
            let _ = writeln!(text, "    {withdrawn}");
        }
        let _ = writeln!(text, "\n    bound: {BOUND_TEXT}");
        if !self.has_reference {
            text += "    there are no references: the output with the settings given stands for them\n";
        }
        writeln!(f, "{text}    on {}", self.device)
    }
}
