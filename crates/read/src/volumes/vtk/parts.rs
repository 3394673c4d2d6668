//! Cells and polygons of legacy VTK files: `POINTS` with `CELLS` and `CELL_TYPES`, or with `VERTICES`, `LINES`, `POLYGONS` and
//! `TRIANGLE_STRIPS`; cells as up to version 4, with counts between their points, and as from version 5, by their ends.

use super::arrays::{Array, Arrays, Owner, Part, kind, whole};
use super::{Dataset, HINT, next, wrong};
use crate::Loaded;
use crate::error::{Place, ReadError};
use crate::meshes::named_arrays::{NamedArrays, SurfaceArray};
use crate::reading::Reading;
use crate::text::{Line, Lines, Word};
use crate::volumes::cells::{self, CellSource, Cells, Field, Lists, Numbers, PointColumns, structured};
use crate::volumes::selection::Selection;
use crate::volumes::voxels::Kind;
use splat_core::text::escaped;
use splat_core::{Association, MeshColumn};

/// Parts of polygonal data and VTK's kinds of their cells, in the order in which values of cells count them.
const OF_POLYDATA: [(&str, u8); 4] = [
    ("VERTICES", cells::VERTICES),
    ("LINES", cells::LINES),
    ("POLYGONS", cells::POLYGONS),
    ("TRIANGLE_STRIPS", cells::STRIPS),
];

/// Names of the arrays of cells that are told by their ends.
const BY_ENDS: [&str; 2] = ["OFFSETS", "CONNECTIVITY"];

/// Whether a line announces an array of the cells themselves, which is passed over.
pub(super) fn take<'a>(line: Line<'a>, lines: &mut Lines<'a>, arrays: &mut Arrays<'a>) -> Result<bool, ReadError> {
    let words: Vec<Word<'_>> = line.words(false).collect();
    let keyword = words.first().map(|w| w.text.to_ascii_uppercase()).unwrap_or_default();
    match keyword.as_slice() {
        b"POINTS" => {
            let tuples = whole(words.get(1), line)?;
            let kind = kind(words.get(2), line)?;
            arrays.take_part(line, Part { name: "POINTS", kind, numbers: 3, tuples, cells: 0 }, lines)?;
        }
        b"CELL_TYPES" => {
            let tuples = whole(words.get(1), line)?;
            arrays.take_part(
                line,
                Part { name: "CELL_TYPES", kind: Kind::I32, numbers: 1, tuples, cells: 0 },
                lines,
            )?;
        }
        name => {
            let all = ["CELLS"].into_iter().chain(OF_POLYDATA.map(|part| part.0));
            let Some(name) = all.into_iter().find(|part| part.as_bytes() == name) else { return Ok(false) };
            let sizes = [whole(words.get(1), line)?, whole(words.get(2), line)?];
            take_cells(name, line, sizes, lines, arrays)?;
        }
    }
    Ok(true)
}

/// Takes cells: their number and how many numbers tell of them, or how many ends and how many points.
fn take_cells<'a>(
    name: &str,
    line: Line<'a>,
    sizes: [u64; 2],
    lines: &mut Lines<'a>,
    arrays: &mut Arrays<'a>,
) -> Result<(), ReadError> {
    if !arrays.continues_with(BY_ENDS[0], lines) {
        let part = Part { name, kind: Kind::I32, numbers: 1, tuples: sizes[1], cells: sizes[0] };
        return arrays.take_part(line, part, lines);
    }
    for (part, size) in BY_ENDS.iter().zip(sizes) {
        let Some(line) = next(lines)? else {
            return Err(ReadError::input(lines.end(), *part, "the end of the file", HINT));
        };
        let words: Vec<Word<'_>> = line.words(false).collect();
        if !words.first().is_some_and(|w| w.text.eq_ignore_ascii_case(part.as_bytes())) {
            return Err(wrong(line, part));
        }
        let name = format!("{name}.{part}");
        let part = Part { name: &name, kind: kind(words.get(1), line)?, numbers: 1, tuples: size, cells: 0 };
        arrays.take_part(line, part, lines)?;
    }
    Ok(())
}

