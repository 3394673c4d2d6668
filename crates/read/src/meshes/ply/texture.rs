//! Textures of PLY: files that comments `TextureFile` name, by places that corners of faces (`texcoord`, and `texnumber` of several) or vertices (`s t`,
//! `u v` or `texture_u texture_v`) have in them.

use super::header::{Element, Header, Shape};
use crate::error::{Fault, ReadError};
use crate::meshes::paint::corners::{Corner, NONE, painted};
use crate::meshes::paint::{Alpha, Paint};
use crate::meshes::texture::Texture;
use crate::reading::Reading;
use crate::stream::beside::Beside;
use crate::stream::input;
use splat_core::text::escaped;
use splat_core::{Association, Mesh, MeshColumn};
use std::collections::HashMap;

/// Names of the places of vertices.
const OF_VERTICES: [[&str; 2]; 3] = [["s", "t"], ["u", "v"], ["texture_u", "texture_v"]];
/// Name of the places of the corners of faces, and of the rank of the texture that a face has.
pub(super) const OF_CORNERS: &[u8] = b"texcoord";
pub(super) const NUMBER: &[u8] = b"texnumber";

/// The places of corners, while faces are read: corners that have all in common are one vertex.
#[derive(Default)]
pub(crate) struct Wedges {
    corners: Vec<Corner>,
    places: Vec<[f32; 2]>,
    known: HashMap<[u32; 4], u32>,
}

/// Names of the properties of vertices that are places in a texture, if there are such and a texture is named.
pub(super) fn of_vertices(header: &Header, vertex: &Element) -> Option<[&'static str; 2]> {
    let has =
        |name: &str| vertex.properties.iter().any(|p| p.name == name.as_bytes() && matches!(p.shape, Shape::Scalar(_)));
    OF_VERTICES.into_iter().filter(|_| !header.textures.is_empty()).find(|pair| pair.iter().all(|name| has(name)))
}

/// Whether corners of faces have places in a texture, and one is named.
pub(super) fn has_corners(header: &Header) -> bool {
    let has = |e: &Element| e.properties.iter().any(|p| p.name == OF_CORNERS && matches!(p.shape, Shape::List { .. }));
    !header.textures.is_empty() && header.elements.iter().filter(|e| e.name == b"face").any(has)
}

impl Wedges {
    /// The vertex for a corner of the file's vertex `v`, at a place of the texture of rank `texture`; without a place where that is no number.
    pub(crate) fn corner(
        &mut self,
        v: u32,
        place: [f32; 2],
        texture: u32,
        reading: &Reading<'_>,
    ) -> Result<u32, ReadError> {
        let is_placed = place.iter().all(|c| c.is_finite());
        let paint = 2 * texture + u32::from(!is_placed);
        let [a, b] = if is_placed { place.map(f32::to_bits) } else { [0; 2] };
        if let Some(known) = self.known.get(&[v, a, b, paint]) {
            return Ok(*known);
        }
        input::reserve(&mut self.corners, 1)?;
        input::reserve(&mut self.places, 1)?;
        self.known.try_reserve(1).map_err(|_| input::none_left("corners"))?;
        reading.go_on()?;
        let new = self.corners.len() as u32;
        // Rows of an image are counted from the top.
        self.places.push(if is_placed { [place[0], 1.0 - place[1]] } else { [0.0; 2] });
        self.corners.push([v, NONE, new, paint]);
        self.known.insert([v, a, b, paint], new);
        Ok(new)
    }

    /// Corners so far.
    pub(crate) fn len(&self) -> usize {
        self.corners.len()
    }

    /// A mesh whose triangles have the vertices of these corners, from one of the vertices of the file.
    pub(crate) fn expanded(&self, mesh: Mesh) -> Mesh {
        let ids = || self.corners.iter().map(|corner| corner[0] as usize);
        let columns = mesh.columns.into_iter().map(|MeshColumn { name, association, values }| {
            let of_vertex = || ids().map(|v| values[v]).collect();
            let values = if association == Association::Vertex { of_vertex() } else { values };
            MeshColumn { name, association, values }
        });
        Mesh {
            position: ids().map(|v| mesh.position[v]).collect(),
            normal: ids().filter_map(|v| mesh.normal.get(v).copied()).collect(),
            color: ids().filter_map(|v| mesh.color.get(v).copied()).collect(),
            opacity: ids().filter_map(|v| mesh.opacity.get(v).copied()).collect(),
            columns: columns.collect(),
            ..mesh
        }
    }

