//! Legacy VTK files (`.vtk`) of structured points, of rectilinear and structured grids, of cells and of polygons → a volume of scalars, of
//! colours their luma; a mesh.
//!
//! Text, or binary in big endian. Read is the first `SCALARS` or `COLOR_SCALARS` of the points, else their first array of one number of a `FIELD`, else the
//! same of the cells, unless one is asked for by name. Other arrays are named, other datasets refused by name.

mod arrays;
mod parts;

use super::lattice;
use super::rectilinear::Rectilinear;
use super::selection::Selection;
use super::voxels::{self, Stored};
use crate::error::{Place, ReadError};
use crate::reading::Reading;
use crate::stream::input::Stream;
use crate::text::{Line, Lines, Words};
use crate::{Loaded, ReadParams};
use arrays::{Array, Arrays, Owner, Part};
use splat_core::Grid;
use splat_core::glam::{DMat3, DVec3};
use splat_core::text::escaped;

const HINT: &str = "the file is truncated or damaged, or its header states other sizes";

/// What to do with datasets that are not read.
const OTHER_DATASETS: &str = "other datasets of VTK, such as fields and tables, are not read: in ParaView, Resample To Image and save it as .vti, or \
    Append Datasets and save it as .vtu";

/// Arrays of the coordinates of a rectilinear grid.
const COORDINATES: [&str; 3] = ["X_COORDINATES", "Y_COORDINATES", "Z_COORDINATES"];

/// What the points of a file hang together by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Dataset {
    StructuredPoints,
    RectilinearGrid,
    StructuredGrid,
    UnstructuredGrid,
    PolyData,
}

/// Reads a file.
pub(crate) fn read(content: &[u8], reading: &mut Reading<'_>) -> Result<Loaded, ReadError> {
    let mut lines = Lines::new(content);
    let (is_binary, dataset) = head(&mut lines)?;
    let mut arrays = Arrays::new(content, is_binary);
    if dataset == Dataset::StructuredPoints {
        return image(content, is_binary, lines, arrays, reading).map(Loaded::Grid);
    }
    if dataset == Dataset::RectilinearGrid {
        return rectilinear(content, is_binary, lines, arrays, reading).map(Loaded::Grid);
    }
    let mut points = Points::default();
    while let Some(line) = next(&mut lines)? {
        let is_of_grid = dataset == Dataset::StructuredGrid && points.take(line)?;
        if !is_of_grid && !parts::take(line, &mut lines, &mut arrays)? {
            arrays.take(line, &mut lines)?;
        }
    }
    let dims = match dataset {
        Dataset::StructuredGrid => Some(points.dims.ok_or_else(|| missing(&lines, "DIMENSIONS"))?.0),
        _ => None,
    };
    parts::read(&parts::Source { content, is_binary, arrays: &arrays, dims, end: lines.end() }, dataset, reading)
}

/// Reads a volume of structured points.
fn image<'a>(
    content: &'a [u8],
    is_binary: bool,
    mut lines: Lines<'a>,
    mut arrays: Arrays<'a>,
    reading: &mut Reading<'_>,
) -> Result<Grid, ReadError> {
    let params = reading.params;
    let notes = &mut reading.notes;
    let mut points = Points::default();
    while let Some(line) = next(&mut lines)? {
        if !points.take(line)? {
            arrays.take(line, &mut lines)?;
        }
    }
    let (dims, place) = points.dims.ok_or_else(|| missing(&lines, "DIMENSIONS"))?;
    let (array, value) = arrays
        .chosen(params, notes)?
        .ok_or_else(|| missing(&lines, "SCALARS, or an array of a FIELD, of POINT_DATA"))?;
    notes.not_used(arrays.all().filter(|a| a.place != array.place).map(|a| a.name.as_bytes()));
    let axes = DMat3::from_diagonal(points.spacing);
    lattice::check(points.origin, &axes, points.place, HINT)?;
    let mut origin = points.origin;
    let mut sizes = dims;
    if array.owner == Owner::Cells {
        (origin, sizes) = lattice::of_cells(origin, &axes, dims);
        notes
            .remarks
            .push(format!("values of cells ({}): they lie at the middles", escaped(array.name.as_bytes(), 40)));
    }
    let selection = array.selection(value, place, params, notes)?;
    let values = Values { content, array, is_binary, selection }.read(sizes, place, params)?;
    Ok(Grid { origin, axes, dims: sizes.map(|n| n as usize), values })
}

