//! Splats that share the slabs of the volumes: classified before they are splatted, each with all of its optical depth in the slab
//! of its centre.
//!
//! A splat has no sections: what is a surface is thinner than a slab, and a medium's kernel is met whole by every ray. Within a slab
//! extinctions add, those of volumes too, and colours weigh by extinction.

use super::picture::{Fragments, Picture};
use super::size::{SIDE, TILE};
use crate::shared::depths::{DepthSpans, share_before};
use crate::shared::input::Splats;
use crate::shared::lines::{BLOCK, Backdrop, Lines, PixelDepths, Shown};
use crate::shared::pixel::{Pixel, PixelForm};
use crate::shared::slabs::Slabs;
use splat_core::raster::bins::{self, Bins};
use splat_core::raster::lanes::{Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;
use splat_core::raster::source::{Source, TileRays};
use splat_core::raster::tile::{PIXELS, Runs, position};
use std::ops::Range;

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
    pub(crate) fn begin(&mut self, drawn: Drawn<'_>, corner: [usize; 2], range: &Range<f64>, form: PixelForm) -> bool {
        let size = drawn.splats.projected.size.map(|s| s as usize);
        let columns = size[0].div_ceil(bins::TILE);
        let squares = |a: usize| corner[a] / bins::TILE..(corner[a] + TILE).min(size[a]).div_ceil(bins::TILE);
        self.squares.clear();
        for (row, column) in squares(1).flat_map(|row| squares(0).map(move |column| (row, column))) {
            let t = row * columns + column;
            let within = |i: &&u32| range.contains(&f64::from(drawn.splats.depths[**i as usize]));
            let ids: Vec<u32> = drawn.bins.tile(t).flatten().filter(within).copied().collect();
            if !ids.is_empty() {
                let corner = drawn.bins.corner(t);
                let rays = TileRays::new(drawn.splats.projected, drawn.opaque, corner);
                self.squares.push(Square { corner, rays, ids, next: 0 });
            }
        }
        let any = !self.squares.is_empty();
        self.sums.resize(if any { COLUMNS * COLUMNS } else { 0 }, form);
        any
    }

    /// Whether none is left.
    pub(crate) fn is_empty(&self) -> bool {
        self.squares.iter().all(|square| square.next == square.ids.len())
    }

    /// The slab of the nearest splat that is not summed up yet.
    pub(crate) fn next_slab(&self, splats: &Splats<'_>, slabs: &Slabs) -> Option<u32> {
        let next = |square: &Square| Some(f64::from(splats.depths[*square.ids.get(square.next)? as usize]));
        self.squares.iter().filter_map(next).map(|depth| slabs.slab_at(depth)).min()
    }

    /// Sums up the splats of a slab, with those before it that no slab had. Fragments.
    #[inline(always)]
    pub(crate) fn fill<S: Simd>(
        &mut self,
        simd: S,
        drawn: Drawn<'_>,
        slabs: &Slabs,
        slab: u32,
        picture: &Picture,
    ) -> u64 {
        self.sums.clear();
        let behind = slabs.origin + f64::from(slab + 1) * slabs.width;
        let mut fragments = 0;
        for square in &mut self.squares {
            while let Some(i) = square.ids.get(square.next).copied() {
                if f64::from(drawn.splats.depths[i as usize]) >= behind {
                    break;
                }
                square.next += 1;
                fragments += self.sums.splat(simd, drawn.splats, i, &square.rays, square.corner, picture);
            }
        }
        fragments
    }
}

impl Sums {
    fn resize(&mut self, blocks: usize, form: PixelForm) {
        self.lines.resize(blocks, COLUMNS, form);
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
        splats: &Splats<'_>,
        i: u32,
        rays: &TileRays,
        corner: [usize; 2],
        picture: &Picture,
    ) -> u64 {
        let values = &splats.values[i as usize * picture.channels..][..picture.channels];
        let object = splats.projected.objects.get(i as usize).copied().unwrap_or_default();
        let shown = Shown { source: Source::new(splats.projected, i), values, object };
        let mut fragments = 0;
        for run in Runs::new(simd, shown.source.splat, splats.projected.size, corner) {
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
            let block = Pixel { x: x / BLOCK, y: y / BLOCK };
            self.lines.add(simd, &shown, splats.materials, run, rays, block);
        }
        fragments
    }

    /// Shares of the splats of the pixels from `first` on that lie between two depths of each.
    #[inline(always)]
    pub(crate) fn between<S: Simd>(&self, simd: S, first: Pixel, origin: f64, spans: &DepthSpans) -> [f32; MAX_LANES] {
        let mut shares = [0.0; MAX_LANES];
        if self.lines.is_empty() {
            return shares;
        }
        let PixelDepths { depth, thickness, .. } = self.lines.depths(simd, first);
        for lane in 0..Lanes::<S>::COUNT {
            let middle = (f64::from(depth[lane]) - origin) as f32;
            let [from, to] = [spans.from[lane], spans.to[lane]].map(|end| share_before(end, middle, thickness[lane]));
            shares[lane] = to - from;
        }
        shares
    }

    /// Adds a share of the splats of the pixels from `first` on to what volumes have there; nothing where there are none.
    #[inline(always)]
    pub(crate) fn add<S: Simd>(
        &self,
        simd: S,
        first: Pixel,
        origin: f64,
        share: &[f32; MAX_LANES],
        fragments: &mut Fragments,
    ) {
        let bits = ((1 << Lanes::<S>::COUNT) - 1) << (first.x + 1);
        if self.tags[first.y + 1] & bits == 0 {
            return;
        }
        let Fragments { any, optical_depth, values, .. } = fragments;
        let backdrop = Backdrop { optical_depth, values, is_any: *any };
        let share_of_green = self.lines.blend(simd, first, share, backdrop);
        if self.lines.has_extras() {
            self.extras::<S>(simd, first, &share_of_green, origin, fragments);
        }
        fragments.any = true;
    }

    /// Depths weigh by extinction, and a pixel is of the object that has more of it.
    #[inline(always)]
    fn extras<S: Simd>(&self, simd: S, first: Pixel, share: &[f32; MAX_LANES], origin: f64, fragments: &mut Fragments) {
        let PixelDepths { optical_depth: tau, depth, thickness } = self.lines.depths(simd, first);
        for lane in (0..Lanes::<S>::COUNT).filter(|lane| tau[*lane] > 0.0) {
            let middle = (f64::from(depth[lane]) - origin) as f32;
            let half = 0.5 * thickness[lane];
            let mix = |volumes: f32, of_splats: f32| {
                if share[lane] >= 1.0 || !fragments.any {
                    of_splats
                } else {
                    volumes + (of_splats - volumes) * share[lane]
                }
            };
            fragments.near[lane] = mix(fragments.near[lane], middle - half);
            fragments.far[lane] = mix(fragments.far[lane], middle + half);
            let pixel = Pixel { x: first.x + lane, y: first.y };
            if let Some(object) = self.lines.object(pixel).filter(|_| share[lane] > 0.5 || !fragments.any) {
                fragments.object[lane] = object;
            }
        }
    }
}
