//! Errors of sheets: parameters and volumes out of range, too many slabs, too much memory, cancelled.

/// Why sheets were refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A parameter is out of its range.
    #[error("{name} is {found}, expected {expected}")]
    Parameter {
        /// Its name in [`crate::Params`].
        name: &'static str,
        /// The value.
        found: String,
        /// The accepted range, in words.
        expected: &'static str,
    },
    /// A volume, or what belongs to it, breaks a promise.
    #[error("volume {volume}: {source}")]
    Volume {
        /// Its place in the input.
        volume: usize,
        /// What is wrong.
        source: splat_core::Error,
    },
    /// The depth of the volumes over the slab width gives too many slabs, or a kernel reaches through too many.
    #[error("slabs {width} wide: {needed} {what}, the limit is {limit}; choose wider slabs")]
    Slabs {
        /// Slab width, world units.
        width: f64,
        /// What there are too many of.
        what: &'static str,
        /// How many there would be.
        needed: f64,
        /// How many there may be.
        limit: u32,
    },
    /// More memory than [`crate::Params::max_bytes`] allows.
    #[error("sheets need {needed} bytes, the limit is {limit}")]
    Memory {
        /// Bytes needed, estimated before any are taken.
        needed: u64,
        /// Bytes allowed.
        limit: u64,
    },
    /// The caller asked to stop, see [`splat_core::Progress`].
    #[error("cancelled")]
    Cancelled,
}

impl Error {
    pub(crate) fn parameter(name: &'static str, found: impl std::fmt::Debug, expected: &'static str) -> Self {
        Self::Parameter { name, found: format!("{found:?}"), expected }
    }
}

/// What splat-core's progress says.
pub(crate) fn cancelled(_: splat_core::Error) -> Error {
    Error::Cancelled
}
