//! Errors of conversions. Every message names the object and the accepted values.

use field::FieldError;
use splat_core::{Exceeded, Progress, glam::DVec3};

/// Errors of converting a mesh, a volume, raw points or a field to a cloud.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ConvertError {
    /// A parameter is outside its range.
    #[error("object '{object}': {parameter} is {found}, expected {expected}")]
    Parameter {
        /// Name of the object.
        object: String,
        /// Name of the parameter.
        parameter: &'static str,
        /// The value, printed.
        found: String,
        /// The accepted range, in words.
        expected: &'static str,
    },
    /// The conversion would make more than its limits allow, or than the system has memory for.
    #[error("{0}; {hint}", hint = .0.hint)]
    Limit(Exceeded),
    /// The input breaks a promise of its noun.
    #[error("object '{object}': {source}")]
    Input {
        /// Name of the object.
        object: String,
        /// The promise that was broken.
        source: splat_core::Error,
    },
    /// A field has no finite value where one is needed.
    #[error(
        "object '{object}': the field is {value} at {point}, expected a finite number; change the expression or the box"
    )]
    NonFinite {
        /// Name of the object.
        object: String,
        /// Where, in the field's coordinates.
        point: DVec3,
        /// The value found.
        value: f64,
    },
    /// [`Progress::cancel`] was called; nothing of the result is of use.
    #[error("interrupted")]
    Cancelled,
}

impl From<FieldError> for ConvertError {
    fn from(error: FieldError) -> Self {
        match error {
            FieldError::Parameter { object, parameter, found, expected } => {
                Self::Parameter { object, parameter, found, expected }
            }
            FieldError::NonFinite { object, point, value } => Self::NonFinite { object, point, value },
            FieldError::Cancelled => Self::Cancelled,
        }
    }
}

/// Returns the error of a parallel loop that was cancelled.
pub(crate) fn check_cancelled(progress: &Progress) -> Result<(), ConvertError> {
    if progress.is_cancelled() { Err(ConvertError::Cancelled) } else { Ok(()) }
}
