//! The header of an NRRD file: lines `field: value` up to an empty line.

use super::axes::{self, Axes};
use crate::error::{Place, ReadError};
use crate::text::{Line, Lines};
use crate::volumes::voxels::Kind;
use splat_core::text::escaped;

/// The type of a voxel by its name.
fn kind_named(name: &str) -> Option<Kind> {
    Some(match name {
        "signed char" | "int8" | "int8_t" => Kind::I8,
        "uchar" | "unsigned char" | "uint8" | "uint8_t" => Kind::U8,
        "short" | "short int" | "signed short" | "signed short int" | "int16" | "int16_t" => Kind::I16,
        "ushort" | "unsigned short" | "unsigned short int" | "uint16" | "uint16_t" => Kind::U16,
        "int" | "signed int" | "int32" | "int32_t" => Kind::I32,
        "uint" | "unsigned int" | "uint32" | "uint32_t" => Kind::U32,
        "longlong" | "long long" | "long long int" | "signed long long" | "int64" | "int64_t" => Kind::I64,
        "ulonglong" | "unsigned long long" | "unsigned long long int" | "uint64" | "uint64_t" => Kind::U64,
        "float" => Kind::F32,
        "double" => Kind::F64,
        _ => return None,
    })
}

/// How voxels are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    Raw,
    Gzip,
    Text,
}

/// What the header says.
#[derive(Debug, Clone)]
pub(super) struct Header {
    pub(super) kind: Kind,
    pub(super) axes: Axes,
    pub(super) encoding: Encoding,
    pub(super) big_endian: bool,
    pub(super) line_skip: u64,
    pub(super) byte_skip: i64,
    /// Name of the file with the voxels, and where the header names it.
    pub(super) data_file: Option<(String, Place)>,
    /// Byte offset of what follows the header.
    pub(super) end: usize,
    /// Lines of the header, the empty one at its end among them.
    pub(super) lines: u64,
}

/// The fields as they are written, with their lines.
#[derive(Default)]
pub(super) struct Fields<'a> {
    found: Vec<(String, String, Line<'a>)>,
}

const KNOWN: [&str; 14] = [
    "type",
    "dimension",
    "sizes",
    "encoding",
    "endian",
    "spacings",
    "space directions",
    "space origin",
    "data file",
    "line skip",
    "byte skip",
    "axis mins",
    "space",
    "kinds",
];

/// Parses the header.
pub(super) fn parse(content: &[u8]) -> Result<Header, ReadError> {
    let mut lines = Lines::new(content);
    let magic = lines.next()?.filter(|l| {
        l.text.strip_prefix(b"NRRD000").is_some_and(|version| matches!(version.trim_ascii_end(), [b'1'..=b'5']))
    });
    if magic.is_none() {
        let found = format!("'{}'", escaped(&content[..content.len().min(16)], 16));
        return Err(ReadError::input(Place::Byte(0), "'NRRD0001' to 'NRRD0005'", found, "is this an NRRD file?"));
    }
    let mut fields = Fields::default();
    while let Some(line) = lines.next()?.filter(|l| !l.text.is_empty()) {
        fields.take(line)?;
    }
    let end = lines.offset();
    let last = lines.end();
    let lines = lines.number();
    let axes = axes::read(&fields, last)?;
    let (name, at) = fields.required("type", last)?;
    let kind = kind_named(name).ok_or_else(|| {
        let expected = "a type of real scalars: 8- to 64-bit integers, float or double";
        ReadError::input(at, expected, format!("'{}'", escaped(name.as_bytes(), 40)), "convert the volume first")
    })?;
    let encoding = fields.encoding(last)?;
    let big_endian = fields.big_endian(kind, encoding, last)?;
    let line_skip = fields.whole("line skip")?.unwrap_or(0).max(0) as u64;
    let byte_skip = fields.whole("byte skip")?.unwrap_or(0);
    let data_file = fields.find("data file").map(|(name, place)| (name.to_owned(), place));
    Ok(Header { kind, axes, encoding, big_endian, line_skip, byte_skip, data_file, end, lines })
}

pub(super) fn wrong(place: Place, expected: &str, found: &str) -> ReadError {
    let hint = "the header is damaged, or a field is not of this kind of volume";
    ReadError::input(place, expected, format!("'{}'", escaped(found.as_bytes(), 60)), hint)
}

impl<'a> Fields<'a> {
    fn take(&mut self, line: Line<'a>) -> Result<(), ReadError> {
        let text = std::str::from_utf8(line.text).map_err(|_| {
            let found = format!("'{}'", escaped(line.text, 60));
            ReadError::input(line.place(), "a line of UTF-8 text, or an empty line before the data", found, super::HINT)
        })?;
        // Comments and pairs of keys and values.
        if text.starts_with('#') || text.contains(":=") {
            return Ok(());
        }
        let Some((field, value)) = text.split_once(": ").or_else(|| text.split_once(':')) else {
            return Err(wrong(line.place(), "field: value", text));
        };
        let field = match field {
            "datafile" => "data file",
            "lineskip" => "line skip",
            "byteskip" => "byte skip",
            "axismins" => "axis mins",
            other => other,
        };
        if !KNOWN.contains(&field) {
            return Ok(());
        }
        if self.find(field).is_some() {
            return Err(wrong(line.place(), "each field once", text));
        }
        self.found.push((field.to_owned(), value.trim().to_owned(), line));
        Ok(())
    }

    pub(super) fn find(&self, field: &str) -> Option<(&str, Place)> {
        self.found.iter().find(|f| f.0 == field).map(|f| (f.1.as_str(), f.2.place()))
    }

    pub(super) fn required(&self, field: &str, end: Place) -> Result<(&str, Place), ReadError> {
        let missing = || ReadError::input(end, format!("a field '{field}'"), "none before the data", super::HINT);
        self.find(field).ok_or_else(missing)
    }

    fn encoding(&self, end: Place) -> Result<Encoding, ReadError> {
        let (name, place) = self.required("encoding", end)?;
        match name.to_ascii_lowercase().as_str() {
            "raw" => Ok(Encoding::Raw),
            "gzip" | "gz" => Ok(Encoding::Gzip),
            "txt" | "text" | "ascii" => Ok(Encoding::Text),
            _ => Err(wrong(place, "encoding raw, gzip or text", name)),
        }
    }

    fn big_endian(&self, kind: Kind, encoding: Encoding, end: Place) -> Result<bool, ReadError> {
        if kind.size() == 1 || encoding == Encoding::Text {
            return Ok(false);
        }
        let (name, place) = self.required("endian", end)?;
        match name {
            "little" => Ok(false),
            "big" => Ok(true),
            _ => Err(wrong(place, "endian little or big", name)),
        }
    }

    fn whole(&self, field: &str) -> Result<Option<i64>, ReadError> {
        let Some((text, place)) = self.find(field) else { return Ok(None) };
        let number = text.parse().ok().filter(|n: &i64| *n >= -1);
        number.map(Some).ok_or_else(|| wrong(place, "a whole number from 0, or -1", text))
    }
}
