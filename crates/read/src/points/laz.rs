//! LAZ chunks → LAS records.
//!
//! The chunk table is read and checked first: chunks must fill exactly the bytes between their start and the table, and
//! their points must add up to the header's count, so nothing is allocated that the file does not stand for. Each chunk
//! is then decoded from its own bytes. Files of the oldest kind have no chunks: their points are one stream.

mod gps_time;

use super::las::{self, Layout, VariableRecord};
use crate::ReadParams;
use crate::error::{Place, ReadError};
use crate::guarded::guarded;
use crate::stream::input;
use ::laz::laszip::{ChunkTable, ChunkTableEntry};
use ::laz::record::{LayeredPointRecordDecompressor, RecordDecompressor, SequentialPointRecordDecompressor};
use ::laz::{DecompressionSelection, LazItem, LazItemRecordBuilder, LazItemType, LazVlr};
use gps_time::GpsTimes;
use rayon::prelude::*;
use std::io::Cursor;

/// Most decompressed bytes per compressed byte, past the first [`FREE`] bytes.
const MAX_RATIO: u64 = 1000;
const FREE: u64 = 16 << 20;
/// Compressors of the LASzip record: one stream of records, the same in chunks, chunks of one stream a field.
const POINTWISE: u16 = 1;
const POINTWISE_CHUNKED: u16 = 2;
const LAYERED: u16 = 3;
/// Chunks decoded at once, 50,000 records each in most files.
const WAVE: usize = 16;
const HINT: &str = "the file is truncated or damaged; fetch it again";

/// Decodes all point records, of those whose fields have streams of their own what is selected, and hands them to `take`, in order and in parts, so that not all of them are in memory.
pub(crate) fn decompress(
    content: &[u8],
    layout: &Layout,
    params: &ReadParams,
    selection: DecompressionSelection,
    mut take: impl FnMut(Vec<u8>) -> Result<(), ReadError>,
) -> Result<(), ReadError> {
    let (compressor, vlr) = laszip_record(content, layout)?;
    if layout.count == 0 {
        return Ok(());
    }
    let items = checked_items(&vlr, layout)?;
    let chunks = match compressor {
        POINTWISE if layout.format_id < 6 => vec![whole(content, layout)?],
        POINTWISE_CHUNKED if layout.format_id < 6 => chunks(content, layout, &vlr)?,
        LAYERED if layout.format_id >= 6 => chunks(content, layout, &vlr)?,
        _ => {
            let expected = format!("a compressor of point format {}", layout.format_id);
            return Err(damaged(layout.points, &expected, format!("compressor {compressor}")));
        }
    };
    let chunks = of_levels(chunks, layout)?;
    let total = layout.read().saturating_mul(layout.record);
    let stored = chunks.iter().map(|c| c.bytes.len() as u64).sum::<u64>();
    if total > FREE && total / MAX_RATIO > stored {
        return Err(ReadError::limit(
            format!("at most {MAX_RATIO} decompressed bytes for each byte of LAZ"),
            format!("{total} from {stored}"),
            "decompress the file yourself if it is to be trusted",
        ));
    }
    for wave in chunks.chunks(WAVE) {
        let bytes = wave.iter().fold(0u64, |n, c| n.saturating_add(c.points.saturating_mul(layout.record)));
        input::hold("the decompressed points", bytes, params)?;
        let parts: Result<Vec<Vec<u8>>, ReadError> =
            wave.par_iter().map(|c| c.decode(&items, layout, selection)).collect();
        parts?.into_iter().try_for_each(&mut take)?;
    }
    Ok(())
}

/// The chunks of the levels of detail that are read.
fn of_levels<'a>(mut chunks: Vec<Chunk<'a>>, layout: &Layout) -> Result<Vec<Chunk<'a>>, ReadError> {
    let Some(levels) = &layout.levels else { return Ok(chunks) };
    chunks.retain(|chunk| levels.have(chunk.at));
    let points = chunks.iter().map(|chunk| chunk.points).sum::<u64>();
    if points == levels.points {
        return Ok(chunks);
    }
    let expected = format!("chunks of {} points where the hierarchy of COPC says", levels.points);
    Err(damaged(layout.points, &expected, points.to_string()))
}

/// What is decoded on its own.
struct Chunk<'a> {
    /// Byte offset in the file.
    at: usize,
    bytes: &'a [u8],
    points: u64,
    /// Whether other things may follow the points in `bytes`.
    open: bool,
}

fn damaged(byte: usize, expected: &str, found: impl Into<String>) -> ReadError {
    ReadError::input(Place::Byte(byte as u64), expected, found, HINT)
}

