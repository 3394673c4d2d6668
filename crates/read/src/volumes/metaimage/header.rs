//! The header of a MetaImage: lines `Field = value`, the last of which is `ElementDataFile`.

use crate::error::{Place, ReadError};
use crate::text::Lines;
use crate::volumes::lattice;
use crate::volumes::voxels::Kind;
use splat_core::glam::{DMat3, DVec3};
use splat_core::text::escaped;

/// The field with which a header ends.
const LAST: &str = "ElementDataFile";

/// Most fields, each of which is held against all others; real headers have a dozen, or hundreds with those of DICOM.
const MAX_FIELDS: usize = 4096;

/// Names of one field each.
const BYTE_ORDER: [&str; 2] = ["BinaryDataByteOrderMSB", "ElementByteOrderMSB"];
const OFFSET: [&str; 3] = ["Offset", "Position", "Origin"];
const MATRIX: [&str; 3] = ["TransformMatrix", "Rotation", "Orientation"];

/// Other fields by which the picture changes.
const USED: [&str; 10] = [
    "ObjectType",
    "NDims",
    "DimSize",
    "ElementType",
    "ElementNumberOfChannels",
    "BinaryData",
    "CompressedData",
    "HeaderSize",
    "ElementSpacing",
    "ElementSize",
];

/// Fields that say of a volume what changes no picture, as ITK reads it.
const WITHOUT_EFFECT: [&str; 11] = [
    "ObjectSubType",
    "Comment",
    "Name",
    "ID",
    "ParentID",
    "Modality",
    "ElementMin",
    "ElementMax",
    "CompressedDataSize",
    "CenterOfRotation",
    "AnatomicalOrientation",
];

/// What the header says.
#[derive(Debug, Clone)]
pub(super) struct Header {
    pub(super) kind: Kind,
    pub(super) big_endian: bool,
    pub(super) is_compressed: bool,
    pub(super) is_text: bool,
    pub(super) sizes: [u64; 3],
    pub(super) frames: u64,
    pub(super) place_of_sizes: Place,
    /// Numbers of a voxel.
    pub(super) numbers: u64,
    pub(super) place_of_numbers: Place,
    /// Place of voxel (0, 0, 0) and steps of the lattice, in the file's space.
    pub(super) origin: DVec3,
    pub(super) axes: DMat3,
    /// Bytes before the data, −1 for whatever comes before it.
    pub(super) header_size: i64,
    /// Name of the file with the voxels, and where the header names it; `None` if they follow.
    pub(super) data_file: Option<(String, Place)>,
    /// Byte offset of what follows the header, and lines of it.
    pub(super) end: usize,
    pub(super) lines: u64,
    /// Fields that are not used.
    pub(super) unused: Vec<String>,
}

/// Whether a header ends within these bytes.
pub(super) fn ends(head: &[u8]) -> bool {
    let last = |line: &[u8]| line.trim_ascii_start().starts_with(LAST.as_bytes());
    // What follows the last line end may go on.
    head.iter().rposition(|b| *b == b'\n').is_some_and(|end| head[..end].split(|b| *b == b'\n').any(last))
}

/// Parses the header.
pub(super) fn parse(content: &[u8]) -> Result<Header, ReadError> {
    let mut lines = Lines::new(content);
    let mut fields = Fields { found: Vec::new(), end: Place::File };
    while fields.find(&[LAST]).is_none() {
        let Some(line) = lines.next()? else {
            let expected = format!("a field {LAST} at the end of the header");
            return Err(ReadError::input(lines.end(), expected, "the end of the file", super::HINT));
        };
        if !line.text.trim_ascii().is_empty() {
            fields.take(line.text, line.place())?;
        }
    }
    fields.end = lines.end();
    let rank = fields.rank()?;
    let (sizes, place_of_sizes) = fields.sizes(rank)?;
    let (kind, _) = fields.kind()?;
    let (numbers, place_of_numbers) = fields.whole(&["ElementNumberOfChannels"], 1)?.unwrap_or((1, place_of_sizes));
    let (origin, axes) = fields.affine(rank)?;
    Ok(Header {
        kind,
        big_endian: fields.truth(&BYTE_ORDER, false)?,
        is_compressed: fields.truth(&["CompressedData"], false)?,
        is_text: !fields.truth(&["BinaryData"], true)?,
        sizes: [sizes[0], sizes[1], sizes[2]],
        frames: sizes.get(3).copied().unwrap_or(1),
        place_of_sizes,
        numbers: numbers as u64,
        place_of_numbers,
        origin,
        axes,
        header_size: fields.whole(&["HeaderSize"], -1)?.map_or(0, |(n, _)| n),
        data_file: fields.data_file(),
        end: lines.offset(),
        lines: lines.number(),
        unused: fields.unused(),
    })
}

