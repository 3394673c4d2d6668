//! Bytes of a regular file from front to back, unpacked from gzip where they are packed, each within the limits.

use super::unpacked::Unpacked;
use crate::ReadParams;
use crate::error::{Place, ReadError};
use splat_core::{Exceeded, Reservation};
use std::fs::File;
use std::io::{self, Read};
use std::ops::{Deref, Range};
use std::path::Path;

/// Most bytes asked from the allocator at once.
const STEP: usize = 64 << 20;
/// Most decompressed bytes per compressed byte, past the first [`FREE`] bytes.
const MAX_RATIO: u64 = 1000;
const FREE: u64 = 16 << 20;
/// Most bytes that deflate, the packing of PNG and of ZIP in OpenEXR, makes of one.
const MAX_DEFLATED: u64 = 1032;
/// Longest header in text; real ones have some hundred bytes.
const MAX_HEADER: usize = 16 << 20;

/// Bytes in the order of the file. What was looked at by [`Stream::peek`] is given once more.
pub(crate) struct Stream<'a> {
    source: Box<dyn Read + 'a>,
    head: Vec<u8>,
    /// Bytes of `head` that were taken.
    taken: usize,
    /// Bytes taken in all.
    position: u64,
    /// Bytes in all, unless they are packed.
    length: Option<u64>,
    /// Bytes of the file itself, packed or not.
    stored: u64,
    params: ReadParams,
}

impl<'a> Stream<'a> {
    /// A regular file.
    pub(crate) fn open(path: &Path, params: &ReadParams) -> Result<Self, ReadError> {
        let refused = |e: io::Error| refused(&e);
        // Asked before opening: opening a FIFO waits for its writer.
        let kind = std::fs::metadata(path).map_err(refused)?;
        if !kind.is_file() {
            if kind.is_dir() {
                return Err(crate::format::unread::folder(path));
            }
            let hint = "copy what comes of it into a file first";
            return Err(ReadError::file_system("a regular file", "a pipe, socket or device", hint));
        }
        let file = File::open(path).map_err(refused)?;
        let length = file.metadata().map_err(refused)?.len();
        check_bytes("the file", length, params)?;
        Ok(Self::new(Measured { file, length, read: 0 }, Some(length), length, params))
    }

    /// Bytes in memory.
    pub(crate) fn in_memory(content: &'a [u8], params: &ReadParams) -> Self {
        let length = content.len() as u64;
        Self::new(content, Some(length), length, params)
    }

    /// A part of a file in memory, whose places are those of the file.
    pub(crate) fn of_part(content: &'a [u8], part: Range<usize>, params: &ReadParams) -> Self {
        let length = content.len() as u64;
        Self { position: part.start as u64, ..Self::new(&content[part.clone()], Some(part.end as u64), length, params) }
    }

    fn new(source: impl Read + 'a, length: Option<u64>, stored: u64, params: &ReadParams) -> Self {
        Self {
            source: Box::new(source),
            head: Vec::new(),
            taken: 0,
            position: 0,
            length,
            stored,
            params: params.clone(),
        }
    }

