//! Shares: how much of a footprint lies in each of consecutive cells along one axis of the table.
//!
//! The footprint is a biweight (15/16)(1 − x²)² of the splat's variance, whose sums over cells have the closed forms
//!
//! F(x) = 1/2 + 15x/16 − 5x³/8 + 3x⁵/16, M(x) = ∫ x·(15/16)(1 − x²)² dx = −(5/32)(1 − x²)³
//!
//! so the shares of all cells sum to 1 at any place and width, and M gives the centre of each part.

use crate::mapping::floor;

/// Half width of a biweight (1 − x²)² over its standard deviation.
pub(crate) const BIWEIGHT: f32 = 2.645_751_3;
/// Most cells along one axis of a footprint that is integrated over cells.
pub(crate) const LONGEST: usize = 8;
/// Fractions at either end below this go to the cell beside.
const NEGLIGIBLE: f32 = 1.0 / 1024.0;
/// Cells that are computed without a loop.
const USUAL: usize = 4;

/// Fractions of a footprint in consecutive cells of one axis, of sum 1.
pub(crate) struct Shares {
    pub(crate) first: i32,
    pub(crate) count: usize,
    at: f32,
    half: f32,
    share: [f32; LONGEST],
    moment: [f32; LONGEST],
}

impl Shares {
    /// A biweight of half width `half` < LONGEST/2 − 1 about `at`.
    #[inline]
    pub(crate) fn new(at: f32, half: f32) -> Self {
        let first = floor(at - half);
        let count = (floor(at + half) - first + 1).clamp(1, LONGEST as i32) as usize;
        let mut shares = Self { first, count, at, half, share: [0.0; LONGEST], moment: [0.0; LONGEST] };
        if count <= USUAL {
            shares.fill::<USUAL>()
        } else {
            shares.fill::<LONGEST>()
        }
        shares.trim();
        shares
    }

    /// The share of a cell, counted from the first.
    #[inline]
    pub(crate) fn share(&self, i: usize) -> f32 {
        self.share[i]
    }

    /// The centre of the part in a cell, counted from the first.
    #[inline]
    pub(crate) fn centre(&self, i: usize) -> f32 {
        self.at + self.half * self.moment[i] / self.share[i].max(f32::MIN_POSITIVE)
    }

    #[inline]
    fn fill<const N: usize>(&mut self) {
        let inv = 1.0 / self.half;
        let start = (self.first + 1) as f32 - self.at;
        let (mut cdf, mut moment) = ([0.0; N], [0.0; N]);
        for i in 0..N {
            let x = ((start + i as f32) * inv).clamp(-1.0, 1.0);
            let x2 = x * x;
            let rest = 1.0 - x2;
            cdf[i] = 0.5 + x * (0.9375 - x2 * (0.625 - 0.1875 * x2));
            moment[i] = -0.15625 * rest * rest * rest;
        }
        // Rounding at the far edge must not lose the last share.
        cdf[self.count.min(N) - 1] = 1.0;
        self.share[0] = cdf[0];
        self.moment[0] = moment[0];
        for i in 1..N {
            self.share[i] = cdf[i] - cdf[i - 1];
            self.moment[i] = moment[i] - moment[i - 1];
        }
    }

    #[inline]
    fn trim(&mut self) {
        if self.count > 1 && self.share[self.count - 1] < NEGLIGIBLE {
            self.count -= 1;
            self.share[self.count - 1] += self.share[self.count];
        }
        if self.count > 1 && self.share[0] < NEGLIGIBLE {
            self.share[1] += self.share[0];
            self.share.copy_within(1.., 0);
            self.moment.copy_within(1.., 0);
            self.first += 1;
            self.count -= 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_sum_to_one_and_balance_about_the_centre() {
        for k in 0..4000 {
            let at = 5.0 + splat_core::rng::unit_f32(1, 1, k, 0);
            let half = 1e-4 + 2.9 * splat_core::rng::unit_f32(1, 1, k, 1).powi(3);
            let shares = Shares::new(at, half);
            let n = shares.count;
            let sum: f32 = (0..n).map(|i| shares.share(i)).sum();
            let mean: f32 = (0..n).map(|i| shares.share(i) * shares.centre(i)).sum();
            assert!((sum - 1.0).abs() < 1e-6, "{at} ± {half}: Σ {sum}");
            assert!((mean - at).abs() < 1e-3 * (1.0 + half), "{at} ± {half}: mean {mean}");
            for i in 0..n {
                let cell = (shares.first + i as i32) as f32;
                assert!(shares.share(i) > 0.0);
                assert!((cell - 0.01..cell + 1.01).contains(&shares.centre(i)) || shares.share(i) < 0.01);
            }
        }
    }
}
