//! Which blocks of 8³ voxels hold any that may be seen.

use super::RIM;
use crate::shared::voxels::Voxels;
use rayon::prelude::*;
use splat_core::glam::{DVec3, IVec3};

/// Side of a brick, voxels.
const SIDE: usize = 8;

/// Which bricks are seen, of the lattice with its rim.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Bricks {
    dims: [usize; 3],
    /// How many are seen of those before a corner of bricks along all axes, so that a block of any size takes eight of these.
    seen_before: Vec<u32>,
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
        let is_seen: Vec<bool> = (0..dims.iter().product()).into_par_iter().with_min_len(64).map(brick).collect();
        let [sx, sy, sz] = dims.map(|n| n + 1);
        let mut seen_before = vec![0u32; sx * sy * sz];
        for (row, is_seen) in is_seen.chunks_exact(dims[0]).enumerate() {
            let at = ((row / dims[1] + 1) * sy + row % dims[1] + 1) * sx;
            let mut of_row = 0;
            for (i, is_seen) in is_seen.iter().enumerate() {
                of_row += u32::from(*is_seen);
                let corner = at + i + 1;
                // Both sums hold the bricks before this row and plane: one of them is subtracted.
                let of_plane = seen_before[corner - sx] + seen_before[corner - sx * sy];
                seen_before[corner] = of_plane - seen_before[corner - sx * sy - sx] + of_row;
            }
        }
        Self { dims, seen_before }
    }

    pub(crate) fn bytes(&self) -> u64 {
        size_of_val(&*self.seen_before) as u64
    }

    /// Whether any brick of the cells may be seen, the lattice going on as it does in its rim.
    #[inline(always)]
    pub(crate) fn is_any(&self, cells: &Box3) -> bool {
        let mut begin = [0usize; 3];
        let mut end = [0usize; 3];
        for a in 0..3 {
            let last = self.dims[a] as i32 - 1;
            let brick = |cell: i32| (cell.saturating_add(RIM[a] as i32) >> 3).clamp(0, last);
            begin[a] = brick(cells.low[a]) as usize;
            end[a] = brick(cells.high[a]) as usize + 1;
        }
        let stride = self.dims[0] + 1;
        let plane = stride * (self.dims[1] + 1);
        let in_row = |j: usize, k: usize| {
            let row = &self.seen_before[k * plane + j * stride..][..stride];
            row[end[0]].wrapping_sub(row[begin[0]])
        };
        let before = |k: usize| in_row(end[1], k).wrapping_sub(in_row(begin[1], k));
        before(end[2]) != before(begin[2])
    }
}
