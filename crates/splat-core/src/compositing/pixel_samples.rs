//! The samples that a pixel is averaged from.

/// An image of samples, `antialias` along each side of a pixel, as pixels.
///
/// ```
/// use splat_core::PixelSamples;
/// let samples = PixelSamples { size: [4, 2], antialias: 2 };
/// assert_eq!(samples.pixels(), [2, 1]);
/// // The second pixel is made of the last two samples of both rows.
/// assert_eq!(samples.map(|at| at.collect::<Vec<_>>()), [[0, 1, 4, 5], [2, 3, 6, 7]]);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PixelSamples {
    /// Width and height of the image of samples, multiples of `antialias`.
    pub size: [u32; 2],
    /// Samples along each side of a pixel, ≥ 1.
    pub antialias: u32,
}

impl PixelSamples {
    /// Width and height in pixels.
    pub fn pixels(&self) -> [u32; 2] {
        self.size.map(|side| side / self.antialias)
    }

    /// Samples of one pixel.
    pub fn per_pixel(&self) -> u32 {
        self.antialias * self.antialias
    }

    /// One value a pixel, row by row from the top left, of the places of its samples in the image of samples.
    pub fn map<T>(&self, value: impl Fn(&mut dyn Iterator<Item = usize>) -> T) -> Vec<T> {
        let antialias = self.antialias as usize;
        let [width, height] = self.pixels().map(|side| side as usize);
        let of_pixel = |k: usize| {
            let x = k % width * antialias;
            let y = k / width * antialias;
            value(&mut (0..antialias * antialias).map(|s| (y + s / antialias) * width * antialias + x + s % antialias))
        };
        (0..width * height).map(of_pixel).collect()
    }
}
