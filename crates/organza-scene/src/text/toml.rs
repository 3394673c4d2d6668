//! TOML → value tree.

use super::tree::{Entry, Node, Place, Value, error_at};
use crate::{Error, MAX_SCENE_DEPTH, shown};
use std::path::Path;
use toml::de::{DeTable, DeValue};
use toml_parser::lexer::TokenKind;

/// Parses a TOML document.
pub(crate) fn read_toml(file: &Path, text: &str) -> Result<Node, Error> {
    check_dotted_keys(file, text)?;
    let table = DeTable::parse(text).map_err(|e| {
        let byte = e.span().map_or(0, |s| s.start);
        let hint = if e.message().contains("duplicate") { "each key may stand once in its table" } else { "" };
        error_at(file, text, byte, format!("not TOML: {}", shown(e.message())), hint)
    })?;
    let reader = Reader { file, text };
    let place = table.span().start;
    Ok(Node { place: Place::Byte(place), value: reader.table(table.into_inner(), 1)? })
}

/// Parses one TOML value, such as `[1, 2]`; the error is a message alone.
pub(crate) fn read_toml_value(text: &str) -> Result<Value, String> {
    let file = Path::new("");
    let message_of = |e: Error| match e {
        Error::Scene { message, .. } => message,
        other => other.to_string(),
    };
    check_dotted_keys(file, text).map_err(message_of)?;
    let value = DeValue::parse(text).map_err(|e| format!("not a TOML value: {}", shown(e.message())))?;
    let node = Reader { file, text }.value(value.into_inner(), 0, 1).map_err(message_of)?;
    Ok(node.value)
}

/// The parser has a limit for brackets but none for `a.b.c…`, and a tree as deep as a file is long would overflow the
/// stack when it is dropped.
fn check_dotted_keys(file: &Path, text: &str) -> Result<(), Error> {
    let mut dots = 0;
    for token in toml_parser::Source::new(text).lex() {
        match token.kind() {
            TokenKind::Dot => dots += 1,
            TokenKind::Atom
            | TokenKind::Whitespace
            | TokenKind::LiteralString
            | TokenKind::BasicString
            | TokenKind::MlLiteralString
            | TokenKind::MlBasicString => {}
            _ => dots = 0,
        }
        if dots > MAX_SCENE_DEPTH {
            return Err(too_deep(file, text, token.span().start()));
        }
    }
    Ok(())
}

fn too_deep(file: &Path, text: &str, byte: usize) -> Error {
    error_at(file, text, byte, format!("expected at most {MAX_SCENE_DEPTH} levels of nesting, found more"), "")
}

struct Reader<'a> {
    file: &'a Path,
    text: &'a str,
}

impl Reader<'_> {
    fn table(&self, table: DeTable<'_>, depth: usize) -> Result<Value, Error> {
        let mut entries = Vec::with_capacity(table.len());
        for (key, value) in table {
            let place = Place::Byte(key.span().start);
            let span = value.span().start;
            // A `[header]` table has the place of its header, which is the key's.
            let node = self.value(value.into_inner(), span, depth)?;
            entries.push(Entry { key: key.into_inner().into_owned(), place, node });
        }
        // The parser keeps keys in alphabetical order; errors should come in the file's.
        entries.sort_by_key(|e| match e.place {
            Place::Byte(byte) | Place::Flag(byte) => byte,
        });
        Ok(Value::Table(entries))
    }

    fn value(&self, value: DeValue<'_>, byte: usize, depth: usize) -> Result<Node, Error> {
        if depth > MAX_SCENE_DEPTH {
            return Err(too_deep(self.file, self.text, byte));
        }
        let wrong = |message: String| error_at(self.file, self.text, byte, message, "");
        let value = match value {
            DeValue::String(text) => Value::Text(text.into_owned()),
            DeValue::Boolean(b) => Value::Bool(b),
            DeValue::Integer(i) => {
                let parsed = i64::from_str_radix(i.as_str(), i.radix());
                Value::Int(
                    parsed
                        .map_err(|_| wrong(format!("expected a 64-bit whole number, found {}", shown(i.as_str()))))?,
                )
            }
            DeValue::Float(x) => {
                let parsed: f64 =
                    x.as_str().parse().map_err(|_| wrong(format!("expected a number, found {}", shown(x.as_str()))))?;
                if !parsed.is_finite() {
                    return Err(wrong(format!("expected a finite number, found {}", shown(x.as_str()))));
                }
                Value::Float(parsed)
            }
            DeValue::Datetime(d) => {
                return Err(wrong(format!("expected a number, text, list or table, found the date {d}")));
            }
            DeValue::Array(items) => {
                let mut list = Vec::with_capacity(items.len());
                for item in items {
                    let span = item.span().start;
                    list.push(self.value(item.into_inner(), span, depth + 1)?);
                }
                Value::List(list)
            }
            DeValue::Table(table) => self.table(table, depth + 1)?,
        };
        Ok(Node { place: Place::Byte(byte), value })
    }
}
