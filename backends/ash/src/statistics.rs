use ash::{khr, vk};

use crate::Error;
use crate::pipelines::Pipeline;

/// What the driver's compiler says of one pass; see [`Context::statistics`](crate::offscreen::Context::statistics).
#[derive(Debug, Clone, PartialEq)]
pub struct PassStatistics {
    /// Name of the pass.
    pub pass: String,
    /// Name that the driver gives to what it compiled: some compile a kernel more than once, for several sizes of
    /// subgroups.
    pub executable: String,
    /// Invocations of a subgroup.
    pub subgroup_size: u32,
    /// Names and values in the driver's own terms and order.
    pub values: Vec<(String, f64)>,
}

fn text(name: Result<&std::ffi::CStr, std::ffi::FromBytesUntilNulError>) -> String {
    name.unwrap_or_default().to_string_lossy().into_owned()
}

fn value(statistic: &vk::PipelineExecutableStatisticKHR<'_>) -> f64 {
    use vk::PipelineExecutableStatisticFormatKHR as Format;
    let value = &statistic.value;
    // SAFETY: `format` says which member of the union the driver wrote.
    unsafe {
        match statistic.format {
            Format::BOOL32 => f64::from(value.b32),
            Format::INT64 => value.i64 as f64,
            Format::UINT64 => value.u64 as f64,
            _ => value.f64,
        }
    }
}

impl Pipeline {
    /// What the driver says of the pipeline.
    pub(crate) fn statistics(
        &self,
        extension: &khr::pipeline_executable_properties::Device,
    ) -> Result<Vec<PassStatistics>, Error> {
        let failed = || Error::vulkan(format!("reading statistics of {}", self.label));
        let info = vk::PipelineInfoKHR::default().pipeline(self.pipeline);
        // SAFETY: the pipeline is alive and was made with the flag that keeps statistics.
        let executables = unsafe { extension.get_pipeline_executable_properties(&info) }.map_err(failed())?;
        let statistics = |(index, executable): (usize, &vk::PipelineExecutablePropertiesKHR<'_>)| {
            let info = vk::PipelineExecutableInfoKHR::default().pipeline(self.pipeline).executable_index(index as u32);
            // SAFETY: as above; the executable exists.
            let statistics = unsafe { extension.get_pipeline_executable_statistics(&info) }.map_err(failed())?;
            Ok(PassStatistics {
                pass: self.pass.to_owned(),
                executable: text(executable.name_as_c_str()),
                subgroup_size: executable.subgroup_size,
                values: statistics.iter().map(|s| (text(s.name_as_c_str()), value(s))).collect(),
            })
        };
        executables.iter().enumerate().map(statistics).collect()
    }
}
