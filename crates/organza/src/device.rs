//! The GPU beside the processor: the passes that have a recording run there when the user asks for it.
//!
//! Today that is the lists of shadow maps (`tsm::gpu`), the order of translucent splats (`hbsort::gpu`), in exact mode, and
//! the making (on meshes and in volumes), projection, light and average of particles (`pbsr::gpu`). Whatever the device cannot do
//! the processor does, with one line said. Lists and order are the processor's bit for bit: a device that would round otherwise
//! is found out by a trial before it is used. Sets of particles are the processor's too, up to a pixel in a thousand and
//! 3·10⁻⁵ of a hit's light (see `pbsr::gpu`). Who allows 10⁻⁵ of difference lets the device look shadows up for splats
//! (`tsm::gpu`) and composite them as well: from their attributes to the picture by one joined recording, or, where that does
//! not fit or is not all the device's, splats that the processor has projected and shaded (`splat_core::raster::gpu`).

mod chain;
mod helper;
mod order;
mod particles;
mod passport;
mod shadows;
mod splats;
mod trial;

use crate::Error;
pub(crate) use chain::Splats;
pub(crate) use helper::Helper;
pub(crate) use particles::Folding;
pub use passport::{Agreement, Checked, KernelTime, Passport, passport};
pub(crate) use shadows::LookedUp;
use splat_shaders::{Adapter, Backend, Choice, DeviceError};
use std::sync::Arc;

/// Which device helps the processor.
#[derive(Debug, Clone)]
pub struct DeviceChoice {
    /// The ways to devices; the first that opens one which keeps the picture is taken.
    pub backends: Vec<Arc<dyn Backend>>,
    /// Which of a backend's devices.
    pub choice: Choice,
    /// Without such a device the processor draws alone, with one line said; else that is [`Error::Gpu`].
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
    fn names(&self) -> String {
        match &self.backends[..] {
            [one] => one.name().to_owned(),
            _ => "auto".to_owned(),
        }
    }
}

/// What can be asked to compute beside the processor.
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
/// [`Error::Gpu`] when a driver fails.
pub fn devices() -> Result<Vec<ListedDevice>, Error> {
    let mut all = Vec::new();
    for backend in backends() {
        let found = listed(&*backend)?;
        all.extend(found.into_iter().map(|adapter| ListedDevice { backend: backend.name(), adapter }));
    }
    Ok(all)
}

/// What one backend reaches.
fn listed(backend: &dyn Backend) -> Result<Vec<Adapter>, Error> {
    match backend.adapters() {
        Err(DeviceError::NoDevice { .. }) => Ok(Vec::new()),
        found => found.map_err(|e| fault(backend.name(), &e.to_string())),
    }
}

/// Every backend of this version, the preferred first.
fn backends() -> Vec<Arc<dyn Backend>> {
    vec![gpu_ash::backend(), gpu_wgpu::backend()]
}

fn fault(name: &str, why: &str) -> Error {
    let hint = "`organza devices` lists what there is; --backend cpu needs none".into();
    Error::Gpu { message: format!("--backend {name}: {why}"), hint }
}

/// Why a device did not do it.
#[derive(Debug, thiserror::Error)]
enum Failure {
    #[error(transparent)]
    Device(#[from] DeviceError),
    #[error(transparent)]
    Sort(#[from] hbsort::Error),
    #[error(transparent)]
    Particles(#[from] pbsr::Error),
    #[error(transparent)]
    Shadows(#[from] tsm::Error),
    #[error(transparent)]
    Splats(#[from] splat_core::Error),
    #[error("its buffers or its memory are too small for all splats at once")]
    Small,
    #[error("{0}")]
    Left(&'static str),
    #[error("it rounds otherwise than the processor, so the picture would be another")]
    Rounds,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_device_that_is_not_there_is_an_error_for_who_asked() {
        let name = || "no such device".to_owned();
        let named = || Choice::Named(name());
        let asked = [DeviceChoice::ash(named()), DeviceChoice::wgpu(named()), DeviceChoice::auto(Some(name()))];
        for choice in asked {
            let Err(error) = Helper::open(&choice) else { panic!("opened") };
            assert_eq!(error.exit_code(), 6);
            assert!(error.to_string().starts_with(&format!("--backend {}: ", choice.names())), "{error}");
        }
    }
}
