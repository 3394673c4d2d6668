//! LAZ chunks → LAS records.
//!
//! The chunk table is read and checked first: chunks must fill exactly the bytes between their start and the table, and
//! their points must add up to the header's count, so nothing is allocated that the file does not stand for. Each chunk
//! is then decoded from its own bytes.

use super::las::Layout;
use super::{ReadLimits, input};
use crate::error::{Place, ReadError};
use ::laz::laszip::{ChunkTable, ChunkTableEntry};
use ::laz::{LasZipDecompressor, LazItem, LazItemRecordBuilder, LazItemType, LazVlr, LazVlrBuilder};
use rayon::prelude::*;
use std::cell::Cell;
use std::io::Cursor;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Most decompressed bytes per compressed byte, past the first [`FREE`] bytes.
const MAX_RATIO: u64 = 1000;
const FREE: u64 = 16 << 20;
const RECORD_HEADER: usize = 54;
const HINT: &str = "the file is truncated or damaged; fetch it again";

/// All point records, uncompressed.
pub(super) fn decompress(content: &[u8], layout: &Layout, limits: &ReadLimits) -> Result<Vec<u8>, ReadError> {
    let vlr = laszip_record(content, layout)?;
    if layout.count == 0 {
        return Ok(Vec::new());
    }
    let items = checked_items(&vlr, layout)?;
    let (chunks, data) = chunks(content, layout, &vlr)?;
    let total = layout.count.saturating_mul(layout.record);
    input::check_bytes("the decompressed points", total, limits)?;
    if total > FREE && total / MAX_RATIO > data.len() as u64 {
        return Err(ReadError::limit(
            format!("at most {MAX_RATIO} decompressed bytes for each byte of LAZ"),
            format!("{total} from {}", data.len()),
            "decompress the file yourself if it is to be trusted",
        ));
    }
    let mut tasks = Vec::with_capacity(chunks.len());
    let mut start = 0;
    for chunk in &chunks {
        // Cannot leave `data`: the chunks add up to its length.
        let bytes = &data[start..start + chunk.byte_count as usize];
        tasks.push((layout.points + 8 + start, bytes, chunk.point_count));
        start += bytes.len();
    }
    let parts: Vec<Vec<u8>> = tasks
        .into_par_iter()
        .map(|(at, bytes, points)| chunk(at, bytes, points, &items, layout))
        .collect::<Result<_, _>>()?;
    let mut records = Vec::new();
    input::reserve(&mut records, total as usize)?;
    parts.into_iter().for_each(|part| records.extend(part));
    Ok(records)
}

fn damaged(byte: usize, expected: &str, found: impl Into<String>) -> ReadError {
    ReadError::input(Place::Byte(byte as u64), expected, found, HINT)
}

/// The record that describes the compression, among the variable-length records before the points.
fn laszip_record(content: &[u8], layout: &Layout) -> Result<LazVlr, ReadError> {
    let (mut at, count) = layout.records;
    for _ in 0..count {
        let (Some(head), true) = (content.get(at..at + RECORD_HEADER), at + RECORD_HEADER <= layout.points) else {
            break;
        };
        let length = usize::from(u16::from_le_bytes([head[20], head[21]]));
        let data = at + RECORD_HEADER..at + RECORD_HEADER + length;
        if data.end > layout.points {
            break;
        }
        let user = head[2..18].split(|b| *b == 0).next().unwrap_or_default();
        if user == LazVlr::USER_ID.as_bytes() && u16::from_le_bytes([head[18], head[19]]) == LazVlr::RECORD_ID {
            return LazVlr::from_buffer(&content[data]).map_err(|e| damaged(at, "a LASzip record", e.to_string()));
        }
        at = data.end;
    }
    Err(damaged(at, "a LASzip record before the points of a compressed file", "none"))
}

