//! The points of a PCD file, from text or bytes.

use super::columns::{Columns, Number};
use super::header::{Field, Header, Kind};
use super::{LONGER, TRUNCATED};
use crate::error::{Place, ReadError};
use crate::reading::Reading;
use crate::text::{Lines, Word};
use splat_core::text::counted;

/// Points between two looks at whether to stop.
const LOOK: u64 = 1 << 14;

fn look(point: u64, reading: &Reading<'_>) -> Result<(), ReadError> {
    if point.is_multiple_of(LOOK) { reading.go_on() } else { Ok(()) }
}

/// Points as bytes.
pub(super) struct Bytes<'a> {
    content: &'a [u8],
    /// Where the body begins in the file, for messages.
    start: usize,
    /// First byte of each field, and bytes from one point to the next.
    layout: Vec<[usize; 2]>,
}

impl<'a> Bytes<'a> {
    /// `content` holds all points that the header announces.
    pub(super) fn new(content: &'a [u8], start: usize, layout: Vec<[usize; 2]>) -> Self {
        Self { content, start, layout }
    }

    pub(super) fn read(&self, header: &Header, columns: &mut Columns, reading: &Reading<'_>) -> Result<(), ReadError> {
        columns.reserve(header.points, reading)?;
        for point in 0..header.points {
            look(point, reading)?;
            let number = |field: usize| {
                let [first, step] = self.layout[field];
                let at = first + step * point as usize;
                (binary(&header.fields[field], &self.content[at..]), at)
            };
            columns.push(|field| number(field).0).map_err(|(field, expected, hint)| {
                let (value, at) = number(field);
                let place = Place::Byte((self.start + at) as u64);
                ReadError::input(place, expected, format!("{} at point {point}", value.value), hint)
            })?;
        }
        Ok(())
    }
}

/// The first number of a field.
fn binary(field: &Field, bytes: &[u8]) -> Number {
    let mut wide = [0; 8];
    wide[..field.size].copy_from_slice(&bytes[..field.size]);
    let bits = u64::from_le_bytes(wide);
    let unused = 64 - 8 * field.size as u32;
    let value = match (field.kind, field.size) {
        (Kind::Float, 4) => f32::from_bits(bits as u32).into(),
        (Kind::Float, _) => f64::from_bits(bits),
        (Kind::Unsigned, _) => bits as f64,
        // Shifted up and down again: the sign follows.
        (Kind::Signed, _) => (((bits << unused) as i64) >> unused) as f64,
    };
    Number { value, bits: bits as u32 }
}

/// Points as text, one a line.
pub(super) struct Text<'a> {
    lines: Lines<'a>,
}

impl<'a> Text<'a> {
    pub(super) fn new(content: &'a [u8], header: &Header) -> Self {
        Self { lines: Lines::after(&content[header.body..], header.lines) }
    }

    pub(super) fn read(
        mut self,
        header: &Header,
        columns: &mut Columns,
        reading: &Reading<'_>,
    ) -> Result<(), ReadError> {
        let points = header.points;
        let numbers = header.numbers();
        let mut count = 0;
        while let Some(line) = self.lines.next()? {
            let words: Vec<Word<'a>> = line.words(false).collect();
            if words.is_empty() {
                continue;
            }
            if words.len() != numbers || count == points {
                let expected =
                    if count == points { "the end of the file".into() } else { counted(numbers as u64, "number") };
                let found = format!("{} on the line", words.len());
                let hint = if count == points || words.len() > numbers { LONGER } else { TRUNCATED };
                return Err(ReadError::input(line.place(), expected, found, hint));
            }
            look(count, reading)?;
            // What the file cannot hold is not made room for: a line at a time.
            columns.reserve_one(count, reading)?;
            point(&words, header, columns)?;
            count += 1;
        }
        if count == points {
            return Ok(());
        }
        let expected = format!("{}, as announced", counted(points, "point"));
        Err(ReadError::input(header.place_of_points, expected, counted(count, "point"), TRUNCATED))
    }
}

/// The point of a line. All of its words have to be numbers of their types.
fn point(words: &[Word<'_>], header: &Header, columns: &mut Columns) -> Result<(), ReadError> {
    let mut numbers = Vec::with_capacity(header.fields.len());
    for field in &header.fields {
        let values = words[field.column..field.column + field.count].iter().map(|w| textual(field, *w));
        let values: Vec<Number> = values.collect::<Result<_, _>>()?;
        numbers.push(values[0]);
    }
    columns.push(|field| numbers[field]).map_err(|(field, expected, hint)| {
        let word = words[header.fields[field].column];
        ReadError::input(word.place(), expected, word.shown(), hint)
    })
}

fn textual(field: &Field, word: Word<'_>) -> Result<Number, ReadError> {
    let text = std::str::from_utf8(word.text).unwrap_or("?");
    let wrong = |expected: String| {
        ReadError::input(word.place(), expected, word.shown(), "numbers are written with a point, one point a line")
    };
    if let Some((low, high)) = field.integer_range() {
        let number = text.parse::<i128>().ok().filter(|n| (low..=high).contains(n));
        let number = number.ok_or_else(|| wrong(format!("an integer from {low} to {high}")))?;
        return Ok(Number { value: number as f64, bits: number as u32 });
    }
    let value = word.decimal().ok_or_else(|| wrong("a decimal number".to_owned()))?;
    // A packed colour is written as the float that has its bits, or as the whole number of them.
    let bits = text.parse::<u32>().unwrap_or((value as f32).to_bits());
    Ok(Number { value, bits })
}
