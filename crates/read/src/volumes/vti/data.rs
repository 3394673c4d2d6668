//! The numbers of the arrays of a VTK file in XML: text, base64 or raw bytes, in one piece or in blocks of zlib.

use super::{HINT, place, wrong};
use crate::ReadParams;
use crate::error::{Place, ReadError};
use crate::reading::Reading;
use crate::stream::inflate::Inflate;
use crate::stream::input::{self, Stream};
use crate::text::Words;
use crate::volumes::cells::Numbers;
use crate::volumes::voxels::{self, Stored};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use roxmltree::Node;
use splat_core::text::counted;
use std::borrow::Cow;
use std::cell::Cell;
use std::io::Read;
use std::ops::Range;

/// Most bytes of an array: more are a lie, and their number may not overflow.
const MOST_BYTES: u64 = 1 << 48;

/// The bytes behind the elements, at which arrays point.
#[derive(Debug, Clone)]
pub(super) struct Appended {
    bytes: Range<usize>,
}

impl Appended {
    /// Parts a file into the appended bytes, if it has some, and the rest of its XML with all end tags.
    pub(super) fn split(content: &[u8]) -> Result<(Option<Self>, Cow<'_, str>), ReadError> {
        let tag = b"<AppendedData";
        let mut tags = content.iter().enumerate().filter(|(_, b)| **b == b'<').map(|(i, _)| i);
        let Some(start) = tags.find(|i| content[*i..].starts_with(tag)) else {
            return Ok((None, text(content)?.into()));
        };
        let cut = |expected: &str| ReadError::input(Place::Byte(start as u64), expected, "another end", HINT);
        let open = content[start..].iter().position(|b| *b == b'>').ok_or_else(|| cut("'>' after AppendedData"))?;
        let head = &content[..=start + open];
        let ends = "</AppendedData> and </VTKFile> at the end of the file";
        let tail = content.trim_ascii_end().strip_suffix(b"</VTKFile>").map(<[u8]>::trim_ascii_end);
        let data = tail.and_then(|t| t.strip_suffix(b"</AppendedData>")).ok_or_else(|| cut(ends))?;
        let blanks = data.get(head.len()..).and_then(|d| d.iter().position(|b| !b.is_ascii_whitespace()));
        let mark = blanks.map(|n| head.len() + n).filter(|at| data[*at] == b'_');
        let bytes = mark.ok_or_else(|| cut("'_' before the appended data"))? + 1..data.len();
        Ok((Some(Self { bytes }), (text(head)?.to_owned() + "</AppendedData></VTKFile>").into()))
    }
}

fn text(part: &[u8]) -> Result<&str, ReadError> {
    let wrong = |at: usize| ReadError::input(Place::Byte(at as u64), "UTF-8 text", "another byte", HINT);
    std::str::from_utf8(part).map_err(|e| wrong(e.valid_up_to()))
}

/// How the arrays of a file are stored.
pub(super) struct Encoding<'a> {
    content: &'a [u8],
    pub(super) big_endian: bool,
    /// Bytes of a size before an array.
    word: usize,
    is_compressed: bool,
    /// The appended bytes, and whether they are in base64.
    appended: Option<(Range<usize>, bool)>,
    /// A place of the text, and the ends of lines before it: from there on they are counted, for an array after the other.
    counted: Cell<(usize, u64)>,
}

/// What an array holds.
enum Content<'a> {
    Text(Words<'a>),
    Bytes(Cow<'a, [u8]>),
}

/// An array's bytes, taken from the front.
struct Source<'a> {
    content: &'a [u8],
    left: Range<usize>,
    is_base64: bool,
    place: Place,
}