    /// The corners so far, and the places that they name.
    pub(crate) fn into_parts(self) -> (Vec<Corner>, Vec<[f32; 2]>) {
        (self.corners, self.places)
    }

    /// The mesh with the colours of its textures.
    pub(super) fn paint(self, mesh: Mesh, textures: Textures, reading: &mut Reading<'_>) -> Result<Mesh, ReadError> {
        let Self { corners, places, .. } = self;
        // A face of a texture that is not there has none.
        let most = textures.paints.len() as u32;
        let corners = corners.into_iter().map(|[v, normal, place, paint]| [v, normal, place, paint.min(most - 1)]);
        textures.painted(mesh, corners.collect(), &places, reading)
    }
}

/// The textures of a file.
pub(super) struct Textures {
    /// Two of each texture, with it and without.
    paints: Vec<Paint>,
    textures: Vec<Texture>,
}

impl Textures {
    /// Decodes those that are there; `None` without any, which remarks say.
    pub(super) fn open(
        names: &[Vec<u8>],
        beside: &Beside<'_>,
        reading: &mut Reading<'_>,
    ) -> Result<Option<Self>, ReadError> {
        let mut found = Self { paints: Vec::new(), textures: Vec::new() };
        for name in names {
            let texture = texture(&String::from_utf8_lossy(name).replace('\\', "/"), beside, reading)?;
            let rank = texture.map(|texture| {
                found.textures.push(texture);
                found.textures.len() - 1
            });
            let paint = Paint { factor: [1.0; 4], texture: rank, alpha: Alpha::Blended };
            found.paints.extend([paint, Paint { texture: None, ..paint }]);
        }
        Ok((!found.textures.is_empty()).then_some(found))
    }

    /// A mesh whose vertices have places in the texture by these columns, which are taken out unless they are asked for.
    pub(super) fn paint_vertices(
        self,
        mut mesh: Mesh,
        names: [&str; 2],
        reading: &mut Reading<'_>,
    ) -> Result<Mesh, ReadError> {
        let column = |name: &str| mesh.columns.iter().find(|c| c.name == name).map(|c| c.values.clone());
        let [u, v] = names.map(|name| column(name).unwrap_or_default());
        mesh.columns
            .retain(|column| !names.contains(&column.name.as_str()) || reading.params.columns.contains(&column.name));
        let place = |(u, v): (&f64, &f64)| [*u as f32, 1.0 - *v as f32];
        let places: Vec<[f32; 2]> = u.iter().zip(&v).map(place).collect();
        let corner = |(i, place): (usize, &[f32; 2])| {
            let is_placed = place.iter().all(|c| c.is_finite());
            [i as u32, NONE, if is_placed { i as u32 } else { NONE }, u32::from(!is_placed)]
        };
        let corners = places.iter().enumerate().map(corner).collect();
        self.painted(mesh, corners, &places, reading)
    }

    fn painted(
        self,
        mesh: Mesh,
        corners: Vec<Corner>,
        places: &[[f32; 2]],
        reading: &mut Reading<'_>,
    ) -> Result<Mesh, ReadError> {
        if !mesh.color.is_empty() {
            reading.notes.remark("its texture is shown in the place of the colours of its vertices");
        }
        let mesh = Mesh { color: Vec::new(), ..mesh };
        painted(mesh, corners, places, self.paints, self.textures, reading)
    }
}

/// A texture; `None` for one that is not there or of another kind, which a remark says.
fn texture(name: &str, beside: &Beside<'_>, reading: &mut Reading<'_>) -> Result<Option<Texture>, ReadError> {
    let shown = escaped(name.as_bytes(), 60);
    let what = format!("texture '{shown}'");
    let content = match beside.open(name, "the texture", reading.params) {
        Ok(stream) => stream.rest()?,
        Err(error) if error.fault == Fault::Limit => return Err(error),
        Err(error) => {
            let expected = error.expected.rsplit_once(": ").map_or(error.expected.as_str(), |(_, expected)| expected);
            let remark = format!("{what}: expected {expected}, found {}: it is left out", error.found);
            reading.notes.remark(remark);
            return Ok(None);
        }
    };
    if Texture::is_left_out(&content, &what, reading) {
        return Ok(None);
    }
    Texture::decode(&content, &what, reading).map(Some)
}
