//! Participating media: a density with optical properties.

use crate::density::Density;
use crate::liberty::Liberty;
use glam::DVec3;
use splat_core::Error;

/// A colour that varies over space.
pub type ColorAt<'a> = &'a (dyn Fn(DVec3) -> [f64; 3] + Sync);

/// A medium. Where several overlap, their extinctions add.
///
/// The radiative transfer equation of one medium of density ρ along a ray is
/// dL/ds = ρ·σ·(−L + S + ω∫p·L dω'), σ `extinction`, S = `emission` + `glow`·c, ω = `albedo`·c, c `color` (1 without).
#[derive(Clone, Copy)]
pub struct Medium<'a> {
    /// How much of it there is where.
    pub density: Density<'a>,
    /// Extinction σ_t per channel at density 1, 1/world unit, ≥ 0.
    pub extinction: [f64; 3],
    /// Single-scattering albedo ω per channel, in \[0, 1\].
    pub albedo: [f64; 3],
    /// Asymmetry g of the Henyey-Greenstein phase function, in (−1, 1).
    pub asymmetry: f64,
    /// Emitted radiance of a fully opaque column per channel, ≥ 0.
    pub emission: [f64; 3],
    /// Emitted radiance of a fully opaque column per unit of `color`, ≥ 0.
    pub glow: [f64; 3],
    /// Colour by world position, each channel in \[0, 1\] (larger values count as 1 in the albedo).
    pub color: Option<ColorAt<'a>>,
    /// What it does otherwise than nature.
    pub liberty: Liberty,
}

impl<'a> Medium<'a> {
    /// A grey, isotropic, dark medium: what the caller does not set.
    pub fn new(density: Density<'a>, extinction: f64, albedo: f64) -> Self {
        Self {
            density,
            extinction: [extinction; 3],
            albedo: [albedo; 3],
            asymmetry: 0.0,
            emission: [0.0; 3],
            glow: [0.0; 3],
            color: None,
            liberty: Liberty::default(),
        }
    }

    /// Albedo and emitted radiance at `p`.
    pub(crate) fn source(&self, p: DVec3) -> ([f64; 3], [f64; 3]) {
        match self.color {
            None => (self.albedo, std::array::from_fn(|c| self.emission[c] + self.glow[c])),
            Some(color) => {
                let color = color(p);
                let albedo = std::array::from_fn(|c| self.albedo[c] * color[c].clamp(0.0, 1.0));
                (albedo, std::array::from_fn(|c| self.emission[c] + self.glow[c] * color[c].max(0.0)))
            }
        }
    }

    pub(crate) fn emits(&self) -> bool {
        self.emission.iter().chain(&self.glow).any(|e| *e > 0.0)
    }

    pub(crate) fn largest_extinction(&self) -> f64 {
        self.extinction.iter().fold(0.0, |m, e| m.max(*e))
    }

    /// Checks every number.
    ///
    /// # Errors
    /// [`Error::Invalid`] naming the medium by `index`.
    pub fn validate(&self, index: usize) -> Result<(), Error> {
        self.density.validate(index)?;
        self.liberty.validate("medium", index)?;
        for (attribute, values) in [("extinction", self.extinction), ("emission", self.emission), ("glow", self.glow)] {
            if !values.iter().all(|v| v.is_finite() && *v >= 0.0) {
                return Err(Error::invalid("medium", index, attribute, values, "three finite numbers ≥ 0"));
            }
        }
        if !self.albedo.iter().all(|a| (0.0..=1.0).contains(a)) {
            return Err(Error::invalid("medium", index, "albedo", self.albedo, "three numbers in [0, 1]"));
        }
        if !(self.asymmetry > -1.0 && self.asymmetry < 1.0) {
            return Err(Error::invalid("medium", index, "asymmetry", self.asymmetry, "a number in (−1, 1)"));
        }
        Ok(())
    }
}