/// The record that describes the compression, among the variable-length records before the points, with its compressor.
fn laszip_record(content: &[u8], layout: &Layout) -> Result<(u16, LazVlr), ReadError> {
    let mut records = las::variable_records(content, layout);
    let found = records.find(|r| r.user == LazVlr::USER_ID.as_bytes() && r.id == LazVlr::RECORD_ID);
    let Some(VariableRecord { at, data, .. }) = found else {
        return Err(damaged(layout.records.0, "a LASzip record before the points of a compressed file", "none"));
    };
    let vlr = LazVlr::from_buffer(data).map_err(|e| damaged(at, "a LASzip record", e.to_string()))?;
    Ok((data.first_chunk().map_or(0, |b| u16::from_le_bytes(*b)), vlr))
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

/// All points as one stream without a table; what may follow them does not say where it begins in every version.
fn whole<'a>(content: &'a [u8], layout: &Layout) -> Result<Chunk<'a>, ReadError> {
    let end = las::first_byte_after_points(content, layout.points);
    let bytes = &content[layout.points..end];
    if (bytes.len() as u64) < layout.record {
        let expected = format!("a record of {} bytes", layout.record);
        return Err(damaged(layout.points, &expected, format!("{} bytes", bytes.len())));
    }
    Ok(Chunk { at: layout.points, bytes, points: layout.count, open: end < content.len() })
}

/// The chunks of the checked chunk table.
fn chunks<'a>(content: &'a [u8], layout: &Layout, vlr: &LazVlr) -> Result<Vec<Chunk<'a>>, ReadError> {
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
        let mut from = 0;
        let chunk = |entry: ChunkTableEntry| {
            // Cannot leave `data`: the chunks add up to its length.
            let bytes = &data[from..from + entry.byte_count as usize];
            let at = start + from;
            from += bytes.len();
            Chunk { at, bytes, points: entry.point_count, open: false }
        };
        return Ok(entries.into_iter().map(chunk).collect());
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

impl Chunk<'_> {
    /// Its records.
    fn decode(
        &self,
        items: &[LazItem],
        layout: &Layout,
        selection: DecompressionSelection,
    ) -> Result<Vec<u8>, ReadError> {
        let Self { at, bytes, points, open } = *self;
        let layered = layout.format_id >= 6;
        if layered {
            check_layers(at, bytes, points, items, layout)?;
        }
        let length = points.checked_mul(layout.record).and_then(|n| usize::try_from(n).ok()).unwrap_or(usize::MAX);
        let mut records = Vec::new();
        input::reserve(&mut records, length)?;
        records.resize(length, 0);
        let source = Cursor::new(bytes);
        let used = guarded(|| {
            if layered {
                by_layers(source, items, selection, &mut records)
            } else {
                by_points(source, items, &mut records)
            }
        });
        // The coder writes exactly as many bytes as the decoder reads: anything else is damage, which no checksum tells.
        let whole = used.and_then(|used| {
            let stored = bytes.len() as u64;
            if used == stored || open && used < stored { Ok(()) } else { Err(format!("{used} bytes used of {stored}")) }
        });
        whole.map_err(|e| damaged(at, &format!("a chunk of {points} points"), e))?;
        Ok(records)
    }
}

/// Decodes records whose fields share one stream; gives the bytes used.
fn by_points(source: Cursor<&[u8]>, items: &[LazItem], records: &mut [u8]) -> Result<u64, String> {
    let mut decoder = SequentialPointRecordDecompressor::new(source);
    for item in items {
        if item.item_type() == LazItemType::GpsTime && item.version() == 2 {
            decoder.add_field_decompressor(GpsTimes::new());
        } else {
            decoder.set_fields_from(&vec![*item]).map_err(|e| e.to_string())?;
        }
    }
    decoder.decompress_many(records).map_err(|e| e.to_string())?;
    Ok(decoder.get().position())
}

/// Decodes records whose fields have streams of their own, of which only those are decoded that are selected; gives the
/// bytes used.
fn by_layers(
    source: Cursor<&[u8]>,
    items: &[LazItem],
    selection: DecompressionSelection,
    records: &mut [u8],
) -> Result<u64, String> {
    let mut decoder = LayeredPointRecordDecompressor::new(source);
    decoder.set_fields_from(&items.to_vec()).map_err(|e| e.to_string())?;
    decoder.set_selection(selection);
    decoder.decompress_many(records).map_err(|e| e.to_string())?;
    Ok(decoder.get().position())
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
