//! Reading lists: one of a cell, or four at once.

use super::{Lists, WINDOW};
use std::hint::select_unpredictable;

/// Entries among which a place need not be told: so few of a [`WINDOW`] that what a receiver is within most often lies in it too.
pub(crate) const ENOUGH: usize = 4;

/// The sorted entries of one cell: equal distances are one, and nothing follows the visible limit.
#[derive(Debug, Clone, Copy)]
pub(crate) struct List<'a, const C: usize> {
    /// From its first entry on: those of other lists follow its last one.
    distance: &'a [f32],
    total: &'a [[f32; C]],
    len: usize,
}

impl<'a, const C: usize> List<'a, C> {
    /// Of a cell that is covered by nothing.
    pub(crate) const NONE: Self = List { distance: &[], total: &[], len: 0 };

    /// Number of entries.
    #[inline(always)]
    pub(crate) fn len(&self) -> usize {
        self.len
    }

    /// Their distances.
    #[inline(always)]
    pub(crate) fn distance(&self) -> &'a [f32] {
        &self.distance[..self.len]
    }

    /// Absorbance up to and with each.
    #[inline(always)]
    pub(crate) fn total(&self) -> &'a [[f32; C]] {
        &self.total[..self.len]
    }

    /// Distances, and that of the next, and totals from entry `n` < [`Self::len`] on; what stands past the last entry is of no meaning.
    #[inline(always)]
    pub(crate) fn window(&self, n: usize) -> (&'a [f32; WINDOW + 1], &'a [[f32; C]; WINDOW]) {
        let windows = self.distance[n..].first_chunk().zip(self.total[n..].first_chunk());
        windows.expect("invariant: a window follows the last list")
    }

    /// Absorbance of the first `n` entries.
    #[inline(always)]
    pub(crate) fn total_of(&self, n: usize) -> [f32; C] {
        n.checked_sub(1).and_then(|last| self.total().get(last)).copied().unwrap_or([0.0; C])
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
        let start = span[0] as usize;
        let len = span[1] as usize;
        List { distance: &self.distance[start..], total: &self.total[start..], len }
    }

    /// The sorted entries of a cell.
    #[inline]
    pub(crate) fn list(&self, cell: u32) -> List<'_, C> {
        self.list_at(self.span(cell))
    }

    /// Places in the lists of four cells about each of `n` receivers, so that every entry before one comes before the bound of its
    /// list, and none does from [`ENOUGH`] entries behind it on. All are searched at once and without branches: a search by halves
    /// waits for memory at every step, all of them wait together, and where they go on cannot be foreseen.
    #[inline(always)]
    pub(crate) fn places<const R: usize>(
        &self,
        spans: &[[[u32; 2]; 4]; R],
        bounds: &[[f32; 4]; R],
        n: usize,
        is_before: impl Fn(f32, f32) -> bool,
    ) -> [[usize; 4]; R] {
        let mut at = [[0u32; 4]; R];
        let mut size = [[0u32; 4]; R];
        let mut most = 0;
        for r in 0..n {
            for k in 0..4 {
                [at[r][k], size[r][k]] = spans[r][k];
                most = most.max(size[r][k]);
            }
        }
        while most > ENOUGH as u32 {
            for r in 0..n {
                let mut middle = [0.0; 4];
                for k in 0..4 {
                    middle[k] = self.distance[(at[r][k] + size[r][k] / 2) as usize];
                }
                for k in 0..4 {
                    let half = size[r][k] / 2;
                    at[r][k] = select_unpredictable(is_before(middle[k], bounds[r][k]), at[r][k] + half, at[r][k]);
                    size[r][k] -= half;
                }
            }
            most -= most / 2;
        }
        let mut places = [[0; 4]; R];
        let mut begun = 0.0;
        for r in 0..n {
            for k in 0..4 {
                let first = at[r][k] as usize;
                begun += self.total[first][0] + self.total[first + WINDOW][0] + self.distance[first + WINDOW];
                places[r][k] = first - spans[r][k][0] as usize;
            }
        }
        // What is there will be asked for one after the other: all of it is on its way now.
        std::hint::black_box(begun);
        places
    }
}
