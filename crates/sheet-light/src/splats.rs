//! Splats that share the slabs of the volumes: classified before they are splatted, each with all of its optical depth in the slab
//! of its centre.
//!
//! A splat has no sections: what is a surface is thinner than a slab, and a medium's kernel is met whole by every ray. Within a slab
//! extinctions add, those of volumes too, and colours weigh by extinction.

use crate::picture::{Fragments, Picture};
use crate::slabs::Slabs;
use crate::tile::{SIDE, TILE};
use splat_core::raster::Projected;
use splat_core::raster::bins::{self, Bins};
use splat_core::raster::lanes::{Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;
use splat_core::raster::source::{Source, TileRays};
use splat_core::raster::tile::{Line, PIXELS, Runs, position};
use splat_core::shade::ChannelLayout;
use splat_core::{Accumulator, Material};
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
    /// View depths of the nearest and the farthest centre.
    pub(crate) fn reach(&self) -> [f64; 2] {
        let depths = self.order.iter().map(|i| self.depths[*i as usize]);
        depths.fold([f64::INFINITY, 0.0], |[near, far], z| [near.min(f64::from(z)), far.max(f64::from(z))])
    }

    pub(crate) fn bin(&self) -> Bins {
        bins::bin(self.projected, &self.order)
    }
}

