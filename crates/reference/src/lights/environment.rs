//! Light from everywhere: a constant, or an image over all directions that is sampled in proportion to its brightness.
//!
//! The image is constant over each pixel, so its integral and the sampling density are exact: the probability of a pixel
//! is its luminance times its solid angle over the total, and directions are uniform in (azimuth, cosine) within it.

use glam::DVec3;
use splat_core::Error;
use std::f64::consts::PI;

/// Radiance that arrives from beyond the scene.
#[derive(Debug, Clone, PartialEq)]
pub enum Environment {
    /// The same from everywhere, per channel.
    Constant([f64; 3]),
    /// An image over all directions.
    Image(LatLong),
}

impl Default for Environment {
    fn default() -> Self {
        Self::Constant([0.0; 3])
    }
}

/// An image by latitude and longitude: the first row is around +Y, a row turns from −Z over +X to +Z and −X; constant
/// over each pixel. It may be turned about +Y, see [`LatLong::turned`].
#[derive(Debug, Clone, PartialEq)]
pub struct LatLong {
    /// Rotation about +Y, turns.
    turns: f64,
    size: [usize; 2],
    pixels: Vec<[f64; 3]>,
    /// Cumulative probability of rows, and of pixels within each row; each ends with 1.
    rows: Vec<f64>,
    columns: Vec<f64>,
    /// Σ luminance · solid angle.
    total: f64,
}

fn luminance(c: &[f64; 3]) -> f64 {
    0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]
}

impl LatLong {
    /// An image of `size` (width, height), row by row from +Y down.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a size that is not the number of pixels, or a pixel that is negative or not finite.
    pub fn new(size: [usize; 2], pixels: Vec<[f64; 3]>) -> Result<Self, Error> {
        if size[0].checked_mul(size[1]) != Some(pixels.len()) || pixels.is_empty() {
            return Err(Error::invalid("environment", 0, "size", size, "as many pixels as width times height"));
        }
        if let Some(i) = pixels.iter().position(|p| !p.iter().all(|v| v.is_finite() && *v >= 0.0)) {
            return Err(Error::invalid("environment", i, "pixel", pixels[i], "three finite numbers ≥ 0"));
        }
        let mut out = Self { turns: 0.0, size, pixels, rows: Vec::new(), columns: Vec::new(), total: 0.0 };
        for y in 0..size[1] {
            let mut sum = 0.0;
            for x in 0..size[0] {
                sum += luminance(&out.pixels[y * size[0] + x]);
                out.columns.push(sum);
            }
            out.columns[y * size[0]..].iter_mut().for_each(|c| *c = if sum > 0.0 { *c / sum } else { 1.0 });
            out.total += sum * out.solid_angle(y);
            out.rows.push(out.total);
        }
        if out.total > 0.0 {
            out.rows.iter_mut().for_each(|r| *r /= out.total);
        }
        Ok(out)
    }

    /// The same image turned about +Y by so many turns, right-handed: 0.25 takes what is seen towards −Z to −X.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a number that is not finite.
    pub fn turned(self, turns: f64) -> Result<Self, Error> {
        if !turns.is_finite() {
            return Err(Error::invalid("environment", 0, "rotation", turns, "a finite number of turns"));
        }
        Ok(Self { turns: (self.turns + turns).rem_euclid(1.0), ..self })
    }

    /// Cosine of the polar angle at the upper edge of a row.
    fn edge(&self, y: usize) -> f64 {
        (PI * y as f64 / self.size[1] as f64).cos()
    }

    /// Solid angle of a pixel in row `y`.
    fn solid_angle(&self, y: usize) -> f64 {
        2.0 * PI / self.size[0] as f64 * (self.edge(y) - self.edge(y + 1))
    }

    fn pixel_of(&self, d: DVec3) -> (usize, usize) {
        let polar = d.y.clamp(-1.0, 1.0).acos() / PI;
        let turn = (d.x.atan2(-d.z) / (2.0 * PI) + self.turns).rem_euclid(1.0);
        let at = |v: f64, n: usize| ((v * n as f64) as usize).min(n - 1);
        (at(turn, self.size[0]), at(polar, self.size[1]))
    }

    fn density_of(&self, x: usize, y: usize) -> f64 {
        if self.total > 0.0 { luminance(&self.pixels[y * self.size[0] + x]) / self.total } else { 0.0 }
    }

