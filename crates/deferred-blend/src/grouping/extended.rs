//! Groups that cover the surface each by itself, as transparent drawing needs (section 4.4.2).
//!
//! Two ways: [`duplicates`] adds discs of other groups where a group covers little, [`enlarged_radii`] makes the discs of a group
//! larger (Eqs. 11-13). For hashed groups, [`covering_factor`] returns a factor of the radius.
//!
//! Deviations: the paper takes splats in descending order of their clipped area and yet wants little overlap. Here the least clipped
//! disc comes first, so a stale priority is a lower bound. Eq. 11 with the area of overlap taken from both discs would subtract
//! it twice. Here a region that m discs cover is clipped by (m − 1)/m from each, which makes Eqs. 11-13 exact. Random discs never
//! cover a surface wholly (their Eq. 13 has no limit), so radii are capped.

use super::area::{WHOLE, covered_shares, epsilon_of};
use super::graph::{OverlapGraph, Search};
use super::surfels::{self, CHUNK, Surfel};
use super::weighted::check_gap;
use super::{Groups, check_cancelled, covering_factor};
use crate::Error;
use rayon::prelude::*;
use splat_core::glam::DVec3;
use splat_core::{Cloud, Progress};
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::f64::consts::PI;

/// Points of a disc that are asked for what covers them.
const SAMPLES: usize = 32;

/// Most iterations of Eq. 13.
const ITERATIONS: u32 = 20;

/// Fewer groups have the bound of these on their radii, √50/4.
const LEAST_GROUPS: u32 = 8;

/// Change of a radius, as a share of it, that ends the iteration.
const SETTLED: f64 = 1e-3;

/// Parameters of adding discs to further groups.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DuplicateParams {
    /// ε of Eq. 8 as a share of the discs' radius, > 0.
    pub gap: f32,
    /// A disc is added while the group covers at most this share of it, in \[0, 1).
    pub most_clipped: f32,
}

impl Default for DuplicateParams {
    fn default() -> Self {
        Self { gap: 0.5, most_clipped: 0.4 }
    }
}

/// Discs that join further groups: for each group the places in the cloud of those added to it, ascending.
///
/// The graph should be one of all overlaps ([`Relaxation::default`](super::Relaxation)).
///
/// # Errors
/// [`Error::Parameter`] for a parameter out of its range; [`Error::Cancelled`].
///
/// # Panics
/// If `groups` are not of the graph's cloud.
pub fn duplicates(
    graph: &OverlapGraph,
    groups: &Groups,
    params: &DuplicateParams,
    progress: Option<&Progress>,
) -> Result<Vec<Vec<u32>>, Error> {
    check_gap(params.gap)?;
    if !(0.0..1.0).contains(&params.most_clipped) {
        return Err(Error::parameter("most_clipped", params.most_clipped, "at least 0 and below 1"));
    }
    let shares = covered_shares(graph, params.gap);
    let most = (f64::from(params.most_clipped) * WHOLE) as u64;
    let of_group = |group: u32| {
        check_cancelled(progress)?;
        Ok(added(graph, &shares, groups, u64::from(group), most))
    };
    (0..groups.count()).into_par_iter().map(of_group).collect()
}

/// The two steps of the paper for one group.
fn added(graph: &OverlapGraph, shares: &[u16], groups: &Groups, group: u64, most: u64) -> Vec<u32> {
    let mut clipped = vec![0u64; graph.nodes()];
    let mut is_in: Vec<bool> =
        (0..graph.nodes()).map(|node| u64::from(groups.by_disc()[graph.place(node)]) == group).collect();
    for (node, clipped) in clipped.iter_mut().enumerate() {
        let covering = graph.neighbors(node).iter().zip(&shares[graph.row(node)]);
        *clipped = covering.filter(|(n, _)| is_in[**n as usize]).map(|(_, &share)| u64::from(share)).sum();
    }
    let outside = (0..graph.nodes()).filter(|&node| !is_in[node] && clipped[node] <= most);
    let mut queue: BinaryHeap<Reverse<(u64, usize)>> = outside.map(|node| Reverse((clipped[node], node))).collect();
    let mut places = Vec::new();
    while let Some(Reverse((priority, node))) = queue.pop() {
        if clipped[node] != priority {
            if clipped[node] <= most {
                queue.push(Reverse((clipped[node], node)));
            }
            continue;
        }
        is_in[node] = true;
        places.push(graph.place(node) as u32);
        for &n in graph.neighbors(node) {
            let n = n as usize;
            let rank = graph.neighbors(n).partition_point(|&m| (m as usize) < node);
            clipped[n] += u64::from(shares[graph.row(n).start + rank]);
        }
    }
    places.sort_unstable();
    places
}

/// A group whose discs are larger.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Enlarged {
    /// Radius over that of the discs, at least 1.
    pub factor: f64,
    /// Share of the surface that the group covers with it.
    pub covered: f64,
}

