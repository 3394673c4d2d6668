//! Errors of particle-based rendering.

/// What can go wrong.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A parameter is outside its range.
    #[error("particles: {name} is {found}, expected {expected}")]
    Parameter {
        /// Name of the parameter.
        name: &'static str,
        /// Its value, printed.
        found: String,
        /// The accepted range, in words.
        expected: &'static str,
    },
    /// More particles or more memory than allowed.
    #[error(
        "particles: {what} needs {needed} {unit}, the limit is {had}; use a larger particle cross-section or a smaller image"
    )]
    TooMuch {
        /// What would be too large.
        what: &'static str,
        /// Amount needed.
        needed: u64,
        /// Amount allowed.
        had: u64,
        /// What is counted: `particles`, `bytes` …
        unit: &'static str,
    },
    /// There is nothing to sample: no surface in the box, no area, no extinction.
    #[error("particles: {what} is empty: {reason}")]
    Empty {
        /// What was to be sampled.
        what: &'static str,
        /// Why nothing was found.
        reason: &'static str,
    },
    /// A field returned a number that is not finite.
    #[error("particles: the field is {found} at {at}, expected a finite number")]
    Field {
        /// World position, printed.
        at: String,
        /// The value, printed.
        found: String,
    },
    /// A checkpoint is damaged, or of another render.
    #[error("checkpoint: {0}")]
    Checkpoint(String),
    /// The input breaks a promise of its noun, or the caller cancelled.
    #[error(transparent)]
    Core(#[from] splat_core::Error),
}

impl Error {
    /// Shorthand for [`Error::Parameter`].
    pub(crate) fn parameter(name: &'static str, found: impl std::fmt::Debug, expected: &'static str) -> Self {
        Self::Parameter { name, found: format!("{found:?}"), expected }
    }
}

/// `Ok` when `ok`, else [`Error::Parameter`].
pub(crate) fn check(
    ok: bool,
    name: &'static str,
    found: impl std::fmt::Debug,
    expected: &'static str,
) -> Result<(), Error> {
    if ok { Ok(()) } else { Err(Error::parameter(name, found, expected)) }
}
