//! Light from all directions behind everything: an image by latitude and longitude, looked up with the solid angle of what sees it.
//!
//! A look-up is the mean of texels with weights ω·(1 − d²/R²)², ω a texel's solid angle and d its distance on the unit sphere from the
//! direction that is asked for. The kernel is round on the sphere, wherever it lies, so the edge where the image ends is no edge and
//! poles are places like others. R follows from variances, which add up: (1 − d²/R²)² has R²/8 along each axis, a tent over twice the
//! side of a square of solid angle Ω has Ω/6, a texel of side h has h²/12. What is wanted is the tent, for then neighbouring footprints
//! share what lies between them, widened by a kernel of radius √1.5·h that makes texels of the image continuous; what texels of a
//! coarser image have of it already is taken off:
//!
//! R² = 8·(Ω/6 + h₀²/12 + 1.5·h₀²/8 − h²/12).
//!
//! Coarser images are means over solid angle of the finer ones. Two of them are blended, so that a look-up is continuous in the
//! footprint too: those whose texels are R/6 to R/3 wide, and the next.

mod level;

use crate::Error;
use glam::DVec3;
use level::{Level, Place};

/// Texels of a level in R, at least, where a coarser one could serve.
const TEXELS: f64 = 3.0;

/// An image of radiance, linear Rec.709.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RadianceImage {
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Row by row from the top left; finite numbers ≥ 0.
    pub pixels: Vec<[f32; 3]>,
}

impl RadianceImage {
    /// Checks the size and every number.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a size that is not that of the pixels, or for the first number that is negative or not finite.
    pub fn validate(&self) -> Result<(), Error> {
        let [width, height] = self.size.map(|s| s as usize);
        if self.pixels.is_empty() || width.checked_mul(height) != Some(self.pixels.len()) {
            return Err(Error::invalid(
                "image",
                0,
                "size",
                self.size,
                "as many pixels as width times height, at least 1",
            ));
        }
        let is_bad = |p: &[f32; 3]| !p.iter().all(|v| v.is_finite() && *v >= 0.0);
        match self.pixels.iter().position(is_bad) {
            Some(i) => Err(Error::invalid("pixel", i, "radiance", self.pixels[i], "three finite numbers ≥ 0")),
            None => Ok(()),
        }
    }

    /// Bytes of the pixels.
    pub fn bytes(&self) -> u64 {
        size_of_val(self.pixels.as_slice()) as u64
    }
}

/// Radiance from every direction.
///
/// Of its image the first row is around +Y, and a row turns from −Z over +X to +Z and −X: the middle of the image lies towards +Z.
///
/// ```
/// use splat_core::{Environment, RadianceImage, glam::DVec3};
/// let sky = RadianceImage { size: [16, 8], pixels: [[[0.5, 0.6, 0.9]; 64], [[0.2, 0.1, 0.1]; 64]].concat() };
/// let sky = Environment::new(&sky, 0.0, 2.0).unwrap();
/// assert_eq!(sky.radiance(DVec3::Y, 0.0), [1.0, 1.2, 1.8]);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Environment {
    /// From fine to coarse, at least one.
    levels: Vec<Level>,
    /// What is left of the rotation when the image was turned by whole texels, turns.
    offset: f64,
    scale: f64,
}

impl Environment {
    /// An environment of an image that is turned about +Y by `turns` (0.25 takes what is seen towards −Z to −X, as a right-handed
    /// rotation does) and whose radiance is multiplied by `scale`. A turn by whole texels gives the same bits as an image whose
    /// columns are moved.
    ///
    /// # Errors
    /// [`Error::Invalid`] as from [`RadianceImage::validate`], for numbers that are not finite, and for a `scale` that is negative or
    /// makes a pixel infinite.
    pub fn new(image: &RadianceImage, turns: f64, scale: f64) -> Result<Self, Error> {
        image.validate()?;
        if !turns.is_finite() {
            return Err(Error::invalid("environment", 0, "rotation", turns, "a finite number of turns"));
        }
        let brightest = image.pixels.iter().flatten().fold(0.0f32, |most, v| most.max(*v));
        let is_finite = scale >= 0.0 && ((f64::from(brightest) * scale) as f32).is_finite();
        if !(scale.is_finite() && is_finite) {
            return Err(Error::invalid(
                "environment",
                0,
                "scale",
                scale,
                "a number ≥ 0 that leaves every pixel finite",
            ));
        }
        let [width, height] = image.size.map(|s| s as usize);
        let texels = turns.rem_euclid(1.0) * width as f64;
        let nearest = texels.round();
        // A turn by whole texels that degrees have rounded is one.
        let is_whole = (texels - nearest).abs() <= 4.0 * f64::EPSILON * width as f64;
        let whole = if is_whole { nearest } else { texels.floor() };
        let offset = if is_whole { 0.0 } else { (texels - whole) / width as f64 };
        let mut pixels = image.pixels.clone();
        pixels.chunks_exact_mut(width).for_each(|row| row.rotate_left(whole as usize % width));
        let mut levels = vec![Level::new([width, height], pixels)];
        while let Some(coarser) = levels.last().and_then(Level::coarser) {
            levels.push(coarser);
        }
        Ok(Self { levels, offset, scale })
    }

    /// Mean radiance over about `solid_angle` (sr, 0 to 4π) around `direction` (of any length but 0, towards the environment). A
    /// footprint that is smaller than a texel of the image sees the image interpolated.
    pub fn radiance(&self, direction: DVec3, solid_angle: f64) -> [f32; 3] {
        let place = Place::new(direction, self.offset);
        let finest = self.levels[0].texel_sq();
        let variance = solid_angle / 6.0 + finest / 12.0 + 1.5 * finest / 8.0;
        let reach = (8.0 * variance).sqrt() / TEXELS;
        let fine = self.levels.iter().rposition(|level| level.texel() <= reach).unwrap_or(0);
        let mean = |level: &Level| level.mean(&place, 8.0 * (variance - level.texel_sq() / 12.0));
        let mut radiance = mean(&self.levels[fine]);
        let texel = self.levels[fine].texel();
        if let Some(coarse) = self.levels.get(fine + 1).filter(|_| reach > texel) {
            let share = (reach - texel) / (coarse.texel() - texel);
            let other = mean(coarse);
            radiance = std::array::from_fn(|c| radiance[c] + share * (other[c] - radiance[c]));
        }
        radiance.map(|v| (v * self.scale) as f32)
    }

    /// Bytes that it takes.
    pub fn bytes(&self) -> u64 {
        self.levels.iter().map(Level::bytes).sum()
    }

    /// Bytes that an environment of an image of this size takes.
    pub fn bytes_of(size: [u32; 2]) -> u64 {
        let sizes = std::iter::successors(Some(size.map(|s| (s as usize).max(1))), |size| level::coarser_size(*size));
        sizes.map(level::bytes_of).sum()
    }
}
