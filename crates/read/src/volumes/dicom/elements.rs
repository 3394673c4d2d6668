//! The elements of a DICOM file, little endian with types or without, as far as slices need them. Lengths are checked against the file before anything is
//! taken for them; sequences are passed over, and their items are elements of their own where they are asked for.

use crate::error::{Place, ReadError};
use splat_core::text::escaped;
use std::borrow::Cow;
use std::ops::Range;

pub(super) const DAMAGED: &str = "the file is truncated or damaged; fetch it again";
pub(super) const CONVERT: &str =
    "convert the series, such as with `dcm2niix FOLDER`, or unpack it: `gdcmconv --raw IN OUT`";

/// Bytes before the mark, the mark, and where elements begin.
const PREAMBLE: usize = 128;
const MARK: &[u8] = b"DICM";
const START: usize = PREAMBLE + 4;
/// The length of what ends with a delimiter.
const UNDEFINED: u32 = u32::MAX;
/// Group of the elements that describe the file: they have types, whatever follows.
const OF_FILE: u16 = 2;
/// An item of a sequence, and the ends of one and of a sequence.
const ITEM: Tag = Tag(0xfffe, 0xe000);
const END_OF_ITEM: Tag = Tag(0xfffe, 0xe00d);
const END_OF_SEQUENCE: Tag = Tag(0xfffe, 0xe0dd);
/// Types whose length has four bytes, behind two that are not used.
const LONG: [&[u8; 2]; 13] =
    [b"OB", b"OD", b"OF", b"OL", b"OV", b"OW", b"SQ", b"SV", b"UC", b"UN", b"UR", b"UT", b"UV"];
const SYNTAX: Tag = Tag(2, 0x10);
const PIXELS: Tag = Tag(0x7fe0, 0x10);
/// Most bytes that a byte of packed pixels stands for: 128 of a run of two.
const MOST_PACKED: usize = 64;
/// How the names of syntaxes begin whose pixels are JPEG, JPEG 2000 or a movie.
const MOVIES: &str = "1.2.840.10008.1.2.4.";
/// Most elements of a file; real ones have some hundred.
const MOST: usize = 1 << 16;

/// Group and number of an element.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Tag(pub(super) u16, pub(super) u16);

/// How numbers of pixels are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Packing {
    None,
    /// Runs of bytes, a segment for each byte of a number.
    Runs,
    /// Another way, which is not read; the other elements are plain.
    Unread,
}

/// The elements of one file.
pub(super) struct Elements<'c> {
    content: &'c [u8],
    found: Vec<(Tag, Range<usize>)>,
    pub(super) packing: Packing,
    has_types: bool,
}

/// An element's header.
struct Head {
    tag: Tag,
    length: u32,
    is_unknown: bool,
    /// Where its value begins.
    start: usize,
}

/// Whether a file is DICOM by its first bytes.
pub(crate) fn is_dicom(head: &[u8]) -> bool {
    head.get(PREAMBLE..START) == Some(MARK)
}

/// The error of a transfer syntax that is not read.
fn unread_syntax(named: &str, syntax: &str) -> ReadError {
    let found = format!("a file that is {named} ({})", escaped(syntax.as_bytes(), 64));
    ReadError::input(Place::Byte(START as u64), "little endian numbers, plain or packed as RLE", found, CONVERT)
}

impl<'c> Elements<'c> {
    pub(super) fn parse(content: &'c [u8]) -> Result<Self, ReadError> {
        let mut elements = Self { content, found: Vec::new(), packing: Packing::None, has_types: true };
        let mut at = START;
        let mut is_in_data = false;
        while at < content.len() {
            let is_of_file = elements.whole(at, 2)? == u64::from(OF_FILE);
            if !is_of_file && !is_in_data {
                is_in_data = true;
                elements.has_types = elements.read_syntax()?;
            }
            let head = elements.head(at, elements.has_types)?;
            at = match head.length {
                UNDEFINED if head.tag == PIXELS => {
                    elements.found.push((PIXELS, head.start..content.len()));
                    content.len()
                }
                _ => elements.take(&head)?,
            };
            if elements.found.len() > MOST {
                return Err(ReadError::input(
                    Place::Byte(at as u64),
                    format!("at most {MOST} elements"),
                    "more",
                    DAMAGED,
                ));
            }
        }
        Ok(elements)
    }

    /// Takes the value of an element; gives its end.
    fn take(&mut self, head: &Head) -> Result<usize, ReadError> {
        let end = match head.length {
            UNDEFINED => self.end_of_sequence(head, self.has_types)?,
            length => self.end(head.start, length)?,
        };
        // What is of no known type has no types within.
        if !head.is_unknown || head.length != UNDEFINED {
            self.found.push((head.tag, head.start..end));
        }
        Ok(end)
    }

