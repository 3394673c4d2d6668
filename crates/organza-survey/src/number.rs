//! Numbers for people: no more digits than say something.

/// `x` to a whole number of steps of about `unit`, as TOML writes it.
pub fn rounded(x: f64, unit: f64) -> String {
    let digits = (exponent(x) - exponent(unit)).clamp(0, 16) as usize;
    let near: f64 = format!("{x:.digits$e}").parse().unwrap_or(x);
    // No minus before nothing.
    let near = if near.abs() < unit { 0.0 } else { near };
    let text = format!("{near:?}");
    text.strip_suffix(".0").map(str::to_owned).unwrap_or(text)
}

/// `x` with so many digits that say something.
pub(crate) fn significant(x: f64, digits: i32) -> String {
    rounded(x, 10f64.powi(exponent(x) + 1 - digits))
}

/// A vector as a list in TOML.
pub(crate) fn list<const N: usize>(values: [f64; N], unit: f64) -> String {
    format!("[{}]", values.map(|x| rounded(x, unit)).join(", "))
}

/// A colour as a list in TOML.
pub(crate) fn color(values: [f32; 3]) -> String {
    list(values.map(f64::from), 1e-3)
}

/// Power of ten of the first digit.
fn exponent(x: f64) -> i32 {
    let text = format!("{:e}", x.abs());
    text.split_once('e').and_then(|(_, power)| power.parse().ok()).unwrap_or(0)
}

/// A size of a file for people, in powers of a thousand, as disks are sold: `302 MB`.
pub fn sized(bytes: u64) -> String {
    const UNITS: [&str; 4] = ["kB", "MB", "GB", "TB"];
    let mut size = bytes as f64;
    if bytes < 1000 {
        return format!("{bytes} bytes");
    }
    let mut unit = 0;
    size /= 1000.0;
    // 999.5 would round to 1000.
    while size >= 999.5 && unit + 1 < UNITS.len() {
        size /= 1000.0;
        unit += 1;
    }
    let digits = if size < 9.995 { 2 } else { usize::from(size < 99.95) };
    format!("{size:.digits$} {}", UNITS[unit])
}

/// A count with a comma after every third digit.
pub fn grouped(count: u64) -> String {
    let digits = count.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// A count of one thing or of several, with commas: `1 edge`, `1,234 edges`.
pub fn counted(count: u64, [one, several]: [&str; 2]) -> String {
    format!("{} {}", grouped(count), if count == 1 { one } else { several })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_have_three_digits_and_a_unit() {
        let texts = [999, 1_000, 12_345, 999_499, 999_500, 302_123_456, 7_250_000_000].map(sized);
        assert_eq!(texts, ["999 bytes", "1.00 kB", "12.3 kB", "999 kB", "1.00 MB", "302 MB", "7.25 GB"]);
    }

    #[test]
    fn numbers_have_the_digits_of_their_unit() {
        assert_eq!(rounded(1_234.567_89, 0.01), "1234.57");
        assert_eq!(rounded(637_012.239_87, 0.001), "637012.24");
        assert_eq!(rounded(1e7 + 0.25, 0.01), "10000000.25");
        assert_eq!(rounded(-0.000_01, 0.001), "0");
        assert_eq!(rounded(1.5e-9, 1e-12), "1.5e-9");
        assert_eq!(rounded(123_456.0, 1000.0), "123000");
        assert_eq!(significant(0.001_234_56, 3), "0.00123");
        assert_eq!(significant(0.0, 3), "0");
        assert_eq!(list([1.0, -2.5, 0.0], 0.1), "[1, -2.5, 0]");
    }

    #[test]
    fn counts_have_commas() {
        assert_eq!([0, 999, 1000, 1_234_567].map(grouped), ["0", "999", "1,000", "1,234,567"]);
        let edges = [0, 1, 1234].map(|n| counted(n, ["edge", "edges"]));
        assert_eq!(edges, ["0 edges", "1 edge", "1,234 edges"]);
    }
}
