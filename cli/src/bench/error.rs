//! Errors of a frame beyond the scores of [`metrics`](crate::metrics): tails, and by kind of pixel.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::history::History;
use crate::metrics::{FrameScore, tone_map};
use crate::sequence::Frame;

/// Which way a metric gets better.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Better {
    /// Downwards.
    Lower,
    /// Upwards.
    Higher,
    /// Towards a value.
    Near(f64),
}

/// What a number in a report means.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Metric {
    /// Name in tables and files.
    pub name: &'static str,
    /// Which way is better.
    pub better: Better,
    /// Changes up to this are none: absolute for metrics in decibels and those near a value, else relative.
    pub tolerance: f64,
    /// One line for readers.
    pub meaning: &'static str,
}

impl Metric {
    /// A value as one that grows as it gets worse.
    pub fn badness(&self, value: f64) -> f64 {
        match self.better {
            Better::Lower => value,
            Better::Higher => -value,
            Better::Near(target) => (value - target).abs(),
        }
    }
}

const fn metric(name: &'static str, better: Better, tolerance: f64, meaning: &'static str) -> Metric {
    Metric { name, better, tolerance, meaning }
}

/// All metrics, in the order of tables. Errors are of exposed radiance after `x / (1 + x)` unless said otherwise.
pub const METRICS: &[Metric] = &[
    metric("psnr", Better::Higher, 0.02, "peak signal to noise ratio, dB"),
    metric("relmse", Better::Lower, 0.01, "relative mean squared error of linear radiance"),
    metric("flip", Better::Lower, 0.005, "difference a viewer notices, 0 to 1"),
    metric("flicker", Better::Lower, 0.01, "mean change of a pixel's error from frame to frame"),
    metric("energy", Better::Near(1.0), 0.002, "mean radiance over the reference's"),
    metric("bias", Better::Near(0.0), 0.0005, "mean signed error; below 0 is too dark"),
    metric("rms", Better::Lower, 0.005, "root mean squared error"),
    metric("p99", Better::Lower, 0.01, "error that 1 % of values exceed"),
    metric("max", Better::Lower, 0.05, "largest error"),
    metric("disocclusion", Better::Lower, 0.01, "rms where the frame before did not show the surface"),
    metric("mirror", Better::Lower, 0.01, "rms at perceptual roughness up to 0.1"),
    metric("rough", Better::Lower, 0.01, "rms at perceptual roughness above 0.3"),
    metric("firefly", Better::Lower, 0.01, "rms within 2 pixels of an input 16 times above the reference"),
    metric("non_finite", Better::Lower, 0.0, "values that are NaN or infinite"),
];

/// Values of one frame, or their means over several, by name of the metric. What is not defined is not there.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Values(pub BTreeMap<String, f64>);

impl Values {
    /// The value of a metric.
    pub fn get(&self, name: &str) -> Option<f64> {
        self.0.get(name).copied()
    }

    fn set(&mut self, name: &str, value: Option<f64>) {
        if let Some(value) = value.filter(|value| value.is_finite()) {
            self.0.insert(name.to_owned(), value);
        }
    }

    /// Means over those that have a value; the sum of non-finite ones.
    pub fn mean<'v>(all: impl IntoIterator<Item = &'v Values> + Clone) -> Values {
        let mut mean = Values::default();
        for metric in METRICS {
            let values: Vec<f64> = all.clone().into_iter().filter_map(|values| values.get(metric.name)).collect();
            let divisor = if metric.name == "non_finite" { 1 } else { values.len() };
            if !values.is_empty() {
                mean.set(metric.name, Some(values.iter().sum::<f64>() / divisor as f64));
            }
        }
        mean
    }
}

/// Kinds of pixels in which errors differ, by the name of their metric.
pub const REGIONS: [&str; 4] = ["disocclusion", "mirror", "rough", "firefly"];

/// For each pixel the regions that it belongs to, a bit for each.
#[derive(Clone, Debug)]
pub struct Regions(Vec<u8>);

