//! Opacity ↔ number of particles (Tanaka 2012, Eq. 1), both ways, without cancellation.
//!
//! α = 1 − (1 − q)^n, q = min(1, s/(S·cos θ))
//!
//! | symbol | meaning |
//! |---|---|
//! | s | cross-section of a particle: the area of one pixel at the particle, across the ray |
//! | S | area of the surface on which the n particles of one set lie |
//! | θ | angle between the ray and the normal |
//! | q | probability that one particle falls on the pixel |
//! | τ | optical depth −ln(1 − α) |
//!
//! The paper prints s/S cos θ. Read from left to right, the opacity would fall at grazing angles; it means s/(S cos θ).
//! A fractional n becomes a whole number in each set by a rounding that keeps the **opacity** in the mean, not the
//! number: with m + 1 particles in the share f = (1 − (1 − q)^frac)/q of the sets and m in the others,
//! E\[(1 − q)^n\] = (1 − q)^m·(1 − f·q) = (1 − q)^(m + frac).
//!
//! Where the number of particles is a Poisson variable of mean μ, P(no hit) = e^(−μq): then μ = τ/q.

use splat_core::optics;

/// Below this cosine a surface is seen on edge; any q is then 1.
const TINY_COSINE: f64 = 1e-300;

/// q: the probability that a particle, uniform over the area `area`, falls on a given pixel. The pixel's area at the
/// surface is `cross_section`, seen at `cos_theta` to the normal. In \[0, 1\] for any input; 1 for an area of
/// nothing.
pub fn hit_probability(cross_section: f64, area: f64, cos_theta: f64) -> f64 {
    let q = cross_section / (area.max(0.0) * cos_theta.abs().max(TINY_COSINE));
    // 0/0 has no extent at all: certain to be hit by the pixel that holds it.
    if q.is_nan() { 1.0 } else { q.clamp(0.0, 1.0) }
}

/// α of `n` particles of hit probability `q`; exact for q → 0 and n → ∞.
pub fn opacity(n: f64, q: f64) -> f64 {
    if n <= 0.0 || q <= 0.0 {
        return 0.0;
    }
    -libm::expm1(n * libm::log1p(-q.min(1.0)))
}

/// n for opacity `alpha` at hit probability `q`: 0 for α ≤ 0, +∞ for α ≥ 1, which asks for the opaque path
/// (see [`crate::Scene::occluder`]), and 1 for q = 1 and any α between, to be rounded by [`whole_count`].
pub fn count(alpha: f64, q: f64) -> f64 {
    if alpha <= 0.0 || q <= 0.0 {
        0.0
    } else if alpha >= 1.0 {
        f64::INFINITY
    } else if q >= 1.0 {
        // One particle is enough; the share of sets that have it is α.
        alpha
    } else {
        libm::log1p(-alpha) / libm::log1p(-q)
    }
}

/// A whole number of particles for one set from the fractional `n`, which must be finite: the mean of (1 − q)^N over
/// uniform `u` in (0, 1) is (1 − q)^n. For q ≥ 1 the mean of N is n.
pub fn whole_count(n: f64, q: f64, u: f64) -> u64 {
    let floor = n.max(0.0).floor();
    let fraction = n.max(0.0) - floor;
    let share = if q > 0.0 && q < 1.0 { -libm::expm1(fraction * libm::log1p(-q)) / q } else { fraction };
    floor as u64 + u64::from(u < share)
}

/// Optical depth that gives opacity `alpha`, at most `cap`: what an opaque surface is sampled with when it is not drawn
/// by [`crate::Scene::occluder`]. At the default cap of 16, one pixel in nine million stays open in a set.
pub fn capped_optical_depth(alpha: f64, cap: f64) -> f64 {
    optics::optical_depth(alpha.clamp(0.0, 1.0)).min(cap)
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::rng;

    #[test]
    fn pb01_small_shares_and_large_counts_keep_their_opacity() {
        assert!((opacity(1e8, 1e-8) - 0.632_120_558_828_557_7).abs() < 1e-8);
        for q in [1e-12, 1e-8, 1e-3, 0.1, 0.9] {
            for alpha in [1e-9, 1e-3, 0.1, 0.5, 0.9, 1.0 - 1e-9] {
                let back = opacity(count(alpha, q), q);
                assert!((back / alpha - 1.0).abs() < 1e-5, "q {q} α {alpha}: {back}");
            }
        }
    }

    #[test]
    fn pb02_opaque_and_clear_are_exact() {
        assert_eq!(count(1.0, 1e-6), f64::INFINITY);
        assert!(count(1.0 - 1e-9, 1e-6).is_finite());
        assert_eq!(count(0.0, 1e-6), 0.0);
        assert_eq!(opacity(f64::INFINITY, 1e-6), 1.0);
        assert_eq!(opacity(0.0, 1.0), 0.0);
        assert_eq!(whole_count(0.0, 0.5, 1e-9), 0);
    }

    #[test]
    fn pb03_fractional_counts_keep_the_opacity_in_the_mean() {
        for (alpha, q) in [(1e-3, 0.1), (0.01, 0.5), (0.3, 0.9), (0.7, 0.2)] {
            const SETS: u64 = 400_000;
            let n = count(alpha, q);
            let hit = |set| {
                let k = whole_count(n, q, rng::unit(1, 2, set, 0));
                1.0 - f64::powi(1.0 - q, k as i32)
            };
            let values: Vec<f64> = (0..SETS).map(hit).collect();
            let mean = values.iter().sum::<f64>() / SETS as f64;
            let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / SETS as f64;
            let sigma = (variance / SETS as f64).sqrt();
            assert!((mean - alpha).abs() < 4.0 * sigma, "α {alpha} q {q}: {mean} ± {sigma}");
        }
    }

    #[test]
    fn pb04_opacity_stays_in_range_for_any_area() {
        for area in [0.0, 1e-300, 0.5, 1.0, 1e300, f64::INFINITY] {
            for n in [0.0, 0.5, 1.5, 2.0, 1e12, f64::INFINITY] {
                let alpha = opacity(n, hit_probability(1.0, area, 1.0));
                assert!((0.0..=1.0).contains(&alpha), "S {area} n {n}: {alpha}");
            }
        }
        assert_eq!(opacity(1.5, hit_probability(1.5, 1.0, 1.0)), 1.0);
    }

    #[test]
    fn pb05_grazing_angles_grow_opaque() {
        let mut last = 0.0;
        for k in 0..=1000 {
            let cosine = 1.0 - f64::from(k) / 1000.0;
            let alpha = opacity(100.0, hit_probability(1e-3, 1.0, cosine));
            assert!(alpha >= last && alpha <= 1.0, "cos {cosine}: {alpha} after {last}");
            last = alpha;
        }
        assert_eq!(last, 1.0);
        assert_eq!(hit_probability(0.0, 0.0, 0.0), 1.0);
    }
}
