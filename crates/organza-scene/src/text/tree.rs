//! A value tree in which everything knows its place, the same for TOML, JSON and overrides.

use crate::{Error, Written, shown};
use std::path::Path;

/// Most levels of lists and tables inside each other.
pub const MAX_SCENE_DEPTH: usize = 64;

/// Where a value was written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Place {
    /// Byte offset in the scene file.
    Byte(usize),
    /// Index into [`Document::flags`].
    Flag(usize),
}

/// A value and its place.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Node {
    pub(crate) place: Place,
    pub(crate) value: Value,
}

/// What a scene file can say.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Value {
    Null,
    Bool(bool),
    Int(i64),
    Float(f64),
    Text(String),
    List(Vec<Node>),
    Table(Vec<Entry>),
}

/// A key with its own place, and its value.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Entry {
    pub(crate) key: String,
    pub(crate) place: Place,
    pub(crate) node: Node,
}

/// One step of a path into the tree.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Step<'a> {
    Key(&'a str),
    Index(usize),
}

/// A scene file's text as a tree.
#[derive(Debug)]
pub(crate) struct Document<'a> {
    pub(crate) file: &'a Path,
    pub(crate) text: &'a str,
    /// Overrides as they were written on the command line.
    pub(crate) flags: Vec<String>,
    pub(crate) root: Node,
}

impl Value {
    /// What it is, for messages.
    pub(crate) fn describe(&self) -> String {
        match self {
            Self::Null => "null".into(),
            Self::Bool(b) => b.to_string(),
            Self::Int(i) => format!("the number {i}"),
            Self::Float(x) => format!("the number {}", crate::short(*x)),
            Self::Text(t) => format!("the text \"{}\"", shown(t)),
            Self::List(items) if items.len() == 1 => "a list of 1 value".into(),
            Self::List(items) => format!("a list of {} values", items.len()),
            Self::Table(_) => "a table".into(),
        }
    }
}

/// Line and column of a byte, both from 1; the column counts characters.
pub(crate) fn line_and_column(text: &str, byte: usize) -> (usize, usize) {
    let byte = (0..=byte.min(text.len())).rev().find(|b| text.is_char_boundary(*b)).unwrap_or(0);
    let before = &text[..byte];
    let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
    (before.matches('\n').count() + 1, before[line_start..].chars().count() + 1)
}

/// A scene error at a byte of a text.
pub(crate) fn error_at(
    file: &Path,
    text: &str,
    byte: usize,
    message: impl Into<String>,
    hint: impl Into<String>,
) -> Error {
    let (line, column) = line_and_column(text, byte);
    Written::File(line, column).error(file, &message.into(), &hint.into())
}

