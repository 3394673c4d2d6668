//! SOG of PlayCanvas, versions 1 and 2: images whose pixels are the numbers of Gaussians, row by row, and `meta.json`, which describes them.
//! All of it lies in a ZIP archive, or in a folder.
//!
//! A place has 16 bits an axis, in two images, between bounds of sign(p)·ln(1 + |p|). Logarithms of deviations and constant harmonics are
//! entries of a table of 256 numbers. The three smaller numbers of a rotation are bytes around ½ over √2, and its alpha is 252 more than the
//! place of the largest, w first. Other harmonics are rows of a palette, whose bytes are entries of a table again.

mod description;
mod images;

use super::gaussians::{self, Gathered, Gaussian, Refused, exponentials, refused};
use crate::error::{Place, ReadError};
use crate::reading::Reading;
use description::{Description, PaletteFacts, Tables};
use images::{Image, Source};
use splat_core::RawPoints;
use splat_core::glam::DVec3;
use std::f64::consts::SQRT_2;
use std::path::Path;

/// Gaussians of a row of the palette.
const PER_ROW: usize = 64;
/// The alpha of a rotation whose largest number is w.
const FIRST_LARGEST: u8 = 252;
/// The largest logarithm of a place, as for deviations.
const MOST_LOGARITHM: f64 = 80.0;

/// Reads an archive, or the description of images beside it.
pub(crate) fn read(content: &[u8], place: Option<&Path>, reading: &mut Reading<'_>) -> Result<RawPoints, ReadError> {
    let mut source = Source::new(content, place, reading)?;
    let description = Description::parse(&source.description(reading)?)?;
    for remark in description.remarks() {
        reading.notes.remark(remark);
    }
    let count = description.count;
    let mut image = |name: &str| source.image(name, count, reading);
    let means = [image(&description.means[0])?, image(&description.means[1])?];
    let scales = image(&description.scales)?;
    let quaternions = image(&description.quaternions)?;
    let colors = image(&description.colors)?;
    let palette = match &description.palette {
        None => None,
        Some(facts) => {
            let rows = source.image(&facts.files[0], PER_ROW, reading)?;
            let labels = source.image(&facts.files[1], count, reading)?;
            Some(Palette::new(facts, rows, labels)?)
        }
    };
    Splats { description: &description, means, scales, quaternions, colors, palette }.gather(reading)
}

/// The decoded images, with the description of their numbers.
struct Splats<'a> {
    description: &'a Description,
    means: [Image; 2],
    scales: Image,
    quaternions: Image,
    colors: Image,
    palette: Option<Palette<'a>>,
}

impl Splats<'_> {
    fn gather(&self, reading: &mut Reading<'_>) -> Result<RawPoints, ReadError> {
        let Description { count, .. } = *self.description;
        let degree = self.palette.as_ref().map_or(0, |palette| palette.degree);
        let mut gathered = Gathered::new(count, degree, reading.params)?;
        let others = (usize::from(degree) + 1).pow(2) - 1;
        for i in 0..count {
            if i.is_multiple_of(1 << 14) {
                reading.go_on()?;
            }
            let row = self.palette.as_ref().map_or(Ok(0), |palette| palette.row(i));
            let taken = match (self.gaussian(i), row) {
                (Ok(gaussian), Ok(row)) => {
                    let constant = self.constant(i);
                    let harmonic = |k: usize| match (k, &self.palette) {
                        (0, _) | (_, None) => constant,
                        (k, Some(palette)) => palette.harmonic(row, k - 1),
                    };
                    gathered.push(&gaussian, (0..others + 1).map(harmonic))
                }
                (Err(reason), _) | (_, Err(reason)) => gathered.refuse(reason),
            };
            taken.map_err(|reason| refused(Place::File, i as u64, reason))?;
        }
        gathered.finish(Place::File)
    }

    fn gaussian(&self, i: usize) -> Result<Gaussian, Refused> {
        let rotation = self.rotation(i)?;
        let Description { mins, maxs, scale_tables, .. } = self.description;
        let low = self.means[0].pixel(i);
        let high = self.means[1].pixel(i);
        let share = |k: usize| f64::from(u16::from_le_bytes([low[k], high[k]])) / f64::from(u16::MAX);
        let position = [0, 1, 2].map(|k| unfolded(mins[k] + (maxs[k] - mins[k]) * share(k)));
        let scale = self.scales.pixel(i);
        let mut deviation = exponentials(DVec3::from_array([0, 1, 2].map(|k| scale_tables.number(k, scale[k]))));
        if self.description.is_flat {
            deviation.z = 0.0;
        }
        let opacity = self.description.color_tables.opacity(self.colors.pixel(i)[3]);
        Ok(Gaussian { position: DVec3::from_array(position), deviation, rotation, opacity })
    }

    fn constant(&self, i: usize) -> [f64; 3] {
        let color = self.colors.pixel(i);
        [0, 1, 2].map(|k| self.description.color_tables.number(k, color[k]))
    }

    /// A quaternion, w first.
    fn rotation(&self, i: usize) -> Result<[f64; 4], Refused> {
        let [a, b, c, kind] = self.quaternions.pixel(i);
        let Some(largest) = kind.checked_sub(FIRST_LARGEST).map(usize::from) else {
            return Err(Refused::new("an alpha of a rotation from 252 to 255", kind.to_string()));
        };
        let mut smaller = [a, b, c].map(|v| (2.0 * f64::from(v) / 255.0 - 1.0) / SQRT_2).into_iter();
        let mut rotation = [0, 1, 2, 3].map(|k| if k == largest { 0.0 } else { smaller.next().unwrap_or_default() });
        let squares: f64 = rotation.iter().map(|v| v * v).sum();
        rotation[largest] = (1.0 - squares).max(0.0).sqrt();
        Ok(rotation)
    }
}

