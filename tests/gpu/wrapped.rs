//! A backend with its devices made worse: lost at a submission, short of memory, or with kernels that see small buffers
//! alone.
//!
//! A device is lost by the driver: by `gpu-ash` it answers `VK_ERROR_DEVICE_LOST`, by `gpu-wgpu` the device is destroyed.

use splat_shaders::{Adapter, Backend, Choice, DeviceError, Executor, Inputs, Ready, Recording, Run, Validation};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// When devices are lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Loss {
    /// Never.
    Never,
    /// At this submission, counted from 1 over all devices of the backend.
    Once(u64),
    /// At this submission and each after it.
    Always(u64),
}

/// Interfaces whose devices can be lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interface {
    /// `gpu-ash`.
    Ash,
    /// `gpu-wgpu`.
    Wgpu,
}

/// A backend whose devices fail.
#[derive(Debug)]
pub struct Wrapped {
    interface: Interface,
    loss: Loss,
    binding_bytes: u64,
    memory_bytes: u64,
    submissions: Arc<AtomicU64>,
}

impl Wrapped {
    /// Devices that are lost, and whose kernels see at most so many bytes of a buffer.
    pub fn new(interface: Interface, loss: Loss, binding_bytes: u64) -> Self {
        Self { interface, loss, binding_bytes, memory_bytes: u64::MAX, submissions: Arc::default() }
    }

    /// The same with memory for one recording of so many bytes.
    pub fn with_memory(self, memory_bytes: u64) -> Self {
        Self { memory_bytes, ..self }
    }

    /// Runs that were asked for so far.
    pub fn submissions(&self) -> u64 {
        self.submissions.load(Ordering::Relaxed)
    }

    fn describe(&self, adapter: &Adapter) -> Adapter {
        Adapter { binding_bytes: adapter.binding_bytes.min(self.binding_bytes), ..adapter.clone() }
    }
}

impl Backend for Wrapped {
    fn name(&self) -> &'static str {
        match self.interface {
            Interface::Ash => "ash",
            Interface::Wgpu => "wgpu",
        }
    }

    fn adapters(&self) -> Result<Vec<Adapter>, DeviceError> {
        let adapters = match self.interface {
            Interface::Ash => gpu_ash::adapters()?,
            Interface::Wgpu => gpu_wgpu::adapters()?,
        };
        Ok(adapters.iter().map(|adapter| self.describe(adapter)).collect())
    }

    fn open(&self, choice: &Choice, validation: Validation) -> Result<Box<dyn Executor>, DeviceError> {
        let (inner, lose): (Box<dyn Executor>, Lose) = match self.interface {
            Interface::Ash => {
                let device = gpu_ash::Device::open(choice, validation)?;
                let lose = Arc::new(device.loss());
                (Box::new(device), lose)
            }
            Interface::Wgpu => {
                let device = gpu_wgpu::Device::open(choice, validation)?;
                let lose = Arc::new(device.loss());
                (Box::new(device), lose)
            }
        };
        let adapter = self.describe(inner.adapter());
        let fate = Fate { loss: self.loss, submissions: self.submissions.clone(), lose };
        Ok(Box::new(WrappedDevice { inner, adapter, memory_bytes: self.memory_bytes, fate }))
    }
}

/// Loses a device.
type Lose = Arc<dyn Fn() + Send + Sync>;

/// What becomes of a device; once it is lost it stays so.
#[derive(Clone)]
struct Fate {
    loss: Loss,
    submissions: Arc<AtomicU64>,
    lose: Lose,
}

impl Fate {
    fn submit(&self) {
        let count = self.submissions.fetch_add(1, Ordering::Relaxed) + 1;
        let strikes = match self.loss {
            Loss::Never => false,
            Loss::Once(at) => count == at,
            Loss::Always(at) => count >= at,
        };
        if strikes {
            (self.lose)();
        }
    }
}

struct WrappedDevice {
    inner: Box<dyn Executor>,
    adapter: Adapter,
    memory_bytes: u64,
    fate: Fate,
}

impl Executor for WrappedDevice {
    fn adapter(&self) -> &Adapter {
        &self.adapter
    }

    fn prepare(&mut self, recording: &Recording) -> Result<Box<dyn Ready>, DeviceError> {
        let had = self.adapter.binding_bytes;
        if let Some(b) = recording.buffers().iter().find(|b| b.bytes > had) {
            return Err(DeviceError::TooLarge { name: b.name, needed: b.bytes, had });
        }
        let bytes = recording.bytes();
        if bytes > self.memory_bytes {
            return Err(DeviceError::Memory { bytes });
        }
        Ok(Box::new(WrappedReady { inner: self.inner.prepare(recording)?, fate: self.fate.clone() }))
    }
}

struct WrappedReady {
    inner: Box<dyn Ready>,
    fate: Fate,
}

impl Ready for WrappedReady {
    fn run(&mut self, inputs: &Inputs<'_>) -> Result<Run, DeviceError> {
        self.fate.submit();
        self.inner.run(inputs)
    }
}
