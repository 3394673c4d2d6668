//! A lattice and a rim of voxels around it that continue its values.
//!
//! At a face of a volume half of a kernel's neighbours are missing: a mean of what is left lies too far inside, and the gradient is
//! wrong there. So the lattice goes on for as many voxels as kernels reach, v(−m) = 2·v(0) − v(m) along each axis: a linear field
//! stays linear up to its faces, and a constant one constant. The volume itself does not grow.

pub(crate) mod near;
pub(crate) mod neighbours;
pub(crate) mod rays;

use splat_core::glam::DMat3;
use splat_core::{Grid, Packing};

/// Most voxels of the rim along an axis.
const MOST_RIM: usize = 3;

/// Most planes of it where they lie half a cell apart.
const MOST_PLANES: usize = 2 * MOST_RIM;

/// A grid with its rim; indices count from the rim's corner.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lattice<'a> {
    /// Without the rim, i fastest.
    values: &'a [f32],
    inner: [usize; 3],
    /// Which planes continue which.
    pub(crate) packing: Packing,
    /// Voxels before and behind the grid, by axis.
    pub(crate) rim: [usize; 3],
    /// Lattice points with the rim.
    pub(crate) dims: [usize; 3],
}

/// A share of a lattice point.
pub(crate) type Term = (f64, usize);

impl<'a> Lattice<'a> {
    /// Of planes that lie like that, with a rim for kernels that reach so many steps along the axes. Planes of the two lattices of a body-centred
    /// one go on each by itself.
    pub(crate) fn new(grid: &'a Grid, packing: Packing, reach: [usize; 3]) -> Self {
        Self::over(&grid.values, grid.dims, packing, reach)
    }

    /// The same of bare values, as a grid holds them.
    pub(crate) fn over(values: &'a [f32], inner: [usize; 3], packing: Packing, reach: [usize; 3]) -> Self {
        let most = [MOST_RIM, MOST_RIM, if packing == Packing::Cartesian { MOST_RIM } else { MOST_PLANES }];
        let rim = [0, 1, 2].map(|a| reach[a].min(most[a]));
        Self { values, inner, packing, rim, dims: [0, 1, 2].map(|a| inner[a] + 2 * rim[a]) }
    }

    /// What the place `i` along an axis is made of.
    #[inline(always)]
    pub(crate) fn terms(&self, axis: usize, i: usize) -> [Term; 2] {
        let n = self.inner[axis] as isize;
        let i = i as isize - self.rim[axis] as isize;
        let last = n - 1;
        if (0..n).contains(&i) {
            return [(1.0, i as usize), (0.0, 0)];
        }
        let (face, inside) = if self.packing == Packing::BodyCentred && axis == 2 {
            // The outermost plane of the same lattice; mirrored there by whole cells.
            let [first, last] = [i & 1, last - 1 + (i & 1)];
            if i < 0 { (first, (2 * first - i).min(last)) } else { (last, (2 * last - i).max(first)) }
        } else if i < 0 {
            (0, (-i).min(last))
        } else {
            (last, (2 * last - i).max(0))
        };
        [(2.0, face as usize), (-1.0, inside as usize)]
    }

    /// The value at a lattice point.
    pub(crate) fn value(&self, i: usize, j: usize, k: usize) -> f32 {
        if let Some(value) = self.inside(i..i + 1, j, k) {
            return value[0];
        }
        let [nx, ny, _] = self.inner;
        let mut sum = 0.0;
        for (c, k) in self.terms(2, k) {
            for (b, j) in self.terms(1, j) {
                for (a, i) in self.terms(0, i) {
                    let share = a * b * c;
                    if share != 0.0 {
                        sum += share * f64::from(self.values[(k * ny + j) * nx + i]);
                    }
                }
            }
        }
        sum as f32
    }