/// The lines before those of the dataset: whether the data is binary, and what it is.
fn head(lines: &mut Lines<'_>) -> Result<(bool, Dataset), ReadError> {
    // The second is a title.
    let mark = lines.next()?;
    let _title = lines.next()?;
    if !mark.is_some_and(|line| line.text.starts_with(b"# vtk DataFile Version")) {
        let expected = "'# vtk DataFile Version' in the first line";
        return Err(ReadError::input(Place::Byte(0), expected, "another beginning", HINT));
    }
    let encoding = next(lines)?.ok_or_else(|| missing(lines, "ASCII or BINARY"))?;
    let is_binary = match encoding.text.trim_ascii().to_ascii_uppercase().as_slice() {
        b"ASCII" => false,
        b"BINARY" => true,
        _ => return Err(wrong(encoding, "ASCII or BINARY")),
    };
    let dataset = next(lines)?.ok_or_else(|| missing(lines, "DATASET STRUCTURED_POINTS"))?;
    let words: Vec<Vec<u8>> = dataset.words(false).map(|w| w.text.to_ascii_uppercase()).collect();
    let kind = match words.iter().map(Vec::as_slice).collect::<Vec<_>>().as_slice() {
        [b"DATASET", b"STRUCTURED_POINTS"] => Dataset::StructuredPoints,
        [b"DATASET", b"RECTILINEAR_GRID"] => Dataset::RectilinearGrid,
        [b"DATASET", b"STRUCTURED_GRID"] => Dataset::StructuredGrid,
        [b"DATASET", b"UNSTRUCTURED_GRID"] => Dataset::UnstructuredGrid,
        [b"DATASET", b"POLYDATA"] => Dataset::PolyData,
        _ => {
            let hint = OTHER_DATASETS;
            let expected =
                "DATASET STRUCTURED_POINTS, RECTILINEAR_GRID, STRUCTURED_GRID, UNSTRUCTURED_GRID or POLYDATA";
            return Err(ReadError { hint, ..wrong(dataset, expected) });
        }
    };
    Ok((is_binary, kind))
}

/// The next line that is not empty.
fn next<'a>(lines: &mut Lines<'a>) -> Result<Option<Line<'a>>, ReadError> {
    loop {
        match lines.next()? {
            Some(line) if line.text.trim_ascii().is_empty() => {}
            line => return Ok(line),
        }
    }
}

fn wrong(line: Line<'_>, expected: &str) -> ReadError {
    ReadError::input(line.place(), expected, format!("'{}'", escaped(line.text, 60)), HINT)
}

fn missing(lines: &Lines<'_>, what: &str) -> ReadError {
    ReadError::input(lines.end(), what, "the end of the file", HINT)
}

/// Reads the volume of a rectilinear grid.
fn rectilinear<'a>(
    content: &'a [u8],
    is_binary: bool,
    mut lines: Lines<'a>,
    mut arrays: Arrays<'a>,
    reading: &mut Reading<'_>,
) -> Result<Grid, ReadError> {
    let mut points = Points::default();
    while let Some(line) = next(&mut lines)? {
        if !points.take(line)? && !take_coordinates(line, &mut lines, &mut arrays)? {
            arrays.take(line, &mut lines)?;
        }
    }
    let (dims, place) = points.dims.ok_or_else(|| missing(&lines, "DIMENSIONS"))?;
    let mut coordinates = [const { Vec::new() }; 3];
    for (axis, name) in COORDINATES.iter().enumerate() {
        let array = arrays.part(name).ok_or_else(|| missing(&lines, name))?;
        if array.tuples != dims[axis] {
            let expected = format!("{} coordinates, as DIMENSIONS says", dims[axis]);
            return Err(ReadError::input(array.place, expected, array.tuples.to_string(), HINT));
        }
        coordinates[axis] = array.read(content, is_binary, reading)?.to_vec();
    }
    let grid = Rectilinear { coordinates, place };
    grid.check()?;
    let (array, value) = arrays
        .chosen(reading.params, &mut reading.notes)?
        .ok_or_else(|| missing(&lines, "SCALARS, or an array of a FIELD, of POINT_DATA"))?;
    reading.notes.not_used(arrays.all().filter(|a| a.place != array.place).map(|a| a.name.as_bytes()));
    let of_values = if array.owner == Owner::Cells { grid.of_cells() } else { grid };
    if array.owner == Owner::Cells {
        let name = escaped(array.name.as_bytes(), 40);
        reading.notes.remark(format!("values of cells ({name}): they lie at the middles"));
    }
    let selection = array.selection(value, place, reading.params, &mut reading.notes)?;
    let values = Values { content, array, is_binary, selection }.read(of_values.dims(), place, reading.params)?;
    of_values.grid(values, reading)
}

