//! PLY: ascii and both binary byte orders → a mesh where there are faces, else raw points.
//!
//! The parser is our own: places down to line and column or byte, line ends of every system, duplicate properties and
//! sizes checked against the file before allocation are asked of it. Properties it has no use for are read over.

mod ascii;
mod binary;
mod body;
mod columns;
mod header;

use super::{Loaded, ReadLimits};
use crate::error::ReadError;
use ascii::Ascii;
use binary::Binary;
use header::Encoding;

/// Reads a PLY file.
pub(super) fn read(content: &[u8], limits: &ReadLimits) -> Result<Loaded, ReadError> {
    let header = header::parse(content)?;
    match header.encoding {
        Encoding::Ascii => body::read(Ascii::new(content, header.body, header.body_line), &header, limits),
        Encoding::LittleEndian => body::read(Binary::<false>::new(content, header.body), &header, limits),
        Encoding::BigEndian => body::read(Binary::<true>::new(content, header.body), &header, limits),
    }
}
