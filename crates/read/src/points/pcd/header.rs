//! The header of a PCD file: lines of a keyword and its values, up to `DATA`.

use super::TRUNCATED;
use crate::error::{Place, ReadError};
use crate::text::{Line, Lines, Word};
use splat_core::text::{counted, escaped};

/// Most fields of a point, and most numbers of one field; real files have tens of fields, histograms of some hundred numbers.
const MOST_FIELDS: usize = 1024;
const MOST_NUMBERS: usize = 1 << 16;

/// How points are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Data {
    Text,
    Binary,
    Compressed,
}

/// A number's type; its size stands beside it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Signed,
    Unsigned,
    Float,
}

/// A field of a point.
#[derive(Debug, Clone)]
pub(super) struct Field {
    pub(super) name: Vec<u8>,
    pub(super) kind: Kind,
    /// Bytes of a number: 1, 2, 4 or 8.
    pub(super) size: usize,
    /// Numbers of the field.
    pub(super) count: usize,
    /// Bytes and numbers of a point before it.
    pub(super) offset: usize,
    pub(super) column: usize,
}

impl Field {
    /// Lowest and highest value of an integer.
    pub(super) fn integer_range(&self) -> Option<(i128, i128)> {
        let bits = 8 * self.size as u32;
        match self.kind {
            Kind::Signed => Some((-(1 << (bits - 1)), (1 << (bits - 1)) - 1)),
            Kind::Unsigned => Some((0, (1 << bits) - 1)),
            Kind::Float => None,
        }
    }
}

/// What the header says.
#[derive(Debug, Clone)]
pub(super) struct Header {
    pub(super) fields: Vec<Field>,
    pub(super) place_of_fields: Place,
    pub(super) points: u64,
    pub(super) place_of_points: Place,
    pub(super) data: Data,
    /// Whether a pose of the sensor other than none is stated.
    pub(super) has_viewpoint: bool,
    /// First byte after the header, and lines before it.
    pub(super) body: usize,
    pub(super) lines: u64,
}

impl Header {
    /// Bytes of a stored point.
    pub(super) fn record(&self) -> usize {
        self.fields.last().map_or(0, |f| f.offset + f.size * f.count)
    }

    /// Numbers of a point.
    pub(super) fn numbers(&self) -> usize {
        self.fields.last().map_or(0, |f| f.column + f.count)
    }

    /// Bytes of all stored points.
    pub(super) fn bytes(&self) -> Result<u64, ReadError> {
        self.points.checked_mul(self.record() as u64).ok_or_else(|| {
            let expected = "points that a file can hold";
            ReadError::input(self.place_of_points, expected, format!("{} points", self.points), TRUNCATED)
        })
    }
}

/// The statements as they are written.
#[derive(Default)]
struct Statements<'a> {
    found: Vec<(Word<'a>, Vec<Word<'a>>)>,
}

const KNOWN: [&[u8]; 10] =
    [b"VERSION", b"FIELDS", b"COLUMNS", b"SIZE", b"TYPE", b"COUNT", b"WIDTH", b"HEIGHT", b"VIEWPOINT", b"POINTS"];

/// Parses the header.
pub(super) fn parse(content: &[u8]) -> Result<Header, ReadError> {
    let mut lines = Lines::new(content);
    let mut statements = Statements::default();
    let data = loop {
        let Some(line) = lines.next()? else {
            return Err(ReadError::input(lines.end(), "a line DATA", "the end of the file", TRUNCATED));
        };
        if let Some(data) = statements.take(line)? {
            break data;
        }
    };
    let end = Place::Line { line: lines.number(), column: 0 };
    let (fields, place_of_fields) = statements.fields(end)?;
    let (points, place_of_points) = statements.points(end)?;
    let has_viewpoint = statements.has_viewpoint()?;
    let body = lines.offset();
    let lines = lines.number();
    Ok(Header { fields, place_of_fields, points, place_of_points, data, has_viewpoint, body, lines })
}

fn wrong(word: Word<'_>, expected: &str) -> ReadError {
    ReadError::input(word.place(), expected, word.shown(), "the header is damaged, or this is not a PCD file")
}

fn whole(word: Word<'_>, expected: &str) -> Result<u64, ReadError> {
    let number = std::str::from_utf8(word.text).ok().and_then(|t| t.parse().ok());
    number.ok_or_else(|| wrong(word, expected))
}

impl<'a> Statements<'a> {
    /// Takes a line; the last one says how points are stored.
    fn take(&mut self, line: Line<'a>) -> Result<Option<Data>, ReadError> {
        let mut words = line.words(false);
        let Some(keyword) = words.next().filter(|w| !w.text.starts_with(b"#")) else { return Ok(None) };
        let values: Vec<Word<'a>> = words.collect();
        if keyword.text == b"DATA" {
            return match values.first().map(|w| w.text) {
                Some(b"ascii") => Ok(Some(Data::Text)),
                Some(b"binary") => Ok(Some(Data::Binary)),
                Some(b"binary_compressed") => Ok(Some(Data::Compressed)),
                _ => Err(wrong(*values.first().unwrap_or(&keyword), "DATA ascii, binary or binary_compressed")),
            };
        }
        if !KNOWN.contains(&keyword.text) {
            return Err(wrong(keyword, "a keyword of PCD such as FIELDS, SIZE or DATA"));
        }
        if self.find(keyword.text).is_some() {
            return Err(wrong(keyword, "each keyword once"));
        }
        self.found.push((keyword, values));
        Ok(None)
    }

