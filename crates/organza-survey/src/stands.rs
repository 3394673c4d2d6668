//! Which axis of data points up, where its format says nothing of it: things stand on the plane that their coordinates begin at, and points and
//! layers of the ground or the sky are far wider than high.

use splat_core::glam::DVec3;
use splat_core::{DAabb, Grid, UpAxis};

/// Distance of the lowest point from 0 over the height, of what stands there.
const ON: f64 = 0.01;
/// Distance of the middle from 0 over the size, of what was placed about 0.
const ABOUT: f64 = 0.1;

/// Height over the lesser width, up to which points and volumes are a layer that lies flat.
const FLAT: f64 = 0.25;

/// z where a box is far wider along x and y than high along z, and y is no thinner; `None` where it is not, and for what has no height.
pub(crate) fn lies_flat_along(bounds: DAabb) -> Option<UpAxis> {
    let size = bounds.size();
    (size.z > 0.0 && size.z <= FLAT * size.x.min(size.y)).then_some(UpAxis::Z)
}

/// The same of points, which may stand as meshes do.
pub(crate) fn cloud_stands_along(bounds: DAabb) -> Option<UpAxis> {
    stands_along(bounds).or_else(|| lies_flat_along(bounds))
}

/// Whether points lie as a depth camera at the origin sees them that looks along z: before it, to both sides of its axis, and within its angle of view.
/// y points down in the axes of such cameras.
pub(crate) fn lies_before_camera(points: impl Iterator<Item = DVec3>) -> bool {
    /// Tangents of half the angles of view that depth cameras have, about 14° to 50°.
    const LEAST: f64 = 0.25;
    const MOST: f64 = 1.2;
    let mut least = DVec3::INFINITY;
    let mut most = DVec3::NEG_INFINITY;
    for point in points {
        if point.z <= 0.0 {
            return false;
        }
        let seen = DVec3::new(point.x / point.z, point.y / point.z, 0.0);
        least = least.min(seen);
        most = most.max(seen);
    }
    let is_side = |tangent: f64| (0.0..=MOST).contains(&tangent);
    let are_sides = [-least.x, -least.y, most.x, most.y].into_iter().all(is_side);
    are_sides && (-least.x).max(most.x) >= LEAST
}

/// The box of the cells of a volume.
pub(crate) fn extent(grid: &Grid) -> DAabb {
    let count = grid.dims.map(|n| n as f64);
    let corner = |k: usize| {
        let index = DVec3::from_array(std::array::from_fn(|a| if k >> a & 1 == 0 { -0.5 } else { count[a] - 0.5 }));
        grid.origin + grid.axes * index
    };
    DAabb::of_points((0..8).map(corner))
}

/// z where the data's box begins at z = 0 and lies about 0 along x and y, as printable and drawn things mostly do; `None` where it does not.
pub(crate) fn stands_along(bounds: DAabb) -> Option<UpAxis> {
    let size = bounds.size();
    let center = bounds.center();
    let about = |axis: usize| center[axis].abs() <= ABOUT * size[axis];
    let stands = size.z > 0.0 && bounds.min.z.abs() <= ON * size.z && about(0) && about(1);
    stands.then_some(UpAxis::Z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_lie_flat_and_stand_along_their_thin_side() {
        let up_axis = |size: [f64; 3]| {
            lies_flat_along(DAabb::new(DVec3::splat(7.0), DVec3::splat(7.0) + DVec3::from_array(size)))
        };
        // A terrain, a layer of clouds; a body, a wall that faces z, a layer along y, a plane.
        assert_eq!([up_axis([900.0, 700.0, 60.0]), up_axis([64.0, 64.0, 16.0])], [Some(UpAxis::Z); 2]);
        assert_eq!(
            [up_axis([2.0, 2.0, 1.8]), up_axis([9.0, 1.0, 0.4]), up_axis([9.0, 0.5, 9.0]), up_axis([9.0, 9.0, 0.0])],
            [None; 4]
        );
        assert_eq!(
            cloud_stands_along(DAabb::new(DVec3::new(-1.0, -1.0, 0.0), DVec3::new(1.0, 1.0, 4.0))),
            Some(UpAxis::Z)
        );
    }

    #[test]
    fn what_a_depth_camera_sees_lies_before_it_and_within_its_view() {
        let wall = |depth: f64, half: f64| {
            (0..9).map(move |i| DVec3::new(half * f64::from(i % 3 - 1), half * f64::from(i / 3 - 1), depth))
        };
        assert!(lies_before_camera(wall(2.0, 1.0)));
        // A house on a hill, a room around the scanner, a thing beside the axis.
        assert!(!lies_before_camera(wall(300.0, 20.0)));
        assert!(!lies_before_camera(wall(2.0, 1.0).chain(wall(-2.0, 1.0))));
        assert!(!lies_before_camera(wall(2.0, 0.5).map(|point| point + DVec3::X)));
    }

    #[test]
    fn things_stand_where_they_begin_at_zero_and_lie_about_it() {
        let up_axis =
            |min: [f64; 3], max: [f64; 3]| stands_along(DAabb::new(DVec3::from_array(min), DVec3::from_array(max)));
        assert_eq!(up_axis([-2.0, -2.1, 0.01], [2.1, 2.0, 5.0]), Some(UpAxis::Z));
        // On y = 0, about the origin, beside it, flat.
        assert_eq!(up_axis([-2.0, 0.0, -2.0], [2.0, 5.0, 2.0]), None);
        assert_eq!(up_axis([-1.0; 3], [1.0; 3]), None);
        assert_eq!(up_axis([0.0; 3], [9.0; 3]), None);
        assert_eq!(up_axis([-1.0, -1.0, 0.0], [1.0, 1.0, 0.0]), None);
    }
}
