//! Three-dimensional Gaussians with a colour for each direction (Kerbl, Kopanas, Leimkühler, Drettakis 2023, *3D Gaussian Splatting
//! for Real-Time Radiance Field Rendering*), as a table beside a cloud.
//!
//! A splat that names one is a medium for whatever casts light or samples it: a ball. Where splats are composited it is seen as
//! the Gaussian itself, whose projection has the opacity α = min(0.99, o·e^(−½d²)) of its authors, d in standard deviations of the
//! image; below 1/255 nothing is seen. Opacities, not optical depths, have the shape of a Gaussian.

use crate::shapes::harmonics::{MOST_DEGREE, basis, rotation, terms};
use crate::{Cloud, Error, Similarity, srgb};
use glam::{DVec3, Vec3};
use std::cmp::Ordering;
use std::sync::Arc;

/// Gaussians as columns.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Gaussians {
    /// One standard deviation along each of three axes across each other, world units.
    pub axes: Vec<[Vec3; 3]>,
    /// Opacity o of a ray through the centre, in \[0, 1\].
    pub opacity: Vec<f32>,
    /// Degree of the harmonics of all, 0 to 3.
    pub degree: u8,
    /// Coefficients of the spherical harmonics of red, green and blue, (degree + 1)² a Gaussian, the lowest degree first. Their sum and ½ is
    /// the sRGB colour as it is displayed; what is below 0 is 0.
    pub harmonics: Vec<[f32; 3]>,
}

impl Gaussians {
    /// What a splat names that is none.
    pub const NONE: u32 = u32::MAX;
    /// The highest degree of harmonics.
    pub const MOST_DEGREE: u8 = MOST_DEGREE;
    /// The largest opacity of one of them on a ray.
    pub const MOST_OPACITY: f32 = 0.99;
    /// Opacity below which one of them is not seen.
    pub const LEAST_OPACITY: f32 = 1.0 / 255.0;
    /// Variance of the filter in the image over that of other splats: 0.3 to 0.25 square pixels.
    pub const FILTER_VARIANCE: f32 = 1.2;
    /// Farthest from the image's middle, over half its size, that perspective bends the axes of one, as its authors have it.
    pub const MOST_SLANT: f32 = 1.3;

    /// How many there are.
    pub fn len(&self) -> usize {
        self.axes.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.axes.is_empty()
    }

    /// Coefficients a Gaussian and colour.
    pub fn terms(&self) -> usize {
        terms(self.degree)
    }

    /// Bytes of one Gaussian of a degree.
    pub fn bytes_each(degree: u8) -> u64 {
        (size_of::<[Vec3; 3]>() + size_of::<f32>() + terms(degree) * size_of::<[f32; 3]>()) as u64
    }

    /// Bytes of all.
    pub fn bytes(&self) -> u64 {
        Self::bytes_each(self.degree) * self.len() as u64
    }

    /// The coefficient of degree 0 of a linear colour that is the same from everywhere.
    pub fn constant(color: [f32; 3]) -> [f32; 3] {
        let [unit, ..] = basis(DVec3::Z);
        color.map(|c| ((srgb::encoded(f64::from(c)) - 0.5) / unit) as f32)
    }

    /// Half the square of the distance, in standard deviations, from which on a Gaussian of an opacity is not seen; not above 0 for one that
    /// is never seen.
    pub fn level(opacity: f32) -> f32 {
        libm::logf(opacity / Self::LEAST_OPACITY)
    }

    /// Linear Rec.709 of Gaussian `i` seen along a direction, unit or zero, from the eye to it.
    ///
    /// # Panics
    /// If there is no such Gaussian.
    pub fn color(&self, i: usize, direction: Vec3) -> [f32; 3] {
        let n = self.terms();
        let basis = basis(direction.as_dvec3());
        let mut sum = [0.5; 3];
        for (coefficient, y) in self.harmonics[i * n..][..n].iter().zip(basis) {
            (0..3).for_each(|c| sum[c] += f64::from(coefficient[c]) * y);
        }
        sum.map(|c| srgb::decoded(c.max(0.0)) as f32)
    }

