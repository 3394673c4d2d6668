//! Scalar fields over space: implicit surfaces and procedural densities.

use glam::{DMat3, DVec3};

/// Step of differences over the size of what they are taken of: the cube root of a rounding, where the error of the difference and
/// that of rounding are alike.
const STEP: f64 = 1.0 / (1u64 << 17) as f64;

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

    /// Hessian at `p`, symmetric. By default central differences of the gradient at 2⁻¹⁷ times the greatest coordinate of `p`, at
    /// the origin of the way to 0 along the gradient: about ten digits where the features of the field are as large as `p` is far
    /// from the origin, fewer where they are much smaller or larger. A field that knows it in closed form gives its own.
    ///
    /// ```
    /// use splat_core::{ScalarField, glam::{DMat3, DVec3}};
    /// struct Ball;
    /// impl ScalarField for Ball {
    ///     fn value(&self, p: DVec3) -> f64 { p.length_squared() - 1.0 }
    ///     fn gradient(&self, p: DVec3) -> DVec3 { 2.0 * p }
    ///     fn bound(&self, _: DVec3, _: f64) -> Option<(f64, f64)> { None }
    /// }
    /// let hessian = Ball.hessian(DVec3::new(0.6, 0.0, 0.8));
    /// assert!(hessian.abs_diff_eq(2.0 * DMat3::IDENTITY, 1e-9));
    /// ```
    fn hessian(&self, p: DVec3) -> DMat3 {
        let way_to_zero = || {
            let (value, gradient) = self.value_gradient(p);
            let way = value.abs() / gradient.length();
            if way.is_finite() && way > 0.0 { way } else { 1.0 }
        };
        let size = p.abs().max_element();
        let step = STEP * if size > 0.0 { size } else { way_to_zero() };
        let along = |axis: DVec3| (self.gradient(p + axis * step) - self.gradient(p - axis * step)) * (0.5 / step);
        let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z].map(along);
        let slopes = DMat3::from_cols(x, y, z);
        (slopes + slopes.transpose()) * 0.5
    }

    /// An interval that contains every value within `radius` of `p`, or `None` where no bound is known.
    fn bound(&self, p: DVec3, radius: f64) -> Option<(f64, f64)>;

    /// A bound of |f(a) − f(b)| over |a − b| for places within `radius` of `p`, and so of |∇f| there; `None` where none is known. Where
    /// many lines of a small ball are searched, one such bound tells of most of them what [`ScalarField::bound`] would.
    ///
    /// ```
    /// use splat_core::{ScalarField, glam::DVec3};
    /// struct Ball;
    /// impl ScalarField for Ball {
    ///     fn value(&self, p: DVec3) -> f64 { p.length_squared() - 1.0 }
    ///     fn gradient(&self, p: DVec3) -> DVec3 { 2.0 * p }
    ///     fn bound(&self, _: DVec3, _: f64) -> Option<(f64, f64)> { None }
    ///     fn steepest(&self, p: DVec3, radius: f64) -> Option<f64> { Some(2.0 * (p.length() + radius)) }
    /// }
    /// // From 0.21 in the middle of the ball to 0 is farther than the ball reaches.
    /// assert!(Ball.value(DVec3::X * 1.1) > Ball.steepest(DVec3::X * 1.1, 0.08).unwrap() * 0.08);
    /// ```
    fn steepest(&self, _p: DVec3, _radius: f64) -> Option<f64> {
        None
    }

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng;

    /// exp(x·y) + sin z, scaled in space.
    struct Wave(f64);

    impl Wave {
        fn own_hessian(&self, p: DVec3) -> DMat3 {
            let q = p / self.0;
            let e = (q.x * q.y).exp();
            let mixed = e * (1.0 + q.x * q.y);
            DMat3::from_cols_array(&[q.y * q.y * e, mixed, 0.0, mixed, q.x * q.x * e, 0.0, 0.0, 0.0, -q.z.sin()])
                * (1.0 / (self.0 * self.0))
        }
    }

    impl ScalarField for Wave {
        fn value(&self, p: DVec3) -> f64 {
            let q = p / self.0;
            (q.x * q.y).exp() + q.z.sin()
        }

        fn gradient(&self, p: DVec3) -> DVec3 {
            let q = p / self.0;
            let e = (q.x * q.y).exp();
            DVec3::new(q.y * e, q.x * e, q.z.cos()) / self.0
        }

        fn bound(&self, _: DVec3, _: f64) -> Option<(f64, f64)> {
            None
        }
    }

    #[test]
    fn differences_give_the_hessian_at_any_scale() {
        for scale in [1e-9, 1.0, 1e6] {
            let wave = Wave(scale);
            for i in 0..500 {
                let p = DVec3::from_array([0, 1, 2].map(|a| rng::unit(5, 0, i, a) * 4.0 - 2.0)) * scale;
                let largest = |m: DMat3| m.to_cols_array().into_iter().fold(0.0, |most: f64, e| most.max(e.abs()));
                let found = wave.hessian(p);
                let exact = wave.own_hessian(p);
                let error = largest(found - exact) / largest(exact);
                assert!(error < 2e-9, "{p} at {scale}: {error:e}");
            }
            // At the origin nothing but the field's own size is known.
            let error = wave.hessian(DVec3::ZERO) - wave.own_hessian(DVec3::ZERO);
            assert!((error * (scale * scale)).abs_diff_eq(DMat3::ZERO, 1e-8), "{scale}: {error}");
        }
    }
}
