//! Changes of the value tree from the command line, before anything is checked.

use super::de::suggest;
use super::tree::{Document, Entry, Node, Place, Value};
use crate::text::toml::read_toml_value;
use crate::{Error, MAX_SCENE_DEPTH, shown};

/// One change: a value at a path of keys.
///
/// ```
/// use organza_scene::Override;
/// let change = Override::parse("render.points.exact=true").unwrap();
/// assert_eq!(change.flag(), "--set render.points.exact=true");
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Override {
    flag: String,
    path: Vec<String>,
    /// `None` takes away what is there.
    value: Option<Value>,
}

impl Override {
    /// From `PATH=VALUE`: keys with dots between them, in a list an index from 0 or an entry's `name`; a key with dots stands in quotes, as in TOML. The
    /// value is in TOML, where a plain word needs no quotes. Without a value, what is at the path is taken away.
    ///
    /// ```
    /// use organza_scene::Override;
    /// let change = Override::parse("object.\"scan.v2\".opacity=0.5").unwrap();
    /// assert_eq!(change.path(), ["object", "scan.v2", "opacity"]);
    /// ```
    ///
    /// # Errors
    /// [`Error::Usage`] naming what is wrong.
    pub fn parse(text: &str) -> Result<Self, Error> {
        let bad = |message: String| {
            let message = format!("--set {}: {message}", shown(text));
            Error::usage(message, "write PATH=VALUE, such as --set render.points.exact=true")
        };
        let (path, value) = split_assignment(text).ok_or_else(|| bad("expected PATH=VALUE, found no `=`".into()))?;
        let path = split_path(path).map_err(bad)?;
        let value = value.trim();
        if value.is_empty() {
            return Ok(Self { flag: format!("--set {text}"), path, value: None });
        }
        let is_word = |c: char| c.is_alphanumeric() || "_-./".contains(c);
        let parsed = match read_toml_value(value) {
            Ok(parsed) => parsed,
            Err(_) if value.chars().all(is_word) && !is_not_finite(value) => Value::Text(value.to_owned()),
            Err(message) => return Err(bad(message)),
        };
        Ok(Self { flag: format!("--set {text}"), path, value: Some(parsed) })
    }

    /// From an option of its own: `flag` as it is shown in messages, a path, and a value in TOML.
    ///
    /// # Errors
    /// [`Error::Usage`] if the value is not TOML.
    pub fn from_option(flag: String, path: &str, toml: &str) -> Result<Self, Error> {
        let bad = |message: String| Error::usage(format!("{}: {message}", shown(&flag)), "");
        let value = read_toml_value(toml).map_err(bad)?;
        Ok(Self { path: path.split('.').map(str::to_owned).collect(), value: Some(value), flag })
    }

    /// From `NAME=on` or `NAME=off` of an effect, whose name may have dots in it.
    ///
    /// # Errors
    /// [`Error::Usage`] naming what is wrong.
    pub fn of_effect(text: &str) -> Result<Self, Error> {
        let flag = format!("--effect {text}");
        let (name, switch) = text.rsplit_once('=').unwrap_or((text, ""));
        if name.is_empty() || !["on", "off", "auto"].contains(&switch) {
            let message = format!("{}: expected NAME=on, NAME=off or NAME=auto", shown(&flag));
            return Err(Error::usage(message, "`organza explain` lists the effects of a scene by name"));
        }
        let path = ["render", "effects", name].map(str::to_owned).to_vec();
        Ok(Self { flag, path, value: Some(Value::Text(switch.to_owned())) })
    }

    /// The option as it was written on the command line.
    pub fn flag(&self) -> &str {
        &self.flag
    }

    /// The keys that lead to the value; in a list an index, or an entry's `name`.
    pub fn path(&self) -> &[String] {
        &self.path
    }

