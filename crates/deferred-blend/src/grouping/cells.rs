//! Cells for finding discs near one another, in near-linear time for any mixture of radii.
//!
//! Discs are divided into levels by their reach, an octave each. Every level has a uniform lattice whose cells are as wide as the greatest
//! distance of two overlapping discs. So a disc finds all partners of its level, and of each level with larger discs, in 3×3×3 cells.
//! Occupied cells are a sorted list, x running fastest, so that three cells along x are one run of it.

use super::surfels::{CHUNK, Surfel};
use rayon::prelude::*;
use splat_core::glam::{DVec3, Vec3};
use std::ops::Range;

/// Bits of a coordinate of a cell.
const BITS: u32 = 21;

/// Cells along an axis; wider cells take the place of more. Two of 2²¹ are the border around.
const MOST_CELLS: f64 = ((1u64 << BITS) - 4) as f64;

/// Levels; the finest holds all that is smaller too.
const MOST_LEVELS: usize = 24;

/// Steps from the place of the last cell before a search.
const STEPS: usize = 8;

/// Discs of one range of reaches.
#[derive(Debug, Clone, Default)]
struct Level {
    /// Width of a cell.
    width: f64,
    /// Nodes of the level.
    nodes: Range<usize>,
    /// Cells that hold a disc, in order.
    keys: Vec<u64>,
    /// First node of each cell, and the end of the last.
    starts: Vec<u32>,
}

/// Discs by their cells.
#[derive(Debug, Clone, Default)]
pub(crate) struct Cells {
    least: DVec3,
    /// Small discs first.
    levels: Vec<Level>,
}

/// Sorts discs by levels and cells, and within a cell leaves them in the order that they come in. Partners are found that lie
/// within `factor` times the sum of their reaches.
pub(crate) fn sort(surfels: &[Surfel], factor: f64) -> (Vec<Surfel>, Cells) {
    let (largest, low, high) = surfels
        .par_iter()
        .with_min_len(CHUNK)
        .map(|s| (s.reach, s.center, s.center))
        .reduce(|| (0.0, Vec3::MAX, Vec3::MIN), |a, b| (a.0.max(b.0), a.1.min(b.1), a.2.max(b.2)));
    let mut cells = Cells { least: low.as_dvec3(), levels: Vec::new() };
    let extent = (high.as_dvec3() - cells.least).max_element();
    let mut members: Vec<Vec<u32>> = vec![Vec::new(); MOST_LEVELS];
    for (i, surfel) in surfels.iter().enumerate() {
        members[level(surfel.reach, largest)].push(i as u32);
    }
    let mut sorted = Vec::with_capacity(surfels.len());
    for members in members.iter().rev().filter(|members| !members.is_empty()) {
        let reach = members.iter().map(|&i| surfels[i as usize].reach).fold(0.0, f32::max);
        // Wider by what a quotient may be rounded.
        let width = (2.0 * factor * f64::from(reach)).max(extent / MOST_CELLS) * (1.0 + 1e-9);
        let keyed = members.par_iter().with_min_len(CHUNK);
        let keyed = keyed.map(|&i| (key(surfels[i as usize].center, cells.least, width), i));
        let mut keyed: Vec<(u64, u32)> = keyed.collect();
        keyed.par_sort_unstable();
        let first = sorted.len();
        sorted.par_extend(keyed.par_iter().with_min_len(CHUNK).map(|&(_, i)| surfels[i as usize]));
        let mut level = Level { width, nodes: first..sorted.len(), ..Level::default() };
        for (node, &(key, _)) in (first as u32..).zip(&keyed) {
            if level.keys.last() != Some(&key) {
                level.keys.push(key);
                level.starts.push(node);
            }
        }
        level.starts.push(sorted.len() as u32);
        cells.levels.push(level);
    }
    (sorted, cells)
}

/// Octaves below the largest reach.
fn level(reach: f32, largest: f32) -> usize {
    let ratio = f64::from(largest) / f64::from(reach);
    (((ratio.to_bits() >> 52) as usize).saturating_sub(1023)).min(MOST_LEVELS - 1)
}

/// A cell as a number: x in the lowest bits. Coordinates begin at 1, so that neighbours have numbers too.
fn key(center: Vec3, least: DVec3, width: f64) -> u64 {
    let [x, y, z] = ((center.as_dvec3() - least) / width).to_array().map(|v| v as u64 + 1);
    z << (2 * BITS) | y << BITS | x
}

impl Cells {
    /// Number of levels.
    pub(crate) fn levels(&self) -> usize {
        self.levels.len()
    }

    /// First node of the levels with larger discs than that of a node.
    pub(crate) fn end_of_level(&self, node: usize) -> usize {
        self.levels.iter().find(|level| node < level.nodes.end).map_or(node, |level| level.nodes.end)
    }
}

/// Looks partners up for one node after the other; fastest in the order of nodes.
pub(crate) struct Finder<'a> {
    cells: &'a Cells,
    rows: Vec<Rows>,
}

/// The runs of nodes around one cell.
#[derive(Debug, Clone, Default)]
struct Rows {
    key: u64,
    /// Where the last search ended, by row.
    hints: [usize; 9],
    runs: [(u32, u32); 9],
}

impl<'a> Finder<'a> {
    pub(crate) fn new(cells: &'a Cells) -> Self {
        Self { cells, rows: vec![Rows::default(); cells.levels.len()] }
    }

    /// Calls `visit` with runs of nodes, in ascending order, among which are all partners of a disc that are of its own level or
    /// of one with larger discs; the disc itself is among them.
    pub(crate) fn runs(&mut self, center: Vec3, node: usize, mut visit: impl FnMut(Range<usize>)) {
        for (level, rows) in self.cells.levels.iter().zip(&mut self.rows) {
            if node >= level.nodes.end {
                continue;
            }
            let key = key(center, self.cells.least, level.width);
            if rows.key != key {
                rows.seek(level, key);
            }
            rows.runs.iter().for_each(|&(from, to)| visit(from as usize..to as usize));
        }
    }
}

impl Rows {
    fn seek(&mut self, level: &Level, key: u64) {
        self.key = key;
        for row in 0..9 {
            let y = (row % 3) as u64;
            let z = (row / 3) as u64;
            // The row's first cell is one to the left.
            let first = key + (y << BITS) + (z << (2 * BITS)) - (1 << BITS) - (1 << (2 * BITS)) - 1;
            let from = seek(&level.keys, first, self.hints[row]);
            let cells = level.keys[from..].iter().take_while(|&&k| k <= first + 2).count();
            self.hints[row] = from;
            self.runs[row] = (level.starts[from], level.starts[from + cells]);
        }
    }
}

/// First place of `keys` with at least `key`; quick where that is a few steps behind `hint`.
fn seek(keys: &[u64], key: u64, hint: usize) -> usize {
    if hint > 0 && keys[hint - 1] >= key {
        return keys[..hint].partition_point(|&k| k < key);
    }
    let near = keys[hint..].iter().take(STEPS).take_while(|&&k| k < key).count();
    if near < STEPS { hint + near } else { hint + near + keys[hint + near..].partition_point(|&k| k < key) }
}
