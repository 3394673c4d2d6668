//! Errors of fields. Every message names the object and the accepted values.

use splat_core::{Progress, glam::DVec3};

/// Errors of making a field, or a surface of it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FieldError {
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

/// Returns the error of a parallel loop that was cancelled.
pub(crate) fn check_cancelled(progress: &Progress) -> Result<(), FieldError> {
    if progress.is_cancelled() { Err(FieldError::Cancelled) } else { Ok(()) }
}
