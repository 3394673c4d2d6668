//! Regular volumes, on Cartesian and on body-centred cubic lattices.

use crate::Error;
use glam::{DMat3, DVec3};
use rayon::prelude::*;
use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2};

/// A volume of scalars on a regular lattice, x fastest.
///
/// Lattice point (i, j, k) lies at `origin + axes · (i, j, k)`, world units of the file.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// Position of lattice point (0, 0, 0).
    pub origin: DVec3,
    /// Columns: the steps along i, j and k. A sheared or mirrored lattice is allowed, a flat one is not.
    pub axes: DMat3,
    /// Lattice points along i, j and k.
    pub dims: [usize; 3],
    /// Values, `dims` product many.
    pub values: Vec<f32>,
}

impl Grid {
    /// Value at lattice point (i, j, k), each clamped to the lattice.
    pub fn at_clamped(&self, i: isize, j: isize, k: isize) -> f32 {
        let c = |v: isize, n: usize| v.clamp(0, n as isize - 1) as usize;
        self.values[(c(k, self.dims[2]) * self.dims[1] + c(j, self.dims[1])) * self.dims[0] + c(i, self.dims[0])]
    }

    /// World position of lattice point (i, j, k).
    pub fn position(&self, i: usize, j: usize, k: usize) -> DVec3 {
        self.origin + self.axes * DVec3::new(i as f64, j as f64, k as f64)
    }

    /// Volume of one lattice cell, world units³, > 0.
    pub fn cell_volume(&self) -> f64 {
        self.axes.determinant().abs()
    }

    /// Bytes held by the values.
    pub fn bytes(&self) -> u64 {
        size_of_val(self.values.as_slice()) as u64
    }

    /// Length of the shortest step along a side of a cell.
    pub fn shortest_step(&self) -> f64 {
        [self.axes.x_axis, self.axes.y_axis, self.axes.z_axis].iter().fold(f64::INFINITY, |s, a| s.min(a.length()))
    }

    /// A lattice of fewer points for previews: each has the mean of a block of `side` points along each axis, or of as many as leave `least` blocks along
    /// it. Points without a value (NaN) have no share in a mean, and a block of such points has none. The last block of an axis may have fewer points.
    ///
    /// ```
    /// use splat_core::{Grid, glam::{DMat3, DVec3}};
    /// let values = (0..64).map(|place| (place % 4) as f32).collect();
    /// let grid = Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims: [4, 4, 4], values };
    /// let coarse = grid.coarsened(2, 1);
    /// assert_eq!((coarse.dims, coarse.origin), ([2, 2, 2], DVec3::splat(0.5)));
    /// assert_eq!(coarse.values, [0.5, 2.5].repeat(4));
    /// ```
    pub fn coarsened(&self, side: usize, least: usize) -> Self {
        let sides = self.dims.map(|count| side.min(count / least.max(1)).max(1));
        let steps = DVec3::from_array(sides.map(|side| side as f64));
        let dims = std::array::from_fn(|axis| self.dims[axis].div_ceil(sides[axis]));
        let mut values = vec![0.0; dims.iter().product()];
        let row_of_blocks = |counts: &mut Vec<u32>, (row, sums): (usize, &mut [f32])| {
            counts.clear();
            counts.resize(sums.len(), 0);
            let first = [row % dims[1] * sides[1], row / dims[1] * sides[2]];
            for k in first[1]..(first[1] + sides[2]).min(self.dims[2]) {
                for j in first[0]..(first[0] + sides[1]).min(self.dims[1]) {
                    let start = (k * self.dims[1] + j) * self.dims[0];
                    let blocks = self.values[start..start + self.dims[0]].chunks(sides[0]);
                    for ((sum, count), block) in sums.iter_mut().zip(counts.iter_mut()).zip(blocks) {
                        for value in block.iter().filter(|value| !value.is_nan()) {
                            *sum += value;
                            *count += 1;
                        }
                    }
                }
            }
            sums.iter_mut().zip(counts).for_each(|(sum, count)| *sum /= *count as f32);
        };
        values.par_chunks_mut(dims[0].max(1)).enumerate().for_each_init(Vec::new, row_of_blocks);
        let origin = self.origin + self.axes * ((steps - 1.0) / 2.0);
        Self { origin, axes: self.axes * DMat3::from_diagonal(steps), dims, values }
    }

