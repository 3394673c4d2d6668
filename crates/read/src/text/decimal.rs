//! Decimal numbers in text, the same in every format.

/// What is expected of the last number of a file that ends with a point.
pub(crate) const CUT: &str = "digits or a line end after the point, where the file ends";

/// A decimal number with or without sign, point and exponent; NaN and infinities too. `last` where the file ends with it: a
/// point without digits is cut off there, while elsewhere it is how some programs write whole numbers.
pub(crate) fn decimal(word: &[u8], last: bool) -> Option<f64> {
    if last && word.ends_with(b".") {
        return None;
    }
    std::str::from_utf8(word).ok()?.parse().ok()
}
