//! Errors of the nouns: input that breaks a promise, too much of something, work cancelled.

/// What can go wrong in this crate.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// An attribute of one element is outside its range.
    #[error("{element} {index}: {attribute} is {found}, expected {expected}")]
    Invalid {
        /// The kind of element: `splat`, `vertex`, `face`, `light`, `camera` …
        element: &'static str,
        /// Index of the element.
        index: usize,
        /// Name of the attribute.
        attribute: &'static str,
        /// The value, printed.
        found: String,
        /// The accepted range, in words.
        expected: &'static str,
    },
    /// Two columns of one table differ in length.
    #[error("column {attribute} has {found} entries, expected {expected}")]
    ColumnLength {
        /// Name of the column.
        attribute: &'static str,
        /// Its length.
        found: usize,
        /// The length of the table.
        expected: usize,
    },
    /// More than there may be.
    #[error("{0}")]
    Limit(crate::Exceeded),
    /// A recording has less room than it needs.
    #[cfg(feature = "gpu")]
    #[error(transparent)]
    Overflow(#[from] splat_shaders::Overflow),
    /// The caller asked to stop, see [`crate::Progress`].
    #[error("cancelled")]
    Cancelled,
}

impl Error {
    /// Shorthand for [`Error::Invalid`].
    pub fn invalid(
        element: &'static str,
        index: usize,
        attribute: &'static str,
        found: impl std::fmt::Debug,
        expected: &'static str,
    ) -> Self {
        Self::Invalid { element, index, attribute, found: format!("{found:?}"), expected }
    }
}
