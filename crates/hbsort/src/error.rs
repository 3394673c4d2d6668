//! Errors of the sort: parameters out of range, depths that are not finite, too many splats, no memory.

use splat_core::{Exceeded, glam::DVec3};

/// Why a sort was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The given slice thickness cannot be used.
    #[error("slice thickness is {found}, expected a finite number of at least 1e-300")]
    Thickness {
        /// The thickness, world units.
        found: f64,
    },
    /// [`crate::Thickness::Auto`] takes ε from splat radii, and depths alone have none.
    #[error("depths alone have no splat radii to take the slice thickness from: give Thickness::World")]
    NoRadii,
    /// The axis that slices should lie across has no finite origin or no direction of unit length.
    #[error("slices along {direction} from {origin}: expected a direction of length 1 and a finite origin")]
    Axis {
        /// Where distances are 0, world units.
        origin: DVec3,
        /// The direction.
        direction: DVec3,
    },
    /// A ready depth is NaN or infinite.
    #[error("depth {index} is {found}, expected a finite number")]
    Depth {
        /// Its place in the input.
        index: usize,
        /// The depth.
        found: f32,
    },
    /// The subset of splats is not strictly ascending, or names a splat that the cloud does not have.
    #[error("ids must ascend strictly and stay below {len}: entry {index} is {found}")]
    Ids {
        /// The first entry at fault.
        index: usize,
        /// The id there.
        found: u32,
        /// Splats in the cloud.
        len: usize,
    },
    /// More splats than an order can name, or buffers that the system has no memory for.
    #[error("{0}; {hint}", hint = .0.hint)]
    Limit(Exceeded),
    /// A recording has less room than it needs.
    #[cfg(feature = "gpu")]
    #[error(transparent)]
    Overflow(#[from] splat_shaders::Overflow),
    /// The bytes that were read back are no result of the recording.
    #[cfg(feature = "gpu")]
    #[error("{found} bytes of {what} were read back, expected {expected}")]
    ReadBack {
        /// The buffer.
        what: &'static str,
        /// Bytes expected at least.
        expected: u64,
        /// Bytes given.
        found: u64,
    },
    /// The device could not do it.
    #[cfg(feature = "gpu")]
    #[error(transparent)]
    Device(#[from] splat_shaders::DeviceError),
}
