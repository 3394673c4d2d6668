//! The overlap graph: nodes are discs, edges join discs that overlap (Eq. 5), except pairs that may share a group all the same.

use super::cells::{self, Cells, Finder};
use super::surfels::{self, CHUNK, MORE, Surfel};
use super::{Groups, check_cancelled};
use crate::Error;
use rayon::prelude::*;
use splat_core::{Cloud, Exceeded, Progress};
use std::hint::black_box;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

/// Nodes whose lists are fetched together.
pub(crate) const FETCHED: usize = 32;

/// Entries that a task finds before it tells of them.
const COUNTED: usize = 1 << 16;

/// Overlaps that a group may have: the three modifications of section 4.1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Relaxation {
    /// (1): discs of one plane and one colour; `None` keeps their edges.
    pub coplanar: Option<Coplanar>,
    /// (2): discs whose normals point into opposite directions, n_i·n_j < 0.
    pub opposite: bool,
    /// (3): the factor c of |p_i − p_j| < c·(r_i + r_j), in (0, 1\]; the paper's 0 would leave no edge at all.
    pub factor: f32,
}

impl Default for Relaxation {
    /// No relaxation: Eq. 5 itself.
    fn default() -> Self {
        Self { coplanar: None, opposite: false, factor: 1.0 }
    }
}

/// When two discs count as of one plane and one colour; they must also have one material and be of one object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coplanar {
    /// Least cosine between the normals, in \[0, 1\].
    pub cosine: f32,
    /// Largest distance of either centre to the other disc's plane, as a share of r_i + r_j; ≥ 0.
    pub offset: f32,
    /// Largest difference between the colours, by channel; ≥ 0.
    pub color: f32,
}

impl Default for Coplanar {
    fn default() -> Self {
        Self { cosine: 0.999, offset: 0.01, color: 1.0 / 256.0 }
    }
}

/// Parameters of an overlap graph.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GraphParams {
    /// Radius of a disc over the cut-off radius of its splat, in (0, 1\]; see [`Params::disc_scale`](crate::Params::disc_scale).
    pub disc_scale: f32,
    /// The overlaps that make no edges.
    pub relaxation: Relaxation,
    /// Most bytes of the lists of neighbours.
    pub max_bytes: u64,
}

impl Default for GraphParams {
    fn default() -> Self {
        Self { disc_scale: 1.0, relaxation: Relaxation::default(), max_bytes: 1 << 32 }
    }
}

impl GraphParams {
    fn check(&self) -> Result<(), Error> {
        let Relaxation { coplanar, factor, .. } = self.relaxation;
        if !(factor > 0.0 && factor <= 1.0) {
            return Err(Error::parameter("factor c of the radii", factor, "above 0 and at most 1"));
        }
        let Some(Coplanar { cosine, offset, color }) = coplanar else { return Ok(()) };
        if !(0.0..=1.0).contains(&cosine) {
            return Err(Error::parameter("cosine of coplanar discs", cosine, "between 0 and 1"));
        }
        for (name, found) in [("offset of coplanar discs", offset), ("color of coplanar discs", color)] {
            if !(found >= 0.0 && found.is_finite()) {
                return Err(Error::parameter(name, found, "a finite number of at least 0"));
            }
        }
        Ok(())
    }
}

/// Discs and which of them overlap, as compressed rows: 8 bytes an edge, 52 bytes a disc.
///
/// Nodes are numbered by size and place, whatever the order of the cloud.
#[derive(Debug, Clone, Default)]
pub struct OverlapGraph {
    surfels: Vec<Surfel>,
    /// Where the neighbours of each node begin, and where those of the last end.
    starts: Vec<u32>,
    /// By node, ascending.
    neighbors: Vec<u32>,
}

impl OverlapGraph {
    /// Finds all edges between the discs of a cloud, each decided in f64 by the difference of both centres. Near-linear in discs
    /// and edges for any mixture of radii.
    ///
    /// # Errors
    /// [`Error::Parameter`] and [`Error::Cloud`] for bad input, pieces of a medium among it; [`Error::Limit`] for more edges than
    /// fit into the memory that there may be; [`Error::Cancelled`].
    pub fn build(cloud: &Cloud, params: &GraphParams, progress: Option<&Progress>) -> Result<Self, Error> {
        params.check()?;
        let surfels = surfels::read(cloud, params.disc_scale)?;
        let relaxation = &params.relaxation;
        let is_edge = |a: &Surfel, b: &Surfel| relaxation.joins(cloud, a, b);
        let search = Search { factor: f64::from(relaxation.factor), max_bytes: params.max_bytes, progress };
        Self::with_edges(&surfels, &search, is_edge)
    }

