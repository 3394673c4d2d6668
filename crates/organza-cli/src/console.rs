//! stdout and stderr that survive a closed pipe.

pub(super) mod bar;
pub(super) mod signals;

use organza::{Error, escape_controls, printable};
use serde_json::json;
use std::io::{self, ErrorKind, IsTerminal, Write};
use std::path::Path;
use std::sync::atomic::{AtomicU8, Ordering};

/// Writes to stdout. A reader that went away, as `head` does, is no error.
pub(super) fn out(text: &str) -> Result<(), Error> {
    let mut stdout = io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(Error::io(Path::new("stdout"), "cannot write", e)),
        _ => Ok(()),
    }
}

/// Writes to stdout while a bar of progress may stand on stderr.
pub(super) fn out_between(text: &str) -> Result<(), Error> {
    if io::stderr().is_terminal() && !is_quiet() {
        note("\r\x1b[2K");
    }
    account(text)
}

/// A path as a shell takes it in a command that is printed to be copied: in quotes where it has more than letters, digits and a few marks.
pub(super) fn argument(path: &Path) -> String {
    let path = printable(path);
    let is_plain = |c: char| c.is_alphanumeric() || "._/-+=@%,:".contains(c);
    if !path.is_empty() && path.chars().all(is_plain) { path } else { format!("'{}'", path.replace('\'', "'\\''")) }
}

/// Writes to stderr, as far as that is possible.
pub(super) fn note(text: &str) {
    let _ = io::stderr().lock().write_all(text.as_bytes());
}

/// How much is said beside warnings, errors and documents.
static LOUDNESS: AtomicU8 = AtomicU8::new(USUAL);
const QUIET: u8 = 0;
const USUAL: u8 = 1;
const VERBOSE: u8 = 2;

/// Takes what the user says of it.
pub(super) fn set_loudness(is_quiet: bool, is_verbose: bool) {
    let loudness = if is_quiet {
        QUIET
    } else if is_verbose {
        VERBOSE
    } else {
        USUAL
    };
    LOUDNESS.store(loudness, Ordering::Relaxed);
}

/// Whether nothing is said but warnings, errors and documents.
pub(super) fn is_quiet() -> bool {
    LOUDNESS.load(Ordering::Relaxed) == QUIET
}

/// Whether each stage is told as it begins.
pub(super) fn is_verbose() -> bool {
    LOUDNESS.load(Ordering::Relaxed) == VERBOSE
}

/// Writes an account of what was done to stdout, unless the user wants none.
pub(super) fn account(text: &str) -> Result<(), Error> {
    if is_quiet() { Ok(()) } else { out(text) }
}

/// Prints what is good to know as one line on stderr.
pub(super) fn remark(text: &str) {
    if is_quiet() {
        return;
    }
    note(&format!("note: {}\n", escape_controls(text)));
}

/// Prints a warning of one line on stderr.
pub(super) fn warn(text: &str) {
    note(&format!("warning: {}\n", escape_controls(text)));
}

/// Prints an error and its hint on stderr, and as a document on stdout when JSON was asked for.
pub(super) fn report_error(error: &Error, as_json: bool) {
    let message = error.to_string();
    note(&format!("error: {}\n", escape_controls(&message)));
    if !error.hint().is_empty() {
        note(&format!("hint: {}\n", escape_controls(error.hint())));
    }
    if as_json {
        let document = json!({
            "error": { "exit_code": error.exit_code(), "message": message, "hint": error.hint() }
        });
        // The exit code already tells of one error.
        let _ = out(&format!("{document:#}\n"));
    }
}
