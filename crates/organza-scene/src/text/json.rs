//! JSON (RFC 8259) → value tree. Our own reader, because places of values and duplicate keys are wanted.

use super::tree::{Entry, Node, Place, Value, error_at, line_and_column};
use crate::{Error, MAX_SCENE_DEPTH};
use std::collections::HashMap;
use std::path::Path;

/// Parses a JSON document.
pub(crate) fn read_json(file: &Path, text: &str) -> Result<Node, Error> {
    let mut reader = Reader { file, text, at: 0 };
    let node = reader.value(0)?;
    reader.skip_space();
    if reader.at < text.len() {
        return Err(reader.expected("the end of the file"));
    }
    Ok(node)
}

struct Reader<'a> {
    file: &'a Path,
    text: &'a str,
    at: usize,
}

impl Reader<'_> {
    fn error(&self, byte: usize, message: String) -> Error {
        error_at(self.file, self.text, byte, message, "")
    }

    fn expected(&self, what: &str) -> Error {
        let found = match self.text[self.at..].chars().next() {
            Some(c) => format!("`{c}`"),
            None => "the end of the file".into(),
        };
        self.error(self.at, format!("not JSON: expected {what}, found {found}"))
    }

    fn peek(&self) -> Option<u8> {
        self.text.as_bytes().get(self.at).copied()
    }

    fn skip_space(&mut self) {
        while matches!(self.peek(), Some(b' ' | b'\t' | b'\n' | b'\r')) {
            self.at += 1;
        }
    }

    fn take(&mut self, byte: u8, what: &str) -> Result<(), Error> {
        self.skip_space();
        if self.peek() != Some(byte) {
            return Err(self.expected(what));
        }
        self.at += 1;
        Ok(())
    }

    fn value(&mut self, depth: usize) -> Result<Node, Error> {
        self.skip_space();
        let start = self.at;
        if depth > MAX_SCENE_DEPTH {
            let message = format!("expected at most {MAX_SCENE_DEPTH} levels of nesting, found more");
            return Err(self.error(start, message));
        }
        let value = match self.peek() {
            Some(b'{') => self.table(depth)?,
            Some(b'[') => self.list(depth)?,
            Some(b'"') => Value::Text(self.string()?),
            Some(b'-' | b'0'..=b'9') => self.number()?,
            _ => self.word()?,
        };
        Ok(Node { place: Place::Byte(start), value })
    }

    fn word(&mut self) -> Result<Value, Error> {
        let words = [("true", Value::Bool(true)), ("false", Value::Bool(false)), ("null", Value::Null)];
        for (word, value) in words {
            if self.text[self.at..].starts_with(word) {
                self.at += word.len();
                return Ok(value);
            }
        }
        Err(self.expected("a value"))
    }

    fn table(&mut self, depth: usize) -> Result<Value, Error> {
        self.take(b'{', "`{`")?;
        let mut entries: Vec<Entry> = Vec::new();
        let mut seen: HashMap<String, usize> = HashMap::new();
        self.skip_space();
        if self.peek() == Some(b'}') {
            self.at += 1;
            return Ok(Value::Table(entries));
        }
        loop {
            self.skip_space();
            let start = self.at;
            if self.peek() != Some(b'"') {
                return Err(self.expected("a key in double quotes"));
            }
            let key = self.string()?;
            if let Some(first) = seen.insert(key.clone(), start) {
                let (line, column) = line_and_column(self.text, first);
                let message = format!("duplicate key `{}`, first at line {line}, column {column}", crate::shown(&key));
                return Err(error_at(self.file, self.text, start, message, "each key may stand once in its table"));
            }
            self.take(b':', "`:`")?;
            let node = self.value(depth + 1)?;
            entries.push(Entry { key, place: Place::Byte(start), node });
            self.skip_space();
            if self.peek() == Some(b'}') {
                self.at += 1;
                return Ok(Value::Table(entries));
            }
            self.take(b',', "`,` or `}`")?;
        }
    }

    fn list(&mut self, depth: usize) -> Result<Value, Error> {
        self.take(b'[', "`[`")?;
        let mut items = Vec::new();
        self.skip_space();
        if self.peek() == Some(b']') {
            self.at += 1;
            return Ok(Value::List(items));
        }
        loop {
            items.push(self.value(depth + 1)?);
            self.skip_space();
            if self.peek() == Some(b']') {
                self.at += 1;
                return Ok(Value::List(items));
            }
            self.take(b',', "`,` or `]`")?;
        }
    }

    fn digits(&mut self) -> Result<(), Error> {
        if !self.peek().is_some_and(|b| b.is_ascii_digit()) {
            return Err(self.expected("a digit"));
        }
        while self.peek().is_some_and(|b| b.is_ascii_digit()) {
            self.at += 1;
        }
        Ok(())
    }

    fn number(&mut self) -> Result<Value, Error> {
        let start = self.at;
        let mut whole = true;
        if self.peek() == Some(b'-') {
            self.at += 1;
        }
        if self.peek() == Some(b'0') {
            self.at += 1;
        } else {
            self.digits()?;
        }
        if self.peek() == Some(b'.') {
            whole = false;
            self.at += 1;
            self.digits()?;
        }
        if matches!(self.peek(), Some(b'e' | b'E')) {
            whole = false;
            self.at += 1;
            if matches!(self.peek(), Some(b'+' | b'-')) {
                self.at += 1;
            }
            self.digits()?;
        }
        let text = &self.text[start..self.at];
        if let (true, Ok(i)) = (whole, text.parse()) {
            return Ok(Value::Int(i));
        }
        match text.parse::<f64>() {
            Ok(x) if x.is_finite() => Ok(Value::Float(x)),
            _ => Err(self.error(start, format!("expected a finite number, found {}", crate::shown(text)))),
        }
    }

    fn string(&mut self) -> Result<String, Error> {
        let start = self.at;
        self.at += 1;
        let mut out = String::new();
        loop {
            let rest = &self.text[self.at..];
            let Some(c) = rest.chars().next() else {
                return Err(self.error(start, "not JSON: this text has no closing quote".into()));
            };
            self.at += c.len_utf8();
            match c {
                '"' => return Ok(out),
                '\\' => out.push(self.escape()?),
                '\0'..='\u{1f}' => {
                    self.at -= 1;
                    return Err(self.expected("an escaped control character"));
                }
                _ => out.push(c),
            }
        }
    }

    fn escape(&mut self) -> Result<char, Error> {
        let Some(b) = self.peek() else { return Err(self.expected("an escape")) };
        let c = match b {
            b'"' | b'\\' | b'/' => char::from(b),
            b'b' => '\u{8}',
            b'f' => '\u{c}',
            b'n' => '\n',
            b'r' => '\r',
            b't' => '\t',
            b'u' => return self.unicode_escape(),
            _ => return Err(self.expected("one of the escapes \\\" \\\\ \\/ \\b \\f \\n \\r \\t \\u")),
        };
        self.at += 1;
        Ok(c)
    }

    fn unicode_escape(&mut self) -> Result<char, Error> {
        let start = self.at;
        let high = self.four_hex()?;
        let code = if (0xd800..0xdc00).contains(&high) && self.text[self.at..].starts_with("\\u") {
            self.at += 1;
            let low = self.four_hex()?;
            if (0xdc00..0xe000).contains(&low) { 0x10000 + ((high - 0xd800) << 10) + (low - 0xdc00) } else { high }
        } else {
            high
        };
        char::from_u32(code).ok_or_else(|| self.error(start, "not JSON: expected a Unicode character".into()))
    }

    /// Reads `uXXXX`.
    fn four_hex(&mut self) -> Result<u32, Error> {
        let digits = self.text.get(self.at + 1..self.at + 5).filter(|d| d.bytes().all(|b| b.is_ascii_hexdigit()));
        let Some(digits) = digits else { return Err(self.expected("\\u and four hexadecimal digits")) };
        self.at += 5;
        u32::from_str_radix(digits, 16).map_err(|_| self.expected("four hexadecimal digits"))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Value, String> {
        read_json(Path::new("s.json"), text).map(|n| n.value).map_err(|e| e.to_string())
    }

    #[test]
    fn values_are_read() {
        assert_eq!(read(" [1, -2.5e1, true, null] ").map(|v| v.describe()).unwrap(), "a list of 4 values");
        assert_eq!(read(r#""a\n\u00fc\ud83d\ude00""#).unwrap(), Value::Text("a\nü😀".into()));
        assert_eq!(read("9223372036854775808").unwrap(), Value::Float(9.223_372_036_854_776e18));
        assert_eq!(read("-0").unwrap(), Value::Int(0));
    }

    #[test]
    fn errors_have_places() {
        let cases = [
            ("{\"a\": 1,\n \"a\": 2}", "s.json:2:2: duplicate key `a`, first at line 1, column 2"),
            ("[1 2]", "s.json:1:4: not JSON: expected `,` or `]`, found `2`"),
            ("1e999", "s.json:1:1: expected a finite number, found 1e999"),
            ("NaN", "s.json:1:1: not JSON: expected a value, found `N`"),
            ("01", "s.json:1:2: not JSON: expected the end of the file, found `1`"),
            ("\"\\ud800\"", "s.json:1:3: not JSON: expected a Unicode character"),
            ("\"\\ud800\\u0041\"", "s.json:1:3: not JSON: expected a Unicode character"),
            ("\"abc", "s.json:1:1: not JSON: this text has no closing quote"),
        ];
        for (text, expected) in cases {
            assert_eq!(read(text).unwrap_err(), expected, "{text}");
        }
    }

    #[test]
    fn bi25_nesting_is_capped() {
        let deep = "[".repeat(100_000);
        assert!(read(&deep).unwrap_err().contains("64 levels"));
    }
}
