//! Runs recordings of GPU work through wgpu: the same names as `gpu-ash`, the same modules, no unsafe code.
//!
//! wgpu reads the SPIR-V through naga, adds checks of bounds, and derives barriers from the bindings that kernels declare.
//! So its results are a second opinion on `gpu-ash`, which takes barriers from the recording.
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