/// A place from the number that stands for it.
fn unfolded(folded: f64) -> f64 {
    if folded.abs() <= MOST_LOGARITHM { libm::copysign(libm::expm1(folded.abs()), folded) } else { f64::NAN }
}

/// Harmonics beside the constant, that many Gaussians share.
struct Palette<'a> {
    rows: Image,
    labels: Image,
    tables: &'a Tables,
    count: usize,
    coefficients: usize,
    degree: u8,
}

impl<'a> Palette<'a> {
    fn new(palette: &'a PaletteFacts, rows: Image, labels: Image) -> Result<Self, ReadError> {
        let width = rows.size[0] as usize;
        let coefficients = width / PER_ROW;
        let degree = gaussians::degree_of(coefficients).filter(|_| width.is_multiple_of(PER_ROW) && coefficients > 0);
        let fits = palette.bands.is_none_or(|bands| degree.is_some_and(|degree| u64::from(degree) == bands));
        let Some(degree) = degree.filter(|_| fits) else {
            let widths = match palette.bands {
                Some(bands @ 1..=3) => format!("{} pixels", PER_ROW * ((bands as usize + 1).pow(2) - 1)),
                _ => "192, 512 or 960 pixels".to_owned(),
            };
            let name = images::shown(&palette.files[0]);
            return Err(description::wrong(format!("a width of {widths} of {name}"), format!("{width} pixels")));
        };
        let room = PER_ROW * rows.size[1] as usize;
        let count = palette.count.unwrap_or(room);
        if count > room {
            let name = images::shown(&palette.files[0]);
            return Err(description::wrong(format!("a palette of {count} rows in {name}"), format!("{room} rows")));
        }
        Ok(Self { rows, labels, tables: &palette.tables, count, coefficients, degree })
    }

    /// The row of Gaussian `i`.
    fn row(&self, i: usize) -> Result<usize, Refused> {
        let [low, high, ..] = self.labels.pixel(i);
        let row = usize::from(u16::from_le_bytes([low, high]));
        let found = || format!("row {row} of {}", self.count);
        if row < self.count { Ok(row) } else { Err(Refused::new("a row of the palette of harmonics", found())) }
    }

    /// Coefficients `k` of a row.
    fn harmonic(&self, row: usize, k: usize) -> [f64; 3] {
        let x = row % PER_ROW * self.coefficients + k;
        let pixel = self.rows.pixel(row / PER_ROW * self.rows.size[0] as usize + x);
        [0, 1, 2].map(|c| self.tables.number(c, pixel[c]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_come_back_from_their_logarithms() {
        for place in [0.0, 0.25, -3.0, 1e6, -1e9] {
            let folded = libm::copysign(libm::log1p(libm::fabs(place)), place);
            assert!((unfolded(folded) - place).abs() <= 1e-12 * libm::fabs(place), "{place}");
        }
        assert!(unfolded(81.0).is_nan() && unfolded(f64::NAN).is_nan());
    }
}
