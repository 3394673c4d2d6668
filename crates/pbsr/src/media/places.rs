//! Places of particles in the cells of a grid, with value and gradient there, in lanes.
//!
//! A volume is made of voxels, each around its lattice point: n points along an axis span n steps. Cells lie between
//! lattice points. Cells at the border include the half steps beyond it too, where the value is the border's. So along an
//! axis a cell reaches from 0 (−½ for the first cell) to 1 (1½ for the last cell). An axis with a single lattice point
//! has one cell, from −½ to ½.

use crate::blocks::BATCH;
use crate::stream::triple;
use glam::{Mat3, Vec3};
use splat_core::{Grid, glam};

/// From indices to places.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lattice {
    axes: Mat3,
    /// Lattice points along x and y, and 1 over them.
    dims: [u32; 2],
    inverse_dims: [f64; 2],
    /// Where the last voxel ends along each axis, lattice coordinates.
    ends: Vec3,
}

impl Lattice {
    pub(crate) fn new(axes: Mat3, counts: [u32; 3]) -> Self {
        let [nx, ny, nz] = counts;
        let ends = Vec3::from_array([nx, ny, nz].map(|n| (f64::from(n) - 0.5) as f32));
        Self { axes, dims: [nx, ny], inverse_dims: [nx, ny].map(|n| 1.0 / f64::from(n)), ends }
    }

    /// Where the last voxel ends along each axis, lattice coordinates.
    #[cfg(feature = "gpu")]
    pub(crate) fn ends(&self) -> Vec3 {
        self.ends
    }

    /// The lattice indices of the cell's first corner.
    #[inline(always)]
    pub(crate) fn corner(&self, at: u32) -> [u32; 3] {
        let [nx, ny] = self.dims;
        // 32-bit numbers and a half are further from a whole quotient than f64 rounds: the quotients are exact.
        // Where the last bit of the sum is 1, its bits are those of the nearest whole number.
        const ONES: f64 = 6_755_399_441_055_744.0;
        let over = |v: u32, inverse: f64| ((f64::from(v) + 0.5) * inverse - 0.5 + ONES).to_bits() as u32;
        let row = over(at, self.inverse_dims[0]);
        let layer = over(row, self.inverse_dims[1]);
        [at.wrapping_sub(row.wrapping_mul(nx)), row.wrapping_sub(layer.wrapping_mul(ny)), layer]
    }

    /// From where to where a cell reaches along each axis, in steps from its first corner.
    #[inline(always)]
    fn reach(&self, corner: [u32; 3]) -> [[f32; 2]; 3] {
        std::array::from_fn(|a| {
            let left = self.ends[a] - corner[a] as f32;
            [if corner[a] == 0 { -0.5 } else { 0.0 }, if left < 2.0 { left } else { 1.0 }]
        })
    }

    /// Volume of a cell, in steps³: 1 but at the border.
    pub(crate) fn volume(&self, at: u32) -> f32 {
        self.reach(self.corner(at)).into_iter().map(|[low, high]| high - low).product()
    }

    /// The place at `f` in \[0, 1\]³ of a cell, in steps from its first corner.
    #[inline(always)]
    pub(crate) fn within(&self, corner: [u32; 3], f: [f32; 3]) -> [f32; 3] {
        let reach = self.reach(corner);
        std::array::from_fn(|a| reach[a][0] + f[a] * (reach[a][1] - reach[a][0]))
    }

    /// Offset from the grid's origin, so many steps from the first corner of a cell.
    #[inline(always)]
    pub(crate) fn offset(&self, cell: [u32; 3], within: [f32; 3]) -> Vec3 {
        let [i, j, k] = cell;
        self.axes * Vec3::new(i as f32 + within[0], j as f32 + within[1], k as f32 + within[2])
    }
}

/// The nearest place between the corners of a cell.
#[inline(always)]
pub(crate) fn between(within: [f32; 3]) -> [f32; 3] {
    within.map(|w| w.clamp(0.0, 1.0))
}

/// Cells along an axis of so many lattice points.
pub(crate) fn cells(points: usize) -> usize {
    points.saturating_sub(1).max(1)
}

/// From a lattice point to the next along each axis, in values; 0 where there is no other.
#[inline(always)]
pub(crate) fn steps(counts: [usize; 3]) -> [usize; 3] {
    let [nx, ny, nz] = counts;
    [usize::from(nx > 1), if ny > 1 { nx } else { 0 }, if nz > 1 { nx * ny } else { 0 }]
}

