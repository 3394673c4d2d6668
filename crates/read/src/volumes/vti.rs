//! VTK files in XML: images (`.vti`), rectilinear grids (`.vtr`), structured grids (`.vts`) and cells (`.vtu`) → a volume of scalars, of
//! colours their luma; surfaces (`.vtp`) → a mesh; lists of such files (`.pvtu` and the like, `.vtm`, `.pvd`) → what these are together.
//!
//! Arrays as text, in base64 or appended, raw or in base64, each also in blocks of zlib. Read is the array that is asked for, else the one
//! that `Scalars` names, else the first of one number, of the points, else of the cells; others are named.

mod data;
mod extents;
mod listed;
mod pasted;
mod piece;
mod pieces;

use super::lattice;
use super::rectilinear::Rectilinear;
use super::selection::{Candidate, GHOSTS, Selection, Value, chosen_array};
use super::voxels::{Kind, Stored};
use crate::error::{Place, ReadError};
use crate::reading::Reading;
use crate::stream::input;
use crate::text::xml;
use crate::{Loaded, Notes, ReadParams};
use data::{Appended, Encoding};
use roxmltree::{Document, Node};
use splat_core::Grid;
use splat_core::glam::{DMat3, DVec3};
use splat_core::text::escaped;
use std::path::Path;

const HINT: &str = "the file is truncated or damaged, or its header states other sizes";

/// What to do with datasets that are not read.
const OTHER_DATASETS: &str = "other datasets of VTK, such as trees and tables, are not read: in ParaView, Resample To Image and save it as .vti, or \
    Append Datasets and save it as .vtu";

/// Most elements, attributes and texts of a file; real ones have some dozens.
const MAX_NODES: u32 = 10_000;

/// Datasets that are read.
const DATASETS: [&str; 5] = ["ImageData", "RectilinearGrid", "StructuredGrid", "UnstructuredGrid", "PolyData"];

/// Reads a file, which lies at `place` if it is no part of memory.
pub(crate) fn read(content: &[u8], place: Option<&Path>, reading: &mut Reading<'_>) -> Result<Loaded, ReadError> {
    if listed::is_list(content) {
        return listed::read(content, place, reading);
    }
    let (appended, text) = Appended::split(content)?;
    input::hold("the description", if appended.is_some() { text.len() as u64 } else { 0 }, reading.params)?;
    let document = parsed(&text)?;
    let dataset = dataset(&document)?;
    let encoding = Encoding::stated_by(document.root_element(), content, appended)?;
    let list = place.and_then(listed::naming);
    if let Some(list) = &list {
        let list = escaped(list.as_bytes(), 60);
        reading
            .notes
            .remark(format!("this file is one piece of the dataset whose list is '{list}', which draws all of it"));
    }
    one(&pieces::Source { dataset, encoding: &encoding, file: None }, reading)
}

/// Reads the dataset of one file.
fn one(source: &pieces::Source<'_, '_, '_>, reading: &mut Reading<'_>) -> Result<Loaded, ReadError> {
    match source.dataset.tag_name().name() {
        "ImageData" => image(source.dataset, source.encoding, reading).map(Loaded::Grid),
        "RectilinearGrid" => rectilinear(source.dataset, source.encoding, reading).map(Loaded::Grid),
        _ => pieces::read(std::slice::from_ref(source), false, reading),
    }
}

/// The elements of a text.
fn parsed(text: &str) -> Result<Document<'_>, ReadError> {
    xml::parse(text, MAX_NODES).map_err(|e| {
        let line = e.line.map(|(line, column)| Place::Line { line: line.into(), column: column.into() });
        ReadError::input(line.unwrap_or(Place::Byte(e.byte as u64)), e.expected, e.found, HINT)
    })
}

/// Reads the volume of an image.
fn image(image: Node<'_, '_>, encoding: &Encoding<'_>, reading: &mut Reading<'_>) -> Result<Grid, ReadError> {
    let piece = only_piece(image, reading)?;
    let lattice = Lattice::within(image, extent(piece, "Extent")?)?;
    let found = chosen_of(piece, reading)?;
    not_used(image, &[found.array], &mut reading.notes);
    let mut origin = lattice.origin;
    let mut sizes = lattice.points;
    if found.is_of_cells {
        (origin, sizes) = lattice::of_cells(origin, &lattice.axes, lattice.points);
        remark_middles(&found, reading);
    }
    let values = lattice_values(&found, sizes, lattice.place, encoding, reading)?;
    Ok(Grid { origin, axes: lattice.axes, dims: sizes.map(|n| n as usize), values })
}

