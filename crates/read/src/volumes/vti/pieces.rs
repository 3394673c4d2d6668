//! The pieces of an unstructured or structured grid or of polygonal data in XML, of one file or several → cells: points of one behind those of
//! the other, arrays joined by name.

use super::data::Encoding;
use super::extents;
use super::piece::Piece;
use super::{
    ChosenArray, HINT, arrays, child, chosen, components, extent, kind, name, not_used, offered, place, sizes,
    warn_of_part, wrong,
};
use crate::Loaded;
use crate::error::{Place, ReadError};
use crate::meshes::named_arrays::{NamedArrays, SurfaceArray};
use crate::reading::Reading;
use crate::volumes::cells::{self, Cells, Field, Numbers, PointColumns, structured};
use crate::volumes::selection::shown_column;
use crate::volumes::voxels::Kind;
use roxmltree::Node;
use splat_core::text::{counted, escaped};
use splat_core::{Association, MeshColumn};

/// A dataset of a file, and how its arrays are stored.
pub(super) struct Source<'e, 'a, 'i> {
    pub(super) dataset: Node<'a, 'i>,
    pub(super) encoding: &'e Encoding<'e>,
    /// The name of the file where a list names it.
    pub(super) file: Option<&'e str>,
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
    let cells = pieces.cells(sources, &mut used, reading)?;
    if !are_blocks && sources.iter().all(|source| source.dataset.has_tag_name("StructuredGrid")) {
        if let [source] = sources
            && let [piece] = pieces.list.as_slice()
        {
            warn_of_part(piece.node, source.dataset, reading)?;
        }
        extents::check_points(&extents::parts(sources, &[])?, &cells.points)?;
    }
    let dims = pieces.lattice(&cells)?;
    let mut field = Field::One;
    let mut columns = PointColumns::default();
    let has_bodies = cells.has_bodies();
    let is_volume = has_bodies && !reading.params.surfaces;
    if is_volume {
        if let Some(chosen) = pieces.chosen(reading)? {
            let array = chosen.array;
            let selection = chosen.selection(reading.params, &mut reading.notes)?;
            let numbers = pieces.joined(array, &mut used, reading)?;
            field = cells::field(&numbers, &selection, &name(array), !chosen.is_of_cells, place(array), reading)?;
        }
    } else {
        if let Some(array) = pieces.common(normals_of).filter(|_| !has_bodies) {
            columns.normal = cells::normals(&pieces.joined(array, &mut used, reading)?);
        }
        if let Some(array) = pieces.common(colors_of) {
            let numbers = pieces.joined(array, &mut used, reading)?;
            columns.color = cells::colors(&numbers, components(array)?, 255.0);
            columns.opacity = cells::opacities(&numbers, components(array)?, 255.0);
        }
        columns.named = pieces.named(&mut used, reading)?;
        if columns.color.is_empty() {
            reading.notes.shown_column = pieces.shown_column(has_bodies)?;
        }
    }
    let mut datasets: Vec<Node<'_, '_>> = sources.iter().map(|source| source.dataset).collect();
    datasets.dedup();
    datasets.iter().for_each(|dataset| not_used(*dataset, &used, &mut reading.notes));
    if is_volume
        && let Some(dims) = dims
        && let Some(grid) = structured::straight(&cells.points, dims, &field, reading)?
    {
        return Ok(Loaded::Grid(grid));
    }
    cells.loaded(field, columns, reading)
}

