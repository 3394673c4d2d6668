//! Which voxels have a share in what is at a place of a lattice: those whose kernels reach it.

use splat_core::glam::{DMat3, DVec3};

/// Most rows that are looked at one by one.
const MOST_ROWS: usize = 512;

/// Voxels around a voxel, the same on both sides.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Near {
    /// All lie in it: so many steps along each axis.
    pub(crate) block: [usize; 3],
    /// Those of each row; none of them if they are all of the block.
    pub(crate) rows: Vec<Run>,
}

/// Neighbours in a row: `length` of them from `first` on, in the row that is `j` and `k` away.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Run {
    pub(crate) j: isize,
    pub(crate) k: isize,
    pub(crate) first: isize,
    pub(crate) length: usize,
}

impl Near {
    /// All that are so many steps away along each axis.
    pub(crate) fn block(block: [usize; 3]) -> Self {
        Self { block, rows: Vec::new() }
    }

    /// Those whose `steps`·d lies no farther along any of the directions than `reach` of it says. Of many rows the block that holds them.
    pub(crate) fn within(steps: &DMat3, directions: &[DVec3], reach: impl Fn(DVec3) -> f64) -> Self {
        /// What lies at the border by rounding is near.
        const ROUNDING: f64 = 1.0 + 1e-9;
        let inverse = steps.inverse();
        let block = [0, 1, 2].map(|a| (reach(inverse.row(a)) * ROUNDING).min(1e6) as usize);
        let mut near = Self::block(block);
        if (2 * block[1] + 1) * (2 * block[2] + 1) > MOST_ROWS {
            return near;
        }
        let bounds: Vec<_> = directions.iter().map(|n| (steps.transpose() * *n, reach(*n) * ROUNDING)).collect();
        let [i, j, k] = block.map(|n| n as isize);
        for (k, j) in (-k..=k).flat_map(|k| (-j..=j).map(move |j| (k, j))) {
            let is_near = |i: &isize| {
                let steps_away = DVec3::new(*i as f64, j as f64, k as f64);
                bounds.iter().all(|(n, reach)| n.dot(steps_away).abs() <= *reach)
            };
            let length = (-i..=i).filter(is_near).count();
            near.rows.extend((-i..=i).find(is_near).map(|first| Run { j, k, first, length }));
        }
        near
    }
}
