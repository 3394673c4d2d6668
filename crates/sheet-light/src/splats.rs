//! Splats that share the slabs of the volumes: classified before they are splatted, each with all of its optical depth in the slab
//! of its centre.
//!
//! A splat has no sections: what is a surface is thinner than a slab, and a medium's kernel is met whole by every ray. Within a slab
//! extinctions add, those of volumes too, and colours weigh by extinction.

use crate::lines::{BLOCK, Lines, Shown};
use crate::picture::{Fragments, Picture};
use crate::slabs::{MOST_BY_SPLATS, Slabs};
use crate::tile::{SIDE, TILE};
use splat_core::raster::Projected;
use splat_core::raster::bins::{self, Bins};
use splat_core::raster::lanes::{Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;
use splat_core::raster::source::{Source, TileRays};
use splat_core::raster::tile::{PIXELS, Runs, position};
use splat_core::{Accumulator, Material, SliceOrder};
use std::ops::Range;

/// Splats, projected and shaded.
#[derive(Debug, Clone)]
pub struct Splats<'a> {
    /// Footprints by id, with depths where something opaque hides them or depths are asked for, with objects where these are.
    pub projected: &'a Projected,
    /// View depths of the centres by id, world units.
    pub depths: Vec<f32>,
    /// The ids that are drawn, front to back.
    pub order: Vec<u32>,
    /// As many numbers a splat as the accumulator has channels, by id.
    pub values: &'a [f32],
    /// Extinction per channel, by id of the material.
    pub materials: &'a [Material],
    /// Width of the slabs where neither the parameters nor a volume give one, world units, > 0.
    pub slab_width: f64,
}

impl Splats<'_> {
    /// Width of slabs for splats in order: that of their slices, but not so little that most slabs are empty.
    pub fn slab_width(order: &SliceOrder) -> f64 {
        let whole = f64::from(order.far) - f64::from(order.near);
        order.thickness.max(whole / MOST_BY_SPLATS).max(f64::MIN_POSITIVE)
    }

    /// View depths of the nearest and the farthest centre.
    pub(crate) fn reach(&self) -> [f64; 2] {
        let depths = self.order.iter().map(|i| self.depths[*i as usize]);
        depths.fold([f64::INFINITY, 0.0], |[near, far], z| [near.min(f64::from(z)), far.max(f64::from(z))])
    }

    pub(crate) fn bin(&self) -> Bins {
        bins::bin(self.projected, &self.order)
    }
}

/// Blocks in a row of a tile.
const COLUMNS: usize = TILE / BLOCK;

/// The splats of one tile, and what those of one slab bring to it.
pub(crate) struct SplatSheet {
    /// The squares of the image that the tile lies in.
    squares: Vec<Square>,
    pub(crate) sums: Sums,
}

/// A square of the lists of splats.
struct Square {
    corner: [usize; 2],
    rays: TileRays,
    ids: Vec<u32>,
    next: usize,
}

/// Sums over the splats of one slab.
pub(crate) struct Sums {
    lines: Lines,
    /// Pixels of each row of the tile with its rim that have any.
    pub(crate) tags: [u64; SIDE],
    is_empty: bool,
}

/// What a tile reads of its splats.
#[derive(Clone, Copy)]
pub(crate) struct Drawn<'a> {
    pub(crate) splats: &'a Splats<'a>,
    pub(crate) bins: &'a Bins,
    /// Depth of what is opaque, a number a pixel or none at all.
    pub(crate) opaque: &'a [f32],
}

impl SplatSheet {
    pub(crate) fn new() -> Self {
        let sums = Sums { lines: Lines::default(), tags: [0; SIDE], is_empty: true };
        Self { squares: Vec::new(), sums }
    }

    /// Finds the splats of the tile at `corner` whose centres lie in a range of depths. Whether there are any.
    pub(crate) fn begin(
        &mut self,
        of: Drawn<'_>,
        corner: [usize; 2],
        range: &Range<f64>,
        (into, depths): (&Accumulator, bool),
    ) -> bool {
        let size = into.size.map(|s| s as usize);
        let columns = size[0].div_ceil(bins::TILE);
        let squares = |a: usize| corner[a] / bins::TILE..(corner[a] + TILE).min(size[a]).div_ceil(bins::TILE);
        self.squares.clear();
        for (row, column) in squares(1).flat_map(|row| squares(0).map(move |column| (row, column))) {
            let t = row * columns + column;
            let within = |i: &&u32| range.contains(&f64::from(of.splats.depths[**i as usize]));
            let ids: Vec<u32> = of.bins.tile(t).flatten().filter(within).copied().collect();
            if !ids.is_empty() {
                let corner = of.bins.corner(t);
                let rays = TileRays::new(of.splats.projected, of.opaque, corner);
                self.squares.push(Square { corner, rays, ids, next: 0 });
            }
        }
        let any = !self.squares.is_empty();
        self.sums.resize(if any { COLUMNS * COLUMNS } else { 0 }, (into, depths));
        any
    }

    /// Whether none is left.
    pub(crate) fn is_empty(&self) -> bool {
        self.squares.iter().all(|square| square.next == square.ids.len())
    }

    /// The slab of the nearest splat that is not summed up yet.
    pub(crate) fn next_slab(&self, splats: &Splats<'_>, slabs: &Slabs) -> Option<u32> {
        let next = |square: &Square| Some(f64::from(splats.depths[*square.ids.get(square.next)? as usize]));
        self.squares.iter().filter_map(next).map(|depth| slabs.at(depth)).min()
    }

