//! This executor behind the traits that all executors share.

use crate::{Device, Prepared, adapters};
use splat_shaders::{Adapter, Backend, Choice, DeviceError, Executor, Inputs, Ready, Recording, Run, Validation};
use std::sync::Arc;

/// Devices by wgpu: for whoever takes any executor.
pub fn backend() -> Arc<dyn Backend> {
    Arc::new(Wgpu)
}

#[derive(Debug)]
struct Wgpu;

impl Backend for Wgpu {
    fn name(&self) -> &'static str {
        "wgpu"
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
}

impl Ready for Prepared {
    fn run(&mut self, inputs: &Inputs<'_>) -> Result<Run, DeviceError> {
        Prepared::run(self, inputs)
    }
}
