//! Walking a footprint through a tile: blocks of 4x4 pixels, each as many vectors as its 16 pixels take.
//!
//! Pixels of a tile are kept block by block, 16 numbers each, row by row inside. A footprint of 3x3 pixels touches 2.25
//! blocks on average; whole rows of as many lanes would be touched 3.4 times, and blocks never overlap in memory, so a
//! store is never half of the next load.
//!
//! What blends splats in another way than [`fold`](super::fold) does walks tiles by the same few names:
//!
//! ```
//! use splat_core::raster::{Detail, Params, ProjectInput, Projected, project, pulp};
//! use splat_core::raster::{bins::{Bins, bin}, lanes::{Broadcast, Lanes}, tile::{AREA, Runs}};
//! use splat_core::{Camera, Cloud, FootprintStack, Material, Projection, Splat, glam::DVec3};
//!
//! /// The sum of all optical depths in a tile.
//! struct Sum<'a>(&'a Projected, &'a Bins, usize);
//!
//! impl pulp::WithSimd for Sum<'_> {
//!     type Output = f32;
//!
//!     fn with_simd<S: pulp::Simd>(self, simd: S) -> f32 {
//!         let Self(projected, bins, t) = self;
//!         let corner = bins.corner(t);
//!         let mut plane = vec![0.0; AREA];
//!         let factors = projected.ray_factors(corner);
//!         for &id in bins.tile(t).flatten() {
//!             let splat = &projected.splats[id as usize];
//!             for run in Runs::new(simd, splat, projected.size, corner) {
//!                 let s = run.distance_sq(simd, splat) * Lanes::load(simd, &factors[run.pixel()..]);
//!                 let kernel = projected.kernel(splat);
//!                 let tau = simd.lanes(splat.peak) * kernel.profile(simd, (simd.lanes(1.0) - s).max(simd.lanes(0.0)));
//!                 (Lanes::load(simd, &plane[run.pixel()..]) + tau).store(&mut plane[run.pixel()..]);
//!             }
//!         }
//!         plane.iter().sum()
//!     }
//! }
//!
//! let mut cloud = Cloud::new(DVec3::ZERO);
//! cloud.push(&Splat { radius: 0.5, cross_section: 0.2, ..Splat::default() });
//! let view = Projection::Orthographic { height: 2.0 };
//! let camera = Camera::look_at(DVec3::Z, DVec3::ZERO, DVec3::Y, view, [64, 64]).unwrap();
//! let footprints = &FootprintStack::default();
//! let materials = &[Material::default()];
//! let params = &Params::default();
//! let input = ProjectInput { cloud: &cloud, camera: &camera, footprints, materials, params, detail: Detail::ALL };
//! let projected = project(&input);
//! let bins = bin(&projected, &[0]);
//! let sum: f32 = (0..bins.tiles()).map(|t| pulp::Arch::new().dispatch(Sum(&projected, &bins, t))).sum();
//! // ∫τ dA is the cross-section, whatever the splat's size: 32 pixels are one unit of length.
//! assert!((sum / (32.0 * 32.0) - 0.2).abs() < 1e-4);
//! ```

use super::bins::TILE;
use super::lanes::{Broadcast, Lanes, MAX_LANES};
use super::projected::{ProjectedDepth, ProjectedSplat, SpecialDisc};
use pulp::Simd;

/// Side of a block, pixels.
const BLOCK: usize = 4;

/// Pixels in a block.
pub const PIXELS: usize = BLOCK * BLOCK;

/// Blocks in a row of a tile.
const COLUMNS: usize = TILE / BLOCK;

/// Blocks in a tile.
pub const BLOCKS: usize = COLUMNS * COLUMNS;

/// Pixels in a tile.
pub const AREA: usize = TILE * TILE;

/// Splats whose records are copied together before they are folded: the records of one tile lie far apart in memory,
/// and the misses of a batch overlap. Also how often a tile is looked at for being opaque.
pub const BATCH: usize = 64;

