//! Images and rectilinear grids whose pieces lie in several files → one volume.

use super::extents::{self, Extent, Filling};
use super::pieces::{Source, in_file};
use super::{
    ChosenArray, HINT, Lattice, child, chosen, coordinates, extent, lattice, lattice_values, not_used, place,
    remark_middles, sizes, wrong,
};
use crate::error::{Place, ReadError};
use crate::reading::Reading;
use crate::stream::input;
use crate::volumes::rectilinear::Rectilinear;
use roxmltree::Node;
use splat_core::Grid;

/// Voxels between the pieces for each of a piece, at most: more are a damaged index.
const MOST_EMPTY: u64 = 64;

/// A piece, and where it lies.
struct Part<'s, 'e, 'a, 'i> {
    source: &'s Source<'e, 'a, 'i>,
    node: Node<'a, 'i>,
    extent: Extent,
}

/// How far apart two pieces may have a coordinate that they share, of the distance to its neighbour: what rounding to single precision does.
const SAME: f64 = 1e-3;

/// Reads the volume of all pieces, which agree where they share points or cells.
pub(super) fn read(sources: &[Source<'_, '_, '_>], reading: &mut Reading<'_>) -> Result<Grid, ReadError> {
    let mut parts = Vec::new();
    for source in sources {
        for node in source.dataset.children().filter(|c| c.has_tag_name("Piece")) {
            let extent = extent(node, "Extent").map_err(|e| in_file(source.file, e))?;
            parts.push(Part { source, node, extent });
        }
    }
    let Some(first) = parts.first() else {
        return Err(ReadError::input(Place::File, "a Piece", "none", HINT));
    };
    let Some(found) = chosen(first.node, reading.params, &mut reading.notes)? else {
        return Err(wrong(first.node, "a DataArray in PointData or CellData", "none"));
    };
    let mut whole = first.extent;
    for part in &parts {
        for (ends, [low, high]) in whole.iter_mut().zip(part.extent) {
            *ends = [ends[0].min(low), ends[1].max(high)];
        }
    }
    let place = place(first.node);
    check_whole(whole, &parts, place)?;
    if found.is_of_cells {
        extents::check_filled(&extents::parts(sources, &[])?, None, Filling::Cells)?;
        remark_middles(&found, reading);
    }
    let values = pasted(&parts, &found, whole, reading)?;
    let dims = values_within(whole, whole, found.is_of_cells).map_or([1; 3], sizes).map(|n| n as usize);
    if first.source.dataset.has_tag_name("RectilinearGrid") {
        let coordinates = joined(&parts, whole, place, reading)?;
        coordinates.check()?;
        let of_values = if found.is_of_cells { coordinates.of_cells() } else { coordinates };
        return of_values.grid(values, reading);
    }
    let Lattice { origin, axes, points, .. } = Lattice::within(first.source.dataset, whole)?;
    for part in &parts {
        let lattice = Lattice::within(part.source.dataset, whole).map_err(|e| in_file(part.source.file, e))?;
        if (lattice.origin, lattice.axes) != (origin, axes) {
            let error = wrong(part.source.dataset, "the Origin, Spacing and Direction of the other pieces", "others");
            return Err(in_file(part.source.file, error));
        }
    }
    let origin = if found.is_of_cells { lattice::of_cells(origin, &axes, points).0 } else { origin };
    Ok(Grid { origin, axes, dims, values })
}

/// Refuses pieces that leave nearly all of the lattice empty, and a lattice that is out of reach.
fn check_whole(whole: Extent, parts: &[Part<'_, '_, '_, '_>], place: Place) -> Result<(), ReadError> {
    let count = |extent: Extent| sizes(extent).iter().try_fold(1u64, |n, size| n.checked_mul(*size));
    let filled = parts.iter().try_fold(0u64, |n, part| n.checked_add(count(part.extent)?));
    let most = filled.and_then(|filled| filled.checked_mul(MOST_EMPTY));
    if count(whole).zip(most).is_some_and(|(voxels, most)| voxels <= most) {
        return Ok(());
    }
    let [x, y, z] = sizes(whole);
    let found = format!("{x} x {y} x {z} points, of which the pieces have few");
    Err(ReadError::input(place, "pieces that lie side by side", found, HINT))
}

/// Indices of the values of a piece: of its points, or of the cells between them. `None` of a piece that has none because it is a layer of points
/// of a lattice with depth.
fn values_within(extent: Extent, whole: Extent, are_of_cells: bool) -> Option<Extent> {
    let mut values = extent;
    for (ends, [low, high]) in values.iter_mut().zip(whole) {
        match (are_of_cells && low < high, ends[0] < ends[1]) {
            (true, true) => ends[1] -= 1,
            (true, false) => return None,
            _ => {}
        }
    }
    Some(values)
}

/// The values of all pieces, each at its place.
fn pasted(
    parts: &[Part<'_, '_, '_, '_>],
    found: &ChosenArray<'_, '_>,
    whole: Extent,
    reading: &mut Reading<'_>,
) -> Result<Vec<f32>, ReadError> {
    let outer = values_within(whole, whole, found.is_of_cells).unwrap_or(whole);
    let [nx, ny, nz] = sizes(outer).map(|n| n as usize);
    let count = nx * ny * nz;
    input::hold("the voxels of all pieces", (count * size_of::<f32>()) as u64, reading.params)?;
    let mut values = Vec::new();
    input::reserve(&mut values, count)?;
    values.resize(count, f32::NAN);
    for part in parts {
        reading.go_on()?;
        let Some(inner) = values_within(part.extent, whole, found.is_of_cells) else { continue };
        let told = |e: ReadError| in_file(part.source.file, e);
        let array = part.array(found).map_err(told)?;
        let coordinates = child(part.node, "Coordinates").into_iter().flat_map(super::arrays);
        let used: Vec<Node<'_, '_>> = coordinates.chain([array.array]).collect();
        not_used(part.source.dataset, &used, &mut reading.notes);
        let dims = sizes(inner);
        let read = lattice_values(&array, dims, place(part.node), part.source.encoding, reading).map_err(told)?;
        let [mx, my, _] = dims.map(|n| n as usize);
        let start = [0, 1, 2].map(|axis| (inner[axis][0] - outer[axis][0]) as usize);
        for (n, row) in read.chunks_exact(mx).enumerate() {
            let first = start[0] + nx * (start[1] + n % my + ny * (start[2] + n / my));
            let there = &mut values[first..first + mx];
            if let Some(i) = (0..mx).find(|i| !there[*i].is_nan() && there[*i] != row[*i]) {
                let [j, k] = [n % my, n / my].map(|n| n as i64);
                let index = [inner[0][0] + i as i64, inner[1][0] + j, inner[2][0] + k];
                let what =
                    format!("the value at {} {} {} of {}", index[0], index[1], index[2], super::name(array.array));
                let [expected, found] = [there[i], row[i]].map(f64::from);
                return Err(extents::differ(&what, expected, found, part.source.file, place(part.node)));
            }
            there.copy_from_slice(row);
        }
    }
    Ok(values)
}

/// The coordinates of all pieces, each at its place.
fn joined(
    parts: &[Part<'_, '_, '_, '_>],
    whole: Extent,
    place: Place,
    reading: &Reading<'_>,
) -> Result<Rectilinear, ReadError> {
    let [nx, ny, nz] = sizes(whole).map(|n| n as usize);
    let mut joined = [vec![f64::NAN; nx], vec![f64::NAN; ny], vec![f64::NAN; nz]];
    for part in parts {
        let found = coordinates(part.node, part.source.encoding, reading).map_err(|e| in_file(part.source.file, e))?;
        for (axis, coordinates) in found.coordinates.iter().enumerate() {
            let first = (part.extent[axis][0] - whole[axis][0]) as usize;
            let there = &mut joined[axis][first..first + coordinates.len()];
            for (i, coordinate) in coordinates.iter().enumerate() {
                let step =
                    coordinates.get(i + 1).or(coordinates.get(i.wrapping_sub(1))).map_or(0.0, |c| c - coordinate);
                if (there[i] - coordinate).abs() > SAME * step.abs() {
                    let index = part.extent[axis][0] + i as i64;
                    let what = format!("the coordinate {index} along {}", ["x", "y", "z"][axis]);
                    return Err(extents::differ(
                        &what,
                        there[i],
                        *coordinate,
                        part.source.file,
                        super::place(part.node),
                    ));
                }
                there[i] = *coordinate;
            }
        }
    }
    Ok(Rectilinear { coordinates: joined, place })
}

impl<'a, 'i> Part<'_, '_, 'a, 'i> {
    /// The array of this piece that has the name of the chosen one and belongs to the same.
    fn array(&self, found: &ChosenArray<'_, '_>) -> Result<ChosenArray<'a, 'i>, ReadError> {
        let element = if found.is_of_cells { "CellData" } else { "PointData" };
        let name = found.array.attribute("Name");
        let mut arrays = child(self.node, element).into_iter().flat_map(super::arrays);
        let array = arrays.find(|array| array.attribute("Name") == name);
        let array = array.ok_or_else(|| {
            let expected = format!("an array '{}' in {element}, which another Piece has", super::name(found.array));
            wrong(self.node, &expected, "none")
        })?;
        extents::check_alike(found.array, array)?;
        Ok(ChosenArray { array, is_of_cells: found.is_of_cells, value: found.value })
    }
}
