//! The GPU's side of the stages, without a GPU: kernels, layouts, and recordings of what a device is to do.
//!
//! A kernel is one GLSL file under `glsl/`, named as its twin on the CPU; `cargo xtask shaders` compiles it to the
//! SPIR-V under `spirv/`, which is committed. A [`Recording`] is plain data: buffers, and steps that upload, dispatch
//! and read back, with what each step reads and writes. A stage makes its own without a device, so that it can be read
//! and tested; an executor (`gpu-ash`) runs it and takes every barrier from [`barriers`], none is written by hand.
//!
//! ```
//! use splat_shaders::{Groups, Recording, barriers, kernels};
//!
//! let mut recording = Recording::default();
//! let values = recording.input("values", 4096);
//! let sums = recording.scratch("sums", 16);
//! let scan = recording.input("scan", 8);
//! recording.dispatch(&kernels::SCAN_REDUCE, Groups::Direct([1, 1, 1]), &[scan, values, sums], &[]);
//! recording.read(sums);
//! recording.check().unwrap();
//! // The dispatch waits for the uploads, the copy for the dispatch.
//! let waits: Vec<usize> = barriers(&recording).iter().map(Vec::len).collect();
//! assert_eq!(waits, [0, 0, 2, 1]);
//! ```
#![forbid(unsafe_code)]

mod barriers;
mod batches;
mod check;
mod device;
mod fit;
mod join;
pub mod kernels;
mod lanes;
mod layout;
pub mod layouts;
mod overflow;
pub mod radix;
mod recording;
pub mod reflect;
mod snapshot;

pub use barriers::{Barrier, Use, barriers};
pub use batches::{LONGEST, batches};
pub use check::Fault;
pub use device::{
    Adapter, AdapterKind, Backend, Choice, DeviceError, Executor, Inputs, PassTime, Ready, Run, Validation,
};
pub use fit::most_that_fits;
pub use join::Joined;
pub use kernels::{Access, Kernel};
pub use lanes::{Lanes, SubgroupOps};
pub use layout::{Field, GlslType, Layout};
pub use overflow::Overflow;
pub use recording::{Buffer, BufferId, Dispatch, Groups, Recording, Step};