/// Offsets of the pixels of a block from its first.
const X: [f32; PIXELS] = [0., 1., 2., 3., 0., 1., 2., 3., 0., 1., 2., 3., 0., 1., 2., 3.];
const Y: [f32; PIXELS] = [0., 0., 0., 0., 1., 1., 1., 1., 2., 2., 2., 2., 3., 3., 3., 3.];

/// One number for each pixel of a block, in one cache line.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub struct Line(pub [f32; PIXELS]);

const _: () = assert!(PIXELS == MAX_LANES, "a block is the widest vector");

/// Some pixels of a block under a footprint, as many as there are lanes.
#[derive(Clone, Copy)]
pub struct Run<S: Simd> {
    /// Block of the tile, row by row.
    pub block: usize,
    /// First pixel within the block.
    pub lane: usize,
    /// Offsets from the splat's centre, pixels.
    dx: Lanes<S>,
    dy: Lanes<S>,
}

/// The [runs](Run) of one splat in one tile, in the order of memory. An iterator and no function that calls back: only what is surely inlined is
/// compiled for the instruction set.
pub struct Runs<S: Simd> {
    simd: S,
    /// Blocks left, and the lane of the next run.
    blocks: usize,
    lane: usize,
    /// Columns of blocks under the footprint.
    x0: usize,
    x1: usize,
    x: usize,
    y: usize,
    /// Offset of the tile's first pixel from the splat's centre.
    origin: [f32; 2],
}

impl<S: Simd> Runs<S> {
    /// The runs of `splat` in the tile whose first pixel is `origin`.
    #[inline(always)]
    pub fn new(simd: S, splat: &ProjectedSplat, size: [u32; 2], origin: [usize; 2]) -> Self {
        let [x0, x1, y0, y1] = splat.bounds(size);
        let (x0, x1) = block_range(x0, x1, origin[0]);
        let (y0, y1) = block_range(y0, y1, origin[1]);
        let [cx, cy] = splat.center_px;
        Self {
            simd,
            blocks: x1.saturating_sub(x0) * y1.saturating_sub(y0),
            lane: 0,
            x0,
            x1,
            x: x0,
            y: y0,
            origin: [origin[0] as f32 + 0.5 - cx, origin[1] as f32 + 0.5 - cy],
        }
    }

    /// Pixels of all runs.
    #[inline(always)]
    pub fn pixels(&self) -> u64 {
        (self.blocks * PIXELS) as u64
    }
}

/// What the columns and rows of blocks under a footprint give to s at their pixels, so that [`Run::distance_sq_by`] takes two steps.
pub(crate) struct Conic {
    dx: [Line; COLUMNS],
    /// The conic's second number times dy.
    mixed: [Line; COLUMNS],
    /// Its third times dy².
    square: [Line; COLUMNS],
}

impl Conic {
    pub(crate) const fn new() -> Self {
        const EMPTY: [Line; COLUMNS] = [Line([0.0; PIXELS]); COLUMNS];
        Self { dx: EMPTY, mixed: EMPTY, square: EMPTY }
    }

    /// Of a splat, where its runs are.
    #[inline(always)]
    pub(crate) fn fill<S: Simd>(&mut self, simd: S, splat: &ProjectedSplat, runs: &Runs<S>) {
        let rows = runs.y..runs.y + runs.blocks / (runs.x1 - runs.x0).max(1);
        for lane in (0..PIXELS).step_by(Lanes::<S>::COUNT) {
            for x in runs.x0..runs.x1 {
                offset(simd, runs.origin[0], x, &X[lane..]).store(&mut self.dx[x % COLUMNS].0[lane..]);
            }
            for y in rows.clone() {
                let dy = offset(simd, runs.origin[1], y, &Y[lane..]);
                (simd.lanes(splat.conic[1]) * dy).store(&mut self.mixed[y % COLUMNS].0[lane..]);
                (simd.lanes(splat.conic[2]) * dy * dy).store(&mut self.square[y % COLUMNS].0[lane..]);
            }
        }
    }
}

