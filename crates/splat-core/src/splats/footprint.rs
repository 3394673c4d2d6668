//! Footprints: the kernel integrated along the ray, a radial profile on the plane across it.
//!
//! The profile is a Gaussian cut at `cutoff` standard deviations, less the first three terms of its Taylor series at
//! the rim, so that value, slope and curvature vanish there:
//!
//! w(s) = e^(−qs) − e^(−q)·(1 + x + x²/2), x = q(1 − s), q = cutoff²/2, s = ρ²/R² ∈ \[0, 1\]
//!
//! It is positive, integrates in closed form, and a lattice of spacing h ≈ R/2.4 sums to a constant within 1.5·10⁻⁴ at
//! the default cutoff: a plain cut Gaussian is off fifty times as far. Gunjee 2007 (section 4.3) samples Gaussians into
//! a stack of textures; a profile by formula has no table error and costs less than the look-up. What no formula says, such as a leaf,
//! is an image in the stack: see [`FootprintImage`].

mod image;

#[cfg(feature = "raster")]
pub(crate) use image::Level;
pub use image::{FootprintImage, MOST_TEXELS};

use crate::{Cloud, Error, SplatKind};
use std::f64::consts::PI;
use std::sync::Arc;

/// One radial profile.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Footprint {
    /// Where the Gaussian is cut, in standard deviations: R = cutoff·σ.
    pub cutoff: f32,
}

impl Default for Footprint {
    fn default() -> Self {
        Self { cutoff: 3.0 }
    }
}

impl Footprint {
    /// Radius over lattice spacing at which the footprints of a square lattice sum to a constant within 1.5·10⁻⁴ at
    /// the default cutoff; wider cutoffs keep σ = 0.8 spacings.
    pub const SIGMA_OVER_SPACING: f32 = 0.8;

    /// Share of an opaque disc's radius within which it hides what lies behind: 1.08 spacings at the default cutoff, so that
    /// neighbours leave no hole.
    pub const CORE: f32 = 0.45;

    /// Cutoff radius for splats that are `spacing` apart.
    pub fn radius_for_spacing(&self, spacing: f32) -> f32 {
        self.cutoff * Self::SIGMA_OVER_SPACING * spacing
    }

    /// Distance of lattice points whose splats have the cutoff radius `radius`, see [`Footprint::radius_for_spacing`].
    pub fn spacing_for_radius(&self, radius: f32) -> f32 {
        radius / (self.cutoff * Self::SIGMA_OVER_SPACING)
    }

    /// q = cutoff²/2.
    pub fn sharpness(&self) -> f32 {
        0.5 * self.cutoff * self.cutoff
    }

    /// Profile at s = ρ²/R², 1 − O(e^−q) at the centre, 0 from s = 1 on. Not normalised, see [`Footprint::norm`].
    pub fn profile(&self, s: f64) -> f64 {
        if s >= 1.0 {
            return 0.0;
        }
        let q = f64::from(self.sharpness());
        let x = q * (1.0 - s);
        libm::exp(-q * s) - libm::exp(-q) * (1.0 + x + 0.5 * x * x)
    }

    /// n₀ and n₁ of a second weight n₀ + n₁·s at the squared distance s = ρ²/R² from the centre, by which splats of a medium
    /// count for where it lies along a ray: see [`crate::DepthFragment::narrow`].
    #[cfg(feature = "raster")]
    pub fn narrowing(&self) -> [f32; 2] {
        let [whole, first, second] = self.moments();
        crate::compositing::depth_profile::narrowing(
            first / whole,
            second / whole,
            f64::from(self.spacing_for_radius(1.0)),
        )
    }

    /// ∫sⁿ·w ds over \[0, 1\] for n = 0, 1, 2, from w = e^−q·Σ_{k≥3} (qt)^k/k!, t = 1 − s, whose terms are all positive.
    #[cfg(feature = "raster")]
    pub(crate) fn moments(&self) -> [f64; 3] {
        let q = f64::from(self.sharpness());
        let mut sums = [0.0; 3];
        // e^−q·q^k/(k + 1)!
        let mut term = libm::exp(-q) / q;
        for k in 0..256 {
            let k = f64::from(k);
            term *= q / (k + 1.0);
            if k > 2.0 {
                let first = term / (k + 2.0);
                [term, first, 2.0 * first / (k + 3.0)].iter().zip(&mut sums).for_each(|(add, sum)| *sum += add);
            }
        }
        sums
    }

    /// Share of the kernel before a plane across the ray, x = distance/R behind its centre: 0 up to x = −1, 1 from x = 1 on.
    /// The kernel along the ray is the profile w(x²), whose integral is
    ///
    /// H(x) = ½·√(π/q)·erf(√q·x) − e^(−q)·(x(1 + q + q²/2) − (q + q²)·x³/3 + q²·x⁵/10)
    ///
    /// so the parts of a kernel between planes sum to 1, and those of a lattice along the ray to a constant as its footprints do.
    pub fn share_before(&self, x: f64) -> f64 {
        let q = f64::from(self.sharpness());
        let integral = |x: f64| {
            let root = libm::sqrt(q);
            let x2 = x * x;
            let gauss = 0.5 * libm::sqrt(PI) / root * libm::erf(root * x);
            let taper = x * ((1.0 + q + 0.5 * q * q) - x2 * ((q + q * q) / 3.0 - x2 * (0.1 * q * q)));
            gauss - libm::exp(-q) * taper
        };
        0.5 + 0.5 * integral(x.clamp(-1.0, 1.0)) / integral(1.0)
    }

