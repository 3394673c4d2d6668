//! Reading lists: one of a cell, or four at once.

use super::{BLOCK, Lists};
use std::hint::select_unpredictable;

/// The sorted entries of one cell: equal distances are one, and nothing follows the visible limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct List<'a, const C: usize> {
    pub(crate) distance: &'a [f32],
    /// Absorbance up to and with each.
    pub(crate) total: &'a [[f32; C]],
    /// Its first entry's place among those of all lists.
    start: usize,
    moment: &'a [[f32; C]],
}

impl<const C: usize> List<'_, C> {
    /// Of a cell that is covered by nothing.
    pub(crate) const NONE: Self = List { distance: &[], total: &[], start: 0, moment: &[] };

    /// Where the next block of entries begins, at or behind entry `n`; past the list where none does.
    #[inline(always)]
    pub(crate) fn next_block(&self, n: usize) -> usize {
        (self.start + n).next_multiple_of(BLOCK) - self.start
    }

    /// Σ a·(d − d₀) of a whole block, entry `n` its first, d₀ the distance of that.
    #[inline(always)]
    pub(crate) fn moment(&self, n: usize) -> [f32; C] {
        self.moment[(self.start + n) / BLOCK]
    }

    /// Absorbance of the first `n` entries.
    #[inline(always)]
    pub(crate) fn total_of(&self, n: usize) -> [f32; C] {
        n.checked_sub(1).and_then(|last| self.total.get(last)).copied().unwrap_or([0.0; C])
    }
}

impl<const C: usize> Lists<C> {
    /// First entry and number of entries of a cell's list.
    #[inline(always)]
    pub(crate) fn span(&self, cell: u32) -> [u32; 2] {
        self.span[cell as usize]
    }

    /// The list of a [`Lists::span`].
    #[inline(always)]
    pub(crate) fn list_at(&self, span: [u32; 2]) -> List<'_, C> {
        let [start, kept] = span.map(|n| n as usize);
        let (distance, total) = (&self.distance[start..start + kept], &self.total[start..start + kept]);
        List { distance, total, start, moment: &self.moment }
    }

    /// The sorted entries of a cell.
    #[inline]
    pub(crate) fn list(&self, cell: u32) -> List<'_, C> {
        self.list_at(self.span(cell))
    }

    /// How many entries of four lists come before a bound of each. All are searched at once and without branches: a search by halves
    /// waits for memory at every step, four of them wait together, and where they go on cannot be foreseen.
    #[inline(always)]
    pub(crate) fn places(
        &self,
        spans: [[u32; 2]; 4],
        bounds: [f32; 4],
        is_before: impl Fn(f32, f32) -> bool,
    ) -> [usize; 4] {
        let (mut at, mut size) = (spans.map(|[start, _]| start as usize), spans.map(|[_, kept]| kept as usize));
        // Nothing is read of a list that is at an end of all.
        let is_before =
            |at: usize, k: usize| is_before(self.distance.get(at).copied().unwrap_or(f32::INFINITY), bounds[k]);
        let steps = size.iter().fold(1, |most: usize, n| most.max(*n)).next_power_of_two().ilog2();
        for _ in 0..steps {
            for k in 0..4 {
                let half = size[k] / 2;
                at[k] = select_unpredictable(is_before(at[k] + half, k), at[k] + half, at[k]);
                size[k] -= half;
            }
        }
        std::array::from_fn(|k| at[k] - spans[k][0] as usize + usize::from(is_before(at[k], k)) * size[k])
    }
}
