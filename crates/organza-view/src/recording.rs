//! Files of events: what was done is played again.

use crate::event::Event;
use organza::output::Target;
use organza::{Error, printable};
use std::io::Read;
use std::path::Path;

/// Most events of a recording.
pub const MOST_EVENTS: usize = 100_000;

/// Most bytes of a file of events.
const MOST_BYTES: u64 = 16 << 20;

/// Reads a file of events, a JSON list.
///
/// # Errors
/// [`Error::Io`] for a file that cannot be read, or is no regular file; [`Error::Input`] with line and column for another text, for numbers out of
/// range, and for a file of more than 16 MiB or more than [`MOST_EVENTS`] events.
pub fn read_events(path: &Path) -> Result<Vec<Event>, Error> {
    let fail = |e| Error::io(path, "cannot read the events", e);
    // Asked before opening: opening a pipe waits for its writer.
    if !std::fs::metadata(path).map_err(fail)?.is_file() {
        return Err(fail(std::io::Error::other("not a regular file")));
    }
    let mut text = Vec::new();
    let file = std::fs::File::open(path).map_err(fail)?;
    file.take(MOST_BYTES + 1).read_to_end(&mut text).map_err(fail)?;
    let input = |message: String, hint: &str| Error::input(printable(path), message, hint);
    if text.len() as u64 > MOST_BYTES {
        return Err(input(format!("expected at most {MOST_BYTES} bytes of events, found more"), "play it in parts"));
    }
    let events: Vec<Event> = serde_json::from_slice(&text).map_err(|e| {
        let hint =
            "expected a list such as [{\"do\": \"orbit\", \"right\": 0.1, \"up\": 0}]; docs/view.md lists the events";
        input(organza::shown(&e.to_string()).to_string(), hint)
    })?;
    if events.len() > MOST_EVENTS {
        let count = events.len();
        return Err(input(format!("expected at most {MOST_EVENTS} events, found {count}"), "play it in parts"));
    }
    for (rank, event) in events.iter().enumerate() {
        event.check().map_err(|e| input(format!("event {rank}: {e}"), e.hint()))?;
    }
    Ok(events)
}

/// Writes a file of events, one a line, whole or not at all.
///
/// # Errors
/// [`Error::Output`] for the file system.
pub fn write_events(target: &Target, events: &[Event]) -> Result<(), Error> {
    let line = |event: &Event| serde_json::to_string(event).expect("invariant: an event is JSON");
    let lines: Vec<String> = events.iter().map(line).collect();
    let text = if lines.is_empty() { "[]\n".to_owned() } else { format!("[\n{}\n]\n", lines.join(",\n")) };
    Ok(target.write(text.as_bytes())?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_again() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("events.json");
        for events in [vec![], vec![Event::Reset {}, Event::Zoom { steps: 0.1 + 0.2 }]] {
            let target = Target::new(&path, true).unwrap();
            write_events(&target, &events).unwrap();
            assert_eq!(read_events(&path).unwrap(), events);
        }
    }

    #[test]
    fn hostile_files_are_refused_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("events.json");
        let deep = "[".repeat(100_000);
        let many = format!("[{}{{\"do\":\"reset\"}}]", "{\"do\":\"reset\"},".repeat(MOST_EVENTS));
        for text in [
            "",
            "{}",
            "null",
            "[1]",
            "[{\"do\":\"orbit\",\"right\":1e400,\"up\":0}]",
            "[{\"do\":\"orbit\",\"right\":1001,\"up\":0}]",
            "[{\"do\":\"reset\"}",
            "[{\"do\":\"reset\"}] x",
            "[{\"do\":\"\u{1b}[2J\"}]",
            "\u{0}\u{1}",
            &deep,
            &many,
        ] {
            std::fs::write(&path, text).unwrap();
            let error = read_events(&path).unwrap_err().to_string();
            assert!(error.contains("events.json") && error.len() < 1000, "{error}");
            assert!(!error.contains('\u{1b}'), "{error:?}");
        }
        assert!(read_events(folder.path()).unwrap_err().to_string().contains("not a regular file"));
        assert!(read_events(&folder.path().join("none.json")).is_err());
    }
}
