//! VTK image data in XML (`.vti`) → a volume of scalars, of colours their luma.
//!
//! Arrays as text, in base64 or appended, raw or in base64, each also in blocks of zlib. Read is the array that `Scalars` names,
//! else the first, of the points, else of the cells; others are named.

mod data;

use super::selection::Selection;
use super::voxels::{Kind, Stored};
use super::{Notes, ReadParams, lattice};
use crate::error::{Place, ReadError, escaped};
use data::{Appended, Encoding};
use roxmltree::{Document, Node, ParsingOptions};
use splat_core::Grid;
use splat_core::glam::{DMat3, DVec3};

const HINT: &str = "the file is truncated or damaged, or its header states other sizes";

/// Most elements, attributes and texts of a file; real ones have some dozens.
const MAX_NODES: u32 = 10_000;

/// Reads a volume.
pub(super) fn read(content: &[u8], params: &ReadParams, notes: &mut Notes) -> Result<Grid, ReadError> {
    let (appended, text) = Appended::split(content)?;
    let options = ParsingOptions { allow_dtd: false, nodes_limit: MAX_NODES, ..ParsingOptions::default() };
    let document = Document::parse_with_options(&text, options).map_err(|e| {
        let place = Place::Line { line: e.pos().row.into(), column: e.pos().col.into() };
        ReadError::input(place, "XML", e.to_string(), HINT)
    })?;
    let image = image(&document)?;
    let encoding = Encoding::of(document.root_element(), content, appended)?;
    let lattice = Lattice::of(image)?;
    let (array, is_of_cells) = chosen(image, notes)?;
    let (mut origin, mut sizes) = (lattice.origin, lattice.points);
    if is_of_cells {
        (origin, sizes) = lattice::of_cells(origin, &lattice.axes, lattice.points);
        let name = escaped(array.attribute("Name").unwrap_or_default().as_bytes(), 40);
        notes.remarks.push(format!("values of cells ({name}): they lie at the middles"));
    }
    let stored = stored(array, sizes, encoding.big_endian, params, notes)?;
    stored.check(lattice.place, HINT)?;
    let values = encoding.values(array, &stored, params)?;
    Ok(Grid { origin, axes: lattice.axes, dims: sizes.map(|n| n as usize), values })
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

/// The element of the image.
fn image<'a, 'i>(document: &'a Document<'i>) -> Result<Node<'a, 'i>, ReadError> {
    let root = document.root_element();
    let kind = root.attribute("type").unwrap_or_default();
    if !root.has_tag_name("VTKFile") || kind != "ImageData" {
        let hint = "other datasets of VTK are not read: resample to an image, or write a surface as PLY, OBJ or STL";
        return Err(ReadError { hint, ..wrong(root, "a VTKFile of type ImageData", kind) });
    }
    child(root, "ImageData").ok_or_else(|| wrong(root, "an element ImageData", "none"))
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
    fn of(image: Node<'_, '_>) -> Result<Self, ReadError> {
        let extent = extent(image, "WholeExtent")?;
        let spacing = numbers(image, "Spacing")?.map_or(DVec3::ONE, DVec3::from_array);
        // Row by row.
        let direction =
            numbers(image, "Direction")?.map_or(DMat3::IDENTITY, |d| DMat3::from_cols_array(&d).transpose());
        let axes = direction * DMat3::from_diagonal(spacing);
        let first = DVec3::from_array([0, 1, 2].map(|i| extent[i][0] as f64));
        let origin = numbers(image, "Origin")?.map_or(DVec3::ZERO, DVec3::from_array) + axes * first;
        lattice::check(origin, &axes, place(image), HINT)?;
        Ok(Self { points: extent.map(|[low, high]| (high - low + 1) as u64), origin, axes, place: place(image) })
    }
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

/// The array that is read, and whether it belongs to the cells; the others are named.
fn chosen<'a, 'i>(image: Node<'a, 'i>, notes: &mut Notes) -> Result<(Node<'a, 'i>, bool), ReadError> {
    let pieces: Vec<_> = image.children().filter(|c| c.has_tag_name("Piece")).collect();
    let &[piece] = pieces.as_slice() else {
        let hint = "write the image as one piece";
        return Err(ReadError { hint, ..wrong(image, "one Piece", &pieces.len().to_string()) });
    };
    if extent(piece, "Extent")? != extent(image, "WholeExtent")? {
        return Err(wrong(piece, "the WholeExtent in one Piece", piece.attribute("Extent").unwrap_or_default()));
    }
    let of = ["PointData", "CellData"].map(|name| child(piece, name));
    let array = of.into_iter().flatten().find_map(|data| {
        let arrays = || data.children().filter(|c| c.has_tag_name("DataArray"));
        let named = data.attribute("Scalars");
        let active = arrays().find(|a| named.is_some() && a.attribute("Name") == named);
        active.or_else(|| arrays().next()).map(|a| (a, data))
    });
    let (array, data) = array.ok_or_else(|| wrong(piece, "a DataArray in PointData or CellData", "none"))?;
    if let Some(named) = data.attribute("Scalars").filter(|name| Some(*name) != array.attribute("Name")) {
        let named = escaped(named.as_bytes(), 40);
        notes.remarks.push(format!("there is no array '{named}', which Scalars names: the first one is read"));
    }
    let others = image.document().descendants().filter(|n| n.has_tag_name("DataArray") && *n != array);
    let names: Vec<String> = others
        .map(|other| {
            let of = other.parent_element().map_or("", |of| of.tag_name().name());
            let name = other.attribute("Name").unwrap_or("an array without a name");
            if of == "PointData" { name.to_owned() } else { format!("{of}.{name}") }
        })
        .collect();
    notes.not_used(names.iter().map(String::as_bytes));
    Ok((array, data.has_tag_name("CellData")))
}

/// How an array over a lattice of these sizes is stored.
fn stored(
    array: Node<'_, '_>,
    dims: [u64; 3],
    big_endian: bool,
    params: &ReadParams,
    notes: &mut Notes,
) -> Result<Stored, ReadError> {
    let name = array.attribute("type").unwrap_or_default();
    let kind = match name {
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
    };
    let components = array.attribute("NumberOfComponents").unwrap_or("1");
    let components = components.parse().map_err(|_| wrong(array, "a number of components", components))?;
    let selection = Selection::of_frames(1, place(array), params, notes)?.with_numbers(
        (components, kind, false),
        place(array),
        notes,
    )?;
    Ok(Stored { kind, big_endian, dims, selection, scaling: (1.0, 0.0) })
}
