//! f64 coordinates → an f64 origin and f32 offsets.

use super::input;
use crate::error::{Place, ReadError};
use splat_core::glam::{DVec3, Vec3};

/// How many diagonals away from zero points may lie before they get an origin of their own.
const FAR: f64 = 4.0;

/// Splits positions so that f32 offsets lose nothing that matters; `Err` is the first point that fits no f32.
///
/// Points near zero keep their coordinates; points that lie farther from zero than [`FAR`] times their diagonal are
/// taken relative to the middle of their bounds. The rule has no absolute length, so it scales with the input.
fn split(positions: &[DVec3], mut offsets: Vec<Vec3>) -> Result<(DVec3, Vec<Vec3>), usize> {
    let Some(&first) = positions.first() else { return Ok((DVec3::ZERO, offsets)) };
    let (min, max) = positions.iter().fold((first, first), |(lo, hi), p| (lo.min(*p), hi.max(*p)));
    let extent = max - min;
    let far = min.abs().max(max.abs()).max_element() > FAR * extent.max_element();
    let origin = if far { min + extent * 0.5 } else { DVec3::ZERO };
    offsets.extend(positions.iter().map(|p| (*p - origin).as_vec3()));
    match offsets.iter().position(|p| !p.is_finite()) {
        Some(i) => Err(i),
        None => Ok((origin, offsets)),
    }
}

/// [`split`], with the words for the point that fits no f32: `named` says which it is.
pub(super) fn relative(
    positions: &[DVec3],
    place: Place,
    named: impl FnOnce(usize) -> String,
) -> Result<(DVec3, Vec<Vec3>), ReadError> {
    let mut room = Vec::new();
    input::reserve(&mut room, positions.len())?;
    split(positions, room).map_err(|i| {
        let expected = "coordinates that fit 32-bit floats once the middle is subtracted";
        let found = format!("{} at {}", positions[i], named(i));
        ReadError::input(place, expected, found, "scale the data, or remove outliers")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn split(positions: &[DVec3]) -> Result<(DVec3, Vec<Vec3>), usize> {
        super::split(positions, Vec::new())
    }

    #[test]
    fn near_points_keep_their_coordinates_and_far_points_keep_their_distances() {
        let near = [DVec3::new(0.1, -2.0, 3.0), DVec3::new(1.0, 2.0, -3.0)];
        assert_eq!(split(&near), Ok((DVec3::ZERO, near.map(|p| p.as_vec3()).to_vec())));
        let far = near.map(|p| p + DVec3::splat(5e6));
        let (origin, offsets) = split(&far).unwrap();
        for (p, o) in far.iter().zip(&offsets) {
            assert!((origin + o.as_dvec3()).distance(*p) < 1e-6);
        }
    }

    #[test]
    fn ba19_coordinates_beyond_f32_are_named() {
        assert_eq!(split(&[DVec3::ZERO, DVec3::new(1e308, 0.0, 0.0)]), Err(1));
        assert_eq!(split(&[DVec3::splat(-1e308), DVec3::splat(1e308)]), Err(0));
        assert_eq!(split(&[DVec3::splat(1e308)]), Ok((DVec3::splat(1e308), vec![Vec3::ZERO])));
    }

    #[test]
    fn scaling_by_a_power_of_two_scales_the_result() {
        let points = [DVec3::new(9.0, 1.25, 3.5), DVec3::new(9.5, 1.0, 3.0)];
        let (origin, offsets) = split(&points).unwrap();
        let (scaled_origin, scaled) = split(&points.map(|p| p * 1024.0)).unwrap();
        assert_eq!(scaled_origin, origin * 1024.0);
        assert_eq!(scaled, offsets.iter().map(|o| *o * 1024.0).collect::<Vec<_>>());
    }
}