impl<'a> Encoding<'a> {
    /// What the root element says.
    pub(super) fn stated_by(
        root: Node<'_, '_>,
        content: &'a [u8],
        appended: Option<Appended>,
    ) -> Result<Self, ReadError> {
        let attribute = |name: &str| root.attribute(name);
        let big_endian = match attribute("byte_order") {
            Some("LittleEndian") => false,
            Some("BigEndian") => true,
            other => return Err(wrong(root, "byte_order LittleEndian or BigEndian", other.unwrap_or("none"))),
        };
        let word = match attribute("header_type") {
            None | Some("UInt32") => 4,
            Some("UInt64") => 8,
            Some(other) => return Err(wrong(root, "header_type UInt32 or UInt64", other)),
        };
        let is_compressed = match attribute("compressor") {
            None | Some("") => false,
            Some("vtkZLibDataCompressor") => true,
            Some(other) => {
                let hint = "write the file with zlib (ParaView: Compressor Type), or without compression";
                return Err(ReadError { hint, ..wrong(root, "the compressor vtkZLibDataCompressor", other) });
            }
        };
        let element = root.children().find(|c| c.has_tag_name("AppendedData"));
        let appended = match (appended, element) {
            (Some(Appended { bytes }), Some(element)) => match element.attribute("encoding") {
                Some("raw") => Some((bytes, false)),
                Some("base64") => Some((bytes, true)),
                other => return Err(wrong(element, "encoding raw or base64", other.unwrap_or("none"))),
            },
            _ => None,
        };
        Ok(Self { content, big_endian, word, is_compressed, appended, counted: Cell::default() })
    }

    /// Bytes of the file.
    pub(super) fn bytes(&self) -> u64 {
        self.content.len() as u64
    }

    /// The values of an array.
    pub(super) fn values(
        &self,
        array: Node<'_, '_>,
        stored: &Stored,
        params: &ReadParams,
    ) -> Result<Vec<f32>, ReadError> {
        match self.content_of(array, stored.bytes(), params)? {
            Content::Text(words) => voxels::whole_text(words, stored, params, HINT),
            Content::Bytes(bytes) => {
                let values = voxels::read(&mut Stream::in_memory(&bytes, params), stored, params, HINT);
                values.map_err(|e| ReadError { place: place(array), ..e })
            }
        }
    }

    /// So many numbers of an array, which has no more.
    pub(super) fn numbers(&self, array: Node<'_, '_>, count: u64, reading: &Reading<'_>) -> Result<Numbers, ReadError> {
        let kind = super::kind(array)?;
        // Writers leave out the text of an array of none.
        if count == 0 {
            return Numbers::room(0, reading);
        }
        let fits = count.checked_mul(kind.size()).filter(|bytes| *bytes <= MOST_BYTES);
        let bytes = fits.ok_or_else(|| wrong(array, "a number of values within the file", &count.to_string()))?;
        let mut words = match self.content_of(array, bytes, reading.params)? {
            Content::Bytes(bytes) => {
                let mut numbers = Numbers::room(count, reading)?;
                numbers.all.extend(kind.numbers(&bytes, self.big_endian));
                return Ok(numbers);
            }
            Content::Text(words) => words,
        };
        // A digit and a blank each, but for the last one.
        if count > (words.left() as u64).div_ceil(2) {
            return Err(wrong(array, &counted(count, "number"), &words.count().to_string()));
        }
        let mut numbers = Numbers::room(count, reading)?;
        for word in words.by_ref().take(count as usize) {
            // NaN is a gap in a field; places and counts refuse it where they are made.
            numbers.all.push(word.decimal().filter(|v| v.is_nan()).map_or_else(|| word.number(), Ok)?);
        }
        let found = numbers.len() as u64;
        let more = words.count() as u64;
        if found == count && more == 0 {
            return Ok(numbers);
        }
        Err(wrong(array, &counted(count, "number"), &(found + more).to_string()))
    }

