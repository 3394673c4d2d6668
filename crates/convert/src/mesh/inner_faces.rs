//! Faces between bodies that lie side by side, which an opaque surface hides: their discs would reach through its outside.

use rayon::prelude::*;
use splat_core::{Association, Mesh};

/// The corners of a triangle by their places, from the least on.
type Corners = [[u32; 3]; 3];

/// The mesh without triangles that lie on each other in pairs, one the other way around; `None` where it has none.
///
/// ```
/// use splat_core::Mesh;
/// use splat_core::glam::Vec3;
/// let position = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
/// let mesh = Mesh { position, triangles: vec![[0, 1, 2], [0, 2, 1], [0, 1, 3]], ..Mesh::default() };
/// assert_eq!(convert::without_inner_faces(&mesh).unwrap().triangles, [[0, 1, 3]]);
/// ```
pub fn without_inner_faces(mesh: &Mesh) -> Option<Mesh> {
    let corners = |triangle: u32| corners_of(mesh, mesh.triangles[triangle as usize]);
    // Triangles with the same corners have one number, whichever way they are wound.
    let number = |triangle: u32| corners(triangle).iter().map(|corner| mixed(*corner)).fold(0, u64::wrapping_add);
    let mut numbered: Vec<(u64, u32)> =
        (0..mesh.triangles.len() as u32).into_par_iter().map(|triangle| (number(triangle), triangle)).collect();
    numbered.par_sort_unstable();
    let are_inner = |pair: &&[(u64, u32)]| {
        let [(_, first), (_, second)] = **pair else { return false };
        let [a, b, c] = corners(first);
        corners(second) == [a, c, b]
    };
    let pairs = numbered.chunk_by(|a, b| a.0 == b.0).filter(are_inner);
    let mut is_inner = vec![false; mesh.triangles.len()];
    let mut found = false;
    for (_, triangle) in pairs.flatten() {
        is_inner[*triangle as usize] = true;
        found = true;
    }
    if !found {
        return None;
    }
    let mut kept = mesh.clone();
    retain(&mut kept.triangles, &is_inner);
    for column in kept.columns.iter_mut().filter(|column| column.association == Association::Triangle) {
        retain(&mut column.values, &is_inner);
    }
    Some(kept)
}

/// Keeps the items of triangles that are not inner ones.
fn retain<T>(items: &mut Vec<T>, is_inner: &[bool]) {
    let mut triangle = 0;
    items.retain(|_| {
        triangle += 1;
        !is_inner[triangle - 1]
    });
}

/// The places of corners in the order of their winding, from the least on.
fn corners_of(mesh: &Mesh, triangle: [u32; 3]) -> Corners {
    let place = |vertex: u32| mesh.position[vertex as usize].to_array().map(|c| (c + 0.0).to_bits());
    let mut corners = triangle.map(place);
    let least = (0..3).min_by_key(|i| corners[*i]).unwrap_or(0);
    corners.rotate_left(least);
    corners
}

/// A number that places share by chance alone.
fn mixed(place: [u32; 3]) -> u64 {
    const FACTOR: u64 = 0x9e37_79b9_7f4a_7c15;
    place.iter().fold(0, |number: u64, bits| (number ^ u64::from(*bits)).wrapping_mul(FACTOR).rotate_left(29))
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::MeshColumn;
    use splat_core::glam::Vec3;

    #[test]
    fn bodies_that_abut_become_one_and_a_face_that_is_there_twice_stays() {
        let position: Vec<Vec3> = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z, -Vec3::Z].into_iter().collect();
        // Two tetrahedra with vertices of their own and a common face.
        let doubled: Vec<Vec3> = position.iter().chain(&position).copied().collect();
        let upper = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        let lower = [[5, 6, 7], [5, 9, 6], [6, 9, 7], [7, 9, 5]];
        let triangles: Vec<[u32; 3]> = upper.into_iter().chain(lower).collect();
        let column = MeshColumn {
            name: "rank".into(),
            association: Association::Triangle,
            values: (0..8).map(f64::from).collect(),
        };
        let mesh = Mesh { position: doubled.clone(), triangles, columns: vec![column], ..Mesh::default() };
        let kept = without_inner_faces(&mesh).expect("a common face");
        assert_eq!(kept.triangles.len(), 6);
        assert_eq!(kept.columns[0].values, [1.0, 2.0, 3.0, 5.0, 6.0, 7.0]);
        assert!(without_inner_faces(&kept).is_none());
        // The same way around they are two coats of one surface; three are none of two bodies.
        let coats = Mesh { position: doubled, triangles: vec![[0, 1, 2], [6, 7, 5]], ..Mesh::default() };
        assert!(without_inner_faces(&coats).is_none());
        let three = Mesh { triangles: vec![[0, 1, 2], [6, 7, 5], [0, 2, 1]], ..coats };
        assert!(without_inner_faces(&three).is_none());
    }
}
