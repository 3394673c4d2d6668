//! Structured grids: cells between the points of a curved lattice, and the volume of one that is straight.

use super::{Cells, Field, HINT, Lists, hold_lists};
use crate::error::{Place, ReadError};
use crate::reading::Reading;
use crate::volumes::lattice;
use splat_core::Grid;
use splat_core::glam::{DMat3, DVec3};

/// VTK's kinds of the cells of grids of no, one, two and three dimensions.
const KINDS: [u8; 4] = [1, 3, 9, 12];

/// Corners of a cell among its neighbours along each axis, in the order of VTK's hexahedron; the first four are its quad, the first two its line.
const CORNERS: [[usize; 3]; 8] =
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]];

/// How far a point of a straight lattice may lie from its place, in the shortest step: what rounding to single precision does.
const STRAIGHT: f64 = 1e-3;

/// Refuses a grid that has not as many points as its sizes.
pub(crate) fn check_dims(dims: [u64; 3], points: u64, place: Place) -> Result<(), ReadError> {
    let [x, y, z] = dims;
    let count = dims.iter().try_fold(1u64, |n, size| n.checked_mul(*size));
    if count == Some(points) {
        return Ok(());
    }
    let expected = format!("as many points as the sizes {x} x {y} x {z} have");
    Err(ReadError::input(place, expected, points.to_string(), HINT))
}

impl Cells {
    /// The cells between points of these sizes, x fastest: hexahedra, or quads of a sheet and lines of a curve.
    pub(crate) fn structured(
        points: Vec<DVec3>,
        dims: [u64; 3],
        place: Place,
        reading: &Reading<'_>,
    ) -> Result<Self, ReadError> {
        check_dims(dims, points.len() as u64, place)?;
        if u32::try_from(points.len()).is_err() {
            let expected = format!("at most {} points", u32::MAX);
            return Err(ReadError::input(place, expected, points.len().to_string(), HINT));
        }
        // There are as many points, which are in memory.
        let [nx, ny, nz] = dims.map(|n| n as usize);
        let along: Vec<usize> = (0..3).filter(|axis| dims[*axis] > 1).collect();
        let corners = &CORNERS[..1 << along.len()];
        let cells: usize = [nx, ny, nz].iter().map(|n| n.saturating_sub(1).max(1)).product();
        hold_lists(cells, cells * corners.len(), reading)?;
        let strides = [1, nx, nx * ny];
        let offsets: Vec<u32> = corners
            .iter()
            .map(|corner| along.iter().zip(corner).map(|(axis, step)| (strides[*axis] * step) as u32).sum())
            .collect();
        let [ex, ey, ez] = [nx, ny, nz].map(|n| n.saturating_sub(1).max(1));
        let firsts = (0..ez).flat_map(|k| (0..ey).flat_map(move |j| (0..ex).map(move |i| i + nx * (j + ny * k))));
        let mut lists = Lists::default();
        for first in firsts {
            lists.push_ranks(offsets.iter().map(|offset| first as u32 + offset));
        }
        Ok(Self { points, kinds: vec![KINDS[along.len()]; lists.len()], lists, place })
    }
}

/// The volume of a field over points of these sizes that are a straight lattice with the same steps throughout; `None` for others.
pub(crate) fn straight(
    points: &[DVec3],
    dims: [u64; 3],
    field: &Field,
    reading: &mut Reading<'_>,
) -> Result<Option<Grid>, ReadError> {
    let [nx, ny, nz] = dims.map(|n| n as usize);
    if dims.iter().any(|n| *n < 2) {
        return Ok(None);
    }
    let origin = points[0];
    let step = |stride: usize, n: usize| (points[stride * (n - 1)] - origin) / (n - 1) as f64;
    let axes = DMat3::from_cols(step(1, nx), step(nx, ny), step(nx * ny, nz));
    if lattice::check(origin, &axes, Place::File, HINT).is_err() {
        return Ok(None);
    }
    let shortest = axes.x_axis.length().min(axes.y_axis.length()).min(axes.z_axis.length());
    let place = |n: usize| origin + axes * DVec3::new((n % nx) as f64, (n / nx % ny) as f64, (n / nx / ny) as f64);
    if !points.iter().enumerate().all(|(n, point)| point.distance(place(n)) <= STRAIGHT * shortest) {
        return Ok(None);
    }
    let numbers = |values: &[f64]| -> Result<Vec<f32>, ReadError> {
        crate::stream::input::hold("the voxels", size_of_val(values) as u64 / 2, reading.params)?;
        Ok(values.iter().map(|value| *value as f32).collect())
    };
    Ok(match field {
        Field::Points(values) => Some(Grid { origin, axes, dims: [nx, ny, nz], values: numbers(values)? }),
        Field::Cells(values) => {
            let values = numbers(values)?;
            let (origin, sizes) = lattice::of_cells(origin, &axes, dims);
            reading.notes.remark("values of cells: they lie at the middles");
            Some(Grid { origin, axes, dims: sizes.map(|n| n as usize), values })
        }
        Field::One => None,
    })
}