impl<'e, 'a, 'i> Pieces<'e, 'a, 'i> {
    /// The cells of all pieces of datasets, which are these from now on.
    fn cells(
        &mut self,
        sources: &[Source<'e, 'a, 'i>],
        used: &mut Vec<Node<'a, 'i>>,
        reading: &Reading<'_>,
    ) -> Result<Cells, ReadError> {
        let mut joined: Option<Cells> = None;
        for Source { dataset, encoding, file } in sources {
            for node in dataset.children().filter(|c| c.has_tag_name("Piece")) {
                reading.go_on()?;
                let mut piece = Piece { node, encoding, file: *file, points: 0, cells: 0, has_bodies: false };
                let cells = piece.checked_cells(used, reading).map_err(|e| in_file(*file, e))?;
                piece.points = cells.points.len() as u64;
                piece.cells = cells.kinds.len() as u64;
                piece.has_bodies = cells.has_bodies();
                self.list.push(piece);
                match &mut joined {
                    Some(joined) => joined.join(cells, reading)?,
                    None => joined = Some(cells),
                }
            }
        }
        joined.ok_or_else(|| {
            let none = ReadError::input(Place::File, "a Piece", "'none'", HINT);
            sources.first().map_or(none, |source| wrong(source.dataset, "a Piece", "none"))
        })
    }

    /// Points along each axis of a structured grid of one piece; `None` of others, and where some of its cells are left out.
    fn lattice(&self, cells: &Cells) -> Result<Option<[u64; 3]>, ReadError> {
        let [piece] = self.list.as_slice() else { return Ok(None) };
        let is_grid = piece.node.parent_element().is_some_and(|dataset| dataset.has_tag_name("StructuredGrid"));
        if is_grid && !cells.has_hidden() { extent(piece.node, "Extent").map(sizes).map(Some) } else { Ok(None) }
    }

    /// The array that is the field: of the first piece that has bodies and arrays, as what has none may have other ones.
    fn chosen(&self, reading: &mut Reading<'_>) -> Result<Option<ChosenArray<'a, 'i>>, ReadError> {
        let Some(first) = self.first_with_arrays(true) else { return Ok(None) };
        chosen(first.node, reading.params, &mut reading.notes).map_err(|e| in_file(first.file, e))
    }

    /// The column of a mesh that is shown where nobody names one.
    fn shown_column(&self, has_bodies: bool) -> Result<Option<String>, ReadError> {
        let Some(first) = self.first_with_arrays(has_bodies) else { return Ok(None) };
        let offered = offered(first.node).map_err(|e| in_file(first.file, e))?;
        Ok(shown_column(&offered.1, has_bodies))
    }

    /// The first piece that has arrays; with `has_bodies` of those with bodies.
    fn first_with_arrays(&self, has_bodies: bool) -> Option<&Piece<'e, 'a, 'i>> {
        let has_arrays = |name: &&str, piece: &Piece<'_, 'a, 'i>| {
            child(piece.node, name).is_some_and(|data| arrays(data).next().is_some())
        };
        let has_data =
            |piece: &&Piece<'_, 'a, 'i>| ["PointData", "CellData"].iter().any(|name| has_arrays(name, piece));
        self.list.iter().filter(|piece| piece.has_bodies || !has_bodies).find(has_data)
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
        let element = array.parent_element().map_or("", |data| data.tag_name().name());
        let each = components(array)?;
        let mut joined = Numbers::room(0, reading)?;
        for piece in &self.list {
            reading.go_on()?;
            let tuples = if element == "PointData" { piece.points } else { piece.cells };
            let same = |other: &Node<'_, '_>| other.attribute("Name") == array.attribute("Name");
            let is_here = array.ancestors().any(|around| around == piece.node);
            let named = || child(piece.node, element).and_then(|data| arrays(data).find(same));
            let found = if is_here { Some(array) } else { named() };
            let found = found.filter(|found| !self.are_blocks || is_alike(array, *found));
            let Some(found) = found else {
                if tuples == 0 {
                    continue;
                }
                if !self.are_blocks {
                    let hint = "write the dataset as one piece, or give all its pieces the same arrays";
                    let expected = format!("an array '{}' in {element}, which another Piece has", name(array));
                    let error = ReadError { hint, ..wrong(piece.node, &expected, "none") };
                    return Err(in_file(piece.file, error));
                }
                let gap = each.checked_mul(tuples);
                let gap = gap.ok_or_else(|| wrong(array, "a number of values within the file", &tuples.to_string()))?;
                joined.reserve(gap)?;
                joined.all.extend(std::iter::repeat_n(f64::NAN, gap as usize));
                continue;
            };
            used.push(found);
            if !is_alike(array, found) {
                let kind = array.attribute("type").unwrap_or_default();
                let expected =
                    format!("{} of type {kind}, as the array has in another Piece", counted(each, "component"));
                let other = format!("{} of {}", components(found)?, found.attribute("type").unwrap_or_default());
                return Err(in_file(piece.file, wrong(found, &expected, &other)));
            }
            let more = piece.numbers(found, tuples, reading).map_err(|e| in_file(piece.file, e))?;
            joined.reserve(more.len() as u64)?;
            joined.all.extend(&more.all);
        }
        Ok(joined)
    }
}

/// Whether two arrays have numbers of the same type, as many a tuple.
fn is_alike(array: Node<'_, '_>, other: Node<'_, '_>) -> bool {
    let numbers = |array: Node<'_, '_>| components(array).ok();
    array.attribute("type") == other.attribute("type") && numbers(array) == numbers(other)
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
