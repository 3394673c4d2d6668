//! Files of a machine: the nanoseconds that each kind of work takes there, as `organza calibrate` measured them.

use super::args::MOST_THREADS;
use organza::cost::{Item, Rates};
use organza::{Error, printable};
use serde::de::{self, DeserializeSeed, MapAccess, Visitor};
use serde_json::{Map, Value, json};
use std::fmt;
use std::path::Path;

/// Version of the format.
const VERSION: u64 = 1;
/// Bytes of such a file at most: a longer one is something else.
const MOST_BYTES: u64 = 1 << 16;
/// Nanoseconds of one item at most: a minute.
const MOST_NS: f64 = 6e10;
/// The hint beside a refused file.
const HINT: &str = "measure this machine with `organza calibrate -o FILE`, or leave out --machine";

/// The name of this machine's processor.
pub(super) fn name() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = text.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    model.map_or_else(|| std::env::consts::ARCH.to_owned(), |(_, name)| name.trim().to_owned())
}

/// The text of a file of this machine.
pub(super) fn text(ns: impl Fn(Item) -> f64) -> String {
    let ns: Map<String, Value> = Item::every().map(|item| (item.name().to_owned(), json!(ns(item)))).collect();
    let document = json!({
        "organza_machine": VERSION,
        "organza": env!("CARGO_PKG_VERSION"),
        "machine": name(),
        "threads": std::thread::available_parallelism().map_or(1, |n| n.get()),
        "ns": ns,
    });
    format!("{document:#}\n")
}

/// The figures of a file of this machine, or the built-in ones where none is named.
pub(super) fn rates(file: Option<&Path>) -> Result<Rates, Error> {
    file.map_or_else(|| Ok(Rates::default()), read)
}

fn read(path: &Path) -> Result<Rates, Error> {
    let length = std::fs::metadata(path).map_err(|e| Error::io(path, "cannot read", e))?.len();
    if length > MOST_BYTES {
        let message = format!("expected a file of a machine, at most {MOST_BYTES} bytes, found {length} bytes");
        return Err(Error::input(printable(path), message, HINT));
    }
    let bytes = std::fs::read(path).map_err(|e| Error::io(path, "cannot read", e))?;
    parse(&bytes, &name()).map_err(|wrong| {
        let what = format!("{}, line {}, column {}", printable(path), wrong.line, wrong.column);
        Error::input(what, wrong.message, HINT)
    })
}

/// A fault of a machine file.
#[derive(Debug, PartialEq)]
struct Wrong {
    line: usize,
    column: usize,
    /// What was expected and found.
    message: String,
}

fn parse(bytes: &[u8], machine: &str) -> Result<Rates, Wrong> {
    let mut reader = serde_json::Deserializer::from_slice(bytes);
    let read = File { machine }.deserialize(&mut reader).and_then(|ns| reader.end().map(|()| ns));
    let ns = read.map_err(|e| {
        let text = e.to_string();
        // The place has a field of its own.
        let message = text.strip_suffix(&format!(" at line {} column {}", e.line(), e.column())).unwrap_or(&text);
        let is_ours = message.starts_with("expected ") && message.contains(", found ");
        let message = if is_ours {
            message.to_owned()
        } else {
            format!("expected JSON that `organza calibrate` wrote, found {message}")
        };
        Wrong { line: e.line(), column: e.column(), message }
    })?;
    let time = |item: Item| ns.get(item.name()).and_then(Value::as_f64).unwrap_or_default();
    Ok(Rates::measured(time, format!("figures of {machine}")))
}

/// Reads the document: every key once, checked where it stands, so that a refusal knows its line.
struct File<'a> {
    /// The machine that it has to be of.
    machine: &'a str,
}

impl<'de> DeserializeSeed<'de> for File<'_> {
    type Value = Map<String, Value>;

    fn deserialize<D: de::Deserializer<'de>>(self, deserializer: D) -> Result<Self::Value, D::Error> {
        deserializer.deserialize_map(self)
    }
}

impl<'de> Visitor<'de> for File<'_> {
    type Value = Map<String, Value>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a table that `organza calibrate` wrote")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<Self::Value, A::Error> {
        const KEYS: [&str; 5] = ["organza_machine", "organza", "machine", "threads", "ns"];
        let mut known: Vec<String> = Vec::new();
        let mut ns = None;
        while let Some(key) = entries.next_key::<String>()? {
            check_key(&key, &known, &KEYS)?;
            match key.as_str() {
                "ns" => ns = Some(entries.next_value_seed(Times)?),
                "organza_machine" => {
                    let value: Value = entries.next_value()?;
                    let is_known = value.as_u64() == Some(VERSION);
                    check_value(is_known, &key, &VERSION.to_string(), &value)?;
                }
                "machine" => {
                    let value: Value = entries.next_value()?;
                    let is_this = value.as_str() == Some(self.machine);
                    check_value(is_this, &key, &format!("\"{}\", which is this one", self.machine), &value)?;
                }
                "threads" => {
                    let value: Value = entries.next_value()?;
                    let is_count = value.as_u64().is_some_and(|threads| (1..=MOST_THREADS).contains(&threads));
                    check_value(is_count, &key, &format!("a whole number from 1 to {MOST_THREADS}"), &value)?;
                }
                _ => {
                    let value: Value = entries.next_value()?;
                    check_value(value.is_string(), &key, "a version of Organza", &value)?;
                }
            }
            known.push(key);
        }
        check_all(&known, &KEYS)?;
        ns.ok_or_else(|| de::Error::custom("expected the key ns, found nothing"))
    }
}

