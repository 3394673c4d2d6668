//! f64 coordinates → an f64 origin and f32 offsets.

use glam::{DVec3, Vec3};

/// How many diagonals away from zero points may lie before they get an origin of their own.
const FAR: f64 = 4.0;

/// Points as f32 offsets from one f64 origin, as columns of clouds and meshes have them.
#[derive(Debug, Clone, PartialEq)]
pub struct Relative {
    /// What the offsets are relative to.
    pub origin: DVec3,
    /// One offset a point.
    pub offsets: Vec<Vec3>,
}

impl Relative {
    /// Splits positions so that f32 offsets lose nothing that matters; the offsets are added to those in `room`, which is empty. Positions lie in any unit.
    ///
    /// Points near zero keep their coordinates; points that lie farther from zero than 4 times the longest side of their bounds are taken relative
    /// to the middle of these. The rule has no absolute length, so it scales with the input.
    ///
    /// ```
    /// use splat_core::{Relative, glam::DVec3};
    /// let far = [DVec3::new(5e6, 0.0, 0.0), DVec3::new(5e6 + 0.25, 0.0, 0.0)];
    /// let Relative { origin, offsets } = Relative::from_positions(&far, Vec::new()).unwrap();
    /// assert_eq!(origin + offsets[1].as_dvec3(), far[1]);
    /// ```
    ///
    /// # Errors
    /// The place of the first point that fits no f32, or is not finite.
    pub fn from_positions(positions: &[DVec3], room: Vec<Vec3>) -> Result<Self, usize> {
        let mut offsets = room;
        let Some(&first) = positions.first() else { return Ok(Self { origin: DVec3::ZERO, offsets }) };
        let mut lowest = first;
        let mut highest = first;
        for position in positions {
            lowest = lowest.min(*position);
            highest = highest.max(*position);
        }
        let extent = highest - lowest;
        let is_far = lowest.abs().max(highest.abs()).max_element() > FAR * extent.max_element();
        let origin = if is_far { lowest + extent * 0.5 } else { DVec3::ZERO };
        offsets.extend(positions.iter().map(|position| (*position - origin).as_vec3()));
        match offsets.iter().position(|offset| !offset.is_finite()) {
            Some(i) => Err(i),
            None => Ok(Self { origin, offsets }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn split(positions: &[DVec3]) -> Result<Relative, usize> {
        Relative::from_positions(positions, Vec::new())
    }

    #[test]
    fn near_points_keep_their_coordinates_and_far_points_keep_their_distances() {
        let near = [DVec3::new(0.1, -2.0, 3.0), DVec3::new(1.0, 2.0, -3.0)];
        let offsets = near.map(|point| point.as_vec3()).to_vec();
        assert_eq!(split(&near), Ok(Relative { origin: DVec3::ZERO, offsets }));
        let far = near.map(|point| point + DVec3::splat(5e6));
        let Relative { origin, offsets } = split(&far).unwrap();
        for (point, offset) in far.iter().zip(&offsets) {
            assert!((origin + offset.as_dvec3()).distance(*point) < 1e-6);
        }
    }

    #[test]
    fn ba19_coordinates_beyond_f32_are_named() {
        assert_eq!(split(&[DVec3::ZERO, DVec3::new(1e308, 0.0, 0.0)]), Err(1));
        assert_eq!(split(&[DVec3::splat(-1e308), DVec3::splat(1e308)]), Err(0));
        let alone = Relative { origin: DVec3::splat(1e308), offsets: vec![Vec3::ZERO] };
        assert_eq!(split(&[DVec3::splat(1e308)]), Ok(alone));
        assert_eq!(split(&[DVec3::ZERO, DVec3::NAN]), Err(1));
    }

    #[test]
    fn scaling_by_a_power_of_two_scales_the_result() {
        let points = [DVec3::new(9.0, 1.25, 3.5), DVec3::new(9.5, 1.0, 3.0)];
        let one = split(&points).unwrap();
        let scaled = split(&points.map(|point| point * 1024.0)).unwrap();
        assert_eq!(scaled.origin, one.origin * 1024.0);
        assert_eq!(scaled.offsets, one.offsets.iter().map(|offset| *offset * 1024.0).collect::<Vec<_>>());
    }
}