/// For each group the factor on its radii with which it should cover the surface (Eqs. 11-13), and how much it does cover. `disc_scale`
/// is the radius over the cut-off radius, `gap` ε of Eq. 8 as a share of the discs' radius.
///
/// The factor is at least 1 and at most [`covering_factor`], for fewer than eight groups that of eight, and at most 20 iterations are done. An empty group has the factor 1 and covers nothing.
///
/// # Errors
/// [`Error::Parameter`] and [`Error::Cloud`] for bad input, groups of another number of discs among it; [`Error::Limit`] for more
/// overlaps than fit into `max_bytes`; [`Error::Cancelled`].
pub fn enlarged_radii(
    cloud: &Cloud,
    groups: &Groups,
    params: &EnlargeParams,
    progress: Option<&Progress>,
) -> Result<Vec<Enlarged>, Error> {
    check_gap(params.gap)?;
    let surfels = surfels::read(cloud, params.disc_scale)?;
    if groups.by_disc().len() != surfels.len() {
        return Err(Error::parameter("number of grouped discs", groups.by_disc().len(), "that of the cloud"));
    }
    let most = covering_factor(groups.count().max(LEAST_GROUPS))?;
    let search = |factor| Search { factor, max_bytes: params.max_bytes, progress };
    let graph = OverlapGraph::with_edges(&surfels, &search(1.0), |a, b| a.overlaps(b, 1.0))?;
    let surface = Cover::new(&graph, params.gap).area(1.0);
    let enlarge = |group: u32| {
        let is_member = |surfel: &&Surfel| u32::from(groups.by_disc()[surfel.place as usize]) == group;
        let members: Vec<Surfel> = surfels.iter().filter(is_member).copied().collect();
        let graph = OverlapGraph::with_edges(&members, &search(most), |a, b| a.overlaps(b, most))?;
        Ok(Cover::new(&graph, params.gap).enlarged(surface, most))
    };
    (0..groups.count()).map(enlarge).collect()
}

/// Parameters of enlarging radii.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EnlargeParams {
    /// Radius of a disc over the cut-off radius of its splat, in (0, 1\].
    pub disc_scale: f32,
    /// ε of Eq. 8 as a share of the discs' radius, > 0.
    pub gap: f32,
    /// Most bytes of the lists of neighbours.
    pub max_bytes: u64,
}

impl Default for EnlargeParams {
    fn default() -> Self {
        Self { disc_scale: 1.0, gap: 0.5, max_bytes: 1 << 32 }
    }
}

/// What discs of a graph cover.
struct Cover<'a> {
    graph: &'a OverlapGraph,
    gap: f32,
    /// Places on a unit disc, evenly spread.
    places: [[f64; 2]; SAMPLES],
    /// Sum of the discs' areas.
    total: f64,
}

impl<'a> Cover<'a> {
    fn new(graph: &'a OverlapGraph, gap: f32) -> Self {
        let golden = PI * (3.0 - 5f64.sqrt());
        let place = |k: usize| {
            let radius = ((k as f64 + 0.5) / SAMPLES as f64).sqrt();
            let (sine, cosine) = libm::sincos(golden * k as f64);
            [radius * cosine, radius * sine]
        };
        let total = (0..graph.nodes()).map(|node| area(graph.surfel(node))).sum();
        Self { graph, gap, places: std::array::from_fn(place), total }
    }

    /// Eq. 11 with all radii `factor` times as large: the area that is covered at least once.
    fn area(&self, factor: f64) -> f64 {
        let nodes: Vec<usize> = (0..self.graph.nodes()).collect();
        let covered_area = |&node: &usize| area(self.graph.surfel(node)) * self.own_share(node, factor);
        let sums: Vec<f64> = nodes.par_chunks(CHUNK).map(|part| part.iter().map(covered_area).sum()).collect();
        sums.iter().sum::<f64>() * factor * factor
    }

    /// Mean over a disc of 1/m, m the number of discs that cover a point.
    fn own_share(&self, node: usize, factor: f64) -> f64 {
        let disc = self.graph.surfel(node);
        let axes = disc.axes().map(|a| a * factor);
        let others: Vec<Other> = self
            .graph
            .neighbors(node)
            .iter()
            .map(|&n| Other::new(disc, self.graph.surfel(n as usize), factor, self.gap))
            .collect();
        let share = |[x, y]: &[f64; 2]| {
            let point = axes[0] * *x + axes[1] * *y;
            1.0 / (1 + others.iter().filter(|other| other.covers(point)).count()) as f64
        };
        self.places.iter().map(share).sum::<f64>() / SAMPLES as f64
    }

    /// Eq. 13 until it settles: n·π·r̃² = A + Σ Clipped(r̃).
    fn enlarged(&self, surface: f64, most: f64) -> Enlarged {
        if self.total == 0.0 {
            return Enlarged { factor: 1.0, covered: 0.0 };
        }
        let mut factor = 1.0;
        for _ in 0..ITERATIONS {
            let clipped = self.total * factor * factor - self.area(factor);
            let next = ((surface + clipped) / self.total).sqrt().clamp(1.0, most);
            let change = (next - factor).abs() / factor;
            factor = next;
            if change < SETTLED {
                break;
            }
        }
        Enlarged { factor, covered: self.area(factor) / surface }
    }
}

/// A neighbour as seen from a disc's centre.
struct Other {
    center: DVec3,
    normal: DVec3,
    /// Semi-axes over their squared lengths.
    axes: [DVec3; 2],
    epsilon: f64,
}

impl Other {
    fn new(disc: &Surfel, other: &Surfel, factor: f64, gap: f32) -> Self {
        Self {
            center: other.from(disc),
            normal: other.normal.as_dvec3(),
            axes: other.axes().map(|a| a / (a.length_squared() * factor)),
            epsilon: epsilon_of(disc, other, gap),
        }
    }

    fn covers(&self, point: DVec3) -> bool {
        let at = point - self.center;
        let [x, y] = self.axes.map(|a| a.dot(at));
        self.normal.dot(at).abs() < self.epsilon && x * x + y * y < 1.0
    }
}

fn area(disc: &Surfel) -> f64 {
    PI * disc.mean_radius() * disc.mean_radius()
}
