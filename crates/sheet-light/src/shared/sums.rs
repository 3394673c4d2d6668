//! Sums that are rounded to half precision, to see what buffers of 16 bits do.

use splat_core::raster::lanes::Lanes;
use splat_core::raster::pulp::Simd;

/// 2¹³ + 1: Veltkamp's splitting keeps 11 of 24 bits.
const SPLIT: f32 = 8193.0;

/// Sums that are larger would overflow on the way, and stay.
const LARGEST: f32 = 1e34;

/// Rounded to 11 bits, whatever their size.
#[inline(always)]
pub(crate) fn rounded<S: Simd>(simd: S, sums: Lanes<S>) -> Lanes<S> {
    let scaled = sums * Lanes::splat(simd, SPLIT);
    (scaled - (scaled - sums)).where_less_or(sums.abs(), Lanes::splat(simd, LARGEST), sums)
}

/// The same of one number.
pub(crate) fn rounded_one(sum: f32) -> f32 {
    let scaled = sum * SPLIT;
    if sum.abs() < LARGEST { scaled - (scaled - sum) } else { sum }
}

/// Adds to sums that are too large by `excess`, or that are of half precision; the new sums.
#[inline(always)]
pub(crate) fn add<S: Simd>(simd: S, sums: &mut [f32], excess: &mut [f32], term: Lanes<S>, half: bool) -> Lanes<S> {
    let sum = Lanes::load(simd, sums);
    if half {
        let new = rounded(simd, sum + term);
        new.store(sums);
        return new;
    }
    let term = term - Lanes::load(simd, excess);
    let new = sum + term;
    ((new - sum) - term).store(excess);
    new.store(sums);
    new
}
