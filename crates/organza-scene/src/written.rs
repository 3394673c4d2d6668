//! Where a value was written, for what is found wrong with it once data are known.

use crate::{Error, escape_controls};
use std::path::Path;

/// Where a value was written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Written {
    /// Line and column in characters of the scene file, both from 1.
    File(usize, usize),
    /// A change from the command line, as it stands there.
    Flag(String),
}

impl Written {
    /// An error there; control characters are escaped.
    pub fn error(&self, file: &Path, message: &str, hint: &str) -> Error {
        let escape = |text: &str| escape_controls(text).into_owned();
        match self {
            Self::File(line, column) => Error::Scene {
                file: file.to_owned(),
                line: *line,
                column: *column,
                message: escape(message),
                hint: escape(hint),
            },
            Self::Flag(flag) => Error::usage(escape(&format!("{flag}: {message}")), escape(hint)),
        }
    }
}
