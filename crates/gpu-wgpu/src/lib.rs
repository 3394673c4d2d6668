//! Runs recordings of GPU work through wgpu: the same names as `gpu-ash`, the same modules, no unsafe code.
//!
//! wgpu reads the SPIR-V through naga, adds checks of bounds, and finds the barriers by itself from what kernels declare
//! of their bindings. What it says of a recording is a second opinion on the executor that works by the recording's own
//! barriers.
//!
//! ```
//! use gpu_wgpu::{Choice, Device, DeviceError, Validation};
//!
//! match Device::open(&Choice::Gpu, Validation::Off) {
//!     Ok(device) => println!("{}", device.adapter().name),
//!     Err(DeviceError::NoDevice { why }) => println!("no GPU here: {why}"),
//!     Err(e) => panic!("{e}"),
//! }
//! ```
#![forbid(unsafe_code)]

mod adapters;
mod backend;
mod device;
mod prepared;

pub use adapters::adapters;
pub use backend::backend;
pub use device::Device;
pub use prepared::Prepared;
pub use splat_shaders::{Adapter, AdapterKind, Choice, DeviceError, Inputs, PassTime, Run, Validation};