    /// Checks dimensions against the values, finite values and a lattice that spans space.
    ///
    /// # Errors
    /// [`Error::Invalid`] or [`Error::ColumnLength`] for the first that does not hold.
    pub fn validate(&self) -> Result<(), Error> {
        let expected = self.dims.iter().try_fold(1usize, |n, &d| n.checked_mul(d));
        if expected != Some(self.values.len()) || self.values.is_empty() {
            return Err(Error::invalid("grid", 0, "dims", self.dims, "as many lattice points as values, at least one"));
        }
        let volume = self.cell_volume();
        if !(volume.is_finite() && volume > 0.0 && self.origin.is_finite()) {
            return Err(Error::invalid("grid", 0, "axes", self.axes, "three finite steps that span space"));
        }
        // Some at once, so that vectors are compared.
        let are_finite = |some: &[f32]| some.iter().fold(true, |are, v| are & v.is_finite());
        if !self.values.chunks(256).all(are_finite)
            && let Some(i) = self.values.iter().position(|v| !v.is_finite())
        {
            return Err(Error::invalid("voxel", i, "value", self.values[i], "a finite number"));
        }
        Ok(())
    }
}

/// How values between lattice points come about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Interpolation {
    /// From the eight corners of the cell; creases at the faces of cells.
    #[default]
    Trilinear,
    /// From 64 lattice points by cubics; continuous gradients, values may overshoot.
    CatmullRom,
}

/// How the planes of a lattice lie, k = 0, 1, 2 …
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Packing {
    /// Each like the one before it.
    #[default]
    Cartesian,
    /// Every second one, k = 1, 3, 5 …, half a step further along i and along j: with steps of a, a and a/2 at right angles the
    /// body-centred cubic lattice of cell edge a.
    BodyCentred,
}

impl Packing {
    /// How far plane k lies along i and along j, steps.
    pub const fn shift(self, k: usize) -> f64 {
        match self {
            Self::BodyCentred if k % 2 == 1 => 0.5,
            _ => 0.0,
        }
    }

    /// The lowest corner of what a lattice fills, lattice coordinates; the highest one lies as many steps further as there are points.
    /// Every point has the same share of it.
    pub const fn lowest(self) -> DVec3 {
        match self {
            Self::Cartesian => DVec3::splat(-0.5),
            Self::BodyCentred => DVec3::new(-0.25, -0.25, -0.5),
        }
    }

    /// Steps of the Cartesian lattice that holds the same spectrum as one with steps `axes`, columns: the nearest copies of the
    /// spectrum are as far away. A body-centred cubic lattice of cell edge a does what a Cartesian one of spacing a/√2 does
    /// with 1/√2 of the points (Theußl, Möller, Gröller 2001, "Optimal regular volume sampling").
    pub fn equivalent_steps(self, axes: DMat3) -> DMat3 {
        match self {
            Self::Cartesian => axes,
            Self::BodyCentred => axes * DMat3::from_diagonal(DVec3::new(FRAC_1_SQRT_2, FRAC_1_SQRT_2, SQRT_2)),
        }
    }
}

/// A volume of scalars on a body-centred lattice: two Cartesian ones, each with its points in the middles of the other's cells.
///
/// It is stored as planes, those of one lattice and of the other in turns. Nothing but what asks for [`Packing::BodyCentred`] may read
/// the planes as a [`Grid`], hence a type of its own.
///
/// ```
/// use splat_core::{BccGrid, Grid, glam::{DMat3, DVec3}};
/// // Cells of edge 2: planes a distance of 1 apart.
/// let axes = DMat3::from_diagonal(DVec3::new(2.0, 2.0, 1.0));
/// let bcc = BccGrid { planes: Grid { origin: DVec3::ZERO, axes, dims: [4, 4, 8], values: vec![0.0; 128] } };
/// bcc.validate().unwrap();
/// assert_eq!(bcc.position(1, 0, 2), DVec3::new(2.0, 0.0, 2.0));
/// // The middle of a cell.
/// assert_eq!(bcc.position(1, 0, 3), DVec3::new(3.0, 1.0, 3.0));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct BccGrid {
    /// Values plane by plane, as [`Packing::BodyCentred`] has them.
    pub planes: Grid,
}

