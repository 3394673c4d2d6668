//! Every kernel and every recording on a device, under validation, against its twin on the CPU: one program, linked once.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod canary;
mod chained;
#[cfg(feature = "deep")]
mod composited;
mod deposits;
mod generated;
mod kernels;
#[cfg(feature = "deep")]
mod layered;
mod lit;
#[cfg(feature = "deep")]
mod means;
mod order;
mod particles;
mod picture;
mod projected;
mod resolved;
mod shaded;
mod shadow;
mod splat;

use gpu_conformance::{adapter, backend};
use organza::device::DeviceChoice;

/// The device that the environment names, and how a picture by it says so.
fn named_device() -> (String, DeviceChoice) {
    let by = backend().unwrap();
    (format!("{}, ", by.name()), DeviceChoice { backends: vec![by], choice: adapter(), or_processor: false })
}
