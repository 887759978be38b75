use std::ffi::{CStr, c_void};
use std::sync::{Arc, Mutex, PoisonError};

use ash::vk;

use super::context::{OffscreenError, failed};

const VALIDATION_LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

unsafe extern "system" fn collect(
    _severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _kind: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    messages: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: the layer passes valid data, and the list that the messenger was made with, which outlives it.
    let (message, messages) = unsafe {
        let message = (*data).message_as_c_str().unwrap_or_default().to_string_lossy().into_owned();
        (message, &*messages.cast::<Mutex<Vec<String>>>())
    };
    // The layer introduces itself, and says what it switched on to do its work.
    let is_about_itself = message.contains("GPU-Assisted Validation") && message.contains("Forcing")
        || message.contains("UNASSIGNED-BestPractices");
    if !is_about_itself {
        messages.lock().unwrap_or_else(PoisonError::into_inner).push(message);
    }
    vk::FALSE
}

/// An instance of the Vulkan loader.
pub(super) struct Instance {
    pub(super) instance: ash::Instance,
    debug: Option<(ash::ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    messages: Arc<Mutex<Vec<String>>>,
    _entry: ash::Entry,
}

impl Drop for Instance {
    fn drop(&mut self) {
        // SAFETY: what was made with the instance is gone.
        unsafe {
            if let Some((debug, messenger)) = &self.debug {
                debug.destroy_debug_utils_messenger(*messenger, None);
            }
            self.instance.destroy_instance(None);
        }
    }
}

pub(super) fn device_name(properties: &vk::PhysicalDeviceProperties) -> String {
    properties.device_name_as_c_str().unwrap_or_default().to_string_lossy().into_owned()
}

/// Lower is better.
fn rank(properties: &vk::PhysicalDeviceProperties) -> u32 {
    match properties.device_type {
        vk::PhysicalDeviceType::DISCRETE_GPU => 0,
        vk::PhysicalDeviceType::INTEGRATED_GPU => 1,
        vk::PhysicalDeviceType::VIRTUAL_GPU => 2,
        vk::PhysicalDeviceType::CPU => 3,
        _ => 4,
    }
}

impl Instance {
    pub(super) fn new(validation: bool) -> Result<Self, OffscreenError> {
        // SAFETY: loads the system's Vulkan loader, as any Vulkan program does.
        let entry = unsafe { ash::Entry::load() }?;
        let messages = Arc::new(Mutex::new(Vec::new()));
        let severity = vk::DebugUtilsMessageSeverityFlagsEXT::ERROR | vk::DebugUtilsMessageSeverityFlagsEXT::WARNING;
        let kind = vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION | vk::DebugUtilsMessageTypeFlagsEXT::PERFORMANCE;
        let mut messenger = vk::DebugUtilsMessengerCreateInfoEXT::default()
            .message_severity(severity)
            .message_type(kind)
            .pfn_user_callback(Some(collect))
            .user_data(Arc::as_ptr(&messages).cast_mut().cast());
        let application = vk::ApplicationInfo::default().application_name(c"limpid").api_version(vk::API_VERSION_1_3);
        let layers = [VALIDATION_LAYER.as_ptr()];
        let extensions = [ash::ext::debug_utils::NAME.as_ptr(), ash::ext::validation_features::NAME.as_ptr()];
        let enabled = [
            vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION,
            vk::ValidationFeatureEnableEXT::GPU_ASSISTED,
            vk::ValidationFeatureEnableEXT::GPU_ASSISTED_RESERVE_BINDING_SLOT,
        ];
        let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(&enabled);
        let mut info = vk::InstanceCreateInfo::default().application_info(&application);
        if validation {
            info = info.enabled_layer_names(&layers).enabled_extension_names(&extensions).push_next(&mut features);
        }
        // SAFETY: everything pointed to is alive.
        let instance = unsafe { entry.create_instance(&info, None) }.map_err(failed(if validation {
            "creating an instance with the validation layer (Debian: apt-get install vulkan-validationlayers)"
        } else {
            "creating an instance"
        }))?;
        let mut this = Self { instance, debug: None, messages, _entry: entry };
        if validation {
            let debug = ash::ext::debug_utils::Instance::new(&this._entry, &this.instance);
            messenger.p_next = std::ptr::null();
            // SAFETY: the list of messages outlives the messenger.
            let messenger = unsafe { debug.create_debug_utils_messenger(&messenger, None) }
                .map_err(failed("listening to the validation layer"))?;
            this.debug = Some((debug, messenger));
        }
        Ok(this)
    }

