//! The stages of Organza on a GPU, beside the processor.
//!
//! Each stage records its own work (`hbsort::gpu`, `tsm::gpu`, `splat_core::raster::gpu`, `splat_core::shade::gpu`,
//! `pbsr::gpu`) and knows no other. This crate joins recordings so that nothing is read back between them. If a device
//! refuses, is lost, or would round otherwise than the processor, the processor does the work, and one
//! line reports it.
//!
//! | work | item | agrees with the processor |
//! |---|---|---|
//! | lists of a shadow map | [`shadow_map`] | bit for bit |
//! | exact order of translucent splats | [`order`] | bit for bit |
//! | splats from their attributes to the picture | [`chain`] | 10⁻⁵ |
//! | sets of particles | [`Folding`] | the hits of 99.9 % of the pixels, and their light up to 3·10⁻⁵ |
//!
//! A [`Device`] is opened once and serves any number of pictures. A [`Helper`] is its work on one picture.
//!
//! ```
//! use organza_device::{Choice, Device, DeviceChoice, Helper};
//!
//! // Without a GPU of this name, opening is an error; `DeviceChoice::auto(None)` leaves the work to the processor then.
//! assert!(Device::open(&DeviceChoice::ash(Choice::Named("no such device".into()))).is_err());
//! let device = Device::open(&DeviceChoice::auto(None)).unwrap();
//! // The opened device has not done any work yet.
//! assert_eq!(Helper::new(&device).name(), "cpu");
//! ```
#![forbid(unsafe_code)]

mod chain;
mod choice;
mod device;
mod order;
mod particles;
mod passport;
mod shadows;
mod trial;

pub use chain::{Chained, Splats, chain, keeps_shadows};
pub use choice::{DeviceChoice, ListedDevice, devices};
pub use device::{Device, Helper};
pub use order::order;
pub use particles::{Folding, Goal, Shadow};
pub use passport::{Agreement, Checked, KernelTime, Passport, passport};
pub use shadows::shadow_map;
pub use splat_shaders::{Adapter, AdapterKind, Choice};

use splat_shaders::DeviceError;

/// No device as it was asked for.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("--backend {backend}: {why}")]
pub struct Error {
    /// The backends that were asked, as users write them.
    pub backend: String,
    /// The reason of each of them.
    pub why: String,
}

/// Why a device did not do it.
#[derive(Debug, thiserror::Error)]
enum Failure {
    #[error(transparent)]
    Device(#[from] DeviceError),
    #[error(transparent)]
    Sort(hbsort::Error),
    #[error(transparent)]
    Particles(#[from] pbsr::Error),
    #[error(transparent)]
    Shadows(tsm::Error),
    #[error(transparent)]
    Splats(#[from] splat_core::Error),
    #[error("{0}")]
    Left(&'static str),
    #[error("it rounds otherwise than the processor, so the picture would be another")]
    Rounds,
}

impl From<hbsort::Error> for Failure {
    fn from(error: hbsort::Error) -> Self {
        match error {
            hbsort::Error::Device(why) => Self::Device(why),
            other => Self::Sort(other),
        }
    }
}

impl From<tsm::Error> for Failure {
    fn from(error: tsm::Error) -> Self {
        match error {
            tsm::Error::Device(why) => Self::Device(why),
            other => Self::Shadows(other),
        }
    }
}

/// The page's example compiles and holds.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Page;
