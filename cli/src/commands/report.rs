//! What a run measured, for people and for scripts.

use std::collections::BTreeMap;
use std::fmt;
use std::time::Duration;

use serde::Serialize;

use crate::backend::{Backend, Denoised};
use crate::metrics::{self, FrameScore, Metrics, Scorer};
use crate::sequence::Frame;

/// Time of a pass.
#[derive(Debug, Serialize)]
struct PassReport {
    name: String,
    /// Mean over the frames after the first, which also compiles, in milliseconds.
    milliseconds: Option<f64>,
}

/// Scores of one image sequence.
#[derive(Debug, Serialize)]
struct Scores {
    frames: Vec<FrameScore>,
    mean: Metrics,
    late: Option<Metrics>,
}

impl Scores {
    fn new(frames: Vec<FrameScore>) -> Self {
        Self { mean: metrics::mean(&frames), late: metrics::late(&frames), frames }
    }
}

/// Everything about a run.
#[derive(Debug, Serialize)]
pub(super) struct Report {
    name: String,
    device: String,
    width: u32,
    height: u32,
    frames: usize,
    exposure: f32,
    rays_per_pixel: f64,
    bytes_per_pixel: f64,
    dispatches_per_frame: usize,
    /// From submission to completion, mean over the frames after the first.
    milliseconds_per_frame: Option<f64>,
    /// Time of all processors together.
    cpu_milliseconds_per_frame: Option<f64>,
    passes: Vec<PassReport>,
    noisy: Option<Scores>,
    denoised: Option<Scores>,
}

/// Gathers a report frame by frame.
pub(super) struct Recorder {
    exposure: f32,
    noisy_scorer: Scorer,
    denoised_scorer: Scorer,
    noisy: Vec<FrameScore>,
    denoised: Vec<FrameScore>,
    total_time: Duration,
    total_cpu_time: Duration,
    pass_times: BTreeMap<String, Duration>,
    timed_frames: u32,
    frames: usize,
    rays: u64,
}

/// The noisy input as an image to score and to look at.
pub(super) fn noisy_radiance(frame: &Frame) -> Vec<[f32; 3]> {
    frame.radiance.iter().map(|&[r, g, b, _]| [r, g, b]).collect()
}

impl Recorder {
    pub(super) fn new(exposure: f32) -> Self {
        Self {
            exposure,
            noisy_scorer: Scorer::new(exposure),
            denoised_scorer: Scorer::new(exposure),
            noisy: Vec::new(),
            denoised: Vec::new(),
            total_time: Duration::ZERO,
            total_cpu_time: Duration::ZERO,
            pass_times: BTreeMap::new(),
            timed_frames: 0,
            frames: 0,
            rays: 0,
        }
    }

    pub(super) fn add(&mut self, frame: &Frame, denoised: &Denoised) {
        if frame.reference.is_some() {
            self.noisy.push(self.noisy_scorer.score(&noisy_radiance(frame), frame));
            self.denoised.push(self.denoised_scorer.score(&denoised.radiance, frame));
        }
        // The first frame's times contain compilation.
        if self.frames > 0 {
            self.timed_frames += 1;
            self.total_time += denoised.time;
            self.total_cpu_time += denoised.cpu_time;
            for (kernel, time) in &denoised.pass_times {
                *self.pass_times.entry(kernel.clone()).or_default() += *time;
            }
        }
        self.frames += 1;
        self.rays += denoised.rays;
    }

    pub(super) fn finish(self, name: String, backend: &dyn Backend) -> Report {
        let plan = backend.plan();
        let pixels = u64::from(plan.size.x) * u64::from(plan.size.y) * self.frames as u64;
        let timed_frames = f64::from(self.timed_frames);
        let milliseconds = |total: &Duration| total.as_secs_f64() * 1e3 / timed_frames;
        let passes = plan.passes.iter();
        Report {
            name,
            device: backend.device().to_owned(),
            width: plan.size.x,
            height: plan.size.y,
            frames: self.frames,
            exposure: self.exposure,
            rays_per_pixel: self.rays as f64 / pixels.max(1) as f64,
            bytes_per_pixel: plan.bytes_per_pixel(),
            dispatches_per_frame: plan.passes.len(),
            milliseconds_per_frame: (self.timed_frames > 0).then(|| milliseconds(&self.total_time)),
            cpu_milliseconds_per_frame: (self.timed_frames > 0).then(|| milliseconds(&self.total_cpu_time)),
            passes: passes
                .map(|pass| PassReport {
                    name: pass.name.clone(),
                    milliseconds: self.pass_times.get(&pass.name).map(milliseconds),
                })
                .collect(),
            noisy: (!self.noisy.is_empty()).then(|| Scores::new(self.noisy)),
            denoised: (!self.denoised.is_empty()).then(|| Scores::new(self.denoised)),
        }
    }
}

impl Report {
    /// Prints to standard output, as tables or as JSON.
    pub(super) fn print(&self, json: bool) -> anyhow::Result<()> {
        super::print(&if json { serde_json::to_string_pretty(self)? + "\n" } else { self.to_string() })
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (title, scores) in [("noisy input", &self.noisy), ("denoised", &self.denoised)] {
            if let Some(scores) = scores {
                writeln!(f, "{}", metrics::table(title, &scores.frames))?;
            }
        }
        let Self { name, width, height, frames, rays_per_pixel, bytes_per_pixel, dispatches_per_frame, .. } = self;
        writeln!(f, "{name} at {width}x{height}, {frames} frames, {rays_per_pixel:.2} rays per pixel")?;
        writeln!(f, "{bytes_per_pixel:.2} bytes per pixel, {dispatches_per_frame} dispatches per frame")?;
        for pass in &self.passes {
            if let Some(milliseconds) = pass.milliseconds {
                writeln!(f, "  {:<18}{milliseconds:9.3} ms", pass.name)?;
            }
        }
        if let (Some(milliseconds), Some(cpu)) = (self.milliseconds_per_frame, self.cpu_milliseconds_per_frame) {
            writeln!(f, "  {:<18}{milliseconds:9.3} ms, {cpu:.3} ms of processor time", "whole frame")?;
        }
        writeln!(f, "on {}", self.device)
    }
}
