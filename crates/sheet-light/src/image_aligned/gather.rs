//! Sheets by gathering: each pixel of a sheet reads the lattice, where splatting has each voxel write sheets.
//!
//! A sheet across the view is a plane of constant view depth, so a row of its pixels is a straight line of constant step through the lattice,
//! through any lens. Slabs, classification, gradients and light stay as they are.

use super::tile::rays::{Crossings, Slopes};
use super::tile::sheets::Sheets;
use super::tile::size::SIDE;
use crate::shared::depths::DepthRange;
use crate::shared::gathered::bricks::Box3;
use crate::shared::gathered::{Corner, Gathered};
use crate::shared::lattice::rays::LatticeRays;
use crate::shared::slabs::{BATCH, Slabs};
use crate::shared::vectors::COUNTING;
use splat_core::glam::DVec3;
use splat_core::raster::lanes::{Broadcast, Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;
use std::ops::Range;

/// Neighbouring pixels that are read together. As many on every machine: their places are counted from a corner of all of them, and so have the same bits.
pub(crate) const GROUP: usize = MAX_LANES;

/// Groups of a row of a tile, without its rim.
pub(crate) const GROUPS: usize = (SIDE - 2) / GROUP;

/// Rows of a block that is looked at as a whole before any of them.
const ROWS: usize = 8;

/// Pixels of a group, from the first column of the tile on.
const GROUP_BITS: u64 = ((1 << GROUP) - 1) << 1;

/// The pixels of a row that belong to the rim.
const RIM_BITS: u64 = 1 | 1 << (SIDE - 1);

/// The same as places in the row; further lanes are the last one.
const RIM_PLACES: [f32; GROUP] = {
    let mut places = [(SIDE - 1) as f32; GROUP];
    places[0] = 0.0;
    places
};

/// The sheets of a batch in a row of a tile, in lattice coordinates: pixel x of slab n at `first` + x·`across` + n·(`behind` + x·`wider`).
#[derive(Debug, Clone, Copy, PartialEq)]
struct Ribbon {
    first: DVec3,
    across: DVec3,
    behind: DVec3,
    /// Zero of parallel rays.
    wider: DVec3,
}

/// What one sheet's row of a tile asks for.
pub(crate) struct SheetLines<'a> {
    pub(crate) rays: &'a LatticeRays,
    pub(crate) slopes: &'a Slopes,
    pub(crate) slabs: &'a Slabs,
    pub(crate) crossings: &'a Crossings,
    /// Slabs to each side of one that values in it are told from.
    pub(crate) beside: u32,
}

impl Ribbon {
    #[inline(always)]
    fn place(&self, x: usize, slab: u32) -> DVec3 {
        let x = x as f64;
        self.first + self.across * x + (self.behind + self.wider * x) * f64::from(slab)
    }

    /// Its places in the first and the last slab between two pixels: all others lie among them.
    #[inline(always)]
    fn ends(&self, from: usize, to: usize) -> [DVec3; 4] {
        [self.place(from, 0), self.place(to, 0), self.place(from, BATCH - 1), self.place(to, BATCH - 1)]
    }

    /// Reads the lattice for pixels of a slab: those that `offsets` are the places of, counted from pixel `x`.
    #[inline(always)]
    fn read<S: Simd>(
        &self,
        simd: S,
        lattice: &Gathered<'_>,
        corner: &Corner,
        x: usize,
        slab: u32,
        offsets: &[f32],
    ) -> Lanes<S> {
        let first = self.place(x, slab);
        let step = self.across + self.wider * f64::from(slab);
        let offsets = Lanes::load(simd, offsets);
        let mut places = [offsets; 3];
        for a in 0..3 {
            let first = simd.lanes(corner.from(a, first[a]) as f32);
            places[a] = offsets.mul_add(simd.lanes(step[a] as f32), first);
        }
        lattice.values(simd, corner, &places)
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
        let first = batch * BATCH;
        let mut tags = [[0; SIDE]; BATCH as usize];
        if lattice.shows(&self.block(first, 0..SIDE, 0, SIDE - 1)) {
            for top in (0..SIDE).step_by(ROWS) {
                let rows = top..(top + ROWS).min(SIDE);
                let open = mask[rows.clone()].iter().fold(0, |open, row| open | row);
                if open == 0 {
                    continue;
                }
                let mut is_seen = [false; GROUPS];
                for (g, is_seen) in is_seen.iter_mut().enumerate() {
                    let x = 1 + g * GROUP;
                    *is_seen = open & (GROUP_BITS << (g * GROUP)) != 0
                        && lattice.shows(&self.block(first, rows.clone(), x, x + GROUP - 1));
                }
                for y in rows {
                    if mask[y] != 0 && (mask[y] & RIM_BITS != 0 || is_seen != [false; GROUPS]) {
                        self.row(simd, lattice, first, y, mask[y], &is_seen, sheets, &mut tags);
                    }
                }
            }
        }
        let mut pixels = 0;
        for (slab, tags) in (first..).zip(&tags) {
            pixels += tags.iter().map(|row| u64::from(row.count_ones())).sum::<u64>();
            sheets.finish(slab, tags);
        }
        pixels
    }

