//! Pixels that show translucent polygons in a slab: those, and what the slab has before, among and behind them, one after the other (steps 20 and
//! 22 of the pseudocode; Figure 7 for each of them).

use super::eye_buffer::Fragments;
use super::eye_sheets::{Chunk, OneSlab, WHOLE};
use super::pane_sheets::{OfPixel, PaneSheets};
use crate::splats::share_before;
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
        let splatted = self.splats.and_then(|splats| splats.squares.at([chunk.x, chunk.y], Lanes::<S>::COUNT));
        let splatted = splatted.map(|(lines, at)| lines.depths(simd, at)).unwrap_or_default();
        let is_last_first = self.prepends();
        for step in 0..=most {
            let n = if is_last_first { most - step } else { step };
            // The n-th part lies before the n-th polygon, as the eye sees it.
            let mut splats = [0.0; MAX_LANES];
            for (lane, own) in of_lanes.iter().enumerate() {
                let ends = [n.checked_sub(1), Some(n)].map(|n| n.filter(|n| *n < own.count()));
                let depths = ends.map(|n| n.map(|n| panes.depths(own, n)));
                let [across, view] = [0, 1].map(|which| depths.map(|depths| depths.map(|of| of[which])));
                let [nearer, farther] = if self.of.frame.back_to_front { [across[1], across[0]] } else { across };
                let is_there = n <= own.count();
                self.part[0][lane] = nearer.filter(|_| is_there).unwrap_or(WHOLE[usize::from(!is_there)][lane]);
                self.part[1][lane] = farther.filter(|_| is_there).unwrap_or(WHOLE[usize::from(is_there)][lane]);
                let [_, depth, thickness] = [0, 1, 2].map(|of| splatted[of][lane]);
                let before = |view: f32| share_before(view, depth, thickness);
                let [from, to] = [view[0].map_or(0.0, before), view[1].map_or(1.0, before)];
                splats[lane] = if is_there { to - from } else { 0.0 };
            }
            let draws_own = |this: &mut Self, n: Option<usize>| {
                if let Some(n) = n.filter(|n| *n < most) {
                    this.draw_panes(simd, chunk, (panes, &of_lanes, n));
                }
            };
            if is_last_first {
                draws_own(self, Some(n));
            }
            self.draw(simd, chunk, splats);
            if !is_last_first {
                draws_own(self, Some(n));
            }
        }
        self.part = WHOLE;
    }

    /// Composites the n-th translucent polygons of neighbouring pixels.
    #[inline(always)]
    fn draw_panes<S: Simd>(
        &mut self,
        simd: S,
        chunk: &Chunk,
        (panes, of_lanes, n): (&PaneSheets<'_>, &[OfPixel<'_>; MAX_LANES], usize),
    ) {
        let mut fragments = Fragments::NONE;
        for (lane, own) in of_lanes.iter().enumerate().filter(|(_, own)| n < own.count()) {
            panes.write(own, n, lane, &mut fragments);
        }
        let mut before = [0.0; MAX_LANES];
        let green = self.eye.pixels.planes / 2;
        self.eye.pixels.so_far(simd, chunk.k).store(&mut before);
        if self.prepends() {
            return self.eye.pixels.prepend(simd, chunk.k, &fragments);
        }
        self.eye.pixels.append(simd, chunk.k, &fragments);
        if self.keeps_depths() {
            for (lane, own) in of_lanes.iter().enumerate().filter(|(_, own)| n < own.count()) {
                let [_, depth] = panes.depths(own, n);
                let ends = [f64::from(depth); 2];
                self.eye.pixels.add_depth(chunk.k + lane, ends, before[lane], fragments.optical_depth[green][lane]);
            }
        }
    }
}
