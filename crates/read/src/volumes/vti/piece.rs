//! The pieces of an unstructured grid or of polygonal data in XML → cells: points of one behind those of the other, arrays joined by name.

use super::data::Encoding;
use super::{arrays, child, chosen, components, kind, name, not_used, place, selection, wrong};
use crate::Loaded;
use crate::error::ReadError;
use crate::meshes::named_arrays::{NamedArrays, SurfaceArray};
use crate::reading::Reading;
use crate::volumes::cells::{self, Cells, Field, Lists, Numbers, PointColumns};
use crate::volumes::voxels::Kind;
use roxmltree::Node;
use splat_core::text::counted;
use splat_core::{Association, MeshColumn};

/// Elements of polygonal data with the attribute that says how many cells they have, and VTK's kind of those, in the order in which
/// values of cells count them.
const OF_POLYDATA: [(&str, &str, u8); 4] = [
    ("Verts", "NumberOfVerts", cells::VERTICES),
    ("Lines", "NumberOfLines", cells::LINES),
    ("Strips", "NumberOfStrips", cells::STRIPS),
    ("Polys", "NumberOfPolys", cells::POLYGONS),
];

/// A piece, how its arrays are stored, and how many points and cells it has.
struct Piece<'e, 'a, 'i> {
    node: Node<'a, 'i>,
    encoding: &'e Encoding<'e>,
    points: u64,
    cells: u64,
}

/// What the pieces of a dataset are together: a volume, a mesh or points.
pub(super) fn read(
    dataset: Node<'_, '_>,
    encoding: &Encoding<'_>,
    reading: &mut Reading<'_>,
) -> Result<Loaded, ReadError> {
    let mut used = Vec::new();
    let mut pieces = Vec::new();
    let mut all: Option<Cells> = None;
    for node in dataset.children().filter(|c| c.has_tag_name("Piece")) {
        reading.go_on()?;
        let mut piece = Piece { node, encoding, points: 0, cells: 0 };
        let cells = piece.cells(&mut used, reading)?;
        cells.check()?;
        (piece.points, piece.cells) = (cells.points.len() as u64, cells.kinds.len() as u64);
        pieces.push(piece);
        match &mut all {
            Some(all) => all.join(cells, reading)?,
            None => all = Some(cells),
        }
    }
    let cells = all.ok_or_else(|| wrong(dataset, "a Piece", "none"))?;
    let mut field = Field::One;
    let mut columns = PointColumns::default();
    if cells.has_bodies() {
        // Pieces without points or cells have no arrays.
        let mut found = None;
        for piece in &pieces {
            if found.is_none() && child(piece.node, "PointData").or(child(piece.node, "CellData")).is_some() {
                found = chosen(piece.node, reading.params, &mut reading.notes)?;
            }
        }
        if let Some((array, of_cells)) = found {
            let selection = selection(array, reading.params, &mut reading.notes)?;
            let numbers = joined(&pieces, array, &mut used, reading)?;
            let told = (name(array), !of_cells);
            field = cells::field(&numbers, &selection, &told.0, told.1, place(array), reading)?;
        }
    } else {
        let data = || pieces.iter().filter_map(|piece| child(piece.node, "PointData"));
        if let Some(array) = data().find_map(normals_of) {
            columns.normal = cells::normals(&joined(&pieces, array, &mut used, reading)?);
        }
        if let Some(array) = data().find_map(colors_of) {
            let numbers = joined(&pieces, array, &mut used, reading)?;
            columns.color = cells::colors(&numbers, components(array)?, 255.0);
            columns.opacity = cells::opacities(&numbers, components(array)?, 255.0);
        }
        columns.named = named(&pieces, &mut used, reading)?;
    }
    not_used(dataset, &used, &mut reading.notes);
    cells.loaded(field, columns, reading)
}