    /// The same of its mean over all directions.
    ///
    /// # Panics
    /// If there is no such Gaussian.
    pub fn mean_color(&self, i: usize) -> [f32; 3] {
        // Of the zero vector all but the lowest degree vanish.
        self.color(i, Vec3::ZERO)
    }

    /// The same Gaussians, moved with what they are part of: shapes and colours turn along.
    #[must_use]
    pub fn transformed(&self, by: &Similarity) -> Self {
        let turn = |axis: Vec3| by.rotate(axis.as_dvec3() * by.scale).as_vec3();
        let mut out = self.clone();
        out.axes.iter_mut().for_each(|axes| *axes = axes.map(turn));
        if by.rotation == glam::DQuat::IDENTITY || self.degree == 0 {
            return out;
        }
        let matrix = rotation(by.rotation);
        let n = self.terms();
        for (to, from) in out.harmonics.chunks_exact_mut(n).zip(self.harmonics.chunks_exact(n)) {
            for degree in 1..=self.degree {
                // Degrees do not mix.
                let band = terms(degree - 1)..terms(degree);
                for k in band.clone() {
                    let turned =
                        |c: usize| band.clone().map(|j| matrix[k][j] * f64::from(from[j][c])).sum::<f64>() as f32;
                    to[k] = [turned(0), turned(1), turned(2)];
                }
            }
        }
        out
    }

    /// Those of which it is said, in their order; none of none.
    #[must_use]
    pub fn chosen(&self, is_chosen: &[bool]) -> Self {
        let places: Vec<usize> = (0..self.len()).filter(|i| is_chosen[*i]).collect();
        let n = self.terms();
        Self {
            axes: places.iter().map(|i| self.axes[*i]).collect(),
            opacity: places.iter().map(|i| self.opacity[*i]).collect(),
            degree: self.degree,
            harmonics: places.iter().flat_map(|i| &self.harmonics[i * n..][..n]).copied().collect(),
        }
    }

    /// Linear colours that are the same from everywhere, one a Gaussian.
    pub fn recolor(&mut self, colors: &[[f32; 3]]) {
        self.degree = 0;
        self.harmonics = colors.iter().map(|color| Self::constant(*color)).collect();
    }

    /// Appends others; the lower degree is filled up with zeros.
    fn append(&mut self, other: &Self) {
        let degree = self.degree.max(other.degree);
        let mut raised = other.raised(degree);
        *self = std::mem::take(self).raised(degree);
        self.axes.extend_from_slice(&other.axes);
        self.opacity.extend_from_slice(&other.opacity);
        self.harmonics.append(&mut raised.harmonics);
    }

    fn raised(&self, degree: u8) -> Self {
        let from = self.terms();
        let to = terms(degree);
        let padded =
            |given: &[[f32; 3]]| (0..to).map(|k| given.get(k).copied().unwrap_or([0.0; 3])).collect::<Vec<_>>();
        Self { degree, harmonics: self.harmonics.chunks_exact(from).flat_map(padded).collect(), ..self.clone() }
    }