    /// Sums up the splats of a slab, with those before it that no slab had. Fragments.
    #[inline(always)]
    pub(crate) fn fill<S: Simd>(
        &mut self,
        simd: S,
        of: Drawn<'_>,
        (slabs, slab): (&Slabs, u32),
        picture: &Picture,
    ) -> u64 {
        self.sums.clear();
        let behind = slabs.origin + f64::from(slab + 1) * slabs.width;
        let mut fragments = 0;
        for square in &mut self.squares {
            while let Some(i) = square.ids.get(square.next).copied() {
                if f64::from(of.splats.depths[i as usize]) >= behind {
                    break;
                }
                square.next += 1;
                fragments += self.sums.splat(simd, of.splats, i, (&square.rays, square.corner), picture);
            }
        }
        fragments
    }
}

impl Sums {
    fn resize(&mut self, blocks: usize, into: (&Accumulator, bool)) {
        self.lines.resize(blocks, COLUMNS, into);
        (self.tags, self.is_empty) = ([0; SIDE], true);
    }

    /// Forgets the splats of the slab before.
    fn clear(&mut self) {
        if !self.is_empty {
            self.lines.clear();
            (self.tags, self.is_empty) = ([0; SIDE], true);
        }
    }

    /// Adds a splat where pixels are seen through. Fragments.
    #[inline(always)]
    fn splat<S: Simd>(
        &mut self,
        simd: S,
        of: &Splats<'_>,
        i: u32,
        (rays, corner): (&TileRays, [usize; 2]),
        picture: &Picture,
    ) -> u64 {
        let values = &of.values[i as usize * picture.channels..][..picture.channels];
        let object = of.projected.objects.get(i as usize).copied().unwrap_or_default();
        let shown = Shown { source: Source::new(of.projected, i), values, object };
        let mut fragments = 0;
        for run in Runs::new(simd, shown.source.splat, of.projected.size, corner) {
            let [x, y] = position(run.block * PIXELS, corner[0], corner[1]);
            // The square reaches beyond the tile.
            let x = x.wrapping_sub(picture.corner[0]);
            let y = y.wrapping_sub(picture.corner[1]);
            if x >= TILE || y >= TILE {
                continue;
            }
            let bits = 0xf << (x + 1);
            let rows = y + 1..y + 1 + BLOCK;
            if picture.open[rows.clone()].iter().all(|row| row & bits == 0) {
                continue;
            }
            self.tags[rows].iter_mut().for_each(|row| *row |= bits);
            self.is_empty = false;
            fragments += Lanes::<S>::COUNT as u64;
            self.lines.add(simd, &shown, of.materials, (run, rays), [x / BLOCK, y / BLOCK]);
        }
        fragments
    }

    /// Shares of the pixels' splats from (x, y) on that lie between two depths of each, counted from the first slab.
    #[inline(always)]
    pub(crate) fn between<S: Simd>(
        &self,
        simd: S,
        at: [usize; 2],
        origin: f64,
        ends: &[[f32; MAX_LANES]; 2],
    ) -> [f32; MAX_LANES] {
        let mut shares = [0.0; MAX_LANES];
        if self.lines.is_empty() {
            return shares;
        }
        let [_, depth, thickness] = self.lines.depths(simd, at);
        for lane in 0..Lanes::<S>::COUNT {
            let middle = (f64::from(depth[lane]) - origin) as f32;
            let [from, to] = [0, 1].map(|n| share_before(ends[n][lane], middle, thickness[lane]));
            shares[lane] = to - from;
        }
        shares
    }

    /// Adds a part of the splats of the pixels from (x, y) on to what volumes have there; nothing where there are none.
    #[inline(always)]
    pub(crate) fn add<S: Simd>(
        &self,
        simd: S,
        at: [usize; 2],
        (origin, part): (f64, &[f32; MAX_LANES]),
        fragments: &mut Fragments,
    ) {
        let bits = ((1 << Lanes::<S>::COUNT) - 1) << (at[0] + 1);
        if self.tags[at[1] + 1] & bits == 0 {
            return;
        }
        let Fragments { any, optical_depth, values, .. } = fragments;
        let share = self.lines.blend(simd, at, *any, (optical_depth, values, part));
        if self.lines.has_extras() {
            self.extras::<S>(simd, at, (&share, origin), fragments);
        }
        fragments.any = true;
    }

    /// Depths weigh by extinction, and a pixel is of the object that has more of it.
    #[inline(always)]
    fn extras<S: Simd>(
        &self,
        simd: S,
        [x, y]: [usize; 2],
        (share, origin): (&[f32; MAX_LANES], f64),
        fragments: &mut Fragments,
    ) {
        let [tau, depth, thickness] = self.lines.depths(simd, [x, y]);
        for lane in (0..Lanes::<S>::COUNT).filter(|lane| tau[*lane] > 0.0) {
            let middle = (f64::from(depth[lane]) - origin) as f32;
            let half = 0.5 * thickness[lane];
            let mix = |volumes: f32, own: f32| {
                if share[lane] >= 1.0 || !fragments.any { own } else { volumes + (own - volumes) * share[lane] }
            };
            fragments.near[lane] = mix(fragments.near[lane], middle - half);
            fragments.far[lane] = mix(fragments.far[lane], middle + half);
            if let Some(object) = self.lines.object([x + lane, y]).filter(|_| share[lane] > 0.5 || !fragments.any) {
                fragments.object[lane] = object;
            }
        }
    }
}

/// Share of what is as thick as this around a depth that lies before a place.
#[inline]
pub(crate) fn share_before(place: f32, depth: f32, thickness: f32) -> f32 {
    if thickness == 0.0 {
        f32::from(u8::from(depth < place))
    } else {
        ((place - depth) / thickness + 0.5).clamp(0.0, 1.0)
    }
}
