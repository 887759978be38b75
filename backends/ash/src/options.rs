use std::sync::Arc;

use ash::vk;
use limpid::kernel::Kernel;

use crate::gpu::Synchronization;

/// Makes the SPIR-V of a kernel; see [`Options::spirv`].
pub type SpirvSource = Arc<dyn Fn(&Kernel) -> Result<Vec<u32>, limpid::Error> + Send + Sync>;

/// What a denoiser is made with, beside its settings.
#[derive(Clone)]
pub struct Options {
    /// Frames that may be recorded while the device has not finished earlier ones. At least 1.
    pub frames_in_flight: usize,
    /// Pipeline stages in which the caller reads the output and the ray list. Every frame's commands make them
    /// visible there, and wait for those stages before they are overwritten. `ALL_COMMANDS`, the default, is
    /// always right; the stages that do read (for example `FRAGMENT_SHADER`) leave more room for overlap.
    pub reader_stages: vk::PipelineStageFlags,
    /// Families of all queues on which the output and the ray list are used, when there are several: they are
    /// then shared by these families without transfers of ownership. Otherwise empty.
    pub queue_families: Vec<u32>,
    /// How barriers are recorded.
    pub synchronization: Synchronization,
    /// Measures each pass; see [`Denoiser::read_times`](crate::Denoiser::read_times).
    pub timestamps: bool,
    /// Lets intermediate images and buffers be copied from after the frame, to inspect them: each has memory of its
    /// own then.
    pub readable_intermediates: bool,
    /// Where pipelines are looked for and stored, or null.
    pub pipeline_cache: vk::PipelineCache,
    /// Makes the SPIR-V of each kernel in the place of limpid: of what another compiler made of exported HLSL or GLSL,
    /// or an optimiser of limpid's own. Version 1.3 or below, the entry point named as the kernel; set and binding are
    /// group and number of [`Kernel::bindings`].
    pub spirv: Option<SpirvSource>,
    /// Gives objects and passes names for debuggers. The instance extension `VK_EXT_debug_utils` is enabled.
    pub debug_utils: Option<ash::ext::debug_utils::Device>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            frames_in_flight: 3,
            reader_stages: vk::PipelineStageFlags::ALL_COMMANDS,
            queue_families: Vec::new(),
            synchronization: Synchronization::default(),
            timestamps: false,
            readable_intermediates: false,
            pipeline_cache: vk::PipelineCache::null(),
            spirv: None,
            debug_utils: None,
        }
    }
}
