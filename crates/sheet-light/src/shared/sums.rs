//! Sums that are rounded to half precision, to see what buffers of 16 bits do.

use splat_core::raster::lanes::{Broadcast, Lanes};
use splat_core::raster::pulp::Simd;

/// 2¹³ + 1: Veltkamp's splitting keeps 11 of 24 bits.
const SPLIT: f32 = 8193.0;

/// Sums that are larger would overflow on the way, and stay.
const LARGEST: f32 = 1e34;

/// Rounded to 11 bits, whatever their size.
#[inline(always)]
pub(crate) fn rounded<S: Simd>(simd: S, sums: Lanes<S>) -> Lanes<S> {
    let scaled = sums * simd.lanes(SPLIT);
    (scaled - (scaled - sums)).where_less_or(sums.abs(), simd.lanes(LARGEST), sums)
}

/// The same of one number.
pub(crate) fn rounded_one(sum: f32) -> f32 {
    let scaled = sum * SPLIT;
    if sum.abs() < LARGEST { scaled - (scaled - sum) } else { sum }
}

/// Adds to sums that are too large by `excess`, or that are of half precision; the new sums.
#[inline(always)]
pub(crate) fn add<S: Simd>(simd: S, sums: &mut [f32], excess: &mut [f32], term: Lanes<S>, half: bool) -> Lanes<S> {
    if half {
        let new = rounded(simd, Lanes::load(simd, sums) + term);
        new.store(sums);
        return new;
    }
    let mut exact = Sum::load(simd, sums, excess);
    exact.add(simd, term);
    exact.store(sums, excess);
    exact.sum
}

/// A sum that is too large by `excess` (Kahan).
#[derive(Clone, Copy)]
pub(crate) struct Sum<S: Simd> {
    pub(crate) sum: Lanes<S>,
    pub(crate) excess: Lanes<S>,
}

impl<S: Simd> Sum<S> {
    #[inline(always)]
    pub(crate) fn load(simd: S, sums: &[f32], excess: &[f32]) -> Self {
        Self { sum: Lanes::load(simd, sums), excess: Lanes::load(simd, excess) }
    }

    #[inline(always)]
    pub(crate) fn store(self, sums: &mut [f32], excess: &mut [f32]) {
        self.sum.store(sums);
        self.excess.store(excess);
    }

    /// A sum to which nothing is added stays as it is: how many pixels are looked at together, some of which get nothing, changes no bit.
    #[inline(always)]
    pub(crate) fn add(&mut self, simd: S, term: Lanes<S>) {
        let size = term.abs();
        let zero = simd.lanes(0.0);
        let term = term - self.excess;
        let new = self.sum + term;
        let excess = (new - self.sum) - term;
        self.excess = excess.where_less_or(zero, size, self.excess);
        self.sum = new.where_less_or(zero, size, self.sum);
    }
}
