//! Sheets by gathering: each pixel of a sheet reads the lattice, where splatting has each voxel write sheets.
//!
//! A sheet across the view is a plane of constant view depth, so a row of its pixels is a straight line of constant step through the lattice,
//! through any lens. Slabs, classification, gradients and light stay as they are.

use super::tile::rays::{Crossings, Slopes};
use super::tile::sheets::Sheets;
use super::tile::size::SIDE;
use crate::shared::gathered::Gathered;
use crate::shared::gathered::bricks::Box3;
use crate::shared::lattice::rays::LatticeRays;
use crate::shared::slabs::{BATCH, Slabs};
use crate::shared::vectors::COUNTING;
use splat_core::glam::DVec3;
use splat_core::raster::lanes::{Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;

/// Neighbouring pixels of a sheet in lattice coordinates: pixel n of the row at `first` + n·`step`.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Row {
    first: DVec3,
    step: DVec3,
}

/// What one sheet's row of a tile asks for.
pub(crate) struct SheetLines<'a> {
    pub(crate) rays: &'a LatticeRays,
    pub(crate) slopes: &'a Slopes,
    pub(crate) slabs: &'a Slabs,
    pub(crate) crossings: &'a Crossings,
}

impl Row {
    fn new(first: DVec3, last: DVec3) -> Self {
        Self { first, step: (last - first) / (SIDE - 1) as f64 }
    }

    /// The cells between two of its pixels.
    #[inline(always)]
    fn between(&self, from: usize, to: usize) -> Box3 {
        Box3::around([self.first + self.step * from as f64, self.first + self.step * to as f64])
    }

    /// Values of the pixels of a row that `mask` has and that may show anything, and which these are, a bit each.
    #[inline(always)]
    fn values<S: Simd>(&self, simd: S, lattice: &Gathered<'_>, mask: u64, out: &mut [f32]) -> u64 {
        let mut tags = 0;
        for x in (0..SIDE).step_by(Lanes::<S>::COUNT) {
            let bits = ((1 << Lanes::<S>::COUNT) - 1) << x & ((1 << SIDE) - 1);
            if mask & bits == 0 {
                continue;
            }
            let part = self.between(x, x + Lanes::<S>::COUNT - 1);
            if !lattice.shows(&part) {
                continue;
            }
            tags |= bits;
            let corner = lattice.corner(&part);
            let counting = Lanes::load(simd, &COUNTING);
            let mut places = [counting; 3];
            for a in 0..3 {
                let first = corner.from(a, self.first[a] + self.step[a] * x as f64);
                places[a] = counting.mul_add(Lanes::splat(simd, self.step[a] as f32), Lanes::splat(simd, first as f32));
            }
            let value = lattice.values(simd, &corner, &places);
            if x + Lanes::<S>::COUNT <= SIDE {
                value.store(&mut out[x..]);
            } else {
                let mut values = [0.0; MAX_LANES];
                value.store(&mut values);
                out[x..SIDE].copy_from_slice(&values[..SIDE - x]);
            }
        }
        tags
    }
}

impl SheetLines<'_> {
    /// Reads the sheets of a batch in the pixels of `mask`, a bit each. Returns the number of pixels.
    #[inline(always)]
    pub(crate) fn batch<S: Simd>(
        &self,
        simd: S,
        lattice: &Gathered<'_>,
        batch: u32,
        mask: &[u64; SIDE],
        sheets: &mut Sheets,
    ) -> u64 {
        let mut pixels = 0;
        let first = batch * BATCH;
        let corners = |slab: u32| {
            [[0, 0], [SIDE - 1, 0], [0, SIDE - 1], [SIDE - 1, SIDE - 1]].map(|[x, y]| self.place(slab, x, y))
        };
        let whole = corners(first).into_iter().chain(corners(first + BATCH - 1));
        let is_seen = lattice.shows(&Box3::around(whole));
        for slab in first..first + BATCH {
            for y in 0..SIDE {
                let mut tags = 0;
                if is_seen && mask[y] != 0 {
                    let row = Row::new(self.place(slab, 0, y), self.place(slab, SIDE - 1, y));
                    if lattice.shows(&row.between(0, SIDE - 1)) {
                        let inside = self.inside(simd, slab, y);
                        tags = row.values(simd, lattice, mask[y] & inside, sheets.begin_values(slab, y));
                    }
                }
                pixels += u64::from(tags.count_ones());
                sheets.finish_row(slab, y, tags);
            }
        }
        pixels
    }

    /// The pixels of a row whose rays are inside the volume in a slab, or in one of those beside it, a bit each.
    #[inline(always)]
    fn inside<S: Simd>(&self, simd: S, slab: u32, y: usize) -> u64 {
        let begin = Lanes::splat(simd, self.slabs.face(slab.saturating_sub(1)));
        let end = Lanes::splat(simd, self.slabs.face(slab + 2));
        let mut bits = 0;
        for x in (0..SIDE).step_by(Lanes::<S>::COUNT) {
            let near = Lanes::load(simd, &self.crossings.near[y * SIDE + x..]).max(begin);
            let far = Lanes::load(simd, &self.crossings.far[y * SIDE + x..]).min(end);
            if near.any_less(far) {
                bits |= ((1 << Lanes::<S>::COUNT) - 1) << x;
            }
        }
        bits & ((1 << SIDE) - 1)
    }

    /// Lattice coordinates of a pixel in the middle of a slab.
    #[inline(always)]
    fn place(&self, slab: u32, x: usize, y: usize) -> DVec3 {
        self.rays.place(self.slopes.ray(x, y), (f64::from(slab) + 0.5) * self.slabs.width)
    }
}
