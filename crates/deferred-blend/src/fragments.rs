//! Collects the fragments of each pixel: tiles of the image, blocks of a tile, pixels of a block.
//!
//! A block has 16 pixels, so its fragments fit into the first-level cache for any number of layers. Memory does not grow with the
//! number of pixels times the number of discs at one place.

use crate::disc::{Disc, Discs, Meeting};
use splat_core::raster::bins::Bins;
use splat_core::raster::lanes::{Broadcast, Lanes, MAX_LANES};
use splat_core::raster::pulp::{self, Simd};
use splat_core::raster::tile::{BLOCKS, PIXELS, position};

/// Pixels along a side of a block.
const SIDE: usize = 4;
/// Blocks in a row of a tile.
const COLUMNS: usize = 8;
const _: () = assert!(SIDE * SIDE == PIXELS && COLUMNS * COLUMNS == BLOCKS, "blocks are square");

/// One disc on the ray of a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Fragment {
    /// View depth, > 0.
    pub(crate) depth: f32,
    /// Rank among the discs.
    pub(crate) disc: u32,
    /// Whose surface it is on.
    pub(crate) object: u32,
    /// w of Eq. 1.
    pub(crate) weight: f32,
    /// ρ²/R², R the radius within which the disc counts.
    pub(crate) distance_sq: f32,
    /// |N|: how much nearer two planes across the normal are than their depths along the ray.
    pub(crate) facing: f32,
}

/// Which discs touch which blocks of a tile, in CSR form.
#[derive(Debug, Default)]
pub(crate) struct BlockLists {
    starts: Vec<u32>,
    discs: Vec<u32>,
}

impl BlockLists {
    /// Of tile `t`.
    pub(crate) fn fill(&mut self, discs: &Discs, bins: &Bins, t: usize) {
        let corner = bins.corner(t);
        self.starts.clear();
        self.starts.resize(BLOCKS + 2, 0);
        for &i in bins.tile(t).flatten() {
            for_each_block(&discs.discs[i as usize], corner, |b| self.starts[b + 2] += 1);
        }
        for b in 2..self.starts.len() {
            self.starts[b] += self.starts[b - 1];
        }
        self.discs.clear();
        self.discs.resize(self.starts[BLOCKS + 1] as usize, 0);
        for &i in bins.tile(t).flatten() {
            for_each_block(&discs.discs[i as usize], corner, |b| {
                self.discs[self.starts[b + 1] as usize] = i;
                self.starts[b + 1] += 1;
            });
        }
    }

    /// The discs that touch a block.
    pub(crate) fn block(&self, b: usize) -> &[u32] {
        &self.discs[self.starts[b] as usize..self.starts[b + 1] as usize]
    }
}

fn for_each_block(disc: &Disc, corner: [usize; 2], mut visit: impl FnMut(usize)) {
    let [x0, x1, y0, y1] = disc.pixels.map(|v| v as usize);
    let range = |low: usize, high: usize, origin: usize| {
        let end = SIDE * COLUMNS;
        low.saturating_sub(origin).min(end) / SIDE..high.saturating_sub(origin).min(end).div_ceil(SIDE)
    };
    for row in range(y0, y1, corner[1]) {
        for column in range(x0, x1, corner[0]) {
            visit(row * COLUMNS + column);
        }
    }
}

/// One tile, in the form that [`pulp`] compiles once per instruction set: every pixel's fragments, in any order, are handed to a
/// visitor, with the pixel's place in a plane of the tile.
pub(crate) struct WalkTile<'a, V> {
    pub(crate) discs: &'a Discs,
    pub(crate) lists: &'a BlockLists,
    pub(crate) corner: [usize; 2],
    pub(crate) visit: V,
}

impl<V: FnMut(usize, &mut [Fragment])> pulp::WithSimd for WalkTile<'_, V> {
    /// Fragments.
    type Output = u64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> u64 {
        let Self { discs, lists, corner, mut visit } = self;
        let mut pixels: [Vec<Fragment>; PIXELS] = Default::default();
        let mut count = 0;
        for b in 0..BLOCKS {
            pixels.iter_mut().for_each(Vec::clear);
            for &i in lists.block(b) {
                meet_block(simd, discs, i, b, corner, &mut pixels);
            }
            for (k, fragments) in pixels.iter_mut().enumerate() {
                let pixel = b * PIXELS + k;
                let [x, y] = position(pixel, corner[0], corner[1]);
                if fragments.is_empty() || x >= discs.size[0] as usize || y >= discs.size[1] as usize {
                    continue;
                }
                count += fragments.len() as u64;
                visit(pixel, fragments);
            }
        }
        count
    }
}

/// The fragments of a disc in a block.
#[inline(always)]
fn meet_block<S: Simd>(
    simd: S,
    discs: &Discs,
    i: u32,
    b: usize,
    corner: [usize; 2],
    pixels: &mut [Vec<Fragment>; PIXELS],
) {
    let disc = &discs.discs[i as usize];
    let look = &discs.looks[i as usize];
    let kernel = &discs.kernels[look.footprint as usize];
    let first = position(b * PIXELS, corner[0], corner[1]);
    for lane in (0..PIXELS).step_by(Lanes::<S>::COUNT) {
        let Meeting { facing, distance_sq, depth, .. } = disc.meet(simd, offsets(simd, disc, first, lane));
        let weight = kernel.profile(
            simd,
            (simd.lanes(1.0) - distance_sq).max(simd.lanes(0.0)).where_less(distance_sq, simd.lanes(1.0)),
        );
        let mut hits = [[0.0; MAX_LANES]; 4];
        for (value, to) in
            [weight.where_less(simd.lanes(0.0), depth), depth, distance_sq, facing.abs()].iter().zip(&mut hits)
        {
            value.store(to);
        }
        for k in 0..Lanes::<S>::COUNT {
            // Depths beyond the largest number lie behind everything that could be seen.
            if hits[0][k] > 0.0 && hits[1][k] < f32::INFINITY {
                let [weight, depth, distance_sq, facing] = hits.map(|h| h[k]);
                pixels[lane + k].push(Fragment { depth, disc: i, object: look.object, weight, distance_sq, facing });
            }
        }
    }
}

/// Offsets from a disc's centre of the pixels from `lane` on of the block whose first pixel is `first`.
#[inline(always)]
pub(crate) fn offsets<S: Simd>(simd: S, disc: &Disc, first: [usize; 2], lane: usize) -> [Lanes<S>; 2] {
    let from_x = simd.lanes(first[0] as f32 + 0.5 - disc.center[0]);
    let from_y = simd.lanes(first[1] as f32 + 0.5 - disc.center[1]);
    [from_x + Lanes::load(simd, &X[lane..]), from_y + Lanes::load(simd, &Y[lane..])]
}

/// Offsets of the pixels of a block from its first.
const X: [f32; PIXELS] = [0., 1., 2., 3., 0., 1., 2., 3., 0., 1., 2., 3., 0., 1., 2., 3.];
const Y: [f32; PIXELS] = [0., 0., 0., 0., 1., 1., 1., 1., 2., 2., 2., 2., 3., 3., 3., 3.];
