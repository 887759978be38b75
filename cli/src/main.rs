//! The `limpid` command.

use std::process::ExitCode;

use clap::Parser;
use limpid_cli::commands::Cli;

fn main() -> ExitCode {
    // Wrong usage ends in `parse`, with exit code 2.
    match Cli::parse().run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
