//! Data behind a header or in the file that it names, in the header's folder or below.

use super::beside::Beside;
use super::input::Stream;
use crate::ReadParams;
use crate::error::{Place, ReadError};
use splat_core::text::escaped;
use std::path::Path;

const HINT: &str = "put the data beside the header and name it without folders";

/// Where the data of a header lies.
pub(crate) struct DataOf<'a> {
    /// The file of the header, if it was read from one.
    pub(crate) header: Option<&'a Path>,
    /// Byte behind the header, and how many lines it has.
    pub(crate) end: (usize, u64),
    /// The name of the data file and where it stands, if the data does not follow the header.
    pub(crate) file: Option<&'a (String, Place)>,
}

impl DataOf<'_> {
    /// What `read` makes of the data; it is told after how many lines of its file that begins.
    pub(crate) fn read<T>(
        &self,
        mut stream: Stream<'_>,
        params: &ReadParams,
        read: impl FnOnce(Stream<'_>, u64) -> Result<T, ReadError>,
    ) -> Result<T, ReadError> {
        let Some((name, place)) = self.file else {
            stream.skip(self.end.0 as u64)?;
            return read(stream, self.end.1);
        };
        let data = open(name, *place, self.header, params)?;
        read(data, 0).map_err(|e| naming_data_file(name, e))
    }
}

/// The content of the data file of this name, which stands at `place` of the file `header`.
fn open(name: &str, place: Place, header: Option<&Path>, params: &ReadParams) -> Result<Stream<'static>, ReadError> {
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
    Stream::open(&path, params).map_err(|e| naming_data_file(name, e))
}

/// An error of the data file, which is told of its header.
fn naming_data_file(name: &str, error: ReadError) -> ReadError {
    let expected = format!("the data file '{}': {}", escaped(name.as_bytes(), 60), error.expected);
    ReadError { expected, ..error }
}