    /// The graph of the discs whose pairs `is_edge` joins among those within reach.
    pub(crate) fn with_edges(
        surfels: &[Surfel],
        search: &Search<'_>,
        is_edge: impl Fn(&Surfel, &Surfel) -> bool + Sync,
    ) -> Result<Self, Error> {
        let (surfels, cells) = cells::sort(surfels, search.factor);
        let found = AtomicU64::new(0);
        let parts: Vec<Part> = chunks(surfels.len())
            .into_par_iter()
            .map(|nodes| {
                let mut part = Part::new(nodes.len());
                part.find(&surfels, &cells, search, nodes, &is_edge, &found)?;
                Ok(part)
            })
            .collect::<Result<_, _>>()?;
        let (starts, neighbors) = join(parts, surfels.len());
        let graph = Self { surfels, starts, neighbors };
        Ok(if cells.levels() > 1 { graph.with_smaller_partners(&cells, search)? } else { graph })
    }

    /// Adds to the lists of larger discs the smaller ones that name them.
    fn with_smaller_partners(self, cells: &Cells, search: &Search<'_>) -> Result<Self, Error> {
        let Self { surfels, starts, neighbors } = self;
        let row = |node: usize| starts[node] as usize..starts[node + 1] as usize;
        let ends: Vec<usize> = (0..surfels.len()).map(|node| cells.end_of_level(node)).collect();
        let mut sizes: Vec<u64> = (0..surfels.len()).map(|node| row(node).len() as u64).collect();
        // Ascending, so partners of larger discs are the last ones.
        let larger = |node: usize| {
            let list = &neighbors[row(node)];
            &list[list.partition_point(|&n| (n as usize) < ends[node])..]
        };
        (0..surfels.len()).for_each(|node| larger(node).iter().for_each(|&n| sizes[n as usize] += 1));
        let total = sizes.iter().sum();
        if total > search.most_entries() {
            return Err(search.exceeded(total));
        }
        let mut lists = vec![0; total as usize];
        let mut new_starts = vec![0u32];
        let mut end = 0;
        new_starts.extend(sizes.iter().map(|&size| {
            end += size as u32;
            end
        }));
        // Nodes come in order of size, so smaller partners, which come first in a list, are in it before the list's own.
        let mut next: Vec<u32> = new_starts.clone();
        for node in 0..surfels.len() {
            let list = &neighbors[row(node)];
            let at = next[node] as usize;
            lists[at..at + list.len()].copy_from_slice(list);
            for &n in larger(node) {
                lists[next[n as usize] as usize] = node as u32;
                next[n as usize] += 1;
            }
        }
        Ok(Self { surfels, starts: new_starts, neighbors: lists })
    }

    /// Number of nodes, one for each disc.
    pub fn nodes(&self) -> usize {
        self.surfels.len()
    }

    /// Number of edges.
    pub fn edges(&self) -> u64 {
        self.neighbors.len() as u64 / 2
    }

    /// Nodes that a node shares an edge with, ascending.
    ///
    /// # Panics
    /// If the node is out of range.
    pub fn neighbors(&self, node: usize) -> &[u32] {
        &self.neighbors[self.row(node)]
    }

    /// Number of edges of a node.
    ///
    /// # Panics
    /// If the node is out of range.
    pub fn degree(&self, node: usize) -> usize {
        self.row(node).len()
    }

    /// Greatest number of edges of a node.
    pub fn max_degree(&self) -> usize {
        (0..self.nodes()).map(|node| self.degree(node)).max().unwrap_or(0)
    }

    /// Place in the cloud of a node's disc.
    ///
    /// # Panics
    /// If the node is out of range.
    pub fn place(&self, node: usize) -> usize {
        self.surfels[node].place as usize
    }

    /// Bytes held.
    pub fn bytes(&self) -> u64 {
        (size_of_val(&*self.surfels) + size_of_val(&*self.starts) + size_of_val(&*self.neighbors)) as u64
    }

