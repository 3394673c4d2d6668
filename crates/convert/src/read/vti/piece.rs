//! The piece of an unstructured grid or of polygonal data in XML → cells.

use super::data::Encoding;
use super::{arrays, child, chosen, components, kind, name, not_used, place, selection, wrong};
use crate::error::ReadError;
use crate::read::Loaded;
use crate::read::cells::{self, Cells, Field, Lists, PointColumns};
use crate::read::reading::Reading;
use crate::read::voxels::Kind;
use roxmltree::Node;

/// Elements of polygonal data with the attribute that says how many cells they have, and VTK's kind of those, in the order in which
/// values of cells count them.
const OF_POLYDATA: [(&str, &str, u8); 4] = [
    ("Verts", "NumberOfVerts", cells::VERTICES),
    ("Lines", "NumberOfLines", cells::LINES),
    ("Strips", "NumberOfStrips", cells::STRIPS),
    ("Polys", "NumberOfPolys", cells::POLYGONS),
];

/// A piece, and how its arrays are stored.
struct Piece<'e, 'a, 'i> {
    node: Node<'a, 'i>,
    encoding: &'e Encoding<'e>,
}

/// What a piece is: a volume, a mesh or points.
pub(super) fn read(
    node: Node<'_, '_>,
    encoding: &Encoding<'_>,
    reading: &mut Reading<'_>,
) -> Result<Loaded, ReadError> {
    let piece = Piece { node, encoding };
    let mut used = Vec::new();
    let cells = piece.cells(&mut used, reading)?;
    cells.check()?;
    let (mut field, mut columns) = (Field::One, PointColumns::default());
    if cells.has_bodies() {
        if let Some((array, of_cells)) = chosen(node, &mut reading.notes) {
            used.push(array);
            field = piece.field((array, !of_cells), &cells, reading)?;
        }
    } else if let Some(data) = child(node, "PointData") {
        columns = piece.columns(data, &cells, &mut used, reading)?;
    }
    not_used(node, &used, &mut reading.notes);
    cells.loaded(field, columns, reading)
}

impl<'a, 'i> Piece<'_, 'a, 'i> {
    /// A number of the piece, 0 where it does not say.
    fn count(&self, attribute: &str) -> Result<u64, ReadError> {
        let text = self.node.attribute(attribute).unwrap_or("0");
        text.trim().parse().map_err(|_| wrong(self.node, &format!("a whole number as {attribute}"), text))
    }

    /// All numbers of an array of so many tuples.
    fn numbers(&self, array: Node<'_, '_>, tuples: u64, reading: &Reading<'_>) -> Result<Vec<f64>, ReadError> {
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
        let places = cells::places(&self.numbers(points, self.count("NumberOfPoints")?, reading)?, place(points))?;
        let mut cells = Cells { points: places, lists: Lists::default(), kinds: Vec::new(), place: place(self.node) };
        if self.node.parent_element().is_some_and(|dataset| dataset.has_tag_name("UnstructuredGrid")) {
            let element = child(self.node, "Cells").ok_or_else(|| wrong(self.node, "an element Cells", "none"))?;
            let (count, types) = (self.count("NumberOfCells")?, self.array(element, "types")?);
            used.push(types);
            cells.place = place(element);
            cells.lists = self.lists(element, count, cells.points.len(), used, reading)?;
            cells.kinds = cells::kinds(&self.numbers(types, count, reading)?, place(types))?;
            return Ok(cells);
        }
        for (name, attribute, kind) in OF_POLYDATA {
            let (count, element) = (self.count(attribute)?, child(self.node, name));
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
        Lists::ending(&ends, &corners, points, place(offsets))
    }

    /// The field that an array of the points or of the cells is, of colours their luma.
    fn field(
        &self,
        (array, of_points): (Node<'_, '_>, bool),
        cells: &Cells,
        reading: &mut Reading<'_>,
    ) -> Result<Field, ReadError> {
        let selection = selection(array, reading.params, &mut reading.notes)?;
        let count = if of_points { cells.points.len() } else { cells.kinds.len() };
        let numbers = self.numbers(array, count as u64, reading)?;
        cells::field((&numbers, &selection), (&name(array), of_points), place(array), &mut reading.notes)
    }

    /// Normals and colours of the points: the arrays that the file calls so, else the first that can be.
    fn columns(
        &self,
        data: Node<'a, 'i>,
        cells: &Cells,
        used: &mut Vec<Node<'a, 'i>>,
        reading: &Reading<'_>,
    ) -> Result<PointColumns, ReadError> {
        let named = |attribute: &str, array: &Node<'_, '_>| {
            let named = data.attribute(attribute);
            named.is_some() && array.attribute("Name") == named
        };
        let points = cells.points.len() as u64;
        let mut columns = PointColumns::default();
        let normals = arrays(data).find(|a| named("Normals", a) && a.attribute("NumberOfComponents") == Some("3"));
        if let Some(array) = normals {
            used.push(array);
            columns.normal = cells::normals(&self.numbers(array, points, reading)?);
        }
        let is_color = |a: &Node<'_, '_>| {
            let is_of_bytes = kind(*a).is_ok_and(|kind| kind == Kind::U8);
            is_of_bytes && matches!(a.attribute("NumberOfComponents"), Some("3" | "4"))
        };
        let colors = arrays(data).filter(is_color);
        if let Some(array) = colors.clone().find(|a| named("Scalars", a)).or_else(|| colors.clone().next()) {
            used.push(array);
            columns.color = cells::colors(&self.numbers(array, points, reading)?, components(array)?, 255.0);
        }
        Ok(columns)
    }
}
