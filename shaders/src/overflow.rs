//! A recording that was made for less than it is given.

/// A recording has less room than it needs: record again with what it needs. The one payload of every stage's
/// `Error::Overflow`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the recording has room for {had} {what}, needed {needed}: record again with that")]
pub struct Overflow {
    /// What there is too little room for.
    pub what: &'static str,
    /// Room that is needed, elements.
    pub needed: u64,
    /// Room that there was, elements.
    pub had: u64,
}

impl Overflow {
    /// Whether so many elements fit.
    ///
    /// # Errors
    /// [`Overflow`] where they do not.
    pub fn check(what: &'static str, needed: u64, had: u64) -> Result<(), Self> {
        if needed > had { Err(Self { what, needed, had }) } else { Ok(()) }
    }
}
