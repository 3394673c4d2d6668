//! Footprints in the image, packed: what a fragment reads takes half a cache line, what only some scenes need lies apart.

use super::bins::TILE;
use super::kernel::Kernel;
use super::tile::{AREA, position};
use crate::SplatKind;
use rayon::prelude::*;

/// The footprint of one splat in the image. Pixel centres lie at half-integers, y runs down.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C, align(32))]
pub struct ProjectedSplat {
    /// Image position of the centre, pixels.
    pub center_px: [f32; 2],
    /// s = a·dx² + b·dx·dy + c·dy² in 1/pixel², s < 1 inside; for a medium in perspective times the pixel's 1/|d|². Of a Gaussian half the
    /// square of the distance in standard deviations.
    pub conic: [f32; 3],
    /// Optical depth where the profile is 1: K·norm/R². For an opaque splat the weight there, area·norm/R²; of a Gaussian the opacity of its
    /// centre.
    pub peak: f32,
    /// Half the extent in x and y, pixels: the upper halves of f32s, rounded up. The sign of the first marks a [`SpecialDisc`],
    /// that of the second a Gaussian.
    pub(crate) half_extent: [u16; 2],
    /// Material id.
    pub material: u16,
    /// Footprint id.
    pub footprint: u8,
    /// Medium, surface or opaque.
    pub kind: SplatKind,
}

/// View depth across a footprint.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ProjectedDepth {
    /// View depth of the centre.
    pub center: f32,
    /// Change per pixel across a disc. Of a medium, one over half the width of its share before a plane, and one over the share that lies
    /// before the eye; of a Gaussian the change of the depth where it lies on average.
    pub slope: [f32; 2],
    /// Largest distance in depth between a fragment and the centre: R.
    pub extent: f32,
    /// The conic of a disc without the image's filter, which tells where an opaque one is solid. The first number of a Gaussian's is one over
    /// half the width of its share before a plane.
    pub core: [f32; 3],
}

/// A disc of which its conic does not tell everything: it reaches through the eye plane, or its footprint is an image.
///
/// Which pixels see what reaches through the eye plane, each of its fragments tells.
/// In perspective w = 1 − slope·(dx, dy)/z is (n·d)/(n·c/z) for a pixel's ray d: the ray meets the disc's plane at the depth
/// z/w, and s is the conic over w². For parallel rays the depth is linear and s the conic.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpecialDisc {
    pub(crate) id: u32,
    /// View depth of the centre.
    pub(crate) center: f32,
    /// Change of depth per pixel at the centre.
    pub(crate) slope: [f32; 2],
    /// Largest distance in depth between a fragment and the centre, R; of a disc through the eye plane it does not count.
    pub(crate) extent: f32,
    /// Whether it reaches through the eye plane.
    pub(crate) crosses: bool,
    /// n·c/z, and the |cosine| that a slab's peak was divided by; 0 for what is no slab, or does not reach through the eye plane.
    pub(crate) slab: [f32; 2],
    /// How its image lies.
    pub(crate) image: Option<ImageFrame>,
}

/// How the image of a disc lies in that of the camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ImageFrame {
    /// From pixels about the centre to units of the semi-axes, row by row: of the disc as it is blended, whose conic is that of the length.
    pub(crate) to_disc: [f32; 4],
    /// The same without the image's filter.
    pub(crate) to_core: [f32; 4],
    /// Level of the image that its pixels see.
    pub(crate) level: f32,
}

/// Which parts of a projection are made beside the footprints.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Detail {
    /// Depths: for opaque splats, what may lie behind them, and depth layers. 28 bytes a splat.
    pub depth: bool,
    /// Object ids, for object layers. 4 bytes a splat.
    pub object: bool,
}

impl Detail {
    /// Everything.
    pub const ALL: Self = Self { depth: true, object: true };
}

/// Footprints of all splats of a cloud, by id. Kept from frame to frame, it allocates nothing.
#[derive(Debug, Clone, Default)]
pub struct Projected {
    /// The footprints; those that no pixel shows are not defined.
    pub splats: Vec<ProjectedSplat>,
    /// Depths by id; empty when not asked for.
    pub depths: Vec<ProjectedDepth>,
    /// Objects by id; empty when not asked for.
    pub objects: Vec<u32>,
    /// Tiles that each footprint reaches.
    pub(crate) coverage: Vec<Coverage>,
    /// Discs of which their conics do not tell everything, by id.
    pub(crate) special: Vec<SpecialDisc>,
    pub(crate) kernels: Vec<Kernel>,
    /// Focal length, pixels, for rays; `None` for parallel rays.
    pub(crate) perspective: Option<f32>,
    /// Image size, pixels.
    pub size: [u32; 2],
}