    fn find(&self, keyword: &[u8]) -> Option<&(Word<'a>, Vec<Word<'a>>)> {
        self.found.iter().find(|(word, _)| word.text == keyword)
    }

    /// The values of a keyword, as many as there are fields.
    fn row(&self, keyword: &str, fields: usize, end: Place) -> Result<&[Word<'a>], ReadError> {
        let Some((word, values)) = self.find(keyword.as_bytes()) else {
            return Err(ReadError::input(end, format!("a line {keyword} before DATA"), "none", TRUNCATED));
        };
        if values.len() == fields {
            return Ok(values);
        }
        let expected = format!("{}, one a field", counted(fields as u64, "value"));
        let found = values.len().to_string();
        Err(ReadError::input(word.place(), expected, found, "the header is damaged"))
    }

    fn fields(&self, end: Place) -> Result<(Vec<Field>, Place), ReadError> {
        let Some((keyword, names)) = self.find(b"FIELDS").or_else(|| self.find(b"COLUMNS")) else {
            return Err(ReadError::input(end, "a line FIELDS before DATA", "none", TRUNCATED));
        };
        if names.len() > MOST_FIELDS {
            let expected = format!("at most {MOST_FIELDS} fields");
            return Err(ReadError::input(keyword.place(), expected, names.len().to_string(), "is this a PCD file?"));
        }
        let sizes = self.row("SIZE", names.len(), end)?;
        let kinds = self.row("TYPE", names.len(), end)?;
        let counts = match self.find(b"COUNT") {
            Some(_) => Some(self.row("COUNT", names.len(), end)?),
            None => None,
        };
        let mut fields: Vec<Field> = Vec::with_capacity(names.len());
        let mut offset = 0;
        let mut column = 0;
        for (i, name) in names.iter().enumerate() {
            // Padding is `_`, as often as there is some.
            if name.text != b"_" && fields.iter().any(|f| f.name == name.text) {
                return Err(wrong(*name, "each field once"));
            }
            let (kind, size) = number_type(kinds[i], sizes[i])?;
            let count = counts.map_or(Ok(1), |c| numbers(c[i]))?;
            fields.push(Field { name: name.text.to_vec(), kind, size, count, offset, column });
            offset += size * count;
            column += count;
        }
        Ok((fields, keyword.place()))
    }

    /// The number of points: `POINTS`, and the product of `WIDTH` and `HEIGHT`, of which the oldest files lack some.
    fn points(&self, end: Place) -> Result<(u64, Place), ReadError> {
        let number = |keyword: &str| -> Result<Option<(u64, Word<'a>)>, ReadError> {
            let Some((word, values)) = self.find(keyword.as_bytes()) else { return Ok(None) };
            let [value] = values.as_slice() else { return Err(wrong(*word, "one number after the keyword")) };
            Ok(Some((whole(*value, "a whole number")?, *value)))
        };
        let width = number("WIDTH")?;
        let height = number("HEIGHT")?.map_or(1, |(n, _)| n);
        let product = match width {
            Some((width, word)) => {
                let product = width.checked_mul(height);
                Some((product.ok_or_else(|| wrong(word, "WIDTH x HEIGHT below 2^64"))?, word))
            }
            None => None,
        };
        match (number("POINTS")?, product) {
            (Some((points, word)), Some((product, _))) if points != product => {
                Err(wrong(word, &format!("{product} points, WIDTH x HEIGHT")))
            }
            (Some((points, word)), _) | (None, Some((points, word))) => Ok((points, word.place())),
            (None, None) => Err(ReadError::input(end, "a line POINTS before DATA", "none", TRUNCATED)),
        }
    }

    fn has_viewpoint(&self) -> Result<bool, ReadError> {
        let Some((keyword, values)) = self.find(b"VIEWPOINT") else { return Ok(false) };
        if values.len() != 7 {
            return Err(wrong(*keyword, "VIEWPOINT with a place and a quaternion, 7 numbers"));
        }
        let pose: Vec<f64> = values.iter().map(|w| w.number()).collect::<Result<_, _>>()?;
        Ok(pose != [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    }
}

fn number_type(kind: Word<'_>, size: Word<'_>) -> Result<(Kind, usize), ReadError> {
    let known = match kind.text {
        b"I" => Kind::Signed,
        b"U" => Kind::Unsigned,
        b"F" => Kind::Float,
        _ => return Err(wrong(kind, "a type I, U or F")),
    };
    match (known, size.text) {
        (Kind::Signed | Kind::Unsigned, b"1") => Ok((known, 1)),
        (Kind::Signed | Kind::Unsigned, b"2") => Ok((known, 2)),
        (_, b"4") => Ok((known, 4)),
        (_, b"8") => Ok((known, 8)),
        _ => Err(wrong(size, &format!("a size of type {} in bytes", escaped(kind.text, 4)))),
    }
}

fn numbers(count: Word<'_>) -> Result<usize, ReadError> {
    let expected = format!("1 to {MOST_NUMBERS} numbers of a field");
    let n = whole(count, &expected)?;
    if (1..=MOST_NUMBERS as u64).contains(&n) { Ok(n as usize) } else { Err(wrong(count, &expected)) }
}
