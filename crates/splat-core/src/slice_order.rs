//! The order in which splats are composited: slices along the view direction.

/// Which end of the view comes first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Direction {
    /// Nearest slice first.
    #[default]
    FrontToBack,
    /// Farthest slice first, as in Gunjee 2007.
    BackToFront,
}

/// Splats in slices of equal view-depth thickness; empty slices are left out.
///
/// Made by `hbsort`, read by [`crate::raster`] and `sheet-light`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SliceOrder {
    /// Sorted position → splat id. Culled splats do not appear.
    pub input_from_sorted: Vec<u32>,
    /// Where each non-empty slice begins in `input_from_sorted`, then its length: one entry more than slices.
    pub slice_starts: Vec<u32>,
    /// Which end comes first.
    pub direction: Direction,
    /// View depth of the nearest kept splat centre, world units.
    pub near: f32,
    /// View depth of the farthest kept splat centre, world units.
    pub far: f32,
    /// Slice thickness ε, world units.
    pub thickness: f64,
    /// Slices between near and far, empty ones included.
    pub slices: u64,
    /// Splats that were left out because no part of them lies in the view.
    pub culled: u64,
}

impl SliceOrder {
    /// Ids of the splats of the `k`-th non-empty slice.
    ///
    /// # Panics
    /// If `k` is not less than [`SliceOrder::non_empty_slices`].
    pub fn slice(&self, k: usize) -> &[u32] {
        &self.input_from_sorted[self.slice_starts[k] as usize..self.slice_starts[k + 1] as usize]
    }

    /// Number of slices with at least one splat.
    pub fn non_empty_slices(&self) -> usize {
        self.slice_starts.len().saturating_sub(1)
    }

    /// The first `n` non-empty slices alone, for a picture of partial compositing (Gunjee 2007, Figure 10).
    pub fn first_slices(mut self, n: usize) -> Self {
        self.slice_starts.truncate(n.saturating_add(1));
        self.input_from_sorted.truncate(self.slice_starts.last().copied().unwrap_or(0) as usize);
        self
    }
}
