//! Segments of a picture that lie one behind the other become one: the associative *over*.

use super::lanes::exp_neg;
use crate::Accumulator;
use crate::shade::ChannelLayout;
use rayon::prelude::*;

/// Pixels of one task.
const CHUNK: usize = 1 << 14;

impl Accumulator {
    /// Puts a segment behind all that is there: C ← C + T·C', A ← A + A', with T = e^−A; depths and objects go on where they
    /// were. Appending is associative but for rounding: however a picture is cut into segments, it stays the same.
    ///
    /// ```
    /// use splat_core::Accumulator;
    /// // Two panes of opacity 1/2, red before green, in one pixel.
    /// let pane = |color: [f32; 3]| {
    ///     let mut pane = Accumulator::new([1, 1], 1, 3, false, false);
    ///     pane.optical_depth[0][0] = 2f32.ln();
    ///     (0..3).for_each(|c| pane.channels[c][0] = 0.5 * color[c]);
    ///     pane
    /// };
    /// let mut all = pane([1.0, 0.0, 0.0]);
    /// all.append(&pane([0.0, 1.0, 0.0]));
    /// assert!((all.channels[0][0] - 0.5).abs() < 1e-6 && (all.channels[1][0] - 0.25).abs() < 1e-6);
    /// assert!((all.optical_depth[0][0] - 4f32.ln()).abs() < 1e-6);
    /// ```
    ///
    /// # Panics
    /// If the two differ in size or in what they keep.
    pub fn append(&mut self, behind: &Self) {
        let kept = |a: &Self| [a.channels.len(), a.optical_depth.len(), a.depth.len(), a.object.len()];
        assert_eq!((self.size, kept(self)), (behind.size, kept(behind)), "invariant: segments of one picture");
        let count = self.channels.len();
        let planes = self.optical_depth.len();
        let before = &self.optical_depth;
        for (c, (to, from)) in self.channels.iter_mut().zip(&behind.channels).enumerate() {
            let depth = &before[ChannelLayout::plane_of(c, count, planes)];
            let chunks = to.par_chunks_mut(CHUNK).zip(from.par_chunks(CHUNK)).zip(depth.par_chunks(CHUNK));
            chunks.for_each(|((to, from), depth)| {
                to.iter_mut().zip(from).zip(depth).for_each(|((to, from), depth)| *to += exp_neg(*depth) * from);
            });
        }
        let green = planes / 2;
        let depths = self.depth.iter_mut().zip(&behind.depth);
        let optical = before[green].iter().zip(&behind.optical_depth[green]);
        depths.zip(optical).for_each(|((to, from), (before, depth))| to.append(from, *before, *depth));
        let objects = self.object.iter_mut().zip(&behind.object);
        objects.filter(|(to, _)| **to == u32::MAX).for_each(|(to, from)| *to = *from);
        for (to, from) in self.optical_depth.iter_mut().zip(&behind.optical_depth) {
            to.iter_mut().zip(from).for_each(|(to, from)| *to += from);
        }
    }
}
