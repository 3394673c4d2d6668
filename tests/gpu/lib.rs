//! The device that the conformance tests share their rules for: which adapter, how closely watched, no message.
//!
//! `cargo xtask vulkan` sets `ORGANZA_ADAPTER` (part of a name; else the first software driver) and
//! `ORGANZA_VALIDATION` (`synchronization`, the default, or `gpu-assisted`).
#![forbid(unsafe_code)]

use gpu_ash::{Choice, Device, DeviceError, Validation};

/// Opens the adapter that the environment names, watched as it says.
///
/// # Errors
/// Those of [`Device::open`]; [`DeviceError::NoDevice`] for an unknown word.
pub fn open() -> Result<Device, DeviceError> {
    let choice = std::env::var("ORGANZA_ADAPTER").map_or(Choice::Software, Choice::Named);
    let validation = match std::env::var("ORGANZA_VALIDATION").as_deref() {
        Err(_) | Ok("synchronization") => Validation::Synchronization,
        Ok("gpu-assisted") => Validation::GpuAssisted,
        Ok(word) => return Err(DeviceError::NoDevice { why: format!("unknown validation {word}") }),
    };
    Device::open(&choice, validation)
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
