//! Ranges of an interpolated volume over boxes of cells: a pyramid of least and greatest control points.
//!
//! A node of the finest level covers 2×2×2 cells, a node of the next 2×2×2 nodes. A box is answered from the level where
//! it meets at most three nodes along each axis: 27 look-ups however large it is, 1.15 bytes a voxel.

use super::Interpolation;
use rayon::prelude::*;
use splat_core::Grid;

/// Added to each end, times the larger end: rounding of control points and of values. Interpolated values are sums
/// of at most 64 lattice values that are below 2200 times the largest control point.
const ROUNDING: f64 = 1e-10;

/// Least and greatest value.
pub(super) type Range = [f32; 2];

/// The union of nothing.
const EMPTY: Range = [f32::INFINITY, f32::NEG_INFINITY];

#[derive(Debug)]
struct Level {
    dims: [usize; 3],
    nodes: Vec<Range>,
}

/// Levels, finest first.
#[derive(Debug)]
pub(super) struct Ranges {
    levels: Vec<Level>,
}

/// Widens a range in f64 so that values computed in another order stay inside.
pub(super) fn widen([low, high]: [f64; 2]) -> [f64; 2] {
    let slack = ROUNDING * low.abs().max(high.abs());
    [low - slack, high + slack]
}

fn outward(range: [f64; 2]) -> Range {
    let [low, high] = widen(range);
    [(low as f32).next_down(), (high as f32).next_up()]
}

fn union(a: Range, b: Range) -> Range {
    [a[0].min(b[0]), a[1].max(b[1])]
}

impl Ranges {
    pub(super) fn new(grid: &Grid, interpolation: Interpolation) -> Self {
        let dims = grid.dims.map(|n| n.saturating_sub(1).div_ceil(2).max(1));
        let mut nodes = vec![EMPTY; dims[0] * dims[1] * dims[2]];
        nodes.par_chunks_mut(dims[0]).enumerate().for_each(|(row, out)| {
            let (j, k) = (row % dims[1], row / dims[1]);
            for (i, node) in out.iter_mut().enumerate() {
                *node = outward(match interpolation {
                    Interpolation::Trilinear => linear_brick(grid, [i, j, k]),
                    Interpolation::CatmullRom => cubic_brick(grid, [i, j, k]),
                });
            }
        });
        let mut levels = vec![Level { dims, nodes }];
        while let Some(next) = levels.last().and_then(Level::coarser) {
            levels.push(next);
        }
        Self { levels }
    }

    /// Range over the cells from `first` to `last`, both included.
    pub(super) fn over(&self, first: [usize; 3], last: [usize; 3]) -> Range {
        let narrow = |level: usize| (0..3).all(|a| (last[a] >> (level + 1)) - (first[a] >> (level + 1)) <= 2);
        let level = (0..self.levels.len()).find(|l| narrow(*l)).unwrap_or(self.levels.len() - 1);
        let Level { dims, nodes } = &self.levels[level];
        let [low, high] = [first, last].map(|c| c.map(|c| c >> (level + 1)));
        let mut range = EMPTY;
        for k in low[2]..=high[2] {
            for j in low[1]..=high[1] {
                for node in &nodes[(k * dims[1] + j) * dims[0]..][low[0]..=high[0]] {
                    range = union(range, *node);
                }
            }
        }
        range
    }
}

impl Level {
    fn coarser(&self) -> Option<Self> {
        if self.nodes.len() == 1 {
            return None;
        }
        let dims = self.dims.map(|n| n.div_ceil(2));
        let mut nodes = vec![EMPTY; dims[0] * dims[1] * dims[2]];
        for (n, range) in self.nodes.iter().enumerate() {
            let [i, j, k] = [n % self.dims[0], n / self.dims[0] % self.dims[1], n / self.dims[0] / self.dims[1]];
            let above = &mut nodes[(k / 2 * dims[1] + j / 2) * dims[0] + i / 2];
            *above = union(*above, *range);
        }
        Some(Self { dims, nodes })
    }
}

fn fold_range(range: [f64; 2], v: f64) -> [f64; 2] {
    [range[0].min(v), range[1].max(v)]
}

/// Trilinear extremes lie at lattice points.
fn linear_brick(grid: &Grid, brick: [usize; 3]) -> [f64; 2] {
    let span = |a: usize| 2 * brick[a]..=(2 * brick[a] + 2).min(grid.dims[a] - 1);
    let mut range = [f64::INFINITY, f64::NEG_INFINITY];
    for k in span(2) {
        for j in span(1) {
            let row = &grid.values[(k * grid.dims[1] + j) * grid.dims[0]..][span(0)];
            range = row.iter().fold(range, |r, v| fold_range(r, f64::from(*v)));
        }
    }
    range
}

/// Along one axis of a brick: the five lattice points from the one before to the one after, clamped, and a third of one
/// over the distance between each inner point's neighbours, ahead of it and behind it, 0 where no cell lies there.
struct Span {
    index: [usize; 5],
    ahead: [f64; 3],
    behind: [f64; 3],
}

impl Span {
    fn new(brick: usize, n: usize) -> Self {
        let first = 2 * brick;
        let third = |i: usize| 1.0 / (3.0 * (i + 1).min(n - 1).saturating_sub(i.saturating_sub(1)).max(1) as f64);
        let exists = |cell: usize| if cell + 1 < n { 1.0 } else { 0.0 };
        Self {
            index: std::array::from_fn(|p| (first + p).saturating_sub(1).min(n - 1)),
            ahead: [third(first) * exists(first), third(first + 1) * exists(first + 1), 0.0],
            behind: [0.0, third(first + 1) * exists(first), third(first + 2) * exists(first + 1)],
        }
    }

    /// Control points of the two cells, the shared end once.
    fn control(&self, v: [f64; 5]) -> [f64; 7] {
        let slope = [v[2] - v[0], v[3] - v[1], v[4] - v[2]];
        [
            v[1],
            v[1] + self.ahead[0] * slope[0],
            v[2] - self.behind[1] * slope[1],
            v[2],
            v[2] + self.ahead[1] * slope[1],
            v[3] - self.behind[2] * slope[2],
            v[3],
        ]
    }
}

/// Extremes of the 343 control points of 2×2×2 cells.
fn cubic_brick(grid: &Grid, brick: [usize; 3]) -> [f64; 2] {
    let [x, y, z] = [0, 1, 2].map(|a| Span::new(brick[a], grid.dims[a]));
    let [nx, ny, _] = grid.dims;
    let planes: [[[f64; 7]; 7]; 5] = std::array::from_fn(|k| {
        let rows: [[f64; 7]; 5] = std::array::from_fn(|j| {
            let row = &grid.values[(z.index[k] * ny + y.index[j]) * nx..][..nx];
            x.control(x.index.map(|i| f64::from(row[i])))
        });
        transposed(std::array::from_fn(|i| y.control(rows.map(|row| row[i]))))
    });
    let mut range = [f64::INFINITY, f64::NEG_INFINITY];
    for j in 0..7 {
        for i in 0..7 {
            range = z.control(planes.map(|p| p[j][i])).into_iter().fold(range, fold_range);
        }
    }
    range
}

fn transposed(columns: [[f64; 7]; 7]) -> [[f64; 7]; 7] {
    std::array::from_fn(|j| std::array::from_fn(|i| columns[i][j]))
}
