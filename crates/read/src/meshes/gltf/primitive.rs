//! Primitives: their triangles, and what their vertices have.

use super::accessor::{Buffers, missing};
use super::document::Primitive;
use super::material::{Coordinates, Paints};
use super::{HINT, wrong};
use crate::error::{Place, ReadError};
use crate::meshes::paint::{Alpha, Painting};
use crate::points::direction::unit;
use crate::reading::Reading;
use crate::stream::input;
use splat_core::glam::{DMat3, DMat4, DVec3, Vec3};

pub(super) const POINTS: u32 = 0;
/// Pairs of points; lines that end where they begin; lines from each point to the next.
pub(super) const LINES: u32 = 1;
const LINE_LOOP: u32 = 2;
pub(super) const LINE_STRIP: u32 = 3;
const TRIANGLES: u32 = 4;
const STRIP: u32 = 5;
const FAN: u32 = 6;

/// Bytes that a vertex and a triangle take while they are read and converted.
pub(super) const BYTES_PER_VERTEX: u64 = 24 + 12 + 12 + 4 + 16 + 8 + 12;
const BYTES_PER_TRIANGLE: u64 = 12;
/// Bytes that a vertex and an index of one primitive take beside them: as stored and as they are in the scene.
const BYTES_PER_OWN_VERTEX: u64 = (12 + 24) + 2 * (12 + 16 + 8);
const BYTES_PER_INDEX: u64 = 4 + 12;

/// All triangles or points of a scene, in its coordinates.
#[derive(Default)]
pub(super) struct Surface {
    pub(super) position: Vec<DVec3>,
    pub(super) normal: Vec<Vec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// Vertices of each line.
    pub(super) lines: Vec<Vec<u32>>,
    pub(super) painting: Painting,
    /// Whether a vertex has a colour of its own.
    pub(super) is_tinted: bool,
}

/// What the vertices of one primitive have.
struct Vertices {
    position: Vec<DVec3>,
    normal: Option<Vec<Vec3>>,
    tint: Option<Vec<[f32; 4]>>,
    place: Option<Vec<[f32; 2]>>,
    paint: u32,
}