impl Document<'_> {
    /// An error at a place: of the scene file, or of the command line when an override is at fault.
    pub(crate) fn error(&self, place: Place, message: impl Into<String>, hint: impl Into<String>) -> Error {
        self.written(place).error(self.file, &message.into(), &hint.into())
    }

    /// A place as it is told once the document is gone.
    pub(crate) fn written(&self, place: Place) -> Written {
        match place {
            Place::Byte(byte) => {
                let (line, column) = line_and_column(self.text, byte);
                Written::File(line, column)
            }
            Place::Flag(index) => Written::Flag(shown(&self.flags[index])),
        }
    }

    /// A place in words, for messages that name a second place.
    pub(crate) fn name_place(&self, place: Place) -> String {
        match self.written(place) {
            Written::File(line, column) => format!("line {line}, column {column}"),
            Written::Flag(flag) => flag,
        }
    }

    /// The place of character `column` (from 1) of a text value that begins at `place`; the value's own place where it is
    /// not written letter by letter (escapes, overrides).
    pub(crate) fn place_in_text(&self, place: Place, value: &str, column: usize) -> Place {
        let Place::Byte(start) = place else { return place };
        let written = self.text.get(start..).unwrap_or("");
        // Longest first; a line end right after three quotes does not belong to the value.
        let quotes = ["\"\"\"\r\n", "'''\r\n", "\"\"\"\n", "'''\n", "\"\"\"", "'''", "\"", "'"];
        let opening = quotes.iter().find(|q| written.strip_prefix(**q).is_some_and(|rest| rest.starts_with(value)));
        let offset = value.char_indices().nth(column.saturating_sub(1)).map_or(value.len(), |(byte, _)| byte);
        opening.map_or(place, |q| Place::Byte(start + q.len() + offset))
    }

    /// The place of the deepest value on a path that exists.
    pub(crate) fn place_of(&self, path: &[Step<'_>]) -> Place {
        self.node_of(path).place
    }

    /// The keys that lead to the key or value that is written at a line and a column, both from 1: of the deepest one, where several begin there.
    /// An entry of a list has its `name`, or its index from 0.
    pub(crate) fn keys_at(&self, line: usize, column: usize) -> Option<Vec<String>> {
        let written = self.text.split_inclusive('\n').nth(line.checked_sub(1)?)?;
        let (offset, _) = written.char_indices().nth(column.checked_sub(1)?)?;
        let above: usize = self.text.split_inclusive('\n').take(line - 1).map(str::len).sum();
        let mut keys = Vec::new();
        find(&self.root, Place::Byte(above + offset), &mut keys).then_some(keys)
    }

    /// That value.
    pub(crate) fn node_of(&self, path: &[Step<'_>]) -> &Node {
        let mut node = &self.root;
        for step in path {
            let next = match (step, &node.value) {
                (Step::Key(key), Value::Table(entries)) => entries.iter().find(|e| e.key == *key).map(|e| &e.node),
                (Step::Index(index), Value::List(items)) => items.get(*index),
                _ => None,
            };
            let Some(next) = next else { break };
            node = next;
        }
        node
    }
}

/// Returns whether a key or value below a node begins at a place; `keys` lead to it then, and stay as they were otherwise.
fn find(node: &Node, sought: Place, keys: &mut Vec<String>) -> bool {
    let mut below = |key: String, place: Option<Place>, node: &Node| {
        keys.push(key);
        let is_found = find(node, sought, keys) || place == Some(sought) || node.place == sought;
        if !is_found {
            keys.pop();
        }
        is_found
    };
    match &node.value {
        Value::Table(entries) => entries.iter().any(|entry| below(entry.key.clone(), Some(entry.place), &entry.node)),
        Value::List(items) => items.iter().enumerate().any(|(i, item)| below(label(i, item), None, item)),
        _ => false,
    }
}

/// The name of an entry of a list, or its index.
fn label(index: usize, item: &Node) -> String {
    let Value::Table(entries) = &item.value else { return index.to_string() };
    let name = entries.iter().find(|entry| entry.key == "name").map(|entry| &entry.node.value);
    match name {
        Some(Value::Text(name)) => name.clone(),
        _ => index.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_inside_texts_are_found_where_they_are_written_letter_by_letter() {
        let root = Node { place: Place::Byte(0), value: Value::Null };
        let text = "a = \"xü+\"\nb = '''\nx + y'''\nc = \"x\\u002by\"";
        let document = Document { file: Path::new("s"), text, flags: Vec::new(), root };
        let byte = |needle: &str| text.find(needle).unwrap_or(0);
        assert_eq!(document.place_in_text(Place::Byte(4), "xü+", 3), Place::Byte(byte("+\"")));
        assert_eq!(document.place_in_text(Place::Byte(4), "xü+", 4), Place::Byte(byte("+\"") + 1));
        assert_eq!(document.place_in_text(Place::Byte(byte("'''")), "x + y", 5), Place::Byte(byte("y'''")));
        let escaped = Place::Byte(byte("\"x\\u"));
        assert_eq!(document.place_in_text(escaped, "x+y", 2), escaped);
        assert_eq!(document.place_in_text(Place::Flag(0), "x", 1), Place::Flag(0));
    }

    #[test]
    fn columns_count_characters() {
        assert_eq!(line_and_column("a = 'ü' x\nb", 8), (1, 8));
        assert_eq!(line_and_column("a\nbc", 3), (2, 2));
        assert_eq!(line_and_column("a\nbc", 99), (2, 3));
        assert_eq!(line_and_column("ü", 1), (1, 1));
    }
}
