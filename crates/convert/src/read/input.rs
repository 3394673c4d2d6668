//! Bytes of a regular file, and their gzip-decompressed form, each within the limits.

use super::ReadLimits;
use crate::error::{Place, ReadError};
use flate2::bufread::MultiGzDecoder;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Most bytes asked from the allocator at once.
const STEP: usize = 64 << 20;
/// Most decompressed bytes per compressed byte, past the first [`FREE`] bytes.
const MAX_RATIO: u64 = 1000;
const FREE: u64 = 16 << 20;

/// The whole content of a regular file.
pub(super) fn regular_file(path: &Path, limits: &ReadLimits) -> Result<Vec<u8>, ReadError> {
    let refused = |e: std::io::Error| {
        ReadError::file_system("a file that can be read", e.to_string(), "check the path and its permissions")
    };
    // Asked before opening: opening a FIFO waits for its writer.
    let kind = std::fs::metadata(path).map_err(refused)?;
    if !kind.is_file() {
        let found = if kind.is_dir() { "a directory" } else { "a pipe, socket or device" };
        return Err(ReadError::file_system("a regular file", found, "name a file; copy a stream into one first"));
    }
    let mut source = File::open(path).map_err(refused)?;
    let length = source.metadata().map_err(refused)?.len();
    check_bytes("the file", length, limits)?;
    let mut content = Vec::new();
    // One byte more than announced: a file that grows meanwhile is noticed, and one that never ends is not followed.
    while (content.len() as u64) <= length {
        let step = (length + 1 - content.len() as u64).min(STEP as u64);
        reserve(&mut content, step as usize)?;
        if source.by_ref().take(step).read_to_end(&mut content).map_err(refused)? == 0 {
            break;
        }
    }
    if content.len() as u64 != length {
        return Err(ReadError::input(
            Place::Byte(content.len() as u64),
            format!("{length} bytes, the length before reading"),
            "another length: the file changed while it was read",
            "wait until the file is complete, then try again",
        ));
    }
    Ok(content)
}

/// The decompressed content of a gzip file, of one or several members.
pub(super) fn gunzip(compressed: &[u8], limits: &ReadLimits) -> Result<Vec<u8>, ReadError> {
    let mut source = MultiGzDecoder::new(compressed);
    let mut content = Vec::new();
    let mut block = vec![0u8; 1 << 18];
    loop {
        let got = source.read(&mut block).map_err(|e| {
            ReadError::input(
                Place::Byte((compressed.len() - source.get_ref().len()) as u64),
                "a complete gzip stream",
                e.to_string(),
                "the file is truncated or damaged; fetch it again",
            )
        })?;
        if got == 0 {
            return Ok(content);
        }
        let total = (content.len() + got) as u64;
        check_bytes("the decompressed file", total, limits)?;
        if total > FREE && total / MAX_RATIO > compressed.len() as u64 {
            return Err(ReadError::limit(
                format!("at most {MAX_RATIO} decompressed bytes for each byte of gzip"),
                format!("more than {total} bytes from {}", compressed.len()),
                "decompress the file yourself if it is to be trusted",
            ));
        }
        reserve(&mut content, got)?;
        content.extend_from_slice(&block[..got]);
    }
}

/// Refuses sizes above the limit.
pub(super) fn check_bytes(what: &str, bytes: u64, limits: &ReadLimits) -> Result<(), ReadError> {
    if bytes <= limits.max_bytes {
        return Ok(());
    }
    Err(ReadError::limit(
        format!("at most {} bytes for {what}", limits.max_bytes),
        format!("{bytes}"),
        "raise the memory limit, or thin out the data",
    ))
}

/// Room for `more` elements, or the limit error where the allocator has none.
pub(super) fn reserve<T>(column: &mut Vec<T>, more: usize) -> Result<(), ReadError> {
    column.try_reserve(more).map_err(|_| {
        ReadError::limit(
            format!("memory for {more} more elements of {} bytes", size_of::<T>()),
            "none left",
            "free memory, or thin out the data",
        )
    })
}