/// Values at the corners of the cell with this first corner, x first.
#[inline]
pub(crate) fn corners(grid: &Grid, at: u32) -> [f32; 8] {
    let [next, row, layer] = steps(grid.dims);
    let at = at as usize;
    let pair = |i: usize| -> [f32; 2] { [grid.values[i], grid.values[i + next]] };
    let [[a, b], [c, d], [e, f], [g, h]] = [pair(at), pair(at + row), pair(at + layer), pair(at + layer + row)];
    [a, b, c, d, e, f, g, h]
}

/// Value and lattice gradient at a place in \[0, 1\]³ of a cell with these values at its corners.
#[inline(always)]
pub(crate) fn interpolate(corners: [f32; 8], share: [f32; 3]) -> (f32, Vec3) {
    let [a0, a1, b0, b1, c0, c1, d0, d1] = corners;
    let [fx, fy, fz] = share;
    let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
    let [da, db, dc, dd] = [a1 - a0, b1 - b0, c1 - c0, d1 - d0];
    let [xa, xb, xc, xd] = [a0 + da * fx, b0 + db * fx, c0 + dc * fx, d0 + dd * fx];
    let [y0, y1] = [mix(xa, xb, fy), mix(xc, xd, fy)];
    let gradient = Vec3::new(mix(mix(da, db, fy), mix(dc, dd, fy), fz), mix(xb - xa, xd - xc, fz), y1 - y0);
    (mix(y0, y1, fz), gradient)
}

/// Particles of some cells. All columns are in one place, so that it is plain that they do not overlap.
pub(crate) struct Places {
    at: [u32; BATCH],
    corners: [[f32; BATCH]; 8],
    bits: [u64; BATCH],
    pub(crate) value: [f32; BATCH],
    gradient: [[f32; BATCH]; 3],
    offset: [[f32; BATCH]; 3],
}

impl Places {
    pub(crate) const EMPTY: Self = Self {
        at: [0; BATCH],
        corners: [[0.0; BATCH]; 8],
        bits: [0; BATCH],
        value: [0.0; BATCH],
        gradient: [[0.0; BATCH]; 3],
        offset: [[0.0; BATCH]; 3],
    };

    /// Particle `j` is to lie in the cell at index `at` with these values at its corners, where 64 random bits put it.
    #[inline]
    pub(crate) fn begin(&mut self, j: usize, at: u32, corners: [f32; 8], bits: u64) {
        (self.at[j], self.bits[j]) = (at, bits);
        (0..8).for_each(|c| self.corners[c][j] = corners[c]);
    }

    /// Finds places, values and gradients of the first `n`.
    pub(crate) fn find(&mut self, n: usize, lattice: &Lattice) {
        pulp::Arch::new().dispatch(Find { places: self, n: n.min(BATCH), lattice: *lattice });
    }

    /// Lattice gradient at particle `j`.
    #[inline]
    pub(crate) fn gradient(&self, j: usize) -> Vec3 {
        Vec3::from_array(self.gradient.each_ref().map(|column| column[j]))
    }

    /// Offset of particle `j` from the grid's origin.
    #[inline]
    pub(crate) fn offset(&self, j: usize) -> Vec3 {
        Vec3::from_array(self.offset.each_ref().map(|column| column[j]))
    }
}

/// In the form that [`pulp`] compiles once per instruction set.
struct Find<'a> {
    places: &'a mut Places,
    n: usize,
    lattice: Lattice,
}

impl pulp::NullaryFnOnce for Find<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { places, n, lattice } = self;
        for j in 0..n {
            let f = triple(places.bits[j]);
            let c = &places.corners;
            let corners = [c[0][j], c[1][j], c[2][j], c[3][j], c[4][j], c[5][j], c[6][j], c[7][j]];
            let corner = lattice.corner(places.at[j]);
            let within = lattice.within(corner, f);
            let (value, gradient) = interpolate(corners, between(within));
            let offset = lattice.offset(corner, within);
            places.value[j] = value;
            [places.gradient[0][j], places.gradient[1][j], places.gradient[2][j]] = gradient.to_array();
            [places.offset[0][j], places.offset[1][j], places.offset[2][j]] = offset.to_array();
        }
    }
}
