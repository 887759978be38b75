//! Looks at a sequence's own data: what is in it, whether it means what limpid takes it for, and which settings suit it.
//!
//! Wrong conventions hide well: an image with motion vectors of the wrong sign is only noisier. So each convention is
//! put to the test against the others: normals against those of the surface that the depth describes, motion vectors
//! and cameras against where the same surface was in the frame before.

mod advice;
mod content;
mod geometry;
mod motion;
#[cfg(test)]
mod tests;

use std::fmt;

use glam::UVec2;
use limpid::settings::Conventions;
use serde::Serialize;

pub use content::Content;
pub use geometry::{Geometry, Meaning};
pub use motion::{CameraMeaning, Motion};

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
    /// The most important first.
    pub findings: Vec<Finding>,
    /// Settings that differ from the default, as TOML.
    pub settings: String,
}

/// Gathers an analysis frame by frame.
pub struct Analyzer {
    conventions: Conventions,
    exposure: f32,
    size: UVec2,
    content: content::Gatherer,
    geometry: geometry::Gatherer,
    motion: motion::Gatherer,
    previous: Option<Frame>,
}

impl Analyzer {
    /// An analysis of frames of that size whose data is taken to follow `conventions`.
    pub fn new(size: UVec2, conventions: &Conventions, exposure: f32) -> Self {
        Self {
            conventions: conventions.clone(),
            exposure,
            size,
            content: content::Gatherer::default(),
            geometry: geometry::Gatherer::default(),
            motion: motion::Gatherer::new(size),
            previous: None,
        }
    }

    /// Looks at the next frame.
    pub fn add(&mut self, frame: Frame) {
        self.content.add(&frame);
        self.geometry.add(&frame);
        if let Some(previous) = &self.previous {
            self.motion.add(previous, &frame, &self.conventions);
        }
        self.previous = Some(frame);
    }

    /// What was found.
    pub fn finish(self) -> Analysis {
        let (content, geometry, motion) = (self.content.finish(), self.geometry.finish(), self.motion.finish());
        let mut findings = advice::findings(&content, &geometry, &motion, &self.conventions, self.exposure);
        findings.sort_by_key(|finding| finding.severity);
        let settings = advice::settings(&motion, &self.conventions);
        Analysis { size: self.size, frames: content.frames, content, geometry, motion, findings, settings }
    }
}

fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

impl fmt::Display for Analysis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{} frames of {}x{}", self.frames, self.size.x, self.size.y)?;
        write!(f, "{}{}{}", self.content, self.geometry, self.motion)?;
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
        if !self.settings.is_empty() {
            writeln!(f, "\nSettings for this sequence (limpid denoise --settings FILE):\n")?;
            for line in self.settings.lines() {
                writeln!(f, "    {line}")?;
            }
        }
        Ok(())
    }
}
