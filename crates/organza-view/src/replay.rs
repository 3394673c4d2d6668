//! Files of events, and the state behind them.

use crate::event::Event;
use crate::recording::MOST_EVENTS;
use crate::state::{History, Source, State};
use crate::viewpoint::Viewpoint;
use crate::wording;
use organza::scene::Scene;
use organza::{Context, Error, printable};
use std::io::Read;
use std::path::Path;

/// Most bytes of a file of events.
const MOST_BYTES: u64 = 16 << 20;

/// Recorded events, and where each stands in its file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct EventFile {
    name: String,
    events: Vec<Event>,
    /// The line that each event begins in, counted from 1.
    lines: Vec<usize>,
}

impl EventFile {
    /// Reads a file of events, a JSON list.
    ///
    /// # Errors
    /// [`Error::Io`] for a file that cannot be read, or is no regular file; [`Error::Input`] with its place for another text, for numbers out of range,
    /// and for a file of more than 16 MiB or more than [`MOST_EVENTS`] events.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let text = read_text(path)?;
        let file = Self { name: printable(path), events: parsed(path, &text)?, lines: lines_of_items(&text) };
        file.events.iter().enumerate().try_for_each(|(rank, event)| event.check().map_err(|e| file.error(rank, &e)))?;
        Ok(file)
    }

    /// The events.
    pub fn events(&self) -> &[Event] {
        &self.events
    }

    /// Refuses columns that objects are coloured by and that their files lack.
    ///
    /// # Errors
    /// [`Error::Input`] that names the event and the columns of the file, and those of reading.
    fn check_columns(&self, state: &State, scene: &Scene, context: Context<'_>) -> Result<(), Error> {
        for (rank, object) in scene.objects.iter().enumerate() {
            let Some(chosen) = state.color_by_of(rank) else { continue };
            let Some(path) = object.source.path() else { continue };
            let mut limits = context.options.read_params();
            limits.columns = scene.columns_of(path);
            // Of an object that is hidden no columns are read.
            if !limits.columns.contains(&chosen.column) {
                limits.columns.push(chosen.column.clone());
            }
            limits.matter = scene.has_matter(path);
            limits.most_points = scene.render.max_points;
            limits.voxel_size = object.voxel_size;
            if let Err(error) = context.files.data(scene, path, &limits, context.progress) {
                let is_last =
                    |event: &Event| matches!(event, Event::ColorBy { object: name, .. } if *name == object.name);
                return Err(match self.events.iter().rposition(is_last) {
                    Some(rank) => self.error(rank, &error),
                    None => error,
                });
            }
        }
        Ok(())
    }

    /// An error that an event causes, with the name and the place of the event.
    fn error(&self, rank: usize, error: &Error) -> Error {
        let message = match error {
            // The event is named by its place already.
            Error::Input { what, message, .. } if what.starts_with("event") => message.clone(),
            _ => wording::sentence(&error.to_string()),
        };
        let Self { name, events, lines } = self;
        let place = format!("{name}:{}: event {} (`{}`)", lines[rank], rank + 1, events[rank].word());
        Error::input(place, message, wording::sentence(error.hint()))
    }
}

/// The line that each item of a list in JSON begins in, counted from 1; the items are objects.
fn lines_of_items(text: &[u8]) -> Vec<usize> {
    let mut lines = Vec::new();
    let mut line = 1;
    let mut depth = 0;
    let mut is_quoted = false;
    let mut is_escaped = false;
    for byte in text {
        match byte {
            _ if is_escaped => is_escaped = false,
            b'\\' => is_escaped = true,
            b'"' => is_quoted = !is_quoted,
            b'\n' => line += 1,
            b'[' | b'{' if !is_quoted => {
                if depth == 1 {
                    lines.push(line);
                }
                depth += 1;
            }
            b']' | b'}' if !is_quoted => depth -= 1,
            _ => {}
        }
    }
    lines
}

fn read_text(path: &Path) -> Result<Vec<u8>, Error> {
    let fail = |e| Error::io(path, "cannot read the events", e);
    // Asked before opening: opening a pipe waits for its writer.
    if !std::fs::metadata(path).map_err(fail)?.is_file() {
        return Err(fail(std::io::Error::other("not a regular file")));
    }
    let mut text = Vec::new();
    let file = std::fs::File::open(path).map_err(fail)?;
    file.take(MOST_BYTES + 1).read_to_end(&mut text).map_err(fail)?;
    if text.len() as u64 > MOST_BYTES {
        let message = format!("expected at most {MOST_BYTES} bytes of events, found more");
        return Err(Error::input(printable(path), message, "play it in parts"));
    }
    Ok(text)
}

fn parsed(path: &Path, text: &[u8]) -> Result<Vec<Event>, Error> {
    let input = |message: String, hint: &str| Error::input(printable(path), message, hint);
    let events: Vec<Event> = serde_json::from_slice(text).map_err(|e| {
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
    Ok(events)
}

/// The state behind recorded events.
pub(crate) struct Replayed {
    pub(crate) history: History,
    /// A sentence for each event that names what the scene lacks.
    pub(crate) left_out: Vec<String>,
}

/// Applies recorded events to a scene; `first` is the viewpoint of its own camera.
///
/// # Errors
/// [`Error::Input`] that names the place of an event for a scene that is refused with it, and for a column that its file lacks.
pub(crate) fn replayed(
    file: &EventFile,
    source: &Source,
    stated: &Scene,
    first: &Viewpoint,
    context: Context<'_>,
) -> Result<Replayed, Error> {
    let played = |count: usize| {
        let mut history = History::default();
        let mut left_out = Vec::new();
        for (rank, event) in file.events[..count].iter().enumerate() {
            // An event that fails changes nothing.
            if let Err(error) = history.apply(event, stated, first) {
                left_out.push(file.error(rank, &error).to_string());
            }
        }
        Replayed { history, left_out }
    };
    let scene = |state: &State| source.scene(source.overrides(state, stated)?);
    let replayed = played(file.events.len());
    let mut error = match scene(replayed.history.present()) {
        Ok(scene) => {
            file.check_columns(replayed.history.present(), &scene, context)?;
            return Ok(replayed);
        }
        Err(error) => error,
    };
    // The scene takes the first events, and not all of them: the event between is found in few steps.
    let mut taken = 0;
    let mut refused = file.events.len();
    while refused - taken > 1 {
        let middle = taken.midpoint(refused);
        match scene(played(middle).history.present()) {
            Ok(_) => taken = middle,
            Err(earlier) => {
                refused = middle;
                error = earlier;
            }
        }
    }
    Err(file.error(taken, &error))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn items_are_found_by_their_lines() {
        let text = "[\n{\"do\": \"cuts\", \"cuts\": [\n]}, {\"a\": \"}\\\"{[\n\"},\n\n{}]";
        assert_eq!(lines_of_items(text.as_bytes()), [2, 3, 6]);
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
            let error = EventFile::read(&path).unwrap_err().to_string();
            assert!(error.contains("events.json") && error.len() < 1000, "{error}");
            assert!(!error.contains('\u{1b}'), "{error:?}");
        }
        assert!(EventFile::read(folder.path()).unwrap_err().to_string().contains("not a regular file"));
        assert!(EventFile::read(&folder.path().join("none.json")).is_err());
    }
}