    /// Pairs of discs, by their places in the cloud, that share both an edge and a group: none for a colouring of this graph.
    ///
    /// # Panics
    /// If `groups` are not of the graph's cloud.
    pub fn overlaps(&self, groups: &Groups) -> Vec<[u32; 2]> {
        let group = |node: usize| groups.by_disc()[self.place(node)];
        let pairs = (0..self.nodes()).into_par_iter().with_min_len(CHUNK).flat_map_iter(|node| {
            let later = self.neighbors(node).iter().filter(move |&&n| n as usize > node);
            later.filter(move |&&n| group(n as usize) == group(node)).map(move |&n| {
                let [a, b] = [self.place(node) as u32, self.place(n as usize) as u32];
                [a.min(b), a.max(b)]
            })
        });
        pairs.collect()
    }

    /// Mean over all discs of the overlap factor of Table 2, Σ(2r − |p_i − p_k|)/r over the discs of disc i's own group that overlap
    /// it. Of two radii r is their mean, an ellipse has that of the circle of its area. The graph should have the factor 1.
    ///
    /// # Panics
    /// If `groups` are not of the graph's cloud.
    pub fn mean_overlap(&self, groups: &Groups) -> f64 {
        let group = |node: usize| groups.by_disc()[self.place(node)];
        let overlap = |node: usize| -> f64 {
            let a = &self.surfels[node];
            let same = self.neighbors(node).iter().filter(|&&n| group(n as usize) == group(node));
            same.map(|&n| {
                let b = &self.surfels[n as usize];
                let r = 0.5 * (a.mean_radius() + b.mean_radius());
                (2.0 - a.from(b).length() / r).max(0.0)
            })
            .sum()
        };
        let nodes: Vec<usize> = (0..self.nodes()).collect();
        let sums: Vec<f64> = nodes.par_chunks(CHUNK).map(|part| part.iter().map(|&node| overlap(node)).sum()).collect();
        sums.iter().sum::<f64>() / (self.nodes().max(1)) as f64
    }

    pub(crate) fn row(&self, node: usize) -> Range<usize> {
        self.starts[node] as usize..self.starts[node + 1] as usize
    }

    /// Entries of consecutive nodes.
    pub(crate) fn rows(&self, nodes: Range<usize>) -> Range<usize> {
        let start = |node: usize| self.starts.get(node).map_or(0, |&start| start as usize);
        start(nodes.start)..start(nodes.end)
    }

    /// Brings the lists of [`FETCHED`] nodes into the cache: in an order that is not theirs lists lie anywhere in memory, and those that
    /// are asked for together arrive together.
    pub(crate) fn fetch(&self, nodes: &[u32]) {
        let ends = |&node: &u32| {
            let list = self.neighbors(node as usize);
            list.first().copied().unwrap_or(0) ^ list.last().copied().unwrap_or(0)
        };
        black_box(nodes.iter().map(ends).fold(0, |bits, end| bits ^ end));
    }

    pub(crate) fn surfel(&self, node: usize) -> &Surfel {
        &self.surfels[node]
    }

    /// What belongs to the nodes, by places in the cloud.
    pub(crate) fn by_place<T: Copy + Default>(&self, of_node: &[T]) -> Vec<T> {
        let mut of_place = vec![T::default(); of_node.len()];
        self.surfels.iter().zip(of_node).for_each(|(surfel, &value)| of_place[surfel.place as usize] = value);
        of_place
    }
}

impl Relaxation {
    fn joins(&self, cloud: &Cloud, a: &Surfel, b: &Surfel) -> bool {
        a.overlaps(b, f64::from(self.factor))
            && !(self.opposite && a.normal.as_dvec3().dot(b.normal.as_dvec3()) < 0.0)
            && !self.coplanar.is_some_and(|coplanar| coplanar.holds(cloud, a, b))
    }
}

impl Coplanar {
    fn holds(&self, cloud: &Cloud, a: &Surfel, b: &Surfel) -> bool {
        let i = a.place as usize;
        let j = b.place as usize;
        let n = a.normal.as_dvec3();
        let m = b.normal.as_dvec3();
        let offset = a.from(b);
        let reach = f64::from(self.offset) * (f64::from(a.reach) + f64::from(b.reach));
        let is_near = |(p, q): (&f32, &f32)| (p - q).abs() <= self.color;
        n.dot(m) >= f64::from(self.cosine)
            && n.dot(offset).abs().max(m.dot(offset).abs()) <= reach
            && cloud.color[i].iter().zip(&cloud.color[j]).all(is_near)
            && (cloud.material[i], cloud.object[i]) == (cloud.material[j], cloud.object[j])
    }
}