    /// The unpacked bytes of what is left, which is gzip of one or several members. However often gzip is packed into
    /// gzip, the bytes of the file itself decide how much may come out.
    pub(crate) fn gunzip(self) -> Stream<'a> {
        let stored = self.stored;
        let params = self.params.clone();
        Stream::new(Unpacked::gzip(self, stored), None, stored, &params)
    }

    /// The same of one zlib stream.
    pub(crate) fn inflate(self) -> Stream<'a> {
        let stored = self.stored;
        let params = self.params.clone();
        Stream::new(Unpacked::zlib(self, stored), None, stored, &params)
    }

    /// Up to `n` of the bytes to come, without taking them; fewer only at the end.
    pub(crate) fn peek(&mut self, n: usize) -> Result<&[u8], ReadError> {
        while self.head.len() - self.taken < n {
            let missing = n - (self.head.len() - self.taken);
            reserve(&mut self.head, missing)?;
            if self.source.by_ref().take(missing as u64).read_to_end(&mut self.head).map_err(failed)? == 0 {
                break;
            }
        }
        let ahead = &self.head[self.taken..];
        Ok(&ahead[..n.min(ahead.len())])
    }

    /// What is to come up to where `ends` finds the end of a header, and some more; all of it where there is none.
    pub(crate) fn peek_until(
        &mut self,
        ends: impl Fn(&[u8]) -> bool,
        what: &str,
        hint: &'static str,
    ) -> Result<&[u8], ReadError> {
        let mut length = 1 << 12;
        loop {
            let head = self.peek(length)?;
            if head.len() < length || ends(head) {
                return self.peek(length);
            }
            if length >= MAX_HEADER {
                let expected = format!("{what} of at most {MAX_HEADER} bytes");
                return Err(ReadError::input(Place::Byte(0), expected, "a longer one", hint));
            }
            length *= 4;
        }
    }

    /// Fills `target` as far as there are bytes; gives how many.
    pub(crate) fn fill(&mut self, target: &mut [u8]) -> Result<usize, ReadError> {
        let mut filled = 0;
        while filled < target.len() {
            match self.read(&mut target[filled..]).map_err(failed)? {
                0 => break,
                n => filled += n,
            }
        }
        Ok(filled)
    }

    /// Passes over `n` bytes; gives how many there were.
    pub(crate) fn skip(&mut self, n: u64) -> Result<u64, ReadError> {
        io::copy(&mut self.by_ref().take(n), &mut io::sink()).map_err(failed)
    }

    /// All that is left, taken from the account of memory as long as it is there.
    pub(crate) fn rest(mut self) -> Result<Content, ReadError> {
        let mut held = self.params.memory.take(CONTENT, 0)?;
        let mut bytes = Vec::new();
        loop {
            let step = self.left().map_or(1 << 18, |left| (left + 1).min(STEP as u64));
            // One byte more is asked for than there should be, to see the end.
            held.set(CONTENT, (bytes.len() as u64).saturating_add(self.left().map_or(step, |left| left.min(step))))?;
            reserve(&mut bytes, step as usize)?;
            if self.by_ref().take(step).read_to_end(&mut bytes).map_err(failed)? == 0 {
                held.set(CONTENT, bytes.len() as u64)?;
                return Ok(Content { bytes, held });
            }
        }
    }

    /// Bytes taken so far.
    pub(crate) fn position(&self) -> u64 {
        self.position
    }

    /// Bytes to come, if that is known before they are unpacked.
    pub(crate) fn left(&self) -> Option<u64> {
        self.length.map(|n| n.saturating_sub(self.position))
    }

    /// Refuses what cannot come, before memory is taken for it.
    pub(crate) fn expect(&self, bytes: u64) -> Result<(), ReadError> {
        if self.length.is_none() { check_ratio(bytes, self.stored) } else { Ok(()) }
    }
}

/// The entry of [`Stream::rest`] in the account of memory.
const CONTENT: &str = "the content of the file";

/// Bytes that are in memory whole.
pub(crate) struct Content {
    bytes: Vec<u8>,
    held: Reservation,
}

impl Content {
    /// Bytes for which memory was taken before.
    pub(crate) fn new(bytes: Vec<u8>, held: Reservation) -> Self {
        Self { bytes, held }
    }

    /// The bytes, and for how long they count.
    pub(crate) fn into_parts(self) -> (Vec<u8>, Reservation) {
        (self.bytes, self.held)
    }
}

impl Deref for Content {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        &self.bytes
    }
}

impl Read for Stream<'_> {
    fn read(&mut self, target: &mut [u8]) -> io::Result<usize> {
        let ahead = &self.head[self.taken..];
        let n = if ahead.is_empty() {
            self.source.read(target)?
        } else {
            let n = ahead.len().min(target.len());
            target[..n].copy_from_slice(&ahead[..n]);
            self.taken += n;
            n
        };
        self.position += n as u64;
        Ok(n)
    }
}

/// A file that has to have the length that it had before.
struct Measured {
    file: File,
    length: u64,
    read: u64,
}

