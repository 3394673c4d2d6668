//! The columns that say how large the kernel of a point of matter is and how much it absorbs, and what their numbers may be.

/// The kernel's reach: beyond that length of the file the point has no matter.
pub(crate) const RADIUS: &str = "radius";
/// Half the kernel's reach, as the kernels of smoothed particles end at twice this length (Monaghan 1992).
pub(crate) const SMOOTHING_LENGTH: &str = "smoothing_length";
/// A factor of the object's extinction.
pub(crate) const EXTINCTION: &str = "extinction";

/// The name, where it is that of a column of matter.
pub(crate) fn of_matter(column: &str) -> Option<&'static str> {
    [RADIUS, SMOOTHING_LENGTH, EXTINCTION].into_iter().find(|name| *name == column)
}

/// What a number of a column of matter has to be, in words, where it is not that.
pub(crate) fn expected(column: &str, number: f64) -> Option<&'static str> {
    match column {
        EXTINCTION if !(number.is_finite() && number >= 0.0) => Some("a finite number from 0 on"),
        RADIUS | SMOOTHING_LENGTH if !(number.is_finite() && number > 0.0) => Some("a finite length above 0"),
        _ => None,
    }
}
