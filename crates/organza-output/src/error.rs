//! Errors of outputs; each message states a remedy.

use organza_scene::printable;
use std::path::{Path, PathBuf};

/// Why a file was not written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The name of the file says nothing of its format.
    #[error("{message}")]
    Usage {
        /// The found and the expected.
        message: String,
        /// What to do.
        hint: String,
    },
    /// The file system failed.
    #[error("{}: {action}: {source}", printable(path))]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// The failed action, such as `cannot write`.
        action: &'static str,
        /// The system's answer.
        source: std::io::Error,
    },
    /// The file may not be written where it was asked for.
    #[error("{}: {message}", printable(path))]
    Output {
        /// The file.
        path: PathBuf,
        /// Why not.
        message: String,
        /// What to do.
        hint: String,
    },
    /// An encoder failed.
    #[error("{0}")]
    Internal(String),
}

impl Error {
    /// What to do about it; may be empty.
    pub fn hint(&self) -> &str {
        match self {
            Self::Usage { hint, .. } | Self::Output { hint, .. } => hint,
            Self::Io { source, .. } if source.kind() == std::io::ErrorKind::StorageFull => "free some space",
            Self::Io { .. } => "",
            Self::Internal(_) => "this is a bug in Organza, please report it",
        }
    }

    pub(crate) fn io(path: &Path, action: &'static str, source: std::io::Error) -> Self {
        Self::Io { path: path.to_owned(), action, source }
    }
}
