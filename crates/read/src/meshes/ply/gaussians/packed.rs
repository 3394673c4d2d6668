//! Gaussians as PlayCanvas packs them: `chunk`s of 256 state between what their places, logarithms of deviations and, in later files, colours
//! lie; a `vertex` has four words for a place (11, 10 and 11 bits), a rotation (the place of the largest number of w, x, y, z and the three
//! others in ten bits each), deviations (as places) and colour with opacity (8 bits each); `sh`, if there is one, the other coefficients
//! in a byte each, all of red, then of green, then of blue.

use super::super::body::{Source, check_count, skip_element};
use super::super::header::{Element, Header, at_line};
use super::table;
use crate::error::ReadError;
use crate::points::gaussians::{CONSTANT, Gathered, Gaussian, degree_of, exponentials, refused};
use crate::reading::Reading;
use splat_core::RawPoints;
use splat_core::glam::DVec3;
use std::f64::consts::SQRT_2;

/// Gaussians of a chunk.
const CHUNK: usize = 256;

const BOUNDS: [&str; 12] = [
    "min_x",
    "min_y",
    "min_z",
    "max_x",
    "max_y",
    "max_z",
    "min_scale_x",
    "min_scale_y",
    "min_scale_z",
    "max_scale_x",
    "max_scale_y",
    "max_scale_z",
];
const COLORS: [&str; 6] = ["min_r", "min_g", "min_b", "max_r", "max_g", "max_b"];
const WORDS: [&str; 4] = ["packed_position", "packed_rotation", "packed_scale", "packed_color"];

/// What the elements hold.
struct Elements {
    /// Eighteen numbers a chunk.
    chunks: Vec<f64>,
    /// Four words a Gaussian.
    words: Vec<u32>,
    /// As many a Gaussian as its degree has coefficients.
    rest: Vec<u8>,
    degree: u8,
}

/// Reads all elements.
pub(super) fn read<S: Source>(
    mut source: S,
    header: &Header,
    reading: &mut Reading<'_>,
) -> Result<RawPoints, ReadError> {
    let mut elements = Elements { chunks: Vec::new(), words: Vec::new(), rest: Vec::new(), degree: 0 };
    let mut place = at_line(header.body_line);
    let mut of_rest = None;
    for element in &header.elements {
        check_count(&source, element)?;
        match element.name.as_slice() {
            b"chunk" => elements.chunks = chunks(&mut source, element, reading)?,
            b"vertex" => {
                place = at_line(element.line);
                elements.words = table(&mut source, element, &WORDS, |v| v as u32, reading)?;
            }
            b"sh" => {
                let n = element.properties.len();
                let degree = degree_of(n / 3).filter(|degree| n.is_multiple_of(3) && *degree > 0);
                elements.degree = degree.ok_or_else(|| {
                    let hint = "coefficients of harmonics of degree 1, 2 or 3, for each colour";
                    ReadError::input(at_line(element.line), "9, 24 or 45 properties of 'sh'", n.to_string(), hint)
                })?;
                let names: Vec<String> = (0..n).map(|k| format!("f_rest_{k}")).collect();
                let names: Vec<&str> = names.iter().map(String::as_str).collect();
                elements.rest = table(&mut source, element, &names, |v| v as u8, reading)?;
                of_rest = Some(element);
            }
            _ => {
                reading.notes.not_used([element.name.as_slice()]);
                skip_element(&mut source, element, reading)?;
            }
        }
    }
    source.finish()?;
    let count = elements.words.len() / WORDS.len();
    let missing = |line, expected: String, found: usize| {
        Err(ReadError::input(line, expected, found.to_string(), "the file is truncated, or its header is damaged"))
    };
    if elements.chunks.len() / 18 < count.div_ceil(CHUNK) {
        return missing(place, format!("a chunk for each {CHUNK} of {count} Gaussians"), elements.chunks.len() / 18);
    }
    if let Some(element) = of_rest.filter(|element| element.count != count as u64) {
        return missing(at_line(element.line), format!("{count} records of 'sh'"), element.count as usize);
    }
    let mut gathered = Gathered::new(count, elements.degree, reading.params)?;
    for i in 0..count {
        let (gaussian, constant) = elements.unpacked(i);
        let n = elements.rest.len() / count;
        let rest = &elements.rest[i * n..][..n];
        let harmonic = |k: usize| match k {
            0 => constant,
            k => [0, 1, 2].map(|c| coefficient(rest[c * (n / 3) + k - 1])),
        };
        gathered.push(&gaussian, (0..n / 3 + 1).map(harmonic)).map_err(|wrong| refused(place, i as u64, wrong))?;
    }
    gathered.finish(place)
}

