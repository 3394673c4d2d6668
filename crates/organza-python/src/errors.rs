//! Errors as Python has them.

use crate::wording::sentence;
use organza::Error;
use pyo3::PyErr;
use pyo3::exceptions::{
    PyFileNotFoundError, PyKeyboardInterrupt, PyMemoryError, PyOSError, PyRuntimeError, PyValueError,
};
use std::io::ErrorKind;

pyo3::create_exception!(
    organza,
    InputError,
    PyValueError,
    "A file, an array or a scene is wrong. The message names it, says what was expected and found, and what to do."
);
pyo3::create_exception!(
    organza,
    LimitError,
    PyMemoryError,
    "The work would take more memory than `max_memory` allows. Nothing was drawn."
);

/// An error with its hint in the words of Python, as the exception that stands for it.
pub(crate) fn raised(error: &Error) -> PyErr {
    let message = sentence(&error.to_string());
    let hint = sentence(error.hint());
    let hint = if is_of_memory(error) && !hint.contains(MEMORY) { with_memory(&hint) } else { hint };
    let text = if hint.is_empty() { message } else { format!("{message}\nhint: {hint}") };
    match error {
        Error::Cancelled => PyKeyboardInterrupt::new_err(()),
        Error::Limit(_) | Error::TooLarge { .. } => LimitError::new_err(text),
        Error::Io { source, .. } if source.kind() == ErrorKind::NotFound => PyFileNotFoundError::new_err(text),
        Error::Io { .. } => PyOSError::new_err(text),
        Error::Internal(_) | Error::Gpu { .. } => PyRuntimeError::new_err(text),
        _ => match error.exit_code() {
            4 => PyOSError::new_err(text),
            5 => LimitError::new_err(text),
            _ => InputError::new_err(text),
        },
    }
}

/// The argument that limits memory.
const MEMORY: &str = "`max_memory`";

/// Whether an error is that of a limit of bytes, which follows from `max_memory`.
fn is_of_memory(error: &Error) -> bool {
    matches!(error, Error::Limit(exceeded) if exceeded.unit == "bytes" && exceeded.limit.is_some())
}

/// A hint that names the argument, too.
fn with_memory(hint: &str) -> String {
    let larger = format!("a larger {MEMORY}");
    if hint.is_empty() { format!("draw with {larger}") } else { format!("{hint}, or {larger}") }
}

/// An argument that is wrong.
pub(crate) fn refused(argument: &str, expected: &str, found: &str) -> PyErr {
    InputError::new_err(format!("{argument}: expected {expected}, found {found}"))
}
