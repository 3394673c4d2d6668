//! Finished sheets of one volume in one tile: the reconstructed value of each pixel, and gradients from neighbouring sheets.
//!
//! v = Σ v_i·w_i / Σ w_i, the kernels' sum being what it is: a constant volume has its value at every pixel that any kernel
//! reaches, whatever ripple the kernels have (section 2 of the paper is silent on it).
//!
//! Gradients are central differences over the neighbouring pixels and sheets (section 4.2), one-sided beside a sample that lies
//! outside the volume, in world units: with u = x/z, v = y/z, ∂x = ∂u/z and ∂z = ∂z|uv − (u·∂u + v·∂v)/z in perspective.

use super::size::{AREA, SIDE};
use crate::shared::sections::LEAST_WEIGHT;
use crate::shared::slabs::BATCH;
use splat_core::raster::lanes::{Broadcast, Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;

/// Sheets kept: those of two batches, so that both neighbours of a sheet are there.
const KEPT: u32 = 2 * BATCH;

/// Numbers of a plane: vectors may run over its end.
const PLANE: usize = AREA + MAX_LANES;

/// The last sheets of one volume.
#[derive(Debug)]
pub(crate) struct Sheets {
    values: Vec<f32>,
    weights: Vec<f32>,
    /// By sheet: pixels of each row that may have a value, a bit each.
    tags: [[u64; SIDE]; KEPT as usize],
}

impl Sheets {
    pub(crate) fn new() -> Self {
        let planes = KEPT as usize * PLANE;
        Self { values: vec![0.0; planes], weights: vec![0.0; planes], tags: [[0; SIDE]; KEPT as usize] }
    }

    /// Bytes of the planes.
    pub(crate) const fn bytes() -> u64 {
        2 * 4 * KEPT as u64 * PLANE as u64
    }

    pub(crate) fn clear(&mut self) {
        self.weights.fill(0.0);
        self.tags = [[0; SIDE]; KEPT as usize];
    }

    #[inline(always)]
    fn index(slab: u32, y: usize, x: usize) -> usize {
        (slab % KEPT) as usize * PLANE + y * SIDE + x
    }

    /// A row of the batch that begins with `slab` will get the pixels `bits`.
    #[inline(always)]
    pub(crate) fn begin_row(&mut self, slab: u32, y: usize, bits: u64) {
        for slab in slab..slab + BATCH {
            let tags = &mut self.tags[(slab % KEPT) as usize][y];
            if *tags != 0 {
                let index = Self::index(slab, y, 0);
                self.weights[index..index + SIDE].fill(0.0);
            }
            *tags = bits;
        }
    }

    /// Σ v·w and Σ w of a pixel.
    #[inline(always)]
    pub(crate) fn put(&mut self, slab: u32, y: usize, x: usize, value: f32, weight: f32) {
        let index = Self::index(slab, y, x);
        self.values[index] = value;
        self.weights[index] = weight;
    }

    /// Replaces the values of pixels of a row from x on.
    #[inline(always)]
    pub(crate) fn set<S: Simd>(&mut self, slab: u32, y: usize, x: usize, values: Lanes<S>) {
        let index = Self::index(slab, y, x);
        let n = Lanes::<S>::COUNT.min(SIDE - x);
        let mut out = [0.0; MAX_LANES];
        values.store(&mut out);
        self.values[index..index + n].copy_from_slice(&out[..n]);
    }

    /// Divides by kernel sums.
    #[inline(always)]
    pub(crate) fn normalize_row<S: Simd>(&mut self, simd: S, slab: u32, y: usize, range: std::ops::Range<usize>) {
        for slab in slab..slab + BATCH {
            let mut x = range.start;
            while x < range.end {
                let index = Self::index(slab, y, x);
                let n = Lanes::<S>::COUNT.min(range.end - x);
                let weight = Lanes::load(simd, &self.weights[index..]).max(simd.lanes(LEAST_WEIGHT));
                let value = Lanes::load(simd, &self.values[index..]) / weight;
                let mut out = [0.0; MAX_LANES];
                value.store(&mut out);
                self.values[index..index + n].copy_from_slice(&out[..n]);
                x += Lanes::<S>::COUNT;
            }
        }
    }

    /// The values of a row, to be filled.
    #[inline(always)]
    pub(crate) fn row_mut(&mut self, slab: u32, y: usize) -> &mut [f32] {
        let index = Self::index(slab, y, 0);
        &mut self.values[index..index + SIDE]
    }

    /// The pixels `tags` of a sheet, a bit each, have values now, and no others.
    #[inline(always)]
    pub(crate) fn finish(&mut self, slab: u32, tags: &[u64; SIDE]) {
        let before = &mut self.tags[(slab % KEPT) as usize];
        for (y, (before, tags)) in before.iter_mut().zip(tags).enumerate() {
            // Weights are those of the sheet that was here before.
            if before != tags {
                let index = Self::index(slab, y, 0);
                for (x, weight) in self.weights[index..index + SIDE].iter_mut().enumerate() {
                    *weight = (tags >> x & 1) as f32;
                }
                *before = *tags;
            }
        }
    }

    /// Pixels of a row that may have a value.
    #[inline(always)]
    pub(crate) fn tags(&self, slab: u32, y: usize) -> u64 {
        self.tags[(slab % KEPT) as usize][y]
    }

    /// Values and kernel sums from pixel x on.
    #[inline(always)]
    pub(crate) fn load<S: Simd>(&self, simd: S, slab: u32, y: usize, x: usize) -> [Lanes<S>; 2] {
        let index = Self::index(slab, y, x);
        [Lanes::load(simd, &self.values[index..]), Lanes::load(simd, &self.weights[index..])]
    }
}

/// Difference over the neighbours of `value`, per step: central, one-sided where one of the two is no sample, 0 where both are.
/// Each neighbour is its value and 1, or anything and 0.
#[inline(always)]
pub(crate) fn difference<S: Simd>(simd: S, value: Lanes<S>, before: [Lanes<S>; 2], after: [Lanes<S>; 2]) -> Lanes<S> {
    let half = simd.lanes(0.5);
    let steps = (before[1] + after[1]).max(half);
    let value_before = before[0].where_less_or(half, before[1], value);
    let value_after = after[0].where_less_or(half, after[1], value);
    (value_after - value_before) / steps
}
