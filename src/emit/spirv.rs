use naga::back::spv::{self, WriterFlags, ZeroInitializeWorkgroupMemoryMode};
use naga::proc::{BoundsCheckPolicies, BoundsCheckPolicy};
use serde::{Deserialize, Serialize};

use super::Checks;
use crate::Error;
use crate::kernel::{Kernel, validator};

/// Version of SPIR-V. Vulkan 1.0 accepts 1.0, Vulkan 1.1 up to 1.3.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "export", derive(schemars::JsonSchema))]
pub enum SpirvVersion {
    /// 1.0
    #[serde(rename = "1.0")]
    V1_0,
    /// 1.1
    #[serde(rename = "1.1")]
    V1_1,
    /// 1.2
    #[serde(rename = "1.2")]
    V1_2,
    /// 1.3
    #[serde(rename = "1.3")]
    #[default]
    V1_3,
}

/// How to write SPIR-V.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "export", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct SpirvOptions {
    /// Version.
    pub version: SpirvVersion,
    /// Whether to keep the names of variables and functions, for debuggers.
    pub debug_names: bool,
    /// What is checked while the kernel runs.
    pub checks: Checks,
    /// Descriptor set of group 0; that of group 1 follows.
    pub first_set: u32,
    /// Number of the first binding of each set.
    pub first_binding: u32,
}

impl Kernel {
    /// The kernel as SPIR-V for Vulkan. The entry point has the kernel's name; group and number of each binding
    /// are its descriptor set and binding, counted from the options' first ones.
    ///
    /// # Errors
    ///
    /// [`Error::Kernel`]; a defect of limpid.
    pub fn spirv(&self, options: &SpirvOptions) -> Result<Vec<u32>, Error> {
        let is_robust = options.checks == Checks::Robust;
        let policy = if is_robust { BoundsCheckPolicy::Restrict } else { BoundsCheckPolicy::Unchecked };
        let mut flags = WriterFlags::empty();
        flags.set(WriterFlags::DEBUG, options.debug_names);
        let naga_options = spv::Options {
            lang_version: (1, options.version as u8),
            flags,
            bounds_check_policies: BoundsCheckPolicies {
                index: policy,
                buffer: policy,
                image_load: policy,
                binding_array: policy,
            },
            // Kernels write workgroup memory before they read it.
            zero_initialize_workgroup_memory: ZeroInitializeWorkgroupMemoryMode::None,
            force_loop_bounding: is_robust,
            emit_int_div_checks: is_robust,
            ..spv::Options::default()
        };
        let fail = |report| Error::Kernel { kernel: self.name, stage: "write SPIR-V", report };
        let mut module = self.module_for_spirv();
        let info = validator().validate(&module).map_err(|error| fail(error.to_string()))?;
        for (_, variable) in module.global_variables.iter_mut() {
            if let Some(at) = &mut variable.binding {
                at.group += options.first_set;
                at.binding += options.first_binding;
            }
        }
        let pipeline =
            spv::PipelineOptions { shader_stage: naga::ShaderStage::Compute, entry_point: self.name.to_owned() };
        spv::write_vec(&module, &info, &naga_options, Some(&pipeline)).map_err(|error| fail(error.to_string()))
    }
}