impl Surface {
    /// Appends a primitive of triangles or of lines, or the points of one.
    pub(super) fn add(
        &mut self,
        primitive: &Primitive,
        scene_from_mesh: &DMat4,
        buffers: &Buffers<'_>,
        paints: &mut Paints<'_>,
        reading: &mut Reading<'_>,
    ) -> Result<(), ReadError> {
        let counts = primitive.attributes.values().map(|index| buffers.count(*index));
        let of_vertices = counts.max().unwrap_or(0).saturating_mul(BYTES_PER_OWN_VERTEX);
        let of_indices = primitive.indices.map_or(0, |index| buffers.count(index).saturating_mul(BYTES_PER_INDEX));
        let _held = reading.params.memory.take("a primitive", of_vertices.saturating_add(of_indices))?;
        let vertices = vertices(primitive, scene_from_mesh, buffers, paints, reading)?;
        let mode = primitive.mode.unwrap_or(TRIANGLES);
        let count = vertices.position.len();
        let indices = match primitive.indices {
            Some(index) => buffers.indices(index, reading)?,
            None => (0..count as u32).collect(),
        };
        if let Some(beyond) = indices.iter().find(|i| **i as usize >= count) {
            return Err(missing("vertex", *beyond as usize, count));
        }
        if mode == POINTS {
            return self.append(&vertices, indices.iter().copied(), reading).map(|_| ());
        }
        if (LINES..=LINE_STRIP).contains(&mode) {
            let first = self.append(&vertices, 0..count as u32, reading)?;
            let placed: Vec<u32> = indices.iter().map(|index| first + index).collect();
            self.add_lines(&placed, mode, reading)?;
            return Ok(());
        }
        let mut triangles = triangles(&indices, mode)?;
        if scene_from_mesh.determinant() < 0.0 {
            // Mirrored, it would be inside out.
            triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        let room = (self.triangles.len() + triangles.len()) as u64 * BYTES_PER_TRIANGLE;
        input::hold("the triangles", room, reading.params)?;
        input::reserve(&mut self.triangles, triangles.len())?;
        if vertices.normal.is_some() {
            let first = self.append(&vertices, 0..count as u32, reading)?;
            self.triangles.extend(triangles.iter().map(|t| t.map(|v| first + v)));
            return Ok(());
        }
        // Without normals each triangle is flat, with corners of its own.
        let first = self.append(&vertices, triangles.iter().flatten().copied(), reading)?;
        for (t, corners) in self.position[first as usize..].as_chunks::<3>().0.iter().enumerate() {
            let across = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            let flat = if across.length_squared() > 0.0 { unit(across) } else { Vec3::Z };
            let at = first as usize + 3 * t;
            self.normal[at..at + 3].fill(flat);
            self.triangles.push([0, 1, 2].map(|k| (at + k) as u32));
        }
        Ok(())
    }

    /// Appends the lines of a primitive of that mode through these vertices.
    fn add_lines(&mut self, vertices: &[u32], mode: u32, reading: &Reading<'_>) -> Result<(), ReadError> {
        let count = if mode == LINES { vertices.len() / 2 } else { 1 };
        let bytes = (self.lines.len() + count) * size_of::<Vec<u32>>() + size_of_val(vertices);
        input::hold("the lines", bytes as u64, reading.params)?;
        input::reserve(&mut self.lines, count)?;
        match mode {
            LINES => self.lines.extend(vertices.as_chunks::<2>().0.iter().map(|pair| pair.to_vec())),
            LINE_LOOP => self.lines.push(vertices.iter().chain(vertices.first()).copied().collect()),
            _ => self.lines.push(vertices.to_vec()),
        }
        Ok(())
    }

    /// Appends these vertices in this order; gives the number of the first.
    fn append(
        &mut self,
        vertices: &Vertices,
        order: impl Iterator<Item = u32> + Clone,
        reading: &Reading<'_>,
    ) -> Result<u32, ReadError> {
        let first = self.position.len();
        let count = order.clone().count();
        input::hold("the vertices", (first + count) as u64 * BYTES_PER_VERTEX, reading.params)?;
        if first + count > u32::MAX as usize {
            return Err(wrong("fewer than 2^32 vertices".into(), (first + count).to_string()));
        }
        let Self { position, normal, painting, .. } = self;
        input::reserve(position, count)?;
        input::reserve(normal, count)?;
        input::reserve(&mut painting.tint, count)?;
        input::reserve(&mut painting.place, count)?;
        input::reserve(&mut painting.paint_of, count)?;
        position.extend(order.clone().map(|v| vertices.position[v as usize]));
        let at = |v: u32| vertices.normal.as_ref().map_or(Vec3::ZERO, |n| n[v as usize]);
        normal.extend(order.clone().map(at));
        let at = |v: u32| vertices.tint.as_ref().map_or([1.0; 4], |t| t[v as usize]);
        painting.tint.extend(order.clone().map(at));
        let at = |v: u32| vertices.place.as_ref().map_or([0.0; 2], |p| p[v as usize]);
        painting.place.extend(order.map(at));
        painting.paint_of.resize(first + count, vertices.paint);
        self.is_tinted |= vertices.tint.is_some();
        Ok(first as u32)
    }
}

/// Vertices that a primitive says that it adds to a scene.
pub(super) fn vertices_of(primitive: &Primitive, buffers: &Buffers<'_>) -> u64 {
    let stored = primitive.attributes.get("POSITION").map_or(0, |index| buffers.count(*index));
    let indices = primitive.indices.map_or(stored, |index| buffers.count(index));
    // Without normals each triangle has corners of its own; strips and fans have more of them than indices.
    if primitive.attributes.contains_key("NORMAL") { stored } else { indices }
}

/// The remark on vertices with opacities.
const OPACITIES: &str =
    "opacities of vertices (COLOR_0) are not used: the alphaMode of their material is OPAQUE; BLEND would show them";

fn vertices(
    primitive: &Primitive,
    scene_from_mesh: &DMat4,
    buffers: &Buffers<'_>,
    paints: &mut Paints<'_>,
    reading: &mut Reading<'_>,
) -> Result<Vertices, ReadError> {
    let attribute = |name: &str| primitive.attributes.get(name).copied();
    let of_position = attribute("POSITION").ok_or_else(|| wrong("POSITION of a primitive".into(), "none".into()))?;
    let (paint, coordinates) = paints.paint_of(primitive.material, reading)?;
    let set = coordinates.map(|c| format!("TEXCOORD_{}", c.set));
    let used = ["POSITION", "NORMAL", "COLOR_0"];
    let unused = primitive.attributes.keys().filter(|k| !used.contains(&k.as_str()) && Some(*k) != set.as_ref());
    reading.notes.not_used(unused.map(String::as_bytes));
    let stored = buffers.vectors::<3>(of_position, "POSITION", reading)?;
    let place_of = |p: &[f32; 3]| scene_from_mesh.transform_point3(Vec3::from(*p).as_dvec3());
    let position: Vec<DVec3> = stored.iter().map(place_of).collect();
    if let Some(i) = position.iter().position(|p| !p.is_finite()) {
        return Err(wrong("finite coordinates".into(), format!("{} at vertex {i}", position[i])));
    }
    let count = position.len();
    let alike = |found: usize, name: &str| {
        if found == count { Ok(()) } else { Err(wrong(format!("{count} entries of {name}"), found.to_string())) }
    };
    let normal =
        attribute("NORMAL").map(|index| normals(index, scene_from_mesh, buffers, reading)).transpose()?.flatten();
    if let Some(normal) = &normal {
        alike(normal.len(), "NORMAL")?;
    }
    let tint = attribute("COLOR_0").map(|index| colors(index, buffers, reading)).transpose()?;
    if let Some(tint) = &tint {
        alike(tint.len(), "COLOR_0")?;
        if tint.iter().any(|color| color[3] < 1.0) && paints.paints[paint as usize].alpha == Alpha::Ignored {
            reading.notes.remark(OPACITIES);
        }
    }
    let place = coordinates.map(|c| places(c, attribute, buffers, reading)).transpose()?.flatten();
    if let Some(place) = &place {
        alike(place.len(), "texture coordinates")?;
    }
    let paint = if coordinates.is_some() && place.is_none() { paint + 1 } else { paint };
    Ok(Vertices { position, normal, tint, place, paint })
}

/// Places in the texture; `None` for a primitive without such coordinates, which a remark says.
fn places(
    coordinates: Coordinates,
    attribute: impl Fn(&str) -> Option<usize>,
    buffers: &Buffers<'_>,
    reading: &mut Reading<'_>,
) -> Result<Option<Vec<[f32; 2]>>, ReadError> {
    let set = format!("TEXCOORD_{}", coordinates.set);
    let Some(index) = attribute(&set) else {
        reading
            .notes
            .remark(format!("a primitive has no {set}, which its texture goes by: it has its baseColorFactor"));
        return Ok(None);
    };
    let stored = buffers.vectors::<2>(index, &set, reading)?;
    let places: Vec<[f32; 2]> = stored.into_iter().map(|p| coordinates.place(p)).collect();
    if places.iter().flatten().all(|c| c.is_finite()) {
        return Ok(Some(places));
    }
    Err(wrong(format!("finite {set}"), "another number".into()))
}

/// Unit normals in the scene; `None` where one of them has no direction, which a remark says.
fn normals(
    index: usize,
    scene_from_mesh: &DMat4,
    buffers: &Buffers<'_>,
    reading: &mut Reading<'_>,
) -> Result<Option<Vec<Vec3>>, ReadError> {
    let stored = buffers.vectors::<3>(index, "NORMAL", reading)?;
    let turned = normals_turn(scene_from_mesh);
    let normals: Vec<Vec3> = stored.iter().map(|n| unit(turned * Vec3::from(*n).as_dvec3())).collect();
    if normals.iter().all(|n| n.is_finite() && *n != Vec3::ZERO) {
        return Ok(Some(normals));
    }
    reading.notes.remark("a primitive has a normal without a direction: its triangles are flat");
    Ok(None)
}

/// The map of normals: cofactors, which exist for flat transforms too; the length does not matter.
fn normals_turn(scene_from_mesh: &DMat4) -> DMat3 {
    let m = DMat3::from_mat4(*scene_from_mesh);
    let cofactors = DMat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis));
    if m.determinant() < 0.0 { cofactors * -1.0 } else { cofactors }
}