/// Reads the volume of a rectilinear grid.
fn rectilinear(grid: Node<'_, '_>, encoding: &Encoding<'_>, reading: &mut Reading<'_>) -> Result<Grid, ReadError> {
    let piece = only_piece(grid, reading)?;
    let coordinates = coordinates(piece, encoding, reading)?;
    let found = chosen_of(piece, reading)?;
    let element = child(piece, "Coordinates");
    let used: Vec<Node<'_, '_>> = element.into_iter().flat_map(arrays).chain([found.array]).collect();
    not_used(grid, &used, &mut reading.notes);
    let of_values = if found.is_of_cells { coordinates.of_cells() } else { coordinates };
    if found.is_of_cells {
        remark_middles(&found, reading);
    }
    let values = lattice_values(&found, of_values.dims(), place(piece), encoding, reading)?;
    of_values.grid(values, reading)
}

/// Says that a volume has the values of cells.
fn remark_middles(found: &ChosenArray<'_, '_>, reading: &mut Reading<'_>) {
    reading.notes.remarks.push(format!("values of cells ({}): they lie at the middles", name(found.array)));
}

/// The array of a piece of a lattice, which has to have one.
fn chosen_of<'a, 'i>(piece: Node<'a, 'i>, reading: &mut Reading<'_>) -> Result<ChosenArray<'a, 'i>, ReadError> {
    let chosen = chosen(piece, reading.params, &mut reading.notes)?;
    chosen.ok_or_else(|| wrong(piece, "a DataArray in PointData or CellData", "none"))
}

/// The values of an array over a lattice of these sizes, which are told of at a place.
fn lattice_values(
    found: &ChosenArray<'_, '_>,
    dims: [u64; 3],
    place: Place,
    encoding: &Encoding<'_>,
    reading: &mut Reading<'_>,
) -> Result<Vec<f32>, ReadError> {
    let selection = found.selection(reading.params, &mut reading.notes)?;
    let kind = kind(found.array)?;
    let stored = Stored { kind, big_endian: encoding.big_endian, dims, selection, scaling: (1.0, 0.0) };
    stored.check(place, HINT)?;
    encoding.values(found.array, &stored, reading.params)
}

/// The coordinates of the points of a piece of a rectilinear grid.
fn coordinates(piece: Node<'_, '_>, encoding: &Encoding<'_>, reading: &Reading<'_>) -> Result<Rectilinear, ReadError> {
    let extent = extent(piece, "Extent")?;
    let element = child(piece, "Coordinates").ok_or_else(|| wrong(piece, "an element Coordinates", "none"))?;
    let found: Vec<_> = arrays(element).collect();
    let &[x, y, z] = found.as_slice() else {
        return Err(wrong(element, "three arrays of coordinates", &found.len().to_string()));
    };
    let along = |array: Node<'_, '_>, [low, high]: [i64; 2]| -> Result<Vec<f64>, ReadError> {
        let numbers = encoding.numbers(array, (high - low + 1) as u64, reading)?;
        Ok(numbers.to_vec())
    };
    let coordinates = [along(x, extent[0])?, along(y, extent[1])?, along(z, extent[2])?];
    let coordinates = Rectilinear { coordinates, place: place(element) };
    coordinates.check()?;
    Ok(coordinates)
}

/// Where an element begins.
fn place(node: Node<'_, '_>) -> Place {
    Place::Byte(node.range().start as u64)
}

fn wrong(node: Node<'_, '_>, expected: &str, found: &str) -> ReadError {
    ReadError::input(place(node), expected, format!("'{}'", escaped(found.as_bytes(), 60)), HINT)
}

fn child<'a, 'i>(node: Node<'a, 'i>, name: &str) -> Option<Node<'a, 'i>> {
    node.children().find(|c| c.has_tag_name(name))
}

/// The element of the dataset.
fn dataset<'a, 'i>(document: &'a Document<'i>) -> Result<Node<'a, 'i>, ReadError> {
    let root = document.root_element();
    let kind = root.attribute("type").unwrap_or_default();
    if !root.has_tag_name("VTKFile") || !DATASETS.contains(&kind) {
        let expected = "a VTKFile of type ImageData, RectilinearGrid, StructuredGrid, UnstructuredGrid or PolyData";
        return Err(ReadError { hint: OTHER_DATASETS, ..wrong(root, expected, kind) });
    }
    child(root, kind).ok_or_else(|| wrong(root, &format!("an element {kind}"), "none"))
}

