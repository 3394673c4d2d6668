//! Colours of materials on the corners of faces.

use super::Corner;
use crate::error::ReadError;
use crate::read::mtl::Materials;
use crate::read::paint::Painting;
use crate::read::reading::Reading;
use crate::vertex_normals;
use splat_core::Mesh;
use splat_core::glam::Vec3;

/// The mesh with the colours of its materials.
pub(super) fn painted(
    mut mesh: Mesh,
    corners: &[Corner],
    places: &[[f32; 2]],
    materials: Materials<'_>,
    reading: &mut Reading<'_>,
) -> Result<Mesh, ReadError> {
    if mesh.normal.is_empty() {
        mesh.normal = smooth_normals(&mesh, corners);
    }
    let Materials { paints, textures, .. } = materials;
    let place = |c: &Corner| places.get(c[2] as usize).copied().unwrap_or_default();
    let painting = Painting {
        place: if textures.is_empty() { Vec::new() } else { corners.iter().map(place).collect() },
        paint_of: corners.iter().map(|c| c[3]).collect(),
        tint: Vec::new(),
        paints,
        textures,
    };
    painting.paint(mesh, reading)
}

/// Normals as they are where vertices are not split: a change of material is no edge.
fn smooth_normals(mesh: &Mesh, corners: &[Corner]) -> Vec<Vec3> {
    let count = corners.iter().map(|c| c[0] as usize + 1).max().unwrap_or(0);
    let mut whole = Mesh { position: vec![Vec3::ZERO; count], ..Mesh::default() };
    corners.iter().zip(&mesh.position).for_each(|(c, p)| whole.position[c[0] as usize] = *p);
    whole.triangles = mesh.triangles.iter().map(|t| t.map(|v| corners[v as usize][0])).collect();
    let normals = vertex_normals(&whole);
    corners.iter().map(|c| normals[c[0] as usize]).collect()
}
