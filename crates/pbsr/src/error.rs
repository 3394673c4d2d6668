//! Errors of particle-based rendering.

use splat_core::Exceeded;

/// Errors of samplers, ensembles and recordings.
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
    #[error("particles: {0}; {hint}", hint = .0.hint)]
    Limit(Exceeded),
    /// A recording has less room than it needs.
    #[cfg(feature = "gpu")]
    #[error(transparent)]
    Overflow(#[from] splat_shaders::Overflow),
    /// There is nothing to sample: no surface in the box, no area, no extinction.
    #[error("particles: {what} is empty: {reason}")]
    Empty {
        /// The thing to be sampled.
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
    /// [`Error::Limit`] for sets of particles.
    pub fn limit(what: &'static str, needed: u64, limit: u64, unit: &'static str) -> Self {
        let hint = "use a larger particle cross-section or a smaller image".into();
        Self::Limit(Exceeded { what: what.into(), needed, limit: Some(limit), unit, hint })
    }

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
