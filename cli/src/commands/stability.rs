//! `limpid stability`.

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use clap::Args;
use indicatif::ProgressBar;
use limpid::{Preset, Settings};

use super::interrupt;
use crate::backend::{self, Choice};
use crate::sequence::write_atomically;
use crate::stability::probe::ProbeReport;
use crate::stability::{Case, Report, figure, library, run};

/// Tries to break the numbers of every preset on every backend, and judges the results by criteria.
///
/// Each line is a case: how many of its verdicts passed, over presets and backends, and the worst of them with
/// pixel, value and what was expected. Fails when a criterion does not hold that is not known to.
#[derive(Debug, Args)]
pub(super) struct Stability {
    /// Only cases whose group or name contains this. Can be given more than once.
    #[arg(long, value_name = "TEXT")]
    case: Vec<String>,
    /// Backend; all there are if not given. Can be given more than once.
    #[arg(long, value_enum)]
    backend: Vec<Choice>,
    /// Frames of long runs.
    #[arg(long, default_value_t = library::LONG, value_parser = parse_frames)]
    long: usize,
    /// Look inside of the kernels instead, on the CPU with the default preset: where NaN, infinity, denormal numbers
    /// and cancellation arise, and the rounding error of what is written, by kernel and line. Long runs are left out.
    #[arg(long, conflicts_with = "backend")]
    probe: bool,
    /// Write a picture of how near every verdict came to its limit.
    #[arg(long, value_name = "FILE.svg", conflicts_with = "probe")]
    figure: Option<PathBuf>,
    /// Write a Markdown table of what passed, by group.
    #[arg(long, value_name = "FILE.md", conflicts_with = "probe")]
    table: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

fn parse_frames(text: &str) -> Result<usize, String> {
    let frames = text.parse().ok().filter(|frames| (160..=1_000_000).contains(frames));
    frames.ok_or_else(|| format!("expected 160 to 1000000, found `{text}`"))
}

/// Backends that can be opened; says which cannot.
fn available() -> Vec<Choice> {
    let opens = |choice: &Choice| match backend::open(*choice, &Settings::default(), glam::UVec2::ONE) {
        Ok(backend) => {
            eprintln!("{}: {}", choice.name(), backend.device());
            true
        }
        Err(error) => {
            eprintln!("SKIPPED: {}: {error:#}", choice.name());
            false
        }
    };
    [Choice::Cpu, Choice::Ash, Choice::Wgpu].into_iter().filter(opens).collect()
}

impl Stability {
    fn is_wanted(&self, case: &Case) -> bool {
        let is_in = |text: &String| case.group.contains(text.as_str()) || case.name.contains(text.as_str());
        self.case.is_empty() || self.case.iter().any(is_in)
    }

    fn probe(&self, cases: &[Case]) -> Result<()> {
        let progress = ProgressBar::new(cases.len() as u64);
        let mut report = ProbeReport::default();
        for case in cases.iter().filter(|case| case.frames < self.long).take_while(|_| !interrupt::requested()) {
            report.add(case)?;
            progress.inc(1);
        }
        progress.finish_and_clear();
        super::print(&if self.json { serde_json::to_string_pretty(&report)? + "\n" } else { report.to_string() })
    }

    pub(super) fn run(&self) -> Result<()> {
        let cases: Vec<Case> = library::all(self.long).into_iter().filter(|case| self.is_wanted(case)).collect();
        if cases.is_empty() {
            bail!("no case is called like {}", self.case.join(" or "));
        }
        interrupt::listen()?;
        if self.probe {
            return self.probe(&cases);
        }
        let mut backends = self.backend.clone();
        if backends.is_empty() {
            backends = available();
        }
        backends.iter_mut().for_each(|choice| *choice = backend::settle(*choice));
        let progress = ProgressBar::new((cases.len() * backends.len() * Preset::ALL.len()) as u64);
        let mut report = Report::default();
        for case in &cases {
            for &choice in &backends {
                for &preset in Preset::ALL {
                    if interrupt::requested() {
                        break;
                    }
                    report.verdicts.extend(run::run_case(case, preset, choice)?);
                    progress.inc(1);
                }
            }
        }
        progress.finish_and_clear();
        super::print(&if self.json { serde_json::to_string_pretty(&report)? + "\n" } else { report.to_string() })?;
        let figure = self.figure.as_ref().map(|path| (path, figure::svg(&report)));
        let table = self.table.as_ref().map(|path| (path, report.markdown()));
        for (path, text) in [figure, table].into_iter().flatten() {
            write_atomically(path, |file| std::io::Write::write_all(file, text.as_bytes()))
                .with_context(|| format!("cannot write {}", path.display()))?;
        }
        match report.failures().count() {
            0 if interrupt::requested() => bail!("interrupted; these are the cases that were finished"),
            0 => Ok(()),
            failures => bail!("{failures} of {} verdicts failed", report.verdicts.len()),
        }
    }
}
