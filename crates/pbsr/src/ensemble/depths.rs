//! The distribution of the depths of one pixel's hits: moments, median and first passage, in memory that does not grow with
//! the number of sets.
//!
//! A ray ends at its nearest particle. So over the sets the depths of the hits are samples of the depth of absorption, and sets
//! without a hit are light that passes. Behind an occluder nothing is sampled: the ray ends at its depth. Of L sets
//!
//! - mean and deviation are those of the samples, in steps of a millionth of the depth range: standard error σ/√n for n
//!   hits;
//! - the median, where T = 1/2, is the sample of rank L/2: standard error 1/(2·p·√L), p the density of depth there;
//! - the first depth is the depth at which the opacity passes a = 1/255. Half of all blocks of m sets have their nearest hit
//!   before it, if 1 − (1 − a)^m = 1/2, so m = 176.4. So it is the median of the nearest hits of blocks of
//!   [`BLOCK`] sets: standard error a/√(0.69·a·L)/p, and a bias below that over √(number of blocks). Before one block is whole, it is the nearest hit so far.
//!
//! A rank is found in [`Span`]s: disjoint ranges of depth with the number of samples in each. A sample between all spans
//! begins a new span. When there are too many spans, the two neighbours with the least (samples × length) are merged, first those far from the requested rank. So
//! the rank of each end is exact, a surface is a span without length, and a gap stays empty. Only inside of a span
//! the density of the samples is assumed to be linear, from their mean. (A streaming histogram after Y. Ben-Haim and E. Tom-Tov: *A Streaming Parallel
//! Decision Tree Algorithm*, JMLR 11, 2010, with ranges in place of points.)
//!
//! Spans depend on the order of the samples, which is that of the sets, for any number of threads and any batches.

/// Sets in whose nearest hit is before the first depth as often as behind.
pub(crate) const BLOCK: u32 = 176;

/// Steps of a depth between the two ends of the range.
const STEPS: f32 = 1_048_576.0;

/// Spans of all samples, and of the nearest of each block.
const SPANS: usize = 6;
const BLOCK_SPANS: usize = 4;

/// How much cheaper a span is that lies as far from the rank as the rank from 0, less one.
const FAR: f32 = 30.0;

/// A range of depth that holds samples; of none behind the last.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Span {
    low: f32,
    high: f32,
    mean: f32,
    count: u32,
}

impl Span {
    /// One sample.
    fn from_depth(depth: f32) -> Self {
        Self { low: depth, high: depth, mean: depth, count: 1 }
    }

    /// Two neighbours as one.
    fn with(&self, next: &Self) -> Self {
        let count = self.count.saturating_add(next.count);
        let mean = self.mean + (next.mean - self.mean) * (next.count as f32 / count as f32);
        Self { low: self.low, high: next.high, mean, count }
    }

    /// A sample inside.
    fn add(&mut self, depth: f32) {
        self.count = self.count.saturating_add(1);
        self.mean += (depth - self.mean) / self.count as f32;
    }

    /// The depth before which the share `share` of the samples lies: their density is taken as linear, with their mean.
    fn at(&self, share: f32) -> f32 {
        let length = self.high - self.low;
        if share <= 0.0 || length <= 0.0 {
            return self.low;
        }
        let slope = (6.0 * (self.mean - self.low) / length - 3.0).clamp(-1.0, 1.0);
        let rest = 1.0 - slope;
        let root = (rest * rest + 4.0 * slope * share).max(0.0).sqrt();
        self.low + length * (2.0 * share / (rest + root)).min(1.0)
    }
}

