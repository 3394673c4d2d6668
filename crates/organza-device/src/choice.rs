//! The choice of a device: the backends to try, and which of their devices to open.

use crate::Error;
use splat_shaders::{Adapter, Backend, Choice, DeviceError};
use std::sync::Arc;

/// Which device helps the processor.
#[derive(Debug, Clone)]
pub struct DeviceChoice {
    /// The ways to devices; the first that opens one which keeps the picture is taken.
    pub backends: Vec<Arc<dyn Backend>>,
    /// Which of a backend's devices.
    pub choice: Choice,
    /// Without such a device the processor draws alone, with one line said; else that is an [`Error`].
    pub or_processor: bool,
}

impl DeviceChoice {
    /// A device by Vulkan, through `gpu-ash`.
    pub fn ash(choice: Choice) -> Self {
        Self { backends: vec![gpu_ash::backend()], choice, or_processor: false }
    }

    /// A device by wgpu, through `gpu-wgpu`.
    pub fn wgpu(choice: Choice) -> Self {
        Self { backends: vec![gpu_wgpu::backend()], choice, or_processor: false }
    }

    /// A device by either, Vulkan first. Without a name it is a real GPU, and where there is none, the processor.
    pub fn auto(name: Option<String>) -> Self {
        let or_processor = name.is_none();
        Self { backends: backends(), choice: name.map_or(Choice::Gpu, Choice::Named), or_processor }
    }

    /// The names of the backends, as users write them.
    pub(crate) fn names(&self) -> String {
        match &self.backends[..] {
            [one] => one.name().to_owned(),
            _ => "auto".to_owned(),
        }
    }
}

/// A device that can be requested beside the processor.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ListedDevice {
    /// The backend that reaches it: `ash` or `wgpu`.
    pub backend: &'static str,
    /// The device.
    pub adapter: Adapter,
}

/// Every device by every backend, software drivers included. No driver at all is no error.
///
/// # Errors
/// When a driver fails to say what there is.
pub fn devices() -> Result<Vec<ListedDevice>, Error> {
    let mut devices = Vec::new();
    for backend in backends() {
        let found = listed(&*backend)?;
        devices.extend(found.into_iter().map(|adapter| ListedDevice { backend: backend.name(), adapter }));
    }
    Ok(devices)
}

/// Lists the devices that one backend reaches.
pub(crate) fn listed(backend: &dyn Backend) -> Result<Vec<Adapter>, Error> {
    match backend.adapters() {
        Err(DeviceError::NoDevice { .. }) => Ok(Vec::new()),
        found => found.map_err(|e| Error { backend: backend.name().to_owned(), why: e.to_string() }),
    }
}

/// Every backend of this version, the preferred first.
pub(crate) fn backends() -> Vec<Arc<dyn Backend>> {
    vec![gpu_ash::backend(), gpu_wgpu::backend()]
}