/// Distances of some pixels of the `block`-th column or row from a splat's centre, from that of the tile's first pixel.
#[inline(always)]
fn offset<S: Simd>(simd: S, origin: f32, block: usize, within: &[f32]) -> Lanes<S> {
    let place = simd.lanes((BLOCK * block) as f32) + Lanes::load(simd, within);
    simd.lanes(origin) + place
}

impl<S: Simd> Iterator for Runs<S> {
    type Item = Run<S>;

    #[inline(always)]
    fn next(&mut self) -> Option<Run<S>> {
        if self.blocks == 0 {
            return None;
        }
        let simd = self.simd;
        let lane = self.lane;
        let dx = offset(simd, self.origin[0], self.x, &X[lane..]);
        let dy = offset(simd, self.origin[1], self.y, &Y[lane..]);
        let run = Run { block: self.y * COLUMNS + self.x, lane, dx, dy };
        self.lane = (lane + Lanes::<S>::COUNT) % PIXELS;
        if self.lane == 0 {
            self.blocks -= 1;
            // One count for the rectangle: two nested loops would be left at a guess twice.
            let wrapped = self.x + 1 == self.x1;
            (self.x, self.y) = if wrapped { (self.x0, self.y + 1) } else { (self.x + 1, self.y) };
        }
        Some(run)
    }
}

/// Blocks of the tile from pixel `origin` on that the pixels `low..high` lie in.
#[inline(always)]
fn block_range(low: u32, high: u32, origin: usize) -> (usize, usize) {
    let low = (low as usize).saturating_sub(origin);
    let high = (high as usize).saturating_sub(origin).min(TILE);
    (low / BLOCK, high.div_ceil(BLOCK))
}

impl<S: Simd> Run<S> {
    /// Index of the first pixel in a plane of the tile.
    #[inline(always)]
    pub fn pixel(&self) -> usize {
        self.block * PIXELS + self.lane
    }

    /// s of each pixel; for a medium in perspective yet to be multiplied by the pixel's 1/|d|².
    #[inline(always)]
    pub fn distance_sq(&self, simd: S, splat: &ProjectedSplat) -> Lanes<S> {
        let along = simd.lanes(splat.conic[0]).mul_add(self.dx, simd.lanes(splat.conic[1]) * self.dy);
        along.mul_add(self.dx, simd.lanes(splat.conic[2]) * self.dy * self.dy)
    }

    /// [`Run::distance_sq`] of the splat that `conic` was made of, bit for bit.
    #[inline(always)]
    pub(crate) fn distance_sq_by(&self, simd: S, splat: &ProjectedSplat, conic: &Conic) -> Lanes<S> {
        let column = self.block % COLUMNS;
        let row = self.block / COLUMNS % COLUMNS;
        let dx = Lanes::load(simd, &conic.dx[column].0[self.lane..]);
        let mixed = Lanes::load(simd, &conic.mixed[row].0[self.lane..]);
        let square = Lanes::load(simd, &conic.square[row].0[self.lane..]);
        let along = simd.lanes(splat.conic[0]).mul_add(dx, mixed);
        along.mul_add(dx, square)
    }

    /// s and view depths of a special disc. Where it lies behind the eye, s is 1 and the depth the largest number.
    #[inline(always)]
    pub fn meet(&self, simd: S, splat: &ProjectedSplat, disc: &SpecialDisc, perspective: bool) -> [Lanes<S>; 2] {
        let mut s = self.distance_sq(simd, splat);
        let rise = self.rise(simd, disc);
        if !disc.crosses {
            return [s, simd.lanes(disc.center) + rise.max(simd.lanes(-disc.extent)).min(simd.lanes(disc.extent))];
        }
        let mut depth = simd.lanes(disc.center) + rise;
        if perspective {
            let w = simd.lanes(1.0) - rise / simd.lanes(disc.center);
            s = s / (w * w);
            depth = simd.lanes(disc.center) / w;
        }
        let depth = depth.min(simd.lanes(f32::MAX));
        [
            s.where_less_or(simd.lanes(0.0), depth, simd.lanes(1.0)),
            depth.where_less_or(simd.lanes(0.0), depth, simd.lanes(f32::MAX)),
        ]
    }