    /// The changes in the order in which the command applies them: those by `--set`, then those of other options; each kind as it was made.
    pub fn in_order(changes: &[Self]) -> impl Iterator<Item = &Self> {
        let is_set = |change: &&Self| change.flag().starts_with("--set ");
        changes.iter().filter(is_set).chain(changes.iter().filter(move |change| !is_set(change)))
    }

    /// Returns whether a later change takes the place of a value that this one states, by another value.
    ///
    /// ```
    /// use organza_scene::Override;
    /// let change = |text: &str| Override::parse(text).unwrap();
    /// let size = change("camera.size=[64, 48]");
    /// assert!(change("camera={ size = [9, 9], fov_y = 35 }").is_lost_by(&size));
    /// assert!(!change("camera={ size = [64, 48] }").is_lost_by(&size));
    /// assert!(!change("camera={ fov_y = 35 }").is_lost_by(&size));
    /// assert!(change("background.color=red").is_lost_by(&change("background={ color = [1, 1, 1] }")));
    /// ```
    pub fn is_lost_by(&self, later: &Self) -> bool {
        let Some(value) = &self.value else { return false };
        let stated = |value: &Value| toml_of(value);
        if let Some(below) = later.path.strip_prefix(&self.path[..]) {
            let replaced = later.value.as_ref().map(stated);
            return at_path(value, below).is_some_and(|value| Some(stated(value)) != replaced);
        }
        let Some(below) = self.path.strip_prefix(&later.path[..]) else { return false };
        let left = later.value.as_ref().and_then(|value| at_path(value, below)).map(stated);
        left != Some(stated(value))
    }

    /// The value as TOML on one line; `None` takes away what is at the path.
    ///
    /// ```
    /// use organza_scene::Override;
    /// let change = Override::parse("camera={ size = [64, 48], fov_y = 35.5 }").unwrap();
    /// assert_eq!((change.path().join("."), change.toml()), ("camera".into(), Some("{ size = [64, 48], fov_y = 35.5 }".into())));
    /// assert_eq!(Override::parse("camera.fov_y=").unwrap().toml(), None);
    /// ```
    pub fn toml(&self) -> Option<String> {
        self.value.as_ref().map(toml_of)
    }
}

/// The value at a path of keys within another one.
fn at_path<'v>(value: &'v Value, path: &[String]) -> Option<&'v Value> {
    let [first, rest @ ..] = path else { return Some(value) };
    let Value::Table(entries) = value else { return None };
    at_path(&entries.iter().find(|entry| entry.key == *first)?.node.value, rest)
}

/// A value as TOML on one line, whose numbers are read as the same ones.
fn toml_of(value: &Value) -> String {
    match value {
        // TOML has none, and none comes from it.
        Value::Null => "\"\"".to_owned(),
        Value::Bool(is_so) => is_so.to_string(),
        Value::Int(number) => number.to_string(),
        Value::Float(number) => format!("{number:?}"),
        Value::Text(text) => quoted(text),
        Value::List(items) => {
            let items: Vec<String> = items.iter().map(|item| toml_of(&item.value)).collect();
            format!("[{}]", items.join(", "))
        }
        Value::Table(entries) if entries.is_empty() => "{}".to_owned(),
        Value::Table(entries) => {
            let entry = |entry: &Entry| format!("{} = {}", key_of(&entry.key), toml_of(&entry.node.value));
            let entries: Vec<String> = entries.iter().map(entry).collect();
            format!("{{ {} }}", entries.join(", "))
        }
    }
}

/// A key as TOML has it: in quotes unless it is a plain word.
fn key_of(key: &str) -> String {
    let is_bare = !key.is_empty() && key.chars().all(|c| c.is_ascii_alphanumeric() || "_-".contains(c));
    if is_bare { key.to_owned() } else { quoted(key) }
}

/// A text in the quotes and escapes that TOML shares with JSON.
fn quoted(text: &str) -> String {
    // JSON leaves DEL as it is, which TOML forbids.
    serde_json::Value::from(text).to_string().replace('\u{7f}', "\\u007f")
}

