//! What the caller chooses of half-vector sheets.

use crate::{Error, Params};
use std::f64::consts::FRAC_PI_2;

/// How often light is scattered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scattering {
    /// Once, exactly.
    #[default]
    None,
    /// Ahead as often as it may be (Figure 2): what is scattered back is gone.
    Forward,
    /// Back and forth until it leaves or is absorbed (Figure 4).
    ForwardAndBack,
}

/// Parameters of half-vector sheets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HalfParams {
    /// Slab width, kernel, cutoff and memory. A width of `None` is the least spacing of the volumes along the half vector.
    pub sheets: Params,
    /// Pixels of the light buffer per least step of a lattice, at the middle of the volumes, > 0.
    pub light_pixels: f64,
    /// Most pixels of a light buffer along a side, and of the z-buffer of polygons, 16 to 8192: pixels grow where there would be more. Those
    /// of a light's points have as many together, and at least 16 a side.
    pub most_light_pixels: u32,
    /// How often light is scattered in media that scatter by a phase function.
    pub scattering: Scattering,
    /// Half angle of the cone that light spreads into where it is scattered ahead, radians, in \[0, π/2); `None` for that of the
    /// mean cosine of what the media's phase functions leave ahead.
    pub cone: Option<f64>,
    /// Voxels for each cell of scattered light, 1 to 2²⁰. Layers of cells above an optical depth of 1/2 are cut into thinner ones, up to 2¹⁶ cells.
    pub voxels_per_cell: u32,
}

impl Default for HalfParams {
    fn default() -> Self {
        Self {
            sheets: Params::default(),
            light_pixels: 1.5,
            most_light_pixels: 2048,
            scattering: Scattering::None,
            cone: None,
            voxels_per_cell: 32,
        }
    }
}

impl HalfParams {
    pub(crate) fn check(&self) -> Result<(), Error> {
        self.sheets.check()?;
        if !(self.light_pixels.is_finite() && self.light_pixels > 0.0) {
            return Err(Error::parameter("light_pixels", self.light_pixels, "a finite number > 0"));
        }
        if !(16..=8192).contains(&self.most_light_pixels) {
            return Err(Error::parameter("most_light_pixels", self.most_light_pixels, "16 to 8192"));
        }
        if !self.cone.is_none_or(|cone| (0.0..FRAC_PI_2).contains(&cone)) {
            return Err(Error::parameter("cone", self.cone, "0 to below π/2 radians"));
        }
        if !(1..=1 << 20).contains(&self.voxels_per_cell) {
            return Err(Error::parameter("voxels_per_cell", self.voxels_per_cell, "1 to 2^20"));
        }
        Ok(())
    }
}