/// How partners are looked for.
pub(crate) struct Search<'a> {
    /// Largest distance over the sum of both reaches.
    pub(crate) factor: f64,
    pub(crate) max_bytes: u64,
    pub(crate) progress: Option<&'a Progress>,
}

impl Search<'_> {
    /// Rows begin at numbers of 32 bits.
    fn most_entries(&self) -> u64 {
        (self.max_bytes / size_of::<u32>() as u64).min(u64::from(u32::MAX))
    }

    /// Counts what was found, and stops where that is too much.
    fn count(&self, found: &AtomicU64, entries: u64) -> Result<(), Error> {
        check_cancelled(self.progress)?;
        if found.fetch_add(entries, Ordering::Relaxed) + entries > self.most_entries() {
            // The search ends here, so how many there would be is not known.
            return Err(self.exceeded(u64::MAX));
        }
        Ok(())
    }

    fn exceeded(&self, entries: u64) -> Error {
        Error::Limit(Exceeded {
            what: "overlapping discs".into(),
            needed: entries.saturating_mul(size_of::<u32>() as u64),
            limit: Some(self.max_bytes),
            unit: "bytes",
            hint: "make discs smaller, relax the overlap, or group by hashing".into(),
        })
    }
}

/// The neighbours of consecutive nodes.
struct Part {
    sizes: Vec<u32>,
    neighbors: Vec<u32>,
}

impl Part {
    fn new(nodes: usize) -> Self {
        Self { sizes: Vec::with_capacity(nodes), neighbors: Vec::with_capacity(8 * nodes) }
    }

    fn find(
        &mut self,
        surfels: &[Surfel],
        cells: &Cells,
        search: &Search<'_>,
        nodes: Range<usize>,
        is_edge: &impl Fn(&Surfel, &Surfel) -> bool,
        found: &AtomicU64,
    ) -> Result<(), Error> {
        let mut finder = Finder::new(cells);
        let mut near = Vec::new();
        let factor = search.factor as f32 * MORE;
        let mut counted = 0;
        for node in nodes {
            let surfel = &surfels[node];
            let before = self.neighbors.len();
            near.clear();
            finder.runs(surfel.center, node, |run| {
                let discs = (run.start as u32..run.end as u32).zip(&surfels[run]);
                surfel.add_near(discs.map(|(n, disc)| (n, disc.center, disc.reach)), factor, &mut near);
            });
            let edges = near.iter().filter(|&&other| {
                let candidate = &surfels[other as usize];
                // In one order, so that both discs come to the same result.
                let (a, b) = if (other as usize) < node { (candidate, surfel) } else { (surfel, candidate) };
                other as usize != node && is_edge(a, b)
            });
            self.neighbors.extend(edges);
            self.sizes.push((self.neighbors.len() - before) as u32);
            // Seldom, for all tasks count together; but before one task alone takes much memory.
            if self.neighbors.len() - counted >= COUNTED {
                search.count(found, (self.neighbors.len() - counted) as u64)?;
                counted = self.neighbors.len();
            }
        }
        search.count(found, (self.neighbors.len() - counted) as u64)
    }
}

/// The rows of all parts, one after the other.
fn join(parts: Vec<Part>, nodes: usize) -> (Vec<u32>, Vec<u32>) {
    let mut starts = Vec::with_capacity(nodes + 1);
    let mut end = 0;
    starts.push(0);
    for size in parts.iter().flat_map(|part| &part.sizes) {
        end += size;
        starts.push(end);
    }
    let mut neighbors = vec![0; end as usize];
    let places = cut(&mut neighbors, parts.iter().map(|part| part.neighbors.len()));
    parts.into_par_iter().zip(places).for_each(|(part, place)| place.copy_from_slice(&part.neighbors));
    (starts, neighbors)
}

/// Consecutive nodes for a task each.
pub(crate) fn chunks(nodes: usize) -> Vec<Range<usize>> {
    (0..nodes).step_by(CHUNK).map(|from| from..(from + CHUNK).min(nodes)).collect()
}

/// Consecutive parts of a slice.
pub(crate) fn cut<T>(mut rest: &mut [T], lengths: impl Iterator<Item = usize>) -> Vec<&mut [T]> {
    let next = |length| {
        let (part, after) = std::mem::take(&mut rest).split_at_mut(length);
        rest = after;
        part
    };
    lengths.map(next).collect()
}