    /// The items of a sequence, at most so many; none where there is no such sequence.
    pub(super) fn items(&self, tag: Tag, most: usize) -> Result<Vec<Elements<'c>>, ReadError> {
        let Some((_, range)) = self.found.iter().find(|(found, _)| *found == tag) else { return Ok(Vec::new()) };
        let mut items = Vec::new();
        let mut at = range.start;
        while at < range.end {
            let head = self.head(at, self.has_types)?;
            if head.tag == END_OF_SEQUENCE {
                break;
            }
            if head.tag != ITEM || items.len() == most {
                let expected = format!("at most {most} items of a sequence");
                return Err(ReadError::input(Place::Byte(at as u64), expected, "another element", DAMAGED));
            }
            let mut item = Self { found: Vec::new(), ..*self };
            let end = if head.length == UNDEFINED { range.end } else { self.end(head.start, head.length)? };
            at = head.start;
            while at < end {
                let inner = item.head(at, item.has_types)?;
                if inner.tag == END_OF_ITEM {
                    at = inner.start;
                    break;
                }
                at = item.take(&inner)?;
            }
            items.push(item);
        }
        Ok(items)
    }

    /// A whole number of the file.
    fn whole(&self, at: usize, bytes: usize) -> Result<u64, ReadError> {
        let part = self.content.get(at..at + bytes);
        let cut = || ReadError::input(Place::Byte(at as u64), "a whole element", "the end of the file", DAMAGED);
        Ok(part.ok_or_else(cut)?.iter().rev().fold(0, |n, byte| n << 8 | u64::from(*byte)))
    }

    /// The end of a value of so many bytes.
    fn end(&self, start: usize, length: u32) -> Result<usize, ReadError> {
        let left = self.content.len() - start.min(self.content.len());
        if length as usize <= left {
            return Ok(start + length as usize);
        }
        let found = format!("{left} up to the end of the file");
        Err(ReadError::input(Place::Byte(start as u64), format!("a value of {length} bytes"), found, DAMAGED))
    }

    fn head(&self, at: usize, has_types: bool) -> Result<Head, ReadError> {
        let tag = Tag(self.whole(at, 2)? as u16, self.whole(at + 2, 2)? as u16);
        let plain = Head { tag, length: self.whole(at + 4, 4)? as u32, is_unknown: false, start: at + 8 };
        if !has_types || tag.0 == ITEM.0 {
            return Ok(plain);
        }
        let kind = &self.content[at + 4..at + 6];
        if !kind.iter().all(u8::is_ascii_uppercase) {
            let found = format!("'{}'", escaped(kind, 2));
            return Err(ReadError::input(
                Place::Byte(at as u64 + 4),
                "the type of an element, two letters",
                found,
                DAMAGED,
            ));
        }
        if LONG.iter().any(|long| long.as_slice() == kind) {
            let length = self.whole(at + 8, 4)? as u32;
            return Ok(Head { length, is_unknown: kind == b"UN", start: at + 12, ..plain });
        }
        Ok(Head { length: self.whole(at + 6, 2)? as u32, ..plain })
    }

    /// Passes over a sequence that ends with a delimiter, and over those in it.
    fn end_of_sequence(&self, head: &Head, has_types: bool) -> Result<usize, ReadError> {
        let mut at = head.start;
        // What is of no known type has no types within.
        let mut untyped_from = if head.is_unknown || !has_types { Some(1) } else { None };
        let mut depth = 1u32;
        while depth > 0 {
            let inner = self.head(at, untyped_from.is_none())?;
            at = inner.start;
            if [END_OF_ITEM, END_OF_SEQUENCE].contains(&inner.tag) {
                depth -= 1;
                if untyped_from.is_some_and(|from| from > depth && has_types) {
                    untyped_from = None;
                }
            } else if inner.length == UNDEFINED {
                depth += 1;
                if inner.is_unknown && untyped_from.is_none() {
                    untyped_from = Some(depth);
                }
            } else {
                at = self.end(at, inner.length)?;
            }
        }
        Ok(at)
    }

    /// How the data is stored, and whether its elements have types.
    fn read_syntax(&mut self) -> Result<bool, ReadError> {
        let syntax = self.text(SYNTAX).unwrap_or_default();
        let (packing, has_types) = match syntax.as_str() {
            "1.2.840.10008.1.2" => (Packing::None, false),
            "1.2.840.10008.1.2.1" => (Packing::None, true),
            "1.2.840.10008.1.2.5" => (Packing::Runs, true),
            other if other.starts_with(MOVIES) => (Packing::Unread, true),
            "1.2.840.10008.1.2.2" => return Err(unread_syntax("big endian", &syntax)),
            "1.2.840.10008.1.2.1.99" => return Err(unread_syntax("deflated", &syntax)),
            _ => return Err(unread_syntax("of another transfer syntax", &syntax)),
        };
        self.packing = packing;
        Ok(has_types)
    }

    /// Refuses pixels that are packed in a way that is not read.
    pub(super) fn check_packing(&self) -> Result<(), ReadError> {
        let syntax = || self.text(SYNTAX).unwrap_or_default();
        match self.packing {
            Packing::None | Packing::Runs => Ok(()),
            Packing::Unread => Err(unread_syntax("packed as JPEG, JPEG 2000 or a movie", &syntax())),
        }
    }

    fn value(&self, tag: Tag) -> Option<&'c [u8]> {
        let (_, range) = self.found.iter().find(|(found, _)| *found == tag)?;
        self.content.get(range.clone())
    }

    /// Bytes of a value; 0 where there is none.
    pub(super) fn bytes_of(&self, tag: Tag) -> usize {
        self.value(tag).map_or(0, <[u8]>::len)
    }

    /// A text without the blanks and zeros that fill it.
    pub(super) fn text(&self, tag: Tag) -> Option<String> {
        let text = String::from_utf8_lossy(self.value(tag)?);
        Some(text.trim_matches(|c: char| c == '\0' || c.is_whitespace()).to_owned()).filter(|text| !text.is_empty())
    }

    /// A whole number of two bytes.
    pub(super) fn short(&self, tag: Tag) -> Option<u16> {
        self.value(tag)?.first_chunk().map(|bytes| u16::from_le_bytes(*bytes))
    }

    /// So many finite numbers, written as a text.
    pub(super) fn numbers<const N: usize>(&self, tag: Tag) -> Option<[f64; N]> {
        let text = self.text(tag)?;
        let finite = |word: &str| word.trim().parse::<f64>().ok().filter(|number| number.is_finite());
        let numbers: Option<Vec<f64>> = text.split('\\').map(finite).collect();
        numbers?.try_into().ok()
    }

    /// Refuses a file that cannot hold so many pixels of so many bytes each, before memory is taken for them.
    pub(super) fn check_room(&self, count: usize, bytes: usize) -> Result<(), ReadError> {
        let stored = self.value(PIXELS).map_or(0, <[u8]>::len);
        let most = if self.packing == Packing::None { stored } else { stored.saturating_mul(MOST_PACKED) };
        if count * bytes <= most {
            return Ok(());
        }
        let expected = format!("{} bytes of pixels", count * bytes);
        Err(ReadError::input(Place::File, expected, format!("{stored}"), DAMAGED))
    }

    pub(super) fn has_pixels(&self) -> bool {
        self.value(PIXELS).is_some()
    }

    /// The bytes of so many pixels of so many bytes each.
    pub(super) fn pixels(&self, count: usize, bytes: usize) -> Result<Cow<'c, [u8]>, ReadError> {
        let value = self.value(PIXELS).unwrap_or_default();
        let start = value.as_ptr() as usize - self.content.as_ptr() as usize;
        let needed = count * bytes;
        let wrong = |found: usize| {
            let expected = format!("{needed} bytes of pixels");
            Err(ReadError::input(Place::Byte(start as u64), expected, found.to_string(), DAMAGED))
        };
        if self.packing == Packing::None {
            // One byte more makes their number even.
            return if value.len() == needed || value.len() == needed + needed % 2 {
                Ok(Cow::Borrowed(&value[..needed]))
            } else {
                wrong(value.len())
            };
        }
        // A table of places, one packed frame, and the end of the sequence.
        let table = self.head(start, false)?;
        let frame = self.head(self.end(table.start, table.length)?, false)?;
        let end = self.end(frame.start, frame.length)?;
        let after = self.head(end, false)?;
        if [table.tag, frame.tag, after.tag] != [ITEM, ITEM, END_OF_SEQUENCE] {
            return Err(ReadError::input(
                Place::Byte(start as u64),
                "a table, one packed frame and an end",
                "other items",
                DAMAGED,
            ));
        }
        let packed = &self.content[frame.start..end];
        let word =
            |i: usize| packed.get(4 * i..4 * i + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize);
        if word(0) != Some(bytes) {
            return wrong(0);
        }
        let mut pixels = vec![0; needed];
        for segment in 0..bytes {
            let from = word(1 + segment).unwrap_or(packed.len());
            let to = if segment + 1 < bytes { word(2 + segment).unwrap_or(0) } else { packed.len() };
            let Some(runs) = packed.get(from..to) else { return wrong(from) };
            // The highest byte of each number comes first.
            let filled = unpack(runs, pixels.iter_mut().skip(bytes - 1 - segment).step_by(bytes));
            if filled != count {
                return wrong(filled * bytes);
            }
        }
        Ok(Cow::Owned(pixels))
    }
}

/// Unpacks runs of bytes; gives how many there were, as far as there is room.
fn unpack<'t>(runs: &[u8], mut target: impl Iterator<Item = &'t mut u8>) -> usize {
    let mut at = 0;
    let mut filled = 0;
    while let Some(head) = runs.get(at) {
        let (length, step) = match *head {
            0..128 => (usize::from(*head) + 1, 1),
            128 => (0, 0),
            129.. => (257 - usize::from(*head), 0),
        };
        for i in 0..length {
            let Some(byte) = runs.get(at + 1 + i * step) else { return filled };
            // A byte may fill the segment up to an even number.
            let Some(place) = target.next() else { return filled };
            *place = *byte;
            filled += 1;
        }
        at += 1 + if step == 1 { length } else { usize::from(length > 0) };
    }
    filled
}
