//! Why a file was refused: whose fault it is, where, what was expected, what was found and what to do about it.

use splat_core::Exceeded;
use std::fmt;

/// Whose fault a refused file is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// The file system: missing, no permission, not a regular file.
    FileSystem,
    /// The content of the file.
    Input,
    /// The file asks for more memory than [`crate::ReadParams`] allows.
    Limit,
    /// Nobody's: the reader was asked to stop.
    Cancelled,
}

impl Fault {
    /// The exit code of a command that stops with this fault: 4, 3, 5 or 130.
    pub fn exit_code(self) -> u8 {
        match self {
            Self::FileSystem => 4,
            Self::Input => 3,
            Self::Limit => 5,
            Self::Cancelled => 130,
        }
    }
}

/// Where in a file the fault lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// Nowhere in particular.
    File,
    /// A line of text, counted from 1.
    Line {
        /// The line, from 1.
        line: u64,
        /// The column in bytes, from 1; 0 for the whole line.
        column: u64,
    },
    /// A byte offset, from 0; after decompression if the file is compressed with gzip.
    Byte(u64),
}

impl Place {
    /// The same without a column.
    #[cfg(any(feature = "off", feature = "obj", feature = "vti", feature = "vtk"))]
    pub(crate) fn whole_line(self) -> Self {
        match self {
            Self::Line { line, .. } => Self::Line { line, column: 0 },
            other => other,
        }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File => Ok(()),
            Self::Line { line, column: 0 } => write!(f, ":{line}"),
            Self::Line { line, column } => write!(f, ":{line}:{column}"),
            Self::Byte(byte) => write!(f, "@{byte}"),
        }
    }
}

/// A file that was refused. Prints as `FILE:LINE:COLUMN: expected …, found …` (or `FILE@BYTE: …`) and a line `hint: …`.
///
/// Names and pieces of the file are shown with control characters escaped.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{file}{place}: expected {expected}, found {found}\nhint: {hint}")]
#[non_exhaustive]
pub struct ReadError {
    /// The file's name, escaped.
    pub file: String,
    /// Where in the file.
    pub place: Place,
    /// What would have been accepted, in words.
    pub expected: String,
    /// What was there instead.
    pub found: String,
    /// What to do about it.
    pub hint: &'static str,
    /// Whose fault it is.
    pub fault: Fault,
}

/// The expectation in the error of a missing file.
const A_FILE: &str = "a file";

impl ReadError {
    /// The content is wrong; the file's name is added by [`ReadError::in_file`].
    pub(crate) fn input(
        place: Place,
        expected: impl Into<String>,
        found: impl Into<String>,
        hint: &'static str,
    ) -> Self {
        let expected = expected.into();
        let found = found.into();
        Self { file: String::new(), place, expected, found, hint, fault: Fault::Input }
    }

    /// More memory is needed than allowed.
    pub(crate) fn limit(expected: impl Into<String>, found: impl Into<String>, hint: &'static str) -> Self {
        Self { fault: Fault::Limit, ..Self::input(Place::File, expected, found, hint) }
    }

    /// The reader was asked to stop.
    pub(crate) fn cancelled() -> Self {
        let fault = Fault::Cancelled;
        Self { fault, ..Self::input(Place::File, "to read on", "a request to stop", "start again") }
    }

    /// The file system refused.
    pub(crate) fn file_system(expected: &str, found: impl Into<String>, hint: &'static str) -> Self {
        Self { fault: Fault::FileSystem, ..Self::input(Place::File, expected, found, hint) }
    }

    /// There is no file of that name.
    pub(crate) fn missing() -> Self {
        Self::file_system(A_FILE, "no such file", "check its name and folder")
    }

    /// Whether it is that there is no file of that name, and not one that the file names.
    pub fn is_missing_file(&self) -> bool {
        self.fault == Fault::FileSystem && self.expected == A_FILE
    }

    /// The same error with the name of the file, which must be escaped already.
    pub(crate) fn in_file(self, file: &str) -> Self {
        Self { file: file.to_owned(), ..self }
    }
}

impl From<Exceeded> for ReadError {
    fn from(e: Exceeded) -> Self {
        let limit =
            e.limit.map_or_else(|| "as many bytes as there are".to_owned(), |limit| format!("at most {limit} bytes"));
        let hint = "raise the memory limit (--max-memory), or thin out the data";
        let found = format!("{} for {}", e.needed, e.what);
        let expected = format!("{limit} of memory for all that is read");
        Self::limit(expected, found, hint)
    }
}
