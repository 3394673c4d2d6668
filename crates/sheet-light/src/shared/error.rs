//! Errors of sheets: parameters and volumes out of range, too many slabs, too much memory, cancelled.

use super::reason::Reason;
use splat_core::Exceeded;

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
    /// A light breaks a promise.
    #[error("{0}")]
    Light(splat_core::Error),
    /// A mesh of polygons breaks a promise.
    #[error("polygons: {0}")]
    Polygons(splat_core::Error),
    /// Half vectors cannot serve a light, see [`crate::half::serves()`].
    #[error("light {light}: {reason}")]
    HalfVector {
        /// Its place in the input.
        light: usize,
        /// Why.
        reason: Reason,
    },
    /// Too many slabs, in all or under one kernel, or more memory than [`crate::Params::limits`] allow.
    #[error("{0}; {hint}", hint = .0.hint)]
    Limit(Exceeded),
    /// The caller asked to stop, see [`splat_core::Progress`].
    #[error("cancelled")]
    Cancelled,
}

impl Error {
    pub(crate) fn parameter(name: &'static str, found: impl std::fmt::Debug, expected: &'static str) -> Self {
        Self::Parameter { name, found: format!("{found:?}"), expected }
    }

    /// What is wrong with polygons, or that they take too much, or that nobody waits for them.
    pub(crate) fn of_polygons(error: splat_core::Error) -> Self {
        match error {
            splat_core::Error::Cancelled => Self::Cancelled,
            splat_core::Error::Limit(exceeded) => Self::Limit(exceeded),
            other => Self::Polygons(other),
        }
    }

    pub(crate) fn limit(what: &'static str, needed: u64, limit: u64, unit: &'static str, hint: String) -> Self {
        Self::Limit(Exceeded { what: what.into(), needed, limit: Some(limit), unit, hint: hint.into() })
    }
}

/// What splat-core's progress says.
pub(crate) fn cancelled(_: splat_core::Error) -> Error {
    Error::Cancelled
}
