//! This executor behind the traits that all executors share.

use crate::{Device, Prepared, adapters};
use splat_shaders::{Adapter, Backend, Choice, DeviceError, Executor, Inputs, Ready, Recording, Run, Validation};
use std::sync::Arc;

/// Devices by Vulkan, through ash: for whoever takes any executor.
pub fn backend() -> Arc<dyn Backend> {
    Arc::new(Ash)
}

#[derive(Debug)]
struct Ash;

impl Backend for Ash {
    fn name(&self) -> &'static str {
        "ash"
    }

    fn adapters(&self) -> Result<Vec<Adapter>, DeviceError> {
        adapters()
    }

    fn open(&self, choice: &Choice, validation: Validation) -> Result<Box<dyn Executor>, DeviceError> {
        Ok(Box::new(Device::open(choice, validation)?))
    }
}

impl Executor for Device {
    fn adapter(&self) -> &Adapter {
        Device::adapter(self)
    }

    fn prepare(&mut self, recording: &Recording) -> Result<Box<dyn Ready>, DeviceError> {
        Ok(Box::new(Device::prepare(self, recording)?))
    }

    fn take_messages(&self) -> Vec<String> {
        Device::take_messages(self)
    }
}

impl Ready for Prepared {
    fn run(&mut self, inputs: &Inputs<'_>) -> Result<Run, DeviceError> {
        Prepared::run(self, inputs)
    }
}
