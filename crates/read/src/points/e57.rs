//! E57 (ASTM E2807) → raw points of all scans of a file, each moved to its pose.
//!
//! Kept are cartesian or spherical places, normals, colours, intensity as value, and by name the other numbers of a point. The parser is
//! our own: pages are checked against their sums, and counts against the bits that the file has for them, before anything is
//! allocated. Pictures are named.

mod bits;
mod columns;
mod document;
mod packets;
mod pages;

use crate::error::{Place, ReadError};
use crate::reading::Reading;
use crate::stream::input::Content;
use columns::Columns;
use document::Document;
use pages::Pages;
use splat_core::RawPoints;
use splat_core::text::counted;

const HINT: &str = "the file is truncated or damaged; fetch it again";

/// Reads an E57 file.
pub(crate) fn read(content: Content, reading: &mut Reading<'_>) -> Result<RawPoints, ReadError> {
    let pages = Pages::new(content, reading)?;
    let document = Document::parse(&pages)?;
    if document.images > 0 {
        reading.notes.not_used([format!("{} (images2D)", counted(document.images as u64, "picture")).as_bytes()]);
    }
    let mut columns = Columns::new(&document.scans, reading)?;
    for scan in &document.scans {
        let streams = packets::streams(scan, &pages, reading)?;
        columns.take(scan, &streams, reading)?;
    }
    columns.into_points(reading)
}

fn damaged(byte: u64, expected: impl Into<String>, found: impl Into<String>) -> ReadError {
    ReadError::input(Place::Byte(byte), expected, found, HINT)
}
