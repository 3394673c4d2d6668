//! Lattices that are gathered: what a place of a sheet reads, where splatting has each voxel write sheets.
//!
//! Many neighbouring places at once are interpolated: linearly between eight voxels, as most ray casters have it, or by a cubic B-spline over a
//! lattice that was filtered once ([`filter`]), which is the paper's kernel within 0.4 % of a step edge. What no transfer function shows is not
//! read ([`bricks`]).

pub(crate) mod bricks;
#[cfg(feature = "reference")]
pub(crate) mod exact;
mod filter;
pub(crate) mod gradient;

use crate::Volume;
use crate::shared::classifier::Base;
use crate::shared::lattice::Lattice;
use crate::shared::lattice::near::Near;
use crate::shared::params::GatherKernel;
use crate::shared::vectors::NATURAL;
use crate::shared::voxels::{Voxels, without_extinction};
use bricks::{Box3, Bricks};
use splat_core::glam::IVec3;
use splat_core::raster::lanes::{Broadcast, Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;
use splat_core::{Grid, Packing, TransferFunction};
use std::borrow::Cow;

/// Voxels around the lattice that continue its values: kernels of places in the outermost cells reach them.
pub(crate) const RIM: [usize; 3] = [2; 3];

/// A lattice that sheets read.
pub(crate) struct Gathered<'a> {
    kernel: GatherKernel,
    /// Values of the file, or coefficients of a B-spline, which are relative to the volume's base.
    values: Cow<'a, [f32]>,
    /// Numbers along each axis, and how many of them lie before the lattice.
    stored: [usize; 3],
    before: usize,
    /// First and last cell along each axis, counted as numbers are.
    cells: [[i32; 3]; 2],
    relative: Relative,
    bricks: Bricks,
}

/// What is left to be done to make what is stored relative to the volume's base: less `high`, less `low`, times `factor`.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Relative {
    high: f32,
    low: f32,
    factor: f32,
}

/// The cell that neighbouring places are counted from, so that single precision tells them apart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Corner {
    before: f64,
    /// Its place, counted as numbers are.
    cell: [i32; 3],
    /// Where its number is stored.
    start: usize,
    /// How far behind it the last cell is along each axis.
    last: [f32; 3],
}

impl<'a> Gathered<'a> {
    /// The lattice of a volume and the voxels that may be seen, `near` being the neighbours that shape what is seen at one.
    pub(crate) fn new(
        volume: &Volume<'a>,
        kernel: GatherKernel,
        transfer: &TransferFunction,
        base: Base,
        near: &Near,
    ) -> (Self, Voxels) {
        let grid = volume.grid;
        let hidden = without_extinction(transfer);
        let dims = grid.dims;
        let last = |stored: [usize; 3], behind: usize| stored.map(|n| (n - 1 - behind) as i32);
        match kernel {
            GatherKernel::Linear => {
                let lattice = Lattice::over(&grid.values, dims, Packing::Cartesian, RIM);
                let voxels = Voxels::needed(&lattice, &hidden, near);
                let stored = dims.map(|n| n.max(2));
                // A lattice goes on beyond its faces as its outermost cells do. Of a single plane there are two, so that it has cells.
                let values = if stored == dims { Cow::Borrowed(&grid.values[..]) } else { Cow::Owned(doubled(grid)) };
                let cells = [[0; 3], last(stored, 1)];
                let relative = Relative::of_raw(base);
                (Self { kernel, values, stored, before: 0, cells, relative, bricks: Bricks::new(&voxels) }, voxels)
            }
            GatherKernel::Gaussian => {
                let hidden: Vec<_> = hidden.iter().map(|range| range.relative_to(base)).collect();
                let before = RIM[0];
                let stored = dims.map(|n| n + 2 * before);
                let values = filter::coefficients(grid, base, before);
                let lattice = Lattice::over(&values, stored, Packing::Cartesian, [0; 3]);
                let voxels = Voxels::needed(&lattice, &hidden, near);
                let bricks = Bricks::new(&voxels);
                let cells = [[1; 3], last(stored, 2)];
                let values = Cow::Owned(values);
                (Self { kernel, values, stored, before, cells, relative: Relative::NONE, bricks }, voxels)
            }
        }
    }

    /// Bytes of what is kept beside the file's own values.
    pub(crate) fn bytes(&self) -> u64 {
        let owned = if matches!(self.values, Cow::Owned(_)) { 4 * self.values.len() as u64 } else { 0 };
        owned + self.bricks.bytes()
    }

    /// Whether anything may be seen in some cells.
    #[inline(always)]
    pub(crate) fn shows(&self, cells: &Box3) -> bool {
        self.bricks.is_any(cells)
    }

