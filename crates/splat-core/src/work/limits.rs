//! How much a stage may take, and what it says where it would take more.

use std::borrow::Cow;

/// How much a stage may take. What needs more is refused, before the memory is taken.
///
/// ```
/// use splat_core::Limits;
/// let limits = Limits { max_elements: 1_000_000, ..Limits::default() };
/// assert_eq!(limits.max_bytes, 4 << 30);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Bytes; each stage says of what.
    pub max_bytes: u64,
    /// Elements; each stage says which: splats of a cloud, particles of a set, entries of a map.
    pub max_elements: u64,
}

impl Default for Limits {
    /// 4 GiB, 10⁸ elements.
    fn default() -> Self {
        Self { max_bytes: 4 << 30, max_elements: 100_000_000 }
    }
}

impl Limits {
    /// Everything that fits into the stage's own numbers.
    pub const NONE: Self = Self { max_bytes: u64::MAX, max_elements: u64::MAX };

    /// So many bytes, of any number of elements.
    pub const fn bytes(max_bytes: u64) -> Self {
        Self { max_bytes, ..Self::NONE }
    }

    /// So many elements, of any size.
    pub const fn elements(max_elements: u64) -> Self {
        Self { max_elements, ..Self::NONE }
    }
}

/// Something that needs more than it may have: the one payload of every stage's `Error::Limit`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Exceeded {
    /// What needs it.
    pub what: Cow<'static, str>,
    /// How much is needed; [`u64::MAX`] for more than can be counted.
    pub needed: u64,
    /// How much there may be; `None` where the system has no more memory.
    pub limit: Option<u64>,
    /// What is counted: `bytes`, `splats` …
    pub unit: &'static str,
    /// The knob to turn; may be empty.
    pub hint: Cow<'static, str>,
}

/// From here on numbers are shown with four digits.
const ROUNDED: u64 = 1_000_000_000_000_000;

impl Exceeded {
    /// Refuses what needs more than there may be; the fields in their order.
    ///
    /// # Errors
    /// With `needed` above `limit`.
    pub fn check(
        what: impl Into<Cow<'static, str>>,
        needed: u64,
        limit: u64,
        unit: &'static str,
        hint: impl Into<Cow<'static, str>>,
    ) -> Result<(), Self> {
        match needed <= limit {
            true => Ok(()),
            false => Err(Self { what: what.into(), needed, limit: Some(limit), unit, hint: hint.into() }),
        }
    }

    /// Names the owner of the refused item, as `whose: what`, and takes the hint that is known there.
    pub fn owned_by(self, whose: &str, hint: impl Into<Cow<'static, str>>) -> Self {
        Self { what: format!("{whose}: {}", self.what).into(), hint: hint.into(), ..self }
    }
}

impl std::fmt::Display for Exceeded {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { what, needed, limit, unit, .. } = self;
        match *needed {
            u64::MAX => write!(f, "{what} needs more {unit} than can be counted")?,
            ROUNDED.. => write!(f, "{what} needs {:.3e} {unit}", *needed as f64)?,
            needed => write!(f, "{what} needs {needed} {unit}")?,
        }
        match limit {
            Some(limit) => write!(f, ", the limit is {limit} {unit}"),
            None => write!(f, ", the system has no memory for them"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_exceeded_is_said_in_one_sentence() {
        let hint = "use a larger spacing".into();
        let few = Exceeded { what: "a cloud".into(), needed: 3, limit: Some(2), unit: "splats", hint };
        assert_eq!(few.to_string(), "a cloud needs 3 splats, the limit is 2 splats");
        let many = Exceeded { needed: u64::MAX, limit: None, ..few.clone() };
        assert_eq!(
            many.to_string(),
            "a cloud needs more splats than can be counted, the system has no memory for them"
        );
        let rounded = Exceeded { needed: 10_u64.pow(18), ..few.clone() };
        assert_eq!(rounded.to_string(), "a cloud needs 1.000e18 splats, the limit is 2 splats");
        let named = few.owned_by("object 'fog'", "");
        assert_eq!(named.to_string(), "object 'fog': a cloud needs 3 splats, the limit is 2 splats");
    }
}