/// The arrays of a file, and how to read them.
pub(super) struct Source<'a> {
    pub(super) content: &'a [u8],
    pub(super) is_binary: bool,
    pub(super) arrays: &'a Arrays<'a>,
    /// Points along each axis of a structured grid.
    pub(super) dims: Option<[u64; 3]>,
    /// Where the file ends.
    pub(super) end: Place,
}

/// What the arrays of a file are: a volume, a mesh or points.
pub(super) fn read(source: &Source<'_>, dataset: Dataset, reading: &mut Reading<'_>) -> Result<Loaded, ReadError> {
    let arrays = source.arrays;
    let cells = source.cells(dataset, reading)?;
    cells.check()?;
    let mut field = Field::One;
    let mut columns = PointColumns::default();
    let mut used = Vec::new();
    let has_bodies = cells.has_bodies();
    let is_volume = has_bodies && !reading.params.surfaces;
    if is_volume {
        if let Some((array, value)) = arrays.chosen(reading.params, &mut reading.notes)? {
            used.push(array.place);
            let selection = array.selection(value, array.place, reading.params, &mut reading.notes)?;
            field = source.field(array, &selection, &cells, reading)?;
        }
    } else {
        if let Some(array) = arrays.normals().filter(|_| !has_bodies) {
            used.push(array.place);
            columns.normal = cells::normals(&source.of_points(array, &cells, reading)?);
        }
        if let Some(array) = arrays.colors() {
            used.push(array.place);
            let top = if source.is_of_shares(array) { 1.0 } else { 255.0 };
            let numbers = source.of_points(array, &cells, reading)?;
            columns.color = cells::colors(&numbers, array.numbers, top);
            columns.opacity = cells::opacities(&numbers, array.numbers, top);
        }
        columns.named = source.named(&cells, &mut used, reading)?;
        if columns.color.is_empty() {
            reading.notes.shown_column = arrays.shown_column(has_bodies);
        }
    }
    reading.notes.not_used(arrays.all().filter(|a| !used.contains(&a.place)).map(|a| a.name.as_bytes()));
    if is_volume
        && let Some(dims) = source.dims
        && let Some(grid) = structured::straight(&cells.points, dims, &field, reading)?
    {
        return Ok(Loaded::Grid(grid));
    }
    cells.loaded(field, columns, reading)
}