    fn sample(&self, u: [f64; 2]) -> (DVec3, [f64; 3], f64) {
        let find = |table: &[f64], u: f64| {
            let i = table.partition_point(|c| *c <= u).min(table.len() - 1);
            let low = if i == 0 { 0.0 } else { table[i - 1] };
            (i, ((u - low) / (table[i] - low).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0))
        };
        let (y, fy) = find(&self.rows, u[1]);
        let (x, fx) = find(&self.columns[y * self.size[0]..][..self.size[0]], u[0]);
        let cosine = self.edge(y) + fy * (self.edge(y + 1) - self.edge(y));
        let sine = ((1.0 - cosine) * (1.0 + cosine)).max(0.0).sqrt();
        let (s, c) = (2.0 * PI * ((x as f64 + fx) / self.size[0] as f64 - self.turns)).sin_cos();
        (DVec3::new(s * sine, cosine, -c * sine), self.pixels[y * self.size[0] + x], self.density_of(x, y))
    }
}

impl Environment {
    /// Radiance from unit direction `d` (towards the environment).
    pub fn radiance(&self, d: DVec3) -> [f64; 3] {
        match self {
            Self::Constant(c) => *c,
            Self::Image(image) => {
                let (x, y) = image.pixel_of(d);
                image.pixels[y * image.size[0] + x]
            }
        }
    }

    /// Whether it is worth aiming at: an image that is not dark.
    pub(crate) fn is_sampled(&self) -> bool {
        matches!(self, Self::Image(image) if image.total > 0.0)
    }

    /// Density with which [`Environment::sample`] gives a direction, 1/sr; 0 for a constant.
    pub(crate) fn density(&self, d: DVec3) -> f64 {
        match self {
            Self::Constant(_) => 0.0,
            Self::Image(image) => {
                let (x, y) = image.pixel_of(d);
                image.density_of(x, y)
            }
        }
    }

    /// A direction towards a bright part of an image, its radiance and density; `None` for a constant.
    pub(crate) fn sample(&self, u: [f64; 2]) -> Option<(DVec3, [f64; 3], f64)> {
        match self {
            Self::Image(image) if image.total > 0.0 => Some(image.sample(u)),
            _ => None,
        }
    }

    pub(crate) fn validate(&self) -> Result<(), Error> {
        match self {
            Self::Constant(c) if !c.iter().all(|v| v.is_finite() && *v >= 0.0) => {
                Err(Error::invalid("environment", 0, "radiance", c, "three finite numbers ≥ 0"))
            }
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path::random::Stream;

    fn sky() -> LatLong {
        let mut pixels = vec![[0.5, 0.25, 0.125]; 8 * 5];
        pixels[3] = [400.0, 380.0, 300.0];
        pixels[17] = [0.0; 3];
        LatLong::new([8, 5], pixels).expect("a sky")
    }

    #[test]
    fn samples_reproduce_the_integral_and_know_their_density() {
        let sky = Environment::Image(sky());
        let Environment::Image(image) = &sky else { return };
        let exact: f64 =
            (0..5).map(|y| (0..8).map(|x| image.pixels[y * 8 + x][0]).sum::<f64>() * image.solid_angle(y)).sum();
        let mut rng = Stream::new(3, 0, 0, 0);
        let n = 50_000;
        let mut mean = 0.0;
        let mut square = 0.0;
        for _ in 0..n {
            let (d, radiance, density) = sky.sample(rng.pair()).expect("a bright sky");
            assert_eq!(sky.radiance(d), radiance);
            assert!((sky.density(d) - density).abs() < 1e-15);
            let estimate = radiance[0] / density;
            mean += estimate / f64::from(n);
            square += estimate * estimate / f64::from(n);
        }
        let error = ((square - mean * mean) / f64::from(n)).sqrt();
        // Two-sided 1e-4: 3.9 standard errors.
        assert!((mean - exact).abs() < 3.9 * error, "{mean} ± {error}, exactly {exact}");
    }

    #[test]
    fn a_turned_image_is_seen_and_sampled_where_it_lies() {
        let mut pixels = vec![[0.0; 3]; 8 * 5];
        (pixels[2 * 8], pixels[2 * 8 + 7]) = ([1.0; 3], [1.0; 3]);
        let image = LatLong::new([8, 5], pixels).expect("a sky");
        let sky = Environment::Image(image.turned(0.25).expect("finite"));
        assert_eq!(sky.radiance(DVec3::NEG_X), [1.0; 3]);
        assert_eq!(sky.radiance(DVec3::NEG_Z), [0.0; 3]);
        let mut rng = Stream::new(3, 0, 0, 0);
        for _ in 0..100 {
            let (d, radiance, density) = sky.sample(rng.pair()).expect("a bright sky");
            assert!(d.x < -0.7 && sky.radiance(d) == radiance && sky.density(d) == density);
        }
        assert!(self::sky().turned(f64::NAN).is_err());
    }

    #[test]
    fn solid_angles_cover_the_sphere() {
        let image = sky();
        let sum: f64 = (0..5).map(|y| 8.0 * image.solid_angle(y)).sum();
        assert!((sum - 4.0 * PI).abs() < 1e-12);
    }
}
