//! The device that the conformance tests share their rules for: which executor and adapter, how closely watched.
//!
//! `cargo xtask vulkan` sets `ORGANZA_EXECUTOR` (`ash`, the default, or `wgpu`), `ORGANZA_ADAPTER` (part of a name; else
//! the first software driver) and `ORGANZA_VALIDATION` (`synchronization`, the default, or `gpu-assisted`).
#![forbid(unsafe_code)]

mod listen;
mod wrapped;

pub use wrapped::{Interface, Loss, Wrapped};

use splat_shaders::{
    Adapter, Backend, Choice, DeviceError, Executor, Inputs, Lanes, Ready, Recording, Run, Validation,
};
use std::sync::Arc;

/// A device by the executor that the environment names.
pub struct Device {
    executor: Box<dyn Executor>,
}

fn unknown(word: &str) -> DeviceError {
    DeviceError::NoDevice { why: format!("unknown word {word}") }
}

fn validation() -> Result<Validation, DeviceError> {
    match std::env::var("ORGANZA_VALIDATION").as_deref() {
        Err(_) | Ok("synchronization") => Ok(Validation::Synchronization),
        Ok("gpu-assisted") => Ok(Validation::GpuAssisted),
        Ok(word) => Err(unknown(word)),
    }
}

/// The way to devices that the environment names.
///
/// # Errors
/// [`DeviceError::NoDevice`] for an unknown word.
pub fn backend() -> Result<Arc<dyn Backend>, DeviceError> {
    match std::env::var("ORGANZA_EXECUTOR").as_deref() {
        Err(_) | Ok("ash") => Ok(gpu_ash::backend()),
        Ok("wgpu") => Ok(gpu_wgpu::backend()),
        Ok(word) => Err(unknown(word)),
    }
}

/// The adapter that the environment names.
pub fn adapter() -> Choice {
    std::env::var("ORGANZA_ADAPTER").map_or(Choice::Software, Choice::Named)
}

/// Opens the adapter that the environment names by the executor that it names, watched as it says.
///
/// # Errors
/// Those of the executor; [`DeviceError::NoDevice`] for an unknown word.
pub fn open() -> Result<Device, DeviceError> {
    listen::begin();
    Ok(Device { executor: backend()?.open(&adapter(), validation()?)? })
}

/// The same by `gpu-ash`, whatever executor is named.
///
/// # Errors
/// As [`open`].
pub fn open_ash() -> Result<gpu_ash::Device, DeviceError> {
    gpu_ash::Device::open(&adapter(), validation()?)
}

impl Device {
    /// The adapter that was opened.
    pub fn adapter(&self) -> &Adapter {
        self.executor.adapter()
    }

    /// The portable kernels, and those by subgroups where the device has them.
    pub fn lanes(&self) -> Vec<Lanes> {
        let mut lanes = vec![Lanes::Portable, Lanes::for_adapter(self.adapter())];
        lanes.dedup();
        lanes
    }

    /// As the executor's.
    ///
    /// # Errors
    /// As the executor's.
    pub fn prepare(&mut self, recording: &Recording) -> Result<Box<dyn Ready>, DeviceError> {
        self.executor.prepare(recording)
    }

    /// As the executor's.
    ///
    /// # Errors
    /// As the executor's.
    pub fn run(&mut self, recording: &Recording, inputs: &Inputs<'_>) -> Result<Run, DeviceError> {
        self.executor.run(recording, inputs)
    }

    /// What validation said since the last call, to this device or, by wgpu, to any.
    pub fn take_messages(&self) -> Vec<String> {
        let mut messages = self.executor.take_messages();
        messages.extend(listen::take());
        messages
    }
}

/// Bytes of words, as devices take them.
pub fn bytes(words: &[u32]) -> Vec<u8> {
    words.iter().flat_map(|word| word.to_ne_bytes()).collect()
}

/// Words of bytes.
pub fn words(bytes: &[u8]) -> Vec<u32> {
    let (words, _) = bytes.as_chunks::<4>();
    words.iter().map(|word| u32::from_ne_bytes(*word)).collect()
}
