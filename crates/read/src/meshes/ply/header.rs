//! The header of a PLY file: encoding, elements and their properties.

use crate::error::{Place, ReadError};
use splat_core::text::escaped;

/// Longest line accepted, bytes.
pub(super) const MAX_LINE: usize = 1 << 20;
/// Most properties and elements together; real files have some dozens.
const MAX_ENTRIES: usize = 4096;

/// How the body is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// Type of one stored number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Type {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Type {
    fn named(name: &[u8]) -> Option<Self> {
        Some(match name {
            b"char" | b"int8" => Self::I8,
            b"uchar" | b"uint8" => Self::U8,
            b"short" | b"int16" => Self::I16,
            b"ushort" | b"uint16" => Self::U16,
            b"int" | b"int32" => Self::I32,
            b"uint" | b"uint32" => Self::U32,
            b"float" | b"float32" => Self::F32,
            b"double" | b"float64" => Self::F64,
            _ => return None,
        })
    }

    /// Bytes of one number in a binary file.
    pub(super) fn size(self) -> u64 {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// Range of an integer type; `None` for floating point.
    pub(super) fn integer_range(self) -> Option<(i64, i64)> {
        Some(match self {
            Self::I8 => (i8::MIN.into(), i8::MAX.into()),
            Self::U8 => (0, u8::MAX.into()),
            Self::I16 => (i16::MIN.into(), i16::MAX.into()),
            Self::U16 => (0, u16::MAX.into()),
            Self::I32 => (i32::MIN.into(), i32::MAX.into()),
            Self::U32 => (0, u32::MAX.into()),
            Self::F32 | Self::F64 => return None,
        })
    }
}

/// One number or a counted list of numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Shape {
    Scalar(Type),
    List { count: Type, item: Type },
}

/// One property of an element.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Property {
    pub(super) name: Vec<u8>,
    pub(super) shape: Shape,
    pub(super) line: u64,
}

/// A table of the file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Element {
    pub(super) name: Vec<u8>,
    pub(super) count: u64,
    pub(super) properties: Vec<Property>,
    pub(super) line: u64,
}

/// A comment `organza KEY REST`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Comment {
    pub(super) key: Vec<u8>,
    pub(super) rest: Vec<u8>,
    pub(super) line: u64,
}

/// What the header says, and where the body begins.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
    /// Comments of our own.
    pub(super) comments: Vec<Comment>,
    /// Names of files that comments `TextureFile` name.
    pub(super) textures: Vec<Vec<u8>>,
    /// Byte offset of the body.
    pub(super) body: usize,
    /// Line number of the body's first line.
    pub(super) body_line: u64,
}

/// How a file of 3D Gaussian splats is told, and how it has them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum GaussianKind {
    /// Numbers as they are trained: colour as spherical harmonics, or red, green and blue, log scale, rotation, logit of the opacity.
    Trained,
    /// Words, between the bounds of chunks.
    Packed,
}

impl Header {
    /// Whether there are faces: else vertices are points.
    pub(super) fn is_mesh(&self) -> bool {
        self.elements.iter().any(|e| matches!(e.name.as_slice(), b"face" | b"tristrips") && e.count > 0)
    }

    /// Whether its vertices are Gaussians without any colour that is read.
    pub(super) fn has_gaussians_without_colors(&self) -> bool {
        let Some(vertex) = self.elements.iter().find(|e| e.name == b"vertex") else { return false };
        let has = |name: &[u8]| vertex.properties.iter().any(|p| p.name == name);
        has(b"scale_0") && has(b"rot_0") && has(b"opacity") && !has(b"f_dc_0") && !has(b"red")
    }

