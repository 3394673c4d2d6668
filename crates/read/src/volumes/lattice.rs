//! What the axes of a volume have to be, whatever the file calls them.

use crate::error::{Place, ReadError};
use splat_core::glam::{DMat3, DVec3};

/// Most that the longest step of a lattice may be of the shortest. Long steps are split into such as the shortest, so that a
/// damaged number would make thousands of voxels of each.
pub(crate) const MAX_ASPECT: f64 = 1000.0;

/// Refuses axes that span no volume, or of which one is out of all proportion.
pub(crate) fn check(origin: DVec3, axes: &DMat3, place: Place, hint: &'static str) -> Result<(), ReadError> {
    let volume = axes.determinant();
    if !(origin.is_finite() && volume.is_finite() && volume != 0.0) {
        let found = format!("origin {origin}, axes {axes}");
        return Err(ReadError::input(place, "three independent finite steps", found, hint));
    }
    let steps = [axes.x_axis, axes.y_axis, axes.z_axis].map(DVec3::length);
    let (least, most) = steps.iter().fold((f64::INFINITY, 0f64), |(l, m), s| (l.min(*s), m.max(*s)));
    if most <= MAX_ASPECT * least {
        return Ok(());
    }
    let expected = format!("steps of which none is more than {MAX_ASPECT} times another");
    let [x, y, z] = steps;
    Err(ReadError::input(place, expected, format!("steps of {x}, {y} and {z}"), "check the voxel size, or resample"))
}

/// Place and sizes of the lattice of the middles of the cells between so many points of another; along an axis of one point there
/// is one cell, in its plane.
pub(crate) fn of_cells(origin: DVec3, axes: &DMat3, points: [u64; 3]) -> (DVec3, [u64; 3]) {
    let half = points.map(|n| if n > 1 { 0.5 } else { 0.0 });
    (origin + *axes * DVec3::from_array(half), points.map(|n| n.saturating_sub(1).max(1)))
}