/// The compressed fields, refused unless they are those of the point format: the decoder trusts their sizes.
fn checked_items(vlr: &LazVlr, layout: &Layout) -> Result<Vec<LazItem>, ReadError> {
    let items = vlr.items();
    let layered = layout.format_id >= 6;
    let expected = LazItemRecordBuilder::default_for_point_format_id(layout.format_id, layout.format.extra_bytes)
        .map_err(|e| damaged(layout.points, "a point format that LAZ knows", e.to_string()))?;
    let alike = items.len() == expected.len()
        && items.iter().zip(&expected).all(|(a, b)| a.item_type() == b.item_type() && a.size() == b.size());
    let versions = if layered { [3, 4] } else { [1, 2] };
    let one_version = items.iter().all(|i| versions.contains(&i.version()));
    let size: u64 = items.iter().map(|i| u64::from(i.size())).sum();
    if alike && one_version && size == layout.record {
        return Ok(items.clone());
    }
    let found = format!("{items:?} for records of {} bytes", layout.record);
    Err(damaged(layout.points, &format!("the LASzip items of point format {}", layout.format_id), found))
}

/// The checked chunk table, and the bytes of all chunks.
fn chunks<'a>(content: &'a [u8], layout: &Layout, vlr: &LazVlr) -> Result<(Vec<ChunkTableEntry>, &'a [u8]), ReadError> {
    let start = layout.points + 8;
    let table = table_start(content, layout)?;
    let data = &content[start..table];
    let announced = content.get(table + 4..table + 8).and_then(|b| b.try_into().ok()).map_or(0, u32::from_le_bytes);
    // Each chunk begins with one uncompressed record.
    let most = data.len() as u64 / layout.record;
    if announced == 0 || u64::from(announced) > most {
        let expected = format!("1 to {most} chunks in {} bytes", data.len());
        return Err(damaged(table + 4, &expected, announced.to_string()));
    }
    let variable = vlr.uses_variable_size_chunks();
    let entries =
        guarded(|| ChunkTable::read(&mut Cursor::new(&content[table..]), variable).map_err(|e| e.to_string()))
            .map_err(|e| damaged(table, "a chunk table", e))?;
    let mut entries = entries.as_ref().to_vec();
    if !variable {
        let size = u64::from(vlr.chunk_size());
        let before_last = size.saturating_mul(u64::from(announced) - 1);
        for entry in &mut entries {
            entry.point_count = size;
        }
        if let Some(last) = entries.last_mut() {
            last.point_count = layout.count.checked_sub(before_last).filter(|n| *n <= size).unwrap_or(0);
        }
    }
    let bytes = entries.iter().try_fold(0u64, |n, e| n.checked_add(e.byte_count));
    let points = entries.iter().try_fold(0u64, |n, e| n.checked_add(e.point_count));
    let filled = entries.iter().all(|e| e.byte_count >= layout.record && e.point_count > 0);
    if filled && bytes == Some(data.len() as u64) && points == Some(layout.count) {
        return Ok((entries, data));
    }
    let expected = format!("chunks of {} points in {} bytes", layout.count, data.len());
    Err(damaged(table, &expected, format!("{points:?} points in {bytes:?} bytes, none of them empty: {filled}")))
}

/// Byte offset of the chunk table: before the points, or in the last 8 bytes if the writer could not seek.
fn table_start(content: &[u8], layout: &Layout) -> Result<usize, ReadError> {
    let offset_at = |at: usize| {
        let bytes = content.get(at..at + 8)?.try_into().ok()?;
        usize::try_from(i64::from_le_bytes(bytes)).ok().filter(|t| (layout.points + 8..content.len()).contains(t))
    };
    let streamed = content.get(layout.points..layout.points + 8) == Some(&(-1i64).to_le_bytes());
    let found = if streamed { offset_at(content.len().saturating_sub(8)) } else { offset_at(layout.points) };
    found.ok_or_else(|| damaged(layout.points, "the offset of a chunk table behind the points", "one outside the file"))
}