    /// What places in some cells are counted from.
    #[inline(always)]
    pub(crate) fn corner(&self, cells: &Box3) -> Corner {
        let mut cell = [0; 3];
        let mut last = [0.0; 3];
        for a in 0..3 {
            let low = cells.low[a].saturating_add(self.before as i32);
            cell[a] = low.clamp(self.cells[0][a], self.cells[1][a]);
            last[a] = (self.cells[1][a] - cell[a]) as f32;
        }
        let start = (cell[2] as usize * self.stored[1] + cell[1] as usize) * self.stored[0] + cell[0] as usize;
        Corner { before: self.before as f64, cell, start, last }
    }

    /// The first cell, for places anywhere in the lattice.
    #[inline(always)]
    fn first_corner(&self) -> Corner {
        self.corner(&Box3 { low: IVec3::MIN, high: IVec3::MAX })
    }

    /// Values at places that are counted from a corner, relative to the volume's base.
    #[inline(always)]
    pub(crate) fn values<S: Simd>(&self, simd: S, corner: &Corner, places: &[Lanes<S>; 3]) -> Lanes<S> {
        let value = match self.kernel {
            GatherKernel::Linear => self.linear(simd, corner.start, places, &corner.last),
            GatherKernel::Gaussian => self.cubic(simd, corner.start, places, &corner.last),
        };
        let relative = self.relative;
        (value - simd.lanes(relative.high) - simd.lanes(relative.low)) * simd.lanes(relative.factor)
    }

    /// The first voxels of the cells of places, which are counted from `start`, and how far behind these the places lie along each axis: in \[0, 1\], and
    /// farther before the first cell and behind the `last` where the lattice goes on as they do.
    #[inline(always)]
    fn cells<S: Simd>(
        &self,
        simd: S,
        start: usize,
        places: &[Lanes<S>; 3],
        last: &[f32; 3],
    ) -> ([usize; MAX_LANES], [Lanes<S>; 3]) {
        let natural = simd.lanes(NATURAL);
        let outside = self.kernel.outside();
        let mut parts = *places;
        let mut cells = [[0.0f32; MAX_LANES]; 3];
        for a in 0..3 {
            let place = places[a].max(simd.lanes(-outside)).min(simd.lanes(last[a] + 1.0 + outside));
            // Half a step less, rounded: the voxel before, and for a place at a voxel that or the one before it.
            let rounded = (place - simd.lanes(0.5)) + natural;
            let cell = rounded.max(natural).min(simd.lanes(NATURAL + last[a]));
            parts[a] = place - (cell - natural);
            cell.store(&mut cells[a]);
        }
        let row = self.stored[0];
        let plane = row * self.stored[1];
        // Of natural numbers as they are stored, what they all have too much.
        let start = start.wrapping_sub((NATURAL.to_bits() as usize).wrapping_mul(1 + row + plane));
        let mut firsts = [0; MAX_LANES];
        for lane in 0..Lanes::<S>::COUNT {
            let cell = |a: usize| cells[a][lane].to_bits() as usize;
            let along = start.wrapping_add(cell(0)).wrapping_add(cell(1).wrapping_mul(row));
            firsts[lane] = along.wrapping_add(cell(2).wrapping_mul(plane));
        }
        (firsts, parts)
    }

    /// Linear between the eight voxels around each place; `start` is the voxel that places are counted from.
    #[inline(always)]
    fn linear<S: Simd>(&self, simd: S, start: usize, places: &[Lanes<S>; 3], last: &[f32; 3]) -> Lanes<S> {
        let [nx, ny, _] = self.stored;
        let (firsts, parts) = self.cells(simd, start, places, last);
        // Eight slices of one length, one a corner: the check of a place in one serves the others.
        let count = self.values.len() - (nx * ny + nx + 1);
        let offsets = [0, 1, nx, nx + 1, nx * ny, nx * ny + 1, nx * ny + nx, nx * ny + nx + 1];
        let mut from = [&self.values[..]; 8];
        for c in 0..8 {
            from[c] = &self.values[offsets[c]..offsets[c] + count];
        }
        let mut corners = [[0.0; MAX_LANES]; 8];
        for lane in 0..Lanes::<S>::COUNT {
            let here = firsts[lane];
            for c in 0..8 {
                corners[c][lane] = from[c][here];
            }
        }
        let near = between(edge(simd, &corners, 0, parts[0]), edge(simd, &corners, 2, parts[0]), parts[1]);
        let far = between(edge(simd, &corners, 4, parts[0]), edge(simd, &corners, 6, parts[0]), parts[1]);
        between(near, far, parts[2])
    }

