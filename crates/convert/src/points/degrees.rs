//! Points whose x and y are degrees of longitude and latitude, beside heights in metres → metres.
//!
//! The Earth is taken as a plane around the middle of the points, because a picture covers a small part of it. East is x, north y.

use splat_core::glam::{DVec3, Vec3};
use splat_core::{DAabb, RawPoints};

/// Metres of a degree of latitude, and of one of longitude at the equator: WGS 84, to a thousandth everywhere.
const LATITUDE: f64 = 111_132.0;
const LONGITUDE: f64 = 111_320.0;
/// Points from which their box tells something.
const FEWEST: usize = 100;
/// Height over width from which metres beside degrees are more likely than one unit.
const STEEP: f64 = 1000.0;
/// Most degrees that points of one picture span.
const WIDEST: f64 = 5.0;

/// Whether x and y look like longitude and latitude, in degrees, and z like metres. They are within their ranges, a thousand times as high as
/// wide, and flat once converted to metres.
pub fn looks_like_degrees(points: &RawPoints) -> bool {
    let Some(bounds) = bounds(points).filter(|_| points.len() >= FEWEST) else { return false };
    let size = bounds.size();
    let far = bounds.min.abs().max(bounds.max.abs());
    let width = size.x.max(size.y);
    let is_within = far.x <= 180.0 && far.y <= 90.0 && size.x > 0.0 && size.y > 0.0 && width <= WIDEST;
    is_within && size.z >= STEEP * width && size.z <= width * LONGITUDE
}

/// The same points in metres east and north of the middle of their box, heights as they are. The integers of their file are dropped.
pub fn metres_of_degrees(points: &RawPoints) -> RawPoints {
    let middle = bounds(points).map_or(DVec3::ZERO, |bounds| bounds.center());
    let scale = DVec3::new(LONGITUDE * libm::cos(middle.y.to_radians()), LATITUDE, 1.0);
    let low = DVec3::new(middle.x, middle.y, 0.0);
    let place = |i: usize| (points.exact_position(i) - low) * scale;
    let origin = DVec3::new(0.0, 0.0, middle.z);
    let position: Vec<Vec3> = (0..points.len()).map(|i| (place(i) - origin).as_vec3()).collect();
    RawPoints { origin, position, lattice: None, ..points.clone() }
}

fn bounds(points: &RawPoints) -> Option<DAabb> {
    (!points.is_empty()).then(|| DAabb::of_points((0..points.len()).map(|i| points.exact_position(i))))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square of so many degrees a side and metres high.
    fn ground(side: f64, height: f64) -> RawPoints {
        let place = |i: usize| {
            DVec3::new((i % 12) as f64 / 11.0 * side, (i / 12) as f64 / 11.0 * side, (i % 5) as f64 / 4.0 * height)
        };
        let origin = DVec3::new(-71.05, 60.0, 0.0);
        RawPoints { origin, position: (0..144).map(|i| place(i).as_vec3()).collect(), ..RawPoints::default() }
    }

    #[test]
    fn degrees_are_told_by_their_ranges_and_by_heights_that_are_none() {
        assert!(looks_like_degrees(&ground(3e-4, 4.0)));
        // Metres, a tower of metres, what is no longitude, a few points.
        assert!(!looks_like_degrees(&ground(4.0, 4.0)) && !looks_like_degrees(&ground(0.5, 60.0)));
        let mut far = ground(3e-4, 4.0);
        far.origin.x = 500.0;
        assert!(!looks_like_degrees(&far));
        assert!(!looks_like_degrees(&RawPoints { position: vec![Vec3::ZERO; 9], ..RawPoints::default() }));
    }

    #[test]
    fn a_degree_of_longitude_is_half_as_long_at_sixty_degrees() {
        let metres = metres_of_degrees(&ground(0.001, 4.0));
        let size = DAabb::of_points((0..metres.len()).map(|i| metres.exact_position(i))).size();
        assert!((size.y / 111.132 - 1.0).abs() < 1e-3 && (size.x / 55.66 - 1.0).abs() < 1e-3, "{size}");
        assert!((size.z - 4.0).abs() < 1e-6 && metres.lattice.is_none());
    }
}
