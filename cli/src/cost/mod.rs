//! What GPUs' compilers make of each pass, without those GPUs.
//!
//! Mesa's driver for AMD, RADV, compiles for any generation when told to by `RADV_FORCE_FAMILY`, and
//! `VK_KHR_pipeline_executable_properties` tells what came out. The driver reads that variable once, so each generation
//! has a process of its own: this program again, on the device that its environment shows.

mod radv;
mod table;

use anyhow::{Context as _, Result};
use glam::UVec2;
use limpid::kernel::Sources;
use limpid::{Plan, Settings};
use limpid_ash::offscreen::{Context, ContextOptions};
use serde::{Deserialize, Serialize};

pub use radv::{Driver, GENERATIONS, Generation, Job};
pub use table::{table, traffic};

/// What compilers make of the passes of some settings, on one GPU.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    /// Name as the driver knows it.
    pub gpu: String,
    /// Passes in order; more than once where a driver compiles for several sizes of subgroups.
    pub passes: Vec<PassCost>,
}

/// What a compiler made of one pass.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PassCost {
    /// Name of the kernel.
    pub pass: String,
    /// What the driver calls the executable.
    pub executable: String,
    /// Invocations of a subgroup.
    pub subgroup_size: u32,
    /// In the driver's own terms and order.
    pub statistics: Vec<Statistic>,
}

/// A number that a driver gives.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Statistic {
    /// Name in the driver's terms.
    pub name: String,
    /// Value.
    pub value: f64,
}

impl PassCost {
    /// A statistic by its name.
    pub fn get(&self, name: &str) -> Option<f64> {
        self.statistics.iter().find(|statistic| statistic.name == name).map(|statistic| statistic.value)
    }
}

/// Compiles all passes on this process's most capable Vulkan device.
///
/// # Errors
///
/// When there is no device, when its driver does not tell, or when kernels from `sources` have mistakes.
pub fn on_this_device(settings: &Settings, sources: &Sources) -> Result<Cost> {
    let options = ContextOptions { statistics: true, ..ContextOptions::default() };
    let context = Context::open(&options).context("cannot ask the compiler of this machine's device")?;
    // Shaders do not depend on the size.
    let (plan, kernels) = Plan::from_sources(settings, UVec2::splat(16), sources)?;
    let core = limpid::Denoiser::with_plan(settings, plan, kernels);
    let passes = context.statistics(&core)?.into_iter().map(|pass| PassCost {
        pass: pass.pass,
        executable: pass.executable,
        subgroup_size: pass.subgroup_size,
        // A hash is no quantity.
        statistics: pass
            .values
            .into_iter()
            .filter(|(name, _)| !name.to_lowercase().contains("hash"))
            .map(|(name, value)| Statistic { name, value })
            .collect(),
    });
    Ok(Cost { gpu: context.name().to_owned(), passes: passes.collect() })
}
