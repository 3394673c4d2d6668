//! Pixels that show translucent polygons in a slab: those, and what the slab has before, among and behind them, one after the other (steps 20 and
//! 22 of the pseudocode; Figure 7 for each of them).

use super::buffer::Fragments;
use super::sheets::{Chunk, OneSlab};
use crate::half_vector::polygons::panes::{OfPixel, PaneDepths, PaneSheets};
use crate::shared::depths::{DepthSpans, share_before};
use crate::shared::lines::PixelDepths;
use crate::shared::pixel::Pixel;
use splat_core::raster::lanes::{Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;

impl OneSlab<'_> {
    /// Lights and composites neighbouring pixels with the translucent polygons that they show, and what the slab has before, among and behind them.
    #[inline(always)]
    pub(super) fn draw_parted<S: Simd>(&mut self, simd: S, chunk: &Chunk, panes: &PaneSheets<'_>) {
        let mut of_lanes = [OfPixel::default(); MAX_LANES];
        for lane in 0..Lanes::<S>::COUNT.min(self.eye.band.width.saturating_sub(chunk.x)) {
            of_lanes[lane] = panes.of_pixel(chunk.y * self.eye.band.width + chunk.x + lane);
        }
        let most = of_lanes.iter().map(OfPixel::count).max().unwrap_or(0);
        let first = Pixel { x: chunk.x, y: chunk.y };
        let splatted = self.work.splats.and_then(|splats| splats.squares.find(first, Lanes::<S>::COUNT));
        // Within a closure nothing is vectorised.
        let mut depths_of_splats = PixelDepths::default();
        if let Some(found) = splatted {
            depths_of_splats = found.lines.depths(simd, found.pixel);
        }
        let is_last_first = self.prepends();
        let is_back_to_front = self.work.geometry.frame.back_to_front;
        for step in 0..=most {
            let n = if is_last_first { most - step } else { step };
            // The n-th part lies before the n-th polygon, as the eye sees it.
            let mut splats = [0.0; MAX_LANES];
            for (lane, crossed) in of_lanes.iter().enumerate() {
                let ends = [n.checked_sub(1), Some(n)].map(|n| n.filter(|n| *n < crossed.count()));
                let [before, behind] = ends.map(|n| n.map(|n| panes.depths(crossed, n)));
                let [first, last] = if is_back_to_front { [behind, before] } else { [before, behind] };
                if n > crossed.count() {
                    // Fewer polygons, so no part.
                    self.part.from[lane] = f32::INFINITY;
                    self.part.to[lane] = f32::NEG_INFINITY;
                    continue;
                }
                self.part.from[lane] = first.map_or(f32::NEG_INFINITY, |pane| pane.across_slabs);
                self.part.to[lane] = last.map_or(f32::INFINITY, |pane| pane.across_slabs);
                let share = |pane: PaneDepths| {
                    share_before(pane.view, depths_of_splats.depth[lane], depths_of_splats.thickness[lane])
                };
                splats[lane] = behind.map_or(1.0, share) - before.map_or(0.0, share);
            }
            for draws_polygons in [is_last_first, !is_last_first] {
                if !draws_polygons {
                    self.draw(simd, chunk, splats);
                } else if n < most {
                    self.draw_panes(simd, chunk, panes, &of_lanes, n);
                }
            }
        }
        self.part = DepthSpans::WHOLE;
    }

    /// Composites the n-th translucent polygons of neighbouring pixels.
    #[inline(always)]
    fn draw_panes<S: Simd>(
        &mut self,
        simd: S,
        chunk: &Chunk,
        panes: &PaneSheets<'_>,
        of_lanes: &[OfPixel<'_>; MAX_LANES],
        n: usize,
    ) {
        let mut fragments = Fragments::NONE;
        for (lane, crossed) in of_lanes.iter().enumerate().filter(|(_, crossed)| n < crossed.count()) {
            panes.write(crossed, n, lane, &mut fragments);
        }
        let mut before = [0.0; MAX_LANES];
        let green = self.eye.pixels.planes / 2;
        self.eye.pixels.so_far(simd, chunk.k).store(&mut before);
        if self.prepends() {
            return self.eye.pixels.prepend(simd, chunk.k, &fragments);
        }
        self.eye.pixels.append(simd, chunk.k, &fragments);
        if self.keeps_depths() {
            for (lane, crossed) in of_lanes.iter().enumerate().filter(|(_, crossed)| n < crossed.count()) {
                let depth = f64::from(panes.depths(crossed, n).view);
                let tau = fragments.optical_depth[green][lane];
                self.eye.pixels.add_depth(chunk.k + lane, depth, depth, before[lane], tau);
            }
        }
    }
}