    /// Devices of Vulkan 1.1, the most capable first.
    pub(super) fn devices(&self) -> Result<Vec<(vk::PhysicalDevice, vk::PhysicalDeviceProperties)>, OffscreenError> {
        // SAFETY: the instance is alive.
        let all = unsafe { self.instance.enumerate_physical_devices() }.map_err(failed("listing devices"))?;
        // SAFETY: as above.
        let with = |device| (device, unsafe { self.instance.get_physical_device_properties(device) });
        let mut found: Vec<_> =
            all.into_iter().map(with).filter(|(_, p)| p.api_version >= vk::API_VERSION_1_1).collect();
        found.sort_by_key(|(_, properties)| rank(properties));
        Ok(found)
    }

    pub(super) fn messages(&self) -> Vec<String> {
        self.messages.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// What device to open, and how.
pub(super) struct DeviceRequest<'a> {
    pub(super) physical_device: vk::PhysicalDevice,
    pub(super) properties: &'a vk::PhysicalDeviceProperties,
    pub(super) queue_family: u32,
    /// Whether pipelines can be asked what the compiler made of them.
    pub(super) statistics: bool,
}

fn has_extension(instance: &ash::Instance, device: vk::PhysicalDevice, name: &CStr) -> Result<bool, OffscreenError> {
    // SAFETY: the physical device is of this instance.
    let found = unsafe { instance.enumerate_device_extension_properties(device) };
    let found = found.map_err(failed("listing extensions"))?;
    Ok(found.iter().any(|extension| extension.extension_name_as_c_str() == Ok(name)))
}

/// Opens a device with one queue; also says whether `synchronization2` is enabled.
pub(super) fn open_device(
    instance: &ash::Instance,
    request: &DeviceRequest<'_>,
) -> Result<(ash::Device, bool), OffscreenError> {
    let mut available13 = vk::PhysicalDeviceVulkan13Features::default();
    let is_1_3 = request.properties.api_version >= vk::API_VERSION_1_3;
    let mut available = vk::PhysicalDeviceFeatures2::default();
    if is_1_3 {
        available = available.push_next(&mut available13);
    }
    // SAFETY: the physical device is of this instance.
    unsafe { instance.get_physical_device_features2(request.physical_device, &mut available) };
    let basic = available.features;
    let has_synchronization2 = is_1_3 && available13.synchronization2 == vk::TRUE;
    // limpid's own, and what GPU-assisted validation writes its findings with.
    let features = vk::PhysicalDeviceFeatures::default()
        .shader_storage_image_extended_formats(basic.shader_storage_image_extended_formats == vk::TRUE)
        .fragment_stores_and_atomics(basic.fragment_stores_and_atomics == vk::TRUE)
        .vertex_pipeline_stores_and_atomics(basic.vertex_pipeline_stores_and_atomics == vk::TRUE);
    let mut enabled13 = vk::PhysicalDeviceVulkan13Features::default().synchronization2(has_synchronization2);
    let mut statistics =
        vk::PhysicalDevicePipelineExecutablePropertiesFeaturesKHR::default().pipeline_executable_info(true);
    let queues =
        [vk::DeviceQueueCreateInfo::default().queue_family_index(request.queue_family).queue_priorities(&[1.0])];
    let extensions = [ash::khr::pipeline_executable_properties::NAME.as_ptr()];
    let mut info = vk::DeviceCreateInfo::default().queue_create_infos(&queues).enabled_features(&features);
    if is_1_3 {
        info = info.push_next(&mut enabled13);
    }
    if request.statistics {
        let name = ash::khr::pipeline_executable_properties::NAME;
        if !has_extension(instance, request.physical_device, name)? {
            return Err(crate::Error::Unsupported { what: format!("the extension {}", name.to_string_lossy()) }.into());
        }
        info = info.enabled_extension_names(&extensions).push_next(&mut statistics);
    }
    // SAFETY: only what is available is enabled.
    let device =
        unsafe { instance.create_device(request.physical_device, &info, None) }.map_err(failed("opening a device"))?;
    Ok((device, has_synchronization2))
}

/// Names of all devices that [`Context::open`](super::Context::open) could open; none where there is no Vulkan.
pub fn device_names() -> Vec<String> {
    let found = Instance::new(false).and_then(|instance| instance.devices());
    found.map(|found| found.iter().map(|(_, properties)| device_name(properties)).collect()).unwrap_or_default()
}
