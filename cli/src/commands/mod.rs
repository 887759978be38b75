//! The subcommands.

mod analyze;
mod bench;
mod cost;
mod debug_view;
mod demo;
mod denoise;
mod export;
mod interrupt;
mod plan;
mod report;
mod settings;
mod stability;

use std::io::Write;

use anyhow::Result;
use clap::{Parser, Subcommand};
use glam::UVec2;

/// Turns noisy ray-traced reflections into clean, stable images.
#[derive(Debug, Parser)]
#[command(name = "limpid", version, about, arg_required_else_help = true)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Renders a built-in scene with one noisy ray a pixel, denoises it, and measures the result.
    Demo(demo::Demo),
    /// Denoises a sequence of EXR frames.
    Denoise(denoise::Denoise),
    /// Looks at a sequence's data and says what is wrong with it.
    Analyze(analyze::Analyze),
    /// Writes shaders, tables and documents for engines that do not link Rust.
    Export(Box<export::Export>),
    /// Prints what the compilers of GPUs make of each pass, without those GPUs.
    Cost(cost::CostCommand),
    /// Measures error against run time, over presets, settings and features, and writes a report.
    Bench(Box<bench::Bench>),
    /// Tries to break the numbers of every preset on every backend, and judges the results by criteria.
    Stability(stability::Stability),
    /// Prints what is allocated and dispatched for some settings and size.
    Plan(plan::PlanCommand),
}

impl Cli {
    /// Runs the command that was asked for.
    ///
    /// # Errors
    ///
    /// With a message for the user, who can then fix what it names.
    pub fn run(self) -> Result<()> {
        match self.command {
            Command::Demo(demo) => demo.run(),
            Command::Denoise(denoise) => denoise.run(),
            Command::Analyze(analyze) => analyze.run(),
            Command::Export(export) => export.run(),
            Command::Cost(cost) => cost.run(),
            Command::Bench(bench) => bench.run(),
            Command::Stability(stability) => stability.run(),
            Command::Plan(plan) => plan.run(),
        }
    }
}

/// Writes to standard output. A reader that has seen enough is no error.
fn print(text: &str) -> Result<()> {
    match std::io::stdout().write_all(text.as_bytes()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => Err(error.into()),
        _ => Ok(()),
    }
}

/// Parses `WIDTHxHEIGHT`.
fn parse_size(text: &str) -> Result<UVec2, String> {
    let parsed = text.split_once('x').and_then(|(x, y)| Some(UVec2::new(x.parse().ok()?, y.parse().ok()?)));
    let size = parsed.ok_or_else(|| format!("expected WIDTHxHEIGHT such as 320x180, found `{text}`"))?;
    if size.min_element() == 0 || size.max_element() > limpid::MAX_SIZE {
        return Err(format!("expected 1 to {} pixels in each direction, found {text}", limpid::MAX_SIZE));
    }
    Ok(size)
}
