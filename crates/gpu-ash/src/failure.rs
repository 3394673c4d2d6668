//! Translates errors of the driver into those of executors.

use ash::vk;
use gpu_allocator::AllocationError;
use splat_shaders::DeviceError;

/// Names the call that failed.
pub(crate) fn in_call(call: &'static str) -> impl Fn(vk::Result) -> DeviceError {
    move |result| match result {
        vk::Result::ERROR_DEVICE_LOST => DeviceError::Lost,
        result => DeviceError::Driver { call, why: format!("{result:?}") },
    }
}

/// Names how much memory was asked for.
pub(crate) fn of_memory(bytes: u64) -> impl Fn(AllocationError) -> DeviceError {
    move |error| match error {
        AllocationError::OutOfMemory => DeviceError::Memory { bytes },
        error => DeviceError::Driver { call: "memory", why: error.to_string() },
    }
}
