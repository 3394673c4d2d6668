//! Shares: how much of a footprint lies in each of consecutive cells along one axis of the table.
//!
//! The footprint is a triweight (35/32)(1 − x²)³ of the splat's variance, whose sums over cells have the closed forms
//!
//! F(x) = 1/2 + (35/32)(x − x³ + 3x⁵/5 − x⁷/7), M(x) = ∫ x·(35/32)(1 − x²)³ dx = −(35/256)(1 − x²)⁴
//!
//! so the shares of all cells sum to 1 at any place and width, and M gives the centre of each part. Tails, which would
//! cost entries that nobody sees, are cut where |x| > e: (F(x) − F(−e))/(1 − 2F(−e)). A footprint of many cells is cut
//! less, so that sums over a lattice of splats stay smooth.

use crate::mapping::floor;

/// Half width of a cut triweight over its standard deviation, within half a percent for every cut.
pub(crate) const HALF_WIDTH: f32 = 3.01;
/// Where small and large footprints are cut, in half widths.
const CUT: [f32; 2] = [0.83, 0.92];
/// Half width in cells up to which footprints are small.
const SMALL: f32 = 1.0;
/// Growth of the cut with half width.
const GROWTH: f32 = 0.06;
/// Cells that a footprint of this half width overlaps along an axis, mean over where it lies.
pub(crate) fn cells_along(half: f64) -> f64 {
    let [small, large] = CUT.map(f64::from);
    1.0 + 2.0 * half * (small + f64::from(GROWTH) * (half - f64::from(SMALL))).clamp(small, large)
}

/// Cells that are computed at once.
pub(crate) const BLOCK: usize = 8;

/// Least of `high` and greatest of `low` and `x`: two instructions, where `min` and `max` take more to treat NaN.
#[inline(always)]
pub(crate) fn between(x: f32, low: f32, high: f32) -> f32 {
    let x = if x > low { x } else { low };
    if x < high { x } else { high }
}

/// F(x).
#[inline(always)]
fn cumulative(x: f32) -> f32 {
    let x2 = x * x;
    0.5 + x * (1.093_75 - x2 * (1.093_75 - x2 * (0.656_25 - 0.156_25 * x2)))
}

/// A footprint along one axis: a cut triweight about `at`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Axis {
    pub(crate) at: f32,
    pub(crate) half: f32,
    pub(crate) inverse: f32,
    /// Where tails are cut, in half widths, what is cut of each, and by what the rest grows.
    pub(crate) cut: f32,
    pub(crate) tail: f32,
    pub(crate) scale: f32,
    /// First and last cell.
    pub(crate) first: i32,
    pub(crate) last: i32,
}

impl Axis {
    /// A triweight of half width `half` > 0 about `at`, in cells.
    #[inline(always)]
    pub(crate) fn new(at: f32, half: f32) -> Self {
        let cut = (CUT[0] + GROWTH * (half - SMALL)).clamp(CUT[0], CUT[1]);
        let tail = cumulative(-cut);
        let [first, last] = [at - cut * half, at + cut * half].map(floor);
        Self { at, half, inverse: 1.0 / half, cut, tail, scale: 1.0 / (1.0 - 2.0 * tail), first, last }
    }

    /// The same about another place.
    #[inline(always)]
    pub(crate) fn moved(self, at: f32) -> Self {
        let [first, last] = [at - self.cut * self.half, at + self.cut * self.half].map(floor);
        Self { at, first, last, ..self }
    }

    /// Lower edge of the first cell, relative to the centre.
    #[inline(always)]
    pub(crate) fn start(&self) -> f32 {
        self.first as f32 - self.at
    }

    /// Cells that it may overlap wherever it lies, at most.
    #[inline(always)]
    pub(crate) fn most_cells(&self) -> i32 {
        floor(2.0 * self.cut * self.half) + 2
    }

    /// Fraction below an edge between cells, relative to the centre.
    #[inline(always)]
    pub(crate) fn below(&self, edge: f32) -> f32 {
        let x = between(edge * self.inverse, -1.0, 1.0);
        between((cumulative(x) - self.tail) * self.scale, 0.0, 1.0)
    }

    /// Shares of `BLOCK` cells from `first` on.
    #[inline(always)]
    pub(crate) fn shares(&self, first: i32) -> [f32; BLOCK] {
        let start = first as f32 - self.at;
        let upper: [f32; BLOCK] = std::array::from_fn(|k| self.below(start + (k + 1) as f32));
        let mut lower = self.below(start);
        upper.map(|u| u - std::mem::replace(&mut lower, u))
    }

    /// First moment below an edge, in half widths.
    #[inline(always)]
    fn moment_below(&self, edge: f32) -> f32 {
        let x = between(edge * self.inverse, -self.cut, self.cut);
        let rest = (1.0 - x * x) * (1.0 - x * x);
        -0.136_718_75 * self.scale * (rest * rest)
    }

    /// Centre of the part in a cell of lower edge `edge`, which holds `share`; both relative to the centre of the whole.
    #[inline(always)]
    pub(crate) fn centre(&self, edge: f32, share: f32) -> f32 {
        let moment = self.moment_below(edge + 1.0) - self.moment_below(edge);
        // Rounding of a tiny share must not throw its centre out of the cell.
        between(self.half * moment / (share + 1e-6), edge, edge + 1.0)
    }

    /// Centres of the parts in `BLOCK` cells from `first` on, relative to the centre of the whole.
    #[inline(always)]
    pub(crate) fn centres(&self, first: i32, shares: &[f32; BLOCK]) -> [f32; BLOCK] {
        let start = first as f32 - self.at;
        std::array::from_fn(|k| self.centre(start + k as f32, shares[k]))
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
            let axis = Axis::new(at, half);
            let shares = axis.shares(axis.first);
            let centres = axis.centres(axis.first, &shares);
            let n = (axis.last - axis.first + 1) as usize;
            assert!(n <= BLOCK);
            let sum: f32 = shares.iter().sum();
            let mean: f32 = shares.iter().zip(centres).map(|(s, c)| s * (at + c)).sum();
            assert!((sum - 1.0).abs() < 1e-6, "{at} ± {half}: Σ {sum}");
            assert!((mean - at).abs() < 1e-3 * (1.0 + half), "{at} ± {half}: mean {mean}");
            for k in 0..n {
                let cell = axis.first as f32 + k as f32 - at;
                assert!(shares[k] >= 0.0);
                assert!((cell - 0.01..cell + 1.01).contains(&centres[k]) || shares[k] < 0.01);
            }
            assert!(shares[n..].iter().all(|s| *s == 0.0));
        }
    }

    #[test]
    fn cut_triweights_have_about_their_deviation() {
        for half in [0.5f32, 1.5, 3.0, 100.0] {
            let axis = Axis::new(0.0, half);
            let n = 2000;
            let edge = |i: i32| axis.cut * half * i as f32 / n as f32;
            let variance = |i: i32| (axis.below(edge(i + 1)) - axis.below(edge(i))) * (edge(i) + 0.5 * edge(1)).powi(2);
            let deviation = (-n..n).map(variance).sum::<f32>().sqrt();
            assert!((deviation * HALF_WIDTH / half - 1.0).abs() < 7e-3, "{half}: {deviation}");
            assert!(axis.below(edge(-n)) < 1e-6 && axis.below(edge(n)) > 1.0 - 1e-6);
        }
    }
}
