//! Runs recordings of GPU work on Vulkan 1.1.
//!
//! A [`Device`] is opened by [`Choice`]. `Choice::Gpu` never opens a software driver. [`Device::prepare`]
//! allocates a recording's memory, compiles its kernels and writes its commands once. [`Prepared::run`] uploads, runs and
//! reads back, any number of times. Barriers follow from the reads and writes that the recording declares.
//!
//! ```
//! use gpu_ash::{Choice, Device, DeviceError, Validation};
//! use splat_shaders::{Groups, Recording, kernels};
//!
//! let mut recording = Recording::default();
//! let scan = recording.input("scan", 8);
//! let numbers = recording.input("numbers", 12);
//! let sums = recording.scratch("sums", 4);
//! recording.dispatch(&kernels::SCAN_REDUCE, Groups::cover(1), &[scan, numbers, sums], &[]);
//! recording.read(sums);
//!
//! let bytes = |words: &[u32]| words.iter().flat_map(|w| w.to_ne_bytes()).collect::<Vec<u8>>();
//! match Device::open(&Choice::Gpu, Validation::Off) {
//!     Ok(mut device) => {
//!         let inputs = [(scan, &bytes(&[3, 0])[..]), (numbers, &bytes(&[20, 30, 50])[..])];
//!         let run = device.prepare(&recording).unwrap().run(&inputs).unwrap();
//!         assert_eq!(run.bytes(sums), bytes(&[100]));
//!     }
//!     Err(DeviceError::NoDevice { why }) => println!("no GPU here: {why}"),
//!     Err(e) => panic!("{e}"),
//! }
//! ```

mod adapters;
mod backend;
mod commands;
mod device;
mod failure;
mod instance;
#[cfg(feature = "losing")]
mod losing;
mod memory;
mod pipeline;
mod prepared;

pub use adapters::adapters;
pub use backend::backend;
pub use device::Device;
pub use prepared::Prepared;
pub use splat_shaders::{Adapter, AdapterKind, Choice, DeviceError, Inputs, PassTime, Run, Validation};

/// The page's example compiles and holds.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Page;
