//! The pieces of an unstructured or structured grid or of polygonal data in XML, of one file or several → cells: points of one behind those of
//! the other, arrays joined by name.

use super::data::Encoding;
use super::{
    ChosenArray, HINT, Lattice, arrays, child, chosen, components, coordinates, extent, kind, name, not_used, place,
    sizes, wrong,
};
use crate::Loaded;
use crate::error::{Place, ReadError};
use crate::meshes::named_arrays::{NamedArrays, SurfaceArray};
use crate::reading::Reading;
use crate::stream::input;
use crate::volumes::cells::{self, CellSource, Cells, Field, Lists, Numbers, PointColumns, structured};
use crate::volumes::voxels::Kind;
use roxmltree::Node;
use splat_core::glam::DVec3;
use splat_core::text::{counted, escaped};
use splat_core::{Association, MeshColumn};

/// VTK's name of the array that marks copies and hidden cells.
const GHOSTS: &str = "vtkGhostType";

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

/// A dataset of a file, and how its arrays are stored.
pub(super) struct Source<'e, 'a, 'i> {
    pub(super) dataset: Node<'a, 'i>,
    pub(super) encoding: &'e Encoding<'e>,
    /// The name of the file where a list names it.
    pub(super) file: Option<&'e str>,
}

/// A piece, how its arrays are stored, and how many points and cells it has.
struct Piece<'e, 'a, 'i> {
    node: Node<'a, 'i>,
    encoding: &'e Encoding<'e>,
    file: Option<&'e str>,
    points: u64,
    cells: u64,
}

/// The pieces of a dataset.
struct Pieces<'e, 'a, 'i> {
    list: Vec<Piece<'e, 'a, 'i>>,
    /// Whether they are blocks, of which some may lack an array that others have.
    are_blocks: bool,
}

/// The error of a file that a list names.
pub(super) fn in_file(file: Option<&str>, error: ReadError) -> ReadError {
    let Some(file) = file else { return error };
    ReadError {
        expected: format!("the file '{}' of the list: {}", escaped(file.as_bytes(), 60), error.expected),
        ..error
    }
}

