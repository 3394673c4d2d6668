//! Files of events that grow while they happen.

use crate::event::Event;
use organza::Error;
use organza::output::Target;
use std::fs::{File, OpenOptions};
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// Most events of a recording.
pub const MOST_EVENTS: usize = 100_000;

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
    use crate::replay::EventFile;

    fn read_events(path: &Path) -> Vec<Event> {
        EventFile::read(path).unwrap().events().to_vec()
    }

    #[test]
    fn what_is_written_is_read_again() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("events.json");
        let mut recording = Recording::begin(&path, false).unwrap();
        let events =
            [Event::Reset {}, Event::Zoom { steps: 0.1 + 0.2 }, Event::Show { object: "a\n]\n".into(), visible: true }];
        // It is whole after every event, without an end.
        for count in 0..=events.len() {
            assert_eq!(read_events(&path), events[..count]);
            recording.add(&events[count..events.len().min(count + 1)]);
        }
        assert!(!recording.end().unwrap());
        assert!(Recording::begin(&path, false).unwrap_err().to_string().contains("exists already"));
        Recording::begin(&path, true).unwrap();
        assert_eq!(read_events(&path), []);
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
        assert_eq!(read_events(&path).len(), MOST_EVENTS);
        let text = std::fs::read(&path).unwrap();
        std::fs::write(&path, &text[..text.len() - 5]).unwrap();
        assert!(EventFile::read(&path).unwrap_err().hint().contains("the list breaks off"));
    }
}