/// The piece of a lattice, which has to be the only one; warns where it is a part of the whole.
fn only_piece<'a, 'i>(lattice: Node<'a, 'i>, reading: &mut Reading<'_>) -> Result<Node<'a, 'i>, ReadError> {
    let pieces: Vec<_> = lattice.children().filter(|c| c.has_tag_name("Piece")).collect();
    let &[piece] = pieces.as_slice() else {
        let hint = "write the dataset as one piece";
        return Err(ReadError { hint, ..wrong(lattice, "one Piece", &pieces.len().to_string()) });
    };
    warn_of_part(piece, lattice, reading)?;
    Ok(piece)
}

/// Warns where the only piece of a file is a part of its dataset. Refuses one that reaches beyond it.
fn warn_of_part(piece: Node<'_, '_>, dataset: Node<'_, '_>, reading: &mut Reading<'_>) -> Result<(), ReadError> {
    let part = extent(piece, "Extent")?;
    let whole = extent(dataset, "WholeExtent")?;
    let text = |node: Node<'_, '_>, name: &str| escaped(node.attribute(name).unwrap_or_default().as_bytes(), 60);
    if part.iter().zip(&whole).any(|(part, whole)| part[0] < whole[0] || part[1] > whole[1]) {
        return Err(wrong(piece, "a Piece within the WholeExtent", piece.attribute("Extent").unwrap_or_default()));
    }
    if part != whole {
        reading.notes.warnings.push(format!(
            "this file has the piece {} of a dataset of {}, and only that is drawn; the list of all pieces (.pvti, .pvtr, .pvts) draws the whole",
            text(piece, "Extent"),
            text(dataset, "WholeExtent")
        ));
    }
    Ok(())
}

/// The name of an array, as it may be shown.
fn name(array: Node<'_, '_>) -> String {
    escaped(array.attribute("Name").unwrap_or_default().as_bytes(), 40)
}

/// So many numbers of an attribute, if there is one of this name.
fn numbers<const N: usize>(node: Node<'_, '_>, name: &str) -> Result<Option<[f64; N]>, ReadError> {
    let Some(text) = node.attribute(name) else { return Ok(None) };
    let finite = |w: &str| w.parse::<f64>().ok().filter(|v| v.is_finite());
    let numbers: Option<Vec<f64>> = text.split_ascii_whitespace().map(finite).collect();
    let numbers = numbers.and_then(|numbers| <[f64; N]>::try_from(numbers).ok());
    numbers.map(Some).ok_or_else(|| wrong(node, &format!("{N} finite numbers of {name}"), text))
}

/// The lattice of the points.
struct Lattice {
    points: [u64; 3],
    origin: DVec3,
    axes: DMat3,
    place: Place,
}

impl Lattice {
    /// The part between these indices.
    fn within(image: Node<'_, '_>, extent: [[i64; 2]; 3]) -> Result<Self, ReadError> {
        let spacing = numbers(image, "Spacing")?.map_or(DVec3::ONE, DVec3::from_array);
        // Row by row.
        let direction =
            numbers(image, "Direction")?.map_or(DMat3::IDENTITY, |d| DMat3::from_cols_array(&d).transpose());
        let axes = direction * DMat3::from_diagonal(spacing);
        let first = DVec3::from_array([0, 1, 2].map(|i| extent[i][0] as f64));
        let origin = numbers(image, "Origin")?.map_or(DVec3::ZERO, DVec3::from_array) + axes * first;
        lattice::check(origin, &axes, place(image), HINT)?;
        Ok(Self { points: sizes(extent), origin, axes, place: place(image) })
    }
}

/// Points between indices, those included.
fn sizes(extent: [[i64; 2]; 3]) -> [u64; 3] {
    extent.map(|[low, high]| (high - low + 1) as u64)
}

/// The first and the last index along each axis.
fn extent(node: Node<'_, '_>, name: &str) -> Result<[[i64; 2]; 3], ReadError> {
    let text = node.attribute(name).unwrap_or_default();
    let ends: Option<Vec<i32>> = text.split_ascii_whitespace().map(|w| w.parse().ok()).collect();
    let extent = ends.and_then(|e| <[i32; 6]>::try_from(e).ok()).map(|e| e.map(i64::from));
    let extent = extent.map(|[a, b, c, d, e, f]| [[a, b], [c, d], [e, f]]);
    let rises = |extent: &[[i64; 2]; 3]| extent.iter().all(|[low, high]| low <= high);
    extent.filter(rises).ok_or_else(|| wrong(node, &format!("six rising indices in {name}, two an axis"), text))
}

/// The arrays of a piece that belong to its points or its cells.
fn arrays<'a, 'i>(data: Node<'a, 'i>) -> impl Iterator<Item = Node<'a, 'i>> + Clone {
    data.children().filter(|c| c.has_tag_name("DataArray"))
}

