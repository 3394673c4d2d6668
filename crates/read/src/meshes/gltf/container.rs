//! The parts of a file: a GLB is a header of 12 bytes and chunks, the first of them JSON; a `.gltf` is JSON alone.

use super::document::Document;
use crate::ReadParams;
use crate::error::{Place, ReadError};
use crate::stream::input;

const HINT: &str = "the file is truncated or damaged; fetch it again";
const HEADER: usize = 12;
/// Length and type of a chunk before its content.
const CHUNK: usize = 8;
const JSON: &[u8; 4] = b"JSON";
const BINARY: &[u8; 4] = b"BIN\0";
/// Most bytes that an object of the JSON takes as a value of [`Document`].
const BYTES_PER_OBJECT: u64 = 512;
/// Bytes that a character of it takes at most: a digit and a comma are a number of 8 bytes in a list with room for as many again.
const BYTES_PER_CHARACTER: u64 = 8;

/// The description, and the bytes that come with it.
pub(super) fn open<'a>(content: &'a [u8], params: &ReadParams) -> Result<(Document, Option<&'a [u8]>), ReadError> {
    if !content.starts_with(b"glTF") {
        return Ok((document(content, 0, params)?, None));
    }
    let number = |at: usize| content.get(at..)?.first_chunk().map(|b| u32::from_le_bytes(*b));
    match number(4) {
        Some(2) => {}
        Some(1) => return Err(damaged(4, "version 2", "version 1", "convert the file to glTF 2.0")),
        _ => return Err(damaged(4, "version 2", "another version", HINT)),
    }
    let length = content.len();
    if number(8).map(u64::from) != Some(length as u64) {
        let found = number(8).map_or("nothing".to_owned(), |n| n.to_string());
        return Err(damaged(8, &format!("{length}, the length of the file"), &found, HINT));
    }
    let mut at = HEADER;
    let mut json = None;
    let mut binary = None;
    while at < length {
        let (kind, body) = chunk(content, at)?;
        match kind {
            JSON if at == HEADER => json = Some((at + CHUNK, body)),
            BINARY if binary.is_none() && json.is_some() => binary = Some(body),
            _ if json.is_none() => return Err(damaged(at, "a chunk of JSON first", "another one", HINT)),
            // Chunks of other types are to be ignored.
            _ => {}
        }
        at += CHUNK + body.len();
    }
    let (at, json) = json.ok_or_else(|| damaged(HEADER, "a chunk of JSON", "none", HINT))?;
    Ok((document(json, at, params)?, binary))
}

fn damaged(byte: usize, expected: &str, found: &str, hint: &'static str) -> ReadError {
    ReadError::input(Place::Byte(byte as u64), expected, found, hint)
}

/// Type and content of the chunk at that byte.
fn chunk(content: &[u8], at: usize) -> Result<(&[u8; 4], &[u8]), ReadError> {
    let rest = &content[at..];
    let (Some(size), Some(kind)) = (rest.first_chunk::<4>(), rest.get(4..).and_then(<[u8]>::first_chunk::<4>)) else {
        return Err(damaged(at, "length and type of a chunk", &format!("{} bytes", rest.len()), HINT));
    };
    let size = u32::from_le_bytes(*size);
    let body = rest[CHUNK..].get(..size as usize);
    let body = body.ok_or_else(|| {
        let found = format!("{} bytes left", rest.len() - CHUNK);
        damaged(at, &format!("a chunk of {size} bytes"), &found, HINT)
    })?;
    Ok((kind, body))
}

/// Parses the JSON that begins at byte `start` of the file, 0 where it is all of it.
fn document(json: &[u8], start: usize, params: &ReadParams) -> Result<Document, ReadError> {
    let objects = json.iter().filter(|b| **b == b'{').count() as u64;
    let bytes = objects.saturating_mul(BYTES_PER_OBJECT).saturating_add(json.len() as u64 * BYTES_PER_CHARACTER);
    input::hold("the description", bytes, params)?;
    let text = json.strip_prefix(b"\xef\xbb\xbf").unwrap_or(json);
    let document: Document = serde_json::from_slice(text).map_err(|e| {
        let line = e.line();
        let column = e.column();
        let place = if start == 0 {
            Place::Line { line: line as u64, column: column as u64 }
        } else {
            let before: usize =
                text.split_inclusive(|b| *b == b'\n').take(line.saturating_sub(1)).map(<[u8]>::len).sum();
            Place::Byte((start + before + column.saturating_sub(1)) as u64)
        };
        let words = e.to_string();
        let found = words.rsplit_once(" at line ").map_or(words.as_str(), |(what, _)| what);
        ReadError::input(place, "JSON as glTF 2.0 has it", found, HINT)
    })?;
    let version = document.asset.min_version.as_ref().unwrap_or(&document.asset.version);
    if version.split('.').next() != Some("2") {
        let found =
            if version.is_empty() { "none".to_owned() } else { splat_core::text::escaped(version.as_bytes(), 20) };
        return Err(ReadError::input(Place::File, "an asset of version 2", found, "convert the file to glTF 2.0"));
    }
    Ok(document)
}