/// Decodes one chunk of `points` records.
fn chunk(at: usize, bytes: &[u8], points: u64, items: &[LazItem], layout: &Layout) -> Result<Vec<u8>, ReadError> {
    if layout.format_id >= 6 {
        check_layers(at, bytes, points, items, layout)?;
    }
    // The decoder wants the offset of a chunk table and looks for the table there: an empty one follows the chunk.
    let mut source = Vec::new();
    input::reserve(&mut source, bytes.len() + 16)?;
    source.extend_from_slice(&(bytes.len() as i64 + 8).to_le_bytes());
    source.extend_from_slice(bytes);
    source.extend_from_slice(&[0; 8]);
    let size = u32::try_from(points).map_err(|_| damaged(at, "a chunk of fewer points", points.to_string()))?;
    let length = points.checked_mul(layout.record).and_then(|n| usize::try_from(n).ok()).unwrap_or(usize::MAX);
    let mut records = Vec::new();
    input::reserve(&mut records, length)?;
    records.resize(length, 0);
    let vlr = LazVlrBuilder::new(items.to_vec()).with_fixed_chunk_size(size).build();
    guarded(|| {
        let mut decoder = LasZipDecompressor::new(Cursor::new(source), vlr).map_err(|e| e.to_string())?;
        decoder.decompress_many(&mut records).map_err(|e| e.to_string())?;
        // The coder writes exactly as many bytes as the decoder reads: anything else is damage, which no checksum tells.
        let (used, stored) = (decoder.get().position(), bytes.len() as u64 + 8);
        if used == stored { Ok(()) } else { Err(format!("{used} bytes used of {stored}")) }
    })
    .map_err(|e| damaged(at, &format!("a chunk of {points} points"), e))?;
    Ok(records)
}

/// Checks the sizes of a layered chunk: one raw record, the point count, a size for each layer, then the layers.
fn check_layers(at: usize, bytes: &[u8], points: u64, items: &[LazItem], layout: &Layout) -> Result<(), ReadError> {
    let layers: usize = items
        .iter()
        .map(|item| match item.item_type() {
            LazItemType::Point14 => 9,
            LazItemType::RGBNIR14 => 2,
            LazItemType::Byte14(n) => usize::from(n),
            _ => 1,
        })
        .sum();
    let head = layout.record as usize;
    let word = |i: usize| {
        bytes
            .get(head + 4 * i..head + 4 * i + 4)
            .and_then(|b| b.try_into().ok())
            .map(|b| u64::from(u32::from_le_bytes(b)))
    };
    let sizes = (1..=layers).try_fold(0u64, |sum, i| Some(sum + word(i)?));
    let needed = sizes.map(|s| s + (head + 4 * (layers + 1)) as u64);
    if word(0) == Some(points) && needed == Some(bytes.len() as u64) {
        return Ok(());
    }
    let expected = format!("{points} points in layers that fill {} bytes", bytes.len());
    Err(damaged(at, &expected, format!("{:?} points in {needed:?} bytes", word(0))))
}

thread_local! {
    static GUARDED: Cell<bool> = const { Cell::new(false) };
}

/// Whether this thread runs foreign decoding code whose panic becomes a [`ReadError`]; for a panic hook, which would
/// otherwise report a damaged file as a bug.
pub fn panic_is_input_error() -> bool {
    GUARDED.get()
}

/// Runs the decoder and turns a panic into an error.
///
/// Last resort: whether an arithmetic-coded stream is valid shows only while it is decoded, the stream has no checksum,
/// and the decoder indexes tables, divides and adds with what it finds there. Sizes are checked before, so that the
/// decoder cannot exhaust memory; that no unwinding could catch.
fn guarded<T>(work: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    let before = GUARDED.replace(true);
    let result = catch_unwind(AssertUnwindSafe(work));
    GUARDED.set(before);
    result.unwrap_or_else(|_| Err("a damaged compressed stream".to_owned()))
}
