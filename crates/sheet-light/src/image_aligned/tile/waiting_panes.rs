//! Translucent polygons of a tile that are not composited yet.

use super::picture::{Fragments, Picture};
use super::size::TILE;
use crate::image_aligned::panes::Panes;
use crate::shared::depths::DepthSpans;
use crate::shared::pixel::Pixel;
use splat_core::raster::lanes::{Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;
use std::ops::Range;

/// Of a tile, those that are not composited yet.
pub(crate) struct Waiting {
    /// Ranks, by pixel without the rim.
    ranks: Vec<Range<u32>>,
    /// Depth of the nearest of each row, counted from the first slab.
    nearest: [f32; TILE],
}

/// The polygon of each of neighbouring pixels that lies behind `n` others, of those before a depth.
#[derive(Clone, Copy)]
pub(crate) struct NthPane {
    /// The first of the pixels, of the tile without its rim.
    pub(crate) first: Pixel,
    pub(crate) n: usize,
    /// Depth counted from the first slab.
    pub(crate) end: f32,
}

impl Waiting {
    pub(crate) fn new() -> Self {
        Self { ranks: vec![0..0; TILE * TILE], nearest: [f32::INFINITY; TILE] }
    }

    /// Takes up those of the tile at `corner` in a range of view depths. Whether there are any.
    pub(crate) fn begin(&mut self, panes: Option<&Panes<'_>>, corner: [usize; 2], range: &Range<f64>) -> bool {
        self.ranks.fill(0..0);
        self.nearest = [f32::INFINITY; TILE];
        let Some(panes) = panes else { return false };
        let [width, height] = panes.camera.size.map(|s| s as usize);
        for y in 0..TILE.min(height - corner[1]) {
            for x in 0..TILE.min(width - corner[0]) {
                let ranks = panes.polygons.of_pixel((corner[1] + y) * width + corner[0] + x);
                let before = |end: f64| {
                    let is_before = |rank: &u32| f64::from(panes.polygons.seen.depth(*rank as usize)) < end;
                    ranks.start + ranks.clone().take_while(is_before).count() as u32
                };
                self.ranks[y * TILE + x] = before(range.start)..before(range.end);
            }
            self.find_nearest(panes, y);
        }
        self.nearest.iter().any(|depth| *depth < f32::INFINITY)
    }

    fn find_nearest(&mut self, panes: &Panes<'_>, y: usize) {
        let first = |ranks: &Range<u32>| {
            if ranks.is_empty() { f32::INFINITY } else { panes.depth(ranks.start) }
        };
        self.nearest[y] = self.ranks[y * TILE..(y + 1) * TILE].iter().map(first).fold(f32::INFINITY, f32::min);
    }

    /// Most of any of the pixels from `first` on that lie before a depth.
    #[inline(always)]
    pub(crate) fn most<S: Simd>(&self, panes: Option<&Panes<'_>>, first: Pixel, depth: f32) -> usize {
        let Pixel { x, y } = first;
        let Some(panes) = panes.filter(|_| self.nearest[y] < depth) else {
            return 0;
        };
        let lanes = &self.ranks[y * TILE + x..][..Lanes::<S>::COUNT];
        let before = |ranks: &Range<u32>| ranks.clone().take_while(|rank| panes.depth(*rank) < depth).count();
        lanes.iter().map(before).max().unwrap_or(0)
    }

    /// Depth of the `n`-th of a pixel, if it lies before `end`; counted from the first slab.
    #[inline(always)]
    fn depth(&self, panes: &Panes<'_>, pixel: usize, n: usize, end: f32) -> Option<f32> {
        let rank = self.ranks[pixel].clone().nth(n)?;
        Some(panes.depth(rank)).filter(|depth| *depth < end)
    }

    /// Depths between which pixels have the part that lies before the n-th polygon and behind the one before that; without any length where they
    /// have fewer.
    #[inline(always)]
    pub(crate) fn part_before<S: Simd>(&self, panes: &Panes<'_>, nth: NthPane) -> DepthSpans {
        let NthPane { first, n, end } = nth;
        let mut part = DepthSpans::WHOLE;
        for lane in 0..Lanes::<S>::COUNT {
            let depth = |n: usize| self.depth(panes, first.y * TILE + first.x + lane, n, end);
            if let Some(n) = n.checked_sub(1) {
                part.from[lane] = depth(n).unwrap_or(f32::INFINITY);
            }
            part.to[lane] = depth(n).unwrap_or(f32::INFINITY);
        }
        part
    }

    /// Composites the n-th polygons.
    #[inline(always)]
    pub(crate) fn composite<S: Simd>(
        &self,
        simd: S,
        panes: &Panes<'_>,
        nth: NthPane,
        fragments: &mut Fragments,
        picture: &mut Picture,
    ) {
        let NthPane { first: Pixel { x, y }, n, end } = nth;
        fragments.optical_depth = [[0.0; MAX_LANES]; 3];
        fragments.values[..panes.channels].fill([0.0; MAX_LANES]);
        for lane in 0..Lanes::<S>::COUNT {
            let pixel = y * TILE + x + lane;
            let Some(depth) = self.depth(panes, pixel, n, end) else {
                continue;
            };
            let rank = self.ranks[pixel].start as usize + n;
            let tau = panes.polygons.seen.seen(rank, panes.camera).crossing();
            (0..3).for_each(|p| fragments.optical_depth[p][lane] = tau[p]);
            let values = &panes.values[rank * panes.channels..][..panes.channels];
            values.iter().enumerate().for_each(|(c, value)| fragments.values[c][lane] = *value);
            (fragments.near[lane], fragments.far[lane]) = (depth, depth);
            fragments.object[lane] = panes.polygons.seen.polygons(rank).object;
        }
        picture.composite(simd, y, x, fragments, panes.origin);
    }

    /// Leaves those of a row behind that lie before a depth.
    pub(crate) fn pass(&mut self, panes: &Panes<'_>, y: usize, depth: f32) {
        if self.nearest[y] >= depth {
            return;
        }
        for ranks in &mut self.ranks[y * TILE..(y + 1) * TILE] {
            ranks.start += ranks.clone().take_while(|rank| panes.depth(*rank) < depth).count() as u32;
        }
        self.find_nearest(panes, y);
    }

    /// Composites all that are left, behind everything else.
    #[inline(always)]
    pub(crate) fn finish<S: Simd>(
        &mut self,
        simd: S,
        panes: Option<&Panes<'_>>,
        fragments: &mut Fragments,
        picture: &mut Picture,
    ) {
        let Some(panes) = panes else { return };
        for (y, x) in (0..TILE).flat_map(|y| (0..TILE).step_by(Lanes::<S>::COUNT).map(move |x| (y, x))) {
            let first = Pixel { x, y };
            for n in 0..self.most::<S>(Some(panes), first, f32::INFINITY) {
                self.composite(simd, panes, NthPane { first, n, end: f32::INFINITY }, fragments, picture);
            }
        }
    }
}
