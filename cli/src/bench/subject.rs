//! Sequences to measure on: built-in scenes, folders, and one in which things happen suddenly.

use std::path::Path;

use anyhow::{Context, Result, bail};
use glam::{UVec2, vec3};
use serde::{Deserialize, Serialize};

use super::error::Regions;
use super::record::SequenceInfo;
use crate::scene::{self, Scene, Shot};
use crate::sequence::{ChannelNames, Frame, Sequence};

/// Something that a denoiser has to recover from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// The first frame after it.
    pub frame: usize,
    /// What happens.
    pub what: String,
}

/// Frames with references, ready to be denoised again and again.
#[derive(Clone, Debug)]
pub struct Subject {
    /// Unique name.
    pub name: String,
    /// Factor on radiance for filters and scores.
    pub exposure: f32,
    /// At least one.
    pub frames: Vec<Frame>,
    /// Kinds of pixels of each frame.
    pub regions: Vec<Regions>,
    /// What happens.
    pub events: Vec<Event>,
    /// PSNR of the reference, where it is known.
    pub limit: Option<f64>,
}

/// Name of the built-in sequence of sudden changes.
pub const EVENTS: &str = "events";

/// Frames between two events.
const CALM: u32 = 16;

/// Names of all built-in sequences.
pub fn names() -> impl Iterator<Item = &'static str> {
    scene::NAMES.into_iter().chain([EVENTS])
}

/// How built-in sequences are rendered.
#[derive(Clone, Copy)]
pub struct Rendering<'p> {
    /// Image size.
    pub size: UVec2,
    /// How many frames, but for [`EVENTS`], which has its own number.
    pub frames: u32,
    /// Rays a pixel of the reference.
    pub samples: u32,
    /// Called after each frame; whether to go on.
    pub progress: &'p dyn Fn() -> bool,
}

/// Frames that rendering a built-in sequence takes.
pub fn frame_count(name: &str, frames: u32) -> u32 {
    if name == EVENTS { 5 * CALM } else { frames }
}

/// Scene of the events at a frame: the still life, a jump of the camera, lamps that go down and up again.
fn eventful(number: u32) -> Scene {
    let mut scene = scene::by_name("still").expect("a built-in scene");
    let first = scene.shots[0];
    // A step to the side and nearer; what both shots show has moved far.
    let second = Shot { first: CALM, eye: vec3(1.9, 1.4, 3.4), target: vec3(-0.2, 0.5, 0.0), ..first };
    let third = Shot { first: 2 * CALM, ..first };
    scene.shots.extend([second, third]);
    if (3 * CALM..4 * CALM).contains(&number) {
        scene.ambient *= 0.1;
        scene.sky.zenith *= 0.1;
        scene.sky.horizon *= 0.1;
        scene.objects.iter_mut().for_each(|object| object.material.emission *= 0.1);
    }
    scene
}

fn event_list() -> Vec<Event> {
    let event = |index: u32, what: &str| Event { frame: (index * CALM) as usize, what: what.to_owned() };
    vec![
        event(1, "camera cut"),
        event(2, "camera cut, unannounced"),
        event(3, "light to a tenth"),
        event(4, "light tenfold"),
    ]
}

impl Subject {
    pub(crate) fn new(name: &str, exposure: f32, frames: Vec<Frame>, events: Vec<Event>, limit: Option<f64>) -> Self {
        let regions = (0..frames.len())
            .map(|index| {
                let previous = index.checked_sub(1).map(|index| &frames[index]);
                Regions::new(&frames[index], previous, exposure)
            })
            .collect();
        Self { name: name.to_owned(), exposure, frames, regions, events, limit }
    }

    /// A built-in sequence; `None` when rendering was stopped.
    ///
    /// # Errors
    ///
    /// When there is none of that name.
    pub fn built_in(name: &str, how: &Rendering<'_>) -> Result<Option<Self>> {
        if name == EVENTS {
            return Ok(render_events(how));
        }
        let Some(scene) = scene::by_name(name) else {
            bail!("there is no scene `{name}`; there are {}", names().collect::<Vec<_>>().join(", "));
        };
        let mut frames = Vec::new();
        for number in 0..how.frames {
            frames.push(scene.render(number, how.size, how.samples));
            if !(how.progress)() {
                return Ok(None);
            }
        }
        let limit = reference_limit(&scene, &frames[0], how.samples);
        Ok(Some(Self::new(name, 1.0, frames, Vec::new(), limit)))
    }

    /// Up to `most` frames of a folder.
    ///
    /// # Errors
    ///
    /// When it cannot be read or has no references.
    pub fn folder(path: &Path, channels: &ChannelNames, most: u32) -> Result<Self> {
        let sequence = Sequence::open(path, channels)?;
        let frames = (0..sequence.len().min(most as usize))
            .map(|index| {
                let frame = sequence.load(index)?;
                let file = sequence.path(index)?;
                let lacking = || format!("{} has no reference, which the bench compares with", file.display());
                frame.reference.as_ref().with_context(lacking)?;
                Ok(frame)
            })
            .collect::<Result<_>>()?;
        Ok(Self::new(&sequence.name(), sequence.exposure(), frames, Vec::new(), None))
    }

    /// What a report says about it.
    pub fn info(&self) -> SequenceInfo {
        let mut shares = std::collections::BTreeMap::new();
        for regions in &self.regions {
            for (name, share) in regions.shares() {
                *shares.entry(name).or_default() += share / self.regions.len() as f64;
            }
        }
        let (name, events, limit) = (self.name.clone(), self.events.clone(), self.limit);
        SequenceInfo { name, size: self.frames[0].size, frames: self.frames.len(), events, limit, shares }
    }
}

fn render_events(how: &Rendering<'_>) -> Option<Subject> {
    let mut frames: Vec<Frame> = Vec::new();
    for number in 0..frame_count(EVENTS, 0) {
        let mut frame = eventful(number).render(number, how.size, 0);
        // Nothing moves between events, and a reference is the same in every frame then.
        let is_first = number.is_multiple_of(CALM);
        frame.reference = match frames.last() {
            Some(last) if !is_first => last.reference.clone(),
            _ => Some(eventful(number).reference(number, &frame, how.samples)),
        };
        frame.reset &= number != 2 * CALM;
        frames.push(frame);
        if !(how.progress)() {
            return None;
        }
    }
    Some(Subject::new(EVENTS, 1.0, frames, event_list(), None))
}

/// PSNR of a reference, by one of twice the samples that contains it: what the two differ by is half of the error
/// variance of the first.
fn reference_limit(scene: &Scene, frame: &Frame, samples: u32) -> Option<f64> {
    let reference = frame.reference.as_ref()?;
    let mut better = frame.clone();
    better.reference = Some(scene.reference(frame.number, frame, 2 * samples));
    let score = crate::metrics::Scorer::new(1.0).score(reference, &better);
    Some(score.metrics.psnr - 10.0 * 2f64.log10()).filter(|limit| limit.is_finite())
}
