//! Bricks of a lattice in which a transfer function has no extinction: their voxels are skipped.

use crate::common::extremes::{greater, lesser};
use crate::volume::classify::Classes;
use rayon::prelude::*;
use splat_core::Grid;
use std::ops::Range;

/// Lattice points along a brick's sides.
const SIDE: usize = 8;

/// Which bricks may show something.
pub(crate) struct Bricks {
    shown: Vec<bool>,
    counts: [usize; 3],
}

impl Bricks {
    /// By the values of each brick and one lattice point around it, which the cells of its own points reach.
    pub(crate) fn new(lattice: &Grid, classes: &Classes<'_>) -> Self {
        let counts = lattice.dims.map(|n| n.div_ceil(SIDE));
        let mut shown = vec![false; counts.iter().product()];
        shown.par_chunks_mut(counts[0]).enumerate().for_each(|(row, out)| {
            let ranges = ranges(lattice, [row % counts[1], row / counts[1]], counts[0]);
            out.iter_mut().zip(ranges).for_each(|(shown, [low, high])| *shown = classes.shows(low, high));
        });
        Self { shown, counts }
    }

    /// The parts of row j of slab k that may show something, in order.
    pub(crate) fn spans(&self, lattice: &Grid, j: usize, k: usize) -> impl Iterator<Item = Range<usize>> {
        let first = (k / SIDE * self.counts[1] + j / SIDE) * self.counts[0];
        let nx = lattice.dims[0];
        let row = &self.shown[first..][..self.counts[0]];
        let mut at = 0;
        row.chunk_by(|a, b| a == b).filter_map(move |run| {
            let from = at;
            at += run.len();
            run[0].then(|| from * SIDE..nx.min(at * SIDE))
        })
    }
}

/// Ranges of the values in and around the bricks of the row at this place along y and z.
fn ranges(lattice: &Grid, at: [usize; 2], count: usize) -> Vec<[f32; 2]> {
    let [nx, ny, nz] = lattice.dims;
    let around = |brick: usize, n: usize| (brick * SIDE).saturating_sub(1)..(brick * SIDE + SIDE + 1).min(n);
    let mut columns = [vec![0.0; nx], vec![0.0; nx]];
    range_of_rows(lattice, around(at[0], ny), around(at[1], nz), 0..nx, &mut columns);
    let range = |brick: usize| {
        let [low, high] = columns.each_ref().map(|c| c[around(brick, nx)].iter().copied());
        [low.fold(f32::INFINITY, lesser), high.fold(f32::NEG_INFINITY, greater)]
    };
    (0..count).map(range).collect()
}

/// Least and greatest values at each place of `part`, over rows of some j and some k.
// Columns go by eights, which stay in registers.
pub(crate) fn range_of_rows(
    lattice: &Grid,
    js: Range<usize>,
    ks: Range<usize>,
    part: Range<usize>,
    ranges: &mut [Vec<f32>; 2],
) {
    let [lows, highs] = ranges;
    let [nx, ny, _] = lattice.dims;
    for from in part.clone().step_by(SIDE) {
        let columns = from..part.end.min(from + SIDE);
        let [mut low, mut high] = [[f32::INFINITY; SIDE], [f32::NEG_INFINITY; SIDE]];
        for k in ks.clone() {
            for j in js.clone() {
                let row = &lattice.values[(k * ny + j) * nx..][columns.clone()];
                if let Some(row) = row.first_chunk::<SIDE>() {
                    for c in 0..SIDE {
                        (low[c], high[c]) = (lesser(row[c], low[c]), greater(row[c], high[c]));
                    }
                } else {
                    for (c, v) in row.iter().enumerate() {
                        (low[c], high[c]) = (lesser(*v, low[c]), greater(*v, high[c]));
                    }
                }
            }
        }
        lows[columns.clone()].copy_from_slice(&low[..columns.len()]);
        highs[columns.clone()].copy_from_slice(&high[..columns.len()]);
    }
}
