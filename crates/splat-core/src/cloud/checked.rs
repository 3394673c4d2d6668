//! What every cloud promises.

use crate::{Cloud, Error, SplatKind};
use glam::Vec3;

impl Cloud {
    /// Checks every promise that the stages rely on: equal column lengths, finite values, radii > 0, K ≥ 0, unit or
    /// zero normals, coefficients in \[0, 1\].
    ///
    /// # Errors
    /// [`Error::ColumnLength`], or [`Error::Invalid`] for the first splat that breaks a promise.
    pub fn validate(&self) -> Result<(), Error> {
        self.check_lengths()?;
        let bad = |i, attribute, found: String, expected| {
            Err(Error::Invalid { element: "splat", index: i, attribute, found, expected })
        };
        if !self.origin.is_finite() {
            return Err(Error::invalid("cloud", 0, "origin", self.origin, "finite numbers"));
        }
        for i in 0..self.len() {
            let s = self.get(i);
            if !s.position.is_finite() {
                return bad(i, "position", s.position.to_string(), "finite numbers");
            }
            if !(s.radius.is_finite() && s.radius > 0.0) {
                return bad(i, "radius", s.radius.to_string(), "a finite number > 0");
            }
            if !(s.cross_section.is_finite() && s.cross_section >= 0.0) {
                return bad(i, "cross_section", s.cross_section.to_string(), "a finite number ≥ 0");
            }
            if !s.color.iter().all(|c| c.is_finite() && *c >= 0.0) {
                return bad(i, "color", format!("{:?}", s.color), "three finite numbers ≥ 0");
            }
            for (attribute, n) in [("normal", s.normal), ("shading_normal", s.shading_normal)] {
                if !(n == Vec3::ZERO || (n.length_squared() - 1.0).abs() < 1e-3) {
                    return bad(i, attribute, n.to_string(), "a unit vector, or zero for none");
                }
            }
            if s.kind != SplatKind::Medium && s.normal == Vec3::ZERO {
                return bad(i, "normal", s.normal.to_string(), "a unit vector, as for every surface splat");
            }
            if !s.tangent.is_finite() {
                return bad(i, "tangent", s.tangent.to_string(), "finite numbers");
            }
            if !(0.0..=1.0).contains(&s.shadow_coefficient) {
                return bad(i, "shadow_coefficient", s.shadow_coefficient.to_string(), "a number in [0, 1]");
            }
            if !(s.crossing_depth.is_finite() && s.crossing_depth >= 0.0) {
                return bad(i, "crossing_depth", s.crossing_depth.to_string(), "a finite number ≥ 0");
            }
            if !s.value.is_finite() {
                return bad(i, "value", s.value.to_string(), "a finite number");
            }
        }
        self.check_gaussians()
    }
}