impl Source<'_> {
    fn numbers(&self, array: &Array, reading: &Reading<'_>) -> Result<Numbers, ReadError> {
        array.read(self.content, self.is_binary, reading)
    }

    /// The array of that name, which has to be there.
    fn needed(&self, name: &str) -> Result<&Array, ReadError> {
        self.arrays.part(name).ok_or_else(|| ReadError::input(self.end, name, "the end of the file", HINT))
    }

    fn cells(&self, dataset: Dataset, reading: &Reading<'_>) -> Result<Cells, ReadError> {
        let array = self.needed("POINTS")?;
        let points = cells::places(&self.numbers(array, reading)?, array.place, reading)?;
        if let Some(dims) = self.dims {
            return Cells::structured(points, dims, array.place, reading);
        }
        let mut cells = Cells { points, lists: Lists::default(), kinds: Vec::new(), place: array.place };
        if dataset == Dataset::UnstructuredGrid {
            let types = self.needed("CELL_TYPES")?;
            cells.kinds = cells::kinds(&self.numbers(types, reading)?, types.place)?;
            let lists = self.lists("CELLS", cells.points.len(), &cells.kinds, reading)?;
            (cells.lists, cells.place) =
                lists.ok_or_else(|| ReadError::input(self.end, "CELLS", "the end of the file", HINT))?;
            return Ok(cells);
        }
        for (name, kind) in OF_POLYDATA {
            if let Some((lists, place)) = self.lists(name, cells.points.len(), &[], reading)? {
                cells.append(&lists, kind);
                cells.place = place;
            }
        }
        Ok(cells)
    }

    /// The cells of a part, if the file has it, and where they are told of; `kinds` are theirs where some may be polyhedra.
    fn lists(
        &self,
        name: &str,
        points: usize,
        kinds: &[u8],
        reading: &Reading<'_>,
    ) -> Result<Option<(Lists, Place)>, ReadError> {
        let hold = |cells: usize, numbers: usize| {
            if kinds.contains(&cells::POLYHEDRON) {
                cells::hold_faces(numbers, reading)?;
            }
            cells::hold_lists(cells, numbers, reading)
        };
        if let Some(array) = self.arrays.part(name) {
            let numbers = self.numbers(array, reading)?;
            hold(array.cells as usize, numbers.len())?;
            let source = CellSource { points, kinds, place: array.place };
            return Ok(Some((Lists::counted(&numbers, array.cells, source)?, array.place)));
        }
        let [ends, corners] = BY_ENDS.map(|part| self.arrays.part(&format!("{name}.{part}")));
        let Some((ends, corners)) = ends.zip(corners) else { return Ok(None) };
        let numbers = self.numbers(ends, reading)?;
        // The first of them is where the first cell begins.
        let Some((0.0, rest)) = numbers.split_first().map(|(first, rest)| (*first, rest)) else {
            return match numbers.first() {
                None => Ok(Some((Lists::default(), ends.place))),
                Some(first) => Err(ReadError::input(ends.place, "OFFSETS from 0", first.to_string(), HINT)),
            };
        };
        let of_cells = self.numbers(corners, reading)?;
        hold(rest.len(), of_cells.len())?;
        let lists = Lists::ending(rest, &of_cells, CellSource { points, kinds, place: corners.place })?;
        Ok(Some((lists, corners.place)))
    }

    /// Columns of points and of cells that are asked for; those that could be are used.
    fn named(
        &self,
        cells: &Cells,
        used: &mut Vec<Place>,
        reading: &mut Reading<'_>,
    ) -> Result<Vec<MeshColumn>, ReadError> {
        let mut named = NamedArrays::new(reading.params);
        for element in [Owner::Points, Owner::Cells] {
            let (association, count) = match element {
                Owner::Points => (Association::Vertex, cells.points.len()),
                Owner::Cells | Owner::File => (Association::Triangle, cells.kinds.len()),
            };
            let arrays = self.arrays.all().filter(|array| array.owner == element && array.tuples == count as u64);
            for array in arrays.filter(|array| !used.contains(&array.place)).collect::<Vec<_>>() {
                let surface = SurfaceArray { name: &array.name, association, numbers: array.numbers };
                if !surface.is_offered() {
                    continue;
                }
                used.push(array.place);
                let is_needed = named.needs(&surface);
                let numbers = if is_needed { Some(self.numbers(array, reading)?) } else { None };
                named.take(&surface, numbers.as_deref());
            }
        }
        Ok(named.finish(&mut reading.notes))
    }

    /// The numbers of an array that has as many tuples as there are points.
    fn of_points(&self, array: &Array, cells: &Cells, reading: &Reading<'_>) -> Result<Numbers, ReadError> {
        cells::check_count(array.tuples, cells.points.len(), "points", array.place)?;
        self.numbers(array, reading)
    }

    /// Whether a text has shares of 255 in the place of the numbers of an array.
    fn is_of_shares(&self, array: &Array) -> bool {
        !self.is_binary && array.is_of_shares()
    }

    /// The field that an array is, of colours their luma.
    fn field(
        &self,
        array: &Array,
        selection: &Selection,
        cells: &Cells,
        reading: &mut Reading<'_>,
    ) -> Result<Field, ReadError> {
        let of_points = array.owner == Owner::Points;
        let (count, what) = if of_points { (cells.points.len(), "points") } else { (cells.kinds.len(), "cells") };
        cells::check_count(array.tuples, count, what, array.place)?;
        let mut numbers = self.numbers(array, reading)?;
        if self.is_of_shares(array) {
            // Shares have few digits, and stand for whole numbers.
            numbers.all.iter_mut().for_each(|n| *n = (255.0 * *n).round());
        }
        let name = escaped(array.name.as_bytes(), 40);
        cells::field(&numbers, selection, &name, of_points, array.place, reading)
    }
}
