//! Images whose type says what their numbers are.

use std::marker::PhantomData;

/// What the numbers of an [`Image`] are.
pub trait ColorSpace: Copy + std::fmt::Debug {
    /// Name in reports.
    const NAME: &'static str;
}

/// Linear Rec.709 radiance, ≥ 0 and unbounded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Linear;

/// The displayed picture: sRGB-encoded (IEC 61966-2-1), in \[0, 1\].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Display;

impl ColorSpace for Linear {
    const NAME: &'static str = "linear radiance";
}

impl ColorSpace for Display {
    const NAME: &'static str = "displayed picture";
}

/// Why images cannot be compared.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MetricError {
    /// A size that does not fit.
    #[error("expected an image of {expected:?} pixels, found {found:?}")]
    Size {
        /// Width and height that were expected.
        expected: [usize; 2],
        /// Width and height found.
        found: [usize; 2],
    },
    /// As many pixels as the size says are needed.
    #[error("expected {expected} pixels, found {found}")]
    Count {
        /// Width times height.
        expected: usize,
        /// Pixels given.
        found: usize,
    },
    /// A mean over NaN says nothing.
    #[error("pixel {index} is not finite")]
    NotFinite {
        /// Row times width plus column.
        index: usize,
    },
}

/// Pixels row by row from the top left, all finite.
#[derive(Debug, Clone, PartialEq)]
pub struct Image<S> {
    size: [usize; 2],
    pixels: Vec<[f64; 3]>,
    space: PhantomData<S>,
}

impl<S: ColorSpace> Image<S> {
    /// Width and height.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// The pixels, row by row from the top left.
    pub fn pixels(&self) -> &[[f64; 3]] {
        &self.pixels
    }

    fn checked(size: [usize; 2], pixels: Vec<[f64; 3]>) -> Result<Self, MetricError> {
        let expected = size[0].saturating_mul(size[1]);
        if pixels.len() != expected {
            return Err(MetricError::Count { expected, found: pixels.len() });
        }
        match pixels.iter().position(|p| p.iter().any(|v| !v.is_finite())) {
            Some(index) => Err(MetricError::NotFinite { index }),
            None => Ok(Self { size, pixels, space: PhantomData }),
        }
    }

    pub(crate) fn same_size(&self, other: &Self) -> Result<(), MetricError> {
        let expected = self.size;
        let found = other.size;
        if expected == found { Ok(()) } else { Err(MetricError::Size { expected, found }) }
    }
}

impl Image<Linear> {
    /// From radiance.
    ///
    /// # Errors
    /// [`MetricError::Count`] and [`MetricError::NotFinite`].
    pub fn from_radiance(size: [usize; 2], pixels: Vec<[f64; 3]>) -> Result<Self, MetricError> {
        Self::checked(size, pixels)
    }

    /// From the radiance of a rendered layer.
    ///
    /// # Errors
    /// As [`Image::from_radiance`].
    pub fn from_layer(size: [u32; 2], pixels: &[[f32; 3]]) -> Result<Self, MetricError> {
        Self::checked(size.map(|s| s as usize), pixels.iter().map(|p| p.map(f64::from)).collect())
    }

    /// The displayed picture: radiance times 2^exposure, clamped to \[0, 1\], sRGB-encoded.
    pub fn display(&self, exposure: f64) -> Image<Display> {
        let gain = exposure.exp2();
        let pixels = self.pixels.iter().map(|p| p.map(|v| encode((v * gain).clamp(0.0, 1.0)))).collect();
        Image { size: self.size, pixels, space: PhantomData }
    }

    /// Means over blocks of `factor`² pixels; a remainder at the right and at the bottom is left out.
    pub fn box_downsampled(&self, factor: usize) -> Self {
        let factor = factor.max(1);
        let size = self.size.map(|s| s / factor);
        let share = 1.0 / (factor * factor) as f64;
        let mut pixels = vec![[0.0; 3]; size[0] * size[1]];
        for y in 0..size[1] * factor {
            for x in 0..size[0] * factor {
                let from = self.pixels[y * self.size[0] + x];
                let to = &mut pixels[y / factor * size[0] + x / factor];
                (0..3).for_each(|c| to[c] += share * from[c]);
            }
        }
        Self { size, pixels, space: PhantomData }
    }
}

impl Image<Display> {
    /// From sRGB-encoded numbers; values outside \[0, 1\] are clamped.
    ///
    /// # Errors
    /// As [`Image::from_radiance`].
    pub fn from_encoded(size: [usize; 2], pixels: Vec<[f64; 3]>) -> Result<Self, MetricError> {
        Self::checked(size, pixels.into_iter().map(|p| p.map(|v| v.clamp(0.0, 1.0))).collect())
    }

    /// The picture in 8 bits, as a PNG file has it.
    pub fn bytes(&self) -> Vec<u8> {
        self.pixels.iter().flatten().map(|v| (v * 255.0).round() as u8).collect()
    }
}

/// Linear → sRGB (IEC 61966-2-1), both in \[0, 1\].
fn encode(x: f64) -> f64 {
    if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn display_is_exposure_clamp_and_srgb() {
        let image = Image::from_radiance([3, 1], vec![[0.18, 0.09, 0.0], [1.0, 7.0, -1.0], [0.001; 3]]).unwrap();
        let shown = image.display(0.0);
        // 18 % grey is 117.6 in 8-bit sRGB.
        assert!((shown.pixels()[0][0] * 255.0 - 117.6).abs() < 0.1);
        assert_eq!(shown.pixels()[1].map(|v| (v * 1e12).round()), [1e12, 1e12, 0.0]);
        assert!((shown.pixels()[2][0] - 0.01292).abs() < 1e-12);
        // One stop more of half the radiance is the same.
        assert_eq!(image.display(1.0).pixels()[0][1], shown.pixels()[0][0]);
        assert_eq!(shown.bytes()[0], 118);
    }

    #[test]
    fn a_block_becomes_its_mean() {
        let pixels = (0..10).map(|i| [f64::from(i); 3]).collect();
        let small = Image::from_radiance([5, 2], pixels).unwrap().box_downsampled(2);
        assert_eq!((small.size(), small.pixels()), ([2, 1], &[[3.0; 3], [5.0; 3]][..]));
    }

    #[test]
    fn wrong_counts_and_nan_are_refused() {
        let count = Image::from_radiance([2, 2], vec![[0.0; 3]; 3]);
        assert_eq!(count, Err(MetricError::Count { expected: 4, found: 3 }));
        let nan = Image::from_radiance([2, 1], vec![[0.0; 3], [0.0, f64::NAN, 0.0]]);
        assert_eq!(nan, Err(MetricError::NotFinite { index: 1 }));
    }
}
