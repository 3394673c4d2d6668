//! Sharp edges of meshes without normals: a table's top and its sides are lit each by its own plane.
//!
//! Around each vertex the triangles that follow each other across edges of less than [`CREASE`] are one side, and each side beyond the first
//! gets a vertex of its own, so that [`crate::vertex_normals`] are smooth within a side and break at the edges between two.

use crate::{Association, Mesh, robust_cross};
use glam::DVec3;
use rayon::prelude::*;

/// Cosine of the angle between two triangles from which the edge between them is sharp, 60°: coarse balls of 20 triangles stay round, boxes
/// and prisms of up to five sides do not.
const CREASE: f64 = 0.5;

/// Cosine of half of that angle: where all triangles around a vertex lean less from one direction, no two of them meet at a sharp edge.
const HALF: f64 = 0.866_025_403_784_438_6;

/// Triangles at one edge of which each is held against all others; of more, each against so many.
const CROWD: usize = 8;

/// Triangles per parallel task.
const CHUNK: usize = 4096;

/// Gives vertices at which sharp edges of a mesh without normals meet a vertex for each side. They are appended in the order of those
/// that they are parted from; a mesh with normals stays as it is.
///
/// ```
/// use splat_core::{Mesh, glam::Vec3, part_at_creases, vertex_normals};
/// // Two triangles at a right angle.
/// let position = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
/// let mut mesh = Mesh { position, triangles: vec![[0, 1, 2], [0, 3, 1]], ..Mesh::default() };
/// part_at_creases(&mut mesh);
/// assert_eq!(mesh.triangles, [[0, 1, 2], [4, 3, 5]]);
/// assert_eq!(vertex_normals(&mesh)[0], Vec3::Z);
/// ```
///
/// # Panics
/// If a vertex index is out of range, see [`Mesh::validate`].
pub fn part_at_creases(mesh: &mut Mesh) {
    if !mesh.normal.is_empty() {
        return;
    }
    for v in parted(mesh) {
        mesh.push_copy(v as usize);
        for column in mesh.columns.iter_mut().filter(|column| column.association == Association::Vertex) {
            column.values.push(column.values[v as usize]);
        }
    }
}

/// Most bytes that [`part_at_creases`] takes and adds to a mesh: planes and corners of triangles, sums at vertices, and a vertex for each corner.
pub fn crease_bytes(mesh: &Mesh) -> u64 {
    let looks = if mesh.color.is_empty() { 0 } else { 12 } + if mesh.opacity.is_empty() { 0 } else { 4 };
    let of_triangle = 24 + 3 * (8 + 4 + 12 + looks + 8 * mesh.columns.len() as u64);
    if mesh.normal.is_empty() { mesh.triangles.len() as u64 * of_triangle + mesh.position.len() as u64 * 25 } else { 0 }
}

/// Gives the triangles of each further side of a vertex another index there; says for each of those, which follow the vertices, which vertex
/// it is parted from.
fn parted(mesh: &mut Mesh) -> Vec<u32> {
    let plane = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| mesh.position[v as usize].as_dvec3());
        robust_cross(b - a, c - a).normalize_or_zero()
    };
    let planes: Vec<DVec3> = mesh.triangles.par_iter().with_min_len(CHUNK).map(plane).collect();
    let corners = corners_at_creases(mesh, &planes);
    let mut from = Vec::new();
    if mesh.position.len() + corners.len() > u32::MAX as usize {
        return from;
    }
    for around in corners.chunk_by(|a, b| a.0 == b.0) {
        let v = around[0].0;
        let mut vertices = vec![v; around.len()];
        let sides = sides(&mesh.triangles, &planes, around);
        let mut is_first = true;
        for (i, (_, triangle)) in around.iter().enumerate() {
            if sides[i] != i {
                vertices[i] = vertices[sides[i]];
            } else if !std::mem::take(&mut is_first) {
                vertices[i] = (mesh.position.len() + from.len()) as u32;
                from.push(v);
            }
            let ids = &mut mesh.triangles[*triangle as usize];
            *ids = ids.map(|id| if id == v { vertices[i] } else { id });
        }
    }
    from
}

/// A corner: its vertex and its triangle.
type Corner = (u32, u32);