/// Columns of points and of cells that are asked for; those that could be are used.
fn named<'a, 'i>(
    pieces: &[Piece<'_, 'a, 'i>],
    used: &mut Vec<Node<'a, 'i>>,
    reading: &mut Reading<'_>,
) -> Result<Vec<MeshColumn>, ReadError> {
    let mut named = NamedArrays::new(reading.params);
    for (element, association) in [("PointData", Association::Vertex), ("CellData", Association::Triangle)] {
        let Some(data) = pieces.iter().find_map(|piece| child(piece.node, element)) else { continue };
        for array in arrays(data).filter(|array| kind(*array).is_ok()) {
            if used.contains(&array) {
                continue;
            }
            let name = array.attribute("Name").unwrap_or_default();
            let surface = SurfaceArray { name, association, numbers: components(array)? };
            if name.is_empty() || !surface.is_offered() {
                continue;
            }
            let numbers = if named.needs(&surface) { Some(joined(pieces, array, used, reading)?) } else { None };
            named.take(&surface, numbers.as_deref());
            let same = |other: &Node<'_, '_>| other.attribute("Name") == Some(name);
            let data = pieces.iter().filter_map(|piece| child(piece.node, element));
            used.extend(data.flat_map(|data| arrays(data).filter(same).collect::<Vec<_>>()));
        }
    }
    Ok(named.finish(&mut reading.notes))
}

/// The numbers of an array of one piece, and before and behind them those of the arrays of its name in the others.
fn joined<'a, 'i>(
    pieces: &[Piece<'_, 'a, 'i>],
    array: Node<'a, 'i>,
    used: &mut Vec<Node<'a, 'i>>,
    reading: &Reading<'_>,
) -> Result<Numbers, ReadError> {
    let of = array.parent_element().map_or("", |data| data.tag_name().name());
    let mut all = Numbers::room(0, reading)?;
    for piece in pieces {
        reading.go_on()?;
        let tuples = if of == "PointData" { piece.points } else { piece.cells };
        let same = |other: &Node<'_, '_>| other.attribute("Name") == array.attribute("Name");
        let is_here = array.ancestors().any(|around| around == piece.node);
        let own = if is_here { Some(array) } else { child(piece.node, of).and_then(|data| arrays(data).find(same)) };
        let Some(own) = own else {
            if tuples == 0 {
                continue;
            }
            let hint = "write the dataset as one piece, or give all its pieces the same arrays";
            let expected = format!("an array '{}' in {of}, which another Piece has", name(array));
            return Err(ReadError { hint, ..wrong(piece.node, &expected, "none") });
        };
        used.push(own);
        let numbers = components(array)?;
        if own.attribute("type") != array.attribute("type") || components(own)? != numbers {
            let kind = array.attribute("type").unwrap_or_default();
            let expected =
                format!("{} of type {kind}, as the array has in another Piece", counted(numbers, "component"));
            let found = format!("{} of {}", components(own)?, own.attribute("type").unwrap_or_default());
            return Err(wrong(own, &expected, &found));
        }
        let more = piece.numbers(own, tuples, reading)?;
        all.reserve(more.len() as u64)?;
        all.all.extend(&more.all);
    }
    Ok(all)
}

/// The array that points take their normals from: the one that the file calls so.
fn normals_of<'a, 'i>(data: Node<'a, 'i>) -> Option<Node<'a, 'i>> {
    arrays(data).find(|a| is_named(data, "Normals", a) && a.attribute("NumberOfComponents") == Some("3"))
}

/// The array that points take their colours from: the one that the file shows, else the first that can be.
fn colors_of<'a, 'i>(data: Node<'a, 'i>) -> Option<Node<'a, 'i>> {
    let is_color = |a: &Node<'_, '_>| {
        let is_of_bytes = kind(*a).is_ok_and(|kind| kind == Kind::U8);
        is_of_bytes && matches!(a.attribute("NumberOfComponents"), Some("3" | "4"))
    };
    let mut colors = arrays(data).filter(is_color);
    colors.clone().find(|a| is_named(data, "Scalars", a)).or_else(|| colors.next())
}

/// Whether an attribute of all arrays names this one.
fn is_named(data: Node<'_, '_>, attribute: &str, array: &Node<'_, '_>) -> bool {
    let named = data.attribute(attribute);
    named.is_some() && array.attribute("Name") == named
}

impl<'a, 'i> Piece<'_, 'a, 'i> {
    /// A number of the piece, 0 where it does not say.
    fn count(&self, attribute: &str) -> Result<u64, ReadError> {
        let text = self.node.attribute(attribute).unwrap_or("0");
        text.trim().parse().map_err(|_| wrong(self.node, &format!("a whole number as {attribute}"), text))
    }

    /// All numbers of an array of so many tuples.
    fn numbers(&self, array: Node<'_, '_>, tuples: u64, reading: &Reading<'_>) -> Result<Numbers, ReadError> {
        let count = components(array)?.checked_mul(tuples);
        let count = count.ok_or_else(|| wrong(array, "a number of values within the file", &tuples.to_string()))?;
        self.encoding.numbers(array, count, reading)
    }

    /// The array of that name in an element.
    fn array(&self, element: Node<'a, 'i>, name: &str) -> Result<Node<'a, 'i>, ReadError> {
        let array = arrays(element).find(|a| a.attribute("Name") == Some(name));
        array.ok_or_else(|| wrong(element, &format!("an array {name}"), "none"))
    }

    fn cells(&self, used: &mut Vec<Node<'a, 'i>>, reading: &Reading<'_>) -> Result<Cells, ReadError> {
        let points = child(self.node, "Points").and_then(|points| arrays(points).next());
        let points = points.ok_or_else(|| wrong(self.node, "an element Points with a DataArray", "none"))?;
        if components(points)? != 3 {
            return Err(wrong(points, "3 components of points", &components(points)?.to_string()));
        }
        used.push(points);
        let numbers = self.numbers(points, self.count("NumberOfPoints")?, reading)?;
        let places = cells::places(&numbers, place(points), reading)?;
        drop(numbers);
        let mut cells = Cells { points: places, lists: Lists::default(), kinds: Vec::new(), place: place(self.node) };
        if self.node.parent_element().is_some_and(|dataset| dataset.has_tag_name("UnstructuredGrid")) {
            let element = child(self.node, "Cells").ok_or_else(|| wrong(self.node, "an element Cells", "none"))?;
            let count = self.count("NumberOfCells")?;
            let types = self.array(element, "types")?;
            used.push(types);
            cells.place = place(element);
            cells.lists = self.lists(element, count, cells.points.len(), used, reading)?;
            cells.kinds = cells::kinds(&self.numbers(types, count, reading)?, place(types))?;
            return Ok(cells);
        }
        for (name, attribute, kind) in OF_POLYDATA {
            let count = self.count(attribute)?;
            let element = child(self.node, name);
            if count == 0 {
                // What says that there are none is used.
                used.extend(element.into_iter().flat_map(arrays));
            } else {
                let element = element.ok_or_else(|| wrong(self.node, &format!("an element {name}"), "none"))?;
                let lists = self.lists(element, count, cells.points.len(), used, reading)?;
                cells.append(&lists, kind);
            }
        }
        Ok(cells)
    }

    /// So many cells of an element: where each ends, and the points of all.
    fn lists(
        &self,
        element: Node<'a, 'i>,
        cells: u64,
        points: usize,
        used: &mut Vec<Node<'a, 'i>>,
        reading: &Reading<'_>,
    ) -> Result<Lists, ReadError> {
        let [offsets, connectivity] = [self.array(element, "offsets")?, self.array(element, "connectivity")?];
        used.extend([offsets, connectivity]);
        let ends = self.numbers(offsets, cells, reading)?;
        // A negative one is 0 here, and refused as an end.
        let count = ends.last().map_or(0, |end| *end as u64);
        let corners = self.numbers(connectivity, count, reading)?;
        cells::hold_lists(ends.len(), corners.len(), reading)?;
        Lists::ending(&ends, &corners, points, place(offsets))
    }
}