fn wrong(place: Place, expected: &str, found: &str) -> ReadError {
    let hint = "the header is damaged, or a field is not of this kind of volume";
    ReadError::input(place, expected, format!("'{}'", escaped(found.as_bytes(), 60)), hint)
}

/// The fields as they are written.
struct Fields {
    found: Vec<(String, String, Place)>,
    end: Place,
}

impl Fields {
    fn take(&mut self, line: &[u8], place: Place) -> Result<(), ReadError> {
        let field = std::str::from_utf8(line).ok().and_then(|text| text.split_once('='));
        let Some((name, value)) = field else {
            let found = format!("'{}'", escaped(line, 60));
            return Err(ReadError::input(place, "a line Field = value", found, super::HINT));
        };
        let name = name.trim();
        let value = value.trim();
        let one = [&BYTE_ORDER[..], &OFFSET, &MATRIX].into_iter().find(|names| names.contains(&name));
        if self.find(one.unwrap_or(&[name])).is_some() {
            return Err(wrong(place, "each field once", name));
        }
        if self.found.len() == MAX_FIELDS {
            return Err(wrong(place, &format!("at most {MAX_FIELDS} fields"), name));
        }
        self.found.push((name.to_owned(), value.to_owned(), place));
        Ok(())
    }

    /// The field of one of these names.
    fn find(&self, names: &[&str]) -> Option<(&str, Place)> {
        self.found.iter().find(|f| names.contains(&f.0.as_str())).map(|f| (f.1.as_str(), f.2))
    }

    fn required(&self, name: &str) -> Result<(&str, Place), ReadError> {
        let missing = || ReadError::input(self.end, format!("a field {name}"), "none in the header", super::HINT);
        self.find(&[name]).ok_or_else(missing)
    }

    fn truth(&self, names: &[&str], default: bool) -> Result<bool, ReadError> {
        match self.find(names) {
            None => Ok(default),
            Some((text, place)) => match text.to_ascii_lowercase().as_str() {
                "true" | "t" | "1" => Ok(true),
                "false" | "f" | "0" => Ok(false),
                _ => Err(wrong(place, "True or False", text)),
            },
        }
    }

    fn whole(&self, names: &[&str], least: i64) -> Result<Option<(i64, Place)>, ReadError> {
        let Some((text, place)) = self.find(names) else { return Ok(None) };
        let number = text.parse().ok().filter(|n: &i64| *n >= least);
        let wrong = || wrong(place, &format!("a whole number from {least}"), text);
        number.map(|n| Some((n, place))).ok_or_else(wrong)
    }

    /// Dimensions: three, or four with a series along the last.
    fn rank(&self) -> Result<usize, ReadError> {
        if let Some((kind, place)) = self.find(&["ObjectType"]).filter(|(kind, _)| *kind != "Image") {
            return Err(wrong(place, "ObjectType = Image; other objects of MetaIO are not read", kind));
        }
        match self.required("NDims")? {
            ("3", _) => Ok(3),
            ("4", _) => Ok(4),
            ("2", place) => {
                let hint = "it is a picture, not a volume: save it as PNG, or stack several into one volume, such as with Fiji (File > Import > Image Sequence, \
                    File > Save As > Nrrd)";
                Err(ReadError { hint, ..wrong(place, "NDims = 3, or 4 for a series of volumes", "2") })
            }
            (other, place) => Err(wrong(place, "NDims = 3, or 4 for a series of volumes", other)),
        }
    }

