//! From Cartesian to body-centred cubic lattices, which hold the same spectrum with 1/√2 of the points.
//!
//! A Cartesian lattice of spacing h holds a sphere of frequencies up to 1/2h, and the corners of a cube around it. Copies of a spectrum lie
//! 1/h apart there; on a body-centred lattice of cell edge a they lie √2/a apart. So a = √2·h keeps copies of the sphere as
//! far from each other, with 2/a³ = 0.7071/h³ points (Theußl, Möller, Gröller 2001; Neophytou, Mueller 2005, Table 1). Frequencies in the corners of
//! the cube fold back.
//!
//! Values are interpolated by the polynomials of degree 11 through the twelve lattice points around a place, axis by axis: constants and
//! linear fields are exact, waves of four spacings and more err by 1/200 of their height at most. Beyond its faces the lattice goes
//! on by odd reflection, so linear fields are exact there, too.

use crate::volume::volume_points::check_lattice;
use crate::{ConvertError, SplatParams};
use rayon::prelude::*;
use splat_core::glam::{DMat3, DVec3};
use splat_core::{BccGrid, Grid, Packing};
use std::f64::consts::FRAC_1_SQRT_2;

/// Lattice points that a value is interpolated from along each axis.
const POINTS: usize = 12;

/// Lattice points in a row and their weights; those behind the last point of the lattice are 0.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Taps {
    first: usize,
    weights: [f64; POINTS],
}

/// The grid on the body-centred lattice of the same spectrum, which fills the same place. Along i and j it has as many points as the
/// grid over √2, rounded, and along k twice that many planes: the sizes of the paper's Table 1. Cells are stretched for that, by half a
/// cell in all. Slanted and unequal steps keep their ratios, of an affine body-centred lattice.
///
/// ```
/// use convert::{SplatParams, body_centred};
/// use splat_core::{Grid, glam::{DMat3, DVec3}};
/// let values = (0..34 * 34 * 34).map(|i| (i % 34) as f32).collect();
/// let grid = Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims: [34; 3], values };
/// let bcc = body_centred(&grid, &SplatParams::default()).unwrap();
/// assert_eq!(bcc.planes.dims, [24, 24, 48]);
/// assert!((f64::from(bcc.planes.values[7]) - bcc.position(7, 0, 0).x).abs() < 1e-5);
/// ```
///
/// # Errors
/// [`ConvertError::Input`] for an invalid grid, [`ConvertError::Limit`] before memory is taken.
pub fn body_centred(grid: &Grid, params: &SplatParams) -> Result<BccGrid, ConvertError> {
    grid.validate().map_err(|e| params.input(e))?;
    let dims = sizes(grid.dims);
    check_lattice(params, dims.map(|n| n as f64))?;
    let ratio = DVec3::from_array([0, 1, 2].map(|a| grid.dims[a] as f64 / dims[a] as f64));
    // Both fill the same place.
    let origin = grid.origin + grid.axes * (Packing::Cartesian.lowest() - ratio * Packing::BodyCentred.lowest());
    let axes = grid.axes * DMat3::from_diagonal(ratio);
    Ok(BccGrid { planes: Grid { origin, axes, dims, values: values(grid, dims) } })
}

/// Points along i and j, and planes, for a Cartesian lattice of so many points.
fn sizes(points: [usize; 3]) -> [usize; 3] {
    let [i, j, k] = points.map(|n| (n as f64 * FRAC_1_SQRT_2).round().max(1.0) as usize);
    [i, j, 2 * k]
}

/// Values of all planes: along k, then j, then i.
fn values(grid: &Grid, dims: [usize; 3]) -> Vec<f32> {
    let [nx, ny, _] = grid.dims;
    let places = |axis: usize| [0.0, 0.5].map(|shift| taps(grid.dims[axis], dims, axis, shift));
    let columns = places(0);
    let rows = places(1);
    let planes = taps(grid.dims[2], dims, 2, 0.0);
    let mut out = vec![0.0f32; dims.iter().product()];
    let buffers = || (vec![0.0f64; nx * ny], vec![0.0f64; nx]);
    out.par_chunks_mut(dims[0] * dims[1]).enumerate().for_each_init(buffers, |(plane, row), (k, out)| {
        plane.fill(0.0);
        planes[k].sum(|at, weight| {
            let from = &grid.values[at * nx * ny..][..nx * ny];
            plane.iter_mut().zip(from).for_each(|(to, v)| *to += weight * f64::from(*v));
        });
        for (taps, out) in rows[k % 2].iter().zip(out.chunks_exact_mut(dims[0])) {
            row.fill(0.0);
            taps.sum(|at, weight| {
                row.iter_mut().zip(&plane[at * nx..][..nx]).for_each(|(to, v)| *to += weight * v);
            });
            for (taps, out) in columns[k % 2].iter().zip(out) {
                let mut value = 0.0;
                taps.sum(|at, weight| value += weight * row[at]);
                *out = value as f32;
            }
        }
    });
    out
}

/// Taps of all places along an axis with `points` points, in planes that are shifted so far.
fn taps(points: usize, dims: [usize; 3], axis: usize, shift: f64) -> Vec<Taps> {
    let step = points as f64 / dims[axis] as f64;
    let lowest = Packing::BodyCentred.lowest()[axis];
    (0..dims[axis]).map(|i| Taps::new((i as f64 + shift - lowest) * step - 0.5, points)).collect()
}

impl Taps {
    /// The polynomial through the points around a place between −1/2 and `points` − 1/2.
    fn new(place: f64, points: usize) -> Self {
        let last = points as isize - 1;
        let begin = place.floor() as isize - (POINTS as isize / 2 - 1);
        let first = begin.min(last + 1 - POINTS as isize).max(0);
        let mut weights = [0.0; POINTS];
        for at in begin..begin + POINTS as isize {
            let others = (begin..begin + POINTS as isize).filter(|other| *other != at);
            let weight: f64 = others.map(|other| (place - other as f64) / (at - other) as f64).product();
            let face = at.clamp(0, last);
            if face == at {
                weights[(at - first) as usize] += weight;
            } else {
                weights[(face - first) as usize] += 2.0 * weight;
                weights[((2 * face - at).clamp(0, last) - first) as usize] -= weight;
            }
        }
        Self { first: first as usize, weights }
    }

    /// Each point that has a weight, with it.
    #[inline(always)]
    fn sum(&self, mut each: impl FnMut(usize, f64)) {
        for (m, weight) in self.weights.iter().enumerate().filter(|(_, w)| **w != 0.0) {
            each(self.first + m, *weight);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_those_of_the_papers_table_with_less_than_72_percent_of_the_points() {
        // Bonsai, CT head, engine.
        let table = [([256; 3], [181, 181, 362]), ([128; 3], [91, 91, 182]), ([256, 256, 128], [181, 181, 182])];
        for (points, expected) in table {
            assert_eq!(sizes(points), expected);
            let share = expected.iter().product::<usize>() as f64 / points.iter().product::<usize>() as f64;
            assert!((0.7..0.72).contains(&share), "{share}");
        }
    }
}