/// Adds one sample to sorted spans; the rank that will be asked for is about `rank`.
fn put<const N: usize>(spans: &mut [Span; N], depth: f32, rank: f32) {
    let used = spans.iter().position(|s| s.count == 0).unwrap_or(N);
    let i = spans[..used].iter().position(|s| depth <= s.high).unwrap_or(used);
    if i < used && depth >= spans[i].low {
        spans[i].add(depth);
        return;
    }
    let mut carried = Span::from_depth(depth);
    if used < N {
        for span in &mut spans[i..=used] {
            std::mem::swap(span, &mut carried);
        }
        return;
    }
    let at = |k: usize| match k {
        k if k < i => spans[k],
        k if k == i => carried,
        k => spans[k - 1],
    };
    let k = cheapest(N, at, rank);
    let one = at(k);
    let two = at(k + 1);
    // The place of the second is free, and those between it and the sample move by one.
    if k + 1 < i {
        spans.copy_within(k + 2..i, k + 1);
        spans[i - 1] = carried;
    } else if k > i {
        spans.copy_within(i..k, i + 1);
        spans[i] = carried;
    }
    spans[k] = one.with(&two);
}

/// Which of n + 1 spans becomes one with the next: that with the least samples × length, those far from the rank first.
fn cheapest(n: usize, at: impl Fn(usize) -> Span, rank: f32) -> usize {
    let mut best = 0;
    let mut least = f32::INFINITY;
    let mut before = 0.0;
    for k in 0..n {
        let one = at(k);
        let two = at(k + 1);
        let both = one.count as f32 + two.count as f32;
        let away = (before - rank).max(rank - before - both).max(0.0) / rank;
        let cost = both * (two.high - one.low) / (1.0 + FAR * away * away);
        if cost < least {
            (best, least) = (k, cost);
        }
        before += one.count as f32;
    }
    best
}

/// The depth of rank `rank`, the first sample having the rank 1/2; `None` when there are not so many samples.
fn at_rank(spans: &[Span], rank: f64) -> Option<f32> {
    let mut before = 0.0;
    for span in spans {
        let count = f64::from(span.count);
        if span.count > 0 && before + count >= rank {
            let inside = (rank - before - 0.5) / (count - 1.0).max(1.0);
            return Some(span.at(inside as f32));
        }
        before += count;
    }
    None
}

/// Depths of the hits of one pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct DepthSum {
    /// Σ steps and Σ steps².
    sum: u64,
    square: u64,
    spans: [Span; SPANS],
    /// The nearest of blocks that are over.
    blocks: [Span; BLOCK_SPANS],
    /// The last block with a hit, and the nearest in it; infinite before the first.
    block: u32,
    nearest: f32,
}

impl DepthSum {
    /// No hits yet.
    pub(crate) const NONE: Self = {
        let none = Span { low: 0.0, high: 0.0, mean: 0.0, count: 0 };
        Self { sum: 0, square: 0, spans: [none; SPANS], blocks: [none; BLOCK_SPANS], block: 0, nearest: f32::INFINITY }
    };

    /// 32-bit words of one.
    pub(crate) const WORDS: usize = 4 + 4 * (SPANS + BLOCK_SPANS) + 2;

    /// A hit of set `set`, at a positive depth; sets come in order.
    pub(crate) fn add(&mut self, set: u64, depth: f32, range: [f32; 2]) {
        let [near, far] = range;
        let steps = ((depth - near) / (far - near) * STEPS + 0.5).clamp(0.0, STEPS) as u64;
        self.sum = self.sum.saturating_add(steps);
        self.square = self.square.saturating_add(steps * steps);
        put(&mut self.spans, depth, 0.5 * (set + 1) as f32);
        let block = (set / u64::from(BLOCK)) as u32;
        if block != self.block {
            self.close();
            self.block = block;
        }
        self.nearest = self.nearest.min(depth);
    }

    /// Ends a block.
    fn close(&mut self) {
        if self.nearest < f32::INFINITY {
            put(&mut self.blocks, self.nearest, 0.5 * (self.block + 1) as f32);
            self.nearest = f32::INFINITY;
        }
    }

