//! PLY: ascii and both binary byte orders → a mesh where there are faces, else raw points; Gaussians and splats where vertices are such.
//!
//! The parser is our own: places down to line and column or byte, line ends of every system, duplicate properties and
//! sizes checked against the file before allocation are asked of it. Properties it has no use for are read over and named.
//! Faces come as polygons (`face`), as triangle strips (`tristrips`, which −1 starts anew), or as both.

mod ascii;
mod binary;
mod body;
mod columns;
mod faces;
mod gaussians;
mod header;
mod splats;
pub(crate) mod texture;

use crate::error::{Place, ReadError};
use crate::reading::Reading;
use crate::{Loaded, ReadParams};
use ascii::Ascii;
use binary::Binary;
use body::Source;
use header::{Encoding, Header, Shape};
use std::path::Path;

/// Reads a PLY file that lies at `place`, if it is no part of memory.
pub(crate) fn read(content: &[u8], place: Option<&Path>, reading: &mut Reading<'_>) -> Result<Loaded, ReadError> {
    let header = header::parse(content)?;
    match header.encoding {
        Encoding::Ascii => elements(Ascii::new(content, header.body, header.body_line), &header, place, reading),
        Encoding::LittleEndian => elements(Binary::<false>::new(content, header.body), &header, place, reading),
        Encoding::BigEndian => elements(Binary::<true>::new(content, header.body), &header, place, reading),
    }
}

fn elements<S: Source>(
    source: S,
    header: &Header,
    place: Option<&Path>,
    reading: &mut Reading<'_>,
) -> Result<Loaded, ReadError> {
    if splats::is_of_splats(header) {
        return splats::read(source, header, reading).map(Loaded::Points);
    }
    if let Some(kind) = header.gaussians() {
        return gaussians::read(source, header, kind, reading).map(Loaded::Points);
    }
    if header.has_gaussians_without_colors() {
        let hint = "write f_dc_0 to f_dc_2, or red, green and blue, or draw points without scale_* and rot_*";
        let expected = "Gaussians with their colours as f_dc_0 to f_dc_2, or as red, green and blue";
        return Err(ReadError::input(Place::File, expected, "Gaussians without such", hint));
    }
    let loaded = body::read(source, header, place, reading)?;
    reading.notes.not_used(unused(header, reading.params)?.iter().map(Vec::as_slice));
    Ok(loaded)
}

/// Names of what is read over: properties of vertices, and `element.property` of others.
fn unused(header: &Header, params: &ReadParams) -> Result<Vec<Vec<u8>>, ReadError> {
    let is_index = |name: &[u8]| name == b"vertex_indices" || name == b"vertex_index";
    let mut names = Vec::new();
    for element in &header.elements {
        let properties = element.properties.iter().map(|p| p.name.as_slice());
        match element.name.as_slice() {
            b"vertex" => {
                let columns = columns::Columns::new(element, header.is_mesh(), params)?;
                names.extend(columns.unused(element).map(<[u8]>::to_vec));
            }
            b"tristrips" => {}
            // Numbers of faces can be asked for, but for those of a name that vertices have.
            b"face" => {
                let vertex = header.elements.iter().find(|e| e.name == b"vertex");
                let is_taken = |name: &[u8]| vertex.is_some_and(|v| v.properties.iter().any(|p| p.name == name));
                let unused = element.properties.iter().filter(|p| {
                    let is_list = matches!(p.shape, Shape::List { .. });
                    let is_place = p.name == texture::OF_CORNERS && texture::has_corners(header);
                    !is_index(&p.name) && !is_place && (is_list || is_taken(&p.name))
                });
                names.extend(unused.map(|p| [b"face.", p.name.as_slice()].concat()));
            }
            other => names.extend(properties.map(|n| [other, b".", n].concat())),
        }
    }
    Ok(names)
}
