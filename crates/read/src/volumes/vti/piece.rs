//! One piece of an unstructured or structured grid or of polygonal data in XML: its points, its cells and the numbers of its arrays.

use super::data::Encoding;
use super::{Lattice, arrays, child, components, coordinates, extent, kind, place, sizes, wrong};
use crate::error::ReadError;
use crate::reading::Reading;
use crate::stream::input;
use crate::volumes::cells::{self, CellSource, Cells, Lists, Numbers};
use crate::volumes::selection::GHOSTS;
use crate::volumes::voxels::Kind;
use roxmltree::Node;
use splat_core::glam::DVec3;

/// Arrays of the faces of polyhedra: faces and where those of each cell end, up to version 9.3 of VTK; from there on the points of faces, where
/// each face ends among them, faces of cells, and where those of each cell end.
const FACES: [&str; 6] =
    ["faces", "faceoffsets", "face_connectivity", "face_offsets", "polyhedron_to_faces", "polyhedron_offsets"];

/// Elements of polygonal data with the attribute that says how many cells they have, and VTK's kind of those, in the order in which
/// values of cells count them.
const OF_POLYDATA: [(&str, &str, u8); 4] = [
    ("Verts", "NumberOfVerts", cells::VERTICES),
    ("Lines", "NumberOfLines", cells::LINES),
    ("Strips", "NumberOfStrips", cells::STRIPS),
    ("Polys", "NumberOfPolys", cells::POLYGONS),
];

/// A piece, how its arrays are stored, and how many points and cells it has.
pub(super) struct Piece<'e, 'a, 'i> {
    pub(super) node: Node<'a, 'i>,
    pub(super) encoding: &'e Encoding<'e>,
    /// The name of the file where a list names it.
    pub(super) file: Option<&'e str>,
    pub(super) points: u64,
    pub(super) cells: u64,
    /// Whether some of its cells enclose a volume.
    pub(super) has_bodies: bool,
}

