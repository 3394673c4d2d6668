//! What half-vector sheets are made of and what the caller chooses.

use super::{Bodies, HalfSplats, Polygons};
use crate::{Error, Params, SheetInput};
use splat_core::shade::LitBy;
use std::f64::consts::FRAC_PI_2;

/// What is drawn.
#[derive(Clone)]
pub struct HalfInput<'a> {
    /// Volumes, view, lights and ambient radiance. The shadow of a [`LitBy`] is that of everything but the
    /// volumes here, which shadow themselves and each other by the light buffer; `None` for no shadow else. Materials take
    /// [`crate::Volume::shadow_coefficient`] of both.
    pub sheets: SheetInput<'a>,
    /// Splats among the volumes: they shadow them and each other, and take shadows of them. Those of `sheets` are refused, for their
    /// light is known.
    pub splats: Option<HalfSplats<'a>>,
    /// Opaque polygons, anywhere: before, among and behind all that. They hide what is behind them, for the eye and for the lights of
    /// `sheets` and `extended`, and are lit by what comes through to them.
    pub polygons: &'a [Polygons<'a>],
    /// Lights with an extent, a sweep each, whose shadows are soft.
    pub extended: Vec<Extended<'a>>,
    /// Lights beside those, for which there is no sweep: their shadow, that of these volumes included, is known, or they
    /// cast none.
    pub mapped: Vec<LitBy<'a>>,
    /// View depth of what else hides all that at each pixel, +∞ for nothing; or empty.
    pub opaque: &'a [f32],
}

impl HalfInput<'_> {
    /// What there is, as far as it says how slabs lie.
    pub fn bodies(&self) -> Bodies<'_> {
        let splats = self.splats.as_ref().and_then(HalfSplats::bounds);
        Bodies { volumes: &self.sheets.volumes, splats }
    }
}

/// A light with an extent: a sphere, a disk, a rectangle.
///
/// One sweep attenuates along the rays of each of its points, of which each has a z-buffer of the polygons. Unattenuated, it lights as its centre does, by
/// [`splat_core::Light::irradiance`]; and so it is scattered more than once.
#[derive(Clone, Copy)]
pub struct Extended<'a> {
    /// The light, and the shadow of everything but the volumes and polygons, its mean over the light. One without an extent is a point.
    pub lit: LitBy<'a>,
    /// Points that stand for it, those of [`splat_core::Light::points`], 1 to [`MOST_SAMPLES`].
    pub samples: u32,
}

/// Most points of an extended light.
pub const MOST_SAMPLES: u32 = 1024;

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
