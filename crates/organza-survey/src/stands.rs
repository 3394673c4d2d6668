//! Which axis of data points up, where its format says nothing of it: things stand on the plane that their coordinates begin at.

use convert::read::UpAxis;
use splat_core::DAabb;

/// Distance of the lowest point from 0 over the height, of what stands there.
const ON: f64 = 0.01;
/// Distance of the middle from 0 over the size, of what was placed about 0.
const ABOUT: f64 = 0.1;

/// z where the data's box begins at z = 0 and lies about 0 along x and y, as printable and drawn things mostly do; `None` where it does not.
pub(crate) fn stands_along(bounds: DAabb) -> Option<UpAxis> {
    let (size, center) = (bounds.size(), bounds.center());
    let about = |axis: usize| center[axis].abs() <= ABOUT * size[axis];
    let stands = size.z > 0.0 && bounds.min.z.abs() <= ON * size.z && about(0) && about(1);
    stands.then_some(UpAxis::Z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::glam::DVec3;

    #[test]
    fn things_stand_where_they_begin_at_zero_and_lie_about_it() {
        let of =
            |min: [f64; 3], max: [f64; 3]| stands_along(DAabb::new(DVec3::from_array(min), DVec3::from_array(max)));
        assert_eq!(of([-2.0, -2.1, 0.01], [2.1, 2.0, 5.0]), Some(UpAxis::Z));
        // On y = 0, about the origin, beside it, flat.
        assert_eq!(of([-2.0, 0.0, -2.0], [2.0, 5.0, 2.0]), None);
        assert_eq!(of([-1.0; 3], [1.0; 3]), None);
        assert_eq!(of([0.0; 3], [9.0; 3]), None);
        assert_eq!(of([-1.0, -1.0, 0.0], [1.0, 1.0, 0.0]), None);
    }
}