/// Bounds of chunks; colours of files without bounds of their own lie between 0 and 1.
fn chunks<S: Source>(source: &mut S, element: &Element, reading: &mut Reading<'_>) -> Result<Vec<f64>, ReadError> {
    let has_colors = element.properties.iter().any(|p| p.name == COLORS[0].as_bytes());
    if has_colors {
        return table(source, element, &[&BOUNDS[..], &COLORS].concat(), |v| v, reading);
    }
    let rows = table(source, element, &BOUNDS, |v| v, reading)?;
    Ok(rows.chunks_exact(12).flat_map(|row| row.iter().copied().chain([0.0, 0.0, 0.0, 1.0, 1.0, 1.0])).collect())
}

impl Elements {
    fn unpacked(&self, i: usize) -> (Gaussian, [f64; 3]) {
        let bounds = &self.chunks[i / CHUNK * 18..][..18];
        let between = |first: usize, shares: [f64; 3]| {
            [0, 1, 2].map(|k| bounds[first + k] + (bounds[first + 3 + k] - bounds[first + k]) * shares[k])
        };
        let [place, turn, size, color] = [0, 1, 2, 3].map(|k| self.words[4 * i + k]);
        let gaussian = Gaussian {
            position: DVec3::from_array(between(0, triple(place))),
            deviation: exponentials(DVec3::from_array(between(6, triple(size)))),
            rotation: rotation(turn),
            opacity: share(color, 8),
        };
        let shares = [24, 16, 8].map(|shift| share(color >> shift, 8));
        (gaussian, between(12, shares).map(|c| (c - 0.5) / CONSTANT))
    }
}

/// The lowest bits over the most that they can be.
fn share(word: u32, bits: u32) -> f64 {
    let most = (1u32 << bits) - 1;
    f64::from(word & most) / f64::from(most)
}

/// 11, 10 and 11 bits.
fn triple(word: u32) -> [f64; 3] {
    [share(word >> 21, 11), share(word >> 11, 10), share(word, 11)]
}

/// A quaternion, w first, without its largest number, which is positive.
fn rotation(word: u32) -> [f64; 4] {
    let others = [20, 10, 0].map(|shift| (share(word >> shift, 10) - 0.5) * SQRT_2);
    let mut quaternion = [0.0; 4];
    let largest = (word >> 30) as usize;
    quaternion[largest] = (1.0 - others.iter().map(|v| v * v).sum::<f64>()).max(0.0).sqrt();
    (0..4).filter(|k| *k != largest).zip(others).for_each(|(k, v)| quaternion[k] = v);
    quaternion
}

/// A coefficient from −4 to 4: the middle of the step that a byte stands for, and the ends for the first and the last.
fn coefficient(byte: u8) -> f64 {
    let share = match byte {
        0 => 0.0,
        255 => 1.0,
        byte => (f64::from(byte) + 0.5) / 256.0,
    };
    (share - 0.5) * 8.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_worked_out_by_hand() {
        assert_eq!(triple(0xffe0_0000), [1.0, 0.0, 0.0]);
        assert_eq!(triple(0x001f_f800), [0.0, 1.0, 0.0]);
        assert_eq!(triple(0x0000_07ff), [0.0, 0.0, 1.0]);
        // The second number (x) is the largest; of the others w is 1/√2 and the last two are the least.
        let [w, x, y, z] = rotation(1 << 30 | 1023 << 20);
        assert_eq!([w, y, z], [0.5 * SQRT_2, -0.5 * SQRT_2, -0.5 * SQRT_2]);
        assert_eq!(x, 0.0);
        let half = 0.5 / 1023.0 * SQRT_2;
        let [w, x, ..] = rotation(512 << 20 | 512 << 10 | 512);
        assert!((x - half).abs() < 1e-15 && (w - 1.0).abs() < 1e-6);
        assert_eq!([0, 128, 255].map(coefficient), [-4.0, 8.0 * 0.5 / 256.0, 4.0]);
    }
}