impl Read for Measured {
    fn read(&mut self, target: &mut [u8]) -> io::Result<usize> {
        // One byte more than announced: a file that grows meanwhile is noticed, and one that never ends is not followed.
        let most = (self.length + 1 - self.read).min(target.len() as u64) as usize;
        let n = self.file.read(&mut target[..most])?;
        self.read += n as u64;
        let ended = n == 0 && most > 0;
        if self.read > self.length || ended && self.read < self.length {
            return Err(io::Error::other(ReadError::input(
                Place::Byte(self.read),
                format!("{} bytes, the length before reading", self.length),
                "another length: the file changed while it was read",
                "wait until the file is complete, then try again",
            )));
        }
        Ok(n)
    }
}

fn refused(e: &io::Error) -> ReadError {
    if e.kind() == io::ErrorKind::NotFound {
        return ReadError::missing();
    }
    ReadError::file_system("a file that can be read", e.to_string(), "check the path and its permissions")
}

/// What a source said went wrong.
fn failed(e: io::Error) -> ReadError {
    e.downcast::<ReadError>().unwrap_or_else(|e| refused(&e))
}

/// Refuses more bytes than gzip of `stored` bytes may stand for.
pub(crate) fn check_ratio(bytes: u64, stored: u64) -> Result<(), ReadError> {
    check_packed(bytes, stored, "gzip")
}

/// Refuses more bytes than `stored` bytes of something packed may stand for.
pub(crate) fn check_packed(bytes: u64, stored: u64, packed: &str) -> Result<(), ReadError> {
    check_ratio_of(bytes, stored, MAX_RATIO, packed)
}

/// Refuses more bytes than deflate can have packed into `stored` bytes: of one colour throughout, images are packed as far.
pub(crate) fn check_deflated(bytes: u64, stored: u64, packed: &str) -> Result<(), ReadError> {
    check_ratio_of(bytes, stored, MAX_DEFLATED, packed)
}

/// Refuses more than so many bytes for each of `stored` bytes of something packed.
pub(crate) fn check_ratio_of(bytes: u64, stored: u64, most: u64, packed: &str) -> Result<(), ReadError> {
    if bytes <= FREE || bytes / most <= stored {
        return Ok(());
    }
    Err(ReadError::limit(
        format!("at most {most} decompressed bytes for each byte of {packed}"),
        format!("{bytes} from {stored}"),
        "decompress the file yourself if it is to be trusted",
    ))
}

/// Refuses sizes above the limit, of what is not in memory at a time.
pub(crate) fn check_bytes(what: &str, bytes: u64, params: &ReadParams) -> Result<(), ReadError> {
    let limit = params.memory.limit();
    Exceeded::check(what.to_owned(), bytes, limit, "bytes", "").map_err(ReadError::from)
}

/// Says how much memory something takes by now, before it does, until the file is read. Of what has one name in a file the last
/// word counts.
pub(crate) fn hold(what: &str, bytes: u64, params: &ReadParams) -> Result<(), ReadError> {
    Ok(params.memory.hold(what, bytes)?)
}

/// Memory of something that grows bit by bit, for which the account is asked now and then.
pub(crate) struct Growing {
    what: &'static str,
    held: u64,
}

impl Growing {
    pub(crate) fn new(what: &'static str) -> Self {
        Self { what, held: 0 }
    }

    /// Says that it will take so many bytes.
    pub(crate) fn hold(&mut self, bytes: u64, params: &ReadParams) -> Result<(), ReadError> {
        if bytes <= self.held {
            return Ok(());
        }
        // A sixteenth more, so that it is asked for a few hundred times at most; exactly where there is not as much.
        let ample = bytes.saturating_add(bytes / 16);
        self.held = if params.memory.hold(self.what, ample).is_ok() {
            ample
        } else {
            hold(self.what, bytes, params)?;
            bytes
        };
        Ok(())
    }
}

/// Room for `more` elements, or the limit error where the allocator has none.
pub(crate) fn reserve<T>(column: &mut Vec<T>, more: usize) -> Result<(), ReadError> {
    let refused = |_| none_left(&format!("{more} more elements of {} bytes", size_of::<T>()));
    column.try_reserve(more).map_err(refused)
}

/// The error where the allocator has no room.
pub(crate) fn none_left(what: &str) -> ReadError {
    ReadError::limit(format!("memory for {what}"), "none left", "free memory, or thin out the data")
}
