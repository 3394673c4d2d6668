//! Parameters of samplers, and the fields that thin them out.

use crate::Error;
use crate::error::check;
use splat_core::ScalarField;
use splat_core::glam::DVec3;
use splat_core::optics::SurfaceOpacity;

/// The most particles that one set of one sampler may have: ids are 32 bits.
pub(crate) const MAX_PARTICLES: f64 = 4.0e9;

/// Parameters of every sampler of surfaces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceParams {
    /// Opacity of one crossing at right angles, in \[0, 1\].
    pub opacity: f64,
    /// Particle cross-section s: the area of one pixel at the surface, world units², > 0; see
    /// [`crate::pixel_area`]. Smaller is finer and costs more particles.
    pub cross_section: f64,
    /// The growth of the opacity at grazing angles; the paper's surfaces are thin slabs.
    pub surface_opacity: SurfaceOpacity,
    /// Factor on the optical depth of a crossing, > 0. `opacity` includes it already; opacities of a mesh's vertices do not.
    pub extinction_factor: f64,
    /// Linear Rec.709 colour of every particle, or the factor on a mesh's vertex colours; each channel ≥ 0.
    pub color: [f32; 3],
    /// Optical depth at which an opaque surface is sampled, in (0, 64\]; see [`crate::opacity::capped_optical_depth`].
    pub opaque_optical_depth: f64,
    /// Seed of all sets.
    pub seed: u64,
}

impl Default for SurfaceParams {
    fn default() -> Self {
        Self {
            opacity: 0.5,
            cross_section: 1e-4,
            surface_opacity: SurfaceOpacity::ThinSlab,
            extinction_factor: 1.0,
            color: [1.0; 3],
            opaque_optical_depth: 16.0,
            seed: 1,
        }
    }
}

impl SurfaceParams {
    /// Optical depth of one crossing at right angles.
    pub fn optical_depth(&self) -> f64 {
        crate::opacity::capped_optical_depth(self.opacity, self.opaque_optical_depth)
    }

    /// Mean number of particles on an area of 1.
    pub fn particles_per_area(&self) -> f64 {
        self.optical_depth() / self.cross_section
    }

    /// Checks ranges.
    ///
    /// # Errors
    /// [`Error::Parameter`] for the first that is out of range.
    pub fn validate(&self) -> Result<(), Error> {
        check((0.0..=1.0).contains(&self.opacity), "opacity", self.opacity, "a number in [0, 1]")?;
        positive(self.cross_section, "cross_section")?;
        positive(self.extinction_factor, "extinction_factor")?;
        let cap = self.opaque_optical_depth;
        check(cap > 0.0 && cap <= 64.0, "opaque_optical_depth", cap, "a number in (0, 64]")?;
        color(self.color)
    }
}

pub(crate) fn positive(v: f64, name: &'static str) -> Result<(), Error> {
    check(v.is_finite() && v > 0.0, name, v, "a finite number > 0")
}

pub(crate) fn color(c: [f32; 3]) -> Result<(), Error> {
    check(c.iter().all(|v| v.is_finite() && *v >= 0.0), "color", c, "three finite numbers ≥ 0")
}

/// Refuses a set that could not be numbered, or whose optical depths do not add up to a number.
pub(crate) fn countable(expected: f64) -> Result<(), Error> {
    check(!expected.is_nan(), "particles of a set", expected, "a number: finite extinctions, opacities and sizes")?;
    if expected <= MAX_PARTICLES {
        return Ok(());
    }
    Err(Error::limit("a set", expected as u64, MAX_PARTICLES as u64, "particles"))
}

/// A field that multiplies the mean number of particles from place to place, for surfaces and volumes alike.
///
/// Samplers draw at the rate of the bound and keep each particle with probability value / bound: exact, whatever the
/// field. Optical depth follows the field.
#[derive(Clone, Copy)]
pub struct Density<'a> {
    /// The factor; negative values count as 0, values above `max` as `max`.
    pub field: &'a dyn ScalarField,
    /// The largest factor, finite and > 0.
    pub max: f64,
}

impl Density<'_> {
    /// Checks the bound.
    ///
    /// # Errors
    /// [`Error::Parameter`] when it is not positive.
    pub fn validate(&self) -> Result<(), Error> {
        positive(self.max, "density.max")
    }

    /// An upper bound within `radius` of `p`.
    pub(crate) fn bound(&self, p: DVec3, radius: f64) -> f64 {
        match self.field.bound(p, radius) {
            Some((_, high)) if high < self.max => high.max(0.0),
            _ => self.max,
        }
    }

    /// The factor at `p`; a value that is not a number counts as 0.
    pub(crate) fn at(&self, p: DVec3) -> f64 {
        let v = self.field.value(p);
        if v > 0.0 { v.min(self.max) } else { 0.0 }
    }
}

impl std::fmt::Debug for Density<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Density {{ max: {} }}", self.max)
    }
}