    /// Reads a row in the slabs of a batch, from slab `first` on.
    #[inline(always)]
    fn row<S: Simd>(
        &self,
        simd: S,
        lattice: &Gathered<'_>,
        first: u32,
        y: usize,
        mask: u64,
        is_seen: &[bool; GROUPS],
        sheets: &mut Sheets,
        tags: &mut [[u64; SIDE]; BATCH as usize],
    ) {
        let ribbon = self.ribbon(first, y);
        for g in 0..GROUPS {
            let x = 1 + g * GROUP;
            let bits = GROUP_BITS << (g * GROUP);
            let inside = self.inside(first, y, g);
            if mask & bits == 0 || !is_seen[g] || inside.is_empty() {
                continue;
            }
            let part = Box3::around(ribbon.ends(x, x + GROUP - 1));
            if !lattice.shows(&part) {
                continue;
            }
            let corner = lattice.corner(&part);
            for slab in inside {
                let out = sheets.row_mut(first + slab, y);
                for lane in (0..GROUP).step_by(Lanes::<S>::COUNT) {
                    ribbon.read(simd, lattice, &corner, x, slab, &COUNTING[lane..]).store(&mut out[x + lane..]);
                }
                tags[slab as usize][y] |= bits;
            }
        }
        if mask & RIM_BITS == 0 {
            return;
        }
        let part = Box3::around(ribbon.ends(0, SIDE - 1));
        if !lattice.shows(&part) {
            return;
        }
        let corner = lattice.corner(&part);
        for slab in 0..BATCH {
            let mut values = [0.0; GROUP];
            for lane in (0..2).step_by(Lanes::<S>::COUNT) {
                ribbon.read(simd, lattice, &corner, 0, slab, &RIM_PLACES[lane..]).store(&mut values[lane..]);
            }
            let out = sheets.row_mut(first + slab, y);
            out[0] = values[0];
            out[SIDE - 1] = values[1];
            tags[slab as usize][y] |= RIM_BITS;
        }
    }

    /// The slabs of a batch, counted from its first one, in which or beside which any ray of a group is inside the volume.
    #[inline(always)]
    fn inside(&self, first: u32, y: usize, group: usize) -> Range<u32> {
        let DepthRange { near, far } = self.crossings.groups[y * GROUPS + group];
        let mut begin = BATCH;
        let mut end = 0;
        for slab in 0..BATCH {
            let before = self.slabs.face((first + slab).saturating_sub(self.beside));
            let behind = self.slabs.face(first + slab + 1 + self.beside);
            if near < behind && far > before {
                begin = begin.min(slab);
                end = slab + 1;
            }
        }
        begin..end
    }

    /// The cells of some pixels of some rows in a batch, and all between them.
    #[inline(always)]
    fn block(&self, first: u32, rows: Range<usize>, from: usize, to: usize) -> Box3 {
        let top = self.ribbon(first, rows.start).ends(from, to);
        let bottom = self.ribbon(first, rows.end - 1).ends(from, to);
        Box3::around(top.into_iter().chain(bottom))
    }

    #[inline(always)]
    fn ribbon(&self, first: u32, y: usize) -> Ribbon {
        let depth = (f64::from(first) + 0.5) * self.slabs.width;
        let pixels = (SIDE - 1) as f64;
        let left = self.rays.line(self.slopes.ray(0, y), depth);
        let right = self.rays.line(self.slopes.ray(SIDE - 1, y), depth);
        let across = (right.start - left.start) / pixels;
        let behind = left.along * self.slabs.width;
        let wider = (right.along - left.along) * (self.slabs.width / pixels);
        Ribbon { first: left.start, across, behind, wider }
    }
}