    fn sizes(&self, rank: usize) -> Result<(Vec<u64>, Place), ReadError> {
        let (text, place) = self.required("DimSize")?;
        let sizes: Option<Vec<u64>> =
            text.split_ascii_whitespace().map(|w| w.parse().ok().filter(|n| *n > 0)).collect();
        let sizes = sizes.filter(|sizes| sizes.len() == rank);
        sizes.map(|s| (s, place)).ok_or_else(|| wrong(place, &format!("{rank} sizes above 0"), text))
    }

    fn kind(&self) -> Result<(Kind, Place), ReadError> {
        let (name, place) = self.required("ElementType")?;
        // Several channels may say so in the type too.
        let kind = match name.strip_suffix("_ARRAY").unwrap_or(name) {
            "MET_CHAR" => Kind::I8,
            "MET_UCHAR" => Kind::U8,
            "MET_SHORT" => Kind::I16,
            "MET_USHORT" => Kind::U16,
            "MET_INT" | "MET_LONG" => Kind::I32,
            "MET_UINT" | "MET_ULONG" => Kind::U32,
            "MET_LONG_LONG" => Kind::I64,
            "MET_ULONG_LONG" => Kind::U64,
            "MET_FLOAT" => Kind::F32,
            "MET_DOUBLE" => Kind::F64,
            _ => return Err(wrong(place, "an ElementType of real numbers, from MET_CHAR to MET_DOUBLE", name)),
        };
        Ok((kind, place))
    }

    /// So many finite numbers.
    fn numbers(&self, names: &[&str], n: usize) -> Result<Option<(Vec<f64>, Place)>, ReadError> {
        let Some((text, place)) = self.find(names) else { return Ok(None) };
        let finite = |w: &str| w.parse::<f64>().ok().filter(|v| v.is_finite());
        let numbers: Option<Vec<f64>> = text.split_ascii_whitespace().map(finite).collect();
        let numbers = numbers.filter(|numbers| numbers.len() == n);
        numbers.map(|v| Some((v, place))).ok_or_else(|| wrong(place, &format!("{n} finite numbers"), text))
    }

    /// Place of voxel (0, 0, 0) and steps of the lattice: a row of the matrix is the direction of an axis.
    fn affine(&self, rank: usize) -> Result<(DVec3, DMat3), ReadError> {
        let vector = |v: &[f64]| DVec3::new(v[0], v[1], v[2]);
        let spacing = match self.numbers(&["ElementSpacing"], rank)? {
            None => self.numbers(&["ElementSize"], rank)?,
            spacing => spacing,
        };
        let origin = self.numbers(&OFFSET, rank)?.map_or(DVec3::ZERO, |(v, _)| vector(&v));
        let mut axes = DMat3::IDENTITY;
        let mut place = Place::File;
        if let Some((rows, at)) = self.numbers(&MATRIX, rank * rank)? {
            let rows: Vec<&[f64]> = rows.chunks_exact(rank).take(3).collect();
            if rows.iter().any(|row| row[3..].iter().any(|v| *v != 0.0)) {
                let found = rows.iter().map(|row| format!("{row:?} ")).collect::<String>();
                return Err(wrong(at, "axes of space that do not lead along the series", &found));
            }
            (axes, place) = (DMat3::from_cols(vector(rows[0]), vector(rows[1]), vector(rows[2])), at);
        }
        if let Some((spacing, at)) = spacing {
            axes *= DMat3::from_diagonal(vector(&spacing));
            place = at;
        }
        lattice::check(origin, &axes, place, super::HINT)?;
        Ok((origin, axes))
    }

    fn data_file(&self) -> Option<(String, Place)> {
        let (name, place) = self.find(&[LAST])?;
        (!["LOCAL", "Local", "local"].contains(&name)).then(|| (name.to_owned(), place))
    }

    fn unused(&self) -> Vec<String> {
        let known: [&[&str]; 6] = [&USED, &BYTE_ORDER, &OFFSET, &MATRIX, &WITHOUT_EFFECT, &[LAST]];
        let unused = |name: &str| known.iter().all(|names| !names.contains(&name));
        self.found.iter().map(|f| &f.0).filter(|name| unused(name)).cloned().collect()
    }
}
