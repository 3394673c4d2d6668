//! What can be wrong with a scene, by whose fault it is; each says what to do.

use super::printable;
use splat_core::Exceeded;
use std::path::{Path, PathBuf};

/// Why a scene file gives no scene.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A change from the command line is wrong ([`Override`](super::Override)).
    #[error("{message}")]
    Usage {
        /// What was found and what was expected.
        message: String,
        /// What to do; may be empty.
        hint: String,
    },
    /// The scene file is wrong at one place.
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
    /// The scene file could not be read.
    #[error("{}: {action}: {source}", printable(path))]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What was attempted, such as `cannot read`.
        action: &'static str,
        /// The system's answer.
        source: std::io::Error,
    },
    /// A table of labels that the scene names is wrong.
    #[error("{message}")]
    Table {
        /// The file, the place in it, what was expected and what was found.
        message: String,
        /// What to do; may be empty.
        hint: String,
    },
    /// The scene file is larger than it may be.
    #[error("{0}")]
    Limit(Exceeded),
    /// A promise between the steps of this crate was broken.
    #[error("{0}")]
    Internal(String),
}

impl Error {
    /// What to do about it; may be empty.
    pub fn hint(&self) -> &str {
        match self {
            Self::Usage { hint, .. } | Self::Scene { hint, .. } | Self::Table { hint, .. } => hint,
            Self::Limit(exceeded) => &exceeded.hint,
            Self::Io { .. } => "",
            Self::Internal(_) => "this is a bug in Organza, please report it",
        }
    }

    pub(crate) fn usage(message: impl Into<String>, hint: impl Into<String>) -> Self {
        Self::Usage { message: message.into(), hint: hint.into() }
    }

    pub(crate) fn io(path: &Path, action: &'static str, source: std::io::Error) -> Self {
        Self::Io { path: path.to_owned(), action, source }
    }
}
