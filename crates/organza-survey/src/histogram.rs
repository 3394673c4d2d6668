//! How often which values occur.

use rayon::prelude::*;

/// Values counted together before counts are added.
const CHUNK: usize = 1 << 16;

/// Counts of values in bins of equal width; values outside count in the outer bins, and those that are NaN nowhere.
#[derive(Debug, Clone, PartialEq)]
pub struct Histogram {
    /// Lower end of the first bin.
    pub low: f64,
    /// Upper end of the last bin.
    pub high: f64,
    /// Values in each bin.
    pub counts: Vec<u64>,
}

impl Histogram {
    /// Of values between `range`, which has a width.
    pub fn new(values: &[f32], range: [f64; 2], bins: usize) -> Self {
        let [low, high] = range;
        let scale = bins as f64 / (high - low);
        let bin = |v: f32| (((f64::from(v) - low) * scale).max(0.0) as usize).min(bins - 1);
        let count = |part: &[f32]| {
            let mut counts = vec![0u64; bins];
            part.iter().filter(|v| !v.is_nan()).for_each(|v| counts[bin(*v)] += 1);
            counts
        };
        let sum = |mut a: Vec<u64>, b: Vec<u64>| {
            a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
            a
        };
        let counts = values.par_chunks(CHUNK).map(count).reduce(|| vec![0; bins], sum);
        Self { low, high, counts }
    }

    /// Values in all.
    pub fn total(&self) -> u64 {
        self.counts.iter().sum()
    }

    /// Middle of a bin.
    pub fn middle(&self, bin: usize) -> f64 {
        self.low + (bin as f64 + 0.5) * self.width()
    }

    /// Width of a bin.
    pub fn width(&self) -> f64 {
        (self.high - self.low) / self.counts.len() as f64
    }

    /// The bin of a value.
    pub(crate) fn bin(&self, value: f64) -> usize {
        (((value - self.low) / self.width()).max(0.0) as usize).min(self.counts.len() - 1)
    }

    /// The value below which a share of all values lies, to the width of a bin.
    pub fn quantile(&self, share: f64) -> f64 {
        let threshold = share * self.total() as f64;
        let mut below = 0.0;
        for (bin, count) in self.counts.iter().enumerate() {
            let with = below + *count as f64;
            if *count > 0 && with >= threshold {
                let part = ((threshold - below) / *count as f64).clamp(0.0, 1.0);
                return self.low + (bin as f64 + part) * self.width();
            }
            below = with;
        }
        self.high
    }

    /// The value that parts the bins from `first` on into the two classes of least variance (Otsu 1979).
    pub(crate) fn parting(&self, bins: std::ops::Range<usize>) -> f64 {
        let part = &self.counts[bins.clone()];
        let total: f64 = part.iter().map(|c| *c as f64).sum();
        let moment: f64 = part.iter().enumerate().map(|(i, c)| i as f64 * *c as f64).sum();
        let mut weight = 0.0;
        let mut sum = 0.0;
        let mut best = (0.0, 0.0, 0usize);
        for (i, count) in part.iter().enumerate() {
            weight += *count as f64;
            sum += i as f64 * *count as f64;
            let rest = total - weight;
            if weight == 0.0 || rest <= 0.0 {
                continue;
            }
            let between = weight * rest * (sum / weight - (moment - sum) / rest).powi(2);
            // Empty bins between two classes part them equally well: the middle of them is taken.
            match between.total_cmp(&best.0) {
                std::cmp::Ordering::Greater => best = (between, i as f64, 1),
                std::cmp::Ordering::Equal => best = (between, best.1 + i as f64, best.2 + 1),
                std::cmp::Ordering::Less => {}
            }
        }
        let bin = if best.2 == 0 { 0.0 } else { best.1 / best.2 as f64 };
        self.low + (bins.start as f64 + bin + 1.0) * self.width()
    }
}

/// The value below which a share of some values lies, none of which is NaN; `values` are put in order. 0 without values.
pub(crate) fn quantile_of(values: &mut [f32], share: f64) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let rank = ((values.len() - 1) as f64 * share) as usize;
    f64::from(*values.select_nth_unstable_by(rank, f32::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_of_even_values_are_even() {
        let values: Vec<f32> = (0..1000).map(|i| (i as f32 + 0.5) / 1000.0).collect();
        let histogram = Histogram::new(&values, [0.0, 1.0], 50);
        assert_eq!(histogram.counts, vec![20; 50]);
        for share in [0.1, 0.5, 0.99] {
            assert!((histogram.quantile(share) - share).abs() < 1e-9);
        }
        assert_eq!(quantile_of(&mut values.clone(), 0.5), f64::from(values[499]));
    }

    #[test]
    fn two_heaps_are_parted_between_them() {
        let values: Vec<f32> = (0..500).map(|i| if i % 3 == 0 { 0.8 } else { 0.1 } + (i % 7) as f32 * 0.01).collect();
        let parting = Histogram::new(&values, [0.0, 1.0], 100).parting(0..100);
        assert!((0.2..0.8).contains(&parting), "{parting}");
    }

    #[test]
    fn values_outside_count_at_the_ends() {
        assert_eq!(Histogram::new(&[-5.0, 0.5, 9.0], [0.0, 1.0], 2).counts, [1, 2]);
    }
}
