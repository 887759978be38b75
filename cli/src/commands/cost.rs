//! `limpid cost`.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use limpid::Settings;
use limpid::kernel::Sources;

use super::settings::SettingsOptions;
use crate::cost::{Cost, Driver, GENERATIONS, Job, on_this_device, table, traffic};

/// Prints what the compilers of GPUs make of each pass, without those GPUs.
///
/// Registers, memory of workgroups (LDS), instructions and waves that fit on a SIMD at once, for generations of AMD GPUs,
/// through Mesa's driver RADV. docs/cost.md explains the numbers.
#[derive(Debug, Args)]
pub(super) struct CostCommand {
    /// GPUs, as RADV names them: polaris10, vega10, renoir, navi10, navi21, vangogh, navi31... A GPU of each generation
    /// if not given.
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    gpu: Vec<String>,
    #[command(flatten)]
    settings: SettingsOptions,
    /// Kernels to use in the place of those built in: a folder such as kernels/.
    #[arg(long, value_name = "DIR")]
    kernels: Option<PathBuf>,
    /// Manifest of RADV, such as radeon_icd.x86_64.json, if it is not where Vulkan looks for drivers.
    #[arg(long, value_name = "FILE")]
    driver: Option<PathBuf>,
    /// Ask the driver of this machine's device instead, in its own terms.
    #[arg(long, conflicts_with_all = ["gpu", "driver"])]
    this_device: bool,
    /// Print JSON, with everything that the driver tells.
    #[arg(long)]
    json: bool,
}

impl CostCommand {
    fn costs(&self, settings: &Settings) -> Result<Vec<Cost>> {
        let driver = Driver::find(self.driver.as_deref())?;
        let program = std::env::current_exe()?;
        let job = Job { program: &program, settings, kernels: self.kernels.as_deref() };
        let named = self.gpu.iter().map(String::as_str);
        let generations = GENERATIONS.iter().map(|generation| generation.name).filter(|_| self.gpu.is_empty());
        named.chain(generations).map(|gpu| job.run(&driver, gpu)).collect()
    }

    pub(super) fn run(&self) -> Result<()> {
        let settings = self.settings.load()?;
        let traffic = traffic(&settings)?;
        if self.this_device {
            let sources = self.kernels.clone().map_or(Sources::BuiltIn, Sources::Folder);
            let cost = on_this_device(&settings, &sources)?;
            let text = if self.json { serde_json::to_string_pretty(&cost)? + "\n" } else { table(&[cost]) + &traffic };
            return super::print(&text);
        }
        let costs = self.costs(&settings)?;
        super::print(&if self.json { serde_json::to_string_pretty(&costs)? + "\n" } else { table(&costs) + &traffic })
    }
}
