//! The part of TOML that this repository writes one line at a time: tables, and `key = value` on a single line.
//!
//! A line without `=` (the inside of an array over several lines) is passed over; nothing here needs one.

/// One `key = value` line.
#[derive(Debug, PartialEq)]
pub(crate) struct Line<'a> {
    /// Number of the line, from 1.
    pub(crate) number: usize,
    /// Name of the table that the line stands in, without brackets; empty before the first.
    pub(crate) table: &'a str,
    /// How many table headings came before: tells the elements of an array of tables apart.
    pub(crate) heading: usize,
    pub(crate) key: &'a str,
    /// All that follows `=`, trimmed.
    pub(crate) value: &'a str,
}

/// The `key = value` lines of a text.
pub(crate) fn lines(text: &str) -> Vec<Line<'_>> {
    let mut table = "";
    let mut heading = 0;
    let mut found = Vec::new();
    for (at, line) in text.lines().map(str::trim).enumerate() {
        if line.starts_with('[') && line.ends_with(']') {
            table = line.trim_matches(['[', ']']);
            heading += 1;
        } else if !line.starts_with('#')
            && let Some((key, value)) = line.split_once('=')
        {
            found.push(Line { number: at + 1, table, heading, key: key.trim(), value: value.trim() });
        }
    }
    found
}

/// The content of a basic string on one line, with its `\"` and `\\` resolved.
pub(crate) fn string(value: &str) -> Result<String, String> {
    let body = value.strip_prefix('"').ok_or_else(|| format!("expected a string in quotes, found {value}"))?;
    let mut content = String::new();
    let mut rest = body.chars();
    while let Some(c) = rest.next() {
        match c {
            '"' => {
                let tail = rest.as_str().trim();
                let clean = tail.is_empty() || tail.starts_with('#');
                return if clean { Ok(content) } else { Err(format!("expected the line's end, found {tail}")) };
            }
            '\\' => match rest.next() {
                Some(escaped @ ('"' | '\\')) => content.push(escaped),
                other => return Err(format!("expected \\\" or \\\\, found \\{}", other.unwrap_or(' '))),
            },
            _ => content.push(c),
        }
    }
    Err(format!("expected a closing quote in {value}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_know_their_table() {
        let read = lines("top = 1\n[a.b]\n# no = line\nx = [\n  \"y\",\n]\n[[row]]\nk = \"v\"\n[[row]]\nk = \"w\"\n");
        let seen: Vec<_> = read.iter().map(|l| (l.number, l.table, l.heading, l.key, l.value)).collect();
        let rows = [(8, "row", 2, "k", "\"v\""), (10, "row", 3, "k", "\"w\"")];
        assert_eq!(seen[..2], [(1, "", 0, "top", "1"), (4, "a.b", 1, "x", "[")]);
        assert_eq!(seen[2..], rows);
    }

    #[test]
    fn strings_resolve_escapes_and_refuse_the_rest() {
        assert_eq!(string(r#""a \"b\" \\" # c"#), Ok(r#"a "b" \"#.to_owned()));
        for bad in ["bare", "\"open", "\"a\" b", r#""\n""#] {
            assert!(string(bad).is_err(), "{bad}");
        }
    }
}
