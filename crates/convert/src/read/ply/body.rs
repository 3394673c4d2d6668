//! The body of a PLY file, record by record, from text or bytes alike.

use super::columns::Columns;
use super::header::{Element, Header, Property, Shape, Type, at_line};
use crate::error::{Place, ReadError, escaped};
use crate::read::polygon::{self, Polygon};
use crate::read::{Loaded, ReadLimits, input};

/// Where numbers come from.
pub(super) trait Source {
    /// Moves to the next record.
    fn begin_record(&mut self) -> Result<(), ReadError>;
    /// The next number of the record. Floating point may be infinite or NaN.
    fn number(&mut self, kind: Type) -> Result<f64, ReadError>;
    /// Refuses what is left of the record.
    fn end_record(&mut self) -> Result<(), ReadError>;
    /// Refuses what is left of the file.
    fn finish(&mut self) -> Result<(), ReadError>;
    /// Bytes left.
    fn remaining(&self) -> u64;
    /// Fewest bytes that a number can take.
    fn least_bytes(&self, kind: Type) -> u64;
    /// Place of the last number.
    fn place(&self) -> Place;
    /// The last number, as the file has it.
    fn shown(&self, value: f64) -> String;
}

/// Reads every element.
pub(super) fn read<S: Source>(mut source: S, header: &Header, limits: &ReadLimits) -> Result<Loaded, ReadError> {
    let named = |name: &[u8]| header.elements.iter().find(|e| e.name == name && e.count > 0);
    if let Some(strips) = named(b"tristrips") {
        let hint = "convert the strips to faces with another tool";
        return Err(ReadError::input(at_line(strips.line), "faces", "triangle strips", hint));
    }
    let Some(vertices) = header.elements.iter().find(|e| e.name == b"vertex") else {
        let hint = "only meshes and point clouds are read";
        return Err(ReadError::input(at_line(header.body_line - 1), "an element 'vertex'", "none", hint));
    };
    let mesh = named(b"face").is_some();
    let mut columns = Columns::new(vertices, limits.drop_invalid && !mesh)?;
    let mut faces = Faces::default();
    for element in &header.elements {
        check_count(&source, element)?;
        match element.name.as_slice() {
            b"vertex" => read_vertices(&mut source, element, &mut columns, limits)?,
            b"face" => read_faces(&mut source, element, vertices.count, &mut faces, limits)?,
            _ => skip_element(&mut source, element)?,
        }
    }
    source.finish()?;
    if !mesh {
        return columns.into_points().map(Loaded::Points);
    }
    let mut mesh = columns.into_mesh(faces.triangles)?;
    polygon::triangulate(&mut mesh, &faces.polygons).map_err(|p| {
        let found = format!("face {} of {} corners that crosses itself", p.face, p.count + 2);
        let hint = "split the face into triangles, or put its corners in order";
        ReadError::input(at_line(faces.line), "faces whose edges do not cross", found, hint)
    })?;
    Ok(Loaded::Mesh(mesh))
}

/// Refuses a count that the rest of the file cannot hold.
fn check_count<S: Source>(source: &S, element: &Element) -> Result<(), ReadError> {
    let least = |p: &Property| match p.shape {
        Shape::Scalar(kind) | Shape::List { count: kind, .. } => source.least_bytes(kind),
    };
    let record: u64 = element.properties.iter().map(least).sum();
    let needed = record.checked_mul(element.count);
    if needed.is_some_and(|n| n <= source.remaining()) {
        return Ok(());
    }
    Err(ReadError::input(
        at_line(element.line),
        format!(
            "at most {} records, what the {} bytes left can hold",
            source.remaining() / record.max(1),
            source.remaining()
        ),
        format!("{} records of '{}'", element.count, escaped(&element.name, 40)),
        "the file is truncated, or its header is damaged",
    ))
}

fn read_vertices<S: Source>(
    source: &mut S,
    element: &Element,
    columns: &mut Columns,
    limits: &ReadLimits,
) -> Result<(), ReadError> {
    input::check_bytes("the vertices", element.count.saturating_mul(columns.bytes_per_vertex()), limits)?;
    columns.reserve(element.count as usize)?;
    for _ in 0..element.count {
        source.begin_record()?;
        for (index, property) in element.properties.iter().enumerate() {
            match property.shape {
                Shape::Scalar(kind) => {
                    let value = source.number(kind)?;
                    columns.push(index, value).map_err(|(expected, hint)| {
                        ReadError::input(source.place(), expected, source.shown(value), hint)
                    })?;
                }
                Shape::List { count, item } => skip_list(source, count, item)?,
            }
        }
        source.end_record()?;
    }
    Ok(())
}

