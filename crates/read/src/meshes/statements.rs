//! Which statements of an OBJ file have no meaning here.

use super::obj::READ_OVER;

/// Names of the statements that are read over in `content`, in the order of [`READ_OVER`].
pub(crate) fn unused(content: &[u8]) -> impl Iterator<Item = &'static [u8]> {
    let mut found = [false; READ_OVER.len()];
    for line in content.split(|b| matches!(b, b'\n' | b'\r')) {
        let line = line.trim_ascii_start();
        let end = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
        // Nearly all lines begin with one of these.
        if matches!(line[..end], [] | [b'v'] | [b'f'] | [b'v', b'n']) {
            continue;
        }
        if let Some(i) = READ_OVER.iter().position(|name| *name == &line[..end]) {
            found[i] = true;
        }
    }
    READ_OVER.into_iter().zip(found).filter(|(_, found)| *found).map(|(name, _)| name)
}