impl Projected {
    /// Whether splat `i` covers a pixel's rectangle at all.
    pub fn is_visible(&self, i: usize) -> bool {
        self.coverage[i] != Coverage::NONE
    }

    /// Number of splats in view.
    pub fn visible(&self) -> u64 {
        self.coverage.par_iter().with_min_len(1 << 16).filter(|c| **c != Coverage::NONE).count() as u64
    }

    /// Bytes of all columns.
    pub fn bytes(&self) -> u64 {
        (size_of_val(&*self.splats)
            + size_of_val(&*self.depths)
            + size_of_val(&*self.objects)
            + size_of_val(&*self.coverage)) as u64
    }

    /// The profile of a splat's footprint.
    #[inline(always)]
    pub fn kernel(&self, splat: &ProjectedSplat) -> &Kernel {
        &self.kernels[splat.footprint as usize]
    }

    /// Whether rays leave one point; else they are parallel.
    pub fn is_perspective(&self) -> bool {
        self.perspective.is_some()
    }

    /// 1/|d|² for the rays of the pixels of the tile at `corner`, those outside the image included: what
    /// [`Run::distance_sq`](super::tile::Run::distance_sq) of a medium is multiplied by. 1 for parallel rays.
    pub fn ray_factors(&self, pixel: [usize; 2]) -> Vec<f32> {
        let [x, y] = pixel;
        let Some(focal) = self.perspective else { return vec![1.0; AREA] };
        let half = self.size.map(|s| s as f32 * 0.5);
        let factor = |k: usize| {
            let [column, row] = position(k, x, y);
            let u = (column as f32 + 0.5 - half[0]) / focal;
            let v = (row as f32 + 0.5 - half[1]) / focal;
            1.0 / (1.0 + u * u + v * v)
        };
        (0..AREA).map(factor).collect()
    }

    /// What is known of disc `i` if it is a special one.
    #[inline(always)]
    pub fn special_disc(&self, splat: &ProjectedSplat, i: u32) -> Option<&SpecialDisc> {
        splat.is_special().then(|| self.found(i))
    }

    #[cold]
    fn found(&self, i: u32) -> &SpecialDisc {
        let at = self.special.binary_search_by_key(&i, |disc| disc.id);
        &self.special[at.expect("invariant: a disc that is marked is listed")]
    }

    /// Object of splat `i`; `u32::MAX` when not asked for.
    #[inline(always)]
    pub(crate) fn object(&self, i: usize) -> u32 {
        self.objects.get(i).copied().unwrap_or(u32::MAX)
    }

    /// Makes the columns `n` long; what they hold is overwritten.
    pub(crate) fn resize(&mut self, n: usize, detail: Detail) {
        resize(&mut self.splats, n);
        resize(&mut self.coverage, n);
        resize(&mut self.depths, if detail.depth { n } else { 0 });
    }
}

/// New memory is touched by all threads: clearing fresh pages costs more than the projection.
fn resize<T: Default + Send>(column: &mut Vec<T>, n: usize) {
    if column.len() != n {
        (0..n).into_par_iter().with_min_len(1 << 14).map(|_| T::default()).collect_into_vec(column);
    }
}

impl ProjectedSplat {
    /// Sets the extent, at least as large as given.
    #[inline(always)]
    pub(crate) fn set_half_extent(&mut self, half_extent: [f32; 2]) {
        let pack = |e: f32| (e.to_bits().saturating_add(0xffff) >> 16) as u16;
        self.half_extent = [pack(half_extent[0]), pack(half_extent[1])];
    }

    /// Marks a [`SpecialDisc`].
    #[inline(always)]
    pub(crate) fn set_special(&mut self) {
        self.half_extent[0] |= 0x8000;
    }

    /// Marks a Gaussian.
    #[inline(always)]
    pub(crate) fn set_gaussian(&mut self) {
        self.half_extent[1] |= 0x8000;
    }

    /// Whether it is a Gaussian, whose opacity has the shape of one.
    #[inline(always)]
    pub fn is_gaussian(&self) -> bool {
        self.half_extent[1] & 0x8000 != 0
    }

    /// Whether it is a [`SpecialDisc`].
    #[inline(always)]
    pub(crate) fn is_special(&self) -> bool {
        self.half_extent[0] & 0x8000 != 0
    }