    /// 1/∫w dA for R = 1: the factor that makes the footprint integrate to 1 over its plane is `norm()/R²`.
    pub fn norm(&self) -> f64 {
        let q = f64::from(self.sharpness());
        1.0 / (PI * ((-libm::expm1(-q)) / q - libm::exp(-q) * (1.0 + q / 2.0 + q * q / 6.0)))
    }
}

/// The footprints of a scene by [`crate::Splat::footprint`]; the paper's stack of footprint textures: formulas, and images in the place of some.
#[derive(Debug, Clone, PartialEq)]
pub struct FootprintStack {
    layers: Vec<Footprint>,
    /// As many.
    images: Vec<Option<Arc<FootprintImage>>>,
}

impl Default for FootprintStack {
    /// Layer 0 is the default of 3σ, layer 1 soft (2σ), layer 2 wide (5σ).
    fn default() -> Self {
        Self { layers: [3.0, 2.0, 5.0].map(|cutoff| Footprint { cutoff }).to_vec(), images: vec![None; 3] }
    }
}

impl FootprintStack {
    /// A stack of these layers.
    ///
    /// # Errors
    /// [`Error::Invalid`] without layers, with more than 256, or with a cutoff outside \[1, 8\].
    pub fn new(layers: Vec<Footprint>) -> Result<Self, Error> {
        if layers.is_empty() || layers.len() > 256 {
            return Err(Error::invalid("footprint stack", 0, "layers", layers.len(), "1 to 256 layers"));
        }
        if let Some(i) = layers.iter().position(|l| !(1.0..=8.0).contains(&l.cutoff)) {
            return Err(Error::invalid("footprint", i, "cutoff", layers[i].cutoff, "1 to 8 standard deviations"));
        }
        let images = vec![None; layers.len()];
        Ok(Self { layers, images })
    }

    /// The same with an image in the place of layer `id`, whose energy it has to have.
    ///
    /// # Panics
    /// If `id` is out of range.
    #[must_use]
    pub fn with_image(mut self, id: usize, image: Arc<FootprintImage>) -> Self {
        self.images[id] = Some(image);
        self
    }

    /// All layers; where one is an image, the formula that it stands for.
    pub fn layers(&self) -> &[Footprint] {
        &self.layers
    }

    /// The image of a layer that is one.
    pub fn image(&self, id: usize) -> Option<&Arc<FootprintImage>> {
        self.images.get(id).and_then(Option::as_ref)
    }

    /// The splats of a cloud that show images, discs of which these are the kinds.
    pub fn images_in<'a>(&'a self, cloud: &'a Cloud) -> impl Iterator<Item = (usize, SplatKind)> + 'a {
        let looked_at = if self.has_images() { cloud.len() } else { 0 };
        let splats = cloud.footprint.iter().zip(&cloud.kind).enumerate().take(looked_at);
        let shown =
            splats.filter(|(_, (id, kind))| **kind != SplatKind::Medium && self.image(usize::from(**id)).is_some());
        shown.map(|(i, (_, kind))| (i, *kind))
    }

    /// Whether some layer is an image.
    pub fn has_images(&self) -> bool {
        self.images.iter().any(Option::is_some)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn profile_integrates_to_its_closed_form() {
        for cutoff in [1.0, 2.0, 3.0, 5.0, 8.0] {
            let f = Footprint { cutoff };
            let n = 200_000;
            let sum: f64 = (0..n).map(|i| f.profile((f64::from(i) + 0.5) / f64::from(n))).sum();
            let integral = PI * sum / f64::from(n);
            assert!((integral * f.norm() - 1.0).abs() < 1e-6, "cutoff {cutoff}: {}", integral * f.norm());
        }
    }

    #[test]
    fn shares_before_planes_are_integrals_of_the_profile() {
        for cutoff in [1.0, 2.0, 3.0, 5.0, 8.0] {
            let f = Footprint { cutoff };
            let n = 200_000;
            let at = |i: i32| (f64::from(i) + 0.5) / f64::from(n) * 2.0 - 1.0;
            let total: f64 = (0..n).map(|i| f.profile(at(i) * at(i))).sum();
            for x in [-1.5, -1.0, -0.6, -0.1, 0.0, 0.3, 0.9, 1.0, 2.0] {
                let before: f64 = (0..n).filter(|i| at(*i) < x).map(|i| f.profile(at(i) * at(i))).sum();
                assert!((f.share_before(x) - before / total).abs() < 2e-5, "cutoff {cutoff}, {x}");
                assert!((f.share_before(x) + f.share_before(-x) - 1.0).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn a_lattice_before_a_plane_grows_evenly() {
        let f = Footprint::default();
        let radius = f64::from(f.radius_for_spacing(1.0));
        let before = |plane: f64| (-8..=8).map(|k| f.share_before((plane - f64::from(k)) / radius)).sum::<f64>();
        for i in 0..64 {
            let plane = f64::from(i) / 64.0;
            assert!((before(plane) - before(0.0) - plane).abs() < 2e-4, "{plane}: {}", before(plane) - before(0.0));
        }
    }

    #[test]
    fn ia2_square_lattice_sums_to_a_constant() {
        let f = Footprint::default();
        let radius = f64::from(f.radius_for_spacing(1.0));
        let sum_at = |u: f64, v: f64| -> f64 {
            let mut sum = 0.0;
            for i in -4..=4 {
                for j in -4..=4 {
                    let x = f64::from(i) - u;
                    let y = f64::from(j) - v;
                    sum += f.profile((x * x + y * y) / (radius * radius));
                }
            }
            sum * f.norm() / (radius * radius)
        };
        for i in 0..16 {
            for j in 0..16 {
                let sum = sum_at(f64::from(i) / 16.0, f64::from(j) / 16.0);
                assert!((sum - 1.0).abs() < 2.5e-4, "phase {i} {j}: {sum}");
            }
        }
    }
}
