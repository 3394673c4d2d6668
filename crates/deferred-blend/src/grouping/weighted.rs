//! WGC, weighted graph colouring: K groups with as little overlap as two greedy steps find (section 4.2).
//!
//! | symbol | here |
//! |---|---|
//! | A_ij (Eq. 8) | share of disc i's area that disc j covers, so that in a cloud of mixed radii large discs do not count for more |
//! | w_ij (Eq. 7) | [`weighted_cost`]: ½(A_ij + A_ji)·(1 − n_i·n_j) |
//! | L(G, K) (Eq. 6) | [`weighted_cost`]: Σ w_ij over edges within a group |
//! | Q | vertices by the greatest w_ij of their edges: the order in which the paper's queue of edges reaches them |
//! | Q₁ | vertices by Σ w_ij over neighbours of their own group, in rounds |
//! | `MinimizeOverlap` | the group whose discs share the least area with the disc, Σ ½(A_ij + A_ji); of equals the first |
//!
//! Where normals are equal every weight of Eq. 7 is 0 and both queues would have no order. There 1 − n_i·n_j counts as 2⁻¹⁰, so flat
//! parts come after curved ones, and among themselves in the order of overlapped area. Priorities are rounded to half octaves;
//! vertices of one priority come in the order of the graph, which is by size and place. The paper's second queue takes a vertex
//! again and again. Here a vertex returns when a neighbour has entered its group. Each change lowers the overlapped area within
//! groups, so the queue runs empty.

use super::area::{WHOLE, mutual_shares};
use super::graph::{FETCHED, OverlapGraph};
use super::surfels::CHUNK;
use super::{Groups, check_cancelled, check_count};
use crate::Error;
use rayon::prelude::*;
use splat_core::Progress;

/// 1 − n_i·n_j of discs of one plane.
const FLAT: f64 = 1.0 / 1024.0;

/// How a weighted colouring is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WeightedParams {
    /// Number of groups K, 1 to 256.
    pub groups: u32,
    /// ε of Eq. 8 as a share of the discs' radius, > 0: discs farther apart do not cover one another.
    pub gap: f32,
    /// A vertex is done when the others of its group cover no more than this share of its disc, ≥ 0.
    pub threshold: f32,
    /// Most rounds of the optimization.
    pub rounds: u32,
}

impl Default for WeightedParams {
    fn default() -> Self {
        Self { groups: 8, gap: 0.5, threshold: 0.0, rounds: 8 }
    }
}

impl WeightedParams {
    fn check(&self) -> Result<(), Error> {
        check_count(self.groups)?;
        check_gap(self.gap)?;
        if !(self.threshold >= 0.0 && self.threshold.is_finite()) {
            return Err(Error::parameter("threshold of overlap", self.threshold, "a finite number of at least 0"));
        }
        Ok(())
    }
}

pub(crate) fn check_gap(gap: f32) -> Result<(), Error> {
    if !(gap > 0.0 && gap.is_finite()) {
        return Err(Error::parameter("gap", gap, "a finite number above 0"));
    }
    Ok(())
}

/// Parts the discs of an overlap graph into K groups with little overlap.
///
/// # Errors
/// [`Error::Parameter`] for a parameter out of its range; [`Error::Cancelled`].
pub fn weighted_coloring(
    graph: &OverlapGraph,
    params: &WeightedParams,
    progress: Option<&Progress>,
) -> Result<Groups, Error> {
    params.check()?;
    let shares = mutual_shares(graph, params.gap);
    let mut vertices = Vertices::new(graph, &shares, params.groups);
    vertices.initialize(progress)?;
    vertices.optimize(params, progress)?;
    let of_node: Vec<u8> = vertices.group.iter().map(|&group| group as u8).collect();
    Ok(Groups::of_each(params.groups, graph.by_place(&of_node)))
}

/// The cost L(G, K) of Eq. 6 in f64: Σ ½(A_ij + A_ji)·(1 − n_i·n_j) over edges within a group, areas as shares of their discs.
///
/// # Errors
/// [`Error::Parameter`] for a gap that is not above 0.
///
/// # Panics
/// If `groups` are not of the graph's cloud.
pub fn weighted_cost(graph: &OverlapGraph, groups: &Groups, gap: f32) -> Result<f64, Error> {
    check_gap(gap)?;
    let shares = mutual_shares(graph, gap);
    let group = |node: usize| groups.by_disc()[graph.place(node)];
    let overlap = |node: usize| -> f64 {
        let edges = graph.neighbors(node).iter().map(|&n| n as usize).zip(&shares[graph.row(node)]);
        let later = edges.filter(|&(n, _)| n > node && group(n) == group(node));
        later.map(|(n, &share)| f64::from(share) / WHOLE * bend(graph, node, n)).sum()
    };
    let nodes: Vec<usize> = (0..graph.nodes()).collect();
    let sums: Vec<f64> = nodes.par_chunks(CHUNK).map(|part| part.iter().map(|&node| overlap(node)).sum()).collect();
    Ok(sums.iter().sum())
}

/// 1 − n_i·n_j.
fn bend(graph: &OverlapGraph, a: usize, b: usize) -> f64 {
    1.0 - graph.surfel(a).normal.as_dvec3().dot(graph.surfel(b).normal.as_dvec3())
}

