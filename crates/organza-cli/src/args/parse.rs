//! Texts of arguments → values.

use super::Frames;

pub(super) fn parse_frames(text: &str) -> Result<Frames, String> {
    if text == "all" {
        return Ok(Frames::All);
    }
    let (first, last) = text.split_once('-').unwrap_or((text, text));
    match (first.parse(), last.parse()) {
        (Ok(first), Ok(last)) if first <= last => Ok(Frames::Range(first, last)),
        _ => Err("expected FIRST-LAST, such as 0-47, or one frame".into()),
    }
}

pub(super) fn parse_size(text: &str) -> Result<[i64; 2], String> {
    let sides = text.split_once(['x', 'X']).and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    sides.ok_or_else(|| "expected WIDTHxHEIGHT, such as 960x540".into())
}

/// Part of the name of a device, which drivers give 256 bytes at most.
pub(super) fn parse_device(text: &str) -> Result<String, String> {
    let fits = text.len() <= 200;
    fits.then(|| text.to_owned()).ok_or_else(|| "expected a part of a device's name, of 200 bytes at most".into())
}

pub(super) fn parse_finite(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|x: &f64| x.is_finite()).ok_or_else(|| "expected a finite number".into())
}

/// A number of bytes with an optional K, M, G or T (powers of 1024).
pub(super) fn parse_bytes(text: &str) -> Result<u64, String> {
    let (digits, shift) = match text.chars().last().map(|c| c.to_ascii_uppercase()) {
        Some('K') => (&text[..text.len() - 1], 10),
        Some('M') => (&text[..text.len() - 1], 20),
        Some('G') => (&text[..text.len() - 1], 30),
        Some('T') => (&text[..text.len() - 1], 40),
        _ => (text, 0),
    };
    let bytes = digits.parse::<u64>().ok().and_then(|n| n.checked_mul(1 << shift)).filter(|n| *n > 0);
    bytes.ok_or_else(|| "expected a number of bytes above 0, such as 500M or 8G".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_and_bytes_are_read() {
        assert_eq!(parse_size("960x540"), Ok([960, 540]));
        assert!(["", "960", "x", "9x9x9", "1e3x2", " 9x9"].iter().all(|t| parse_size(t).is_err()));
        assert_eq!(parse_bytes("8G"), Ok(8 << 30));
        assert_eq!(parse_frames("all"), Ok(Frames::All));
        assert_eq!([parse_frames("0-47"), parse_frames("9")], [Ok(Frames::Range(0, 47)), Ok(Frames::Range(9, 9))]);
        assert!(["", "-", "5-", "-1", "5-4", "1..4", "a"].iter().all(|t| parse_frames(t).is_err()));
        assert_eq!(parse_bytes("123"), Ok(123));
        assert!(["", "0", "-1", "G", "1.5G", "99999999999T", "1ü"].iter().all(|t| parse_bytes(t).is_err()));
    }
}