impl Regions {
    /// Regions of a frame that follows `previous`. Sky belongs to none, and nothing is disoccluded after a reset.
    pub fn new(frame: &Frame, previous: Option<&Frame>, exposure: f32) -> Self {
        let fireflies = fireflies(frame, exposure);
        let history = History::new(frame, previous);
        let bits = |index: usize| {
            if frame.depth[index] == 0.0 {
                return 0;
            }
            let roughness = frame.roughness[index];
            let is_disoccluded = history.as_ref().is_some_and(|history| history.is_disoccluded(index));
            let is_in = [is_disoccluded, roughness <= 0.1, roughness > 0.3, fireflies[index]];
            is_in.into_iter().enumerate().map(|(bit, is_in)| u8::from(is_in) << bit).sum()
        };
        Self((0..frame.pixels()).map(bits).collect())
    }

    /// Share of pixels in each region.
    pub fn shares(&self) -> BTreeMap<String, f64> {
        let share =
            |bit: usize| self.0.iter().filter(|bits| **bits >> bit & 1 == 1).count() as f64 / self.0.len() as f64;
        REGIONS.iter().enumerate().map(|(bit, name)| ((*name).to_owned(), share(bit))).collect()
    }
}

fn luminance(rgb: &[f32]) -> f32 {
    0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]
}

fn fireflies(frame: &Frame, exposure: f32) -> Vec<bool> {
    let mut near = vec![false; frame.pixels()];
    let Some(reference) = &frame.reference else { return near };
    let (width, height) = (frame.size.x as usize, frame.size.y as usize);
    for (index, (input, reference)) in frame.radiance.iter().zip(reference).enumerate() {
        if luminance(input) * exposure > 16.0 * (luminance(reference) * exposure).max(0.05) {
            let (x, y) = (index % width, index / width);
            for y in y.saturating_sub(2)..(y + 3).min(height) {
                near[y * width + x.saturating_sub(2)..y * width + (x + 3).min(width)].fill(true);
            }
        }
    }
    near
}

fn shown(value: f32, exposure: f32) -> f64 {
    // As the scorer does: NaN and negative values are black, infinity is the largest half float.
    tone_map(f64::from(value.min(65504.0) * exposure).max(0.0))
}

fn root_mean(squares: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = squares.fold((0.0, 0usize), |(sum, count), square| (sum + square, count + 1));
    (count > 0).then(|| (sum / count as f64).sqrt())
}

/// All metrics of a frame.
///
/// # Panics
///
/// When the frame has no reference or images differ in size.
pub fn values(score: &FrameScore, denoised: &[[f32; 3]], frame: &Frame, regions: &Regions, exposure: f32) -> Values {
    let reference = frame.reference.as_deref().expect("a scored frame has a reference");
    let is_surface = |index: &usize| frame.depth[*index] != 0.0;
    let errors: Vec<[f64; 3]> = denoised
        .iter()
        .zip(reference)
        .map(|(a, b)| [0, 1, 2].map(|c| (shown(a[c], exposure) - shown(b[c], exposure)).abs()))
        .collect();
    let squares = |indices: &mut dyn Iterator<Item = usize>| {
        root_mean(indices.flat_map(|index| errors[index]).map(|error| error * error))
    };
    let mut values = Values::default();
    let m = &score.metrics;
    for (name, value) in [
        ("psnr", m.psnr),
        ("relmse", m.relmse),
        ("flip", m.flip),
        ("energy", m.energy),
        ("bias", m.bias),
        ("non_finite", m.non_finite as f64),
    ] {
        values.set(name, Some(value));
    }
    values.set("flicker", m.flicker);
    values.set("rms", squares(&mut (0..errors.len()).filter(is_surface)));
    let mut sorted: Vec<f64> = (0..errors.len()).filter(is_surface).flat_map(|index| errors[index]).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    values.set("max", sorted.last().copied());
    values.set("p99", sorted.get(sorted.len() * 99 / 100).copied());
    for (bit, name) in REGIONS.iter().enumerate() {
        values.set(name, squares(&mut (0..errors.len()).filter(|index| regions.0[*index] >> bit & 1 == 1)));
    }
    values
}
