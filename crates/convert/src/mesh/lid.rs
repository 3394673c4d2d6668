//! Lids of bodies that are cut open: the section of a closed mesh by a plane, as triangles that close it again.
//!
//! A clipped closed mesh has edges along the plane that belong to one triangle alone. Vertices at one place are merged, so meshes whose
//! triangles share nothing are closed too. These edges form outlines. If an outline ends, the mesh is open, and no lid would close it. Gaps that
//! are small beside the outline, such as pinholes of scans, are bridged. The lid uses the vertices of the outlines, so no gap opens between lid and
//! walls.
//!
//! Points that outlines wind around, once or more often, are inside: bodies of one mesh may overlap, and the wall of a cavity goes around the other
//! way. If triangles of a mesh disagree on which side is outside, points that an odd number of outlines surrounds are inside.

mod fill;

use crate::mesh::clipped_mesh::{Rim, clipped_by, cut};
use fill::{Place, fill};
use splat_core::glam::{DVec3, Vec3};
use splat_core::text::counted;
use splat_core::{Clip, Mesh};
use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

/// Largest gap of an outline that is bridged, as a share of its length.
const LARGEST_GAP: f64 = 0.02;

/// Most ends of an outline whose gaps are looked for: each is held against all others.
const MOST_ENDS: usize = 256;

/// A clipped mesh with lids.
pub struct LiddedMesh {
    /// The part that is kept, closed by lids where its outlines close.
    pub mesh: Arc<Mesh>,
    /// Counts of lids, and of outlines without one.
    pub report: LidReport,
}

/// The report of lids.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LidReport {
    /// Triangles of lids.
    pub triangles: u64,
    /// Outlines of sections that do not close, and have no lid.
    pub open: u64,
    /// Small gaps of outlines that lids bridge.
    pub bridged: u64,
}

impl LidReport {
    /// Warnings that the mesh is open where it is cut, one sentence each without a full stop.
    pub fn said(&self) -> impl Iterator<Item = String> {
        let open = counted(self.open, "outline");
        let bridged = counted(self.bridged, "small gap");
        let open = format!("`clip` leaves {open} of it without a lid: the mesh is open there");
        let bridged = format!("lids of `clip` bridge {bridged} of the mesh");
        [(self.open, open), (self.bridged, bridged)].into_iter().filter(|(n, _)| *n > 0).map(|(_, said)| said)
    }
}

/// [`crate::clipped_mesh`] with lids where half-spaces and boxes cut a body open, each with the normal of its plane and the colours of its
/// rim. Of triangles in a border itself those stay that the body ends at.
///
/// ```
/// use splat_core::Clip;
/// use convert::lidded_mesh;
/// use splat_core::{Mesh, glam::{DVec3, Vec3}};
/// // A tetrahedron; the plane cuts off its tip.
/// let position = vec![Vec3::ZERO, Vec3::X * 2.0, Vec3::Y * 2.0, Vec3::Z * 2.0];
/// let triangles = vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
/// let tetrahedron = Mesh { position, triangles, ..Mesh::default() };
/// let stump = lidded_mesh(tetrahedron.into(), &[Clip::HalfSpace { normal: DVec3::Z, offset: 1.0 }]);
/// let lid = stump.mesh.triangles.iter().filter(|t| t.iter().all(|v| stump.mesh.position[*v as usize].z == 1.0));
/// assert_eq!((lid.count(), stump.report.triangles, stump.report.open), (1, 1, 0));
/// ```
///
/// # Panics
/// If an index is out of range; see [`Mesh::validate`].
pub fn lidded_mesh(mesh: Arc<Mesh>, clips: &[Clip]) -> LiddedMesh {
    let mut report = LidReport::default();
    let closed = clipped_by(mesh, clips, |mesh, normal, offset| {
        let mut rims = Vec::new();
        let mut part = cut(mesh, normal, offset, Some(&mut rims));
        close(&mut part, normal, &rims, &mut report);
        part
    });
    LiddedMesh { mesh: closed, report }
}

/// Adds the lid between edges along a plane.
fn close(mesh: &mut Mesh, normal: DVec3, edges: &[[Rim; 2]], report: &mut LidReport) {
    let mut outlines = Outlines::from_edges(mesh, edges);
    outlines.close(report);
    let (places, triangles) = fill(&outlines, normal);
    let first = mesh.position.len() as u32;
    let normal = normal.normalize().as_vec3();
    for Place { rim, crossing } in places {
        let rim = outlines.rims[rim].vertex as usize;
        mesh.push_copy(rim);
        if let (Some(place), Some(last)) = (crossing, mesh.position.last_mut()) {
            *last = place.as_vec3();
        }
        mesh.normal.push(normal);
    }
    report.triangles += triangles.len() as u64;
    mesh.triangles.extend(triangles.into_iter().map(|corners| corners.map(|place| first + place as u32)));
}

