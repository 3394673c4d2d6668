//! The body of a PLY file, record by record, from text or bytes alike.

use super::columns::Columns;
use super::faces::{Faces, Form};
use super::header::{Element, Header, Property, Shape, Type, at_line};
use super::texture::{self, Textures};
use crate::Loaded;
use crate::error::{Place, ReadError};
use crate::reading::Reading;
use crate::stream::beside::Beside;
use crate::stream::input;
use splat_core::text::escaped;
use std::path::Path;

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

/// Records between two looks at whether to stop.
const LOOK: u64 = 1 << 14;

/// Reads every element.
pub(super) fn read<S: Source>(
    mut source: S,
    header: &Header,
    place: Option<&Path>,
    reading: &mut Reading<'_>,
) -> Result<Loaded, ReadError> {
    let Some(vertices) = header.elements.iter().find(|e| e.name == b"vertex") else {
        let hint = "only meshes and point clouds are read";
        return Err(ReadError::input(at_line(header.body_line - 1), "an element 'vertex'", "none", hint));
    };
    let mesh = header.is_mesh();
    let textures = if mesh { Textures::open(&header.textures, &Beside::new(place), reading)? } else { None };
    let has_wedges = textures.is_some() && texture::has_corners(header);
    // Places of vertices in a texture are read as numbers that are asked for.
    let places = texture::of_vertices(header, vertices).filter(|_| textures.is_some() && !has_wedges);
    let mut params = reading.params.clone();
    params.columns.extend(places.into_iter().flatten().map(str::to_owned));
    let mut columns = Columns::new(vertices, mesh, &params)?;
    let of_vertices = vertices.properties.iter().map(|property| property.name.clone()).collect();
    let mut faces = Faces::new(vertices.count, of_vertices, has_wedges);
    for element in &header.elements {
        check_count(&source, element)?;
        match element.name.as_slice() {
            b"vertex" => read_vertices(&mut source, element, &mut columns, reading)?,
            b"face" => faces.read(&mut source, element, Form::Polygons, reading)?,
            b"tristrips" => faces.read(&mut source, element, Form::Strips, reading)?,
            _ => skip_element(&mut source, element, reading)?,
        }
    }
    source.finish()?;
    if !mesh {
        return columns.into_points(&mut reading.notes).map(Loaded::Points);
    }
    let (mesh, wedges) = faces.into_mesh(columns, reading)?;
    let mesh = match (textures, wedges, places) {
        (Some(textures), Some(wedges), _) => wedges.paint(mesh, textures, reading)?,
        (Some(textures), None, Some(places)) => textures.paint_vertices(mesh, places, reading)?,
        (Some(_), None, None) => {
            reading
                .notes
                .remark("it names a texture, and nothing has a place in it (texcoord of faces, s and t of vertices)");
            mesh
        }
        (None, ..) => mesh,
    };
    Ok(Loaded::Mesh(mesh))
}

/// Looks now and then whether to stop.
pub(super) fn look(record: u64, reading: &Reading<'_>) -> Result<(), ReadError> {
    if record.is_multiple_of(LOOK) { reading.go_on() } else { Ok(()) }
}

/// Refuses a count that the rest of the file cannot hold.
pub(super) fn check_count<S: Source>(source: &S, element: &Element) -> Result<(), ReadError> {
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
    reading: &Reading<'_>,
) -> Result<(), ReadError> {
    input::hold("the vertices", element.count.saturating_mul(columns.bytes_per_vertex()), reading.params)?;
    columns.reserve(element.count as usize)?;
    for record in 0..element.count {
        look(record, reading)?;
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

/// The length of a list, refused if the rest of the file cannot hold it.
pub(super) fn list_length<S: Source>(source: &mut S, count: Type, item: Type) -> Result<u64, ReadError> {
    let length = source.number(count)?;
    let most = source.remaining() / source.least_bytes(item);
    if length >= 0.0 && length <= most as f64 {
        return Ok(length as u64);
    }
    let expected = format!("a list of at most {most} entries, what the rest of the file can hold");
    Err(ReadError::input(source.place(), expected, source.shown(length), "the file is truncated or damaged"))
}

pub(super) fn skip_list<S: Source>(source: &mut S, count: Type, item: Type) -> Result<(), ReadError> {
    for _ in 0..list_length(source, count, item)? {
        source.number(item)?;
    }
    Ok(())
}

pub(super) fn skip_element<S: Source>(
    source: &mut S,
    element: &Element,
    reading: &Reading<'_>,
) -> Result<(), ReadError> {
    if element.properties.is_empty() {
        return Ok(());
    }
    for record in 0..element.count {
        look(record, reading)?;
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