/// The faces so far.
#[derive(Default)]
struct Faces {
    triangles: Vec<[u32; 3]>,
    /// Faces of more than three corners; fans among the triangles until all vertices are known.
    polygons: Vec<Polygon>,
    /// Line of the header that announces them.
    line: u64,
}

fn read_faces<S: Source>(
    source: &mut S,
    element: &Element,
    vertices: u64,
    faces: &mut Faces,
    limits: &ReadLimits,
) -> Result<(), ReadError> {
    let is_index = |p: &Property| p.name == b"vertex_indices" || p.name == b"vertex_index";
    let Some(indices) = element.properties.iter().find(|p| is_index(p)) else {
        let hint = "faces without vertices cannot be drawn";
        return Err(ReadError::input(at_line(element.line), "a list 'vertex_indices'", "none", hint));
    };
    if !matches!(indices.shape, Shape::List { item, .. } if item.integer_range().is_some()) {
        let hint = "write 'property list uchar int vertex_indices'";
        return Err(ReadError::input(at_line(indices.line), "a list of integers", "another type", hint));
    }
    input::check_bytes("the faces", element.count.saturating_mul(12), limits)?;
    input::reserve(&mut faces.triangles, element.count as usize)?;
    faces.line = element.line;
    for face in 0..element.count {
        source.begin_record()?;
        for property in &element.properties {
            match property.shape {
                Shape::Scalar(kind) => {
                    source.number(kind)?;
                }
                Shape::List { count, item } if is_index(property) => {
                    read_polygon(source, face, (count, item), vertices, faces, limits)?;
                }
                Shape::List { count, item } => skip_list(source, count, item)?,
            }
        }
        source.end_record()?;
    }
    Ok(())
}

/// One polygon → a fan around its first vertex, for now.
fn read_polygon<S: Source>(
    source: &mut S,
    face: u64,
    (count, item): (Type, Type),
    vertices: u64,
    faces: &mut Faces,
    limits: &ReadLimits,
) -> Result<(), ReadError> {
    let corners = list_length(source, count, item)?;
    if corners < 3 {
        let expected = format!("3 or more corners of face {face}");
        return Err(ReadError::input(source.place(), expected, corners.to_string(), "remove degenerate faces"));
    }
    let Faces { triangles, polygons, .. } = faces;
    let total = triangles.len() as u64 + corners - 2;
    let bytes = total.saturating_mul(12).saturating_add((polygons.len() * size_of::<Polygon>()) as u64);
    input::check_bytes("the triangles", bytes, limits)?;
    let count = corners as usize - 2;
    input::reserve(triangles, count)?;
    if count > 1 {
        input::reserve(polygons, 1)?;
        polygons.push(Polygon { face, first: triangles.len(), count });
    }
    let mut corner = || {
        let index = source.number(item)?;
        if (0.0..vertices as f64).contains(&index) {
            return Ok(index as u32);
        }
        let expected = format!("a vertex of face {face} from 0 to {}", vertices.saturating_sub(1));
        Err(ReadError::input(source.place(), expected, source.shown(index), "the face list is damaged"))
    };
    let (first, mut previous) = (corner()?, corner()?);
    for _ in 2..corners {
        let next = corner()?;
        triangles.push([first, previous, next]);
        previous = next;
    }
    Ok(())
}

/// The length of a list, refused if the rest of the file cannot hold it.
fn list_length<S: Source>(source: &mut S, count: Type, item: Type) -> Result<u64, ReadError> {
    let length = source.number(count)?;
    let most = source.remaining() / source.least_bytes(item);
    if length >= 0.0 && length <= most as f64 {
        return Ok(length as u64);
    }
    let expected = format!("a list of at most {most} entries, what the rest of the file can hold");
    Err(ReadError::input(source.place(), expected, source.shown(length), "the file is truncated or damaged"))
}

fn skip_list<S: Source>(source: &mut S, count: Type, item: Type) -> Result<(), ReadError> {
    for _ in 0..list_length(source, count, item)? {
        source.number(item)?;
    }
    Ok(())
}

fn skip_element<S: Source>(source: &mut S, element: &Element) -> Result<(), ReadError> {
    if element.properties.is_empty() {
        return Ok(());
    }
    for _ in 0..element.count {
        source.begin_record()?;
        for property in &element.properties {
            match property.shape {
                Shape::Scalar(kind) => {
                    source.number(kind)?;
                }
                Shape::List { count, item } => skip_list(source, count, item)?,
            }
        }
        source.end_record()?;
    }
    Ok(())
}
