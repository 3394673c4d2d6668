//! Errors of deferred blending: parameters out of range, too much memory, cancelled.

use splat_core::Exceeded;

/// Why discs were refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A parameter is out of its range.
    #[error("{name} is {found}, expected {expected}")]
    Parameter {
        /// Its name.
        name: &'static str,
        /// The value.
        found: String,
        /// The accepted range, in words.
        expected: &'static str,
    },
    /// The cloud breaks a promise.
    #[error("{0}")]
    Cloud(splat_core::Error),
    /// More groups, edges or memory than the limits allow.
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
}