    /// Values of the grid in a row, without the rim, where all of `range` lies inside.
    #[inline(always)]
    pub(crate) fn inside(&self, range: std::ops::Range<usize>, j: usize, k: usize) -> Option<&'a [f32]> {
        let [nx, ny, nz] = self.inner;
        let [ri, rj, rk] = self.rim;
        let is_inside = range.start >= ri && range.end <= ri + nx && j >= rj && j < rj + ny && k >= rk && k < rk + nz;
        is_inside.then(|| {
            let row = ((k - rk) * ny + j - rj) * nx;
            &self.values[row + range.start - ri..row + range.end - ri]
        })
    }

    /// Values in a row from place `first` on, as far as the row goes.
    #[inline(always)]
    pub(crate) fn eight(&self, first: usize, j: usize, k: usize, out: &mut [f32; 8]) {
        let end = (first + 8).min(self.dims[0]);
        match self.inside(first..end, j, k) {
            Some(values) => match values.first_chunk() {
                Some(eight) => *out = *eight,
                None => out.iter_mut().zip(values).for_each(|(to, from)| *to = *from),
            },
            None => (first..end).for_each(|i| out[i - first] = self.value(i, j, k)),
        }
    }

    /// The values of a row with its rim.
    pub(crate) fn row(&self, j: usize, k: usize, out: &mut Vec<f32>) {
        out.clear();
        let rim = self.rim[0];
        let [n, ny, _] = self.inner;
        out.extend((0..rim).map(|i| self.value(i, j, k)));
        match self.inside(rim..rim + n, j, k) {
            None => {
                // The sum of [`Lattice::value`], term by term in the same order.
                let terms = self.terms(2, k).map(|(c, k)| self.terms(1, j).map(|(b, j)| (b * c, (k * ny + j) * n)));
                let sum = |i: usize| {
                    let shown = terms.iter().flatten().filter(|(share, _)| *share != 0.0);
                    shown.fold(0.0, |sum, (share, row)| sum + share * f64::from(self.values[row + i])) as f32
                };
                out.extend((0..n).map(sum));
            }
            Some(values) => out.extend_from_slice(values),
        }
        out.extend((rim + n..self.dims[0]).map(|i| self.value(i, j, k)));
    }
}

/// Spacing of a lattice along the third axis: the length of its row.
pub(crate) fn spacing_along(axes: &DMat3) -> f64 {
    axes.row(2).length()
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::glam::DVec3;

    #[test]
    fn a_linear_field_goes_on() {
        let dims = [5, 4, 6];
        let field = |[i, j, k]: [f64; 3]| 3.0 + 2.0 * i - j + 0.5 * k;
        let place = |n: usize| [n % 5, n / 5 % 4, n / 20].map(|v| v as f64);
        let values = (0..120).map(|n| field(place(n)) as f32).collect();
        let grid = Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims, values };
        let lattice = Lattice::new(&grid, Packing::Cartesian, [3, 2, 9]);
        assert_eq!((lattice.rim, lattice.dims), ([3, 2, 3], [11, 8, 12]));
        let mut row = Vec::new();
        for (k, j) in (0..12).flat_map(|k| (0..8).map(move |j| (k, j))) {
            lattice.row(j, k, &mut row);
            for (i, found) in row.iter().enumerate() {
                let expected = field([i as f64 - 3.0, j as f64 - 2.0, k as f64 - 3.0]) as f32;
                assert_eq!((*found, lattice.value(i, j, k)), (expected, expected), "{i} {j} {k}");
            }
        }
    }

    #[test]
    fn a_linear_field_goes_on_between_the_planes_of_a_body_centred_lattice() {
        let field = |[i, j, k]: [f64; 3]| 3.0 + 2.0 * i - j + 0.5 * k;
        let packing = Packing::BodyCentred;
        let place = |n: usize| {
            let shift = packing.shift(n / 20);
            [(n % 5) as f64 + shift, (n / 5 % 4) as f64 + shift, (n / 20) as f64]
        };
        for planes in [2, 8] {
            let values = (0..20 * planes).map(|n| field(place(n)) as f32).collect();
            let grid = Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims: [5, 4, planes], values };
            let lattice = Lattice::new(&grid, packing, [2, 3, 9]);
            assert_eq!((lattice.rim, lattice.dims), ([2, 3, 6], [9, 10, planes + 12]));
            // Two planes say nothing of how values rise from plane to plane of one lattice.
            for (k, j, i) in (0..planes + 12).flat_map(|k| (0..10).flat_map(move |j| (0..9).map(move |i| (k, j, i)))) {
                let shift = packing.shift(k);
                let up = if planes == 2 { (k % 2) as f64 } else { k as f64 - 6.0 };
                let expected = field([i as f64 - 2.0 + shift, j as f64 - 3.0 + shift, up]) as f32;
                assert_eq!(lattice.value(i, j, k), expected, "{planes}: {i} {j} {k}");
            }
        }
    }

    #[test]
    fn one_plane_goes_on_as_it_is() {
        let grid = Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims: [1, 1, 2], values: vec![4.0, 6.0] };
        let lattice = Lattice::new(&grid, Packing::Cartesian, [2, 2, 2]);
        assert_eq!((0..6).map(|k| lattice.value(0, 4, k)).collect::<Vec<_>>(), [2.0, 2.0, 4.0, 6.0, 8.0, 8.0]);
    }
}
