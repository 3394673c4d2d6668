//! Searches a box for content: zeros of a field, extinction of a volume.

use crate::SharedField;
use rayon::prelude::*;
use splat_core::glam::DVec3;
use splat_core::{Clip, DAabb, Grid, TransferFunction};

/// How far voxels reach around their lattice points, cells.
const REACH: f64 = 0.5;

/// Most ends of rows that are seen with what surrounds them.
const FEW: usize = 10_000;

/// Share of the largest extinction from which a voxel is seen.
const FAINT: f32 = 0.02;

/// Optical depth from which it is.
const FAINT_DEPTH: f64 = 0.5 / 255.0;

/// Cells along the longest side of a box, in which an implicit surface is looked for.
const SURFACE_CELLS: f64 = 32.0;

/// A search for the places in a box where a field may be zero, by the field's bound.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ZeroSearch {
    /// The part of the box; the whole box where the field knows no bound.
    pub bounds: DAabb,
    /// Cells that may hold a zero times the area of a cell's side; infinite where the field knows no bound.
    pub area: f64,
}

impl ZeroSearch {
    /// Asks the field for its bound on each of at most 32³ cells of the box.
    pub fn new(field: &SharedField, whole: DAabb) -> Self {
        let cells = Cells::new(whole, SURFACE_CELLS);
        let mut found = DAabb::EMPTY;
        let mut n = 0.0;
        for k in 0..cells.count() {
            let (middle, radius) = cells.ball(k);
            let Some((least, most)) = field.bound(middle, radius) else {
                return Self { bounds: whole, area: f64::INFINITY };
            };
            if least <= 0.0 && most >= 0.0 && field.may_be_in_domain(middle, radius) {
                found = found.union(DAabb::around(middle, 0.5 * cells.step));
                n += 1.0;
            }
        }
        let within = |p: DVec3| p.clamp(whole.min, whole.max);
        let bounds = if found.is_solid() { DAabb::new(within(found.min), within(found.max)) } else { whole };
        Self { bounds, area: n * libm::pow(cells.step.element_product(), 2.0 / 3.0) }
    }
}

/// Bounds of the lattice points to which a transfer function gives extinction, and one cell around them, clipped to the voxels.
/// Without such points, the bounds of all voxels.
pub fn extinct_bounds(grid: &Grid, transfer: &TransferFunction) -> DAabb {
    let [nx, ny, _] = grid.dims;
    let mut low = DVec3::INFINITY;
    let mut high = DVec3::NEG_INFINITY;
    for (row, values) in grid.values.chunks(nx).enumerate() {
        let seen = |v: &f32| transfer.at(*v).extinction > 0.0;
        if let (Some(first), Some(last)) = (values.iter().position(seen), values.iter().rposition(seen)) {
            let at = |i: usize| DVec3::new(i as f64, (row % ny) as f64, (row / ny) as f64);
            (low, high) = (low.min(at(first)), high.max(at(last)));
        }
    }
    let first = DVec3::splat(-0.5);
    let last = DVec3::from_array(grid.dims.map(|n| n as f64 - 0.5));
    let (low, high) =
        if low.cmple(high).all() { ((low - 1.0).max(first), (high + 1.0).min(last)) } else { (first, last) };
    DAabb::of_points(DAabb::new(low, high).corners().map(|index| grid.origin + grid.axes * index))
}

/// The first and the last visible lattice point of every row, within all regions. A point is visible if a transfer function gives enough
/// extinction to it, alone or with its neighbours. A lattice of few rows yields the corners around the visible part of each row. Without a
/// visible point, the corners of [`extinct_bounds`]. A voxel is seen by an optical depth of half a grey level of eight bits, or by a fiftieth
/// of the densest. `scale` is the length of a unit of the lattice in that of extinctions.
pub fn visible_ends(grid: &Grid, transfer: &TransferFunction, scale: f64, clips: &[Clip]) -> Vec<DVec3> {
    let most = transfer.points().iter().fold(0.0, |most: f32, p| most.max(p.extinction));
    let least = (FAINT * most).min((FAINT_DEPTH / (libm::cbrt(grid.cell_volume()) * scale)) as f32);
    let seen = |v: &f32| transfer.at(*v).extinction > least;
    let [nx, ny, _] = grid.dims;
    let row = |(row, values): (usize, &[f32])| {
        let place = |i: usize| grid.position(i, row % ny, row / ny);
        let is_seen = |i: &usize| seen(&values[*i]) && clips.iter().all(|clip| clip.keeps(place(*i)));
        let first = (0..nx).find(is_seen)?;
        let last = (0..nx).rfind(is_seen)?;
        Some([first, last].map(place))
    };
    let mut ends: Vec<DVec3> = grid.values.par_chunks(nx).enumerate().filter_map(row).flatten_iter().collect();
    if ends.is_empty() {
        return extinct_bounds(grid, transfer).corners().to_vec();
    }
    // In a lattice of many rows half a voxel is less than a pixel or two.
    if ends.len() <= FEW {
        let around = DAabb::around(DVec3::ZERO, DVec3::splat(REACH)).corners().map(|index| grid.axes * index);
        ends = ends.iter().flat_map(|end| around.map(|reach| *end + reach)).collect();
    }
    ends
}

