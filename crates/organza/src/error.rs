//! Errors by whose fault they are; each has one exit code and says what to do.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// Everything that can go wrong, from the command line to the finished file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The command line asks for something impossible. Exit code 2.
    #[error("{message}")]
    Usage {
        /// What was found and what was expected.
        message: String,
        /// What to do; may be empty.
        hint: String,
    },
    /// The scene file is wrong at one place. Exit code 3.
    #[error("{}:{line}:{column}: {message}", printable(file))]
    Scene {
        /// The scene file.
        file: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Column in characters, from 1.
        column: usize,
        /// What was found and what was expected.
        message: String,
        /// What to do; may be empty.
        hint: String,
    },
    /// An input file, or data made from it, is wrong. Exit code 3.
    #[error("{what}: {message}")]
    Input {
        /// The file or the object.
        what: String,
        /// What was found and what was expected.
        message: String,
        /// What to do; may be empty.
        hint: String,
    },
    /// A file could not be read or written. Exit code 4.
    #[error("{}: {action}: {source}", printable(path))]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What was attempted, such as `cannot read`.
        action: &'static str,
        /// The system's answer.
        source: std::io::Error,
    },
    /// An output may not be written where it was asked for. Exit code 4.
    #[error("{}: {message}", printable(path))]
    Output {
        /// The file.
        path: PathBuf,
        /// Why not.
        message: String,
        /// What to do; may be empty.
        hint: String,
    },
    /// The work would take more than it may. Exit code 5.
    #[error("{what} needs {needed} {unit}, the limit is {limit}")]
    Limit {
        /// What needs it.
        what: String,
        /// How much is needed.
        needed: u64,
        /// How much is allowed.
        limit: u64,
        /// What is counted: `bytes`, `splats` …
        unit: &'static str,
        /// The knob to turn; may be empty.
        hint: String,
    },
    /// A file asks for more memory than it may. Exit code 5.
    #[error("{what}: {message}")]
    TooLarge {
        /// The file and the place in it.
        what: String,
        /// What was found and what was expected.
        message: String,
        /// What to do; may be empty.
        hint: String,
    },
    /// A measurement is not good enough to be shown, and would be with more work. Exit code 5.
    #[error("{message}")]
    Unresolved {
        /// What was measured, and what it was measured against.
        message: String,
        /// What it would take.
        hint: String,
    },
    /// The backend cannot do it. Exit code 6.
    #[error("{message}")]
    Gpu {
        /// Why not.
        message: String,
        /// What to do; may be empty.
        hint: String,
    },
    /// A promise between stages was broken. Exit code 1.
    #[error("{0}")]
    Internal(String),
    /// Interrupted. Exit code 130.
    #[error("interrupted")]
    Cancelled,
}

impl Error {
    /// Shorthand for [`Error::Usage`].
    pub fn usage(message: impl Into<String>, hint: impl Into<String>) -> Self {
        Self::Usage { message: message.into(), hint: hint.into() }
    }

    /// Shorthand for [`Error::Input`].
    pub fn input(what: impl Into<String>, message: impl Into<String>, hint: impl Into<String>) -> Self {
        Self::Input { what: what.into(), message: message.into(), hint: hint.into() }
    }

    /// Shorthand for [`Error::Io`].
    pub fn io(path: &Path, action: &'static str, source: std::io::Error) -> Self {
        Self::Io { path: path.to_owned(), action, source }
    }

    /// An error of the nouns about the data of `what` (an object, a file): broken promises are bad input, overflows
    /// are limits.
    pub fn from_core(what: &str, error: splat_core::Error) -> Self {
        match error {
            splat_core::Error::Overflow { what: buffer, needed, had } => Self::Limit {
                what: format!("{what}: {buffer}"),
                needed,
                limit: had,
                unit: "elements",
                hint: "use a larger `spacing` or a smaller image".into(),
            },
            splat_core::Error::Cancelled => Self::Cancelled,
            other => Self::input(what, other.to_string(), ""),
        }
    }

    /// An error of a reader.
    pub fn from_read(path: &Path, error: &convert::ReadError) -> Self {
        let what = format!("{}{}", printable(Path::new(&error.file)), error.place);
        let message = format!("expected {}, found {}", error.expected, shown(&error.found));
        match error.fault {
            convert::Fault::FileSystem => Self::io(path, "cannot read", std::io::Error::other(message)),
            convert::Fault::Cancelled => Self::Cancelled,
            convert::Fault::Limit => Self::TooLarge { what, message, hint: error.hint.into() },
            _ => Self::input(what, message, error.hint),
        }
    }