    /// Places on a special disc in units of its semi-axes, from pixels about its centre by `to_disc`.
    #[inline(always)]
    pub(crate) fn places(
        &self,
        simd: S,
        to_disc: &[f32; 4],
        disc: &SpecialDisc,
        perspective: bool,
    ) -> [[f32; MAX_LANES]; 2] {
        let [a, b, c, d] = *to_disc;
        let mut x = simd.lanes(a) * self.dx + simd.lanes(b) * self.dy;
        let mut y = simd.lanes(c) * self.dx + simd.lanes(d) * self.dy;
        if disc.crosses && perspective {
            let w = simd.lanes(1.0) - self.rise(simd, disc) / simd.lanes(disc.center);
            (x, y) = (x / w, y / w);
        }
        let mut places = [[0.0; MAX_LANES]; 2];
        x.store(&mut places[0]);
        y.store(&mut places[1]);
        places
    }

    /// How much deeper a disc lies than at its centre, as a plane seen by parallel rays.
    #[inline(always)]
    fn rise(&self, simd: S, disc: &SpecialDisc) -> Lanes<S> {
        simd.lanes(disc.slope[0]) * self.dx + simd.lanes(disc.slope[1]) * self.dy
    }

    /// View depths: the plane of a disc.
    #[inline(always)]
    pub fn depth(&self, simd: S, depth: &ProjectedDepth) -> Lanes<S> {
        let offset = simd.lanes(depth.slope[0]) * self.dx + simd.lanes(depth.slope[1]) * self.dy;
        simd.lanes(depth.center) + offset.max(simd.lanes(-depth.extent)).min(simd.lanes(depth.extent))
    }
}

/// Pixels of the tile at (x, y) that lie in the image, in spans of neighbours: their range in a plane of the tile and
/// in the image.
pub fn for_each_span(
    size: [u32; 2],
    x: usize,
    y: usize,
    mut visit: impl FnMut(std::ops::Range<usize>, std::ops::Range<usize>),
) {
    let [width, height] = size.map(|s| s as usize);
    for row in 0..TILE.min(height - y) {
        for column in (0..TILE.min(width - x)).step_by(BLOCK) {
            let tile = ((row / BLOCK) * COLUMNS + column / BLOCK) * PIXELS + (row % BLOCK) * BLOCK;
            let image = (y + row) * width + x + column;
            let n = BLOCK.min(width - x - column);
            visit(tile..tile + n, image..image + n);
        }
    }
}

/// Image position of pixel `k` of a plane of the tile at (x, y).
pub fn position(k: usize, x: usize, y: usize) -> [usize; 2] {
    let block = k / PIXELS;
    let pixel = k % PIXELS;
    [x + BLOCK * (block % COLUMNS) + pixel % BLOCK, y + BLOCK * (block / COLUMNS) + pixel / BLOCK]
}

/// The part of a plane of the image in the tile at `corner`, `fill` outside the image; nothing of an empty plane.
///
/// # Panics
/// If the plane is shorter than the image.
pub fn tile_of<T: Copy>(plane: &[T], size: [u32; 2], pixel: [usize; 2], fill: T) -> Vec<T> {
    let [x, y] = pixel;
    let mut out = vec![fill; if plane.is_empty() { 0 } else { AREA }];
    if !plane.is_empty() {
        for_each_span(size, x, y, |tile, image| out[tile].copy_from_slice(&plane[image]));
    }
    out
}