/// Reads the nanoseconds of each kind of work.
struct Times;

impl<'de> DeserializeSeed<'de> for Times {
    type Value = Map<String, Value>;

    fn deserialize<D: de::Deserializer<'de>>(self, deserializer: D) -> Result<Self::Value, D::Error> {
        deserializer.deserialize_map(self)
    }
}

impl<'de> Visitor<'de> for Times {
    type Value = Map<String, Value>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a table of nanoseconds")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<Self::Value, A::Error> {
        let names: Vec<&str> = Item::every().map(Item::name).collect();
        let mut times = Map::new();
        let mut known: Vec<String> = Vec::new();
        while let Some(name) = entries.next_key::<String>()? {
            check_key(&name, &known, &names)?;
            let value: Value = entries.next_value()?;
            let is_time = value.as_f64().is_some_and(|ns| ns > 0.0 && ns <= MOST_NS);
            let expected = format!("nanoseconds above 0, at most {MOST_NS:e}");
            check_value(is_time, &format!("ns.{name}"), &expected, &value)?;
            times.insert(name.clone(), value);
            known.push(name);
        }
        check_all(&known, &names)?;
        Ok(times)
    }
}

/// Refuses a key that is not one of these, or stands there twice.
fn check_key<E: de::Error>(key: &str, known: &[String], keys: &[&str]) -> Result<(), E> {
    if !keys.contains(&key) {
        return Err(E::custom(format!("expected the keys of this version, found \"{}\"", shortened(key))));
    }
    if known.iter().any(|before| before == key) {
        return Err(E::custom(format!("expected each key once, found \"{key}\" twice")));
    }
    Ok(())
}

fn check_value<E: de::Error>(is_right: bool, key: &str, expected: &str, value: &Value) -> Result<(), E> {
    let found = || shortened(&value.to_string());
    if is_right { Ok(()) } else { Err(E::custom(format!("expected {expected} as {key}, found {}", found()))) }
}

/// Refuses a table that lacks a key.
fn check_all<E: de::Error>(known: &[String], keys: &[&str]) -> Result<(), E> {
    let missing = keys.iter().find(|key| !known.iter().any(|known| known == *key));
    missing.map_or(Ok(()), |key| Err(E::custom(format!("expected the key {key}, found nothing"))))
}

/// The beginning of a text that a stranger may have made as long as they like.
fn shortened(text: &str) -> String {
    const MOST: usize = 60;
    if text.chars().count() <= MOST { text.to_owned() } else { text.chars().take(MOST).collect::<String>() + "…" }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The refusal of what was written, with one text in the place of another.
    fn refused(written: &str, damaged: &str) -> Wrong {
        let text = text(|_| 5.0);
        assert!(text.contains(written), "{written}");
        parse(text.replacen(written, damaged, 1).as_bytes(), &name()).unwrap_err()
    }

    #[test]
    fn what_was_written_reads_back() {
        let rates = parse(text(|item| 1.5 + item as u8 as f64).as_bytes(), &name()).unwrap();
        assert!(Item::every().all(|item| rates.ns(item) == 1.5 + item as u8 as f64));
        assert_eq!(rates.source(), format!("figures of {}", name()));
    }

    #[test]
    fn damaged_old_and_foreign_files_are_refused_with_line_expected_and_found() {
        let cut = &text(|_| 5.0)[..40];
        let wrong = parse(cut.as_bytes(), &name()).unwrap_err();
        assert!(wrong.message.contains("EOF"), "{wrong:?}");
        let particle = "\"particle\": 5.0";
        let line_of = |part: &str| 1 + text(|_| 5.0).lines().position(|line| line.contains(part)).unwrap();
        for (written, damaged, message) in [
            ("\"organza_machine\": 1", "\"organza_machine\": 0", "expected 1 as organza_machine, found 0"),
            (particle, "\"particle\": -1.0", "as ns.particle, found -1.0"),
            (particle, "\"particle\": 0", "as ns.particle, found 0"),
            (particle, "\"particle\": 1e300", "as ns.particle, found 1e+300"),
            (particle, "\"particle\": null", "as ns.particle, found null"),
            (particle, "\"particle\": NaN", "expected JSON that"),
            (particle, "\"particle\": 5.0, \"particle\": 6.0", "expected each key once, found \"particle\" twice"),
            (particle, "\"attic\": 5.0", "found \"attic\""),
        ] {
            let wrong = refused(written, damaged);
            assert!(wrong.message.contains(message), "{wrong:?}");
            assert_eq!(wrong.line, line_of(written), "{wrong:?}");
        }
        let threads = format!("\"threads\": {}", std::thread::available_parallelism().unwrap());
        let expected = "expected a whole number from 1 to 1024 as threads, found 0";
        assert_eq!(refused(&threads, "\"threads\": 0").message, expected);
        assert!(refused(&threads, &format!("{threads}, {threads}")).message.contains("\"threads\" twice"));
        assert!(refused(&format!("\"{}\"", name()), "\"another\"").message.ends_with("found \"another\""));
        assert_eq!(refused(&threads, "\"organza\": \"1\"").message, "expected each key once, found \"organza\" twice");
        assert_eq!(parse(b"{\"ns\": {}}", &name()).unwrap_err().message, "expected the key file_byte, found nothing");
        assert!(parse(b"[1]", &name()).unwrap_err().message.contains("invalid type"));
    }
}
