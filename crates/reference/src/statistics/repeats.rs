//! Means of random repeats and medians of timings.

use super::student_t_95;

/// A mean and how well it is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mean {
    /// Arithmetic mean.
    pub mean: f64,
    /// Half of the 95 % confidence interval (Student's t).
    pub half_width: f64,
}

/// Mean and 95 % confidence interval of independent repeats; `None` for fewer than two.
pub fn mean_with_interval(values: &[f64]) -> Option<Mean> {
    if values.len() < 2 {
        return None;
    }
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
    Some(Mean { mean, half_width: student_t_95(values.len() - 1) * (variance / n).sqrt() })
}

/// Where the middle of some timings lies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// The median: a repeat that something disturbed does not move it.
    pub median: f64,
    /// The least.
    pub min: f64,
    /// The largest.
    pub max: f64,
}

/// Median, least and largest; `None` for none.
pub fn median_with_spread(values: &[f64]) -> Option<Spread> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    let min = *sorted.first()?;
    let max = *sorted.last()?;
    let median = if sorted.len() % 2 == 1 { sorted[middle] } else { 0.5 * (sorted[middle - 1] + sorted[middle]) };
    Some(Spread { median, min, max })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_and_interval_by_hand() {
        // Mean 3, s² = 2.5, t(4) = 2.776.
        let m = mean_with_interval(&[1.0, 2.0, 3.0, 4.0, 5.0]).unwrap();
        assert!((m.mean - 3.0).abs() < 1e-12 && (m.half_width - 2.776_445 * 0.5f64.sqrt()).abs() < 1e-5);
        assert_eq!(mean_with_interval(&[1.0]), None);
    }

    #[test]
    fn the_interval_covers_the_mean_as_often_as_it_says() {
        let covered = (0..2000u64)
            .filter(|&trial| {
                // Sums of twelve uniform numbers: nearly normal around 6.
                let value = |k| (0..12).map(|j| splat_core::rng::unit(5, trial, k, j)).sum::<f64>();
                let m = mean_with_interval(&(0..5).map(value).collect::<Vec<_>>()).unwrap();
                (m.mean - 6.0).abs() < m.half_width
            })
            .count();
        // 1900 expected, a deviation of 9.7.
        assert!((1860..=1940).contains(&covered), "{covered}");
    }

    #[test]
    fn median_of_odd_even_and_none() {
        let spread = median_with_spread(&[3.0, 9.0, 1.0]).unwrap();
        assert_eq!(spread, Spread { median: 3.0, min: 1.0, max: 9.0 });
        assert_eq!(median_with_spread(&[4.0, 1.0, 2.0, 100.0]).unwrap().median, 3.0);
        assert_eq!(median_with_spread(&[]), None);
    }
}
