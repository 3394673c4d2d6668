//! Faults of a mesh that a picture or a print may show. Vertices at one place count as one, for formats that repeat them.

use rayon::prelude::*;
use splat_core::Mesh;

/// What is wrong with a mesh; all 0 for a closed surface without faults.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct MeshFaults {
    /// Edges of one triangle alone: the rims of holes, and of a surface that is open.
    pub open_edges: u64,
    /// Rims that hang together: about as many holes.
    pub holes: u64,
    /// Edges of more than two triangles.
    pub crowded_edges: u64,
    /// Triangles whose corners another one has too.
    pub duplicates: u64,
    /// Triangles with two corners at one place, or three on a line.
    pub degenerate: u64,
    /// Vertices of no triangle.
    pub isolated: u64,
}

/// Looks at all edges, in the time of sorting them.
pub(crate) fn mesh_faults(mesh: &Mesh) -> MeshFaults {
    let place = places(mesh);
    let triangles: Vec<[u32; 3]> = mesh.triangles.iter().map(|t| t.map(|v| place[v as usize])).collect();
    let is_flat = |(t, original): &(&[u32; 3], &[u32; 3])| {
        t[0] == t[1] || t[1] == t[2] || t[2] == t[0] || area(mesh, original) == 0.0
    };
    let degenerate = triangles.iter().zip(&mesh.triangles).filter(is_flat).count() as u64;
    let whole: Vec<[u32; 3]> = triangles.into_iter().filter(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0]).collect();
    let mut sorted: Vec<[u32; 3]> = whole
        .iter()
        .map(|t| {
            let mut t = *t;
            t.sort_unstable();
            t
        })
        .collect();
    sorted.par_sort_unstable();
    let duplicates = sorted.windows(2).filter(|w| w[0] == w[1]).count() as u64;
    let mut used = vec![false; mesh.position.len()];
    mesh.triangles.iter().flatten().for_each(|v| used[*v as usize] = true);
    let mut faults = MeshFaults {
        duplicates,
        degenerate,
        isolated: used.iter().filter(|used| !**used).count() as u64,
        ..MeshFaults::default()
    };
    count_edges(&whole, mesh.position.len(), &mut faults);
    faults
}

/// For each vertex the first one at its place.
fn places(mesh: &Mesh) -> Vec<u32> {
    let key = |v: u32| mesh.position[v as usize].to_array().map(|c| (c + 0.0).to_bits());
    let mut order: Vec<u32> = (0..mesh.position.len() as u32).collect();
    order.par_sort_unstable_by_key(|v| (key(*v), *v));
    let mut place = vec![0; order.len()];
    let mut first = 0;
    for (i, v) in order.iter().enumerate() {
        if i == 0 || key(order[i - 1]) != key(*v) {
            first = *v;
        }
        place[*v as usize] = first;
    }
    place
}

fn area(mesh: &Mesh, t: &[u32; 3]) -> f64 {
    let [a, b, c] = t.map(|v| mesh.position[v as usize].as_dvec3());
    (b - a).cross(c - a).length_squared()
}

fn count_edges(triangles: &[[u32; 3]], vertices: usize, faults: &mut MeshFaults) {
    let edge = |a: u32, b: u32| u64::from(a.min(b)) << 32 | u64::from(a.max(b));
    let mut edges: Vec<u64> =
        triangles.iter().flat_map(|t| [edge(t[0], t[1]), edge(t[1], t[2]), edge(t[2], t[0])]).collect();
    edges.par_sort_unstable();
    let mut rims = Rims::new(vertices);
    for same in edges.chunk_by(|a, b| a == b) {
        match same.len() {
            1 => {
                faults.open_edges += 1;
                faults.holes += u64::from(rims.join((same[0] >> 32) as u32, same[0] as u32));
            }
            2 => {}
            _ => faults.crowded_edges += 1,
        }
    }
    // Each join of two vertices that were apart makes one piece fewer.
    faults.holes = rims.touched() - faults.holes;
}

/// Vertices that open edges join, each with one that stands for its rim.
struct Rims {
    above: Vec<u32>,
}

impl Rims {
    const ALONE: u32 = u32::MAX;

    fn new(vertices: usize) -> Self {
        Self { above: vec![Self::ALONE; vertices] }
    }

    fn top(&mut self, mut v: u32) -> u32 {
        if self.above[v as usize] == Self::ALONE {
            self.above[v as usize] = v;
        }
        while self.above[v as usize] != v {
            let above = self.above[v as usize];
            self.above[v as usize] = self.above[above as usize];
            v = above;
        }
        v
    }

    /// Whether they were apart.
    fn join(&mut self, a: u32, b: u32) -> bool {
        let a = self.top(a);
        let b = self.top(b);
        self.above[a.max(b) as usize] = a.min(b);
        a != b
    }

    fn touched(&self) -> u64 {
        self.above.iter().filter(|above| **above != Self::ALONE).count() as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::glam::Vec3;

    fn tetrahedron() -> Mesh {
        Mesh {
            position: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z],
            triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
            ..Mesh::default()
        }
    }

    #[test]
    fn a_closed_surface_has_no_faults_also_if_every_triangle_has_vertices_of_its_own() {
        let mesh = tetrahedron();
        assert_eq!(mesh_faults(&mesh), MeshFaults::default());
        let corners: Vec<u32> = mesh.triangles.iter().flatten().copied().collect();
        let soup = Mesh {
            position: corners.iter().map(|v| mesh.position[*v as usize]).collect(),
            triangles: (0..4).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
            ..Mesh::default()
        };
        assert_eq!(mesh_faults(&soup), MeshFaults::default());
    }

    #[test]
    fn every_fault_is_counted() {
        let mut mesh = tetrahedron();
        mesh.triangles.pop();
        let open = MeshFaults { open_edges: 3, holes: 1, ..MeshFaults::default() };
        assert_eq!(mesh_faults(&mesh), open);
        mesh.position.push(Vec3::splat(9.0));
        assert_eq!(mesh_faults(&mesh), MeshFaults { isolated: 1, ..open });
        let twice = Mesh { triangles: [tetrahedron().triangles, vec![[1, 0, 2]]].concat(), ..tetrahedron() };
        assert_eq!(mesh_faults(&twice), MeshFaults { duplicates: 1, crowded_edges: 3, ..MeshFaults::default() });
        let flat = Mesh { triangles: [tetrahedron().triangles, vec![[1, 1, 2]]].concat(), ..tetrahedron() };
        assert_eq!(mesh_faults(&flat), MeshFaults { degenerate: 1, ..MeshFaults::default() });
    }
}