/// The corners of triangles with a plane at vertices where two of them may meet at a sharp edge, by vertex.
fn corners_at_creases(mesh: &Mesh, planes: &[DVec3]) -> Vec<Corner> {
    let mut middle = vec![DVec3::ZERO; mesh.position.len()];
    let corners = || mesh.triangles.iter().zip(planes).flat_map(|(t, plane)| t.map(|v| (v as usize, *plane)));
    corners().for_each(|(v, plane)| middle[v] += plane);
    let mut leans = vec![false; mesh.position.len()];
    for (v, plane) in corners() {
        leans[v] |= plane != DVec3::ZERO && plane.dot(middle[v]) < HALF * middle[v].length();
    }
    let of_triangle = |(i, t): (usize, &[u32; 3])| t.map(|v| (v, i as u32));
    let whole = mesh.triangles.iter().enumerate().filter(|(i, _)| planes[*i] != DVec3::ZERO);
    let mut found: Vec<Corner> = whole.flat_map(of_triangle).filter(|(v, _)| leans[*v as usize]).collect();
    found.par_sort_unstable();
    found
}

/// For each corner around a vertex the first one that is on the same side of it.
fn sides(triangles: &[[u32; 3]], planes: &[DVec3], around: &[Corner]) -> Vec<usize> {
    let mut edges: Vec<(u32, usize)> = Vec::new();
    for (i, (v, t)) in around.iter().enumerate() {
        edges.extend(triangles[*t as usize].iter().filter(|w| *w != v).map(|w| (*w, i)));
    }
    edges.sort_unstable();
    let mut first: Vec<usize> = (0..around.len()).collect();
    for shared in edges.chunk_by(|a, b| a.0 == b.0) {
        for (k, (_, b)) in shared.iter().enumerate() {
            for (_, a) in &shared[k.saturating_sub(CROWD)..k] {
                if planes[around[*a].1 as usize].dot(planes[around[*b].1 as usize]) >= CREASE {
                    let a = top(&mut first, *a);
                    let b = top(&mut first, *b);
                    first[a.max(b)] = a.min(b);
                }
            }
        }
    }
    (0..around.len()).map(|i| top(&mut first, i)).collect()
}

/// The first corner of the side of corner `i`.
fn top(first: &mut [usize], mut i: usize) -> usize {
    while first[i] != i {
        first[i] = first[first[i]];
        i = first[i];
    }
    i
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vertex_normals;
    use glam::Vec3;

    /// A fan around a tip over the corners of a regular polygon of radius 1, as high.
    fn cone(sides: u32, height: f32) -> Mesh {
        let turn = |i: u32| (i as f32 / sides as f32 * std::f32::consts::TAU).sin_cos();
        let rim = (0..sides).map(|i| Vec3::new(turn(i).0, 0.0, turn(i).1));
        let position = [Vec3::Y * height].into_iter().chain(rim).collect();
        Mesh { position, triangles: (1..=sides).map(|i| [0, i, i % sides + 1]).collect(), ..Mesh::default() }
    }

    #[test]
    fn a_box_is_lit_by_its_planes() {
        let position: Vec<Vec3> =
            (0..8).map(|i| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32)).collect();
        let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
        let mut mesh = Mesh { color: vec![[0.5; 3]; 8], position, triangles, ..Mesh::default() };
        part_at_creases(&mut mesh);
        assert_eq!((mesh.position.len(), mesh.color.len()), (24, 24));
        mesh.validate().expect("a valid mesh");
        let normals = vertex_normals(&mesh);
        assert!(normals.iter().all(|n| n.abs().max_element() == 1.0), "{normals:?}");
    }

    #[test]
    fn what_is_round_stays_round() {
        for (mut mesh, parts) in [(cone(12, 1.0), 0), (cone(4, 0.3), 0), (cone(4, 9.0), 7), (cone(3, 9.0), 5)] {
            let before = mesh.position.len();
            part_at_creases(&mut mesh);
            assert_eq!(mesh.position.len() - before, parts);
        }
        // Many triangles around one edge take no time that grows with their square.
        let fan: Vec<[u32; 3]> = (0..1_000_000).map(|_| [0, 1, 2]).collect();
        let mut mesh = Mesh { triangles: [fan, vec![[1, 0, 2]]].concat(), ..cone(4, 9.0) };
        part_at_creases(&mut mesh);
        assert_eq!(mesh.triangles.len(), 1_000_001);
    }
}
