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
    /// Index of each non-empty slice among all slices, empty ones included: 0 for the one at `near`, whichever end comes
    /// first. See [`SliceOrder::depth_range`].
    pub slice_indices: Vec<u64>,
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

    /// View depths between which the `k`-th non-empty slice lies, world units, the lesser first: from near + g·ε to
    /// near + (g + 1)·ε for its index g, and no farther than the farthest centre. A centre lies outside by the rounding of
    /// this product at most.
    ///
    /// # Panics
    /// If `k` is not less than [`SliceOrder::non_empty_slices`].
    pub fn depth_range(&self, k: usize) -> [f64; 2] {
        let at = |g: u64| (f64::from(self.near) + g as f64 * self.thickness).min(f64::from(self.far));
        let g = self.slice_indices[k];
        // Rounding, or ε above the whole span, may leave the end of the last slice before the farthest centre.
        [at(g), if g + 1 >= self.slices { f64::from(self.far) } else { at(g + 1) }]
    }

    /// Number of slices with at least one splat.
    pub fn non_empty_slices(&self) -> usize {
        self.slice_starts.len().saturating_sub(1)
    }

    /// Bytes of the order: 4 a splat and 12 a non-empty slice.
    pub fn bytes(&self) -> u64 {
        (4 * (self.input_from_sorted.len() + self.slice_starts.len()) + 8 * self.slice_indices.len()) as u64
    }

    /// The first `n` non-empty slices alone, for a picture of partial compositing (Gunjee 2007, Figure 10).
    pub fn first_slices(mut self, n: usize) -> Self {
        self.slice_starts.truncate(n.saturating_add(1));
        self.slice_indices.truncate(n);
        self.input_from_sorted.truncate(self.slice_starts.last().copied().unwrap_or(0) as usize);
        self
    }
}
