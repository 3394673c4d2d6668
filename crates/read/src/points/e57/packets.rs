//! The packets of a scan: each holds a piece of the bits of every field.

use super::damaged;
use super::document::Scan;
use super::pages::Pages;
use crate::error::ReadError;
use crate::reading::Reading;
use crate::stream::input;

/// Bytes of the header of a section, and of a packet of data.
const SECTION: usize = 32;
const HEAD: usize = 6;
/// Mark of a section of points, and kinds of packets.
const POINTS: u8 = 1;
const INDEX: u8 = 0;
const DATA: u8 = 1;
const IGNORED: u8 = 2;
/// Shortest packet.
const LEAST: usize = 4;

/// The bytes of every field of a scan, which are known to hold all of its points.
pub(super) fn streams(scan: &Scan, pages: &Pages, reading: &Reading<'_>) -> Result<Vec<Vec<u8>>, ReadError> {
    let mut streams = vec![Vec::new(); scan.fields.len()];
    if scan.points == 0 {
        return Ok(streams);
    }
    let bytes = pages.bytes();
    let section = pages.place(scan.section, scan.place)?;
    let at = pages.byte(section);
    let header = bytes.get(section..).and_then(|rest| rest.first_chunk::<SECTION>());
    let header = header.filter(|header| header[0] == POINTS);
    let header = header.ok_or_else(|| damaged(at, "the section of the points of a scan", "something else"))?;
    let number = |i: usize| header[i..i + 8].iter().rev().fold(0, |n, b| n << 8 | u64::from(*b));
    let end = usize::try_from(number(8)).ok().and_then(|length| section.checked_add(length));
    let end = end.filter(|end| *end <= bytes.len());
    let end = end.ok_or_else(|| damaged(at, "a section within the file", format!("one of {} bytes", number(8))))?;
    let mut packet = pages.place(number(16), at)?;
    let mut held = input::Growing::new("the bits of a scan");
    // Every packet brings bytes, and they are taken once: the fields have no more together than the file.
    while lacks(scan, &streams) {
        let head = bytes[..end].get(packet..).and_then(|rest| rest.first_chunk::<HEAD>());
        let head = head.ok_or_else(|| lacking(scan, &streams, pages.byte(packet)))?;
        let length = usize::from(u16::from_le_bytes([head[2], head[3]])) + 1;
        let whole = bytes[..end].get(packet..packet + length).filter(|_| length >= LEAST);
        let whole = whole.ok_or_else(|| {
            damaged(pages.byte(packet), "a packet within its section", format!("one of {length} bytes"))
        })?;
        match head[0] {
            DATA => {
                let before: usize = streams.iter().map(Vec::len).sum();
                held.hold((before + whole.len()) as u64, reading.params)?;
                take(whole, pages.byte(packet), &mut streams)?;
            }
            INDEX | IGNORED => {}
            other => return Err(damaged(pages.byte(packet), "a packet of kind 0, 1 or 2", other.to_string())),
        }
        packet += length;
        reading.go_on()?;
    }
    Ok(streams)
}

/// Bits that a field still lacks.
fn missing(scan: &Scan, streams: &[Vec<u8>]) -> Option<(usize, u128)> {
    let needed = |field: usize| u128::from(scan.fields[field].stored.bits()) * u128::from(scan.points);
    let has = |field: usize| 8 * streams[field].len() as u128;
    (0..streams.len()).find(|f| has(*f) < needed(*f)).map(|f| (f, needed(f) - has(f)))
}

fn lacks(scan: &Scan, streams: &[Vec<u8>]) -> bool {
    missing(scan, streams).is_some()
}

fn lacking(scan: &Scan, streams: &[Vec<u8>], byte: u64) -> ReadError {
    let (field, bits) = missing(scan, streams).unwrap_or_default();
    let name = scan.fields.get(field).map(|f| f.name.as_str()).unwrap_or_default();
    let expected = format!("{} points of the scan, {bits} more bits of {name}", scan.points);
    damaged(byte, expected, "the end of their section")
}

/// Takes the pieces of a packet.
fn take(packet: &[u8], byte: u64, streams: &mut [Vec<u8>]) -> Result<(), ReadError> {
    let count = packet.get(4..HEAD).map_or(0, |n| usize::from(n[0]) | usize::from(n[1]) << 8);
    if count != streams.len() {
        return Err(damaged(byte, format!("a packet of {} fields", streams.len()), count.to_string()));
    }
    let mut at = HEAD + 2 * count;
    for (i, stream) in streams.iter_mut().enumerate() {
        let size = packet.get(HEAD + 2 * i..HEAD + 2 * i + 2).map(|n| usize::from(n[0]) | usize::from(n[1]) << 8);
        let piece = size.and_then(|size| packet.get(at..at + size));
        let piece = piece.ok_or_else(|| damaged(byte, format!("field {i} within its packet"), "a longer one"))?;
        input::reserve(stream, piece.len())?;
        stream.extend_from_slice(piece);
        at += piece.len();
    }
    Ok(())
}
