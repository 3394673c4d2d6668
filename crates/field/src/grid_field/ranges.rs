//! Ranges of an interpolated volume over boxes of cells: a pyramid of bounds of its control points.
//!
//! A node of the finest level covers 2×2×2 cells, a node of the next 2×2×2 nodes. The range of a box is read from the level where
//! it meets at most three nodes along each axis. So a box of any size takes 27 look-ups; the pyramid takes 1.15 bytes a voxel.

use rayon::prelude::*;
use splat_core::{Grid, Interpolation};

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
pub(super) fn widen(range: [f64; 2]) -> [f64; 2] {
    let [low, high] = range;
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
        nodes
            .par_chunks_mut(dims[0] * dims[1])
            .enumerate()
            .for_each(|(k, out)| layer(grid, interpolation, k, out, dims[0], dims[1]));
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

/// Ranges of the control points around the lattice points of one row.
///
/// Trilinear: the value itself. Catmull-Rom: around each lattice point lie v ± mₓ/3 ± mᵧ/3 ± m_z/3 ± mₓᵧ/9 … in all
/// combinations of its slopes; the sum of their magnitudes bounds them all, whichever cell they belong to.
struct Row {
    /// Values and their parts of slope along y, z and both, thirds folded in; one entry of padding at both ends.
    parts: [Vec<f64>; 4],
    low: Vec<f64>,
    high: Vec<f64>,
}

/// Neighbours of lattice point `i` on an axis and a third of one over their distance: m/3 = (v[hi] − v[lo])·scale.
fn slope(i: usize, n: usize) -> (usize, usize, f64) {
    let lo = i.saturating_sub(1);
    let hi = (i + 1).min(n - 1);
    (lo, hi, 1.0 / (3 * (hi - lo).max(1)) as f64)
}

impl Row {
    fn new(n: usize) -> Self {
        Self { parts: std::array::from_fn(|_| vec![0.0; n + 2]), low: vec![0.0; n], high: vec![0.0; n] }
    }

    fn fill(&mut self, grid: &Grid, interpolation: Interpolation, j: usize, k: usize) {
        let [nx, ny, nz] = grid.dims;
        let row = |j: usize, k: usize| &grid.values[(k * ny + j) * nx..][..nx];
        let value = row(j, k);
        if interpolation == Interpolation::Trilinear {
            value.iter().zip(&mut self.low).for_each(|(v, l)| *l = f64::from(*v));
            self.high.copy_from_slice(&self.low);
            return;
        }
        let (j0, j1, y) = slope(j, ny);
        let (k0, k1, z) = slope(k, nz);
        let below = row(j0, k);
        let above = row(j1, k);
        let front = row(j, k0);
        let back = row(j, k1);
        let corners = [row(j0, k0), row(j1, k0), row(j0, k1), row(j1, k1)];
        let difference = |a: f32, b: f32| f64::from(a) - f64::from(b);
        let [v, vy, vz, vyz] = &mut self.parts;
        for i in 0..nx {
            v[i + 1] = f64::from(value[i]);
            vy[i + 1] = difference(above[i], below[i]) * y;
            vz[i + 1] = difference(back[i], front[i]) * z;
            let across = difference(corners[3][i], corners[2][i]) - difference(corners[1][i], corners[0][i]);
            vyz[i + 1] = across * (y * z);
        }
        self.spread(nx);
    }

    /// From the parts to the ranges.
    fn spread(&mut self, nx: usize) {
        for part in &mut self.parts {
            // The border's slope is one-sided over one step: doubled, as the loop halves it.
            (part[0], part[nx + 1]) = (2.0 * part[1] - part[2.min(nx)], 2.0 * part[nx] - part[nx.max(2) - 1]);
        }
        let [v, vy, vz, vyz] = &self.parts;
        let along = |p: &[f64], i: usize| (p[i + 2] - p[i]).abs() * (1.0 / 6.0);
        for i in 0..nx {
            let across = vy[i + 1].abs() + vz[i + 1].abs() + vyz[i + 1].abs();
            let reach = across + along(v, i) + along(vy, i) + along(vz, i) + along(vyz, i);
            (self.low[i], self.high[i]) = (v[i + 1] - reach, v[i + 1] + reach);
        }
    }

    /// Joins the ranges to those of a row of nodes.
    fn join(&self, nodes: &mut [[f64; 2]]) {
        let last = self.low.len() - 1;
        for (i, node) in nodes.iter_mut().enumerate() {
            for p in 2 * i..=(2 * i + 2).min(last) {
                *node = [node[0].min(self.low[p]), node[1].max(self.high[p])];
            }
        }
    }
}

/// The finest nodes of one layer.
fn layer(grid: &Grid, interpolation: Interpolation, k: usize, out: &mut [Range], nx: usize, ny: usize) {
    let [points_x, points_y, points_z] = grid.dims;
    let mut row = Row::new(points_x);
    let mut nodes = vec![[f64::INFINITY, f64::NEG_INFINITY]; nx * ny];
    for plane in 2 * k..=(2 * k + 2).min(points_z - 1) {
        for j in 0..points_y {
            row.fill(grid, interpolation, j, plane);
            // An even row of points closes one row of nodes and begins the next.
            let begun = (j / 2 < ny).then_some(j / 2);
            let closed = (j % 2 == 0).then(|| (j / 2).checked_sub(1)).flatten();
            for node_row in [begun, closed].into_iter().flatten() {
                row.join(&mut nodes[node_row * nx..][..nx]);
            }
        }
    }
    out.iter_mut().zip(nodes).for_each(|(o, n)| *o = outward(n));
}
