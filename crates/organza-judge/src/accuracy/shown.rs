//! Two displayed pictures side by side: how far they are apart, and where.

use super::report::pictures::{difference, png};
use organza::Error;
use reference::metrics::{Display, Image, Viewing, compare, flip};

/// The difference between two displayed pictures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Apart {
    /// Root mean square of the differences of displayed numbers, 0 to 1.
    pub rmse: f64,
    /// Mean LDR-FLIP, 0 to 1.
    pub flip: f64,
}

/// Compares two displayed pictures of one size, red, green and blue of 8 bits each, row by row from the top left.
///
/// # Errors
/// [`Error::Internal`] for bytes that are no picture of this size.
pub fn apart(size: [u32; 2], picture: &[u8], reference: &[u8]) -> Result<Apart, Error> {
    let picture = image(size, picture)?;
    let reference = image(size, reference)?;
    let internal = |e: reference::metrics::MetricError| Error::Internal(e.to_string());
    let rmse = compare(&picture, &reference).map_err(internal)?.rmse;
    // Without a difference the eye sees none; half of a second is saved.
    let flip = if rmse == 0.0 { 0.0 } else { flip(&picture, &reference, &Viewing::default()).map_err(internal)?.mean };
    Ok(Apart { rmse, flip })
}

/// The largest difference of the three channels of two displayed pictures as a picture, with the power of two that it is brightened by.
#[derive(Debug, Clone, PartialEq)]
pub struct DifferencePicture {
    /// A PNG file: black where both are the same, over violet, red and yellow to white.
    pub png: Vec<u8>,
    /// Differences are shown so many times larger.
    pub gain: f64,
}

/// Makes the picture of the difference of two pictures, as [`apart`] takes them.
///
/// # Errors
/// As [`apart`].
pub fn difference_picture(size: [u32; 2], picture: &[u8], reference: &[u8]) -> Result<DifferencePicture, Error> {
    let (shown, gain) = difference(&image(size, picture)?, &image(size, reference)?)?;
    Ok(DifferencePicture { png: png(&shown.bytes(), shown.size())?, gain })
}

fn image(size: [u32; 2], bytes: &[u8]) -> Result<Image<Display>, Error> {
    let share = |byte: &u8| f64::from(*byte) / 255.0;
    let pixels = bytes.chunks_exact(3).map(|pixel| [share(&pixel[0]), share(&pixel[1]), share(&pixel[2])]).collect();
    Image::from_encoded(size.map(|side| side as usize), pixels).map_err(|e| Error::Internal(e.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_are_apart_by_what_differs() {
        let grey = [128u8; 12];
        let mut other = grey;
        // One of four pixels differs by a fifth in all channels: half of a fifth.
        other[..3].fill(128 + 51);
        let found = apart([2, 2], &other, &grey).unwrap();
        assert!((found.rmse - 0.1).abs() < 1e-12 && found.flip > 0.0);
        assert_eq!(apart([2, 2], &grey, &grey).unwrap(), Apart { rmse: 0.0, flip: 0.0 });
        let difference = difference_picture([2, 2], &other, &grey).unwrap();
        assert!(difference.png.starts_with(b"\x89PNG") && difference.gain == 4.0);
        assert!(apart([3, 2], &grey, &grey).is_err() && difference_picture([2, 2], &grey[..9], &grey).is_err());
    }
}
