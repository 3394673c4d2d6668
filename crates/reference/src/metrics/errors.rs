//! Differences between two images of one colour space.

use super::{ColorSpace, Display, Image, MetricError};

/// Errors over all pixels and channels, in the unit of the image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Errors {
    /// Root of the mean squared difference.
    pub rmse: f64,
    /// Mean of (image − reference): what a brighter or darker picture shows as.
    pub bias: f64,
    /// Mean of |image − reference|.
    pub mean_absolute: f64,
    /// Largest |image − reference|.
    pub max: f64,
}

/// Compares an image with a reference.
///
/// # Errors
/// [`MetricError::Size`].
pub fn compare<S: ColorSpace>(image: &Image<S>, reference: &Image<S>) -> Result<Errors, MetricError> {
    reference.same_size(image)?;
    let mut square = 0.0;
    let mut sum = 0.0;
    let mut absolute = 0.0;
    let mut max = 0.0f64;
    for (a, b) in image.pixels().iter().flatten().zip(reference.pixels().iter().flatten()) {
        let d = a - b;
        square += d * d;
        sum += d;
        absolute += d.abs();
        max = max.max(d.abs());
    }
    // An image without pixels differs from none.
    let n = (3 * image.pixels().len()).max(1) as f64;
    Ok(Errors { rmse: (square / n).sqrt(), bias: sum / n, mean_absolute: absolute / n, max })
}

/// Peak signal-to-noise ratio of the displayed picture, dB, with a peak of 1; +∞ for equal pictures.
///
/// # Errors
/// [`MetricError::Size`].
pub fn psnr(image: &Image<Display>, reference: &Image<Display>) -> Result<f64, MetricError> {
    compare(image, reference).map(|e| -20.0 * e.rmse.log10())
}

/// ε of Zhang and Pajarola 2007, section 6.3: Σ (|R − R_d| + |G − G_d| + |B − B_d|) / number of pixels, in 8-bit units.
///
/// # Errors
/// [`MetricError::Size`].
pub fn epsilon_8_bit(image: &Image<Display>, reference: &Image<Display>) -> Result<f64, MetricError> {
    reference.same_size(image)?;
    let a = image.bytes();
    let b = reference.bytes();
    let sum: u64 = a.iter().zip(&b).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
    Ok(sum as f64 / image.pixels().len().max(1) as f64)
}

#[cfg(test)]
mod tests {
    use super::super::Linear;
    use super::*;

    fn flat(value: f64) -> Image<Linear> {
        Image::from_radiance([4, 3], vec![[value; 3]; 12]).unwrap()
    }

    fn shown(value: f64) -> Image<Display> {
        Image::from_encoded([4, 3], vec![[value; 3]; 12]).unwrap()
    }

    #[test]
    fn a_constant_difference_is_every_metric() {
        let e = compare(&flat(0.25), &flat(0.5)).unwrap();
        assert_eq!(e, Errors { rmse: 0.25, bias: -0.25, mean_absolute: 0.25, max: 0.25 });
        assert!((psnr(&shown(0.4), &shown(0.5)).unwrap() - 20.0).abs() < 1e-9);
        // 51 of 255 in each of three channels.
        assert_eq!(epsilon_8_bit(&shown(0.2), &shown(0.4)).unwrap(), 153.0);
    }

    #[test]
    fn one_wrong_channel_of_one_pixel() {
        let mut pixels = vec![[0.0; 3]; 12];
        pixels[7][1] = 0.6;
        let image = Image::from_radiance([4, 3], pixels.clone()).unwrap();
        let e = compare(&image, &flat(0.0)).unwrap();
        assert!((e.rmse - 0.1).abs() < 1e-12 && (e.bias - 0.6 / 36.0).abs() < 1e-12);
        assert!((e.mean_absolute - 0.6 / 36.0).abs() < 1e-12 && e.max == 0.6);
        let image = Image::from_encoded([4, 3], pixels).unwrap();
        assert!((epsilon_8_bit(&image, &shown(0.0)).unwrap() - 153.0 / 12.0).abs() < 1e-12);
    }

    #[test]
    fn opposite_differences_hide_in_the_bias_alone() {
        let pixels = (0..12).map(|i| if i % 2 == 0 { [1.0; 3] } else { [0.0; 3] }).collect();
        let e = compare(&Image::from_radiance([4, 3], pixels).unwrap(), &flat(0.5)).unwrap();
        assert_eq!(e, Errors { rmse: 0.5, bias: 0.0, mean_absolute: 0.5, max: 0.5 });
    }

    /// Sums in f32 would end at 2²⁴ equal parts, and lose small parts beside a large one.
    #[test]
    fn ou5_means_of_many_pixels_are_exact_and_one_huge_pixel_is_told() {
        let n = 1_000_000;
        let mut pixels: Vec<[f64; 3]> = (0..n).map(|i| [0.1 + (i % 1000) as f64 * 1e-3; 3]).collect();
        let size = [1000, 1000];
        let black = Image::from_radiance(size, vec![[0.0; 3]; n]).unwrap();
        let e = compare(&Image::from_radiance(size, pixels.clone()).unwrap(), &black).unwrap();
        // The mean and the mean square of 0.1, 0.101, … 1.099.
        let mean = 0.5995;
        let variance = 1e-6 * (1e6 - 1.0) / 12.0;
        assert!((e.bias - mean).abs() < 1e-12 && (e.mean_absolute - mean).abs() < 1e-12, "{e:?}");
        assert!((e.rmse - f64::sqrt(mean * mean + variance)).abs() < 1e-12 && e.max == 1.099, "{e:?}");
        pixels[7] = [1e30; 3];
        let e = compare(&Image::from_radiance(size, pixels).unwrap(), &black).unwrap();
        assert!(e.max == 1e30 && (e.bias / 1e24 - 1.0).abs() < 1e-12 && (e.rmse / 1e27 - 1.0).abs() < 1e-12, "{e:?}");
    }

    #[test]
    fn equal_pictures_and_unequal_sizes() {
        assert_eq!(psnr(&shown(0.5), &shown(0.5)).unwrap(), f64::INFINITY);
        assert_eq!(epsilon_8_bit(&shown(0.5), &shown(0.5)).unwrap(), 0.0);
        let other = Image::from_radiance([3, 4], vec![[0.0; 3]; 12]).unwrap();
        assert_eq!(compare(&flat(0.0), &other), Err(MetricError::Size { expected: [3, 4], found: [4, 3] }));
    }
}
