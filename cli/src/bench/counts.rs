//! Costs that are the same on every machine: from the plan and the kernels' SPIR-V.

use std::collections::BTreeMap;

use glam::UVec2;
use limpid::emit::SpirvOptions;
use limpid::kernel::Kernel;
use limpid::plan::Pass;
use limpid::resource::{Access, Kind};
use limpid::{Plan, Settings};
use serde::{Deserialize, Serialize};

/// Costs of a frame in which every pixel is denoised, and none in a whole block.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Counts {
    /// Dispatches.
    pub dispatches: usize,
    /// Barriers on all memory.
    pub barriers: usize,
    /// Bytes a pixel that passes read, each resource once a pass; taps around a pixel come from caches.
    pub bytes_read: f64,
    /// Bytes a pixel that passes write.
    pub bytes_written: f64,
    /// Bytes a pixel that are allocated, every resource on its own.
    pub bytes_allocated: f64,
    /// The same where resources share memory.
    pub bytes_shared: f64,
    /// SPIR-V instructions in the functions of each kernel.
    pub instructions: BTreeMap<String, u64>,
}

/// Bytes a texel of the images that this command supplies.
fn input_bytes(name: &str) -> f64 {
    match name {
        "normal" | "prev_normal" => 16.0,
        "radiance" | "motion" | "hit_motion" | "environment" => 8.0,
        _ => 4.0,
    }
}

/// Whether a pass does next to nothing in such a frame: there are no left-out tiles to fill and to clear.
fn is_idle(pass: &Pass) -> bool {
    matches!(pass.kernel.as_str(), "fill" | "list_tiles" | "accumulate_blocks" | "lobe_filter_blocks")
}

fn bytes(plan: &Plan, size: UVec2, wanted: fn(Access) -> bool) -> f64 {
    let pixels = f64::from(size.x) * f64::from(size.y);
    let of = |name: &str| match plan.resource(name) {
        Some(resource) if resource.kind == Kind::Input => input_bytes(name),
        Some(resource) => resource.bytes(size) as f64 / pixels / if resource.ping_pong { 2.0 } else { 1.0 },
        None => 0.0,
    };
    let bindings = plan.passes.iter().filter(|pass| !is_idle(pass)).flat_map(|pass| &pass.bindings);
    bindings.filter(|bound| wanted(bound.access)).map(|bound| of(&bound.resource)).sum()
}

/// Instructions inside of functions.
fn instruction_count(words: &[u32]) -> u64 {
    const HEADER: usize = 5;
    const OP_FUNCTION: u32 = 54;
    let (mut at, mut count, mut is_inside) = (HEADER, 0, false);
    while let Some(&word) = words.get(at) {
        is_inside |= word & 0xffff == OP_FUNCTION;
        count += u64::from(is_inside);
        at += (word >> 16).max(1) as usize;
    }
    count
}

impl Counts {
    /// Costs of settings at a size.
    ///
    /// # Errors
    ///
    /// As [`Plan::new`].
    pub fn new(settings: &Settings, size: UVec2) -> Result<Self, limpid::Error> {
        let (plan, kernels) = Plan::new(settings, size)?;
        let pixels = f64::from(size.x) * f64::from(size.y);
        let instructions =
            |kernel: &Kernel| Ok((kernel.name.to_owned(), instruction_count(&kernel.spirv(&SpirvOptions::default())?)));
        Ok(Self {
            dispatches: plan.passes.len(),
            barriers: plan.barriers().iter().flatten().count(),
            bytes_read: bytes(&plan, size, |access| access != Access::Write),
            bytes_written: bytes(&plan, size, Access::writes),
            bytes_allocated: plan.bytes_per_pixel(),
            bytes_shared: plan.shared_memory().total() as f64 / pixels,
            instructions: kernels.iter().map(instructions).collect::<Result<_, limpid::Error>>()?,
        })
    }

    /// All counts by name, for tables and comparisons.
    pub fn named(&self) -> Vec<(String, f64)> {
        let total: u64 = self.instructions.values().sum();
        let mut named = vec![
            ("dispatches".to_owned(), self.dispatches as f64),
            ("barriers".to_owned(), self.barriers as f64),
            ("bytes read".to_owned(), self.bytes_read),
            ("bytes written".to_owned(), self.bytes_written),
            ("bytes allocated".to_owned(), self.bytes_allocated),
            ("bytes allocated, shared".to_owned(), self.bytes_shared),
            ("SPIR-V instructions".to_owned(), total as f64),
        ];
        let of_kernel = |(name, count): (&String, &u64)| (format!("SPIR-V of {name}"), *count as f64);
        named.extend(self.instructions.iter().map(of_kernel));
        named
    }
}
