//! A file of text: its bytes, and the text that they are.

use super::tree::error_at;
use crate::Error;
use std::io::Read;
use std::path::Path;

/// Largest scene file, bytes.
pub const MAX_SCENE_BYTES: u64 = 16 << 20;

/// Bytes that a character of a scene takes while it is read, at most: a digit and a comma are a value with its place, in a list with
/// room for as many again.
pub(crate) const BYTES_PER_CHARACTER: u64 = 96;

/// The bytes of a scene file, for [`crate::parse`].
///
/// # Errors
/// [`Error::Io`] for what cannot be read, or is no regular file.
pub fn read(file: &Path) -> Result<Vec<u8>, Error> {
    let fail = |e| Error::io(file, "cannot read the scene", e);
    let meta = std::fs::metadata(file).map_err(fail)?;
    if !meta.is_file() {
        // A pipe or a device could block or never end.
        return Err(fail(std::io::Error::other("not a regular file")));
    }
    let mut bytes = Vec::new();
    let handle = std::fs::File::open(file).map_err(fail)?;
    handle.take(MAX_SCENE_BYTES + 1).read_to_end(&mut bytes).map_err(fail)?;
    Ok(bytes)
}

/// The text of a file's bytes.
pub(crate) fn decode<'a>(file: &Path, bytes: &'a [u8]) -> Result<&'a str, Error> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    std::str::from_utf8(bytes).map_err(|e| {
        let valid = std::str::from_utf8(&bytes[..e.valid_up_to()]).unwrap_or("");
        let found = bytes.get(e.valid_up_to()).copied().unwrap_or(0);
        error_at(file, valid, valid.len(), format!("expected UTF-8, found the byte 0x{found:02x}"), "")
    })
}
