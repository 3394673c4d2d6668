//! What was given, as messages repeat it: no more than can be read, and nothing that steers a terminal.

use glam::DVec3;
use std::borrow::Cow;
use std::path::Path;

/// Most characters of what was given that a message repeats.
const MOST_SHOWN: usize = 200;

/// What was given (a name, a key, a value, an expression), for a message: its first 200 characters, those escaped that would
/// steer a terminal.
pub fn shown(text: &str) -> String {
    // Of the bytes that are not looked at there may be millions.
    match text.char_indices().nth(MOST_SHOWN) {
        Some(_) => {
            let end = text.char_indices().nth(MOST_SHOWN - 1).map_or(0, |(at, _)| at);
            format!("{}…", escape_controls(&text[..end]))
        }
        None => escape_controls(text).into_owned(),
    }
}

/// A path for a message: what is not UTF-8 or would steer a terminal is escaped, and of a long one the middle is left out,
/// so that 200 characters are shown.
pub fn printable(path: &Path) -> String {
    let mut characters = Vec::new();
    for chunk in path.as_os_str().as_encoded_bytes().utf8_chunks() {
        characters.extend(chunk.valid().chars().map(|c| escape_controls(c.encode_utf8(&mut [0; 4])).into_owned()));
        characters.extend(chunk.invalid().iter().map(|byte| format!("\\x{byte:02x}")));
    }
    if characters.len() > MOST_SHOWN {
        let half = MOST_SHOWN / 2;
        characters.splice(half..characters.len() - half + 1, ["…".to_owned()]);
    }
    characters.concat()
}

/// A number as it was given, unless its zeros would fill a line: these are written as a power of ten.
pub fn short(value: f64) -> String {
    const LONGEST: usize = 20;
    let plain = value.to_string();
    if plain.len() <= LONGEST { plain } else { format!("{value:e}") }
}

/// A place or a direction for a message: four digits are enough to find it.
pub fn place(p: DVec3) -> String {
    let digits = |v: f64| {
        let unit = 10f64.powi(3 - libm::log10(v.abs().max(1e-300)).floor() as i32);
        let rounded = (v * unit).round() / unit;
        if rounded.is_finite() { rounded } else { v }
    };
    format!("{:?}", p.to_array().map(digits))
}

/// `text` with control characters and marks that change the direction of writing escaped, so that a name in a file can
/// neither steer the terminal nor fake a line of output.
pub fn escape_controls(text: &str) -> Cow<'_, str> {
    let steers = |c: char| {
        c.is_control() || matches!(c, '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
    };
    if !text.contains(steers) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        if steers(c) { out.extend(c.escape_default()) } else { out.push(c) }
    }
    Cow::Owned(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_cannot_steer_the_terminal() {
        assert_eq!(escape_controls("a\u{1b}[2Jb\nc"), "a\\u{1b}[2Jb\\nc");
        assert_eq!(escape_controls("grün"), "grün");
        assert_eq!(escape_controls("\u{202e}gnp.exe"), "\\u{202e}gnp.exe");
    }

    #[test]
    fn no_more_than_200_characters_are_repeated() {
        let exact = "ü".repeat(200);
        assert_eq!(shown(&exact), exact);
        assert_eq!(shown(&"ü".repeat(1 << 20)), format!("{}…", "ü".repeat(199)));
        assert_eq!(shown(&"\u{7}".repeat(201)), format!("{}…", "\\u{7}".repeat(199)));
        assert_eq!(printable(Path::new(&exact)), exact);
        let long = format!("/start/{}/end.ply", "ü".repeat(1000));
        let cut = printable(Path::new(&long));
        assert_eq!(cut.chars().count(), 200);
        assert!(cut.starts_with("/start/ü") && cut.contains("ü…ü") && cut.ends_with("ü/end.ply"), "{cut}");
    }

    #[cfg(unix)]
    #[test]
    fn bi34_paths_that_are_not_utf8_are_printed_escaped() {
        use std::os::unix::ffi::OsStrExt;
        let path = Path::new(std::ffi::OsStr::from_bytes(b"a\xff\nb.toml"));
        assert_eq!(printable(path), "a\\xff\\nb.toml");
    }

    #[test]
    fn places_have_four_digits() {
        assert_eq!(place(DVec3::new(1234.56, -0.000_123_456, 0.0)), "[1235.0, -0.0001235, 0.0]");
    }
}
