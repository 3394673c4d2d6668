//! Slices along any direction: distances along an axis in the place of view depths.
//!
//! Sweeps of a cloud along another axis than the view, such as sheets across the bisector of view and light,
//! need the same slices: the same integer index, the same two levels, the same exact order. No splat is culled.

use crate::project::{CULLED, Extremes};
use crate::scratch::CHUNK;
use crate::sort::{Bits, check_count, check_ids, slice_projected};
use crate::{Error, Params, Scratch};
use glam::DVec3;
use rayon::prelude::*;
use splat_core::{Cloud, SliceOrder, glam};

/// Splats whose distances are found at once.
const LANES: usize = 16;

/// How far the square of a direction's length may be from 1.
const UNIT: f64 = 1e-6;

/// The axis that slices lie across.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SliceAxis {
    /// The point whose distance is 0, world units.
    pub origin: DVec3,
    /// Direction in which distances grow, of unit length.
    pub direction: DVec3,
}

impl SliceAxis {
    /// Distance along the axis of a place `offset` from `origin`, in f64, then rounded; −0 becomes +0.
    fn distance(&self, from_axis: f64, offset: glam::Vec3) -> f32 {
        let d = self.direction;
        let p = offset.as_dvec3();
        (d.x * p.x + d.y * p.y + d.z * p.z + from_axis) as f32 + 0.0
    }
}

/// Orders the splats of a cloud, or those of `ids` (strictly ascending), in slices of equal thickness along an axis.
///
/// Sorts as [`crate::slice_cloud`] does, with the distance of a splat's centre along the axis in the place of its view
/// depth: [`SliceOrder::near`] is the least distance, and front to back is from there on. The difference of the two origins
/// is taken in f64. Splats that are no finite numbers are left out, no others.
///
/// ```
/// use hbsort::{Direction, Params, Scratch, SliceAxis, Thickness, slice_along};
/// use splat_core::{Cloud, Splat, glam::{DVec3, Vec3}};
///
/// let mut cloud = Cloud::new(DVec3::splat(1.0e7));
/// for position in [Vec3::ZERO, Vec3::X, Vec3::Z, Vec3::new(3.0, 5.0, 3.0)] {
///     cloud.push(&Splat { position, radius: 0.1, ..Splat::default() });
/// }
/// // Across the bisector of the directions of the view and of the light.
/// let axis = SliceAxis { origin: cloud.origin, direction: (DVec3::X + DVec3::Z).normalize() };
/// let params = Params { direction: Direction::FrontToBack, thickness: Thickness::World(0.5), ..Params::default() };
/// let order = slice_along(&cloud, None, &axis, &params, &mut Scratch::new()).unwrap();
/// let slices: Vec<&[u32]> = (0..order.non_empty_slices()).map(|k| order.slice(k)).collect();
/// assert_eq!(slices, [&[0][..], &[1, 2], &[3]]);
/// // 1/√2 lies in the second slice, 3·√2 in the last of nine.
/// assert_eq!((order.slice_indices.as_slice(), order.depth_range(1)), (&[0, 1, 8][..], [0.5, 1.0]));
/// ```
///
/// # Errors
/// [`Error::Axis`], and those of [`crate::slice_cloud`].
pub fn slice_along(
    cloud: &Cloud,
    ids: Option<&[u32]>,
    axis: &SliceAxis,
    params: &Params,
    scratch: &mut Scratch,
) -> Result<SliceOrder, Error> {
    let SliceAxis { origin, direction } = *axis;
    if !(origin.is_finite() && (direction.length_squared() - 1.0).abs() <= UNIT) {
        return Err(Error::Axis { origin, direction });
    }
    let len = cloud.len().min(cloud.radius.len());
    check_count(len)?;
    ids.map_or(Ok(()), |ids| check_ids(ids, len))?;
    params.given_thickness()?;
    let mut order = scratch.take_order(ids.map_or(len, <[u32]>::len))?;
    let from_axis = (cloud.origin - origin).dot(direction);
    let distance = |id: u32| axis.distance(from_axis, cloud.position[id as usize]);
    let chunk = |(c, out): (usize, &mut [u32])| {
        let mut extremes = Extremes::NONE;
        for (place, out) in (c * CHUNK..).zip(out) {
            let id = ids.map_or(place as u32, |ids| ids[place]);
            let found = distance(id);
            let found = if found.is_finite() { found } else { CULLED };
            extremes.take(place % LANES, found, cloud.radius[id as usize]);
            *out = found.to_bits();
        }
        extremes
    };
    let extremes = order.input_from_sorted.par_chunks_mut(CHUNK).enumerate().map(chunk);
    let extremes = extremes.reduce(|| Extremes::NONE, Extremes::join);
    slice_projected(cloud, ids, Bits { extremes, order }, distance, params, scratch)
}
