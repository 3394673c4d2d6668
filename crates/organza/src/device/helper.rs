//! An opened device: one that is lost is opened once more, one that fails is given up and the processor goes on.

use super::order::order_on;
use super::trial::order_trial;
use super::{DeviceChoice, Failure, fault};
use crate::Error;
use hbsort::{Params, SliceOrder};
use splat_core::{Camera, Cloud};
use splat_shaders::{Backend, Choice, DeviceError, Executor, Validation};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The device that helps one render, and what was said about it.
pub(crate) struct Helper {
    /// `None` once it was given up.
    opened: Mutex<Option<Opened>>,
    history: Mutex<History>,
    /// Backend and device.
    name: String,
}

struct Opened {
    backend: Arc<dyn Backend>,
    choice: Choice,
    executor: Box<dyn Executor>,
}

#[derive(Default)]
struct History {
    said: Vec<String>,
    /// Whether it did anything.
    helped: bool,
    /// Whether it was lost and opened again.
    reopened: bool,
}

fn held<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Helper {
    /// Opens the device that was asked for; whoever asks for one gets it or an error.
    pub(crate) fn open(choice: &DeviceChoice) -> Result<Self, Error> {
        let mut faults = Vec::new();
        for backend in &choice.backends {
            match open_one(backend, &choice.choice) {
                Ok(executor) => {
                    let name = format!("{}, {}", backend.name(), executor.adapter().name);
                    let opened = Opened { backend: backend.clone(), choice: choice.choice.clone(), executor };
                    return Ok(Self { opened: Mutex::new(Some(opened)), history: Mutex::default(), name });
                }
                Err(why) if choice.backends.len() == 1 => faults.push(why.to_string()),
                Err(why) => faults.push(format!("{}: {why}", backend.name())),
            }
        }
        let why = faults.join("; ");
        if !choice.or_processor {
            return Err(fault(&choice.names(), &why));
        }
        let helper = Self { opened: Mutex::new(None), history: Mutex::default(), name: String::new() };
        helper.say(format!("no GPU helps ({why}): the processor draws alone"));
        Ok(helper)
    }

    /// What drew, as metadata and reports name it.
    pub(crate) fn name(&self) -> String {
        match (held(&self.opened).is_some(), held(&self.history).helped) {
            (true, _) => self.name.clone(),
            (false, true) => format!("{}, then cpu", self.name),
            (false, false) => "cpu".to_owned(),
        }
    }

    /// What a user should know, one sentence each.
    pub(crate) fn said(self) -> Vec<String> {
        self.history.into_inner().unwrap_or_else(PoisonError::into_inner).said
    }

    /// The exact order of some splats, or `None` for the processor to find it.
    pub(crate) fn order(&self, cloud: &Cloud, ids: &[u32], camera: &Camera, params: &Params) -> Option<SliceOrder> {
        if !params.exact && held(&self.opened).is_some() {
            self.say("slices without order inside (render.points.exact = false) are made by the processor".to_owned());
        }
        if !params.exact {
            return None;
        }
        let (order, _) = self.with(|device| order_on(device, cloud, ids, camera, params))?;
        Some(order)
    }

    /// Does some work on the device, once more on a fresh one if it is lost meanwhile for the first time. `None` when
    /// there is no device, or none any more: what the work was for is the processor's.
    fn with<T>(&self, mut work: impl FnMut(&mut dyn Executor) -> Result<T, Failure>) -> Option<T> {
        let mut opened = held(&self.opened);
        loop {
            let device = opened.as_mut()?;
            let why = match work(&mut *device.executor) {
                Ok(done) => {
                    held(&self.history).helped = true;
                    return Some(done);
                }
                Err(why) => why,
            };
            let lost = matches!(why, Failure::Device(DeviceError::Lost));
            let again = (lost && !std::mem::replace(&mut held(&self.history).reopened, lost))
                .then(|| device.backend.open(&device.choice, Validation::Off));
            match again {
                Some(Ok(executor)) => {
                    device.executor = executor;
                    self.say(format!("{}: {why} and opened once more", self.name));
                }
                _ => {
                    self.say(format!("{}: {why}; the processor goes on", self.name));
                    *opened = None;
                }
            }
        }
    }

    fn say(&self, what: String) {
        held(&self.history).said.push(what);
    }
}

/// A device that keeps the picture, bit for bit.
fn open_one(backend: &Arc<dyn Backend>, choice: &Choice) -> Result<Box<dyn Executor>, Failure> {
    let mut executor = backend.open(choice, Validation::Off)?;
    if order_trial(&mut *executor)? { Ok(executor) } else { Err(Failure::Rounds) }
}
