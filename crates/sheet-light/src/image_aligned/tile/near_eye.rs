//! Sheets beside the eye in perspective.
//!
//! A voxel behind the eye has no place in the image, so sheets that its kernel would reach lack it, and their values are those of places deeper
//! than the middles of their slabs. How deep is found by splatting the depths of voxels as their values are. The value in the middle of a slab
//! lies on the line through that sheet and the next one: exact in a linear field, as sheets farther off are.

use super::place::Place;
use super::ring::{Record, Ring, Splatter};
use super::sheets::Sheets;
use super::size::SIDE;
use crate::image_aligned::prepared::Prepared;
use crate::image_aligned::viewed::eye_of;
use crate::shared::sections::LEAST_WEIGHT;
use crate::shared::sections::PHASES;
use crate::shared::slabs::{BATCH, Slabs};
use splat_core::raster::lanes::{Broadcast, Lanes};
use splat_core::raster::pulp::Simd;

/// Sheets whose depths are less apart than this share of a slab tell no slope.
pub(crate) const LEAST_APART: f64 = 1.0 / 256.0;

/// The depths of one volume's sheets in one tile.
#[derive(Debug)]
pub(crate) struct NearEye {
    ring: Ring,
    depths: Sheets,
}

impl NearEye {
    pub(crate) fn new(touched: usize) -> Self {
        Self { ring: Ring::new(touched), depths: Sheets::new() }
    }

    pub(crate) fn clear(&mut self) {
        self.ring.clear();
        self.depths.clear();
    }

    /// Adds a voxel's depth. Number of fragments.
    #[inline(always)]
    pub(crate) fn splat<S: Simd>(
        &mut self,
        simd: S,
        splatter: &Splatter<'_>,
        slabs: &Slabs,
        record: &Record,
        mask: &[u64; SIDE],
    ) -> u64 {
        let depth = f64::from(record.place) / f64::from(PHASES) + splatter.viewed.reach / slabs.width - eye_of(slabs);
        self.ring.splat(simd, splatter, &Record { value: depth as f32, ..*record }, mask)
    }

    /// Finishes the depths of a batch, and the values that can be told with them: those of its sheets but the last, and of the last before it.
    #[inline(always)]
    pub(crate) fn take_batch<S: Simd>(&mut self, simd: S, prepared: &Prepared<'_>, batch: u32, sheets: &mut Sheets) {
        let Some(lacking) = &prepared.lacking else {
            return;
        };
        self.ring.take_batch(simd, batch, &mut self.depths);
        let from = (batch * BATCH).saturating_sub(1).max(lacking.start);
        for slab in from..((batch + 1) * BATCH - 1).min(lacking.end) {
            let middle = (f64::from(slab) + 0.5 - eye_of(&prepared.slabs)) as f32;
            for y in 0..SIDE {
                let touched = if sheets.tags(slab, y) == 0 { 0 } else { SIDE };
                for x in (0..touched).step_by(Lanes::<S>::COUNT) {
                    self.mend(simd, Place { slab, y, x }, middle, sheets);
                }
            }
        }
    }

    /// Tells the values of neighbouring pixels in the middle of a slab.
    #[inline(always)]
    fn mend<S: Simd>(&self, simd: S, place: Place, middle: f32, sheets: &mut Sheets) {
        let Place { slab, y, x } = place;
        let [value, weight] = sheets.load(simd, slab, y, x);
        let [next, next_weight] = sheets.load(simd, slab + 1, y, x);
        let [depth, _] = self.depths.load(simd, slab, y, x);
        let [next_depth, _] = self.depths.load(simd, slab + 1, y, x);
        let apart = next_depth - depth;
        let least = simd.lanes(LEAST_APART as f32);
        let slope = (next - value) / simd.lanes(1.0).where_less_or(apart, least, apart);
        let slope = slope.where_less(least, apart);
        let slope =
            slope.where_less(simd.lanes(LEAST_WEIGHT), weight).where_less(simd.lanes(LEAST_WEIGHT), next_weight);
        sheets.set(slab, y, x, (simd.lanes(middle) - depth).mul_add(slope, value));
    }
}