    /// First, median, mean and deviation after `levels` sets with `hits` hits; +∞ where undefined. Rays that pass all
    /// particles end at `solid`.
    pub(crate) fn depths(mut self, levels: u32, hits: u32, range: [f32; 2], solid: Option<f32>) -> [f32; 4] {
        let [near, far] = range;
        let behind = solid.unwrap_or(f32::INFINITY);
        if hits == 0 {
            return [behind, behind, behind, if solid.is_some() { 0.0 } else { f32::INFINITY }];
        }
        let n = f64::from(hits);
        let sets = f64::from(levels.max(hits));
        let step = f64::from(far - near) / f64::from(STEPS);
        let steps = self.sum as f64 / n;
        let variance = (self.square as f64 / n - steps * steps).max(0.0) * step * step;
        let mean_of_hits = f64::from(near) + steps * step;
        let share = if solid.is_some() { n / sets } else { 1.0 };
        let beyond = if solid.is_some() { f64::from(behind) } else { mean_of_hits };
        let mean = share * mean_of_hits + (1.0 - share) * beyond;
        let spread = share * (1.0 - share) * (mean_of_hits - beyond).powi(2);
        let median = at_rank(&self.spans, 0.5 * sets).unwrap_or(behind);
        let blocks = levels / BLOCK;
        let first = if blocks == 0 {
            self.nearest
        } else {
            if self.block < blocks {
                self.close();
            }
            at_rank(&self.blocks, 0.5 * f64::from(blocks)).unwrap_or(behind)
        };
        [first, median, mean as f32, (share * variance + spread).sqrt() as f32]
    }

    /// As words, and back.
    pub(crate) fn words(&self) -> [u32; Self::WORDS] {
        let mut words = [0; Self::WORDS];
        let sum = self.sum;
        let square = self.square;
        let head = [sum as u32, (sum >> 32) as u32, square as u32, (square >> 32) as u32];
        let spans = self.spans.iter().chain(&self.blocks);
        let spans = spans.flat_map(|s| [s.low.to_bits(), s.high.to_bits(), s.mean.to_bits(), s.count]);
        let values = head.into_iter().chain(spans).chain([self.block, self.nearest.to_bits()]);
        words.iter_mut().zip(values).for_each(|(to, word)| *to = word);
        words
    }

