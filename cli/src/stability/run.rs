//! Carries cases out and judges them.

use anyhow::Result;
use glam::UVec2;
use half::f16;
use limpid::Preset;

use super::case::{Case, Criterion, Paint};
use super::known;
use super::report::{Verdict, Worst};
use crate::backend::{self, Choice};

/// One rounding of a half float, relative.
const HALF_STEP: f32 = 1.0 / 1024.0;

/// Radiance and variance of a frame's pixels.
struct Output {
    frame: usize,
    size: UVec2,
    texels: Vec<[f32; 4]>,
}

impl Output {
    fn mean(&self) -> f64 {
        let sum: f64 = self.texels.iter().flat_map(|texel| &texel[..3]).map(|value| f64::from(*value)).sum();
        sum / (3 * self.texels.len()) as f64
    }

    fn pixel(&self, index: usize) -> [u32; 2] {
        [index as u32 % self.size.x, index as u32 / self.size.x]
    }

    fn worst(&self, index: usize, expected: String) -> Worst {
        let [r, g, b, a] = self.texels[index];
        Worst { frame: self.frame, pixel: self.pixel(index), value: format!("{r} {g} {b}, variance {a}"), expected }
    }
}

/// What a criterion came to: measured, allowed, and where.
struct Finding {
    name: &'static str,
    measured: f64,
    limit: f64,
    worst: Option<Worst>,
}

impl Finding {
    fn new(name: &'static str, measured: f64, limit: f64) -> Self {
        Self { name, measured, limit, worst: None }
    }

    /// Takes another measurement where it is worse.
    fn raise(&mut self, measured: f64, worst: impl FnOnce() -> Worst) {
        if measured > self.measured || (measured.is_nan() && !self.measured.is_nan()) {
            (self.measured, self.worst) = (measured, Some(worst()));
        }
    }
}

/// A value as limpid takes it: not negative, finite, no more than a half float holds.
fn usable(value: f32) -> f32 {
    if value.is_finite() { f16::from_f32(value.clamp(0.0, 65504.0)).to_f32() } else { 0.0 }
}

/// What was put in so far.
struct Inputs {
    low: f32,
    high: f32,
    sum: f64,
    count: usize,
    /// Mean of each frame.
    means: Vec<f64>,
}

impl Inputs {
    fn add(&mut self, radiance: &[[f32; 4]]) {
        let values = || radiance.iter().flat_map(|texel| &texel[..3]).map(|value| usable(*value));
        (self.low, self.high) =
            values().fold((self.low, self.high), |(low, high), value| (low.min(value), high.max(value)));
        let sum: f64 = values().map(f64::from).sum();
        self.sum += sum;
        self.count += 3 * radiance.len();
        self.means.push(sum / (3 * radiance.len()) as f64);
    }
}

/// Outputs that criteria look back at: all of a short run; of a long one means, and the last two.
struct Run {
    outputs: Vec<Output>,
    means: Vec<f64>,
    inputs: Inputs,
    findings: Vec<Finding>,
    refusal: Option<String>,
}

/// Frames up to which all outputs are kept.
const SHORT: usize = 150;

fn check_finite(output: &Output, finding: &mut Finding) {
    let bad = |texel: &[f32; 4]| texel.iter().any(|value| !value.is_finite());
    let count = output.texels.iter().filter(|texel| bad(texel)).count();
    if let Some(index) = output.texels.iter().position(bad) {
        finding.raise(count as f64, || output.worst(index, "finite numbers".to_owned()));
    }
}

/// Distance beyond the bounds in units of what rounding allows.
fn check_bounds(output: &Output, low: f32, high: f32, exposure: f32, finding: &mut Finding) {
    // Rounded as input, history, average and output, and by the floor of the clip, which is exposed radiance.
    let slack = |value: f32| f64::from(4.0 * HALF_STEP * value) + f64::from(0.0011 / exposure) + 6e-8;
    for (index, texel) in output.texels.iter().enumerate() {
        for value in &texel[..3] {
            let above = f64::from(value - high) / slack(high);
            let below = f64::from(low - value) / slack(low);
            let outside = above.max(below);
            if outside > finding.measured {
                finding.raise(outside, || output.worst(index, format!("{low} to {high}")));
            }
        }
    }
}

