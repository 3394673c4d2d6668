//! Pictures inside the page: PNG files as data URIs, and differences made visible.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use organza::Error;
use reference::metrics::{Display, Image};

/// A displayed picture as `data:image/png;base64,…`.
pub(crate) fn data_uri(picture: &Image<Display>) -> Result<String, Error> {
    let bytes = png(&picture.bytes(), picture.size())?;
    Ok(format!("data:image/png;base64,{}", STANDARD.encode(bytes)))
}

/// Eight-bit RGB as a PNG file.
pub(crate) fn png(bytes: &[u8], size: [usize; 2]) -> Result<Vec<u8>, Error> {
    let mut file = Vec::new();
    let [width, height] = size.map(|s| s as u32);
    PngEncoder::new(&mut file)
        .write_image(bytes, width, height, ExtendedColorType::Rgb8)
        .map_err(|e| Error::Internal(format!("PNG encoder: {e}")))?;
    Ok(file)
}

/// |a − b| of the displayed pictures, largest of the three channels, on a ramp from black to white; with the gain, a power
/// of two that brings the largest difference below 1.
pub(crate) fn difference(a: &Image<Display>, b: &Image<Display>) -> Result<(Image<Display>, f64), Error> {
    let distance = |(p, q): (&[f64; 3], &[f64; 3])| (0..3).map(|c| (p[c] - q[c]).abs()).fold(0.0, f64::max);
    let values: Vec<f64> = a.pixels().iter().zip(b.pixels()).map(distance).collect();
    let largest = values.iter().copied().fold(0.0, f64::max);
    let gain = if largest > 0.0 { (-largest.log2()).floor().clamp(0.0, 20.0).exp2() } else { 1.0 };
    let pixels = values.into_iter().map(|v| ramp(v * gain)).collect();
    let picture = Image::from_encoded(a.size(), pixels).map_err(|e| Error::Internal(e.to_string()))?;
    Ok((picture, gain))
}

/// Black, violet, red, yellow, white, of rising lightness.
fn ramp(value: f64) -> [f64; 3] {
    const STOPS: [[f64; 3]; 5] =
        [[0.0, 0.0, 0.02], [0.32, 0.07, 0.48], [0.82, 0.25, 0.27], [0.99, 0.72, 0.25], [1.0, 1.0, 0.93]];
    // The square root shows small differences too.
    let at = value.clamp(0.0, 1.0).sqrt() * (STOPS.len() - 1) as f64;
    let k = (at as usize).min(STOPS.len() - 2);
    let t = at - k as f64;
    std::array::from_fn(|c| STOPS[k][c] + t * (STOPS[k + 1][c] - STOPS[k][c]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_shown_where_they_are() {
        let flat = |v: f64| Image::from_encoded([2, 1], vec![[0.5; 3], [0.5, 0.5, v]]).unwrap();
        let (picture, gain) = difference(&flat(0.5 + 0.2), &flat(0.5)).unwrap();
        assert_eq!(gain, 4.0);
        assert_eq!(picture.pixels()[0], ramp(0.0));
        assert!(picture.pixels()[1][0] > 0.9);
        assert_eq!(difference(&flat(0.5), &flat(0.5)).unwrap().1, 1.0);
        assert!(data_uri(&picture).unwrap().starts_with("data:image/png;base64,iVBOR"));
    }
}
