//! Liberties: departures from physics that a scene may ask of one object, which a path tracer can follow all the same.
//!
//! They concern light that reaches an object from a light: what casts no shadow is left out of shadow rays, a shadow
//! coefficient k mixes the transmittance T of a shadow ray to 1 − k(1 − T), and a gain multiplies what is scattered. Light from
//! the environment takes none of the first two.

use splat_core::Error;

/// What one object does otherwise than nature.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Liberty {
    /// Whether it dims what lies behind it, seen from a light.
    pub casts_shadow: bool,
    /// Share of shadow that it receives, in \[0, 1\].
    pub shadow_coefficient: f64,
    /// Factor on the light that it scatters, ≥ 0; above 1 it makes light, and paths must end by
    /// [`crate::PathRules::max_bounces`].
    pub gain: f64,
}

impl Default for Liberty {
    /// None.
    fn default() -> Self {
        Self { casts_shadow: true, shadow_coefficient: 1.0, gain: 1.0 }
    }
}

impl Liberty {
    /// Whether shadows are not those of nature.
    pub(crate) fn touches_shadows(&self) -> bool {
        !self.casts_shadow || self.shadow_coefficient != 1.0
    }

    pub(crate) fn validate(&self, element: &'static str, index: usize) -> Result<(), Error> {
        if !(0.0..=1.0).contains(&self.shadow_coefficient) {
            let found = self.shadow_coefficient;
            return Err(Error::invalid(element, index, "shadow_coefficient", found, "a number in [0, 1]"));
        }
        if !(self.gain.is_finite() && self.gain >= 0.0) {
            return Err(Error::invalid(element, index, "gain", self.gain, "a finite number ≥ 0"));
        }
        Ok(())
    }

    /// Refuses what a method does not follow.
    pub(crate) fn refuse(&self, element: &'static str, index: usize) -> Result<(), Error> {
        if *self == Self::default() {
            return Ok(());
        }
        Err(Error::invalid(element, index, "liberty", self, "none; ask the path tracer"))
    }
}