    /// How its vertices are Gaussians, if they are.
    pub(super) fn gaussians(&self) -> Option<GaussianKind> {
        let vertex = self.elements.iter().find(|e| e.name == b"vertex")?;
        let has = |names: &[&[u8]]| names.iter().all(|name| vertex.properties.iter().any(|p| p.name == *name));
        if has(&[b"scale_0", b"rot_0", b"opacity"]) && (has(&[b"f_dc_0"]) || has(&[b"red"])) {
            return Some(GaussianKind::Trained);
        }
        has(&[b"packed_position", b"packed_rotation", b"packed_scale", b"packed_color"]).then_some(GaussianKind::Packed)
    }
}

/// The place of a whole line.
pub(super) fn at_line(line: u64) -> Place {
    Place::Line { line, column: 0 }
}

/// Parses the header.
pub(super) fn parse(content: &[u8]) -> Result<Header, ReadError> {
    let start = if content.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
    let mut lines = Lines { content, at: start, line: 0, cr_only: false };
    let magic = lines.next()?;
    if magic.trim_ascii() != b"ply" {
        let found = if content.is_empty() { "an empty file".to_owned() } else { shown(magic) };
        return Err(ReadError::input(Place::Byte(0), "'ply' at byte 0", found, "is this a PLY file?"));
    }
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    let mut comments = Vec::new();
    let mut textures = Vec::new();
    let mut entries = 0;
    loop {
        let text = lines.next()?;
        let line = lines.line;
        let mut words = text.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty());
        match words.next().unwrap_or_default() {
            b"end_header" => break,
            b"comment" => match comment(text, line) {
                Some(own) => comments.push(own),
                None => match texture(text) {
                    Some(name) => textures.push(name),
                    None => continue,
                },
            },
            b"obj_info" => continue,
            b"format" if encoding.is_none() => encoding = Some(format(&mut words, line, text)?),
            b"element" => elements.push(element(&mut words, line, text, &elements)?),
            b"property" => {
                let Some(element) = elements.last_mut() else {
                    return Err(wrong(line, "an element before its properties", text));
                };
                let property = property(&mut words, line, text)?;
                if element.properties.iter().any(|p| p.name == property.name) {
                    return Err(wrong(line, "each property name once in an element", text));
                }
                element.properties.push(property);
            }
            _ => return Err(wrong(line, "format (once), element, property, comment, obj_info or end_header", text)),
        }
        if words.next().is_some() && !text.trim_ascii_start().starts_with(b"comment") {
            return Err(wrong(line, "the end of the line", text));
        }
        entries += 1;
        if entries > MAX_ENTRIES {
            return Err(wrong(line, &format!("at most {MAX_ENTRIES} header entries"), text));
        }
    }
    let encoding = encoding.ok_or_else(|| wrong(lines.line, "a format line before end_header", b"none"))?;
    Ok(Header { encoding, elements, comments, textures, body: lines.at, body_line: lines.line + 1 })
}

/// A comment of our own, and none of somebody else's.
fn comment(text: &[u8], line: u64) -> Option<Comment> {
    let rest =
        text.trim_ascii().strip_prefix(b"comment")?.trim_ascii_start().strip_prefix(b"organza ")?.trim_ascii_start();
    let end = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
    let (key, rest) = rest.split_at(end);
    Some(Comment { key: key.to_vec(), rest: rest.trim_ascii().to_vec(), line })
}

/// The name of a texture, which a comment `TextureFile` has.
fn texture(text: &[u8]) -> Option<Vec<u8>> {
    const KEY: &[u8] = b"TextureFile";
    let rest = text.trim_ascii().strip_prefix(b"comment")?.trim_ascii_start();
    let (key, name) = rest.split_at_checked(KEY.len())?;
    let name = name.trim_ascii();
    (key.eq_ignore_ascii_case(KEY) && !name.is_empty()).then(|| name.to_vec())
}