fn run(case: &Case, preset: Preset, choice: Choice, paint: &Paint) -> Result<Run> {
    let mut backend = backend::open_encoded(choice, &case.settings_of(preset), case.size)?;
    let inputs = Inputs { low: f32::INFINITY, high: 0.0, sum: 0.0, count: 0, means: Vec::new() };
    let findings = vec![Finding::new("finite", 0.0, 0.0), Finding::new("bounded", 0.0, 1.0)];
    let mut run = Run { outputs: Vec::new(), means: Vec::new(), inputs, findings, refusal: None };
    for number in 0..case.frames {
        let (frame, exposure) = case.frame(number, paint);
        run.inputs.add(&frame.radiance);
        let denoised = match backend.denoise(&frame, exposure, None) {
            Ok(denoised) => denoised,
            Err(refusal) => {
                run.refusal = Some(format!("frame {number}: {refusal:#}"));
                break;
            }
        };
        let texels = denoised.radiance.iter().zip(&denoised.variance).map(|(&[r, g, b], &a)| [r, g, b, a]).collect();
        let output = Output { frame: number, size: frame.size, texels };
        check_finite(&output, &mut run.findings[0]);
        check_bounds(&output, run.inputs.low, run.inputs.high, exposure, &mut run.findings[1]);
        run.means.push(output.mean());
        if case.frames > SHORT && run.outputs.len() == 2 {
            run.outputs.remove(0);
        }
        run.outputs.push(output);
    }
    Ok(run)
}

fn relative(a: f32, b: f32) -> f64 {
    if a == b { 0.0 } else { f64::from(a - b).abs() / f64::from(a.abs().max(b.abs())).max(1e-7) }
}

/// Largest relative difference of a pixel's radiance.
fn difference(a: [f32; 4], b: [f32; 4]) -> f64 {
    (0..3).map(|c| relative(a[c], b[c])).fold(0.0, f64::max)
}

fn contained(own: &Run, twin: &Run, at: UVec2, frame: usize, reach: u32, lifetime: usize) -> Vec<Finding> {
    let mut footprint = Finding::new("footprint", 0.0, f64::from(reach));
    let mut lasting = Finding::new("lifetime", 0.0, 0.05);
    for (a, b) in own.outputs.iter().zip(&twin.outputs) {
        for index in 0..a.texels.len() {
            let difference = difference(a.texels[index], b.texels[index]);
            if difference == 0.0 {
                continue;
            }
            let expected = || a.worst(index, format!("{:?}, as without it", &b.texels[index][..3]));
            if a.frame == frame {
                let [x, y] = a.pixel(index);
                footprint.raise(f64::from(x.abs_diff(at.x).max(y.abs_diff(at.y))), expected);
            } else if a.frame >= frame + lifetime {
                lasting.raise(difference, expected);
            }
        }
    }
    vec![footprint, lasting]
}

fn insensitive(own: &Run, twin: &Run, limit: f64) -> Finding {
    let (mut sum, mut count) = (0.0, 0);
    let mut largest = Finding::new("sensitivity", 0.0, limit);
    for (a, b) in own.outputs.iter().zip(&twin.outputs) {
        for index in 0..a.texels.len() {
            let difference = difference(a.texels[index], b.texels[index]);
            (sum, count) = (sum + difference, count + 1);
            largest.raise(difference, || a.worst(index, format!("{:?}", &b.texels[index][..3])));
        }
    }
    // It is the mean that counts; the worst pixel shows where a decision tipped.
    Finding { measured: sum / f64::from(count.max(1)), ..largest }
}

/// How far a ratio is outside of a range around 1, as a share of that range.
fn energy(own: &Run, low: f64, high: f64) -> Finding {
    let input = own.inputs.sum / own.inputs.count.max(1) as f64;
    let ratio = own.means.last().map_or(f64::NAN, |mean| if input == *mean { 1.0 } else { mean / input });
    let allowed = if ratio < 1.0 { 1.0 - low } else { high - 1.0 };
    Finding::new("energy", (ratio - 1.0).abs(), allowed)
}