/// The array that is read.
struct ChosenArray<'a, 'i> {
    array: Node<'a, 'i>,
    /// Whether it belongs to the cells.
    is_of_cells: bool,
    /// The part of a vector that is the value.
    value: Option<Value>,
}

impl ChosenArray<'_, '_> {
    /// Which of the numbers of a tuple is its value.
    fn selection(&self, params: &ReadParams, notes: &mut Notes) -> Result<Selection, ReadError> {
        let numbers = components(self.array)?;
        let place = place(self.array);
        let selection = Selection::of_frames(1, place, params, notes)?;
        match self.value {
            Some(value) => Ok(selection.with_value(numbers, value)),
            None => selection.with_numbers(numbers, kind(self.array)?, false, place, notes),
        }
    }
}

/// The array that is read: of the points where one of them is a field, else of the cells.
fn chosen<'a, 'i>(
    piece: Node<'a, 'i>,
    params: &ReadParams,
    notes: &mut Notes,
) -> Result<Option<ChosenArray<'a, 'i>>, ReadError> {
    for data in data_of(piece) {
        let named = data.attribute("Scalars");
        let is_there = arrays(data).any(|array| array.attribute("Name") == named);
        if let Some(named) = named.filter(|_| !is_there && arrays(data).next().is_some()) {
            let named = escaped(named.as_bytes(), 40);
            notes.remark(format!("there is no array '{named}', which Scalars names: another is read"));
        }
    }
    let (nodes, candidates) = offered(piece)?;
    let chosen = chosen_array(&candidates, place(piece), params, notes)?;
    let is_of_cells =
        |array: Node<'_, '_>| array.parent_element().is_some_and(|parent| parent.has_tag_name("CellData"));
    Ok(chosen.map(|chosen| {
        let array = nodes[chosen.rank];
        ChosenArray { array, is_of_cells: is_of_cells(array), value: chosen.value }
    }))
}

/// The elements of a piece that have the arrays of its points and of its cells.
fn data_of<'a, 'i>(piece: Node<'a, 'i>) -> impl Iterator<Item = Node<'a, 'i>> {
    ["PointData", "CellData"].into_iter().filter_map(move |name| child(piece, name))
}

/// The arrays of a piece that can be a field, those of points before those of cells, and the same as far as choosing needs them.
fn offered<'a, 'i>(piece: Node<'a, 'i>) -> Result<(Vec<Node<'a, 'i>>, Vec<Candidate>), ReadError> {
    let mut nodes = Vec::new();
    let mut candidates = Vec::new();
    for data in data_of(piece) {
        let is_active = |array: Node<'_, '_>| {
            let named =
                |attribute: &str| data.attribute(attribute).is_some_and(|name| array.attribute("Name") == Some(name));
            named("Scalars") || named("Vectors")
        };
        for array in arrays(data).filter(|array| array.attribute("Name") != Some(GHOSTS)) {
            nodes.push(array);
            candidates.push(Candidate {
                name: name(array),
                numbers: components(array)?,
                kind: kind(array).ok(),
                is_named: is_active(array),
                is_of_cells: data.has_tag_name("CellData"),
            });
        }
    }
    Ok((nodes, candidates))
}

/// Names the arrays that are not used.
fn not_used(dataset: Node<'_, '_>, used: &[Node<'_, '_>], notes: &mut Notes) {
    let others = dataset.document().descendants().filter(|n| n.has_tag_name("DataArray") && !used.contains(n));
    let names: Vec<String> = others
        .map(|other| {
            let association = other.parent_element().map_or("", |parent| parent.tag_name().name());
            let name = other.attribute("Name").unwrap_or("an array without a name");
            if association == "PointData" { name.to_owned() } else { format!("{association}.{name}") }
        })
        .collect();
    notes.not_used(names.iter().map(String::as_bytes));
}

/// The type of the numbers of an array.
fn kind(array: Node<'_, '_>) -> Result<Kind, ReadError> {
    let name = array.attribute("type").unwrap_or_default();
    Ok(match name {
        "Int8" => Kind::I8,
        "UInt8" => Kind::U8,
        "Int16" => Kind::I16,
        "UInt16" => Kind::U16,
        "Int32" => Kind::I32,
        "UInt32" => Kind::U32,
        "Int64" => Kind::I64,
        "UInt64" => Kind::U64,
        "Float32" => Kind::F32,
        "Float64" => Kind::F64,
        _ => return Err(wrong(array, "a DataArray of a type from Int8 to Float64", name)),
    })
}

/// Numbers of a tuple of an array.
fn components(array: Node<'_, '_>) -> Result<u64, ReadError> {
    let components = array.attribute("NumberOfComponents").unwrap_or("1");
    components.parse().map_err(|_| wrong(array, "a number of components", components))
}
