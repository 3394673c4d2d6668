//! The quadratic B-spline of the blend: w(x) = b(3|y|/2), y = (x − center)/R; b(t) = 3/4 − t² up to 1/2, (3/2 − t)²/2 up
//! to 3/2. In r = |y|: 3/4 − 9r²/4 up to 1/3, 9(1 − r)²/8 up to 1.

use splat_core::glam::{DMat3, DVec3};

/// r² where the two parabolas meet.
const INNER: f64 = 1.0 / 9.0;

/// Weight at squared distance `r2` ≥ 0.
#[inline]
pub(super) fn weight(r2: f64) -> f64 {
    if r2 < INNER {
        return 0.75 - 2.25 * r2;
    }
    let rest = (1.0 - r2.sqrt()).max(0.0);
    1.125 * rest * rest
}

/// Weight w and g with ∇w = g·y, for `r2` < 1.
#[inline]
pub(super) fn weight_slope(r2: f64) -> (f64, f64) {
    if r2 < INNER {
        return (0.75 - 2.25 * r2, -4.5);
    }
    let r = r2.sqrt();
    let rest = 1.0 - r;
    (1.125 * rest * rest, -2.25 * rest / r)
}

/// Hessian of the weight, for |y| < 1.
pub(super) fn weight_hessian(y: DVec3) -> DMat3 {
    let r2 = y.length_squared();
    if r2 < INNER {
        return DMat3::from_diagonal(DVec3::splat(-4.5));
    }
    let r = r2.sqrt();
    let outer = DMat3::from_cols(y * y.x, y * y.y, y * y.z);
    DMat3::from_diagonal(DVec3::splat(2.25 - 2.25 / r)) + outer * (2.25 / (r2 * r))
}

/// Largest |∇w| for r in `low` ..= `high`.
pub(super) fn steepest(low: f64, high: f64) -> f64 {
    let slope = |r: f64| if r < 1.0 / 3.0 { 4.5 * r } else { 2.25 * (1.0 - r).max(0.0) };
    if low <= 1.0 / 3.0 && high >= 1.0 / 3.0 { 1.5 } else { slope(low).max(slope(high)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_and_hessians_are_those_of_the_weight() {
        let h = 1e-5;
        for r in [0.1, 0.3, 0.36, 0.7, 0.95] {
            let y = DVec3::new(0.6, -0.48, 0.64) * r;
            let (w, g) = weight_slope(y.length_squared());
            assert!((w - weight(y.length_squared())).abs() < 1e-15);
            assert!((g * y).length() <= steepest(r - 0.01, r + 0.01));
            for a in 0..3 {
                let d = DVec3::AXES[a] * h;
                let slope = (weight((y + d).length_squared()) - weight((y - d).length_squared())) / (2.0 * h);
                assert!((slope - g * y[a]).abs() < 1e-8);
                let gradient = |y: DVec3| y * weight_slope(y.length_squared()).1;
                let bend = (gradient(y + d) - gradient(y - d)) / (2.0 * h);
                assert!((bend - weight_hessian(y).col(a)).length() < 1e-7);
            }
        }
        assert_eq!((weight(0.0), weight(1.0), weight(4.0)), (0.75, 0.0, 0.0));
    }
}
