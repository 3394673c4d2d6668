//! Files of a machine: the nanoseconds that each kind of work takes there, as `organza calibrate` measured them.

use organza::cost::{Item, Rates};
use organza::{Error, printable};
use serde_json::{Map, Value, json};
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
        let what = format!("{}, {}", printable(path), wrong.place);
        Error::input(what, format!("expected {}, found {}", wrong.expected, wrong.found), HINT)
    })
}

/// A fault of a machine file.
#[derive(Debug, PartialEq)]
struct Wrong {
    place: String,
    expected: String,
    found: String,
}

fn wrong(place: &str, expected: impl Into<String>, found: impl Into<String>) -> Wrong {
    Wrong { place: place.to_owned(), expected: expected.into(), found: found.into() }
}

fn parse(bytes: &[u8], machine: &str) -> Result<Rates, Wrong> {
    let document: Value = serde_json::from_slice(bytes).map_err(|e| {
        wrong(
            &format!("line {}, column {}", e.line(), e.column()),
            "JSON that `organza calibrate` wrote",
            e.to_string(),
        )
    })?;
    let show = |value: Option<&Value>| value.map_or_else(|| "nothing".to_owned(), |v| shortened(&v.to_string()));
    let version = document.get("organza_machine");
    if version.and_then(Value::as_u64) != Some(VERSION) {
        return Err(wrong("key organza_machine", VERSION.to_string(), show(version)));
    }
    let measured_on = document.get("machine");
    if measured_on.and_then(Value::as_str) != Some(machine) {
        return Err(wrong("key machine", format!("\"{machine}\", which is this one"), show(measured_on)));
    }
    let ns = document.get("ns").and_then(Value::as_object);
    let ns = ns.ok_or_else(|| wrong("key ns", "a table of numbers", show(document.get("ns"))))?;
    if let Some(name) = ns.keys().find(|name| !Item::every().any(|item| item.name() == *name)) {
        return Err(wrong("table ns", "the kinds of work of this version", format!("\"{}\"", shortened(name))));
    }
    let is_time = |value: &f64| *value > 0.0 && *value <= MOST_NS;
    for item in Item::every() {
        let value = ns.get(item.name());
        if value.and_then(Value::as_f64).filter(is_time).is_none() {
            let expected = format!("nanoseconds above 0, at most {MOST_NS:e}");
            return Err(wrong(&format!("key ns.{}", item.name()), expected, show(value)));
        }
    }
    let time = |item: Item| ns.get(item.name()).and_then(Value::as_f64).unwrap_or_default();
    Ok(Rates::measured(time, format!("figures of {machine}")))
}

/// The beginning of a text that a stranger may have made as long as they like.
fn shortened(text: &str) -> String {
    const MOST: usize = 60;
    if text.chars().count() <= MOST { text.to_owned() } else { text.chars().take(MOST).collect::<String>() + "…" }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(change: impl Fn(&mut Value)) -> Wrong {
        let mut document: Value = serde_json::from_str(&text(|_| 5.0)).unwrap();
        change(&mut document);
        parse(document.to_string().as_bytes(), &name()).unwrap_err()
    }

    #[test]
    fn what_was_written_reads_back() {
        let rates = parse(text(|item| 1.5 + item as u8 as f64).as_bytes(), &name()).unwrap();
        assert!(Item::every().all(|item| rates.ns(item) == 1.5 + item as u8 as f64));
        assert_eq!(rates.source(), format!("figures of {}", name()));
    }

    #[test]
    fn damaged_old_and_foreign_files_are_refused_with_place_expected_and_found() {
        let cut = &text(|_| 5.0)[..40];
        let wrong = parse(cut.as_bytes(), &name()).unwrap_err();
        assert!(wrong.place.starts_with("line ") && wrong.found.starts_with("EOF"), "{wrong:?}");
        let wrong = refused(|d| d["organza_machine"] = json!(0));
        assert_eq!((wrong.place.as_str(), wrong.found.as_str()), ("key organza_machine", "0"));
        let wrong = refused(|d| d["machine"] = json!("another"));
        assert_eq!((wrong.place.as_str(), wrong.found.as_str()), ("key machine", "\"another\""));
        let wrong = refused(|d| d["ns"]["particle"] = json!(-1.0));
        assert_eq!((wrong.place.as_str(), wrong.found.as_str()), ("key ns.particle", "-1.0"));
        let wrong = refused(|d| d["ns"]["particle"] = Value::Null);
        assert_eq!(wrong.found, "null");
        let wrong = refused(|d| d["ns"]["attic"] = json!(1.0));
        assert_eq!(wrong.found, "\"attic\"");
        assert_eq!(refused(|d| *d = json!([1])).found, "nothing");
    }
}