    /// Checks that columns have one length, that numbers are finite and opacities shares.
    ///
    /// # Errors
    /// [`Error::ColumnLength`], or [`Error::Invalid`] for the first Gaussian that breaks a promise.
    pub fn validate(&self) -> Result<(), Error> {
        if self.degree > MOST_DEGREE {
            return Err(Error::invalid("gaussians", 0, "degree", self.degree, "0 to 3"));
        }
        let expected = self.len();
        for (attribute, found) in [("opacity", self.opacity.len()), ("harmonics", self.harmonics.len() / self.terms())]
        {
            if found != expected {
                return Err(Error::ColumnLength { attribute, found, expected });
            }
        }
        for (i, axes) in self.axes.iter().enumerate() {
            if !axes.iter().all(|a| a.is_finite()) {
                return Err(Error::invalid("gaussian", i, "axes", axes, "finite numbers"));
            }
            if !(0.0..=1.0).contains(&self.opacity[i]) {
                return Err(Error::invalid("gaussian", i, "opacity", self.opacity[i], "a number in [0, 1]"));
            }
        }
        match self.harmonics.iter().position(|h| !h.iter().all(|v| v.is_finite())) {
            Some(i) => {
                Err(Error::invalid("gaussian", i / self.terms(), "harmonics", self.harmonics[i], "finite numbers"))
            }
            None => Ok(()),
        }
    }

    /// Order by the bits of all numbers.
    fn compare(&self, a: usize, b: usize) -> Ordering {
        let n = self.terms();
        let bits = |v: f32| v.to_bits();
        let numbers = |i: usize| {
            let axes = self.axes[i].into_iter().flat_map(|axis| axis.to_array());
            axes.chain([self.opacity[i]]).chain(self.harmonics[i * n..][..n].iter().flatten().copied()).map(bits)
        };
        numbers(a).cmp(numbers(b))
    }
}

impl Cloud {
    /// The Gaussian in [`Cloud::gaussians`] that splat `i` is.
    #[inline]
    pub fn gaussian_of(&self, i: usize) -> Option<usize> {
        self.gaussian.get(i).filter(|g| **g != Gaussians::NONE).map(|g| *g as usize)
    }

    /// Colour of splat `i` seen along a direction, from the eye to it.
    #[inline]
    pub fn color_along(&self, i: usize, direction: Vec3) -> [f32; 3] {
        self.gaussian_of(i).map_or_else(|| self.color[i], |g| self.gaussians.color(g, direction))
    }

    /// Takes the Gaussians of a cloud whose splats were appended from splat `first` on.
    pub(crate) fn append_gaussians(&mut self, first: usize, other: &Self) {
        if other.gaussians.is_empty() {
            return;
        }
        if self.gaussians.is_empty() {
            self.gaussians = Arc::clone(&other.gaussians);
            return;
        }
        let before = self.gaussians.len() as u32;
        Arc::make_mut(&mut self.gaussians).append(&other.gaussians);
        let new = self.gaussian[first..].iter_mut().filter(|g| **g != Gaussians::NONE);
        new.for_each(|g| *g += before);
    }

    pub(crate) fn scale_gaussians(&mut self, length: f32) {
        if !self.gaussians.is_empty() {
            let axes = Arc::make_mut(&mut self.gaussians).axes.iter_mut().flatten();
            axes.for_each(|axis| *axis *= length);
        }
    }

    /// Order of the Gaussians of two splats, whatever place they have in the table.
    pub(crate) fn compare_gaussians(&self, a: usize, b: usize) -> Ordering {
        match (self.gaussian_of(a), self.gaussian_of(b)) {
            (Some(a), Some(b)) => self.gaussians.compare(a, b),
            (a, b) => a.is_some().cmp(&b.is_some()),
        }
    }