/// Linear colours of vertices, with their opacity or 1.
fn colors(index: usize, buffers: &Buffers<'_>, reading: &Reading<'_>) -> Result<Vec<[f32; 4]>, ReadError> {
    let colors: Vec<[f32; 4]> = if buffers.width(index)? == 3 {
        buffers.vectors::<3>(index, "COLOR_0", reading)?.into_iter().map(|[r, g, b]| [r, g, b, 1.0]).collect()
    } else {
        buffers.vectors::<4>(index, "COLOR_0", reading)?
    };
    if let Some(color) = colors.iter().flatten().find(|c| !(c.is_finite() && **c >= 0.0)) {
        return Err(wrong("colours from 0 to 1 in COLOR_0".into(), color.to_string()));
    }
    Ok(colors.into_iter().map(|color| color.map(|c| c.min(1.0))).collect())
}

/// Triangles of a list, a strip or a fan. Those with a corner twice join strips and are nothing by themselves.
fn triangles(indices: &[u32], mode: u32) -> Result<Vec<[u32; 3]>, ReadError> {
    let mut triangles: Vec<[u32; 3]> = match mode {
        TRIANGLES => indices.as_chunks::<3>().0.to_vec(),
        STRIP => {
            let turned = |(i, t): (usize, &[u32])| if i % 2 == 0 { [t[0], t[1], t[2]] } else { [t[1], t[0], t[2]] };
            indices.windows(3).enumerate().map(turned).collect()
        }
        FAN => indices.windows(2).skip(1).map(|pair| [indices[0], pair[0], pair[1]]).collect(),
        _ => {
            let expected = "a mode from 0 to 6".to_owned();
            return Err(ReadError::input(Place::File, expected, mode.to_string(), HINT));
        }
    };
    triangles.retain(|[a, b, c]| a != b && b != c && a != c);
    Ok(triangles)
}