impl<'a, 'i> Piece<'_, 'a, 'i> {
    /// A number of the piece, 0 where it does not say.
    fn count(&self, attribute: &str) -> Result<u64, ReadError> {
        let text = self.node.attribute(attribute).unwrap_or("0");
        text.trim().parse().map_err(|_| wrong(self.node, &format!("a whole number as {attribute}"), text))
    }

    /// All numbers of an array of so many tuples.
    pub(super) fn numbers(
        &self,
        array: Node<'_, '_>,
        tuples: u64,
        reading: &Reading<'_>,
    ) -> Result<Numbers, ReadError> {
        let count = components(array)?.checked_mul(tuples);
        let count = count.ok_or_else(|| wrong(array, "a number of values within the file", &tuples.to_string()))?;
        self.encoding.numbers(array, count, reading)
    }

    /// The array of that name in an element.
    fn array(&self, element: Node<'a, 'i>, name: &str) -> Result<Node<'a, 'i>, ReadError> {
        let array = arrays(element).find(|a| a.attribute("Name") == Some(name));
        array.ok_or_else(|| wrong(element, &format!("an array {name}"), "none"))
    }

    /// The cells, each of a kind that is read.
    pub(super) fn checked_cells(
        &self,
        used: &mut Vec<Node<'a, 'i>>,
        reading: &Reading<'_>,
    ) -> Result<Cells, ReadError> {
        let mut cells = self.cells(used, reading)?;
        let marks =
            child(self.node, "CellData").and_then(|data| arrays(data).find(|a| a.attribute("Name") == Some(GHOSTS)));
        if let Some(marks) = marks.filter(|marks| kind(*marks).is_ok_and(|kind| kind == Kind::U8)) {
            used.push(marks);
            cells.hide(&self.numbers(marks, cells.kinds.len() as u64, reading)?);
        }
        let of_points = child(self.node, "PointData").into_iter().flat_map(arrays);
        used.extend(of_points.filter(|a| a.attribute("Name") == Some(GHOSTS)));
        cells.check()?;
        Ok(cells)
    }

    /// The points of a piece, so many of them.
    fn points(&self, count: u64, used: &mut Vec<Node<'a, 'i>>, reading: &Reading<'_>) -> Result<Vec<DVec3>, ReadError> {
        let points = child(self.node, "Points").and_then(|points| arrays(points).next());
        let points = points.ok_or_else(|| wrong(self.node, "an element Points with a DataArray", "none"))?;
        if components(points)? != 3 {
            return Err(wrong(points, "3 components of points", &components(points)?.to_string()));
        }
        used.push(points);
        let numbers = self.numbers(points, count, reading)?;
        cells::places(&numbers, place(points), reading)
    }

    /// The points between indices of an image, of a rectilinear grid or of a structured grid, and the cells between them.
    fn structured(
        &self,
        dataset: Node<'_, '_>,
        used: &mut Vec<Node<'a, 'i>>,
        reading: &Reading<'_>,
    ) -> Result<Cells, ReadError> {
        let extent = extent(self.node, "Extent")?;
        let dims = sizes(extent);
        let count = dims.iter().try_fold(1u64, |n, size| n.checked_mul(*size)).filter(|n| *n <= u64::from(u32::MAX));
        let too_many =
            || wrong(self.node, "at most 4294967295 points", self.node.attribute("Extent").unwrap_or_default());
        let count = count.ok_or_else(too_many)?;
        if dataset.has_tag_name("StructuredGrid") {
            let points = self.points(count, used, reading)?;
            return Cells::structured(points, dims, place(self.node), reading);
        }
        // They are not in the file, whose arrays have as many numbers.
        input::check_packed(count, self.encoding.bytes(), "a file of VTK")?;
        input::hold("the points of a lattice", count * size_of::<DVec3>() as u64, reading.params)?;
        let mut points = Vec::new();
        input::reserve(&mut points, count as usize)?;
        if dataset.has_tag_name("ImageData") {
            let Lattice { origin, axes, .. } = Lattice::within(dataset, extent)?;
            let [nx, ny, nz] = dims;
            let rows = (0..nz).flat_map(|k| (0..ny).map(move |j| (j, k)));
            let places = rows.flat_map(|(j, k)| (0..nx).map(move |i| DVec3::new(i as f64, j as f64, k as f64)));
            points.extend(places.map(|place| origin + axes * place));
        } else {
            used.extend(child(self.node, "Coordinates").into_iter().flat_map(arrays));
            points.extend(coordinates(self.node, self.encoding, reading)?.points());
        }
        Cells::structured(points, dims, place(self.node), reading)
    }

    fn cells(&self, used: &mut Vec<Node<'a, 'i>>, reading: &Reading<'_>) -> Result<Cells, ReadError> {
        let dataset = self.node.parent_element();
        let is_of = |name: &&str| dataset.is_some_and(|dataset| dataset.has_tag_name(*name));
        if let Some(dataset) = dataset.filter(|_| ["ImageData", "RectilinearGrid", "StructuredGrid"].iter().any(is_of))
        {
            return self.structured(dataset, used, reading);
        }
        let points = self.points(self.count("NumberOfPoints")?, used, reading)?;
        let mut cells = Cells { points, lists: Lists::default(), kinds: Vec::new(), place: place(self.node) };
        if is_of(&"UnstructuredGrid") {
            let element = child(self.node, "Cells").ok_or_else(|| wrong(self.node, "an element Cells", "none"))?;
            let count = self.count("NumberOfCells")?;
            let types = self.array(element, "types")?;
            used.push(types);
            cells.place = place(element);
            cells.lists = self.lists(element, count, cells.points.len(), used, reading)?;
            cells.kinds = cells::kinds(&self.numbers(types, count, reading)?, place(types))?;
            self.faces(element, &mut cells, used, reading)?;
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
        Lists::ending(&ends, &corners, CellSource { points, kinds: &[], place: place(offsets) })
    }

    /// Adds the faces of the polyhedra among cells, as VTK writes them up to version 9.3 or as from 9.4.
    fn faces(
        &self,
        element: Node<'a, 'i>,
        cells: &mut Cells,
        used: &mut Vec<Node<'a, 'i>>,
        reading: &Reading<'_>,
    ) -> Result<(), ReadError> {
        let named = |name: &str| arrays(element).find(|a| a.attribute("Name") == Some(name));
        used.extend(FACES.iter().filter_map(|name| named(name)));
        if !cells.kinds.contains(&cells::POLYHEDRON) {
            return Ok(());
        }
        let count = cells.kinds.len() as u64;
        let polyhedra: Vec<usize> = (0..cells.kinds.len()).filter(|i| cells.kinds[*i] == cells::POLYHEDRON).collect();
        if named(FACES[0]).is_some() {
            let ends = self.numbers(self.array(element, FACES[1])?, count, reading)?;
            let array = self.array(element, FACES[0])?;
            let most = ends.iter().copied().fold(0.0, f64::max);
            let stream = self.numbers(array, most as u64, reading)?;
            cells::hold_faces(stream.len(), reading)?;
            let source = CellSource { points: cells.points.len(), kinds: &[], place: place(array) };
            let mut start = 0;
            for cell in polyhedra {
                let end = ends[cell] as usize;
                let part = stream.get(start..end).ok_or_else(|| {
                    let expected = format!("the faces of cell {cell} to end at {start} to {}", stream.len());
                    wrong(array, &expected, &ends[cell].to_string())
                })?;
                cells.lists.add_faces(cell, part, source)?;
                start = end;
            }
            return Ok(());
        }
        let [corners, ends, ranks, of_cells] =
            [FACES[2], FACES[3], FACES[4], FACES[5]].map(|name| self.array(element, name));
        let [corners, ends, ranks, of_cells] = [corners?, ends?, ranks?, of_cells?];
        let of_cells = self.numbers(of_cells, count, reading)?;
        let ranks = self.numbers(ranks, of_cells.last().map_or(0, |end| *end as u64), reading)?;
        let faces = ranks.iter().copied().fold(-1.0, f64::max) + 1.0;
        let place_of_ends = ends;
        let ends = self.numbers(ends, faces as u64, reading)?;
        let place_of_corners = place(corners);
        let corners = self.numbers(corners, ends.iter().copied().fold(0.0, f64::max) as u64, reading)?;
        cells::hold_faces(2 * corners.len() + ranks.len(), reading)?;
        let source = CellSource { points: cells.points.len(), kinds: &[], place: place_of_corners };
        let mut taken = 0;
        for cell in polyhedra {
            let start = cell.checked_sub(1).map_or(0, |before| of_cells[before] as usize);
            let of_cell = ranks.get(start..of_cells[cell] as usize).ok_or_else(|| {
                wrong(
                    element,
                    &format!("the faces of cell {cell} to end behind those before it"),
                    &of_cells[cell].to_string(),
                )
            })?;
            for rank in of_cell {
                let rank = *rank as usize;
                let first = rank.checked_sub(1).map_or(0, |before| ends[before] as usize);
                let face = corners.get(first..ends[rank] as usize).ok_or_else(|| {
                    wrong(
                        place_of_ends,
                        &format!("face {rank} to end behind the one before it"),
                        &ends[rank].to_string(),
                    )
                })?;
                // A face has a cell on either side, and no more.
                taken += face.len();
                if taken > 2 * corners.len() {
                    return Err(wrong(element, "faces of two polyhedra at most", "faces of more"));
                }
                cells.lists.add_face(cell, face, source)?;
            }
            cells.lists.end_faces(cell);
        }
        Ok(())
    }
}
