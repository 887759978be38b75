//! `limpid plan`.

use anyhow::Result;
use clap::Args;
use glam::UVec2;
use limpid::Plan;

use super::parse_size;
use super::settings::SettingsOptions;

/// Prints what is allocated and dispatched for some settings and size.
#[derive(Debug, Args)]
pub(super) struct PlanCommand {
    /// Image size.
    #[arg(long, default_value = "1920x1080", value_parser = parse_size, value_name = "WIDTHxHEIGHT")]
    size: UVec2,
    #[command(flatten)]
    settings: SettingsOptions,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

impl PlanCommand {
    pub(super) fn run(&self) -> Result<()> {
        let (plan, _) = Plan::new(&self.settings.load()?, self.size)?;
        let barriers = plan.barriers().iter().flatten().count();
        let dependencies = plan.dependencies().iter().flatten().count();
        super::print(&if self.json {
            serde_json::to_string_pretty(&plan)? + "\n"
        } else {
            format!(
                "{plan}{} dispatches and {barriers} barriers a frame, for {dependencies} dependencies\n",
                plan.passes.len()
            )
        })
    }
}
