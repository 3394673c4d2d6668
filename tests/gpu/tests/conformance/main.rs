//! Every kernel and every recording on a device, under validation, against its twin on the CPU: one program, linked once.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod canary;
mod chained;
mod deposits;
mod generated;
mod kernels;
mod lit;
mod order;
mod particles;
mod picture;
mod projected;
mod resolved;
mod shaded;
mod shadow;
mod splat;

/// What takes long and rarely fails where the others hold: `cargo xtask deep`.
mod deep {
    mod composited;
    mod layered;
    mod means;
}

use gpu_conformance::{adapter, backend};
use organza::device::DeviceChoice;

/// The device that the environment names, and how a picture by it says so.
fn named_device() -> (String, DeviceChoice) {
    let by = backend().unwrap();
    (format!("{}, ", by.name()), DeviceChoice { backends: vec![by], choice: adapter(), or_processor: false })
}
