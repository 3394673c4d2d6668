//! Scalar fields over space: implicit surfaces and procedural densities.

use glam::{DMat3, DVec3};

/// A scalar field; a surface is its zero set, negative inside.
pub trait ScalarField: Sync {
    /// Value at `p`.
    fn value(&self, p: DVec3) -> f64;

    /// Gradient at `p`.
    fn gradient(&self, p: DVec3) -> DVec3;

    /// Value and gradient at `p` together, for fields that know both for little more than one.
    fn value_gradient(&self, p: DVec3) -> (f64, DVec3) {
        (self.value(p), self.gradient(p))
    }

    /// Value and gradient at each of some places, for fields that do several at once for less; `out` is as long as `at`.
    fn value_gradients(&self, at: &[DVec3], out: &mut [(f64, DVec3)]) {
        at.iter().zip(out).for_each(|(p, out)| *out = self.value_gradient(*p));
    }

    /// Hessian at `p`, symmetric.
    fn hessian(&self, p: DVec3) -> DMat3;

    /// An interval that contains every value within `radius` of `p`, or `None` where no bound is known.
    fn bound(&self, p: DVec3, radius: f64) -> Option<(f64, f64)>;

    /// Whether a zero at `p` belongs to the surface: false beyond the border of an open surface. The field itself has
    /// values there too.
    fn in_domain(&self, _p: DVec3) -> bool {
        true
    }

    /// Whether some place within `radius` of `p` may be in the domain; false only where surely none is.
    fn may_be_in_domain(&self, _p: DVec3, _radius: f64) -> bool {
        true
    }
}
