//! Parameters of blending.

use crate::Error;

/// Parameters of the surfaces that discs form.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Params {
    /// Radius within which a disc counts, over its cut-off radius, in \[0.45, 1\]. The kernel is drawn in with it: less is sharper
    /// and faster. A disc ends a hole within [`Footprint::CORE`](splat_core::Footprint::CORE) of the cut-off radius whatever this is.
    pub disc_scale: f32,
    /// ε: two neighbours along a ray belong to one layer if the planes of their discs lie nearer to one another than this, as a share
    /// of the discs' radius; in \[2⁻¹⁰, 4\].
    pub gap: f32,
    /// A pixel is done when its transmittance is below this, in \[0, 1).
    pub transmittance_cutoff: f32,
}

impl Default for Params {
    fn default() -> Self {
        Self { disc_scale: 0.6, gap: 0.5, transmittance_cutoff: 1e-6 }
    }
}

impl Params {
    /// Whether all is in range.
    ///
    /// # Errors
    /// [`Error::Parameter`] for the first that is not.
    pub fn check(&self) -> Result<(), Error> {
        if !(0.45..=1.0).contains(&self.disc_scale) {
            return Err(Error::parameter("disc_scale", self.disc_scale, "between 0.45 and 1"));
        }
        if !(2f32.powi(-10)..=4.0).contains(&self.gap) {
            return Err(Error::parameter("gap", self.gap, "between 2⁻¹⁰ and 4"));
        }
        if !(0.0..1.0).contains(&self.transmittance_cutoff) {
            return Err(Error::parameter("transmittance_cutoff", self.transmittance_cutoff, "at least 0 and below 1"));
        }
        Ok(())
    }
}
