//! Counts in sentences.

/// `1 cell`, `2 cells`: a count of what this is one of.
pub(crate) fn counted(count: u64, one: &str) -> String {
    let s = if count == 1 { "" } else { "s" };
    format!("{count} {one}{s}")
}

#[cfg(test)]
mod tests {
    #[test]
    fn one_is_no_plural() {
        assert_eq!([0, 1, 2].map(|n| super::counted(n, "cell")), ["0 cells", "1 cell", "2 cells"]);
    }
}
