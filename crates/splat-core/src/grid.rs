//! Regular volumes.

use crate::Error;
use glam::{DMat3, DVec3};

/// A volume of scalars on a regular lattice, x fastest.
///
/// Lattice point (i, j, k) lies at `origin + axes · (i, j, k)`, world units of the file.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// Position of lattice point (0, 0, 0).
    pub origin: DVec3,
    /// Columns: the steps along i, j and k. A sheared or mirrored lattice is allowed, a flat one is not.
    pub axes: DMat3,
    /// Lattice points along i, j and k.
    pub dims: [usize; 3],
    /// Values, `dims` product many.
    pub values: Vec<f32>,
}

impl Grid {
    /// Value at lattice point (i, j, k), each clamped to the lattice.
    pub fn at_clamped(&self, i: isize, j: isize, k: isize) -> f32 {
        let c = |v: isize, n: usize| v.clamp(0, n as isize - 1) as usize;
        self.values[(c(k, self.dims[2]) * self.dims[1] + c(j, self.dims[1])) * self.dims[0] + c(i, self.dims[0])]
    }

    /// World position of lattice point (i, j, k).
    pub fn position(&self, i: usize, j: usize, k: usize) -> DVec3 {
        self.origin + self.axes * DVec3::new(i as f64, j as f64, k as f64)
    }

    /// Volume of one lattice cell, world units³, > 0.
    pub fn cell_volume(&self) -> f64 {
        self.axes.determinant().abs()
    }

    /// Checks dimensions against the values, finite values and a lattice that spans space.
    ///
    /// # Errors
    /// [`Error::Invalid`] or [`Error::ColumnLength`] for the first that does not hold.
    pub fn validate(&self) -> Result<(), Error> {
        let expected = self.dims.iter().try_fold(1usize, |n, &d| n.checked_mul(d));
        if expected != Some(self.values.len()) || self.values.is_empty() {
            return Err(Error::invalid("grid", 0, "dims", self.dims, "as many lattice points as values, at least one"));
        }
        let volume = self.cell_volume();
        if !(volume.is_finite() && volume > 0.0 && self.origin.is_finite()) {
            return Err(Error::invalid("grid", 0, "axes", self.axes, "three finite steps that span space"));
        }
        if let Some(i) = self.values.iter().position(|v| !v.is_finite()) {
            return Err(Error::invalid("voxel", i, "value", self.values[i], "a finite number"));
        }
        Ok(())
    }
}
