//! Where neighbouring pixels of a tile lie.

use super::size::SIDE;

/// Neighbouring pixels of one row, from column x of the tile with its rim on.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    /// Of the volume's own slabs.
    pub(crate) slab: u32,
    pub(crate) y: usize,
    pub(crate) x: usize,
}

impl Place {
    /// Of the tile with its rim.
    #[inline(always)]
    pub(crate) fn pixel(self) -> usize {
        self.y * SIDE + self.x
    }
}