/// Side of a block of pixels.
const BLOCK: usize = 4;
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
    /// For each block of pixels, by line: optical depths and the channels times them; then, where depths are asked for, view depth and
    /// thickness times the optical depth.
    lines: Vec<Line>,
    stride: usize,
    has_depths: bool,
    /// The first object of each pixel, block by block.
    objects: Vec<u32>,
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
        let sums = Sums {
            lines: Vec::new(),
            stride: 0,
            has_depths: false,
            objects: Vec::new(),
            tags: [0; SIDE],
            is_empty: true,
        };
        Self { squares: Vec::new(), sums }
    }

    /// Finds the splats of the tile at `corner` whose centres lie in a range of depths. Whether there are any.
    pub(crate) fn begin(&mut self, of: Drawn<'_>, corner: [usize; 2], range: &Range<f64>, into: &Accumulator) -> bool {
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
        self.sums.resize(if any { COLUMNS * COLUMNS } else { 0 }, into);
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
    fn resize(&mut self, blocks: usize, into: &Accumulator) {
        self.has_depths = !into.depth.is_empty();
        self.stride = into.optical_depth.len() + into.channels.len() + if self.has_depths { 2 } else { 0 };
        self.lines.clear();
        self.lines.resize(blocks * self.stride, Line([0.0; PIXELS]));
        self.objects.clear();
        self.objects.resize(if into.object.is_empty() { 0 } else { blocks * PIXELS }, u32::MAX);
        (self.tags, self.is_empty) = ([0; SIDE], true);
    }

    /// Forgets the splats of the slab before.
    fn clear(&mut self) {
        if !self.is_empty {
            self.lines.fill(Line([0.0; PIXELS]));
            self.objects.fill(u32::MAX);
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
        let source = Source::new(of.projected, i);
        let extinction = of.materials[source.splat.material as usize].extinction_rgb;
        let values = &of.values[i as usize * picture.channels..][..picture.channels];
        let mut fragments = 0;
        for run in Runs::new(simd, source.splat, of.projected.size, corner) {
            let [x, y] = position(run.block * PIXELS, corner[0], corner[1]);
            // The square reaches beyond the tile.
            let (x, y) = (x.wrapping_sub(picture.corner[0]), y.wrapping_sub(picture.corner[1]));
            if x >= TILE || y >= TILE {
                continue;
            }
            let (bits, rows) = (0xf << (x + 1), y + 1..y + 1 + BLOCK);
            if picture.open[rows.clone()].iter().all(|row| row & bits == 0) {
                continue;
            }
            self.tags[rows].iter_mut().for_each(|row| *row |= bits);
            self.is_empty = false;
            fragments += Lanes::<S>::COUNT as u64;
            let block = y / BLOCK * COLUMNS + x / BLOCK;
            let tau = source.optical_depth(simd, run, rays);
            let lines = &mut self.lines[block * self.stride..][..self.stride];
            let mut add = |line: usize, v: Lanes<S>| {
                let to = &mut lines[line].0[run.lane..];
                (Lanes::load(simd, to) + v).store(to);
            };
            let of_plane = |p: usize| tau * Lanes::splat(simd, extinction[p]);
            (0..picture.planes).for_each(|p| add(p, of_plane(p)));
            for (c, value) in values.iter().enumerate() {
                let p = ChannelLayout::plane_of(c, picture.channels, picture.planes);
                add(picture.planes + c, of_plane(p) * Lanes::splat(simd, *value));
            }
            if self.has_depths {
                let (green, line) = (of_plane(picture.planes / 2), picture.planes + picture.channels);
                add(line, green * source.view_depth(simd, run, rays));
                add(line + 1, green * Lanes::splat(simd, source.thickness()));
            }
            if !self.objects.is_empty() {
                self.name::<S>(of.projected.objects[i as usize], block * PIXELS + run.lane, tau);
            }
        }
        fragments
    }

    /// Names the pixels that a splat is the first to hide something of.
    #[inline(always)]
    fn name<S: Simd>(&mut self, object: u32, at: usize, tau: Lanes<S>) {
        let mut hidden = [0.0; MAX_LANES];
        tau.store(&mut hidden);
        for (to, tau) in self.objects[at..].iter_mut().zip(&hidden[..Lanes::<S>::COUNT]) {
            if *tau > 0.0 && *to == u32::MAX {
                *to = object;
            }
        }
    }

    /// The pixels from (x, y) of the tile on, of one line.
    #[inline(always)]
    fn row<S: Simd>(&self, simd: S, line: usize, [x, y]: [usize; 2]) -> Lanes<S> {
        let mut row = [0.0; MAX_LANES];
        for group in 0..Lanes::<S>::COUNT / BLOCK {
            let block = y / BLOCK * COLUMNS + x / BLOCK + group;
            let from = &self.lines[block * self.stride + line].0[y % BLOCK * BLOCK..][..BLOCK];
            row[group * BLOCK..][..BLOCK].copy_from_slice(from);
        }
        Lanes::load(simd, &row)
    }

    /// Adds the splats of the pixels from (x, y) on to what volumes have there; nothing where there are none.
    #[inline(always)]
    pub(crate) fn add<S: Simd>(
        &self,
        simd: S,
        [x, y]: [usize; 2],
        origin: f64,
        picture: &Picture,
        fragments: &mut Fragments,
    ) {
        let bits = ((1 << Lanes::<S>::COUNT) - 1) << (x + 1);
        if self.tags[y + 1] & bits == 0 {
            return;
        }
        let zero = Lanes::splat(simd, 0.0);
        let mut before = [zero; 3];
        if fragments.any {
            (0..picture.planes).for_each(|p| before[p] = Lanes::load(simd, &fragments.optical_depth[p]));
        }
        let least = Lanes::splat(simd, f32::MIN_POSITIVE);
        let mut inverse = [zero; 3];
        for p in 0..picture.planes {
            let all = before[p] + self.row(simd, p, [x, y]);
            all.store(&mut fragments.optical_depth[p]);
            inverse[p] = Lanes::splat(simd, 1.0) / all.max(least);
        }
        for c in 0..picture.channels {
            let p = ChannelLayout::plane_of(c, picture.channels, picture.planes);
            let own = self.row(simd, picture.planes + c, [x, y]);
            let volumes = if fragments.any { before[p] * Lanes::load(simd, &fragments.values[c]) } else { zero };
            ((own + volumes) * inverse[p]).store(&mut fragments.values[c]);
        }
        if self.has_depths || !self.objects.is_empty() {
            let green = picture.planes / 2;
            let mut share = [0.0; MAX_LANES];
            (self.row(simd, green, [x, y]) * inverse[green]).store(&mut share);
            self.extras::<S>(simd, [x, y], (&share, origin), picture, fragments);
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
        picture: &Picture,
        fragments: &mut Fragments,
    ) {
        let (green, line) = (picture.planes / 2, picture.planes + picture.channels);
        let (mut depth, mut thickness) = ([0.0; MAX_LANES], [0.0; MAX_LANES]);
        let mut tau = [0.0; MAX_LANES];
        self.row(simd, green, [x, y]).store(&mut tau);
        if self.has_depths {
            self.row(simd, line, [x, y]).store(&mut depth);
            self.row(simd, line + 1, [x, y]).store(&mut thickness);
        }
        for lane in 0..Lanes::<S>::COUNT {
            if tau[lane] <= 0.0 {
                continue;
            }
            if self.has_depths {
                let middle = (f64::from(depth[lane] / tau[lane]) - origin) as f32;
                let half = 0.5 * thickness[lane] / tau[lane];
                let mix = |volumes: f32, own: f32| {
                    if share[lane] >= 1.0 || !fragments.any { own } else { volumes + (own - volumes) * share[lane] }
                };
                fragments.near[lane] = mix(fragments.near[lane], middle - half);
                fragments.far[lane] = mix(fragments.far[lane], middle + half);
            }
            if !self.objects.is_empty() && (share[lane] > 0.5 || !fragments.any) {
                let block = y / BLOCK * COLUMNS + (x + lane) / BLOCK;
                fragments.object[lane] = self.objects[block * PIXELS + y % BLOCK * BLOCK + (x + lane) % BLOCK];
            }
        }
    }
}
