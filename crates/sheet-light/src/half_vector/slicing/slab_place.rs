//! Where things lie among the slabs of a sweep.

use crate::shared::slabs::Slabs;

/// A slab, or all that lies behind the last one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum SlabPlace {
    Slab(u32),
    Behind,
}

impl SlabPlace {
    /// The number of the slab; that of all slabs for what lies behind them.
    pub(crate) fn index(self, slabs: &Slabs) -> u32 {
        match self {
            Self::Slab(slab) => slab,
            Self::Behind => slabs.count,
        }
    }
}