    /// Pixel rectangle [x0, x1, y0, y1) within an image of `size`; empty when x0 ≥ x1 or y0 ≥ y1.
    #[inline(always)]
    pub(crate) fn bounds(&self, size: [u32; 2]) -> [u32; 4] {
        let range = |axis: usize| {
            let extent = f32::from_bits(u32::from(self.half_extent[axis] & 0x7fff) << 16);
            // Pixel i is covered when |i + ½ − centre| < extent; casts round down, and on the rim itself w = 0.
            let clamp = |v: f32| v.max(0.0).min(size[axis] as f32) as i32 as u32;
            let center = self.center_px[axis] + 0.5;
            [clamp(center - extent), clamp(center + extent)]
        };
        let [x0, x1] = range(0);
        let [y0, y1] = range(1);
        [x0, x1, y0, y1]
    }
}

/// The rectangle of tiles that a footprint reaches, in one word: 11 bits each for the first column and row, 5 each for
/// the numbers of further ones. Lists of tiles are made from this column alone, which stays in the cache.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Coverage(u32);

impl Default for Coverage {
    fn default() -> Self {
        Self::NONE
    }
}

impl Coverage {
    /// No tile. As a rectangle it would begin in the last tile and reach beyond it.
    pub(crate) const NONE: Self = Self(u32::MAX);

    /// What stands for this many further tiles or more: the footprint itself has to be asked.
    const MANY: u32 = 31;

    /// Of the pixel rectangle [x0, x1, y0, y1).
    #[inline(always)]
    pub(crate) fn from_bounds(bounds: [u32; 4]) -> Self {
        let [x0, x1, y0, y1] = bounds;
        let tile = |v: u32| v / TILE as u32;
        let word = tile(x0)
            | tile(y0) << 11
            | (tile(x1.wrapping_sub(1)).wrapping_sub(tile(x0))).min(Self::MANY) << 22
            | (tile(y1.wrapping_sub(1)).wrapping_sub(tile(y0))).min(Self::MANY) << 27;
        if (x0 < x1) & (y0 < y1) { Self(word) } else { Self::NONE }
    }

    /// First and last tile [column, row]; `splat` tells how far a large footprint reaches.
    #[inline(always)]
    pub(crate) fn tiles(self, splat: impl FnOnce() -> [u32; 4]) -> [[usize; 2]; 2] {
        let first = [self.0 & 0x7ff, self.0 >> 11 & 0x7ff];
        let further = [self.0 >> 22 & 0x1f, self.0 >> 27];
        let mut last = [first[0] + further[0], first[1] + further[1]];
        if further[0] == Self::MANY || further[1] == Self::MANY {
            let [_, x1, _, y1] = splat();
            last = [(x1 - 1) / TILE as u32, (y1 - 1) / TILE as u32];
        }
        [first, last].map(|t| t.map(|v| v as usize))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coverage_is_the_rectangle_of_tiles() {
        for bounds in [[0, 1, 0, 1], [31, 33, 0, 32], [65_535, 65_536, 0, 3], [0, 65_536, 5, 6], [0, 1024, 0, 1000]] {
            let t = TILE as u32;
            let expected = [[bounds[0] / t, bounds[2] / t], [(bounds[1] - 1) / t, (bounds[3] - 1) / t]];
            let coverage = Coverage::from_bounds(bounds);
            assert_eq!(coverage.tiles(|| bounds), expected.map(|v| v.map(|v| v as usize)));
            assert_ne!(coverage, Coverage::NONE);
        }
        assert_eq!(Coverage::from_bounds([3, 3, 0, 1]), Coverage::NONE);
    }

    #[test]
    fn an_extent_is_never_packed_smaller() {
        let mut splat = ProjectedSplat { center_px: [50.0, 50.0], ..ProjectedSplat::default() };
        for i in 0..1000 {
            let e = 0.05 * 1.007f32.powi(i);
            splat.set_half_extent([e, 0.5 * e]);
            let [x0, x1, y0, y1] = splat.bounds([1000, 1000]).map(|v| v as f32);
            let covered = |v: f32| v.clamp(0.0, 1000.0).floor();
            assert!(x0 <= covered(50.5 - e) && x1 >= covered(50.5 + e));
            assert!(y0 <= covered(50.5 - 0.5 * e) && y1 >= covered(50.5 + 0.5 * e));
        }
    }
}