/// Keys with dots between them, each plain or in the quotes of TOML; the error is a message alone.
pub(crate) fn split_path(text: &str) -> Result<Vec<String>, String> {
    let mut path = Vec::new();
    let mut rest = Some(text.trim());
    while let Some(from) = rest {
        let (key, after) = first_key(from)?;
        path.push(key);
        rest = after;
    }
    if path.iter().any(String::is_empty) || path.len() > MAX_SCENE_DEPTH {
        return Err(format!("expected 1 to {MAX_SCENE_DEPTH} keys with dots between them"));
    }
    Ok(path)
}

/// The first key of a path, and what follows the dot behind it.
fn first_key(path: &str) -> Result<(String, Option<&str>), String> {
    if !path.starts_with(QUOTES) {
        return Ok(path.split_once('.').map_or((path.to_owned(), None), |(key, after)| (key.to_owned(), Some(after))));
    }
    let open = || format!("expected a key in quotes with a dot or nothing behind it, found {}", shown(path));
    let end = quotes_end(path).ok_or_else(open)?;
    let Value::Text(key) = read_toml_value(&path[..end])? else { return Err(open()) };
    match path[end..].strip_prefix('.') {
        None if end < path.len() => Err(open()),
        after => Ok((key, after)),
    }
}

/// The quotes that keys may stand in.
const QUOTES: [char; 2] = ['"', '\''];

/// The byte behind the quotes that a text begins with; `None` where they do not end.
fn quotes_end(text: &str) -> Option<usize> {
    let quote = text.chars().next()?;
    let mut is_escaped = false;
    let ends = |(_, c): &(usize, char)| {
        let is_end = *c == quote && !is_escaped;
        is_escaped = quote == '"' && *c == '\\' && !is_escaped;
        is_end
    };
    text.char_indices().skip(1).find(ends).map(|(at, c)| at + c.len_utf8())
}

/// The path and the value of `PATH=VALUE`, whose keys in quotes may hold the sign.
fn split_assignment(text: &str) -> Option<(&str, &str)> {
    let mut at = text.len() - text.trim_start().len();
    loop {
        if text[at..].starts_with(QUOTES) {
            at += quotes_end(&text[at..])?;
        }
        at += text[at..].find(['.', '='])?;
        if text[at..].starts_with('=') {
            return Some((&text[..at], &text[at + 1..]));
        }
        at += 1;
    }
}

fn is_not_finite(word: &str) -> bool {
    word.parse::<f64>().is_ok_and(|x| !x.is_finite())
}

/// Applies all changes in order.
pub(crate) fn apply(document: &mut Document<'_>, overrides: &[Override]) -> Result<(), Error> {
    for change in overrides {
        let place = Place::Flag(document.flags.len());
        document.flags.push(change.flag.clone());
        let done = match change.value.clone() {
            None => remove(&mut document.root, &change.path),
            Some(mut value) => {
                set_places(&mut value, place);
                set(&mut document.root, &change.path, value, place)
            }
        };
        done.map_err(|(message, hint)| document.error(place, message, hint))?;
    }
    Ok(())
}

fn set_places(value: &mut Value, place: Place) {
    match value {
        Value::List(items) => {
            for item in items {
                item.place = place;
                set_places(&mut item.value, place);
            }
        }
        Value::Table(entries) => {
            for entry in entries {
                entry.place = place;
                entry.node.place = place;
                set_places(&mut entry.node.value, place);
            }
        }
        _ => {}
    }
}

/// Walks to the path's end, makes tables that are missing, and puts the value there.
pub(crate) fn set(root: &mut Node, path: &[String], value: Value, place: Place) -> Result<(), (String, String)> {
    let mut node = root;
    for key in path {
        let found = node.value.describe();
        node = match &mut node.value {
            Value::Table(entries) => {
                let index = entries.iter().position(|e| e.key == *key).unwrap_or_else(|| {
                    let empty = Node { place, value: Value::Table(Vec::new()) };
                    entries.push(Entry { key: key.clone(), place, node: empty });
                    entries.len() - 1
                });
                &mut entries[index].node
            }
            Value::List(items) => {
                let index = index_in_list(items, key)?;
                &mut items[index]
            }
            _ => {
                return Err((
                    format!("expected a table or a list before `{}`, found {found}", shown(key)),
                    String::new(),
                ));
            }
        };
    }
    *node = Node { place, value };
    Ok(())
}

