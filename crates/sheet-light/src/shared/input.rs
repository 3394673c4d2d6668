//! What image-aligned sheets draw: volumes, splats beside them, the lights, the view.

use super::slabs::MOST_BY_SPLATS;
use crate::{Error, Volume};
use splat_core::glam::DVec3;
use splat_core::raster::Projected;
use splat_core::raster::bins::{self, Bins};
use splat_core::shade::LitBy;
use splat_core::{Camera, Clip, Material, Packing, SliceOrder};

/// Most lattice points along one axis: a voxel's place in its row is kept in 16 bits, with a rim around the lattice.
const MOST_A_SIDE: usize = (1 << 16) - 8;

/// Splats, projected and shaded.
#[derive(Debug, Clone)]
pub struct Splats<'a> {
    /// Footprints by id, with depths where something opaque hides them or depths are asked for, with objects where these are.
    pub projected: &'a Projected,
    /// View depths of the centres by id, world units.
    pub depths: Vec<f32>,
    /// The ids that are drawn, front to back.
    pub order: Vec<u32>,
    /// As many numbers a splat as the accumulator has channels, by id.
    pub values: &'a [f32],
    /// Extinction per channel, by id of the material.
    pub materials: &'a [Material],
    /// Width of the slabs where neither the parameters nor a volume give one, world units, > 0.
    pub slab_width: f64,
}

impl Splats<'_> {
    /// Width of slabs for splats in order: that of their slices, but not so little that most slabs are empty.
    pub fn slab_width(order: &SliceOrder) -> f64 {
        let whole = f64::from(order.far) - f64::from(order.near);
        order.thickness.max(whole / MOST_BY_SPLATS).max(f64::MIN_POSITIVE)
    }

    /// View depths of the nearest and the farthest centre.
    pub(crate) fn reach(&self) -> [f64; 2] {
        let depths = self.order.iter().map(|i| self.depths[*i as usize]);
        depths.fold([f64::INFINITY, 0.0], |[near, far], z| [near.min(f64::from(z)), far.max(f64::from(z))])
    }

    pub(crate) fn bin(&self) -> Bins {
        bins::bin(self.projected, &self.order)
    }
}

/// What sheets are made of.
#[derive(Clone)]
pub struct SheetInput<'a> {
    /// Volumes; where they overlap extinctions add, and colours weigh by extinction.
    pub volumes: Vec<Volume<'a>>,
    /// Splats that share the slabs, shaded already.
    pub splats: Option<Splats<'a>>,
    /// The view. Slabs lie across its axis.
    pub camera: &'a Camera,
    /// Lights, with their shadows.
    pub lights: Vec<LitBy<'a>>,
    /// World position that receivers of shadows are relative to: the origin of the cloud that casts them.
    pub shadow_origin: DVec3,
    /// Ambient radiance, the same from everywhere.
    pub ambient: [f32; 3],
}

impl SheetInput<'_> {
    pub(crate) fn check(&self) -> Result<(), Error> {
        if let Some(width) = self.splats.as_ref().map(|s| s.slab_width).filter(|w| !(w.is_finite() && *w > 0.0)) {
            return Err(Error::parameter("splats.slab_width", width, "a finite number > 0, world units"));
        }
        for (volume, v) in self.volumes.iter().enumerate() {
            v.grid.validate().map_err(|source| Error::Volume { volume, source })?;
            v.clip.iter().try_for_each(Clip::validate).map_err(|source| Error::Volume { volume, source })?;
            if v.packing == Packing::BodyCentred && !v.grid.dims[2].is_multiple_of(2) {
                let expected = "an even number of planes of a body-centred lattice";
                let source = splat_core::Error::invalid("grid", 0, "dims", v.grid.dims, expected);
                return Err(Error::Volume { volume, source });
            }
            if v.grid.dims.iter().any(|n| *n > MOST_A_SIDE) {
                let source = splat_core::Error::invalid("grid", 0, "dims", v.grid.dims, "at most 65528 a side");
                return Err(Error::Volume { volume, source });
            }
            if !(v.extinction_scale.is_finite() && v.extinction_scale > 0.0) {
                let expected = "a finite number > 0";
                let source =
                    splat_core::Error::invalid("volume", volume, "extinction_scale", v.extinction_scale, expected);
                return Err(Error::Volume { volume, source });
            }
            if !(0.0..=1.0).contains(&v.shadow_coefficient) {
                let expected = "a number in [0, 1]";
                let source =
                    splat_core::Error::invalid("volume", volume, "shadow_coefficient", v.shadow_coefficient, expected);
                return Err(Error::Volume { volume, source });
            }
        }
        Ok(())
    }
}