    /// The first splat that names a Gaussian which there is not, or is one and no medium.
    pub(crate) fn check_gaussians(&self) -> Result<(), Error> {
        self.gaussians.validate()?;
        for i in 0..self.gaussian.len() {
            let Some(g) = self.gaussian_of(i) else { continue };
            if g >= self.gaussians.len() || self.kind[i] != crate::SplatKind::Medium {
                return Err(Error::invalid("splat", i, "gaussian", g, "an index of the table, for a medium"));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Splat;
    use glam::DQuat;

    fn some(degree: u8, n: usize) -> Gaussians {
        let number = |i: usize| ((i * 37 % 101) as f32 - 50.0) / 50.0;
        Gaussians {
            axes: (0..n).map(|i| [Vec3::X * number(i), Vec3::Y, Vec3::Z * 0.1]).collect(),
            opacity: (0..n).map(|i| number(i).abs()).collect(),
            degree,
            harmonics: (0..n * terms(degree)).map(|i| [number(i), number(i + 7), number(i + 19)]).collect(),
        }
    }

    fn cloud(degree: u8, n: usize) -> Cloud {
        let mut cloud = Cloud::new(DVec3::ZERO);
        (0..n).for_each(|i| cloud.push(&Splat { gaussian: i as u32, ..Splat::default() }));
        cloud.gaussians = Arc::new(some(degree, n));
        cloud
    }

    #[test]
    fn clouds_of_any_degree_join_and_keep_their_colors() {
        let first = cloud(1, 3);
        let second = cloud(3, 2);
        let mut plain = Cloud::new(DVec3::ZERO);
        plain.push(&Splat::default());
        let mut joined = Cloud::new(DVec3::ZERO);
        [&plain, &first, &second].into_iter().for_each(|part| joined.append(part));
        joined.validate().unwrap();
        let d = Vec3::new(0.36, 0.48, 0.8);
        assert_eq!(joined.color_along(0, d), [1.0; 3]);
        (0..3).for_each(|i| assert_eq!(joined.color_along(1 + i, d), first.color_along(i, d)));
        (0..2).for_each(|i| assert_eq!(joined.color_along(4 + i, d), second.color_along(i, d)));
        let picked = joined.gather(&[5, 0]);
        assert_eq!((picked.color_along(0, d), picked.gaussian_of(1)), (second.color_along(1, d), None));
        joined.gaussian[1] = 99;
        assert!(joined.validate().unwrap_err().to_string().contains("gaussian"));
    }

    #[test]
    fn a_linear_color_that_is_the_same_from_everywhere_comes_back() {
        let given = [0.02, 0.5, 1.0];
        let harmonics = vec![Gaussians::constant(given)];
        let red = Gaussians { axes: vec![[Vec3::X; 3]], opacity: vec![1.0], degree: 0, harmonics };
        red.color(0, Vec3::X).iter().zip(given).for_each(|(c, expected)| assert!((c - expected).abs() < 1e-6, "{c}"));
    }

    #[test]
    fn colors_turn_with_what_they_are_part_of() {
        let by = Similarity {
            scale: 2.0,
            rotation: DQuat::from_xyzw(0.1, 0.7, -0.3, 0.4).normalize(),
            ..Similarity::default()
        };
        let before = some(3, 1);
        let d = DVec3::new(2.0, -3.0, 6.0) / 7.0;
        let after = before.transformed(&by);
        assert!((after.axes[0][1].length() - 2.0).abs() < 1e-6);
        let colors = before.color(0, d.as_vec3()).into_iter().zip(after.color(0, by.rotate(d).as_vec3()));
        colors.for_each(|(a, b)| assert!((a - b).abs() < 1e-5, "{a} {b}"));
        assert_eq!(before.transformed(&Similarity::default()), before);
    }

    #[test]
    fn the_order_of_splats_does_not_depend_on_their_places_in_the_table() {
        let whole = cloud(2, 40);
        let ids: Vec<u32> = (0..40).rev().collect();
        let mut turned = whole.gather(&ids);
        // The table is turned around as well.
        let mut table = some(2, 40);
        table.axes.reverse();
        table.opacity.reverse();
        table.harmonics = table.harmonics.chunks_exact(9).rev().flatten().copied().collect();
        turned.gaussian.iter_mut().for_each(|g| *g = 39 - *g);
        turned.gaussians = Arc::new(table);
        let colors = |mut cloud: Cloud| {
            cloud.canonicalize();
            (0..40).map(|i| cloud.color_along(i, Vec3::Y)).collect::<Vec<_>>()
        };
        assert_eq!(colors(whole), colors(turned));
    }
}