fn format<'a>(words: &mut impl Iterator<Item = &'a [u8]>, line: u64, text: &[u8]) -> Result<Encoding, ReadError> {
    let encoding = match words.next().unwrap_or_default() {
        b"ascii" => Encoding::Ascii,
        b"binary_little_endian" => Encoding::LittleEndian,
        b"binary_big_endian" => Encoding::BigEndian,
        _ => return Err(wrong(line, "format ascii, binary_little_endian or binary_big_endian", text)),
    };
    match words.next() {
        Some(b"1.0") => Ok(encoding),
        _ => Err(wrong(line, "version 1.0", text)),
    }
}

fn element<'a>(
    words: &mut impl Iterator<Item = &'a [u8]>,
    line: u64,
    text: &[u8],
    before: &[Element],
) -> Result<Element, ReadError> {
    let (Some(name), Some(count)) = (words.next(), words.next()) else {
        return Err(wrong(line, "element NAME COUNT", text));
    };
    let count = std::str::from_utf8(count).ok().and_then(|c| c.parse().ok());
    let count = count.ok_or_else(|| wrong(line, "a whole number of elements, at most 18446744073709551615", text))?;
    if before.iter().any(|e| e.name == name) {
        return Err(wrong(line, "each element name once", text));
    }
    Ok(Element { name: name.to_vec(), count, properties: Vec::new(), line })
}

fn property<'a>(words: &mut impl Iterator<Item = &'a [u8]>, line: u64, text: &[u8]) -> Result<Property, ReadError> {
    let mut type_named = |expected: &str| -> Result<(Type, bool), ReadError> {
        match words.next() {
            Some(b"list") => Ok((Type::U8, true)),
            Some(word) => Type::named(word).map(|t| (t, false)).ok_or_else(|| wrong(line, expected, text)),
            None => Err(wrong(line, expected, text)),
        }
    };
    const TYPES: &str = "char, uchar, short, ushort, int, uint, float, double, or list COUNT_TYPE ITEM_TYPE";
    let shape = match type_named(TYPES)? {
        (scalar, false) => Shape::Scalar(scalar),
        (_, true) => match (type_named(TYPES)?, type_named(TYPES)?) {
            ((count, false), (item, false)) if count.integer_range().is_some() => Shape::List { count, item },
            _ => return Err(wrong(line, "list with an integer count type and a number type", text)),
        },
    };
    let name = words.next().ok_or_else(|| wrong(line, "a property name", text))?;
    Ok(Property { name: name.to_vec(), shape, line })
}

fn wrong(line: u64, expected: &str, text: &[u8]) -> ReadError {
    ReadError::input(at_line(line), expected, shown(text), "the header of the PLY file is damaged or not PLY 1.0")
}

fn shown(text: &[u8]) -> String {
    format!("'{}'", escaped(text.trim_ascii(), 60))
}

/// Header lines, ended by LF, CR LF or CR.
struct Lines<'a> {
    content: &'a [u8],
    at: usize,
    line: u64,
    /// The first line ended with CR alone: an LF after the last CR belongs to the body.
    cr_only: bool,
}

impl<'a> Lines<'a> {
    fn next(&mut self) -> Result<&'a [u8], ReadError> {
        self.line += 1;
        let rest = &self.content[self.at..];
        let window = &rest[..rest.len().min(MAX_LINE)];
        let Some(length) = window.iter().position(|b| matches!(b, b'\n' | b'\r')) else {
            if self.line == 1 {
                self.at = self.content.len();
                return Ok(window);
            }
            let (expected, found) = if window.len() == MAX_LINE {
                ("a line of at most 1 MiB", "a longer one")
            } else {
                ("end_header", "the end of the file")
            };
            return Err(ReadError::input(at_line(self.line), expected, found, "the file is truncated or damaged"));
        };
        let crlf = rest[length] == b'\r' && rest.get(length + 1) == Some(&b'\n');
        if self.line == 1 {
            self.cr_only = rest[length] == b'\r' && !crlf;
        }
        self.at += length + if crlf && !self.cr_only { 2 } else { 1 };
        Ok(&rest[..length])
    }
}
