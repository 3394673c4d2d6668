//! The GPU beside the processor: the passes that have a recording run there when the user asks for it.
//!
//! Today that is the order of translucent splats (`hbsort::gpu`), in exact mode. Whatever the device cannot do the
//! processor does, with one line said: the picture is the same, bit for bit.

use crate::Error;
use hbsort::gpu::{Capacities, record};
use hbsort::{Params, SliceOrder};
use splat_core::{Camera, Cloud};
use splat_shaders::{Adapter, Choice, DeviceError};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// What can be asked to compute beside the processor, software drivers included. No driver at all is no error.
///
/// # Errors
/// [`Error::Gpu`] when a driver fails.
pub fn devices() -> Result<Vec<Adapter>, Error> {
    match gpu_ash::adapters() {
        Ok(adapters) => Ok(adapters),
        Err(DeviceError::NoDevice { .. }) => Ok(Vec::new()),
        Err(e) => Err(fault(&e)),
    }
}

fn fault(e: &DeviceError) -> Error {
    let hint = "`organza devices` lists what there is; --backend cpu needs none".into();
    Error::Gpu { message: format!("--backend ash: {e}"), hint }
}

/// An opened device and what was said about it.
pub(crate) struct Helper {
    choice: Choice,
    /// `None` once it was given up.
    device: Mutex<Option<gpu_ash::Device>>,
    said: Mutex<Vec<String>>,
    name: String,
}

fn held<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Helper {
    /// Opens the device that was asked for; whoever asks for one gets it or an error.
    pub(crate) fn open(choice: &Choice) -> Result<Self, Error> {
        let device = gpu_ash::Device::open(choice, gpu_ash::Validation::Off).map_err(|e| fault(&e))?;
        let name = device.adapter().name.clone();
        Ok(Self { choice: choice.clone(), device: Mutex::new(Some(device)), said: Mutex::default(), name })
    }

    /// The backend that drew, as metadata and reports name it.
    pub(crate) fn name(&self) -> String {
        if held(&self.device).is_some() { format!("ash, {}", self.name) } else { "cpu".to_owned() }
    }

    /// What a user should know, one sentence each.
    pub(crate) fn said(self) -> Vec<String> {
        self.said.into_inner().unwrap_or_else(PoisonError::into_inner)
    }

    /// The exact order of some splats, or `None` for the processor to find it. A lost device is opened once more.
    pub(crate) fn order(&self, cloud: &Cloud, ids: &[u32], camera: &Camera, params: &Params) -> Option<SliceOrder> {
        if !params.exact {
            self.say("slices without order inside (render.points.exact = false) are made by the processor");
            return None;
        }
        let mut device = held(&self.device);
        for attempt in 0..2 {
            match order_on(device.as_mut()?, cloud, ids, camera, params) {
                Ok(order) => return Some(order),
                Err(Failure::Device(DeviceError::Lost)) if attempt == 0 => {
                    *device = gpu_ash::Device::open(&self.choice, gpu_ash::Validation::Off).ok();
                }
                Err(why) => {
                    self.say(&format!("{}: {why}; the processor goes on", self.name));
                    break;
                }
            }
        }
        *device = None;
        None
    }

    fn say(&self, what: &str) {
        held(&self.said).push(what.to_owned());
    }
}

/// Why the device did not give an order.
#[derive(Debug, thiserror::Error)]
enum Failure {
    #[error(transparent)]
    Device(#[from] DeviceError),
    #[error(transparent)]
    Sort(#[from] hbsort::Error),
}

fn order_on(
    device: &mut gpu_ash::Device,
    cloud: &Cloud,
    ids: &[u32],
    camera: &Camera,
    params: &Params,
) -> Result<SliceOrder, Failure> {
    let splats = ids.len() as u32;
    let recorded = record(Capacities { splats, kept: splats });
    let uploads = recorded.uploads(cloud, Some(ids), camera, params)?;
    let run = device.run(&recorded.recording, &recorded.inputs(&uploads))?;
    let reads = [recorded.state, recorded.keys, recorded.places].map(|buffer| run.bytes(buffer));
    Ok(recorded.order(reads, cloud, Some(ids), params)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::Projection;
    use splat_core::glam::DVec3;

    #[test]
    fn where_no_device_is_left_the_processor_is_asked() {
        let (device, said) = (Mutex::new(None), Mutex::default());
        let helper = Helper { choice: Choice::Gpu, device, said, name: "gone".to_owned() };
        let view = Projection::Perspective { fov_y: 1.0 };
        let camera = Camera::look_at(DVec3::Z, DVec3::ZERO, DVec3::Y, view, [8, 8]).expect("a camera");
        let params = |exact| Params { exact, ..Params::default() };
        assert_eq!(helper.order(&Cloud::new(DVec3::ZERO), &[], &camera, &params(true)), None);
        assert_eq!(helper.order(&Cloud::new(DVec3::ZERO), &[], &camera, &params(false)), None);
        assert_eq!(helper.name(), "cpu");
        assert_eq!(helper.said().len(), 1);
    }

    #[test]
    fn a_device_that_is_not_there_is_an_error_for_who_asked() {
        let Err(error) = Helper::open(&Choice::Named("no such device".to_owned())) else { panic!("opened") };
        assert_eq!(error.exit_code(), 6);
    }
}
