//! An image as heights, which is looked up for its slopes.

use crate::shapes::image_levels::{Border, ImageLevels};
use crate::{Error, RadianceImage};

/// Heights that an image tells, repeated to all sides: 0 where it is black, 1 where it is white.
///
/// ```
/// use splat_core::{HeightImage, RadianceImage};
/// // Two ridges across: 0, 1/2, 1, 1/2 and again.
/// let pixels = [0.0, 0.5, 1.0, 0.5, 0.0, 0.5, 1.0, 0.5].map(|v| [v; 3]).to_vec();
/// let ridges = HeightImage::new(&RadianceImage { size: [8, 1], pixels }).unwrap();
/// // Half a height on an eighth of the width.
/// assert_eq!(ridges.slope([1.5 / 8.0, 0.3], 0.0), [4.0, 0.0]);
/// assert_eq!(ridges.slope([-0.5 / 8.0, 7.3], 0.0), [-4.0, 0.0]);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct HeightImage {
    /// Slopes to the right and down, a width of the image; the third number is not used.
    slopes: ImageLevels,
}

impl HeightImage {
    /// Of an image, whose channels are averaged.
    ///
    /// # Errors
    /// [`Error::Invalid`] as from [`RadianceImage::validate`], and for heights whose slopes no f32 holds.
    pub fn new(image: &RadianceImage) -> Result<Self, Error> {
        image.validate()?;
        let [width, height] = image.size.map(|n| n as usize);
        let at = |x: usize, y: usize| image.pixels[y * width + x].iter().map(|v| v / 3.0).sum::<f32>();
        // Texels are squares, so the width of two of them is that of both differences.
        let across_two = 0.5 * width as f32;
        let slope = |x: usize, y: usize| {
            let right = at((x + 1) % width, y) - at((x + width - 1) % width, y);
            let down = at(x, (y + 1) % height) - at(x, (y + height - 1) % height);
            [right * across_two, down * across_two, 0.0]
        };
        let places = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let pixels: Vec<[f32; 3]> = places.map(|(x, y)| slope(x, y)).collect();
        if let Some(i) = pixels.iter().position(|p| !p.iter().all(|v| v.is_finite())) {
            return Err(Error::invalid("pixel", i, "height", image.pixels[i], "finite slopes beside it"));
        }
        let slopes = RadianceImage { size: image.size, pixels };
        Ok(Self { slopes: ImageLevels::new(slopes, Border::Repeats) })
    }

    /// How heights rise to the right and downwards, a width of the image, at a place from its top left, which also is in widths of it. They
    /// are a mean of what `width`, in that unit too, covers.
    pub fn slope(&self, offset: [f64; 2], width: f64) -> [f64; 2] {
        let [right, down] = offset;
        let [columns, rows] = self.slopes.image().size.map(f64::from);
        let [x, y, _] = self.slopes.at([right, down * columns / rows], width * columns);
        [x, y]
    }

    /// Bytes that it takes.
    pub fn bytes(&self) -> u64 {
        self.slopes.bytes()
    }

    /// Bytes that one of an image of this size takes.
    pub fn bytes_of(size: [u32; 2]) -> u64 {
        ImageLevels::bytes_of(size)
    }
}
