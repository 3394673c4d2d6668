//! Voxels that are classified before they are splatted, as the first splatters had them (section 4): extinction and the colours that it
//! weighs are summed in the place of values. What lies between voxels is a mean of their classes, which blurs the transfer function
//! by a kernel.

use super::ring::{Record, Ring, Splatter};
use super::sheets::Sheets;
use super::size::SIDE;
use crate::shared::classifier::Classifier;
use splat_core::raster::lanes::{Broadcast, Lanes};
use splat_core::raster::pulp::Simd;

/// Extinction, and red, green and blue times it.
const SUMS: usize = 4;

/// Sums of one volume in one tile, beside those of its values, which gradients are of.
pub(crate) struct Preclassified {
    rings: [Ring; SUMS],
    sheets: [Sheets; SUMS],
}

impl Preclassified {
    pub(crate) fn new(touched: usize) -> Self {
        Self { rings: std::array::from_fn(|_| Ring::new(touched)), sheets: std::array::from_fn(|_| Sheets::new()) }
    }

    /// How many times what the values take.
    pub(crate) const fn times() -> u64 {
        SUMS as u64
    }

    pub(crate) fn clear(&mut self) {
        self.rings.iter_mut().for_each(Ring::clear);
        self.sheets.iter_mut().for_each(Sheets::clear);
    }

    /// Adds a voxel's class. Number of fragments.
    #[inline(always)]
    pub(crate) fn splat<S: Simd>(
        &mut self,
        simd: S,
        splatter: &Splatter<'_>,
        classifier: &Classifier,
        record: &Record,
        mask: &[u64; SIDE],
    ) -> u64 {
        let [extinction, red, green, blue] = classifier.class_of(record.value);
        let sums = [extinction, extinction * red, extinction * green, extinction * blue];
        let mut fragments = 0;
        // No closure: it would not be compiled for the vectors of its caller.
        for (ring, value) in self.rings.iter_mut().zip(sums) {
            fragments += ring.splat(simd, splatter, &Record { value, ..*record }, mask);
        }
        fragments
    }

    #[inline(always)]
    pub(crate) fn take_batch<S: Simd>(&mut self, simd: S, batch: u32) {
        for (ring, sheets) in self.rings.iter_mut().zip(&mut self.sheets) {
            ring.take_batch(simd, batch, sheets);
        }
    }

    /// Extinction, red, green and blue.
    #[inline(always)]
    pub(crate) fn load<S: Simd>(&self, simd: S, slab: u32, y: usize, x: usize) -> [Lanes<S>; 4] {
        let [first, second, third, fourth] = &self.sheets;
        let [extinction, _] = first.load(simd, slab, y, x);
        let [red, _] = second.load(simd, slab, y, x);
        let [green, _] = third.load(simd, slab, y, x);
        let [blue, _] = fourth.load(simd, slab, y, x);
        let inverse = simd.lanes(1.0) / extinction.max(simd.lanes(f32::MIN_POSITIVE));
        [extinction, red * inverse, green * inverse, blue * inverse]
    }
}
