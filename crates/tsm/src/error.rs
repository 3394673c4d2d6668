//! Errors of translucent shadow maps.

use splat_core::Exceeded;

/// Errors of building, reading and recording shadow maps.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A parameter is outside its range.
    #[error("shadow map: {name} is {found}, expected {expected}")]
    Parameter {
        /// Name of the parameter.
        name: &'static str,
        /// Its value, printed.
        found: String,
        /// The accepted range, in words.
        expected: &'static str,
    },
    /// The map would take more than it may.
    #[error("shadow map: {0}; {hint}", hint = .0.hint)]
    Limit(Exceeded),
    /// A recording has less room than it needs.
    #[cfg(feature = "gpu")]
    #[error(transparent)]
    Overflow(#[from] splat_shaders::Overflow),
    /// What was read back is no result of the recording.
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
    /// What devices do not do.
    #[cfg(feature = "gpu")]
    #[error("{why}")]
    Processor {
        /// The reason, a clause of its own.
        why: &'static str,
    },
    /// The device could not do it.
    #[cfg(feature = "gpu")]
    #[error(transparent)]
    Device(#[from] splat_shaders::DeviceError),
    /// The light or the cloud breaks a promise, or the caller cancelled.
    #[error(transparent)]
    Core(#[from] splat_core::Error),
}

impl Error {
    /// [`Error::Limit`] for a part of a map.
    pub(crate) fn limit(what: &'static str, needed: u64, limit: u64, unit: &'static str) -> Self {
        let hint = "use a smaller resolution".into();
        Self::Limit(Exceeded { what: what.into(), needed, limit: Some(limit), unit, hint })
    }
}