    /// The same error, naming the file of an object where it names no more than the scene: errors of conversions know the
    /// object and its element, but not where the data came from.
    pub(crate) fn in_object(self, scene: &Path, file: Option<&Path>) -> Self {
        match self {
            Self::Input { what, message, hint } if what == Self::OF_SCENE => {
                Self::Input { what: printable(file.unwrap_or(scene)), message, hint }
            }
            Self::Limit { what, needed, limit, unit, hint } => {
                let what = file.map_or_else(|| what.clone(), |file| format!("{}: {what}", printable(file)));
                Self::Limit { what, needed, limit, unit, hint }
            }
            other => other,
        }
    }

    /// What an error is about before it is known which file an object was made from.
    pub(crate) const OF_SCENE: &str = "scene";

    /// The exit code of the command.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Internal(_) => 1,
            Self::Usage { .. } => 2,
            Self::Scene { .. } | Self::Input { .. } => 3,
            Self::Io { .. } | Self::Output { .. } => 4,
            Self::Limit { .. } | Self::TooLarge { .. } | Self::Unresolved { .. } => 5,
            Self::Gpu { .. } => 6,
            Self::Cancelled => 130,
        }
    }

    /// What to do about it; may be empty.
    pub fn hint(&self) -> &str {
        match self {
            Self::Usage { hint, .. }
            | Self::Scene { hint, .. }
            | Self::Input { hint, .. }
            | Self::Output { hint, .. }
            | Self::Limit { hint, .. }
            | Self::TooLarge { hint, .. }
            | Self::Unresolved { hint, .. }
            | Self::Gpu { hint, .. } => hint,
            Self::Io { source, .. } if source.kind() == std::io::ErrorKind::StorageFull => "free some space",
            Self::Io { .. } | Self::Cancelled => "",
            Self::Internal(_) => "this is a bug in Organza, please report it",
        }
    }
}

/// Most characters of what was given that a message repeats.
const MOST_SHOWN: usize = 200;

/// What was given (a name, a key, a value, an expression), for a message: its first 200 characters, those escaped that would
/// steer a terminal.
pub fn shown(text: &str) -> String {
    // Of the bytes that are not looked at there may be millions.
    match text.char_indices().nth(MOST_SHOWN) {
        Some(_) => {
            let end = text.char_indices().nth(MOST_SHOWN - 1).map_or(0, |(at, _)| at);
            format!("{}…", escape_controls(&text[..end]))
        }
        None => escape_controls(text).into_owned(),
    }
}

/// A path for a message: what is not UTF-8 or would steer a terminal is escaped, and of a long one the middle is left out,
/// so that 200 characters are shown.
pub fn printable(path: &Path) -> String {
    let mut characters = Vec::new();
    for chunk in path.as_os_str().as_encoded_bytes().utf8_chunks() {
        characters.extend(chunk.valid().chars().map(|c| escape_controls(c.encode_utf8(&mut [0; 4])).into_owned()));
        characters.extend(chunk.invalid().iter().map(|byte| format!("\\x{byte:02x}")));
    }
    if characters.len() > MOST_SHOWN {
        let half = MOST_SHOWN / 2;
        characters.splice(half..characters.len() - half + 1, ["…".to_owned()]);
    }
    characters.concat()
}

/// `text` with control characters and marks that change the direction of writing escaped, so that a name in a file can
/// neither steer the terminal nor fake a line of output.
pub fn escape_controls(text: &str) -> Cow<'_, str> {
    let steers = |c: char| {
        c.is_control() || matches!(c, '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
    };
    if !text.contains(steers) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        if steers(c) { out.extend(c.escape_default()) } else { out.push(c) }
    }
    Cow::Owned(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_cannot_steer_the_terminal() {
        assert_eq!(escape_controls("a\u{1b}[2Jb\nc"), "a\\u{1b}[2Jb\\nc");
        assert_eq!(escape_controls("grün"), "grün");
        assert_eq!(escape_controls("\u{202e}gnp.exe"), "\\u{202e}gnp.exe");
    }

    #[test]
    fn no_more_than_200_characters_are_repeated() {
        let exact = "ü".repeat(200);
        assert_eq!(shown(&exact), exact);
        assert_eq!(shown(&"ü".repeat(1 << 20)), format!("{}…", "ü".repeat(199)));
        assert_eq!(shown(&"\u{7}".repeat(201)), format!("{}…", "\\u{7}".repeat(199)));
        assert_eq!(printable(Path::new(&exact)), exact);
        let long = format!("/start/{}/end.ply", "ü".repeat(1000));
        let cut = printable(Path::new(&long));
        assert_eq!(cut.chars().count(), 200);
        assert!(cut.starts_with("/start/ü") && cut.contains("ü…ü") && cut.ends_with("ü/end.ply"), "{cut}");
    }

    #[cfg(unix)]
    #[test]
    fn bi34_paths_that_are_not_utf8_are_printed_escaped() {
        use std::os::unix::ffi::OsStrExt;
        let path = Path::new(std::ffi::OsStr::from_bytes(b"a\xff\nb.toml"));
        assert_eq!(printable(path), "a\\xff\\nb.toml");
    }
}
