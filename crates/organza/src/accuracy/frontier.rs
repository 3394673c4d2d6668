//! The frontier: settings that nothing more accurate comes near in time.
//!
//! From the most accurate on, a setting is on the frontier if it is faster than the last one on it by more than times can
//! be told apart. That ratio follows from the spread of the repeats, rounded up to one of a few values: so noise neither
//! adds points that are only luckily faster, nor moves the ratio between two runs.

use reference::statistics::median_with_spread;

/// Ratios of times that a report may call different.
const RATIOS: [f64; 4] = [1.1, 1.25, 1.5, 2.0];

/// A setting that may be on the frontier.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Candidate {
    /// What it is known by.
    pub id: usize,
    /// Its error, > 0.
    pub error: f64,
    /// Median of its times, seconds.
    pub seconds: f64,
}

/// The least of a few ratios by which two medians must differ to be called different: 1 plus six times the median over
/// all settings of the relative median deviation of their repeats. That is about four standard deviations of one repeat;
/// a repeat that something disturbed does not move it.
pub fn significant_ratio(repeats: &[Vec<f64>]) -> f64 {
    let noise = |times: &Vec<f64>| {
        let middle = median_with_spread(times).filter(|s| times.len() > 1 && s.median > 0.0)?.median;
        let deviations: Vec<f64> = times.iter().map(|t| (t - middle).abs() / middle).collect();
        median_with_spread(&deviations).map(|s| s.median)
    };
    let all: Vec<f64> = repeats.iter().filter_map(noise).collect();
    let wanted = 1.0 + 6.0 * median_with_spread(&all).map_or(0.0, |s| s.median);
    RATIOS.into_iter().find(|r| *r >= wanted).unwrap_or(RATIOS[RATIOS.len() - 1])
}

/// Ids of the frontier, from the most accurate to the fastest.
pub fn frontier(candidates: &[Candidate], ratio: f64) -> Vec<usize> {
    let mut sorted: Vec<&Candidate> = candidates.iter().filter(|c| c.seconds > 0.0 && c.error.is_finite()).collect();
    sorted.sort_by(|a, b| a.error.total_cmp(&b.error).then(a.seconds.total_cmp(&b.seconds)).then(a.id.cmp(&b.id)));
    let mut fastest = f64::INFINITY;
    let mut on_it = Vec::new();
    for c in sorted {
        if c.seconds * ratio < fastest || on_it.is_empty() {
            fastest = c.seconds;
            on_it.push(c.id);
        }
    }
    on_it
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::rng::unit;

    fn candidate(id: usize, error: f64, seconds: f64) -> Candidate {
        Candidate { id, error, seconds }
    }

    #[test]
    fn only_what_is_faster_than_all_that_is_better() {
        let all = [
            candidate(0, 1e-4, 10.0),
            candidate(1, 2e-4, 9.8),
            candidate(2, 1e-3, 4.0),
            candidate(3, 2e-3, 5.0),
            candidate(4, 1e-2, 1.0),
        ];
        assert_eq!(frontier(&all, 1.05), [0, 2, 4]);
        assert_eq!(frontier(&all, 1.01), [0, 1, 2, 4]);
        assert_eq!(frontier(&[], 1.05), [0usize; 0]);
    }

    #[test]
    fn the_ratio_follows_the_noise_in_steps() {
        assert_eq!(significant_ratio(&[vec![1.0, 1.0, 1.0]]), 1.1);
        // Median 1.02, median deviation 0.03.
        assert_eq!(significant_ratio(&[vec![1.0, 1.1, 1.05, 1.02, 0.98]]), 1.25);
        assert_eq!(significant_ratio(&[vec![1.0, 9.0]]), 2.0);
        assert_eq!(significant_ratio(&[vec![1.0]]), 1.1);
    }

    /// Forty settings like those of a report: many near one time (their knob is cheap), the rest spread over a decade.
    fn rerun(run: u64) -> (Vec<Candidate>, Vec<Vec<f64>>) {
        let mut repeats = Vec::new();
        let of = |id: usize| {
            let u = |k| unit(11, 0, id as u64, k);
            let error = 10f64.powf(-4.0 + 2.5 * u(0));
            let seconds = if id.is_multiple_of(2) { 1.0 } else { 10f64.powf(-0.5 + u(1)) };
            let time = |r: u64| {
                // Sums of four uniform numbers: a deviation of 3 %, and now and then a repeat that was disturbed.
                let noise: f64 = (0..4).map(|j| unit(run, r, id as u64, j) - 0.5).sum();
                let disturbed = if unit(run, r, id as u64, 9) < 0.05 { 1.5 } else { 1.0 };
                seconds * disturbed * (1.0 + 0.052 * noise)
            };
            let times: Vec<f64> = (0..5).map(time).collect();
            let median = median_with_spread(&times).unwrap().median;
            repeats.push(times);
            candidate(id, error, median)
        };
        let candidates = (0..40).map(of).collect();
        (candidates, repeats)
    }

    #[test]
    fn a_rerun_gives_the_same_frontier_in_nine_of_ten_points() {
        let run = |seed| {
            let (candidates, repeats) = rerun(seed);
            frontier(&candidates, significant_ratio(&repeats))
        };
        let (mut same, mut all, mut thin) = (0, 0, usize::MAX);
        for pair in 0..100 {
            let (a, b) = (run(2 * pair), run(2 * pair + 1));
            same += a.iter().filter(|id| b.contains(id)).count();
            all += a.len().max(b.len());
            thin = thin.min(a.len());
        }
        assert!(same as f64 >= 0.9 * f64::from(all as u32), "{same} of {all}");
        assert!(thin >= 2, "a frontier of {thin} points proves nothing");
    }
}