/// Frames from the change on until the mean stays within a tenth of the input's.
fn settles(own: &Run, from: usize, within: usize) -> Finding {
    let pairs = own.means.iter().zip(&own.inputs.means).skip(from);
    let off: Vec<bool> = pairs.map(|(output, input)| (output - input).abs() > 0.1 * input).collect();
    let frames = off.iter().rposition(|off| *off).map_or(0, |last| last + 1);
    let mut finding = Finding::new("settling", frames as f64, within as f64);
    if let Some(output) = own.outputs.last().filter(|_| frames > within) {
        let mean = own.inputs.means.last().copied().unwrap_or_default();
        finding.worst = Some(output.worst(0, format!("a mean of {mean:.4}")));
    }
    finding
}

fn at_rest(own: &Run) -> Finding {
    let mut finding = Finding::new("at rest", 0.0, f64::from(2.0 * HALF_STEP));
    if let [.., a, b] = &own.outputs[..] {
        for index in 0..a.texels.len() {
            // Among denormal numbers a step is larger.
            let near = (0..3).all(|c| (a.texels[index][c] - b.texels[index][c]).abs() <= 1.2e-7);
            let change = if near { 0.0 } else { difference(a.texels[index], b.texels[index]) };
            finding.raise(change, || b.worst(index, format!("{:?}, as one frame before", &a.texels[index][..3])));
        }
    }
    finding
}

fn no_drift(own: &Run, from: usize, within: f64) -> Finding {
    // Means of a window, as noise moves single ones.
    let window = |start: usize| {
        let means = &own.means[start.min(own.means.len())..(start + 50).min(own.means.len())];
        means.iter().sum::<f64>() / means.len().max(1) as f64
    };
    let (begin, end) = (window(from), window(own.means.len().saturating_sub(50)));
    Finding::new("drift", (end / begin - 1.0).abs(), within)
}

fn judge(criterion: &Criterion, own: &Run, twin: Option<&Run>) -> Vec<Finding> {
    match (criterion, twin) {
        (&Criterion::Contained { at, frame, reach, lifetime }, Some(twin)) => {
            contained(own, twin, at, frame, reach, lifetime)
        }
        (&Criterion::Insensitive(limit), Some(twin)) => vec![insensitive(own, twin, limit)],
        (&Criterion::Energy(low, high), _) => vec![energy(own, low, high)],
        (&Criterion::Settles { from, within }, _) => vec![settles(own, from, within)],
        (Criterion::AtRest, _) => vec![at_rest(own)],
        (&Criterion::NoDrift { from, within }, _) => vec![no_drift(own, from, within)],
        (Criterion::Refused(message), _) => {
            let is_refused = own.refusal.as_ref().is_some_and(|refusal| refusal.contains(message));
            vec![Finding::new("refused", f64::from(!is_refused), 0.0)]
        }
        // These hold of every case, and the others need a twin, which the case has.
        (Criterion::Finite | Criterion::Bounded | Criterion::Contained { .. } | Criterion::Insensitive(_), _) => {
            Vec::new()
        }
    }
}

/// Runs a case with a preset on a backend.
///
/// # Errors
///
/// When the backend cannot be opened, or a frame is refused that should not be.
pub fn run_case(case: &Case, (name, preset): (&'static str, Preset), choice: Choice) -> Result<Vec<Verdict>> {
    let mut own = run(case, preset, choice, &case.paint)?;
    let may_refuse = case.criteria.iter().any(|criterion| matches!(criterion, Criterion::Refused(_)));
    if let Some(refusal) = own.refusal.as_ref().filter(|_| !may_refuse) {
        anyhow::bail!("case `{}` was refused: {refusal}", case.name);
    }
    let twin = case.twin.as_ref().map(|twin| run(case, preset, choice, twin)).transpose()?;
    let mut findings = std::mem::take(&mut own.findings);
    findings.extend(case.criteria.iter().flat_map(|criterion| judge(criterion, &own, twin.as_ref())));
    let verdict = |finding: Finding| {
        let passed = finding.measured <= finding.limit;
        Verdict {
            group: case.group,
            case: case.name.clone(),
            preset: name,
            backend: choice.name(),
            criterion: finding.name,
            measured: Some(finding.measured).filter(|measured| measured.is_finite()),
            limit: finding.limit,
            passed,
            known: known::reason(&case.name, finding.name, name).filter(|_| !passed),
            worst: finding.worst,
        }
    };
    Ok(findings.into_iter().map(verdict).collect())
}
