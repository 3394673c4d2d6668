//! Triangles divided along edges, without gaps.

use super::{Association, Mesh};
use crate::glam::Vec3;

/// Halves edges in all triangles that share them, so that no vertex lies inside an edge. Each is given by its two vertices, the lower one first;
/// they are in order, each once. Vertices are appended, one an edge, with the means of what its ends have; numbers of triangles go to their
/// parts. Returns for each triangle the one before that it is a part of.
///
/// ```
/// use splat_core::{Mesh, glam::DVec3, halve_edges};
/// let mut mesh = Mesh::rectangle(DVec3::ZERO, DVec3::X, DVec3::Y);
/// assert_eq!(halve_edges(&mut mesh, &[[0, 2]]), [0, 0, 1, 1]);
/// assert_eq!((mesh.position.len(), mesh.triangles.len()), (5, 4));
/// ```
///
/// # Panics
/// If a vertex index is out of range, see [`Mesh::validate`].
pub fn halve_edges(mesh: &mut Mesh, edges: &[[u32; 2]]) -> Vec<u32> {
    let first = mesh.position.len();
    edges.iter().for_each(|edge| push_middle(mesh, edge.map(|v| v as usize)));
    let halved = |a: u32, b: u32| edges.binary_search(&[a.min(b), a.max(b)]).ok().map(|rank| (first + rank) as u32);
    let old = std::mem::take(&mut mesh.triangles);
    let mut parents = Vec::with_capacity(old.len());
    for (parent, t) in old.iter().enumerate() {
        let middles = [0, 1, 2].map(|k| halved(t[k], t[(k + 1) % 3]));
        // Turned so that the halved edges come first.
        let k = (0..3).find(|k| middles[*k].is_some() && middles[(k + 2) % 3].is_none()).unwrap_or(0);
        let [a, b, c] = [0, 1, 2].map(|i| t[(k + i) % 3]);
        match [0, 1, 2].map(|i| middles[(k + i) % 3]) {
            [Some(ab), Some(bc), Some(ca)] => {
                mesh.triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
            }
            [Some(ab), Some(bc), None] => mesh.triangles.extend([[ab, b, bc], [a, ab, bc], [a, bc, c]]),
            [Some(ab), None, _] => mesh.triangles.extend([[a, ab, c], [ab, b, c]]),
            _ => mesh.triangles.push(*t),
        }
        parents.resize(mesh.triangles.len(), parent as u32);
    }
    for column in mesh.columns.iter_mut().filter(|column| column.association == Association::Triangle) {
        column.values = parents.iter().map(|parent| column.values[*parent as usize]).collect();
    }
    parents
}

/// Appends a vertex in the middle between two.
fn push_middle(mesh: &mut Mesh, edge: [usize; 2]) {
    let [a, b] = edge;
    // Halved before they are added: their sum may be more than a number can be.
    mesh.position.push(0.5 * mesh.position[a] + 0.5 * mesh.position[b]);
    if !mesh.normal.is_empty() {
        // Opposite normals have none between them.
        mesh.normal.push((mesh.normal[a] + mesh.normal[b]).try_normalize().unwrap_or(mesh.normal[a]));
    }
    if !mesh.color.is_empty() {
        let [of_a, of_b] = [a, b].map(|v| Vec3::from(mesh.color[v]));
        mesh.color.push((0.5 * of_a + 0.5 * of_b).to_array());
    }
    if !mesh.opacity.is_empty() {
        mesh.opacity.push(0.5 * mesh.opacity[a] + 0.5 * mesh.opacity[b]);
    }
    for column in mesh.columns.iter_mut().filter(|column| column.association == Association::Vertex) {
        column.values.push(0.5 * column.values[a] + 0.5 * column.values[b]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::MeshColumn;
    use crate::glam::DVec3;

    #[test]
    fn numbers_follow_and_the_area_stays() {
        // Two triangles with a common edge; all subsets of the five edges.
        let candidates: [[u32; 2]; 5] = [[0, 1], [0, 2], [0, 3], [1, 2], [2, 3]];
        for subset in 0..32u32 {
            let edges: Vec<[u32; 2]> =
                (0..5).filter(|i| subset >> i & 1 == 1).map(|i| candidates[i as usize]).collect();
            let mut mesh = Mesh::rectangle(DVec3::ZERO, DVec3::X, DVec3::Y);
            mesh.opacity = vec![0.0, 1.0, 1.0, 0.0];
            let column =
                |association, values: &[f64]| MeshColumn { name: "it".into(), association, values: values.to_vec() };
            mesh.columns =
                vec![column(Association::Vertex, &[-1.0, 1.0, 1.0, -1.0]), column(Association::Triangle, &[3.0, 5.0])];
            let parents = halve_edges(&mut mesh, &edges);
            mesh.validate().expect("a whole mesh");
            assert!((mesh.area() - 4.0).abs() < 1e-12, "{subset}");
            for (i, p) in mesh.position.iter().enumerate() {
                assert_eq!(mesh.columns[0].values[i], f64::from(p.x), "{subset}");
                assert_eq!(mesh.opacity[i], 0.5 * p.x + 0.5, "{subset}");
            }
            let expected: Vec<f64> = parents.iter().map(|parent| [3.0, 5.0][*parent as usize]).collect();
            assert_eq!(mesh.columns[1].values, expected, "{subset}");
        }
    }
}