struct Vertices<'a> {
    graph: &'a OverlapGraph,
    /// By entry, ½(A_ij + A_ji) over 1/65535.
    shares: &'a [u16],
    /// The number of groups for those without one.
    group: Vec<u16>,
    /// By group, and last for those without.
    overlap: Vec<u64>,
}

impl<'a> Vertices<'a> {
    fn new(graph: &'a OverlapGraph, shares: &'a [u16], groups: u32) -> Self {
        Self { graph, shares, group: vec![groups as u16; graph.nodes()], overlap: vec![0; groups as usize + 1] }
    }

    /// Neighbours with what they share.
    fn edges(&self, node: usize) -> impl Iterator<Item = (usize, u16)> {
        let row = self.graph.row(node);
        self.graph.neighbors(node).iter().map(|&n| n as usize).zip(self.shares[row].iter().copied())
    }

    /// w_ij with flat pairs told apart.
    fn weight(&self, node: usize, n: usize, share: u16) -> f64 {
        f64::from(share) * bend(self.graph, node, n).max(FLAT)
    }

    /// Step 1: vertices in the order in which the queue of edges reaches them.
    fn initialize(&mut self, progress: Option<&Progress>) -> Result<(), Error> {
        let greatest = |node: usize| self.edges(node).map(|(n, share)| self.weight(node, n, share)).fold(0.0, f64::max);
        let nodes: Vec<u32> = (0..self.graph.nodes() as u32).collect();
        for batch in by_falling(&nodes, greatest).chunks(FETCHED) {
            check_cancelled(progress)?;
            self.graph.fetch(batch);
            for &node in batch {
                self.group[node as usize] = self.minimize_overlap(node as usize).0;
            }
        }
        Ok(())
    }

    /// Step 2: vertices that overlap others of their group change to the best one.
    fn optimize(&mut self, params: &WeightedParams, progress: Option<&Progress>) -> Result<(), Error> {
        let threshold = (f64::from(params.threshold) * WHOLE) as u64;
        let mut waits = vec![true; self.graph.nodes()];
        for _ in 0..params.rounds {
            let nodes: Vec<u32> = (0..self.graph.nodes() as u32).into_par_iter().with_min_len(CHUNK).collect();
            let wait = |node: &&u32| waits[**node as usize] && self.own_overlap(**node as usize) > threshold;
            let queue: Vec<u32> = nodes.par_iter().with_min_len(CHUNK).filter(wait).copied().collect();
            if queue.is_empty() {
                break;
            }
            waits.fill(false);
            for batch in by_falling(&queue, |node| self.own_weight(node)).chunks(FETCHED) {
                check_cancelled(progress)?;
                batch.iter().for_each(|&node| self.improve(node as usize, &mut waits));
            }
        }
        Ok(())
    }

    /// Moves a vertex to a group with less overlap, if there is one; those that it overlaps there come into the queue.
    fn improve(&mut self, node: usize, waits: &mut [bool]) {
        let current = self.own_overlap(node);
        let (best, overlap) = self.minimize_overlap(node);
        if overlap >= current {
            return;
        }
        self.group[node] = best;
        let joined = self.graph.neighbors(node).iter().map(|&n| n as usize).filter(|&n| self.group[n] == best);
        joined.for_each(|n| waits[n] = true);
        waits[node] = overlap > 0;
    }

    /// The paper's function: the group of the least overlap with a vertex, and that overlap.
    fn minimize_overlap(&mut self, node: usize) -> (u16, u64) {
        let row = self.graph.row(node);
        self.overlap.fill(0);
        for (&n, &share) in self.graph.neighbors(node).iter().zip(&self.shares[row]) {
            self.overlap[usize::from(self.group[n as usize])] += u64::from(share);
        }
        let groups = &self.overlap[..self.overlap.len() - 1];
        let best = (0..groups.len()).min_by_key(|&group| groups[group]).unwrap_or(0);
        (best as u16, groups[best])
    }

    fn own_overlap(&self, node: usize) -> u64 {
        let same_group = self.edges(node).filter(|&(n, _)| self.group[n] == self.group[node]);
        same_group.map(|(_, share)| u64::from(share)).sum()
    }

    fn own_weight(&self, node: usize) -> f64 {
        let same_group = self.edges(node).filter(|&(n, _)| self.group[n] == self.group[node]);
        same_group.map(|(n, share)| self.weight(node, n, share)).sum()
    }
}

/// Vertices by falling priority, rounded to half octaves so that those of one priority lie near one another in memory; then ascending.
fn by_falling(nodes: &[u32], priority: impl Fn(usize) -> f64 + Sync) -> Vec<u32> {
    // Bits of a positive number rise with it; the first of its fraction halves the octave.
    let class = |&node: &u32| (u16::MAX as u64 - (priority(node as usize).to_bits() >> 51)) as u16;
    let classes: Vec<u16> = nodes.par_iter().with_min_len(CHUNK).map(class).collect();
    let mut starts = vec![0u32; usize::from(u16::MAX) + 2];
    classes.iter().for_each(|&class| starts[usize::from(class) + 1] += 1);
    (0..starts.len() - 1).for_each(|class| starts[class + 1] += starts[class]);
    let mut sorted = vec![0; nodes.len()];
    for (&node, &class) in nodes.iter().zip(&classes) {
        let next = &mut starts[usize::from(class)];
        sorted[*next as usize] = node;
        *next += 1;
    }
    sorted
}
