//! Errors by their cause: usage, input, limits, or a fault of the program. Each has one exit code and a hint.

use organza_scene::{printable, shown};
use splat_core::Exceeded;
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
    /// A scene file gives no scene. Exit code 3, but for what lies in the command line (2), the file system (4) or its size (5).
    #[error(transparent)]
    Scene(#[from] organza_scene::Error),
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
    /// An output was not written. Exit code 4, or 2 where its name says nothing of its format.
    #[error(transparent)]
    Output(#[from] organza_output::Error),
    /// The work would take more than it may. Exit code 5.
    #[error("{0}")]
    Limit(Exceeded),
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

    /// A file that holds something else than the object takes.
    pub fn wrong_kind(path: &Path, expected: &str, hint: &str) -> Self {
        Self::input(printable(path), format!("expected {expected}"), hint)
    }

    /// An error of the nouns about the data of `what` (an object, a file).
    pub fn from_core(what: &str, error: splat_core::Error) -> Self {
        match error {
            splat_core::Error::Limit(e) => Self::Limit(e.owned_by(what, "use a larger `spacing` or a smaller image")),
            splat_core::Error::Cancelled => Self::Cancelled,
            other => Self::input(what, other.to_string(), ""),
        }
    }

    /// An error of a reader.
    pub fn from_read(path: &Path, error: &read::ReadError) -> Self {
        let what = format!("{}{}", printable(Path::new(&error.file)), error.place);
        let message = format!("expected {}, found {}", error.expected, shown(&error.found));
        match error.fault {
            read::Fault::FileSystem if error.is_missing_file() => {
                Self::io(path, "cannot read", std::io::Error::new(std::io::ErrorKind::NotFound, error.found.as_str()))
            }
            read::Fault::FileSystem => {
                Self::io(path, "cannot read", std::io::Error::other(format!("{message}; {}", error.hint)))
            }
            read::Fault::Cancelled => Self::Cancelled,
            read::Fault::Limit => Self::TooLarge { what, message, hint: error.hint.into() },
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
            Self::Limit(e) => Self::Limit(match file {
                Some(file) => {
                    let hint = e.hint.clone();
                    e.owned_by(&printable(file), hint)
                }
                None => e,
            }),
            other => other,
        }
    }

    /// What an error is about before it is known which file an object was made from.
    pub(crate) const OF_SCENE: &str = "scene";

    /// The exit code of the command.
    pub fn exit_code(&self) -> u8 {
        use {organza_output::Error as Output, organza_scene::Error as Scene};
        match self {
            Self::Internal(_) | Self::Scene(Scene::Internal(_)) | Self::Output(Output::Internal(_)) => 1,
            Self::Usage { .. } | Self::Scene(Scene::Usage { .. }) | Self::Output(Output::Usage { .. }) => 2,
            Self::Scene(Scene::Limit(_)) => 5,
            Self::Io { .. } | Self::Output(_) | Self::Scene(Scene::Io { .. }) => 4,
            Self::Scene(_) | Self::Input { .. } => 3,
            Self::Limit(_) | Self::TooLarge { .. } | Self::Unresolved { .. } => 5,
            Self::Gpu { .. } => 6,
            Self::Cancelled => 130,
        }
    }

    /// The remedy; may be empty.
    pub fn hint(&self) -> &str {
        match self {
            Self::Scene(error) => error.hint(),
            Self::Output(error) => error.hint(),
            Self::Usage { hint, .. }
            | Self::Input { hint, .. }
            | Self::TooLarge { hint, .. }
            | Self::Unresolved { hint, .. }
            | Self::Gpu { hint, .. } => hint,
            Self::Limit(exceeded) => &exceeded.hint,
            Self::Io { .. } | Self::Cancelled => "",
            Self::Internal(_) => "this is a bug in Organza, please report it",
        }
    }
}

/// An error of a conversion; it knows the object, but not the file that the object came from.
impl From<convert::ConvertError> for Error {
    fn from(error: convert::ConvertError) -> Self {
        use convert::ConvertError;
        match error {
            ConvertError::Limit(e) => Self::Limit(Exceeded {
                what: shown(&e.what).into(),
                hint: "use a larger spacing, or a larger --max-memory or render.max_points".into(),
                ..e
            }),
            ConvertError::Cancelled => Self::Cancelled,
            other => Self::input(Self::OF_SCENE, other.to_string(), ""),
        }
    }
}

impl From<organza_device::Error> for Error {
    fn from(error: organza_device::Error) -> Self {
        let hint = "`organza devices` lists what there is; --backend cpu needs none".into();
        Self::Gpu { message: error.to_string(), hint }
    }
}
