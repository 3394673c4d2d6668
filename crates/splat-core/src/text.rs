//! Words of messages: counts in sentences, and names that may be shown on a terminal.

use std::path::Path;

/// `1 cell`, `2 cells`: a count of what this is one of.
pub fn counted(count: u64, one: &str) -> String {
    let s = if count == 1 { "" } else { "s" };
    format!("{count} {one}{s}")
}

/// A path as it may be shown on a terminal: control and direction characters and bytes that are not UTF-8 are escaped.
pub fn escaped_path(path: &Path) -> String {
    escaped(path.as_os_str().as_encoded_bytes(), usize::MAX)
}

/// At most `limit` characters of `bytes`, escaped, `…` for the rest.
pub fn escaped(bytes: &[u8], limit: usize) -> String {
    let mut out = String::new();
    let mut left = limit;
    for chunk in bytes.utf8_chunks() {
        for c in chunk.valid().chars() {
            if left == 0 {
                return out + "…";
            }
            left -= 1;
            match c {
                '\\' => out.push_str("\\\\"),
                c if c.is_control() || is_direction(c) => out.extend(c.escape_default()),
                c => out.push(c),
            }
        }
        for byte in chunk.invalid() {
            if left == 0 {
                return out + "…";
            }
            left -= 1;
            out.push_str(&format!("\\x{byte:02x}"));
        }
    }
    out
}

/// Characters that reorder or hide the text around them.
fn is_direction(c: char) -> bool {
    matches!(c, '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}' | '\u{feff}')
}

#[cfg(test)]
mod tests {
    #[test]
    fn one_is_no_plural() {
        assert_eq!([0, 1, 2].map(|n| super::counted(n, "cell")), ["0 cells", "1 cell", "2 cells"]);
    }
}
