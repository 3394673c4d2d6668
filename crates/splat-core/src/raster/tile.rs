//! Walking a footprint through a tile: runs of neighbouring pixels, as many as the machine has lanes.

use super::ProjectedSplat;
use super::bins::TILE;
use super::lanes::{Lanes, MAX_LANES};
use pulp::Simd;

/// Row stride of a tile buffer: a run that begins in the last column ends in the padding.
pub(crate) const STRIDE: usize = TILE + MAX_LANES;

/// Numbers in one plane of a tile.
pub(crate) const AREA: usize = STRIDE * TILE;

/// Splats whose records are copied together before they are folded: the records of one tile lie far apart in memory,
/// and the misses of a batch overlap. Also how often a tile is looked at for being opaque.
pub(crate) const BATCH: usize = 64;

/// A run of pixels under a footprint.
pub(crate) struct Run<'a> {
    pub(crate) splat: &'a ProjectedSplat,
    /// Offset of the first pixel in the planes of the tile.
    pub(crate) k: usize,
    /// Offset of the first pixel from the splat's centre, pixels.
    dx: f32,
    dy: f32,
}

/// Visits the runs of `splat` in the tile whose first pixel is `origin`.
#[inline(always)]
pub(crate) fn for_each_run<'a, S: Simd>(splat: &'a ProjectedSplat, origin: [usize; 2], mut visit: impl FnMut(Run<'a>)) {
    let [x0, x1, y0, y1] = splat.bounds.map(usize::from);
    let (x0, x1) = (x0.max(origin[0]), x1.min(origin[0] + TILE));
    for y in y0.max(origin[1])..y1.min(origin[1] + TILE) {
        let dy = y as f32 + 0.5 - splat.center_px[1];
        for x in (x0..x1).step_by(Lanes::<S>::COUNT) {
            let k = (y - origin[1]) * STRIDE + (x - origin[0]);
            visit(Run { splat, k, dx: x as f32 + 0.5 - splat.center_px[0], dy });
        }
    }
}

impl Run<'_> {
    /// s of each pixel; for a medium in perspective yet to be multiplied by the pixel's 1/|d|².
    #[inline(always)]
    pub(crate) fn distance_sq<S: Simd>(&self, simd: S) -> Lanes<S> {
        let of = |v: f32| Lanes::splat(simd, v);
        let [a, b, c] = self.splat.conic;
        let dx = of(self.dx) + Lanes::iota(simd);
        dx * dx * of(a) + dx * of(2.0 * b * self.dy) + of(c * self.dy * self.dy)
    }

    /// peak·w(s): optical depth, or the weight of an opaque disc.
    #[inline(always)]
    pub(crate) fn amount<S: Simd>(&self, simd: S, s: Lanes<S>) -> Lanes<S> {
        let of = |v: f32| Lanes::splat(simd, v);
        let q = of(self.splat.sharpness);
        let r = q - q * s.min(of(1.0));
        let taper = of(self.splat.rim) * (of(1.0) + r + of(0.5) * r * r);
        let w = ((q - r).exp_neg() - taper).max(of(0.0));
        of(self.splat.peak) * w.where_less(s, of(1.0))
    }

    /// View depths: the plane of a disc, the centre of a medium.
    #[inline(always)]
    pub(crate) fn depth<S: Simd>(&self, simd: S) -> Lanes<S> {
        let of = |v: f32| Lanes::splat(simd, v);
        let splat = self.splat;
        let dx = of(self.dx) + Lanes::iota(simd);
        let offset = of(splat.depth_slope[0]) * dx + of(splat.depth_slope[1] * self.dy);
        of(splat.depth) + offset.max(of(-splat.depth_extent)).min(of(splat.depth_extent))
    }
}

/// Ranges of each row of the tile at (x, y), in the tile's buffer and in the image.
pub(crate) fn for_each_row(
    size: [u32; 2],
    x: usize,
    y: usize,
    mut visit: impl FnMut(std::ops::Range<usize>, std::ops::Range<usize>),
) {
    let [width, height] = size.map(|s| s as usize);
    let columns = TILE.min(width - x);
    for row in 0..TILE.min(height - y) {
        let (tile, image) = (row * STRIDE, (y + row) * width + x);
        visit(tile..tile + columns, image..image + columns);
    }
}
