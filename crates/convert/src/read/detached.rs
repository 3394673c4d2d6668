//! The data file that a header names, in the header's folder or below.

use super::ReadParams;
use super::input::Stream;
use crate::error::{Place, ReadError, escaped};
use std::path::{Component, Path};

/// The content of the data file of this name, which stands at `place` of the file `header`.
pub(super) fn open(
    name: &str,
    place: Place,
    header: Option<&Path>,
    params: &ReadParams,
) -> Result<Stream<'static>, ReadError> {
    let shown = format!("'{}'", escaped(name.as_bytes(), 60));
    let refused = |expected: &str| {
        let hint = "put the data beside the header and name it without folders";
        Err(ReadError::input(place, expected, shown.clone(), hint))
    };
    if name.contains("://") || name.contains('%') || name.starts_with("LIST") {
        return refused("one data file in the header's folder");
    }
    let within = |c: Component<'_>| matches!(c, Component::Normal(_) | Component::CurDir);
    if !Path::new(name).components().all(within) {
        return refused("a data file in the header's folder or below");
    }
    let Some(header) = header else {
        return refused("a header and its data in one file, as it was read from memory");
    };
    let folder = header.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let path = folder.join(name);
    // Links are followed before they are judged.
    if let (Ok(data), Ok(root)) = (path.canonicalize(), folder.canonicalize()) {
        if !data.starts_with(&root) {
            return refused("a data file in the header's folder or below, links followed");
        }
        if header.canonicalize().is_ok_and(|h| h == data) {
            return refused("a data file that is not the header itself");
        }
    }
    Stream::open(&path, params).map_err(|e| of(name, e))
}

/// An error of the data file, which is told of its header.
pub(super) fn of(name: &str, error: ReadError) -> ReadError {
    let expected = format!("the data file '{}': {}", escaped(name.as_bytes(), 60), error.expected);
    ReadError { expected, ..error }
}
