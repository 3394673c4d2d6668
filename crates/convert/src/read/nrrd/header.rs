//! The header of an NRRD file: lines `field: value` up to an empty line.

use crate::error::{Place, ReadError, escaped};
use crate::read::lattice;
use crate::read::text::{Line, Lines};
use crate::read::voxels::Kind;
use splat_core::glam::{DMat3, DVec3};

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
    pub(super) sizes: [u64; 3],
    pub(super) place_of_sizes: Place,
    pub(super) encoding: Encoding,
    pub(super) big_endian: bool,
    pub(super) origin: DVec3,
    pub(super) axes: DMat3,
    /// What the file calls the space that its axes were converted from.
    pub(super) converted_from: Option<&'static str>,
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
struct Fields<'a> {
    found: Vec<(String, String, Line<'a>)>,
}

const KNOWN: [&str; 13] = [
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
];

/// Spaces of three dimensions, their short names, and how their axes point along right, anterior and superior; those of a
/// scanner or of no patient are taken as they are.
const SPACES: [(&str, &str, DVec3); 6] = [
    ("right-anterior-superior", "ras", DVec3::ONE),
    ("left-anterior-superior", "las", DVec3::new(-1.0, 1.0, 1.0)),
    ("left-posterior-superior", "lps", DVec3::new(-1.0, -1.0, 1.0)),
    ("scanner-xyz", "scanner-xyz", DVec3::ONE),
    ("3d-right-handed", "3d-right-handed", DVec3::ONE),
    ("3d-left-handed", "3d-left-handed", DVec3::ONE),
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
    let (dimension, at) = fields.required("dimension", last)?;
    if dimension != "3" {
        let hint = "extract one volume of scalars first";
        return Err(ReadError::input(at, "dimension: 3", escaped(dimension.as_bytes(), 20), hint));
    }
    let (name, at) = fields.required("type", last)?;
    let kind = kind_named(name).ok_or_else(|| {
        let expected = "a type of real scalars: 8- to 64-bit integers, float or double";
        ReadError::input(at, expected, format!("'{}'", escaped(name.as_bytes(), 40)), "convert the volume first")
    })?;
    let (sizes, place_of_sizes) = fields.required("sizes", last)?;
    let sizes = sizes_of(sizes, place_of_sizes)?;
    let encoding = fields.encoding(last)?;
    let big_endian = fields.big_endian(kind, encoding, last)?;
    let (origin, axes, converted_from) = fields.affine()?;
    let line_skip = fields.whole("line skip")?.unwrap_or(0).max(0) as u64;
    let byte_skip = fields.whole("byte skip")?.unwrap_or(0);
    let data_file = fields.find("data file").map(|(name, place)| (name.to_owned(), place));
    Ok(Header {
        kind,
        sizes,
        place_of_sizes,
        encoding,
        big_endian,
        origin,
        axes,
        converted_from,
        line_skip,
        byte_skip,
        data_file,
        end,
        lines,
    })
}

fn wrong(place: Place, expected: &str, found: &str) -> ReadError {
    let hint = "the header is damaged, or a field is not of this kind of volume";
    ReadError::input(place, expected, format!("'{}'", escaped(found.as_bytes(), 60)), hint)
}

fn sizes_of(text: &str, place: Place) -> Result<[u64; 3], ReadError> {
    let sizes: Vec<u64> = text.split_ascii_whitespace().map_while(|w| w.parse().ok()).filter(|n| *n > 0).collect();
    match sizes.as_slice() {
        [x, y, z] if text.split_ascii_whitespace().count() == 3 => Ok([*x, *y, *z]),
        _ => Err(wrong(place, "three sizes above 0", text)),
    }
}

/// Three numbers as `(x,y,z)`.
fn vector(text: &str) -> Option<DVec3> {
    let inner = text.strip_prefix('(')?.strip_suffix(')')?;
    let mut parts = inner.split(',').map(|c| c.trim().parse::<f64>().ok().filter(|v| v.is_finite()));
    let v = DVec3::new(parts.next()??, parts.next()??, parts.next()??);
    parts.next().is_none().then_some(v)
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

    fn find(&self, field: &str) -> Option<(&str, Place)> {
        self.found.iter().find(|f| f.0 == field).map(|f| (f.1.as_str(), f.2.place()))
    }

    fn required(&self, field: &str, end: Place) -> Result<(&str, Place), ReadError> {
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

    /// Signs that make a right-anterior-superior space of the file's, and its name if that changes anything.
    fn space(&self) -> Result<(DVec3, Option<&'static str>), ReadError> {
        let Some((name, place)) = self.find("space") else { return Ok((DVec3::ONE, None)) };
        let lower = name.to_ascii_lowercase();
        let Some((long, _, signs)) = SPACES.iter().find(|(long, short, _)| lower == *long || lower == *short) else {
            let expected =
                "a space of three dimensions: right-anterior-superior, left-posterior-superior, scanner-xyz …";
            return Err(wrong(place, expected, name));
        };
        Ok((*signs, (*signs != DVec3::ONE).then_some(*long)))
    }

    /// Place of voxel (0, 0, 0) and the steps of the lattice, in a right-anterior-superior space where the file says how its
    /// own lies to it, and then the name of that.
    fn affine(&self) -> Result<(DVec3, DMat3, Option<&'static str>), ReadError> {
        let (signs, converted_from) = self.space()?;
        let mut axes = DMat3::IDENTITY;
        let mut place = Place::File;
        if let Some((text, at)) = self.find("space directions") {
            let columns: Option<Vec<DVec3>> = text.split_ascii_whitespace().map(vector).collect();
            let Some([x, y, z]) = columns.as_deref() else {
                return Err(wrong(at, "three vectors such as (1,0,0) (0,1,0) (0,0,1)", text));
            };
            (axes, place) = (DMat3::from_cols(*x, *y, *z), at);
        } else if let Some((text, at)) = self.find("spacings") {
            // A step that is not known is NaN.
            let steps: Option<Vec<f64>> = text.split_ascii_whitespace().map(|w| w.parse::<f64>().ok()).collect();
            let Some([x, y, z]) = steps.as_deref() else { return Err(wrong(at, "three spacings", text)) };
            let known = |s: f64| if s.is_nan() { 1.0 } else { s };
            (axes, place) = (DMat3::from_diagonal(DVec3::new(known(*x), known(*y), known(*z))), at);
        }
        let origin = match self.find("space origin") {
            None => DVec3::ZERO,
            Some((text, at)) => vector(text).ok_or_else(|| wrong(at, "an origin such as (0,0,0)", text))?,
        };
        lattice::check(origin, &axes, place, super::HINT)?;
        // Spacings alone do not say how the volume lies in the space.
        if self.find("space directions").is_none() {
            return Ok((origin, axes, None));
        }
        Ok((signs * origin, DMat3::from_diagonal(signs) * axes, converted_from))
    }
}
