//! The phase function of Henyey and Greenstein (1941) in f64: value and sampling, without cancellation for |g| → 1.
//!
//! p = (1 − g²)/(4π·d³), d² = (1 − |g|)² + |g|·|travel ∓ leave|²; sampling inverts the distribution of 1 − cos θ:
//! 1 − cos θ = 2(1 − |g|)²·(1 − u)(1 + |g|u)/h², h = 1 − |g| + 2|g|u, which holds for g = 0 too.

use glam::DVec3;
use std::f64::consts::PI;

/// Phase function, 1/sr, for unit directions of light before and after scattering; its integral over the sphere is 1
/// and its mean cosine is `asymmetry`, in (−1, 1).
pub fn henyey_greenstein(travel: DVec3, leave: DVec3, asymmetry: f64) -> f64 {
    let g = asymmetry.abs();
    let apart = if asymmetry >= 0.0 { travel - leave } else { travel + leave };
    let d = (1.0 - g) * (1.0 - g) + g * apart.length_squared();
    (1.0 - g) * (1.0 + g) / (4.0 * PI * d * d.sqrt())
}

/// A direction distributed as [`henyey_greenstein`], from a point of the open unit square.
pub fn sample_henyey_greenstein(travel: DVec3, asymmetry: f64, u: [f64; 2]) -> DVec3 {
    let g = asymmetry.abs();
    let h = 1.0 - g + 2.0 * g * u[0];
    let versine = 2.0 * (1.0 - g) * (1.0 - g) * (1.0 - u[0]) * (1.0 + g * u[0]) / (h * h);
    let sine = (versine * (2.0 - versine)).max(0.0).sqrt();
    let cosine = if asymmetry >= 0.0 { 1.0 - versine } else { versine - 1.0 };
    around(travel, cosine, sine, u[1])
}

/// The unit direction at (cosine, sine) from unit `axis`, turned by the share `turn` of a circle.
pub(crate) fn around(axis: DVec3, cosine: f64, sine: f64, turn: f64) -> DVec3 {
    let (a, b) = axis.any_orthonormal_pair();
    let (s, c) = (2.0 * PI * turn).sin_cos();
    // Normalised, so that rounding does not grow along paths of thousands of vertices.
    (axis * cosine + (a * c + b * s) * sine).normalize()
}

/// A direction of the cosine-weighted hemisphere around unit `normal`; density cos/π.
pub(crate) fn cosine_hemisphere(normal: DVec3, u: [f64; 2]) -> DVec3 {
    around(normal, (1.0 - u[0]).sqrt(), u[0].sqrt(), u[1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path::random::Stream;

    const ASYMMETRIES: [f64; 8] = [-0.9999, -0.5, 0.0, 1e-9, 0.3, 0.85, 0.99, 0.9999];

    #[test]
    fn ms5_integral_is_one_and_mean_cosine_is_g() {
        for g in ASYMMETRIES {
            let n = 200_000;
            let mut total = 0.0;
            let mut mean = 0.0;
            for i in 0..n {
                let t = (f64::from(i) + 0.5) / f64::from(n);
                let from_peak = PI * t.powi(3);
                let theta = if g >= 0.0 { from_peak } else { PI - from_peak };
                let p = henyey_greenstein(DVec3::Z, DVec3::new(from_peak.sin(), 0.0, theta.cos()), g);
                let solid_angle = 2.0 * PI * from_peak.sin() * PI * 3.0 * t * t / f64::from(n);
                total += p * solid_angle;
                mean += p * theta.cos() * solid_angle;
            }
            assert!((total - 1.0).abs() < 1e-6, "g {g}: integral {total}");
            assert!((mean - g).abs() < 1e-6, "g {g}: mean cosine {mean}");
        }
    }

    #[test]
    fn ms5_samples_have_the_mean_cosine_and_the_density() {
        let travel = DVec3::new(0.48, 0.6, -0.64);
        for g in ASYMMETRIES {
            let n = 100_000;
            let mut rng = Stream::new(5, 1, g.to_bits(), 0);
            let mut sum = 0.0;
            let mut forward = 0;
            // Half of all samples lie within the median angle: u = 1/2 inverted in closed form.
            let a = g.abs();
            let median = (1.0 - a) * (1.0 - a) * (1.0 + 0.5 * a);
            for _ in 0..n {
                let leave = sample_henyey_greenstein(travel, g, rng.pair());
                sum += leave.dot(travel) - g;
                let peak = if g >= 0.0 { travel } else { -travel };
                forward += i32::from(0.5 * (leave - peak).length_squared() < median);
            }
            let n = f64::from(n);
            // The variance of the cosine is (1 − g²)/3; the sample's own would miss the rare far samples.
            let error = ((1.0 - g) * (1.0 + g) / 3.0 / n).sqrt();
            // Two-sided 1e-6 for the mean and for the binomial count: 4.9 standard errors.
            assert!((sum / n).abs() < 4.9 * error, "g {g}: {} ± {error}", sum / n);
            assert!((f64::from(forward) - 0.5 * n).abs() < 4.9 * 0.5 * n.sqrt(), "g {g}: {forward} of {n}");
        }
    }
}
