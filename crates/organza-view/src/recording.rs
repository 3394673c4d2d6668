//! Files of events, which replay a session.

use crate::event::Event;
use organza::output::Target;
use organza::{Error, printable};
use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

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
        let hint = if e.is_eof() && text.starts_with(b"[") {
            "the list breaks off: delete what stands behind its last whole event, and the comma before that, and end it with ]"
        } else {
            "expected a list such as [{\"do\": \"orbit\", \"right\": 0.1, \"up\": 0}]; docs/view.md lists the events"
        };
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

/// A file of events that grows with them. The file is a readable list after every event, also if the view is killed.
#[derive(Debug)]
pub struct Recording {
    path: PathBuf,
    file: File,
    count: usize,
    /// Why the file takes no more.
    failure: Option<Error>,
}

/// How a list ends.
const END: &[u8] = b"\n]\n";

impl Recording {
    /// Begins a file; one that is there is replaced where `replaces`.
    ///
    /// # Errors
    /// [`Error::Output`] for a name that is taken, or is no regular file's, and [`Error::Io`] for the file system.
    pub fn begin(path: &Path, replaces: bool) -> Result<Self, Error> {
        let target = Target::new(path, replaces)?;
        let fail = |e| Error::io(target.path(), "cannot write the recording", e);
        let mut options = OpenOptions::new();
        options.write(true);
        if replaces {
            options.create(true).truncate(true);
        } else {
            options.create_new(true);
        }
        let mut file = options.open(target.path()).map_err(fail)?;
        file.write_all(b"[").and_then(|()| file.write_all(END)).map_err(fail)?;
        Ok(Self { path: path.to_owned(), file, count: 0, failure: None })
    }

    /// Adds events, [`MOST_EVENTS`] in all at most. A failure is reported at the end.
    pub fn add(&mut self, events: &[Event]) {
        let events = &events[..events.len().min(MOST_EVENTS - self.count)];
        if events.is_empty() || self.failure.is_some() {
            return;
        }
        let mut text = Vec::new();
        for event in events {
            text.extend_from_slice(if self.count == 0 { b"\n" } else { b",\n" });
            // An event is JSON: its keys are words.
            text.extend(serde_json::to_vec(event).unwrap_or_default());
            self.count += 1;
        }
        text.extend_from_slice(END);
        // In the place of the end, by one write: whoever stops this between two has a whole list.
        let written = self.file.seek(SeekFrom::End(-(END.len() as i64))).and_then(|_| self.file.write_all(&text));
        self.failure = written.err().map(|e| Error::io(&self.path, "cannot write the recording", e));
    }

    /// Ends the file; returns whether it holds as many events as it may.
    ///
    /// # Errors
    /// [`Error::Io`] where not all events could be written.
    pub fn end(self) -> Result<bool, Error> {
        match self.failure {
            Some(failure) => Err(failure),
            None => Ok(self.count == MOST_EVENTS),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_again() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("events.json");
        let mut recording = Recording::begin(&path, false).unwrap();
        let events =
            [Event::Reset {}, Event::Zoom { steps: 0.1 + 0.2 }, Event::Show { object: "a\n]\n".into(), visible: true }];
        // It is whole after every event, without an end.
        for count in 0..=events.len() {
            assert_eq!(read_events(&path).unwrap(), events[..count]);
            recording.add(&events[count..events.len().min(count + 1)]);
        }
        assert!(!recording.end().unwrap());
        assert!(Recording::begin(&path, false).unwrap_err().to_string().contains("exists already"));
        Recording::begin(&path, true).unwrap();
        assert_eq!(read_events(&path).unwrap(), []);
    }

    #[test]
    fn a_recording_has_an_end() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("events.json");
        let mut recording = Recording::begin(&path, false).unwrap();
        recording.add(&vec![Event::Reset {}; MOST_EVENTS - 1]);
        recording.add(&[Event::Reset {}, Event::Reset {}]);
        recording.add(&[Event::Reset {}]);
        assert!(recording.end().unwrap());
        assert_eq!(read_events(&path).unwrap().len(), MOST_EVENTS);
        let text = std::fs::read(&path).unwrap();
        std::fs::write(&path, &text[..text.len() - 5]).unwrap();
        assert!(read_events(&path).unwrap_err().hint().contains("the list breaks off"));
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
