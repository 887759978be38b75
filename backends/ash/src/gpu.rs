//! The device as everything here shares it.

use std::sync::{Mutex, PoisonError};

use ash::vk;

use crate::Error;
use crate::memory::{MemoryBlock, MemoryRequest, MemorySource};

/// The caller's device.
#[derive(Clone, Copy)]
pub struct Gpu<'a> {
    /// The instance that `physical_device` belongs to.
    pub instance: &'a ash::Instance,
    /// The physical device that `device` was made from.
    pub physical_device: vk::PhysicalDevice,
    /// The device, of Vulkan 1.1 or later, with the feature `shaderStorageImageExtendedFormats` enabled, which every
    /// desktop GPU has: limpid stores `R32G32_UINT`. No extension is needed.
    pub device: &'a ash::Device,
    /// Family of the queue that frames are submitted to: with compute, graphics or not.
    pub queue_family: u32,
}

/// How barriers are recorded.
#[derive(Clone, Default)]
pub enum Synchronization {
    /// With `vkCmdPipelineBarrier`.
    #[default]
    Core1_0,
    /// With `vkCmdPipelineBarrier2` of Vulkan 1.3; the feature `synchronization2` is enabled.
    Core1_3,
    /// With `vkCmdPipelineBarrier2KHR`; the feature `synchronization2` is enabled.
    Extension(ash::khr::synchronization2::Device),
}

/// A device and what is needed to use it.
pub(crate) struct Shared {
    pub(crate) device: ash::Device,
    pub(crate) limits: vk::PhysicalDeviceLimits,
    pub(crate) timestamp_valid_bits: u32,
    pub(crate) synchronization: Synchronization,
    pub(crate) debug_utils: Option<ash::ext::debug_utils::Device>,
    /// Asks what the driver's compiler made of pipelines, which then keep it.
    pub(crate) statistics: Option<ash::khr::pipeline_executable_properties::Device>,
    memory: Mutex<Box<dyn MemorySource>>,
}

impl Shared {
    pub(crate) fn new(
        gpu: Gpu<'_>,
        memory: Box<dyn MemorySource>,
        synchronization: Synchronization,
        debug_utils: Option<ash::ext::debug_utils::Device>,
    ) -> Result<Self, Error> {
        // SAFETY: the caller of `Denoiser::new` vouches for the handles of `gpu`.
        let (properties, features, families) = unsafe {
            let (instance, device) = (gpu.instance, gpu.physical_device);
            let families = instance.get_physical_device_queue_family_properties(device);
            let features = instance.get_physical_device_features(device);
            (instance.get_physical_device_properties(device), features, families)
        };
        let unsupported = |what: String| Err(Error::Unsupported { what });
        let version = properties.api_version;
        if version < vk::API_VERSION_1_1 {
            let (major, minor) = (vk::api_version_major(version), vk::api_version_minor(version));
            return unsupported(format!("Vulkan 1.1, it has {major}.{minor}"));
        }
        if features.shader_storage_image_extended_formats == vk::FALSE {
            return unsupported("the feature shaderStorageImageExtendedFormats".to_owned());
        }
        let Some(family) = families.get(gpu.queue_family as usize) else {
            return unsupported(format!("queue family {}, it has {}", gpu.queue_family, families.len()));
        };
        if !family.queue_flags.contains(vk::QueueFlags::COMPUTE) {
            return unsupported(format!(
                "a queue with compute, family {} has {:?}",
                gpu.queue_family, family.queue_flags
            ));
        }
        Ok(Self {
            device: gpu.device.clone(),
            limits: properties.limits,
            timestamp_valid_bits: family.timestamp_valid_bits,
            synchronization,
            debug_utils,
            statistics: None,
            memory: Mutex::new(memory),
        })
    }

    pub(crate) fn allocate(&self, request: &MemoryRequest<'_>) -> Result<MemoryBlock, Error> {
        let mut memory = self.memory.lock().unwrap_or_else(PoisonError::into_inner);
        memory.allocate(request).map_err(|source| Error::OutOfMemory {
            during: format!("allocating {} bytes for {}", request.requirements.size, request.name),
            source,
        })
    }

    pub(crate) fn free(&self, block: MemoryBlock) {
        self.memory.lock().unwrap_or_else(PoisonError::into_inner).free(block);
    }

    /// Gives an object a name in debuggers.
    pub(crate) fn name(&self, handle: impl vk::Handle, name: &str) {
        let (Some(debug_utils), Ok(name)) = (&self.debug_utils, std::ffi::CString::new(name)) else { return };
        let info = vk::DebugUtilsObjectNameInfoEXT::default().object_handle(handle).object_name(&name);
        // SAFETY: the handle is of this device and alive. Names are a help; without memory for one there is none.
        let _ = unsafe { debug_utils.set_debug_utils_object_name(&info) };
    }

    /// Runs `record` within a label for debuggers.
    pub(crate) fn labelled(&self, commands: vk::CommandBuffer, label: &str, record: impl FnOnce()) {
        let label = self.debug_utils.as_ref().zip(std::ffi::CString::new(label).ok());
        if let Some((debug_utils, label)) = &label {
            let info = vk::DebugUtilsLabelEXT::default().label_name(label);
            // SAFETY: `commands` is being recorded.
            unsafe { debug_utils.cmd_begin_debug_utils_label(commands, &info) };
        }
        record();
        if let Some((debug_utils, _)) = &label {
            // SAFETY: closes the label from above.
            unsafe { debug_utils.cmd_end_debug_utils_label(commands) };
        }
    }
}
