//! The device that the conformance tests share their rules for: which executor and adapter, how closely watched.
//!
//! `cargo xtask vulkan` sets `ORGANZA_EXECUTOR` (`ash`, the default, or `wgpu`), `ORGANZA_ADAPTER` (part of a name; else
//! the first software driver) and `ORGANZA_VALIDATION` (`synchronization`, the default, or `gpu-assisted`).
#![forbid(unsafe_code)]

mod listen;

use splat_shaders::{Choice, DeviceError, Inputs, Recording, Run, Validation};

/// A device by one of the executors.
pub enum Device {
    /// By `gpu-ash`.
    Ash(Box<gpu_ash::Device>),
    /// By `gpu-wgpu`.
    Wgpu(Box<gpu_wgpu::Device>),
}

/// A prepared recording of one of the executors.
pub enum Prepared {
    /// By `gpu-ash`.
    Ash(Box<gpu_ash::Prepared>),
    /// By `gpu-wgpu`.
    Wgpu(Box<gpu_wgpu::Prepared>),
}

fn unknown(word: &str) -> DeviceError {
    DeviceError::NoDevice { why: format!("unknown word {word}") }
}

fn environment() -> Result<(Choice, Validation), DeviceError> {
    let choice = std::env::var("ORGANZA_ADAPTER").map_or(Choice::Software, Choice::Named);
    match std::env::var("ORGANZA_VALIDATION").as_deref() {
        Err(_) | Ok("synchronization") => Ok((choice, Validation::Synchronization)),
        Ok("gpu-assisted") => Ok((choice, Validation::GpuAssisted)),
        Ok(word) => Err(unknown(word)),
    }
}

/// Opens the adapter that the environment names by the executor that it names, watched as it says.
///
/// # Errors
/// Those of the executor; [`DeviceError::NoDevice`] for an unknown word.
pub fn open() -> Result<Device, DeviceError> {
    match std::env::var("ORGANZA_EXECUTOR").as_deref() {
        Err(_) | Ok("ash") => Ok(Device::Ash(Box::new(open_ash()?))),
        Ok("wgpu") => {
            listen::begin();
            let (choice, validation) = environment()?;
            Ok(Device::Wgpu(Box::new(gpu_wgpu::Device::open(&choice, validation)?)))
        }
        Ok(word) => Err(unknown(word)),
    }
}

/// The same by `gpu-ash`, whatever executor is named.
///
/// # Errors
/// As [`open`].
pub fn open_ash() -> Result<gpu_ash::Device, DeviceError> {
    let (choice, validation) = environment()?;
    gpu_ash::Device::open(&choice, validation)
}

impl Device {
    /// As the executor's.
    ///
    /// # Errors
    /// As the executor's.
    pub fn prepare(&mut self, recording: &Recording) -> Result<Prepared, DeviceError> {
        Ok(match self {
            Self::Ash(device) => Prepared::Ash(Box::new(device.prepare(recording)?)),
            Self::Wgpu(device) => Prepared::Wgpu(Box::new(device.prepare(recording)?)),
        })
    }

    /// As the executor's.
    ///
    /// # Errors
    /// As the executor's.
    pub fn run(&mut self, recording: &Recording, inputs: &Inputs<'_>) -> Result<Run, DeviceError> {
        self.prepare(recording)?.run(inputs)
    }

    /// What validation said since the last call, to this device or, by wgpu, to any.
    pub fn take_messages(&self) -> Vec<String> {
        match self {
            Self::Ash(device) => device.take_messages(),
            Self::Wgpu(_) => listen::take(),
        }
    }
}

impl Prepared {
    /// As the executor's.
    ///
    /// # Errors
    /// As the executor's.
    pub fn run(&mut self, inputs: &Inputs<'_>) -> Result<Run, DeviceError> {
        match self {
            Self::Ash(prepared) => prepared.run(inputs),
            Self::Wgpu(prepared) => prepared.run(inputs),
        }
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