/// What the pieces of datasets are together: a volume, a mesh or points. Blocks need not have the same arrays.
pub(super) fn read(
    sources: &[Source<'_, '_, '_>],
    are_blocks: bool,
    reading: &mut Reading<'_>,
) -> Result<Loaded, ReadError> {
    let mut used = Vec::new();
    let mut pieces = Pieces { list: Vec::new(), are_blocks };
    let mut all: Option<Cells> = None;
    let mut dims = None;
    for Source { dataset, encoding, file } in sources {
        for node in dataset.children().filter(|c| c.has_tag_name("Piece")) {
            reading.go_on()?;
            let mut piece = Piece { node, encoding, file: *file, points: 0, cells: 0 };
            let cells = piece.checked_cells(&mut used, reading).map_err(|e| in_file(*file, e))?;
            (piece.points, piece.cells) = (cells.points.len() as u64, cells.kinds.len() as u64);
            let is_lattice = dataset.has_tag_name("StructuredGrid") && !cells.has_hidden();
            dims = if is_lattice && pieces.list.is_empty() { Some(sizes(extent(node, "Extent")?)) } else { None };
            pieces.list.push(piece);
            match &mut all {
                Some(all) => all.join(cells, reading)?,
                None => all = Some(cells),
            }
        }
    }
    let Some(cells) = all else {
        let none = ReadError::input(Place::File, "a Piece", "'none'", HINT);
        return Err(sources.first().map_or(none, |source| wrong(source.dataset, "a Piece", "none")));
    };
    let mut field = Field::One;
    let mut columns = PointColumns::default();
    if cells.has_bodies() {
        if let Some(chosen) = pieces.chosen(reading)? {
            let array = chosen.array;
            let selection = chosen.selection(reading.params, &mut reading.notes)?;
            let numbers = pieces.joined(array, &mut used, reading)?;
            field = cells::field(&numbers, &selection, &name(array), !chosen.is_of_cells, place(array), reading)?;
        }
    } else {
        if let Some(array) = pieces.common(normals_of) {
            columns.normal = cells::normals(&pieces.joined(array, &mut used, reading)?);
        }
        if let Some(array) = pieces.common(colors_of) {
            let numbers = pieces.joined(array, &mut used, reading)?;
            columns.color = cells::colors(&numbers, components(array)?, 255.0);
            columns.opacity = cells::opacities(&numbers, components(array)?, 255.0);
        }
        columns.named = pieces.named(&mut used, reading)?;
    }
    let mut datasets: Vec<Node<'_, '_>> = sources.iter().map(|source| source.dataset).collect();
    datasets.dedup();
    datasets.iter().for_each(|dataset| not_used(*dataset, &used, &mut reading.notes));
    if let Some(dims) = dims
        && let Some(grid) = structured::straight(&cells.points, dims, &field, reading)?
    {
        return Ok(Loaded::Grid(grid));
    }
    cells.loaded(field, columns, reading)
}

impl<'a, 'i> Pieces<'_, 'a, 'i> {
    /// The array that is the field: of the first piece that has one, as pieces without points or cells have none.
    fn chosen(&self, reading: &mut Reading<'_>) -> Result<Option<ChosenArray<'a, 'i>>, ReadError> {
        let has_data = |node: Node<'a, 'i>| {
            ["PointData", "CellData"]
                .iter()
                .any(|name| child(node, name).is_some_and(|data| arrays(data).next().is_some()))
        };
        let first = self.list.iter().find(|piece| has_data(piece.node));
        let Some(first) = first else { return Ok(None) };
        chosen(first.node, reading.params, &mut reading.notes).map_err(|e| in_file(first.file, e))
    }

    /// The array of the points of the first piece that has one, as `find` finds it; of blocks all that have points have to have such a one.
    fn common(&self, find: impl Fn(Node<'a, 'i>) -> Option<Node<'a, 'i>>) -> Option<Node<'a, 'i>> {
        let found = |piece: &Piece<'_, 'a, 'i>| child(piece.node, "PointData").and_then(&find);
        let first = self.list.iter().find_map(found)?;
        let mut with_points = self.list.iter().filter(|piece| self.are_blocks && piece.points > 0);
        with_points.all(|piece| found(piece).is_some_and(|other| is_alike(first, other))).then_some(first)
    }

    /// Columns of points and of cells that are asked for; those that could be are used.
    fn named(&self, used: &mut Vec<Node<'a, 'i>>, reading: &mut Reading<'_>) -> Result<Vec<MeshColumn>, ReadError> {
        let pieces = &self.list;
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
                let numbers = if named.needs(&surface) { Some(self.joined(array, used, reading)?) } else { None };
                named.take(&surface, numbers.as_deref());
                let same = |other: &Node<'_, '_>| other.attribute("Name") == Some(name);
                let data = pieces.iter().filter_map(|piece| child(piece.node, element));
                used.extend(data.flat_map(|data| arrays(data).filter(same).collect::<Vec<_>>()));
            }
        }
        Ok(named.finish(&mut reading.notes))
    }

    /// The numbers of an array of one piece, and before and behind them those of the arrays of its name in the others.
    fn joined(
        &self,
        array: Node<'a, 'i>,
        used: &mut Vec<Node<'a, 'i>>,
        reading: &Reading<'_>,
    ) -> Result<Numbers, ReadError> {
        let of = array.parent_element().map_or("", |data| data.tag_name().name());
        let mut all = Numbers::room(0, reading)?;
        for piece in &self.list {
            reading.go_on()?;
            let tuples = if of == "PointData" { piece.points } else { piece.cells };
            let same = |other: &Node<'_, '_>| other.attribute("Name") == array.attribute("Name");
            let is_here = array.ancestors().any(|around| around == piece.node);
            let own =
                if is_here { Some(array) } else { child(piece.node, of).and_then(|data| arrays(data).find(same)) };
            let own = own.filter(|own| !self.are_blocks || is_alike(array, *own));
            let Some(own) = own else {
                if tuples == 0 {
                    continue;
                }
                if self.are_blocks {
                    let gap = components(array)?.checked_mul(tuples);
                    let gap =
                        gap.ok_or_else(|| wrong(array, "a number of values within the file", &tuples.to_string()))?;
                    all.reserve(gap)?;
                    all.all.extend(std::iter::repeat_n(f64::NAN, gap as usize));
                    continue;
                }
                let hint = "write the dataset as one piece, or give all its pieces the same arrays";
                let expected = format!("an array '{}' in {of}, which another Piece has", name(array));
                return Err(ReadError { hint, ..wrong(piece.node, &expected, "none") });
            };
            used.push(own);
            let numbers = components(array)?;
            if !is_alike(array, own) {
                let kind = array.attribute("type").unwrap_or_default();
                let expected =
                    format!("{} of type {kind}, as the array has in another Piece", counted(numbers, "component"));
                let found = format!("{} of {}", components(own)?, own.attribute("type").unwrap_or_default());
                return Err(wrong(own, &expected, &found));
            }
            let more = piece.numbers(own, tuples, reading).map_err(|e| in_file(piece.file, e))?;
            all.reserve(more.len() as u64)?;
            all.all.extend(&more.all);
        }
        Ok(all)
    }
}

/// Whether two arrays have numbers of the same type, as many a tuple.
fn is_alike(array: Node<'_, '_>, other: Node<'_, '_>) -> bool {
    ["type", "NumberOfComponents"].iter().all(|name| array.attribute(*name) == other.attribute(*name))
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

    /// The cells, each of a kind that is read.
    fn checked_cells(&self, used: &mut Vec<Node<'a, 'i>>, reading: &Reading<'_>) -> Result<Cells, ReadError> {
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
    fn points(
        &self,
        count: u64,
        used: &mut Vec<Node<'a, 'i>>,
        reading: &Reading<'_>,
    ) -> Result<(Vec<DVec3>, Place), ReadError> {
        let points = child(self.node, "Points").and_then(|points| arrays(points).next());
        let points = points.ok_or_else(|| wrong(self.node, "an element Points with a DataArray", "none"))?;
        if components(points)? != 3 {
            return Err(wrong(points, "3 components of points", &components(points)?.to_string()));
        }
        used.push(points);
        let numbers = self.numbers(points, count, reading)?;
        Ok((cells::places(&numbers, place(points), reading)?, place(points)))
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
            let (points, _) = self.points(count, used, reading)?;
            return Cells::structured(points, dims, place(self.node), reading);
        }
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
        if let Some(dataset) =
            dataset.filter(|_| ["ImageData", "RectilinearGrid", "StructuredGrid"].iter().any(|n| is_of(n)))
        {
            return self.structured(dataset, used, reading);
        }
        let (points, _) = self.points(self.count("NumberOfPoints")?, used, reading)?;
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
