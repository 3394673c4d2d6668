//! Errors of translucent shadow maps.

/// What can go wrong.
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
    /// The table would take more memory than it may.
    #[error("shadow map: {what} needs {needed_bytes} bytes, the limit is {limit_bytes}; use a smaller resolution")]
    Memory {
        /// What would be too large.
        what: &'static str,
        /// Bytes needed.
        needed_bytes: u64,
        /// Bytes allowed.
        limit_bytes: u64,
    },
    /// A recording has less room than it needs: record again with what it needs.
    #[cfg(feature = "gpu")]
    #[error("room for {had} {what}, needed {needed}: record the lists again with that")]
    Overflow {
        /// What there is too little room for.
        what: &'static str,
        /// Room that is needed.
        needed: u64,
        /// Room that there was.
        had: u64,
    },
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
