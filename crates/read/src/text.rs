//! Text files as lines of words with places.

pub(crate) mod decimal;
#[cfg(any(feature = "vti", feature = "e57"))]
pub(crate) mod xml;

use crate::error::{Place, ReadError};
use crate::text::decimal::{CUT, decimal};
use splat_core::text::escaped;

/// Longest line accepted, bytes.
const MAX_LINE: usize = 1 << 20;

/// The lines of a text; line ends of every system, a byte order mark is skipped.
pub(crate) struct Lines<'a> {
    content: &'a [u8],
    at: usize,
    number: u64,
}

/// One line.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Line<'a> {
    pub(crate) text: &'a [u8],
    /// From 1.
    pub(crate) number: u64,
    /// Whether the file ends with it, without a line end.
    open: bool,
}

/// A word of a line.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Word<'a> {
    pub(crate) text: &'a [u8],
    line: u64,
    /// From 1, bytes.
    column: u64,
    /// Whether the file ends with it.
    open: bool,
}

/// The words of a text between blanks, commas or semicolons, however long its lines are.
pub(crate) struct Words<'a> {
    content: &'a [u8],
    at: usize,
    line: u64,
    line_start: usize,
}

impl<'a> Lines<'a> {
    pub(crate) fn new(content: &'a [u8]) -> Self {
        let at = if content.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
        Self { content, at, number: 0 }
    }

    /// The same behind so many lines of a header.
    pub(crate) fn after(content: &'a [u8], lines: u64) -> Self {
        Self { number: lines, ..Self::new(content) }
    }

    /// Number of the line that was read last.
    pub(crate) fn number(&self) -> u64 {
        self.number
    }

    /// The next line, or `None` at the end.
    pub(crate) fn next(&mut self) -> Result<Option<Line<'a>>, ReadError> {
        if self.at >= self.content.len() {
            return Ok(None);
        }
        self.number += 1;
        let rest = &self.content[self.at..];
        let length = rest.iter().take(MAX_LINE + 1).position(|b| matches!(b, b'\n' | b'\r')).unwrap_or(rest.len());
        if length > MAX_LINE {
            let place = Place::Line { line: self.number, column: 0 };
            return Err(ReadError::input(place, "a line of at most 1 MiB", "a longer one", "is this a text file?"));
        }
        let end = if rest[length..].starts_with(b"\r\n") { 2 } else { 1 };
        self.at += length + end;
        Ok(Some(Line { text: &rest[..length], number: self.number, open: length == rest.len() }))
    }

    /// Bytes read.
    pub(crate) fn offset(&self) -> usize {
        self.at.min(self.content.len())
    }

    /// The words behind the lines that were read.
    pub(crate) fn words(&self) -> Words<'a> {
        Words::new(self.content, self.at.min(self.content.len()), self.number + 1)
    }

    /// Goes on at a byte of the line of this number.
    pub(crate) fn go_to(&mut self, at: usize, line: u64) {
        (self.at, self.number) = (at, line - 1);
    }

    /// The place after the last line.
    pub(crate) fn end(&self) -> Place {
        Place::Line { line: self.number + 1, column: 0 }
    }
}

impl<'a> Line<'a> {
    /// Words between blanks and, if `separators`, between single commas or semicolons.
    pub(crate) fn words(self, separators: bool) -> impl Iterator<Item = Word<'a>> + Clone {
        let parts = move |b: &u8| b.is_ascii_whitespace() || *b == 0x0b || separators && matches!(b, b',' | b';');
        let mut at = 0;
        self.text.split(parts).filter_map(move |text| {
            let column = at as u64 + 1;
            at += text.len() + 1;
            let open = self.open && at > self.text.len();
            (!text.is_empty()).then_some(Word { text, line: self.number, column, open })
        })
    }

    /// The place of the whole line.
    pub(crate) fn place(self) -> Place {
        Place::Line { line: self.number, column: 0 }
    }
}

impl<'a> Words<'a> {
    /// Those from a byte on, which lies in the line of this number.
    pub(crate) fn new(content: &'a [u8], at: usize, line: u64) -> Self {
        Self { content, at, line, line_start: at }
    }

    /// Bytes to come.
    pub(crate) fn left(&self) -> usize {
        self.content.len() - self.at
    }

    /// The byte behind the last word, and the number of its line.
    pub(crate) fn end(&self) -> (usize, u64) {
        (self.at, self.line)
    }
}

impl<'a> Iterator for Words<'a> {
    type Item = Word<'a>;

    fn next(&mut self) -> Option<Word<'a>> {
        let separates = |b: &u8| b.is_ascii_whitespace() || matches!(b, 0x0b | b',' | b';');
        while let Some(byte) = self.content.get(self.at).filter(|b| separates(b)) {
            self.at += 1;
            if *byte == b'\n' || *byte == b'\r' && self.content.get(self.at) != Some(&b'\n') {
                self.line += 1;
                self.line_start = self.at;
            }
        }
        let rest = &self.content[self.at..];
        let text = &rest[..rest.iter().position(separates).unwrap_or(rest.len())];
        let column = (self.at - self.line_start) as u64 + 1;
        self.at += text.len();
        (!text.is_empty()).then_some(Word { text, line: self.line, column, open: self.left() == 0 })
    }
}

impl Word<'_> {
    pub(crate) fn place(self) -> Place {
        Place::Line { line: self.line, column: self.column }
    }

    /// The word without its first bytes.
    pub(crate) fn after(self, bytes: usize) -> Self {
        Self { text: &self.text[bytes..], column: self.column + bytes as u64, ..self }
    }

    /// The word as it may be shown.
    pub(crate) fn shown(self) -> String {
        format!("'{}'", escaped(self.text, 40))
    }

    /// A decimal number, NaN and infinities too, as [`decimal`] reads it.
    pub(crate) fn decimal(self) -> Option<f64> {
        decimal(self.text, self.open)
    }

    /// A finite decimal number, whatever the system's language.
    pub(crate) fn number(self) -> Result<f64, ReadError> {
        match self.decimal() {
            Some(value) if value.is_finite() => Ok(value),
            _ => {
                let hint = "numbers are written with a point; NaN and infinity are not coordinates";
                let expected =
                    if self.open && decimal(self.text, false).is_some() { CUT } else { "a finite decimal number" };
                Err(ReadError::input(self.place(), expected, self.shown(), hint))
            }
        }
    }
}
