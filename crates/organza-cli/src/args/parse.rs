//! Texts of arguments → values.

use super::Frames;
use organza::scene::Goal;
use splat_core::srgb::linear_from_hex;
#[cfg(feature = "view")]
use std::net::{IpAddr, SocketAddr};

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

/// Colours with a name, as CSS has them, 0xRRGGBB.
const COLORS: [(&str, u32); 17] = [
    ("black", 0x000000),
    ("white", 0xffffff),
    ("grey", 0x808080),
    ("gray", 0x808080),
    ("darkgrey", 0x404040),
    ("lightgrey", 0xd3d3d3),
    ("silver", 0xc0c0c0),
    ("ivory", 0xfffff0),
    ("beige", 0xf5f5dc),
    ("skyblue", 0x87ceeb),
    ("lightblue", 0xadd8e6),
    ("navy", 0x000080),
    ("blue", 0x0000ff),
    ("green", 0x008000),
    ("red", 0xff0000),
    ("yellow", 0xffff00),
    ("orange", 0xffa500),
];

/// A colour by its name or its bytes of sRGB, linear Rec.709.
pub(super) fn parse_color(text: &str) -> Result<[f32; 3], String> {
    let named = COLORS.iter().find(|(name, _)| name.eq_ignore_ascii_case(text)).map(|(_, rgb)| *rgb);
    let bytes = text.strip_prefix('#').filter(|digits| digits.bytes().all(|digit| digit.is_ascii_hexdigit()));
    let bytes = bytes.and_then(|digits| match digits.len() {
        6 => u32::from_str_radix(digits, 16).ok(),
        // Each digit stands twice.
        3 => u32::from_str_radix(&digits.chars().flat_map(|digit| [digit; 2]).collect::<String>(), 16).ok(),
        _ => None,
    });
    let names = || COLORS.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
    named.or(bytes).map(linear_from_hex).ok_or_else(|| format!("expected #rrggbb or one of {}", names()))
}

/// Two numbers, the first below the second.
pub(super) fn parse_range(text: &str) -> Result<[f64; 2], String> {
    let ends = text.split_once(',').and_then(|(low, high)| Some([low.trim().parse().ok()?, high.trim().parse().ok()?]));
    let rises = |[low, high]: &[f64; 2]| low.is_finite() && high.is_finite() && low < high;
    ends.filter(rises).ok_or_else(|| "expected LOW,HIGH, two numbers of which the first is less, such as 0,100".into())
}

/// Milliseconds of a budget.
pub(super) fn parse_budget(text: &str) -> Result<u64, String> {
    let ms = text.parse().ok().filter(|ms| (1..=Goal::MOST_MS).contains(ms));
    ms.ok_or_else(|| format!("expected a whole number of milliseconds from 1 to {}, such as 2000", Goal::MOST_MS))
}

/// The largest error of a displayed picture.
pub(super) fn parse_error_limit(text: &str) -> Result<f64, String> {
    let error = text.parse().ok().filter(|error: &f64| *error > 0.0 && *error <= 1.0);
    error.ok_or_else(|| "expected a number above 0, at most 1, such as 0.004".into())
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

/// A numeric address, with or without a port: port 0 is any that is free.
#[cfg(feature = "view")]
pub(super) fn parse_address(text: &str) -> Result<SocketAddr, String> {
    // The one name that needs no look-up, and means the same everywhere.
    let numeric = match text.strip_prefix("localhost") {
        Some(rest) if rest.is_empty() || rest.starts_with(':') => format!("127.0.0.1{rest}"),
        _ => text.to_owned(),
    };
    let with_port = numeric.parse::<SocketAddr>().ok();
    let alone = || numeric.parse::<IpAddr>().ok().map(|ip| SocketAddr::new(ip, 0));
    with_port
        .or_else(alone)
        .ok_or_else(|| "expected `localhost` or a numeric address, such as 127.0.0.1:8000 or ::1".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(feature = "view")]
    #[test]
    fn addresses_are_numbers() {
        let read = |text| parse_address(text).ok().map(|address| address.to_string());
        assert_eq!(read("127.0.0.1:8000").as_deref(), Some("127.0.0.1:8000"));
        assert_eq!([read("0.0.0.0"), read("::1")].map(Option::unwrap), ["0.0.0.0:0", "[::1]:0"]);
        assert_eq!([read("localhost"), read("localhost:80")].map(Option::unwrap), ["127.0.0.1:0", "127.0.0.1:80"]);
        assert!(
            ["", "localhost:", "localhosts", "a.localhost", "a.example:80", "127.0.0.1:99999", ":80"]
                .iter()
                .all(|t| read(t).is_none())
        );
    }

    #[test]
    fn sizes_and_bytes_are_read() {
        assert_eq!(parse_size("960x540"), Ok([960, 540]));
        assert!(["", "960", "x", "9x9x9", "1e3x2", " 9x9"].iter().all(|t| parse_size(t).is_err()));
        assert_eq!(parse_bytes("8G"), Ok(8 << 30));
        assert_eq!(parse_frames("all"), Ok(Frames::All));
        assert_eq!([parse_frames("0-47"), parse_frames("9")], [Ok(Frames::Range(0, 47)), Ok(Frames::Range(9, 9))]);
        assert!(["", "-", "5-", "-1", "5-4", "1..4", "a"].iter().all(|t| parse_frames(t).is_err()));
        assert_eq!(parse_bytes("123"), Ok(123));
        assert_eq!(parse_budget("2000"), Ok(2000));
        assert!(["", "0", "-5", "nan", "1e99", "1.5", "86400001"].iter().all(|t| parse_budget(t).is_err()));
        assert_eq!([parse_error_limit("0.004"), parse_error_limit("1")], [Ok(0.004), Ok(1.0)]);
        assert!(["", "0", "-1", "nan", "inf", "1.01", "a"].iter().all(|t| parse_error_limit(t).is_err()));
        assert!(["", "0", "-1", "G", "1.5G", "99999999999T", "1ü"].iter().all(|t| parse_bytes(t).is_err()));
    }
}
