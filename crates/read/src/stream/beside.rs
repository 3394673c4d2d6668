//! Files that a file names: they are opened only where they lie in its folder or below, links followed.

use super::input::Stream;
use crate::ReadParams;
use crate::error::{Place, ReadError};
use splat_core::text::escaped;
use std::path::{Component, Path, PathBuf};

/// Where a file lies that names others.
pub(crate) struct Beside<'a> {
    /// `None` for a file that was read from memory.
    file: Option<&'a Path>,
}

impl<'a> Beside<'a> {
    pub(crate) fn new(file: Option<&'a Path>) -> Self {
        Self { file }
    }

    /// The content of the file of this name; `what` says what it is for.
    pub(crate) fn open(&self, name: &str, what: &str, params: &ReadParams) -> Result<Stream<'static>, ReadError> {
        let shown = || format!("'{}'", escaped(name.as_bytes(), 60));
        let path = self.find(name).map_err(|expected| {
            let hint = "put the file into the same folder and name it without others";
            ReadError::input(Place::File, format!("{what}: {expected}"), shown(), hint)
        })?;
        Stream::open(&path, params).map_err(|e| {
            let expected = format!("{what} {}: {}", shown(), e.expected);
            ReadError { expected, ..e }
        })
    }

    /// The file of this name as the system knows it, whichever way it is named; `None` for one that is not there.
    pub(crate) fn real(&self, name: &str) -> Option<PathBuf> {
        self.find(name).ok()?.canonicalize().ok()
    }

    /// Where the file of this name is, or what was expected in its place.
    pub(crate) fn find(&self, name: &str) -> Result<PathBuf, &'static str> {
        let within = |c: Component<'_>| matches!(c, Component::Normal(_) | Component::CurDir);
        if name.contains("://") || !Path::new(name).components().all(within) {
            return Err("a file in the same folder or below");
        }
        let file = self.file.ok_or("all of it in one file, as it was read from memory")?;
        let folder = file.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let path = folder.join(name);
        // Links are followed before they are judged.
        match (path.canonicalize(), folder.canonicalize()) {
            (Ok(data), Ok(root)) if !data.starts_with(&root) => {
                Err("a file in the same folder or below, links followed")
            }
            _ => Ok(path),
        }
    }
}

/// The path that a relative uri stands for: %20 is a blank.
pub(crate) fn from_uri(uri: &str) -> String {
    let bytes = uri.as_bytes();
    let digit = |at: usize| bytes.get(at).and_then(|b| char::from(*b).to_digit(16));
    let mut out = Vec::with_capacity(bytes.len());
    let mut at = 0;
    while at < bytes.len() {
        match (bytes[at], digit(at + 1), digit(at + 2)) {
            (b'%', Some(high), Some(low)) => {
                out.push((16 * high + low) as u8);
                at += 3;
            }
            (byte, ..) => {
                out.push(byte);
                at += 1;
            }
        }
    }
    String::from_utf8_lossy(&out).into_owned()
}
