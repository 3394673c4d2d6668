//! The loader, an instance, and the messages of validation.

use crate::failure;
use ash::{ext, vk};
use splat_shaders::{DeviceError, Validation};
use std::ffi::{CStr, c_void};
use std::sync::{Mutex, PoisonError};

/// The layer that watches.
const LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

/// An instance; ends when dropped.
pub(crate) struct Instance {
    pub(crate) raw: ash::Instance,
    watch: Option<Watch>,
    // Last, for the functions above live in the library that it holds.
    _entry: ash::Entry,
}

/// The messenger and where it writes.
struct Watch {
    functions: ext::debug_utils::Instance,
    messenger: vk::DebugUtilsMessengerEXT,
    // Boxed: the driver keeps its address.
    messages: Box<Mutex<Vec<String>>>,
}

impl Instance {
    pub(crate) fn new(validation: Validation) -> Result<Self, DeviceError> {
        // SAFETY: the system's Vulkan loader is trusted to be one; it stays loaded as long as `_entry`.
        let entry = unsafe { ash::Entry::load() }
            .map_err(|e| DeviceError::NoDevice { why: format!("no Vulkan loader: {e}") })?;
        let watched = validation != Validation::Off;
        if watched && !has_layer(&entry)? {
            return Err(DeviceError::NoDevice { why: format!("no layer {}", LAYER.to_string_lossy()) });
        }
        let about = vk::ApplicationInfo::default().application_name(c"organza").api_version(vk::API_VERSION_1_1);
        let layers = [LAYER.as_ptr()];
        let extensions = [ext::debug_utils::NAME.as_ptr()];
        let switches = [
            vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION,
            vk::ValidationFeatureEnableEXT::GPU_ASSISTED,
            vk::ValidationFeatureEnableEXT::GPU_ASSISTED_RESERVE_BINDING_SLOT,
        ];
        let switched = if validation == Validation::GpuAssisted { &switches[..] } else { &switches[..1] };
        let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(switched);
        let mut info = vk::InstanceCreateInfo::default().application_info(&about);
        if watched {
            info = info.enabled_layer_names(&layers).enabled_extension_names(&extensions).push_next(&mut features);
        }
        // SAFETY: everything that `info` points to outlives the call.
        let raw = unsafe { entry.create_instance(&info, None) }.map_err(without_driver)?;
        let mut instance = Self { raw, watch: None, _entry: entry };
        if watched {
            instance.watch = Some(Watch::new(&instance._entry, &instance.raw)?);
        }
        Ok(instance)
    }

    /// Returns and removes the messages of validation so far; empty when it is off.
    pub(crate) fn take_messages(&self) -> Vec<String> {
        let Some(watch) = &self.watch else { return Vec::new() };
        std::mem::take(&mut *watch.messages.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

/// A loader without any driver is as good as none.
fn without_driver(result: vk::Result) -> DeviceError {
    match result {
        vk::Result::ERROR_INCOMPATIBLE_DRIVER => DeviceError::NoDevice { why: "no Vulkan driver".to_owned() },
        result => failure::in_call("vkCreateInstance")(result),
    }
}

impl Watch {
    fn new(entry: &ash::Entry, instance: &ash::Instance) -> Result<Self, DeviceError> {
        let messages = Box::new(Mutex::new(Vec::new()));
        let functions = ext::debug_utils::Instance::new(entry, instance);
        let severity = vk::DebugUtilsMessageSeverityFlagsEXT::WARNING | vk::DebugUtilsMessageSeverityFlagsEXT::ERROR;
        let info = vk::DebugUtilsMessengerCreateInfoEXT::default()
            .message_severity(severity)
            .message_type(vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION)
            .pfn_user_callback(Some(note))
            .user_data((&raw const *messages).cast_mut().cast());
        // SAFETY: the messages are boxed and live until the messenger is destroyed.
        let messenger = unsafe { functions.create_debug_utils_messenger(&info, None) };
        let messenger = messenger.map_err(failure::in_call("vkCreateDebugUtilsMessengerEXT"))?;
        Ok(Self { functions, messenger, messages })
    }
}

/// Called by the layer, from any thread.
unsafe extern "system" fn note(
    _severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _kind: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    messages: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: the layer gives valid data or none, and as user data what the messenger was made with: a mutex that
    // outlives it and that nobody borrows mutably.
    let (data, messages) = unsafe { (data.as_ref(), messages.cast::<Mutex<Vec<String>>>().as_ref()) };
    if let (Some(data), Some(messages)) = (data, messages) {
        // SAFETY: a string of the layer is null or ends with zero.
        let text = unsafe { data.message_as_c_str() }.unwrap_or(c"(no text)").to_string_lossy().into_owned();
        messages.lock().unwrap_or_else(PoisonError::into_inner).push(text);
    }
    vk::FALSE
}

fn has_layer(entry: &ash::Entry) -> Result<bool, DeviceError> {
    // SAFETY: no more than a loaded library is asked for.
    let layers = unsafe { entry.enumerate_instance_layer_properties() };
    let layers = layers.map_err(failure::in_call("vkEnumerateInstanceLayerProperties"))?;
    Ok(layers.iter().any(|layer| layer.layer_name_as_c_str() == Ok(LAYER)))
}

impl Drop for Instance {
    fn drop(&mut self) {
        // SAFETY: whatever was made from the instance holds it, so nothing is left; each is destroyed once.
        unsafe {
            if let Some(watch) = &self.watch {
                watch.functions.destroy_debug_utils_messenger(watch.messenger, None);
            }
            self.raw.destroy_instance(None);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_loader_without_drivers_is_no_failure_of_one() {
        assert!(matches!(without_driver(vk::Result::ERROR_INCOMPATIBLE_DRIVER), DeviceError::NoDevice { .. }));
        assert!(matches!(without_driver(vk::Result::ERROR_INITIALIZATION_FAILED), DeviceError::Driver { .. }));
    }
}
