//! `limpid analyze`.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::Args;
use indicatif::ProgressBar;
use limpid::Settings;

use super::denoise::check_outputs;
use super::interrupt;
use super::settings::SettingsOptions;
use crate::analyze::{Analysis, Analyzer, Trial, untried};
use crate::backend::{self, Choice};
use crate::bench::measure::Observer;
use crate::bench::{Subject, Variant};
use crate::sequence::{ChannelNames, Frame, Sequence, write_atomically};

/// Looks at a sequence's own data: what is in it, whether depth, normals, motion vectors and cameras mean what limpid
/// takes them for, and the smallest settings that suit it.
///
/// Exits with 1 when it finds an error in the data.
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
    /// Denoise the sequence with the settings given and with the recommended ones, in turn, and withdraw what loses
    /// more than a bound.
    #[arg(long)]
    verify: bool,
    /// The same, and try besides what the data alone cannot tell: every other feature, and fewer near taps.
    #[arg(long)]
    search: bool,
    /// How often each frame is timed for --verify; 0 for errors alone.
    #[arg(long, default_value_t = 3)]
    repetitions: u32,
    /// What to run --verify on.
    #[arg(long, value_enum, default_value_t)]
    backend: Choice,
    /// Write the recommended settings as TOML, for --settings of every command.
    #[arg(long, value_name = "FILE")]
    write_settings: Option<PathBuf>,
    /// Replace a file that exists.
    #[arg(long)]
    force: bool,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Shows that something goes on, until interrupted.
struct Spinner(ProgressBar);

impl Observer for Spinner {
    fn denoised(&mut self, _: &Subject, _: &Variant, _: usize, _: &[[f32; 3]]) -> bool {
        self.0.inc(1);
        !interrupt::requested()
    }
}

impl Analyze {
    fn verify(&self, sequence: &Sequence, frames: Vec<Frame>, given: &Settings, analysis: &mut Analysis) -> Result<()> {
        if analysis.has_errors() {
            eprintln!("note: nothing was verified, because the data has to be mended first");
            return Ok(());
        }
        interrupt::listen()?;
        let trial = Trial::new(&sequence.name(), sequence.exposure(), frames, given, backend::settle(self.backend))?;
        let mut changes = analysis.changes.clone();
        if self.search {
            changes.extend(untried(given, &changes));
        }
        let mut spinner = Spinner(ProgressBar::new_spinner().with_message("verifying"));
        let verification = trial.verify(&mut changes, self.repetitions, &mut spinner)?;
        spinner.0.finish_and_clear();
        match verification {
            Some(verification) => analysis.verified(changes, verification),
            None => bail!("interrupted"),
        }
    }

    fn write(&self, path: &Path, analysis: &Analysis, sequence: &Sequence) -> Result<()> {
        let text = format!("# By limpid analyze, for {}.\n{}", sequence.name(), analysis.settings);
        write_atomically(path, |file| std::io::Write::write_all(file, text.as_bytes()))
            .with_context(|| format!("cannot write {}", path.display()))
    }

    pub(super) fn run(&self) -> Result<()> {
        let settings = self.settings.load()?;
        check_outputs(self.write_settings.iter().map(PathBuf::as_path), self.force)?;
        let sequence = Sequence::open(&self.sequence, &ChannelNames::parse(&self.channel)?)?;
        let count = self.frames.unwrap_or(usize::MAX).min(sequence.len());
        let mut analyzer = Analyzer::new(sequence.size(), &settings, sequence.exposure());
        let mut kept = Vec::new();
        let progress = ProgressBar::new(count as u64);
        for index in 0..count {
            let frame = sequence.load(index)?;
            kept.extend((self.verify || self.search).then(|| frame.clone()));
            analyzer.add(frame);
            progress.inc(1);
        }
        progress.finish_and_clear();
        let mut analysis = analyzer.finish()?;
        if self.verify || self.search {
            self.verify(&sequence, kept, &settings, &mut analysis)?;
        }
        if let Some(path) = &self.write_settings {
            self.write(path, &analysis, &sequence)?;
        }
        let text = if self.json { serde_json::to_string_pretty(&analysis)? + "\n" } else { analysis.to_string() };
        super::print(&text)?;
        if analysis.has_errors() {
            bail!("the data of {} does not mean what limpid takes it for", sequence.name());
        }
        Ok(())
    }
}