    pub(crate) fn from_words(words: &[u32; Self::WORDS]) -> Self {
        let long = |k: usize| u64::from(words[k]) | u64::from(words[k + 1]) << 32;
        let float = |k: usize| f32::from_bits(words[k]);
        let span = |k: usize| Span {
            low: float(4 + 4 * k),
            high: float(5 + 4 * k),
            mean: float(6 + 4 * k),
            count: words[7 + 4 * k],
        };
        Self {
            sum: long(0),
            square: long(2),
            spans: std::array::from_fn(span),
            blocks: std::array::from_fn(|k| span(SPANS + k)),
            block: words[Self::WORDS - 2],
            nearest: float(Self::WORDS - 1),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::rng;

    const RANGE: [f32; 2] = [0.0, 16.0];

    /// Depths of `levels` sets, of which `draw` gives each.
    fn depths(levels: u32, solid: Option<f32>, draw: impl Fn(u64) -> Option<f32>) -> [f32; 4] {
        let mut sum = DepthSum::NONE;
        let mut hits = 0;
        for set in 0..u64::from(levels) {
            if let Some(depth) = draw(set) {
                sum.add(set, depth, RANGE);
                hits += 1;
            }
            assert!(sum.spans.windows(2).all(|s| s[1].count == 0 || s[0].high < s[1].low), "{:?}", sum.spans);
            assert_eq!(sum.spans.iter().map(|s| s.count).sum::<u32>(), hits);
        }
        assert_eq!(DepthSum::from_words(&sum.words()), sum);
        sum.depths(levels, hits, RANGE, solid)
    }

    #[test]
    fn the_depths_of_a_slab_are_its_closed_form_within_their_errors() {
        const LEVELS: u32 = 20_000;
        for tau in [1.0f64, 4.0] {
            // A slab from 2 to 3.
            let mut squares = [0.0; 4];
            let mut sums = [0.0; 4];
            let n = 200;
            let mean = 1.0 / tau - 1.0 / tau.exp_m1();
            let sigma = (1.0 / (tau * tau) - tau.exp() / (tau.exp_m1() * tau.exp_m1())).sqrt();
            let first = -(-1.0f64 / 255.0).ln_1p() / tau;
            let median = 2f64.ln() / tau;
            let hits = f64::from(LEVELS) * -(-tau).exp_m1();
            let error = [
                (0.69 * f64::from(LEVELS) / 255.0).sqrt().recip() / 255.0 / tau,
                0.5 / f64::from(LEVELS).sqrt() / (tau * (-tau * median).exp()),
                sigma / hits.sqrt(),
            ];
            for seed in 0..n {
                let draw = |set: u64| {
                    let t = -(1.0 - rng::unit(seed, 1, set, 0)).ln() / tau;
                    (t < 1.0).then_some((2.0 + t) as f32)
                };
                let found = depths(LEVELS, None, draw);
                for (k, expected) in [first, median, mean].into_iter().enumerate() {
                    let z = (f64::from(found[k]) - 2.0 - expected) / error[k];
                    (sums[k], squares[k]) = (sums[k] + z, squares[k] + z * z);
                }
                assert!((f64::from(found[3]) / sigma - 1.0).abs() < 0.03, "{found:?}");
            }
            for k in 0..3 {
                // 200 pictures: four standard errors of the mean and of the mean square.
                let n = n as f64;
                let mean = sums[k] / n;
                let square = squares[k] / n;
                assert!(mean.abs() < 4.0 / n.sqrt(), "τ {tau}, {k}: mean z {mean}");
                assert!((0.6..1.4).contains(&square), "τ {tau}, {k}: mean z² {square}");
            }
        }
    }

    #[test]
    fn surfaces_are_exact_and_gaps_stay_empty() {
        // Three layers of opacities 0.3, 0.4 and 0.5 with a little tilt, one pixel each.
        let draw = |set: u64| {
            let u = |k| rng::unit(7, 2, set, k);
            let layer = [0.3, 0.4, 0.5].iter().zip(1..).position(|(a, k)| u(k) < *a)?;
            Some([3.0, 4.0, 5.0][layer] + 0.01 * u(9) as f32)
        };
        let [first, median, ..] = depths(2000, None, draw);
        assert!((3.0..3.011).contains(&first) && (4.0..4.011).contains(&median), "{first} {median}");
        // Without the tilt they are the layers to the bit.
        let [first, median, mean, sigma] = depths(2000, None, |set| draw(set).map(f32::floor));
        assert_eq!([first, median], [3.0, 4.0]);
        let weights = [0.3, 0.28, 0.21].map(|w| w / 0.79);
        let expected = 3.0 * weights[0] + 4.0 * weights[1] + 5.0 * weights[2];
        assert!((mean - expected).abs() < 4.0 * 0.8 / f32::sqrt(1580.0), "{mean} for {expected}");
        assert!((sigma - 0.79).abs() < 0.03, "{sigma}");
    }

    #[test]
    fn an_occluder_ends_what_passes() {
        let every_fourth = |set: u64| set.is_multiple_of(4).then_some(2.0);
        let [first, median, mean, sigma] = depths(400, Some(6.0), every_fourth);
        assert_eq!([first, median], [2.0, 6.0]);
        assert!((mean - 5.0).abs() < 1e-5 && (sigma - 3f32.sqrt()).abs() < 1e-5, "{mean} {sigma}");
        assert_eq!(depths(400, Some(6.0), |_| None), [6.0, 6.0, 6.0, 0.0]);
        assert_eq!(depths(400, None, |_| None), [f32::INFINITY; 4]);
        // A hit in every 400 sets is fainter than 1/255.
        let [first, median, mean, _] = depths(4000, Some(6.0), |set| (set % 400 == 9).then_some(2.0));
        assert_eq!([first, median], [6.0, 6.0]);
        assert!((mean - 5.99).abs() < 1e-5, "{mean}");
    }
}
