//! Looks at a sequence's own data: what is in it, whether it means what limpid takes it for, and which settings suit it.
//!
//! Wrong conventions hide well: an image with motion vectors of the wrong sign is only noisier. So each convention is
//! put to the test against the others: normals against those of the surface that the depth describes, motion vectors
//! and cameras against where the same surface was in the frame before.

mod advice;
mod conform;
mod content;
mod geometry;
mod motion;
mod needs;
mod recommend;
#[cfg(test)]
mod tests;
mod verify;

use std::fmt;

use anyhow::Result;
use glam::UVec2;
use limpid::Settings;
use serde::Serialize;

pub use content::Content;
pub use geometry::{Geometry, MatrixTiming, Meaning};
pub use motion::{CameraMeaning, Motion};
pub use needs::Needs;
pub use recommend::{Change, Cost, apply, toml_of, untried};
pub use verify::{Trial, Verification};

use crate::sequence::Frame;

/// How much a finding matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Severity {
    /// The result will be wrong.
    Error,
    /// The result will be worse than it need be.
    Warning,
    /// Good to know.
    Note,
}

/// Something about the sequence that its author should know.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// How much it matters.
    pub severity: Severity,
    /// What was found.
    pub found: String,
    /// What to do about it.
    pub advice: String,
}

/// Everything that was found out about a sequence.
#[derive(Debug, Clone, Serialize)]
pub struct Analysis {
    /// Size in pixels.
    pub size: UVec2,
    /// Frames looked at.
    pub frames: usize,
    /// What the images hold.
    pub content: Content,
    /// What depth and normals mean.
    pub geometry: Geometry,
    /// What motion vectors and cameras mean.
    pub motion: Motion,
    /// What of the pipeline they use.
    pub needs: Needs,
    /// The most important first.
    pub findings: Vec<Finding>,
    /// Settings that mend the errors; where there are none, those that leave out what the sequence does not need.
    pub changes: Vec<Change>,
    /// Costs by the plan of the settings given and of those recommended.
    pub predicted: [Cost; 2],
    /// What running both found.
    pub verification: Option<Verification>,
    /// What the recommended settings have that the default preset has not, as TOML for `--settings`.
    pub settings: String,
    #[serde(skip)]
    given: Settings,
}

impl Analysis {
    /// Whether something means other than limpid takes it for.
    pub fn has_errors(&self) -> bool {
        self.findings.iter().any(|finding| finding.severity == Severity::Error)
    }

    /// Takes over what verification left of the changes.
    ///
    /// # Errors
    ///
    /// When settings are refused, which those that were run are not.
    pub fn verified(&mut self, changes: Vec<Change>, verification: Verification) -> Result<()> {
        let settings = apply(&self.given, &changes)?;
        self.predicted[1] = Cost::new(&settings)?;
        self.settings = toml_of(&settings)?;
        (self.changes, self.verification) = (changes, Some(verification));
        Ok(())
    }
}

/// Gathers an analysis frame by frame.
pub struct Analyzer {
    settings: Settings,
    exposure: f32,
    size: UVec2,
    transposed: conform::Transposed,
    content: content::Gatherer,
    geometry: geometry::Gatherer,
    motion: motion::Gatherer,
    needs: needs::Gatherer,
    previous: Option<Frame>,
}

impl Analyzer {
    /// An analysis of frames of that size, whose data is taken to follow the conventions of `settings`, for a denoiser
    /// with the rest of them.
    pub fn new(size: UVec2, settings: &Settings, exposure: f32) -> Self {
        Self {
            settings: settings.clone(),
            exposure,
            size,
            transposed: conform::Transposed::default(),
            content: content::Gatherer::default(),
            geometry: geometry::Gatherer::default(),
            motion: motion::Gatherer::new(size),
            needs: needs::Gatherer::new(settings, exposure),
            previous: None,
        }
    }

    /// Looks at the next frame.
    pub fn add(&mut self, frame: Frame) {
        let found = conform::transposed(&frame);
        self.transposed.view |= found.view;
        self.transposed.projection |= found.projection;
        let frame = conform::conform(frame, self.previous.as_ref(), &self.settings.conventions);
        self.content.add(&frame);
        self.geometry.add(&frame);
        if let Some(previous) = &self.previous {
            self.motion.add(previous, &frame);
        }
        self.needs.add(&frame, self.previous.as_ref());
        self.previous = Some(frame);
    }

    /// What was found.
    ///
    /// # Errors
    ///
    /// When the settings are refused.
    pub fn finish(self) -> Result<Analysis> {
        let (content, geometry, motion) = (self.content.finish(), self.geometry.finish(), self.motion.finish());
        let needs = self.needs.finish();
        let given = self.settings;
        let mut findings = advice::transposed(self.transposed);
        findings.extend(advice::findings(&content, &geometry, &motion, &given, self.exposure));
        findings.sort_by_key(|finding| finding.severity);
        // What a sequence needs cannot be told from data that means something else.
        let is_wrong = findings.iter().any(|finding| finding.severity == Severity::Error);
        let changes = match is_wrong {
            true => advice::mends(&content, &geometry, &motion, &given),
            false => recommend::smallest(&content, &needs, &given),
        };
        let recommended = apply(&given, &changes)?;
        let predicted = [Cost::new(&given)?, Cost::new(&recommended)?];
        let settings = toml_of(&recommended)?;
        let (size, frames, verification) = (self.size, content.frames, None);
        Ok(Analysis {
            size,
            frames,
            content,
            geometry,
            motion,
            needs,
            findings,
            changes,
            predicted,
            verification,
            settings,
            given,
        })
    }
}

fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

impl fmt::Display for Analysis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{} frames of {}x{}", self.frames, self.size.x, self.size.y)?;
        write!(f, "{}{}{}{}", self.content, self.geometry, self.motion, self.needs)?;
        if self.findings.is_empty() {
            writeln!(f, "\nNothing looks wrong.")?;
        }
        for finding in &self.findings {
            let severity = match finding.severity {
                Severity::Error => "error",
                Severity::Warning => "warning",
                Severity::Note => "note",
            };
            writeln!(f, "\n{severity}: {}\n    {}", finding.found, finding.advice)?;
        }
        self.fmt_changes(f)
    }
}

impl Analysis {
    fn fmt_changes(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let title = match (self.has_errors(), self.changes.is_empty()) {
            (true, true) => {
                return writeln!(f, "\nNo setting mends that; the smallest settings can be told afterwards.");
            }
            (true, false) => "Settings that mend it; run again with them for the smallest ones:",
            (false, true) => "All that the settings switch on is used.",
            (false, false) => "Smallest settings for this sequence:",
        };
        writeln!(f, "\n{title}\n")?;
        for change in &self.changes {
            writeln!(f, "    {change}\n        {}; right while {}", change.because, change.holds_while)?;
        }
        if !self.has_errors() && !self.changes.is_empty() {
            write!(f, "\n{}", recommend::cost_table(&self.predicted[0], &self.predicted[1]))?;
        }
        match &self.verification {
            Some(verification) => write!(f, "\n{verification}"),
            None => Ok(()),
        }
    }
}
