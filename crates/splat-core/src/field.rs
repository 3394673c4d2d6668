//! Scalar fields over space: implicit surfaces and procedural densities.

use glam::{DMat3, DVec3};

/// A scalar field; a surface is its zero set, negative inside.
pub trait ScalarField: Sync {
    /// Value at `p`.
    fn value(&self, p: DVec3) -> f64;

    /// Gradient at `p`.
    fn gradient(&self, p: DVec3) -> DVec3;

    /// Hessian at `p`, symmetric.
    fn hessian(&self, p: DVec3) -> DMat3;

    /// An interval that contains every value within `radius` of `p`, or `None` where no bound is known.
    fn bound(&self, p: DVec3, radius: f64) -> Option<(f64, f64)>;
}
