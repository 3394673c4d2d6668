//! Numbers of an ascii body: one record a line, blank lines skipped, any line end.

use super::body::Source;
use super::header::{MAX_LINE, Type};
use crate::error::{Place, ReadError};
use crate::text::decimal::{CUT, decimal};
use splat_core::text::escaped;

/// A cursor over the text.
pub(super) struct Ascii<'a> {
    content: &'a [u8],
    at: usize,
    line: u64,
    line_start: usize,
    token: (usize, usize),
}

impl<'a> Ascii<'a> {
    pub(super) fn new(content: &'a [u8], body: usize, line: u64) -> Self {
        Self { content, at: body, line, line_start: body, token: (body, body) }
    }

    fn skip_blanks(&mut self) {
        while self.content.get(self.at).is_some_and(|b| matches!(b, b' ' | b'\t' | 0x0b | 0x0c)) {
            self.at += 1;
        }
    }

    fn newline(&mut self) {
        let crlf = self.content[self.at..].starts_with(b"\r\n");
        self.at += if crlf { 2 } else { 1 };
        self.line += 1;
        self.line_start = self.at;
    }

    fn at_line_end(&self) -> bool {
        self.content.get(self.at).is_none_or(|b| matches!(b, b'\n' | b'\r'))
    }

    /// The next word of the line; empty at its end.
    fn word(&mut self) -> Result<&'a [u8], ReadError> {
        self.skip_blanks();
        let start = self.at;
        while self.content.get(self.at).is_some_and(|b| !b.is_ascii_whitespace() && *b != 0x0b) {
            self.at += 1;
        }
        self.token = (start, self.at);
        if self.at - self.line_start > MAX_LINE {
            let place = Place::Line { line: self.line, column: 0 };
            let hint = "split the line: one vertex or face a line";
            return Err(ReadError::input(place, "a line of at most 1 MiB", "a longer one", hint));
        }
        Ok(&self.content[start..self.at])
    }

    fn wrong(&self, expected: &str) -> ReadError {
        let hint = "numbers are written with a point, one record a line";
        ReadError::input(self.place(), expected, self.shown(0.0), hint)
    }
}

impl Source for Ascii<'_> {
    fn begin_record(&mut self) -> Result<(), ReadError> {
        loop {
            self.skip_blanks();
            if !self.at_line_end() || self.at == self.content.len() {
                self.token = (self.at, self.at);
                return Ok(());
            }
            self.newline();
        }
    }

    fn number(&mut self, kind: Type) -> Result<f64, ReadError> {
        let word = self.word()?;
        if let Some((low, high)) = kind.integer_range() {
            return match std::str::from_utf8(word).unwrap_or("?").parse::<i64>() {
                Ok(n) if (low..=high).contains(&n) => Ok(n as f64),
                _ => Err(self.wrong(&format!("an integer from {low} to {high}"))),
            };
        }
        let last = self.at == self.content.len();
        decimal(word, last)
            .ok_or_else(|| self.wrong(if last && decimal(word, false).is_some() { CUT } else { "a decimal number" }))
    }

    fn end_record(&mut self) -> Result<(), ReadError> {
        if !self.word()?.is_empty() {
            return Err(self.wrong("the end of the line"));
        }
        if self.at < self.content.len() {
            self.newline();
        }
        Ok(())
    }

    fn finish(&mut self) -> Result<(), ReadError> {
        self.begin_record()?;
        if self.at == self.content.len() {
            return Ok(());
        }
        self.word()?;
        Err(self.wrong("the end of the file after the last element"))
    }

    fn remaining(&self) -> u64 {
        // The last number needs no separator after it.
        (self.content.len() - self.at) as u64 + 1
    }

    fn least_bytes(&self, _kind: Type) -> u64 {
        2
    }

    fn place(&self) -> Place {
        Place::Line { line: self.line, column: (self.token.0 - self.line_start) as u64 + 1 }
    }

    fn shown(&self, _value: f64) -> String {
        match &self.content[self.token.0..self.token.1] {
            [] if self.at == self.content.len() => "the end of the file".to_owned(),
            [] => "the end of the line".to_owned(),
            word => format!("'{}'", escaped(word, 40)),
        }
    }
}