impl BccGrid {
    /// World position of lattice point (i, j, k).
    pub fn position(&self, i: usize, j: usize, k: usize) -> DVec3 {
        let shift = Packing::BodyCentred.shift(k);
        self.planes.origin + self.planes.axes * DVec3::new(i as f64 + shift, j as f64 + shift, k as f64)
    }

    /// Checks what [`Grid::validate`] does, and that there are as many planes of each lattice.
    ///
    /// # Errors
    /// [`Error::Invalid`] or [`Error::ColumnLength`] for the first that does not hold.
    pub fn validate(&self) -> Result<(), Error> {
        if !self.planes.dims[2].is_multiple_of(2) {
            let expected = "an even number of planes, as many of each lattice";
            return Err(Error::invalid("body-centred grid", 0, "dims", self.planes.dims, expected));
        }
        self.planes.validate()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_body_centred_lattice_has_eight_neighbours_in_its_corners_and_six_behind_them() {
        let edge = 2.0;
        let axes = DMat3::from_diagonal(DVec3::new(edge, edge, 0.5 * edge));
        let planes = Grid { origin: DVec3::ONE, axes, dims: [5, 5, 10], values: vec![0.0; 250] };
        let bcc = BccGrid { planes };
        for k in [4, 5] {
            let here = bcc.position(2, 2, k);
            let distances =
                (0..250).map(|n| bcc.position(n % 5, n / 5 % 5, n / 25).distance(here)).filter(|d| *d > 0.0);
            let near: Vec<f64> = distances.filter(|d| *d < 1.01 * edge).collect();
            let corners = near.iter().filter(|d| (*d - 0.75f64.sqrt() * edge).abs() < 1e-12).count();
            let faces = near.iter().filter(|d| (*d - edge).abs() < 1e-12).count();
            assert_eq!((corners, faces, near.len()), (8, 6, 14), "plane {k}");
        }
        // 1/√2 of the points of the Cartesian lattice of the same spectrum, which is cubic.
        let steps = Packing::BodyCentred.equivalent_steps(axes);
        assert!((axes.determinant() / steps.determinant() - SQRT_2).abs() < 1e-12, "{steps}");
        assert!(
            (steps - DMat3::from_diagonal(DVec3::splat(edge / SQRT_2))).to_cols_array().iter().all(|d| d.abs() < 1e-12)
        );
        assert!(bcc.validate().is_ok());
        let odd = Grid { dims: [5, 10, 5], ..bcc.planes };
        assert!(matches!(BccGrid { planes: odd }.validate(), Err(Error::Invalid { .. })));
    }

    #[test]
    fn blocks_have_the_means_of_their_known_points_at_their_middles() {
        // A ramp of the place along i, a sheared lattice, and a column without values; 5 points end in a block of one.
        let dims = [5, 4, 3];
        let value = |rank: usize| if rank % 20 < 5 && rank % 5 == 1 { f32::NAN } else { (rank % 5) as f32 };
        let axes = DMat3::from_cols(DVec3::new(2.0, 0.5, 0.0), DVec3::Y, DVec3::Z);
        let grid = Grid { origin: DVec3::X, axes, dims, values: (0..60).map(value).collect() };
        let coarse = grid.coarsened(2, 2);
        // Along k a block of two would leave one block and a half.
        assert_eq!(coarse.dims, [3, 2, 3]);
        assert_eq!(coarse.position(0, 0, 0), grid.origin + grid.axes * DVec3::new(0.5, 0.5, 0.0));
        let row = |j: usize| &coarse.values[3 * j..3 * j + 3];
        assert_eq!((row(0), row(1)), (&[1.0 / 3.0, 2.5, 4.0][..], &[0.5, 2.5, 4.0][..]));
        assert_eq!(grid.coarsened(1, 1).dims, dims);
        let none = Grid { values: vec![f32::NAN; 60], ..grid };
        assert!(none.coarsened(9, 1).values.iter().all(|value| value.is_nan()));
    }
}