    /// A cubic B-spline of the 64 voxels around each place.
    #[inline(always)]
    fn cubic<S: Simd>(&self, simd: S, start: usize, places: &[Lanes<S>; 3], last: &[f32; 3]) -> Lanes<S> {
        let [nx, ny, _] = self.stored;
        let (firsts, parts) = self.cells(simd, start, places, last);
        let mut weights = [[[0.0; MAX_LANES]; 4]; 3];
        for a in 0..3 {
            let [first, second, third, fourth] = spline(simd, parts[a]);
            first.store(&mut weights[a][0]);
            second.store(&mut weights[a][1]);
            third.store(&mut weights[a][2]);
            fourth.store(&mut weights[a][3]);
        }
        let mut out = [0.0; MAX_LANES];
        for lane in 0..Lanes::<S>::COUNT {
            let corner = firsts[lane] - (nx * ny + nx + 1);
            let mut sums = [0.0f32; 4];
            for k in 0..4 {
                let mut plane = [0.0f32; 4];
                for j in 0..4 {
                    let at = corner + (k * ny + j) * nx;
                    let Some(row) = self.values[at..].first_chunk::<4>() else { continue };
                    let weight = weights[1][j][lane];
                    for c in 0..4 {
                        plane[c] = weight.mul_add(row[c], plane[c]);
                    }
                }
                let weight = weights[2][k][lane];
                for c in 0..4 {
                    sums[c] = weight.mul_add(plane[c], sums[c]);
                }
            }
            let across = |c: usize| weights[0][c][lane] * sums[c];
            out[lane] = (across(0) + across(1)) + (across(2) + across(3));
        }
        Lanes::load(simd, &out)
    }
}

impl GatherKernel {
    /// Voxels before and behind a cell's first that have a share in it.
    fn reach(self) -> [usize; 2] {
        match self {
            Self::Linear => [0, 1],
            Self::Gaussian => [1, 2],
        }
    }

    /// How far outside of its cells the lattice goes on as these do, steps: straight where it is straight in a cell; else its rim has cells of their own.
    fn outside(self) -> f32 {
        match self {
            Self::Linear => 1.0,
            Self::Gaussian => 0.0,
        }
    }

    /// Voxels that have a share in anything that one of them shapes.
    pub(crate) fn near(self, further: [usize; 3]) -> Near {
        let [before, behind] = self.reach();
        Near::block(further.map(|steps| before + behind + steps))
    }
}

impl Relative {
    const NONE: Self = Self { high: 0.0, low: 0.0, factor: 1.0 };

    fn of_raw(base: Base) -> Self {
        let [middle, factor] = base.parts();
        let high = middle as f32;
        Self { high, low: (middle - f64::from(high)) as f32, factor: factor as f32 }
    }
}

impl Corner {
    /// A lattice coordinate along an axis, counted from the corner.
    #[inline(always)]
    pub(crate) fn from(&self, a: usize, place: f64) -> f64 {
        place + self.before - f64::from(self.cell[a])
    }
}

/// The values of a grid, each plane of an axis that has one alone twice.
fn doubled(grid: &Grid) -> Vec<f32> {
    let dims = grid.dims.map(|n| n.max(2));
    let place = |n: usize| [n % dims[0], n / dims[0] % dims[1], n / (dims[0] * dims[1])];
    let value = |n: usize| {
        let [i, j, k] = place(n);
        let inside = |i: usize, a: usize| i.min(grid.dims[a] - 1);
        grid.values[(inside(k, 2) * grid.dims[1] + inside(j, 1)) * grid.dims[0] + inside(i, 0)]
    };
    (0..dims.iter().product()).map(value).collect()
}

// Functions, since closures are not always compiled into code for vectors.

/// A part of the way from one value to another.
#[inline(always)]
fn between<S: Simd>(low: Lanes<S>, high: Lanes<S>, part: Lanes<S>) -> Lanes<S> {
    (high - low).mul_add(part, low)
}

/// A part of the way from a corner of each cell to the next one.
#[inline(always)]
fn edge<S: Simd>(simd: S, corners: &[[f32; MAX_LANES]; 8], corner: usize, part: Lanes<S>) -> Lanes<S> {
    between(Lanes::load(simd, &corners[corner]), Lanes::load(simd, &corners[corner + 1]), part)
}

/// The four shares of a cubic B-spline, a part `t` of a step behind the second voxel.
#[inline(always)]
fn spline<S: Simd>(simd: S, t: Lanes<S>) -> [Lanes<S>; 4] {
    let one = simd.lanes(1.0);
    let half = simd.lanes(0.5);
    let sixth = simd.lanes(1.0 / 6.0);
    let two_thirds = simd.lanes(2.0 / 3.0);
    let u = one - t;
    let second = two_thirds - half * t * t * (one + u);
    let third = two_thirds - half * u * u * (one + t);
    [sixth * u * u * u, second, third, sixth * t * t * t]
}