/// Places where an isosurface crosses the edges of the lattice: of every row of the lattice the outermost ones, so that their box is that of the
/// whole surface. Empty if the surface crosses none.
pub fn surface_ends(grid: &Grid, isovalue: f64) -> Vec<DVec3> {
    let [nx, ny, _] = grid.dims;
    let value = |[i, j, k]: [usize; 3]| f64::from(grid.values[i + nx * (j + ny * k)]);
    let row = |row: usize| {
        let mut ends: Vec<DVec3> = Vec::new();
        for axis in 0..3 {
            // Index of the crossing on the edge that leads from a lattice point along the axis.
            let crossing = |i: usize| {
                let from = [i, row % ny, row / ny];
                let mut to = from;
                to[axis] += 1;
                if to[axis] == grid.dims[axis] {
                    return None;
                }
                let [first, last] = [from, to].map(value);
                let crosses = (first > isovalue) != (last > isovalue);
                let mut index = DVec3::from_array(from.map(|n| n as f64));
                index[axis] += (isovalue - first) / (last - first);
                crosses.then_some(index)
            };
            for along in [0, axis] {
                let order = |a: &DVec3, b: &DVec3| a[along].total_cmp(&b[along]);
                ends.extend((0..nx).filter_map(crossing).min_by(order));
                ends.extend((0..nx).filter_map(crossing).max_by(order));
            }
        }
        ends.into_iter().map(|index| grid.origin + grid.axes * index)
    };
    (0..grid.values.len() / nx.max(1)).into_par_iter().flat_map_iter(row).collect()
}

/// Cells that fill a box.
struct Cells {
    low: DVec3,
    step: DVec3,
    counts: [usize; 3],
}

impl Cells {
    /// About `longest` cells along the longest side.
    fn new(bounds: DAabb, longest: f64) -> Self {
        let sides = bounds.size();
        let counts = (sides / sides.max_element() * longest).ceil().max(DVec3::ONE);
        Self { low: bounds.min, step: sides / counts, counts: counts.to_array().map(|n| n as usize) }
    }

    fn count(&self) -> usize {
        self.counts.iter().product()
    }

    /// A ball around cell `k`: its middle and radius.
    fn ball(&self, k: usize) -> (DVec3, f64) {
        let [nx, ny, _] = self.counts;
        let index = DVec3::new((k % nx) as f64, (k / nx % ny) as f64, (k / (nx * ny)) as f64);
        (self.low + self.step * (index + 0.5), 0.5 * self.step.length() * (1.0 + 1e-12))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::TransferPoint;
    use splat_core::glam::DMat3;

    #[test]
    fn few_voxels_are_seen_with_what_surrounds_them_and_many_as_their_middles() {
        let dense = TransferPoint { value: 1.0, color: [1.0; 3], extinction: 1.0 };
        let transfer = TransferFunction::new(vec![dense]).expect("one point");
        let seen = |n: usize| {
            let grid = Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims: [n; 3], values: vec![1.0; n * n * n] };
            DAabb::of_points(visible_ends(&grid, &transfer, 1.0, &[]))
        };
        let around = DAabb::new(DVec3::splat(-REACH), DVec3::splat(1.0 + REACH));
        assert_eq!(seen(2), around);
        assert_eq!(seen(80), DAabb::new(DVec3::ZERO, DVec3::splat(79.0)));
    }

    #[test]
    fn an_isosurface_has_the_ends_of_a_ball_wherever_that_lies() {
        let middle = DVec3::new(5.3, 9.1, 6.7);
        let radius = 3.4;
        let dims = [14, 17, 12];
        let place = |i: usize| DVec3::new((i % 14) as f64, (i / 14 % 17) as f64, (i / 14 / 17) as f64);
        let values: Vec<f32> = (0..14 * 17 * 12).map(|i| (radius - place(i).distance(middle)) as f32).collect();
        let step = DVec3::new(1.0, 2.0, -0.5);
        let axes = DMat3::from_diagonal(step);
        let grid = Grid { origin: DVec3::splat(100.0), axes, dims, values };
        let ends = DAabb::of_points(surface_ends(&grid, 0.0));
        let around = DAabb::around(grid.origin + step * middle, (radius * step).abs());
        // Edges of the lattice meet a ball a little inside of its ends.
        let inside = (ends.min - around.min).min(around.max - ends.max) / step.abs();
        assert!(inside.min_element() > -1e-6 && inside.max_element() < 0.15, "{inside}");
        assert_eq!(surface_ends(&grid, 99.0), []);
    }

    #[test]
    fn a_faint_rim_is_seen_where_many_such_voxels_are_and_whatever_the_unit_is() {
        // Values 0 to 63 along x; a voxel of value 1 has an optical depth of a fifth of a grey level, of value 3 of three fifths.
        let dims = [64, 8, 8];
        let values = (0..64 * 64).map(|i| (i % 64) as f32).collect();
        let grid = Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims, values };
        for unit in [1.0, 1.3, 1e-3, 1e3] {
            let point =
                |value: f32, depth: f64| TransferPoint { value, color: [1.0; 3], extinction: (depth / unit) as f32 };
            let transfer = TransferFunction::new(vec![point(0.0, 0.0), point(5.0, 1.0 / 255.0), point(63.0, 2.0)]);
            let ends = visible_ends(&grid, &transfer.expect("three points"), unit, &[]);
            assert_eq!(DAabb::of_points(ends).min.x, 3.0 - REACH, "{unit}");
        }
        // Where all is that faint, what is densest is seen.
        let thin = [TransferPoint { value: 63.0, color: [1.0; 3], extinction: 1e-6 }];
        let thin = TransferFunction::new(thin.to_vec()).expect("one point");
        assert_eq!(DAabb::of_points(visible_ends(&grid, &thin, 1.0, &[])).max.x, 63.0 + REACH);
    }
}
