//! Runs variants side by side on the same frames, so that whatever disturbs the machine disturbs all of them.

use std::collections::BTreeMap;

use anyhow::{Context, Result};

use super::accumulate::Accumulation;
use super::error::{self, Values};
use super::record::{Run, Spread, Times};
use super::subject::Subject;
use super::variant::{ACCUMULATION, NOISY, REFERENCE, Variant};
use super::yardstick::{Oidn, Yardstick};
use crate::backend::{self, Backend, Choice};
use crate::metrics::Scorer;
use crate::sequence::Frame;

/// Frames at the start that are not timed: pipelines are compiled and memory is touched for the first time.
const WARM_UP: usize = 2;

/// What is done with each result of the first repetition, and whether to go on.
pub trait Observer {
    /// A variant has denoised a frame, for the first time or again. Whether to go on.
    fn denoised(&mut self, subject: &Subject, variant: &Variant, frame: usize, radiance: &[[f32; 3]]) -> bool;
}

/// Something that makes an image of each frame.
enum Runner {
    Noisy,
    Accumulation(Box<Accumulation>),
    Oidn(Box<Oidn>),
    Backend(Box<dyn Backend>),
}

/// What one frame took, in milliseconds.
struct Timing {
    wall: f64,
    cpu: f64,
    passes: Vec<(String, f64)>,
}

impl Runner {
    fn open(choice: Choice, variant: &Variant, subject: &Subject) -> Result<Self> {
        match (&variant.settings, variant.name.as_str()) {
            (Some(settings), _) => Ok(Self::Backend(backend::open(choice, settings, subject.frames[0].size)?)),
            (None, ACCUMULATION) => Ok(Self::Accumulation(Box::default())),
            (None, name) if name == Yardstick::Oidn.name() => Ok(Self::Oidn(Box::new(Yardstick::Oidn.open()?))),
            (None, name) => {
                debug_assert_eq!(name, NOISY);
                Ok(Self::Noisy)
            }
        }
    }

    fn run(&mut self, frame: &Frame, exposure: f32) -> Result<(Vec<[f32; 3]>, Option<Timing>)> {
        Ok(match self {
            Self::Noisy => (frame.radiance.iter().map(|&[r, g, b, _]| [r, g, b]).collect(), None),
            Self::Accumulation(accumulation) => (accumulation.add(frame), None),
            Self::Oidn(oidn) => {
                let answer = oidn.denoise(frame)?;
                let (wall, cpu) = (milliseconds(answer.time), milliseconds(answer.cpu_time));
                (answer.radiance, Some(Timing { wall, cpu, passes: Vec::new() }))
            }
            Self::Backend(backend) => {
                let denoised = backend.denoise(frame, exposure, None)?;
                let passes = denoised.pass_times.into_iter().map(|(kernel, time)| (kernel, milliseconds(time)));
                let (wall, cpu) = (milliseconds(denoised.time), milliseconds(denoised.cpu_time));
                (denoised.radiance, Some(Timing { wall, cpu, passes: passes.collect() }))
            }
        })
    }
}

/// What was measured of a variant so far.
struct Gathered {
    runner: Runner,
    scorer: Scorer,
    frames: Vec<Values>,
    /// By repetition and frame.
    times: Vec<Timing>,
}

fn milliseconds(duration: std::time::Duration) -> f64 {
    duration.as_secs_f64() * 1e3
}

fn times(own: &[Timing], reference: &[Timing]) -> Option<Times> {
    let of = |value: fn(&Timing) -> f64| Spread::of(own.iter().map(value).collect());
    let ratio = |value: fn(&Timing) -> f64| {
        let ratios = own.iter().zip(reference).map(|(own, reference)| value(own) / value(reference).max(1e-6));
        Spread::of(ratios.collect()).map_or(1.0, |ratio| ratio.median)
    };
    let mut passes: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for (kernel, time) in own.iter().flat_map(|timing| &timing.passes) {
        passes.entry(kernel.clone()).or_default().push(*time);
    }
    Some(Times {
        frame: of(|timing| timing.wall)?,
        cpu: of(|timing| timing.cpu)?,
        ratio: ratio(|timing| timing.wall),
        cpu_ratio: ratio(|timing| timing.cpu),
        samples: own.len(),
        passes: passes.into_iter().filter_map(|(kernel, all)| Some((kernel, Spread::of(all)?.median))).collect(),
    })
}

/// Runs all variants of a group on every frame in turn, `repetitions` times (0 as once, without times). Ratios are
/// to the variant called `reference`, or to the first with settings. `None` when the observer stopped it.
///
/// # Errors
///
/// When a backend cannot be opened or fails.
pub fn run_group(
    choice: Choice,
    subject: &Subject,
    variants: &[&Variant],
    repetitions: u32,
    observer: &mut dyn Observer,
) -> Result<Option<Vec<Run>>> {
    let mut all = Vec::new();
    for variant in variants {
        let runner = Runner::open(choice, variant, subject).with_context(|| format!("variant {}", variant.name))?;
        all.push(Gathered { runner, scorer: Scorer::new(subject.exposure), frames: Vec::new(), times: Vec::new() });
    }
    for repetition in 0..repetitions.max(1) {
        for (index, frame) in subject.frames.iter().enumerate() {
            for (variant, gathered) in variants.iter().zip(&mut all) {
                let is_first = repetition == 0;
                if !is_first && !variant.is_timed() {
                    continue;
                }
                let (radiance, timing) = gathered.runner.run(frame, subject.exposure)?;
                let is_warm = !is_first || index >= WARM_UP.min(subject.frames.len() - 1);
                gathered.times.extend(timing.filter(|_| is_warm && repetitions > 0));
                if is_first {
                    let score = gathered.scorer.score(&radiance, frame);
                    let regions = &subject.regions[index];
                    gathered.frames.push(error::values(&score, &radiance, frame, regions, subject.exposure));
                }
                if !observer.denoised(subject, variant, index, &radiance) {
                    return Ok(None);
                }
            }
        }
    }
    let reference = variants.iter().position(|variant| variant.name == REFERENCE);
    let reference = reference.or_else(|| variants.iter().position(|variant| variant.settings.is_some()));
    let run = |(variant, gathered): (&&Variant, &Gathered)| Run {
        sequence: subject.name.clone(),
        variant: variant.name.clone(),
        mean: Values::mean(&gathered.frames),
        frames: gathered.frames.clone(),
        times: reference.and_then(|reference| times(&gathered.times, &all[reference].times)),
    };
    Ok(Some(variants.iter().zip(&all).map(run).collect()))
}
