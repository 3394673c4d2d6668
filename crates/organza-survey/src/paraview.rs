//! Presets of ParaView: a JSON list of colour maps, of which the first is taken.
//!
//! `RGBPoints` lists value, red, green and blue in sRGB; `Points`, where it is there, value, opacity, and two numbers for the shape
//! between points, which are left out: opacities are linear between them.

use organza::{Error, printable};
use serde_json::Value;
use splat_core::srgb;
use std::path::Path;

/// Largest file, bytes.
const MOST_BYTES: u64 = 4 << 20;

/// Colours and opacities by value.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Sampled {
    /// Values with linear colours, rising.
    pub(crate) colors: Vec<(f64, [f32; 3])>,
    /// Values with opacities, rising; empty where the preset has none.
    pub(crate) opacities: Vec<(f64, f64)>,
}

impl Sampled {
    pub(crate) fn read(path: &Path) -> Result<Self, Error> {
        let io = |e| Error::io(path, "cannot read the preset", e);
        let meta = std::fs::metadata(path).map_err(io)?;
        if !meta.is_file() {
            return Err(io(std::io::Error::other("not a regular file")));
        }
        if meta.len() > MOST_BYTES {
            let message = format!("expected at most {MOST_BYTES} bytes, found {}", meta.len());
            return Err(bad(path, message));
        }
        let text = std::fs::read(path).map_err(io)?;
        let json: Value = serde_json::from_slice(&text).map_err(|e| bad(path, format!("not JSON: {e}")))?;
        Self::of_json(&json).map_err(|message| bad(path, message))
    }

    fn of_json(json: &Value) -> Result<Self, String> {
        let preset = json.get(0).unwrap_or(json);
        let colors = rows(preset, "RGBPoints", 4)?;
        if colors.is_empty() {
            return Err("expected a list `RGBPoints` of at least one value, red, green and blue, found none".into());
        }
        let color = |row: &[f64]| (row[0], [row[1], row[2], row[3]].map(|c| srgb::decoded(c.clamp(0.0, 1.0)) as f32));
        let opacity = |row: &[f64]| (row[0], row[1].clamp(0.0, 1.0));
        Ok(Self {
            colors: colors.chunks(4).map(color).collect(),
            opacities: rows(preset, "Points", 4)?.chunks(4).map(opacity).collect(),
        })
    }

    /// Lowest and highest value.
    pub(crate) fn range(&self) -> [f64; 2] {
        let values = || self.colors.iter().map(|c| c.0).chain(self.opacities.iter().map(|o| o.0));
        [values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max)]
    }

    pub(crate) fn color(&self, value: f64) -> [f32; 3] {
        between(&self.colors, value, |a, b, t| std::array::from_fn(|c| a[c] + (b[c] - a[c]) * t as f32))
    }

    pub(crate) fn opacity(&self, value: f64) -> Option<f64> {
        (!self.opacities.is_empty()).then(|| between(&self.opacities, value, |a, b, t| a + (b - a) * t))
    }
}

/// The value of a list at a place, the nearest end's outside.
fn between<T: Copy>(points: &[(f64, T)], at: f64, blend: impl Fn(T, T, f64) -> T) -> T {
    let above = points.partition_point(|p| p.0 <= at);
    match (above.checked_sub(1).map(|i| points[i]), points.get(above)) {
        (Some(a), Some(b)) => blend(a.1, b.1, (at - a.0) / (b.0 - a.0)),
        (Some(a), None) => a.1,
        (None, _) => points[0].1,
    }
}

/// The numbers of a list, whole rows of them by rising value.
fn rows(preset: &Value, key: &str, row: usize) -> Result<Vec<f64>, String> {
    let Some(list) = preset.get(key).and_then(Value::as_array) else { return Ok(Vec::new()) };
    let numbers: Option<Vec<f64>> = list.iter().map(Value::as_f64).collect();
    let Some(numbers) = numbers.filter(|n| n.len().is_multiple_of(row)) else {
        return Err(format!("`{key}`: expected numbers in groups of {row}, found {} entries", list.len()));
    };
    // Values of volumes are such, and differences of larger ones may be none.
    if let Some(large) = numbers.iter().find(|n| !(**n as f32).is_finite()) {
        return Err(format!("`{key}`: expected numbers that fit 32-bit floats, found {large}"));
    }
    if numbers.chunks(row).zip(numbers.chunks(row).skip(1)).any(|(a, b)| b[0] < a[0]) {
        return Err(format!("`{key}`: expected rising values"));
    }
    Ok(numbers)
}

fn bad(path: &Path, message: String) -> Error {
    Error::input(printable(path), message, "a preset is what ParaView exports from its list of colour maps")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_and_opacities_of_a_preset_are_read() {
        let json =
            r#"[{"Name": "x", "RGBPoints": [0, 0, 0, 0, 2, 1, 1, 0], "Points": [0, 0, 0.5, 0, 2, 0.5, 0.5, 0]}]"#;
        let preset = Sampled::of_json(&serde_json::from_str(json).unwrap()).unwrap();
        assert_eq!(preset.range(), [0.0, 2.0]);
        assert_eq!(preset.color(1.0), [0.5, 0.5, 0.0]);
        assert_eq!([preset.opacity(1.0), preset.opacity(9.0)], [Some(0.25), Some(0.5)]);
    }

    /// Every byte of a preset set to each of some others: an error, or colours and opacities that are numbers.
    #[test]
    fn a_damaged_preset_is_refused_or_valid() {
        let preset = br#"[{"RGBPoints":[-1,0.5,0,0,2e1,1,1,0],"Points":[0,0,0.5,0,12,0.5,0.5,0]}]"#;
        let mut read = 0;
        for at in 0..preset.len() {
            for byte in *b"09-.e,][}{\"\0\xff" {
                let mut damaged = preset.to_vec();
                damaged[at] = byte;
                let Ok(json) = serde_json::from_slice(&damaged) else { continue };
                let Ok(preset) = Sampled::of_json(&json) else { continue };
                let [low, high] = preset.range();
                for value in [low, 0.5 * (low + high), high] {
                    let valid = preset.color(value).iter().all(|c| (0.0..=1.0).contains(c));
                    let opacity = preset.opacity(value).unwrap_or(0.0);
                    assert!(valid && (0.0..=1.0).contains(&opacity), "{}", String::from_utf8_lossy(&damaged));
                }
                read += 1;
            }
        }
        assert!(read > 50, "{read}");
    }

    #[test]
    fn what_is_no_preset_is_refused() {
        let large = r#"[{"RGBPoints": [-1e308, 0, 0, 0, 1e308, 0, 0, 0]}]"#;
        for json in
            [large, "[]", "{}", r#"[{"RGBPoints": [0, 1]}]"#, r#"[{"RGBPoints": [2, 0, 0, 0, 1, 0, 0, 0]}]"#, "3"]
        {
            assert!(Sampled::of_json(&serde_json::from_str(json).unwrap()).is_err(), "{json}");
        }
    }
}
