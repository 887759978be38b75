//! `limpid analyze`.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use indicatif::ProgressBar;

use super::settings::SettingsOptions;
use crate::analyze::{Analyzer, Severity};
use crate::sequence::{ChannelNames, Sequence};

/// Looks at a sequence's own data: what is in it, and whether depth, normals, motion vectors and cameras mean what
/// limpid takes them for.
///
/// Exits with 1 when it finds an error.
#[derive(Debug, Args)]
pub(super) struct Analyze {
    /// Folder with camera.json and the frames.
    sequence: PathBuf,
    #[command(flatten)]
    settings: SettingsOptions,
    /// Channel of the EXR files for an input, as for denoise.
    #[arg(long, value_name = "INPUT=NAME")]
    channel: Vec<String>,
    /// Frames to look at, from the first.
    #[arg(long, value_name = "COUNT")]
    frames: Option<usize>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

impl Analyze {
    pub(super) fn run(&self) -> Result<()> {
        let settings = self.settings.load()?;
        let sequence = Sequence::open(&self.sequence, &ChannelNames::parse(&self.channel)?)?;
        let count = self.frames.unwrap_or(usize::MAX).min(sequence.len());
        let mut analyzer = Analyzer::new(sequence.size(), &settings.conventions, sequence.exposure());
        let progress = ProgressBar::new(count as u64);
        for index in 0..count {
            analyzer.add(sequence.load(index)?);
            progress.inc(1);
        }
        progress.finish_and_clear();
        let analysis = analyzer.finish();
        let text = if self.json { serde_json::to_string_pretty(&analysis)? + "\n" } else { analysis.to_string() };
        super::print(&text)?;
        if analysis.findings.iter().any(|finding| finding.severity == Severity::Error) {
            anyhow::bail!("the data of {} does not mean what limpid takes it for", sequence.name());
        }
        Ok(())
    }
}
