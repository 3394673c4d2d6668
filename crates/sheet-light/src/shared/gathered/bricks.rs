//! Which blocks of 8³ voxels hold any that may be seen.

use super::RIM;
use crate::shared::voxels::Voxels;
use rayon::prelude::*;
use splat_core::glam::{DVec3, IVec3};

/// Side of a brick, voxels.
const SIDE: usize = 8;

/// More bricks are not looked at one by one: one of them is taken to be seen.
const MOST: i32 = 64;

/// A flag a brick, of the lattice with its rim.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Bricks {
    dims: [usize; 3],
    is_seen: Vec<bool>,
}

/// Cells of the lattice, first and last along each axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Box3 {
    pub(crate) low: IVec3,
    pub(crate) high: IVec3,
}

impl Box3 {
    /// The cells of places, and all between them.
    #[inline(always)]
    pub(crate) fn around(places: impl IntoIterator<Item = DVec3>) -> Self {
        let mut low = DVec3::INFINITY;
        let mut high = DVec3::NEG_INFINITY;
        for place in places {
            low = low.min(place);
            high = high.max(place);
        }
        // Casts that saturate.
        Self { low: low.floor().as_ivec3(), high: high.floor().as_ivec3() }
    }
}

impl Bricks {
    pub(crate) fn new(voxels: &Voxels) -> Self {
        let [nx, ny, nz] = voxels.dims();
        let dims = [nx, ny, nz].map(|n| n.div_ceil(SIDE));
        let brick = |at: usize| {
            let first = [at % dims[0], at / dims[0] % dims[1], at / (dims[0] * dims[1])].map(|n| n * SIDE);
            let rows = (first[2]..(first[2] + SIDE).min(nz))
                .flat_map(|k| (first[1]..(first[1] + SIDE).min(ny)).map(move |j| (j, k)));
            rows.into_iter().any(|(j, k)| voxels.eight(first[0] / SIDE, j, k) != 0)
        };
        let is_seen = (0..dims.iter().product()).into_par_iter().with_min_len(64).map(brick).collect();
        Self { dims, is_seen }
    }

    pub(crate) fn bytes(&self) -> u64 {
        self.is_seen.len() as u64
    }

    /// Whether any brick of the cells may be seen, the lattice going on as it does in its rim.
    #[inline(always)]
    pub(crate) fn is_any(&self, cells: &Box3) -> bool {
        let mut low = [0usize; 3];
        let mut high = [0usize; 3];
        let mut count = 1;
        for a in 0..3 {
            let last = self.dims[a] as i32 - 1;
            let brick = |cell: i32| (cell.saturating_add(RIM[a] as i32) >> 3).clamp(0, last);
            (low[a], high[a]) = (brick(cells.low[a]) as usize, brick(cells.high[a]) as usize);
            count *= (high[a] - low[a] + 1).min(MOST as usize);
        }
        if count >= MOST as usize {
            return true;
        }
        for k in low[2]..=high[2] {
            for j in low[1]..=high[1] {
                let row = (k * self.dims[1] + j) * self.dims[0];
                if self.is_seen[row + low[0]..=row + high[0]].iter().any(|seen| *seen) {
                    return true;
                }
            }
        }
        false
    }
}
