//! Smooth vertex normals from the triangles around each vertex, f64.
//!
//! n = Σ (e₁ × e₂)/(|e₁|²·|e₂|²) over the corners at the vertex, e₁ and e₂ the edges that meet there (N. Max 1999,
//! "Weights for computing vertex normals from facet normals"). The weight is sin(angle)/(|e₁||e₂|): exact for
//! triangles with their vertices on a sphere, and it needs no arc cosine. Gunjee 2007, section 4 says "smooth interpolation"
//! and leaves the weights open.

use crate::robust_cross;
use crate::{
    Mesh,
    glam::{DVec3, Vec3},
};
use rayon::prelude::*;

/// Triangles per parallel task.
const CHUNK: usize = 4096;

/// Unit vertex normals by the right-hand rule of the triangles; zero where the triangles around a vertex cancel or are
/// degenerate, and for vertices that no triangle uses.
///
/// ```
/// use splat_core::{Mesh, glam::Vec3, vertex_normals};
/// let mesh = Mesh { position: vec![Vec3::ZERO, Vec3::X, Vec3::Y], triangles: vec![[0, 1, 2]], ..Mesh::default() };
/// assert_eq!(vertex_normals(&mesh), vec![Vec3::Z; 3]);
/// ```
///
/// # Panics
/// If a vertex index is out of range, see [`Mesh::validate`].
pub fn vertex_normals(mesh: &Mesh) -> Vec<Vec3> {
    let corners: Vec<[DVec3; 3]> = mesh
        .triangles
        .par_iter()
        .with_min_len(CHUNK)
        .map(|t| corner_normals(t.map(|v| mesh.position[v as usize])))
        .collect();
    // One thread adds in the order of the file, so that the sums do not depend on the thread count.
    let mut sum = vec![DVec3::ZERO; mesh.position.len()];
    for (triangle, corner) in mesh.triangles.iter().zip(&corners) {
        for (&v, n) in triangle.iter().zip(corner) {
            sum[v as usize] += *n;
        }
    }
    sum.par_iter().with_min_len(CHUNK).map(|n| unit(*n)).collect()
}

/// Gives a mesh that has no normals those of [`vertex_normals`].
///
/// # Panics
/// As there.
pub fn smooth(mesh: &mut Mesh) {
    if mesh.normal.is_empty() {
        mesh.normal = vertex_normals(mesh);
    }
}

fn corner_normals(p: [Vec3; 3]) -> [DVec3; 3] {
    let v = p.map(|p| p.as_dvec3());
    let cross = robust_cross(v[1] - v[0], v[2] - v[0]);
    let edge_sq = [0, 1, 2].map(|i| (v[(i + 2) % 3] - v[(i + 1) % 3]).length_squared());
    let longest = edge_sq[0].max(edge_sq[1]).max(edge_sq[2]);
    if edge_sq.contains(&0.0) || cross.length_squared() <= 2.0_f64.powi(-78) * longest * longest {
        return [DVec3::ZERO; 3];
    }
    [0, 1, 2].map(|i| cross / edge_sq[(i + 1) % 3] / edge_sq[(i + 2) % 3])
}

fn unit(n: DVec3) -> Vec3 {
    let largest = n.abs().max_element();
    // Divided first, so that sums of 1e±30 neither overflow nor vanish.
    if largest > 0.0 && largest.is_finite() { (n / largest).normalize().as_vec3() } else { Vec3::ZERO }
}
