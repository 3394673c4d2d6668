//! The data file that a header names, in the header's folder or below.

use super::ReadParams;
use super::beside::Beside;
use super::input::Stream;
use crate::error::{Place, ReadError, escaped};
use std::path::Path;

const HINT: &str = "put the data beside the header and name it without folders";

/// The content of the data file of this name, which stands at `place` of the file `header`.
pub(super) fn open(
    name: &str,
    place: Place,
    header: Option<&Path>,
    params: &ReadParams,
) -> Result<Stream<'static>, ReadError> {
    let refused =
        |expected: &str| Err(ReadError::input(place, expected, format!("'{}'", escaped(name.as_bytes(), 60)), HINT));
    if name.contains('%') || name.starts_with("LIST") {
        return refused("one data file in the header's folder");
    }
    let path = match Beside::new(header).find(name) {
        Ok(path) => path,
        Err(expected) => return refused(&format!("the data: {expected}")),
    };
    if header.and_then(|header| header.canonicalize().ok()).is_some_and(|h| path.canonicalize().is_ok_and(|p| p == h)) {
        return refused("a data file that is not the header itself");
    }
    Stream::open(&path, params).map_err(|e| of(name, e))
}

/// An error of the data file, which is told of its header.
pub(super) fn of(name: &str, error: ReadError) -> ReadError {
    let expected = format!("the data file '{}': {}", escaped(name.as_bytes(), 60), error.expected);
    ReadError { expected, ..error }
}
