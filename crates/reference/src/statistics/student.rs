//! Student's t distribution, by its closed form for whole degrees of freedom.

use std::f64::consts::PI;

/// The t that a Student variable with `degrees` ≥ 1 degrees of freedom stays within, on both sides, with a probability of
/// 95 %.
pub fn student_t_95(degrees: usize) -> f64 {
    // The normal limit is 1.96, one degree of freedom 12.7.
    let mut low = 1.9;
    let mut high = 13.0;
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if probability_within(middle, degrees.max(1)) < 0.95 { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// P(|T| < t); M. Abramowitz, I. Stegun, *Handbook of Mathematical Functions*, 26.7.3 and 26.7.4.
fn probability_within(t: f64, degrees: usize) -> f64 {
    let theta = (t / (degrees as f64).sqrt()).atan();
    let sin = theta.sin();
    let cos_sq = theta.cos() * theta.cos();
    let odd = degrees % 2 == 1;
    // Σ of products of (k − 1)/k or k/(k + 1) times cos².
    let mut term = 1.0;
    let mut sum = 1.0;
    let mut k = if odd { 3 } else { 2 };
    while k < degrees {
        term *= (k - 1) as f64 / k as f64 * cos_sq;
        sum += term;
        k += 2;
    }
    match (odd, degrees) {
        (true, 1) => 2.0 * theta / PI,
        (true, _) => 2.0 / PI * (theta + sin * theta.cos() * sum),
        (false, _) => sin * sum,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn published_values() {
        // Abramowitz and Stegun, Table 26.10, A = 0.95.
        for (degrees, t) in
            [(1, 12.706), (2, 4.303), (3, 3.182), (4, 2.776), (5, 2.571), (9, 2.262), (10, 2.228), (30, 2.042)]
        {
            assert!((student_t_95(degrees) - t).abs() < 6e-4, "{degrees}: {}", student_t_95(degrees));
        }
        assert!((student_t_95(100_000) - 1.95996).abs() < 1e-4);
    }
}
