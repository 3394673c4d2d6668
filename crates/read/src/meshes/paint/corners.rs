//! Colours of materials on the corners of faces, which share a vertex where they have all in common.

use super::{Paint, Painting};
use crate::error::ReadError;
use crate::meshes::texture::Texture;
use crate::reading::Reading;
use crate::stream::input;
use splat_core::glam::Vec3;
use splat_core::{Association, Mesh, part_at_creases, vertex_normals};
use std::collections::HashMap;

/// Bytes that a vertex and a triangle of the surface without materials take, while it is parted at sharp edges and its normals are found.
const BYTES_PER_WHOLE_VERTEX: u64 = 12 + 25 + 12;
const BYTES_PER_WHOLE_TRIANGLE: u64 = 12 + 48 + 3 * 36;

/// A vertex of the mesh: position, normal, place in its texture, paint; [`NONE`] where a corner has none.
pub(crate) type Corner = [u32; 4];

/// What a corner has not.
pub(crate) const NONE: u32 = u32::MAX;

/// Bytes that a corner takes while it is read and converted.
pub(crate) const BYTES_PER_CORNER: u64 = 16 + 48 + 48;

/// The mesh with the colours of its paints, times those colours and opacities that its vertices have.
pub(crate) fn painted(
    mut mesh: Mesh,
    mut corners: Vec<Corner>,
    places: &[[f32; 2]],
    paints: Vec<Paint>,
    textures: Vec<Texture>,
    reading: &mut Reading<'_>,
) -> Result<Mesh, ReadError> {
    if mesh.normal.is_empty() {
        smooth(&mut mesh, &mut corners, reading)?;
    }
    let place = |c: &Corner| places.get(c[2] as usize).copied().unwrap_or_default();
    let tint = tint(&mut mesh);
    let painting = Painting {
        place: if textures.is_empty() { Vec::new() } else { corners.iter().map(place).collect() },
        paint_of: corners.iter().map(|c| c[3]).collect(),
        tint,
        paints,
        textures,
        stated_triangles: 0,
    };
    painting.paint(mesh, reading)
}

/// Colours and opacities of vertices, which the mesh loses: painting gives it others. Empty where it has neither.
fn tint(mesh: &mut Mesh) -> Vec<[f32; 4]> {
    let colors = std::mem::take(&mut mesh.color);
    let opacities = std::mem::take(&mut mesh.opacity);
    let of_vertex = |v: usize| {
        let [r, g, b] = colors.get(v).copied().unwrap_or([1.0; 3]);
        [r, g, b, opacities.get(v).copied().unwrap_or(1.0)]
    };
    (0..colors.len().max(opacities.len())).map(of_vertex).collect()
}

/// Gives the mesh the normals that it has where materials split no vertex: a change of material is no edge. A vertex on several sides of a
/// sharp edge becomes several.
pub(crate) fn smooth(mesh: &mut Mesh, corners: &mut Vec<Corner>, reading: &Reading<'_>) -> Result<(), ReadError> {
    let count = corners.iter().map(|c| c[0] as usize + 1).max().unwrap_or(0);
    let bytes = count as u64 * BYTES_PER_WHOLE_VERTEX + mesh.triangles.len() as u64 * BYTES_PER_WHOLE_TRIANGLE;
    input::hold("the surface without materials", bytes, reading.params)?;
    let mut whole = Mesh { position: vec![Vec3::ZERO; count], ..Mesh::default() };
    corners.iter().zip(&mesh.position).for_each(|(c, p)| whole.position[c[0] as usize] = *p);
    whole.triangles = mesh.triangles.iter().map(|t| t.map(|v| corners[v as usize][0])).collect();
    part_at_creases(&mut whole);
    let more = 3 * (whole.position.len() - count) as u64;
    input::hold("the corners", (corners.len() as u64 + more) * BYTES_PER_CORNER, reading.params)?;
    let mut side_of: Vec<Option<u32>> = vec![None; mesh.position.len()];
    let mut further: HashMap<[u32; 2], u32> = HashMap::new();
    let mut triangles = std::mem::take(&mut mesh.triangles);
    for (ids, sides) in triangles.iter_mut().zip(&whole.triangles) {
        for (id, side) in ids.iter_mut().zip(sides) {
            let v = *id as usize;
            if *side_of[v].get_or_insert(*side) != *side {
                *id = *further.entry([*id, *side]).or_insert_with(|| {
                    mesh.push_copy(v);
                    for column in mesh.columns.iter_mut().filter(|c| c.association == Association::Vertex) {
                        column.values.push(column.values[v]);
                    }
                    corners.push(corners[v]);
                    side_of.push(Some(*side));
                    side_of.len() as u32 - 1
                });
            }
        }
    }
    mesh.triangles = triangles;
    let normals = vertex_normals(&whole);
    mesh.normal = side_of.iter().map(|side| side.map_or(Vec3::ZERO, |side| normals[side as usize])).collect();
    Ok(())
}
