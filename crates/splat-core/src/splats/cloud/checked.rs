//! What every cloud promises.

use crate::{Cloud, Error, Splat, SplatKind};
use glam::Vec3;
use rayon::prelude::*;

/// Splats that are looked at by one task.
const CHUNK: usize = 8192;

impl Cloud {
    /// Checks every promise that the stages rely on: equal column lengths, finite values, radii > 0, K ≥ 0, unit or
    /// zero normals, coefficients in \[0, 1\].
    ///
    /// # Errors
    /// [`Error::ColumnLength`], or [`Error::Invalid`] for the first splat that breaks a promise.
    pub fn validate(&self) -> Result<(), Error> {
        self.check_lengths()?;
        if !self.origin.is_finite() {
            return Err(Error::invalid("cloud", 0, "origin", self.origin, "finite numbers"));
        }
        let unfit = |index: usize| {
            let Unfit { attribute, found, expected } = self.get(index).check().err()?;
            Some(Error::Invalid { element: "splat", index, attribute, found, expected })
        };
        let first = (0..self.len()).into_par_iter().with_min_len(CHUNK).find_map_first(unfit);
        first.map_or_else(|| self.check_gaussians(), Err)
    }
}

/// What is wrong with an attribute of a splat.
#[derive(Debug, Clone, PartialEq)]
pub struct Unfit {
    /// Its name.
    pub attribute: &'static str,
    /// The value, printed.
    pub found: String,
    /// The accepted range, in words.
    pub expected: &'static str,
}

impl Splat {
    /// Checks what a cloud promises of each of its splats.
    ///
    /// # Errors
    /// The first attribute that breaks a promise.
    pub fn check(&self) -> Result<(), Unfit> {
        let bad = |attribute, found: String, expected| Err(Unfit { attribute, found, expected });
        if !self.position.is_finite() {
            return bad("position", self.position.to_string(), "finite numbers");
        }
        if !(self.radius.is_finite() && self.radius > 0.0) {
            return bad("radius", self.radius.to_string(), "a finite number > 0");
        }
        if !(self.cross_section.is_finite() && self.cross_section >= 0.0) {
            return bad("cross_section", self.cross_section.to_string(), "a finite number ≥ 0");
        }
        if !self.color.iter().all(|c| c.is_finite() && *c >= 0.0) {
            return bad("color", format!("{:?}", self.color), "three finite numbers ≥ 0");
        }
        for (attribute, n) in [("normal", self.normal), ("shading_normal", self.shading_normal)] {
            if !(n == Vec3::ZERO || (n.length_squared() - 1.0).abs() < 1e-3) {
                return bad(attribute, n.to_string(), "a unit vector, or zero for none");
            }
        }
        if self.kind != SplatKind::Medium && self.normal == Vec3::ZERO {
            return bad("normal", self.normal.to_string(), "a unit vector, as for every surface splat");
        }
        if !self.tangent.is_finite() {
            return bad("tangent", self.tangent.to_string(), "finite numbers");
        }
        if !(0.0..=1.0).contains(&self.shadow_coefficient) {
            return bad("shadow_coefficient", self.shadow_coefficient.to_string(), "a number in [0, 1]");
        }
        if !(self.crossing_depth.is_finite() && self.crossing_depth >= 0.0) {
            return bad("crossing_depth", self.crossing_depth.to_string(), "a finite number ≥ 0");
        }
        if !self.value.is_finite() {
            return bad("value", self.value.to_string(), "a finite number");
        }
        Ok(())
    }
}