    /// What an array of so many bytes holds.
    fn content_of(&self, array: Node<'_, '_>, size: u64, params: &ReadParams) -> Result<Content<'a>, ReadError> {
        let format = array.attribute("format").unwrap_or("ascii");
        let is_appended = format == "appended";
        if is_base64(format, self.appended.as_ref()) {
            // The characters without blanks, and what they stand for.
            let most = (self.content.len() as u64).min(size.saturating_mul(2));
            input::hold("an array in base64", 2 * most, params)?;
        }
        let mut source = match format {
            "ascii" | "binary" => {
                let left = inline(array)?;
                Source { content: self.content, left, is_base64: true, place: place(array) }
            }
            "appended" => self.appended_source(array)?,
            other => return Err(wrong(array, "format ascii, binary or appended", other)),
        };
        if format == "ascii" {
            let line = self.line_ends_before(source.left.start) + 1;
            let words = Words::new(&self.content[..source.left.end], source.left.start, line);
            return Ok(Content::Text(words));
        }
        let bytes =
            if self.is_compressed { self.unpacked(&mut source, size, params)? } else { self.plain(&mut source, size)? };
        if !is_appended && !self.content[source.left.clone()].trim_ascii().is_empty() {
            return Err(wrong(array, "the end of the array after its data", "more"));
        }
        Ok(Content::Bytes(bytes))
    }

    /// Ends of lines before a place of the text.
    fn line_ends_before(&self, place: usize) -> u64 {
        let (known, ends) = self.counted.get();
        let count = |between: Range<usize>| self.content[between].iter().filter(|b| **b == b'\n').count() as u64;
        let ends = if place < known { ends - count(place..known) } else { ends + count(known..place) };
        self.counted.set((place, ends));
        ends
    }

    /// The appended bytes from the offset of an array on.
    fn appended_source(&self, array: Node<'_, '_>) -> Result<Source<'a>, ReadError> {
        let Some((bytes, is_base64)) = self.appended.clone() else {
            return Err(wrong(array, "an element AppendedData at the end of the file", "none"));
        };
        let text = array.attribute("offset").unwrap_or_default();
        let offset = text.trim().parse().ok().filter(|n: &usize| *n <= bytes.len());
        let expected = || format!("an offset from 0 to {}, the appended bytes", bytes.len());
        let offset = offset.ok_or_else(|| wrong(array, &expected(), text))?;
        let left = bytes.start + offset..bytes.end;
        Ok(Source { content: self.content, left, is_base64, place: place(array) })
    }

    /// An unsigned number of the header of an array.
    fn size(&self, bytes: &[u8]) -> u64 {
        let digits = bytes[..self.word].iter();
        let next = |n: u64, b: &u8| n << 8 | u64::from(*b);
        if self.big_endian { digits.fold(0, next) } else { digits.rev().fold(0, next) }
    }

    /// An array that is not compressed: its size and its bytes, in base64 as one or as two.
    fn plain(&self, source: &mut Source<'a>, bytes: u64) -> Result<Cow<'a, [u8]>, ReadError> {
        let start = source.left.start;
        let head = source.beginning(self.word)?;
        let size = self.size(&head);
        if size != bytes {
            return Err(source.wrong(&format!("{bytes} bytes of values"), &size.to_string()));
        }
        // Longer than asked for where the run goes on.
        if source.is_base64 && head.len() > self.word {
            source.left.start = start;
            let mut both = source.take(self.word as u64 + size)?.into_owned();
            both.drain(..self.word);
            return Ok(both.into());
        }
        source.take(size)
    }

    /// An array in blocks: how many, their size, that of the last if it is another, their packed sizes; then the blocks.
    fn unpacked(&self, source: &mut Source<'a>, bytes: u64, params: &ReadParams) -> Result<Cow<'a, [u8]>, ReadError> {
        let start = source.left.start;
        let blocks = self.size(&source.beginning(self.word)?);
        source.left.start = start;
        let head = blocks.checked_add(3).and_then(|n| n.checked_mul(self.word as u64));
        let head = head.ok_or_else(|| source.wrong("a number of blocks within the data", &blocks.to_string()))?;
        let head = source.take(head)?;
        let sizes: Vec<u64> = head.chunks_exact(self.word).map(|word| self.size(word)).collect();
        let size = sizes[1];
        let last = if sizes[2] == 0 { sizes[1] } else { sizes[2] };
        let whole = blocks.checked_sub(1).and_then(|n| n.checked_mul(size)).and_then(|n| n.checked_add(last));
        if whole != Some(bytes) || last > size {
            let found = format!("{blocks} blocks of {size} bytes, the last of {last}");
            return Err(source.wrong(&format!("{bytes} bytes of values"), &found));
        }
        let packed_bytes = sizes[3..].iter().try_fold(0u64, |n, s| n.checked_add(*s));
        let packed_bytes = packed_bytes.ok_or_else(|| source.wrong("blocks within the data", "longer ones"))?;
        let packed = source.take(packed_bytes)?;
        input::hold("the unpacked array", bytes, params)?;
        input::check_packed(bytes, packed_bytes, "zlib")?;
        let mut unpacked = Vec::new();
        input::reserve(&mut unpacked, bytes as usize)?;
        let mut left = packed.as_ref();
        for (i, length) in sizes[3..].iter().enumerate() {
            let (block, rest) = left.split_at(*length as usize);
            left = rest;
            let size = if i as u64 + 1 == blocks { last } else { size };
            let before = unpacked.len();
            // One byte too many is enough to be wrong.
            let read = Inflate::new(block).take(size + 1).read_to_end(&mut unpacked);
            let given = (unpacked.len() - before) as u64;
            if read.is_err() || given != size {
                let found = read.map_or_else(|e| e.to_string(), |_| format!("{given}"));
                return Err(source.wrong(&format!("block {i} to be one zlib stream of {size} bytes"), &found));
            }
        }
        Ok(unpacked.into())
    }
}

/// Whether an array of that format is in base64.
fn is_base64(format: &str, appended: Option<&(Range<usize>, bool)>) -> bool {
    format == "binary" || format == "appended" && appended.is_some_and(|(_, is_base64)| *is_base64)
}

impl<'a> Source<'a> {
    fn wrong(&self, expected: &str, found: &str) -> ReadError {
        ReadError::input(self.place, expected, found, HINT)
    }

    /// So many bytes from the front and perhaps one or two more, which are of the same run of base64.
    fn beginning(&mut self, bytes: usize) -> Result<Cow<'a, [u8]>, ReadError> {
        if !self.is_base64 {
            return self.take(bytes as u64);
        }
        let run = self.run(bytes as u64)?;
        if run.len() < bytes { Err(self.wrong("a size before the array", "fewer bytes")) } else { Ok(run.into()) }
    }

    /// So many bytes from the front, in base64 a run of its own.
    fn take(&mut self, bytes: u64) -> Result<Cow<'a, [u8]>, ReadError> {
        let run = if self.is_base64 { Some(self.run(bytes)?) } else { None };
        let too_short = || self.wrong(&format!("{bytes} bytes of an array"), "fewer");
        if let Some(run) = run {
            return if run.len() as u64 == bytes { Ok(run.into()) } else { Err(too_short()) };
        }
        let end = usize::try_from(bytes).ok().and_then(|n| self.left.start.checked_add(n));
        let end = end.filter(|end| *end <= self.left.end).ok_or_else(too_short)?;
        let taken = &self.content[self.left.start..end];
        self.left.start = end;
        Ok(taken.into())
    }

    /// What as many characters of base64 stand for as so many bytes take.
    fn run(&mut self, bytes: u64) -> Result<Vec<u8>, ReadError> {
        let characters = bytes.div_ceil(3).saturating_mul(4);
        let text = &self.content[self.left.clone()];
        if characters > text.len() as u64 {
            return Err(self.wrong(&format!("{characters} characters of base64"), &text.len().to_string()));
        }
        let mut run = Vec::new();
        input::reserve(&mut run, characters as usize)?;
        let mut end = 0;
        for byte in text {
            if run.len() as u64 == characters {
                break;
            }
            end += 1;
            if !byte.is_ascii_whitespace() {
                run.push(*byte);
            }
        }
        self.left.start += end;
        STANDARD.decode(&run).map_err(|e| self.wrong("base64", &e.to_string()))
    }
}

/// The bytes of the text of an array.
fn inline(array: Node<'_, '_>) -> Result<Range<usize>, ReadError> {
    let texts = array.children().filter(|c| c.is_text() && c.text().is_some_and(|t| !t.trim().is_empty()));
    let texts: Vec<_> = texts.collect();
    let &[text] = texts.as_slice() else {
        return Err(wrong(array, "the numbers of the array in one text", &texts.len().to_string()));
    };
    Ok(text.range())
}