/// Walks to the path's end and takes away what is there.
fn remove(root: &mut Node, path: &[String]) -> Result<(), (String, String)> {
    let Some((last, before)) = path.split_last() else { return Ok(()) };
    let mut node = root;
    for key in before {
        node = match &mut node.value {
            Value::Table(entries) => {
                let index = index_in_table(entries, key)?;
                &mut entries[index].node
            }
            Value::List(items) => {
                let index = index_in_list(items, key)?;
                &mut items[index]
            }
            other => return Err(not_here(key, other)),
        };
    }
    match &mut node.value {
        Value::Table(entries) => {
            let index = index_in_table(entries, last)?;
            entries.remove(index);
        }
        Value::List(items) => {
            let index = index_in_list(items, last)?;
            items.remove(index);
        }
        other => return Err(not_here(last, other)),
    }
    Ok(())
}

fn not_here(key: &str, found: &Value) -> (String, String) {
    (format!("expected a table or a list before `{}`, found {}", shown(key), found.describe()), String::new())
}

/// An entry of a table that is to be taken away.
fn index_in_table(entries: &[Entry], key: &str) -> Result<usize, (String, String)> {
    let keys: Vec<&str> = entries.iter().map(|entry| entry.key.as_str()).collect();
    let missing = || (format!("there is no `{}` to take away", shown(key)), suggest(key, &keys));
    keys.iter().position(|known| *known == key).ok_or_else(missing)
}

/// An entry of a list by index, or by its `name`.
fn index_in_list(items: &[Node], key: &str) -> Result<usize, (String, String)> {
    if let Ok(index) = key.parse::<usize>() {
        let message = || (format!("expected an index below {}, found {index}", items.len()), String::new());
        return (index < items.len()).then_some(index).ok_or_else(message);
    }
    let names: Vec<&str> = items.iter().map(|item| name_of(item).unwrap_or("")).collect();
    let position = names.iter().position(|name| *name == key);
    position.ok_or_else(|| (format!("expected an index or a name, found `{}`", shown(key)), suggest(key, &names)))
}

fn name_of(node: &Node) -> Option<&str> {
    let Value::Table(entries) = &node.value else { return None };
    entries.iter().find(|e| e.key == "name").and_then(|e| match &e.node.value {
        Value::Text(name) => Some(name.as_str()),
        _ => None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &str) -> (Vec<String>, Option<String>) {
        let change = Override::parse(text).expect("a path and a value");
        (change.path().to_vec(), change.toml())
    }

    #[test]
    fn names_with_dots_stand_in_quotes() {
        for (text, path) in [
            ("object.\"a.b\".opacity=0.5", ["object", "a.b", "opacity"]),
            ("object.'a=b'.opacity=0.5", ["object", "a=b", "opacity"]),
            (" \"object\".\"a\\\".b\".opacity = 0.5", ["object", "a\".b", "opacity"]),
            // A quote within a plain key is a letter.
            ("object.it's.opacity=0.5", ["object", "it's", "opacity"]),
        ] {
            assert_eq!(parsed(text), (path.map(str::to_owned).to_vec(), Some("0.5".to_owned())), "{text}");
        }
        assert_eq!(parsed("render.effects.\"shadow.sun\"=").1, None);
        for text in ["object.\"a.opacity=0.5", "object.\"a\"b.opacity=0.5", "object.\"\".opacity=0.5", "object.\"a\"."]
        {
            assert!(Override::parse(text).is_err(), "{text}");
        }
    }
}
