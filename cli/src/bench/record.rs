//! What a run of the bench found, as data: the content of `bench.json`.

use std::collections::BTreeMap;

use anyhow::{Result, bail};
use glam::UVec2;
use serde::{Deserialize, Serialize};

use super::counts::Counts;
use super::error::Values;
use super::subject::Event;
use super::variant::{Group, Variant};
use crate::cost::Cost;

/// What was asked for. Reports can be resumed only with the same.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Config {
    /// Size of built-in scenes.
    pub size: UVec2,
    /// Frames of built-in scenes, and most frames of a folder.
    pub frames: u32,
    /// Rays a pixel of references.
    pub samples: u32,
    /// How often each frame is timed; 0 for no times at all.
    pub repetitions: u32,
}

/// A sequence that was measured on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SequenceInfo {
    /// Unique name.
    pub name: String,
    /// In pixels.
    pub size: UVec2,
    /// How many.
    pub frames: usize,
    /// What happens in it.
    pub events: Vec<Event>,
    /// PSNR of the reference itself, as far as its own noise is known: the limit of what can be measured.
    pub limit: Option<f64>,
    /// Mean share of pixels in each region.
    pub shares: BTreeMap<String, f64>,
}

/// Median and quartiles, in milliseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// A quarter is below.
    pub low: f64,
    /// Half is below.
    pub median: f64,
    /// A quarter is above.
    pub high: f64,
}

impl Spread {
    /// Of some values; `None` of none.
    pub fn of(mut values: Vec<f64>) -> Option<Self> {
        values.sort_unstable_by(f64::total_cmp);
        let at = |share: f64| {
            let position = share * (values.len() - 1) as f64;
            let (below, above) = (values[position.floor() as usize], values[position.ceil() as usize]);
            below + (above - below) * position.fract()
        };
        (!values.is_empty()).then(|| Self { low: at(0.25), median: at(0.5), high: at(0.75) })
    }
}

/// Run time of a variant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Times {
    /// Of a frame, from submission to completion.
    pub frame: Spread,
    /// Of all processors together.
    pub cpu: Spread,
    /// Median of the ratio to Reference on the same frame right after each other.
    pub ratio: f64,
    /// The same of [`Times::cpu`].
    pub cpu_ratio: f64,
    /// Frames timed.
    pub samples: usize,
    /// Median of each pass, by the device's clock where it has one.
    pub passes: BTreeMap<String, f64>,
}

/// A variant on a sequence.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// Name of the sequence.
    pub sequence: String,
    /// Name of the variant.
    pub variant: String,
    /// Means over all frames.
    pub mean: Values,
    /// Frame by frame.
    pub frames: Vec<Values>,
    /// Not for baselines.
    pub times: Option<Times>,
}

/// Time at one image size, or at one share of tiles that need denoising.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ScalingPoint {
    /// Name of the variant.
    pub variant: String,
    /// In pixels.
    pub size: UVec2,
    /// Share of tiles with something to denoise, 0 to 1.
    pub share: f64,
    /// Of a frame.
    pub time: Spread,
}

/// A variant with what its plan costs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct VariantInfo {
    /// The variant.
    #[serde(flatten)]
    pub variant: Variant,
    /// Not for baselines.
    pub counts: Option<Counts>,
    /// What a GPU's compiler makes of its passes, where that can be asked. Never compared: it depends on the driver.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub compiled: Option<Cost>,
}

/// Everything that was found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Version of limpid.
    pub limpid: String,
    /// What was asked for.
    pub config: Config,
    /// What it ran on.
    pub device: String,
    /// Ways to denoise.
    pub variants: Vec<VariantInfo>,
    /// Sequences.
    pub sequences: Vec<SequenceInfo>,
    /// Each variant on each sequence.
    pub runs: Vec<Run>,
    /// Times over size and share of tiles.
    pub scaling: Vec<ScalingPoint>,
}

impl Report {
    /// The run of a variant on a sequence.
    pub fn run(&self, sequence: &str, variant: &str) -> Option<&Run> {
        self.runs.iter().find(|run| run.sequence == sequence && run.variant == variant)
    }

    /// Means of a variant over the sequences that it ran on, those for recovery excluded unless there are no
    /// others.
    pub fn overall(&self, variant: &str) -> Values {
        let of = |events: bool| {
            let names = self.sequences.iter().filter(move |s| s.events.is_empty() != events);
            names.filter_map(|sequence| self.run(&sequence.name, variant)).map(|run| &run.mean).collect::<Vec<_>>()
        };
        let plain = of(false);
        Values::mean(if plain.is_empty() { of(true) } else { plain })
    }

    /// Geometric mean over sequences of a variant's time relative to Reference.
    pub fn overall_ratio(&self, variant: &str) -> Option<f64> {
        self.geometric_mean(variant, |times| times.ratio)
    }

    /// The same for the time of all processors together.
    pub fn overall_cpu_ratio(&self, variant: &str) -> Option<f64> {
        self.geometric_mean(variant, |times| times.cpu_ratio)
    }

    fn geometric_mean(&self, variant: &str, ratio: fn(&Times) -> f64) -> Option<f64> {
        let runs = self.runs.iter().filter(|run| run.variant == variant);
        let logs: Vec<f64> = runs.filter_map(|run| run.times.as_ref()).map(|times| ratio(times).ln()).collect();
        (!logs.is_empty()).then(|| (logs.iter().sum::<f64>() / logs.len() as f64).exp())
    }

    /// Time relative to a yardstick, if one took part: of a frame, and of all processors together. Both were
    /// measured relative to Reference, in the same turns.
    pub fn ratio_to_yardstick(&self, variant: &str) -> Option<[f64; 2]> {
        let mut variants = self.variants.iter().map(|info| &info.variant);
        let yardstick = variants.find(|variant| variant.group == Group::Yardstick)?;
        let wall = self.overall_ratio(variant)? / self.overall_ratio(&yardstick.name)?;
        Some([wall, self.overall_cpu_ratio(variant)? / self.overall_cpu_ratio(&yardstick.name)?])
    }

    /// Keeps the runs of an interrupted report that this one would repeat.
    ///
    /// # Errors
    ///
    /// When it was made with other options, on another device, or with other settings under the same name.
    pub fn resume(&mut self, earlier: Report) -> Result<()> {
        for (what, now, then) in [
            ("version", self.limpid.clone(), earlier.limpid.clone()),
            ("device", self.device.clone(), earlier.device.clone()),
            ("options", format!("{:?}", self.config), format!("{:?}", earlier.config)),
        ] {
            if now != then {
                bail!("cannot resume: {what} was {then}, now it is {now}");
            }
        }
        for variant in &self.variants {
            let same_name = earlier.variants.iter().find(|v| v.variant.name == variant.variant.name);
            if same_name.is_some_and(|earlier| earlier.variant.settings != variant.variant.settings) {
                bail!("cannot resume: the settings of `{}` have changed", variant.variant.name);
            }
        }
        let is_wanted = |run: &Run| self.variants.iter().any(|v| v.variant.name == run.variant);
        self.runs = earlier.runs.iter().filter(|run| is_wanted(run)).cloned().collect();
        (self.sequences, self.scaling) = (earlier.sequences, earlier.scaling);
        Ok(())
    }
}