/// The edges along a plane that close what is kept, between vertices at different places.
struct Outlines {
    rims: Vec<Rim>,
    edges: Vec<Edge>,
}

/// An edge between two rims.
struct Edge {
    ends: [usize; 2],
    /// How much oftener triangles have it from the first end to the second than back; never 0.
    times: i64,
}

impl Outlines {
    /// Edges that two triangles have, one each way, are none.
    fn from_edges(mesh: &Mesh, edges: &[[Rim; 2]]) -> Self {
        let mut rims = Vec::new();
        let mut known = HashMap::new();
        let mut times = BTreeMap::new();
        let mut number = |rim: Rim| {
            // −0 is 0.
            let place = (mesh.position[rim.vertex as usize] + Vec3::ZERO).to_array().map(f32::to_bits);
            *known.entry(place).or_insert_with(|| {
                rims.push(rim);
                rims.len() - 1
            })
        };
        for edge in edges {
            let [from, to] = edge.map(&mut number);
            if from != to {
                *times.entry([from.min(to), from.max(to)]).or_insert(0) += if from < to { 1 } else { -1 };
            }
        }
        let edges = times.into_iter().filter(|(_, times)| *times != 0).map(|(ends, times)| Edge { ends, times });
        Self { edges: edges.collect(), rims }
    }

    /// Bridges small gaps, and leaves out what stays open.
    fn close(&mut self, report: &mut LidReport) {
        let mut parent: Vec<usize> = (0..self.rims.len()).collect();
        for Edge { ends, .. } in &self.edges {
            let [a, b] = ends.map(|end| root(&mut parent, end));
            parent[a.max(b)] = a.min(b);
        }
        let part: Vec<usize> = (0..self.rims.len()).map(|rim| root(&mut parent, rim)).collect();
        let mut length = vec![0.0; self.rims.len()];
        self.edges.iter().for_each(|edge| length[part[edge.ends[0]]] += self.distance(edge.ends));
        let surplus = self.surplus();
        let mut ends = BTreeMap::new();
        for rim in (0..surplus.len()).filter(|rim| surplus[*rim] % 2 != 0) {
            ends.entry(part[rim]).or_insert_with(Vec::new).push(rim);
        }
        let mut is_open = vec![false; self.rims.len()];
        for (part, ends) in ends {
            match self.bridges(ends, &surplus, LARGEST_GAP * length[part]) {
                Some(bridges) => {
                    report.bridged += bridges.len() as u64;
                    self.edges.extend(bridges);
                }
                None => {
                    report.open += 1;
                    is_open[part] = true;
                }
            }
        }
        self.edges.retain(|edge| !is_open[part[edge.ends[0]]]);
    }

    /// Edges from each end to the nearest other one; `None` where one of them were too long.
    fn bridges(&self, mut ends: Vec<usize>, surplus: &[i64], longest: f64) -> Option<Vec<Edge>> {
        let mut bridges = Vec::new();
        if ends.len() > MOST_ENDS {
            return None;
        }
        while let Some(end) = ends.pop() {
            let far = |other: usize| self.distance([end, other]);
            let nearest = (0..ends.len()).min_by(|a, b| far(ends[*a]).total_cmp(&far(ends[*b])))?;
            let other = ends.swap_remove(nearest);
            if far(other) > longest {
                return None;
            }
            // Where more edges lead away from an end than to it, the bridge leads to it.
            let is_rising = (surplus[end] > 0) == (other < end);
            bridges.push(Edge { ends: [end.min(other), end.max(other)], times: if is_rising { 1 } else { -1 } });
        }
        Some(bridges)
    }

    fn distance(&self, ends: [usize; 2]) -> f64 {
        let [a, b] = ends.map(|rim| self.rims[rim].place);
        a.distance(b)
    }

    /// How many more edges lead away from each rim than to it.
    fn surplus(&self) -> Vec<i64> {
        let mut surplus = vec![0; self.rims.len()];
        for Edge { ends: [from, to], times } in &self.edges {
            surplus[*from] += times;
            surplus[*to] -= times;
        }
        surplus
    }

    /// Whether as many edges lead to each rim as lead away: triangles agree on what is outside.
    fn are_wound(&self) -> bool {
        self.surplus().iter().all(|surplus| *surplus == 0)
    }
}

/// The first of what hangs together with a rim, as far as is known; ways to it are halved.
fn root(parent: &mut [usize], mut rim: usize) -> usize {
    while parent[rim] != rim {
        parent[rim] = parent[parent[rim]];
        rim = parent[rim];
    }
    rim
}

#[cfg(test)]
mod tests;
