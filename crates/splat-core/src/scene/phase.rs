//! The phase function of Henyey and Greenstein.

use glam::Vec3;
use std::f32::consts::PI;

/// Henyey-Greenstein phase function, 1/sr; integrates to 1 over the sphere.
///
/// `travel` and `leave` are the unit directions of light before and after scattering, `asymmetry` g the mean cosine
/// between them, in (−1, 1): g > 0 scatters forward. With 1 ∓ cos θ = |travel ∓ leave|²/2 the denominator
/// (1 − |g|)² + 2|g|(1 ∓ cos θ) does not cancel at the peak.
pub fn henyey_greenstein(travel: Vec3, leave: Vec3, asymmetry: f32) -> f32 {
    let g = asymmetry.abs();
    let apart = if asymmetry >= 0.0 { travel - leave } else { travel + leave };
    let d = (1.0 - g) * (1.0 - g) + g * apart.length_squared();
    (1.0 - g) * (1.0 + g) / (4.0 * PI * d * d.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ms5_integrates_to_one_with_mean_cosine_g() {
        for g in [-0.9f32, -0.3, 0.0, 0.5, 0.99, 0.9999, -0.9999] {
            // The angle from the peak is π t³, so that the peak is resolved.
            let n = 400_000;
            let mut total = 0.0f64;
            let mut mean = 0.0f64;
            for i in 0..n {
                let t = (f64::from(i) + 0.5) / f64::from(n);
                let from_peak = std::f64::consts::PI * t.powi(3);
                let theta = if g >= 0.0 { from_peak } else { std::f64::consts::PI - from_peak };
                let sin = from_peak.sin();
                let cos = theta.cos();
                let p = f64::from(henyey_greenstein(Vec3::Z, Vec3::new(sin as f32, 0.0, cos as f32), g));
                let solid_angle = 2.0 * std::f64::consts::PI * sin * std::f64::consts::PI * 3.0 * t * t / f64::from(n);
                total += p * solid_angle;
                mean += p * cos * solid_angle;
            }
            assert!((total - 1.0).abs() < 1e-3, "g {g}: integral {total}");
            assert!((mean - f64::from(g)).abs() < 1e-3, "g {g}: mean cosine {mean}");
        }
    }
}