/// Whether a line announces coordinates along an axis, which are passed over.
fn take_coordinates<'a>(line: Line<'a>, lines: &mut Lines<'a>, arrays: &mut Arrays<'a>) -> Result<bool, ReadError> {
    let words: Vec<_> = line.words(false).collect();
    let keyword = words.first().map(|w| w.text.to_ascii_uppercase()).unwrap_or_default();
    let Some(name) = COORDINATES.iter().find(|name| name.as_bytes() == keyword) else { return Ok(false) };
    let tuples = arrays::whole(words.get(1), line)?;
    let kind = arrays::kind(words.get(2), line)?;
    arrays.take_part(line, Part { name, kind, numbers: 1, tuples, cells: 0 }, lines)?;
    Ok(true)
}

/// The lattice, as far as it was told of.
struct Points {
    dims: Option<([u64; 3], Place)>,
    origin: DVec3,
    spacing: DVec3,
    place: Place,
}

impl Default for Points {
    fn default() -> Self {
        Self { dims: None, origin: DVec3::ZERO, spacing: DVec3::ONE, place: Place::File }
    }
}

impl Points {
    /// Whether a line tells of the lattice, and what.
    fn take(&mut self, line: Line<'_>) -> Result<bool, ReadError> {
        let mut words = line.words(false);
        let keyword = words.next().map(|w| w.text.to_ascii_uppercase()).unwrap_or_default();
        match keyword.as_slice() {
            b"DIMENSIONS" => {
                let size = |w: &[u8]| std::str::from_utf8(w).ok()?.parse().ok().filter(|n: &u64| *n > 0);
                let sizes: Option<Vec<u64>> = words.map(|w| size(w.text)).collect();
                let sizes = sizes.and_then(|sizes| <[u64; 3]>::try_from(sizes).ok());
                self.dims =
                    Some((sizes.ok_or_else(|| wrong(line, "DIMENSIONS and three sizes above 0"))?, line.place()));
            }
            b"ORIGIN" => self.origin = vector(words, line)?,
            b"SPACING" | b"ASPECT_RATIO" => (self.spacing, self.place) = (vector(words, line)?, line.place()),
            _ => return Ok(false),
        }
        Ok(true)
    }
}

fn vector<'a>(words: impl Iterator<Item = crate::text::Word<'a>>, line: Line<'_>) -> Result<DVec3, ReadError> {
    let numbers: Vec<f64> = words.map(|w| w.number()).collect::<Result<_, _>>()?;
    let numbers = <[f64; 3]>::try_from(numbers).map_err(|_| wrong(line, "three numbers"))?;
    Ok(numbers.into())
}

/// The values of an array over a lattice.
struct Values<'a> {
    content: &'a [u8],
    array: &'a Array,
    is_binary: bool,
    selection: Selection,
}

impl Values<'_> {
    /// Those of a lattice of these sizes, which stand at a place of the file.
    fn read(&self, dims: [u64; 3], place: Place, params: &ReadParams) -> Result<Vec<f32>, ReadError> {
        let Self { content, array, is_binary, selection } = *self;
        let is_of_shares = !is_binary && array.is_of_shares();
        let scaling = if is_of_shares { (255.0, 0.0) } else { (1.0, 0.0) };
        let stored = Stored { kind: array.kind, big_endian: true, dims, selection, scaling };
        stored.check(place, HINT)?;
        if stored.count() != array.tuples {
            let [x, y, z] = dims;
            let expected = format!("{} values for {x} x {y} x {z}", stored.count());
            return Err(ReadError::input(array.place, expected, array.tuples.to_string(), HINT));
        }
        if is_binary {
            return voxels::read(&mut Stream::of_part(content, array.data.clone(), params), &stored, params, HINT);
        }
        let mut values = voxels::text(&mut Words::new(content, array.data.start, array.line), &stored, params, HINT)?;
        if is_of_shares && array.numbers == 1 {
            // Shares have few digits, and stand for whole numbers.
            values.iter_mut().for_each(|v| *v = v.round());
        }
        Ok(values)
    }
}
