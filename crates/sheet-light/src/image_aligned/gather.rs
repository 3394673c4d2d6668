//! Sheets by gathering: each pixel of a sheet reads the lattice, where splatting has each voxel write sheets.
//!
//! A sheet across the view is a plane of constant view depth, so a row of its pixels is a straight line of constant step through the lattice,
//! through any lens. Along it values are interpolated, many pixels at once: linearly between eight voxels, as most ray casters have it, or by a
//! cubic B-spline over a lattice that was filtered once ([`filter`]), which is the paper's kernel within 0.4 % of a step edge. Slabs,
//! classification, gradients and light stay as they are. What no transfer function shows is not read ([`bricks`]).

mod bricks;
#[cfg(feature = "reference")]
pub(crate) mod exact;
mod filter;

use super::tile::rays::{Crossings, Slopes};
use super::tile::sheets::Sheets;
use super::tile::size::SIDE;
use crate::Volume;
use crate::shared::classifier::Base;
use crate::shared::lattice::Lattice;
use crate::shared::lattice_rays::LatticeRays;
use crate::shared::near::Near;
use crate::shared::params::GatherKernel;
use crate::shared::slabs::{BATCH, Slabs};
use crate::shared::value_range::ValueRange;
use crate::shared::vectors::{COUNTING, NATURAL};
use crate::shared::voxels::{Voxels, without_extinction};
use bricks::{Box3, Bricks};
use rayon::prelude::*;
use splat_core::glam::DVec3;
use splat_core::raster::lanes::{Lanes, MAX_LANES};
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

/// Neighbouring pixels of a sheet in lattice coordinates: pixel n of the row at `first` + n·`step`.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Row {
    first: DVec3,
    step: DVec3,
}

/// What one sheet's row of a tile asks for.
pub(crate) struct SheetLines<'a> {
    pub(crate) rays: &'a LatticeRays,
    pub(crate) slopes: &'a Slopes,
    pub(crate) slabs: &'a Slabs,
    pub(crate) crossings: &'a Crossings,
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
        let seen = |values: &[f32], hidden: &[ValueRange]| {
            Voxels::needed(&Lattice::over(values, dims, Packing::Cartesian, RIM), hidden, near)
        };
        let last = |stored: [usize; 3], behind: usize| stored.map(|n| (n - 1 - behind) as i32);
        match kernel {
            GatherKernel::Linear => {
                let voxels = seen(&grid.values, &hidden);
                let stored = dims.map(|n| n.max(2));
                // A lattice goes on beyond its faces as its outermost cells do. Of a single plane there are two, so that it has cells.
                let values = if stored == dims { Cow::Borrowed(&grid.values[..]) } else { Cow::Owned(doubled(grid)) };
                let cells = [[0; 3], last(stored, 1)];
                let relative = Relative::of_raw(base);
                (Self { kernel, values, stored, before: 0, cells, relative, bricks: Bricks::new(&voxels) }, voxels)
            }
            GatherKernel::Gaussian => {
                let hidden: Vec<_> = hidden.iter().map(|range| range.relative_to(base)).collect();
                let coefficients = filter::coefficients(grid, base);
                let voxels = seen(&coefficients, &hidden);
                let lattice = Lattice::over(&coefficients, dims, Packing::Cartesian, RIM);
                let values = with_rim(&lattice);
                let cells = [[1; 3], last(lattice.dims, 2)];
                let bricks = Bricks::new(&voxels);
                let stored = lattice.dims;
                let relative = Relative::NONE;
                (Self { kernel, values: Cow::Owned(values), stored, before: RIM[0], cells, relative, bricks }, voxels)
            }
        }
    }

    /// Bytes of what is kept beside the file's own values.
    pub(crate) fn bytes(&self) -> u64 {
        let owned = if matches!(self.values, Cow::Owned(_)) { 4 * self.values.len() as u64 } else { 0 };
        owned + self.bricks.bytes()
    }

    /// Reads the sheets of a batch in the pixels of `mask`, a bit each. Returns the number of pixels.
    #[inline(always)]
    pub(crate) fn batch<S: Simd>(
        &self,
        simd: S,
        lines: &SheetLines<'_>,
        batch: u32,
        mask: &[u64; SIDE],
        sheets: &mut Sheets,
    ) -> u64 {
        let mut pixels = 0;
        let first = batch * BATCH;
        let corners = |slab: u32| {
            [[0, 0], [SIDE - 1, 0], [0, SIDE - 1], [SIDE - 1, SIDE - 1]].map(|[x, y]| lines.place(slab, x, y))
        };
        let whole = corners(first).into_iter().chain(corners(first + BATCH - 1));
        let is_seen = self.bricks.is_any(&Box3::around(whole));
        for slab in first..first + BATCH {
            for y in 0..SIDE {
                let mut tags = 0;
                if is_seen && mask[y] != 0 {
                    let row = Row::new(lines.place(slab, 0, y), lines.place(slab, SIDE - 1, y));
                    if self.bricks.is_any(&row.between(0, SIDE - 1)) {
                        let inside = lines.inside(simd, slab, y);
                        tags = self.row(simd, &row, mask[y] & inside, sheets.begin_values(slab, y));
                    }
                }
                pixels += u64::from(tags.count_ones());
                sheets.finish_row(slab, y, tags);
            }
        }
        pixels
    }

    /// Values of the pixels of a row that `mask` has and that may show anything, and which these are, a bit each.
    #[inline(always)]
    fn row<S: Simd>(&self, simd: S, row: &Row, mask: u64, out: &mut [f32]) -> u64 {
        let mut tags = 0;
        for x in (0..SIDE).step_by(Lanes::<S>::COUNT) {
            let bits = ((1 << Lanes::<S>::COUNT) - 1) << x & ((1 << SIDE) - 1);
            if mask & bits == 0 {
                continue;
            }
            let part = row.between(x, x + Lanes::<S>::COUNT - 1);
            if !self.bricks.is_any(&part) {
                continue;
            }
            tags |= bits;
            let mut values = [0.0; MAX_LANES];
            // Counted from the corner of what they cross, so that single precision tells places apart.
            let mut corner = [0; 3];
            let mut last = [0.0; 3];
            let counting = Lanes::load(simd, &COUNTING);
            let mut places = [counting; 3];
            for a in 0..3 {
                let low = part.low[a].saturating_add(self.before as i32);
                corner[a] = low.clamp(self.cells[0][a], self.cells[1][a]);
                last[a] = (self.cells[1][a] - corner[a]) as f32;
                let first = row.first[a] + row.step[a] * x as f64 + self.before as f64 - f64::from(corner[a]);
                places[a] = counting.mul_add(Lanes::splat(simd, row.step[a] as f32), Lanes::splat(simd, first as f32));
            }
            let start =
                (corner[2] as usize * self.stored[1] + corner[1] as usize) * self.stored[0] + corner[0] as usize;
            match self.kernel {
                GatherKernel::Linear => self.linear(simd, start, &places, &last, &mut values),
                GatherKernel::Gaussian => self.cubic(simd, start, &places, &last, &mut values),
            }
            let relative = self.relative;
            let value = Lanes::load(simd, &values) - Lanes::splat(simd, relative.high);
            let value = (value - Lanes::splat(simd, relative.low)) * Lanes::splat(simd, relative.factor);
            if x + Lanes::<S>::COUNT <= SIDE {
                value.store(&mut out[x..]);
            } else {
                value.store(&mut values);
                out[x..SIDE].copy_from_slice(&values[..SIDE - x]);
            }
        }
        tags
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
        let natural = Lanes::splat(simd, NATURAL);
        let outside = self.kernel.outside();
        let mut parts = *places;
        let mut firsts = [start; MAX_LANES];
        let mut stride = 1;
        for a in 0..3 {
            let place = places[a].max(Lanes::splat(simd, -outside)).min(Lanes::splat(simd, last[a] + 1.0 + outside));
            // Half a step less, rounded: the voxel before, and for a place at a voxel that or the one before it.
            let rounded = (place - Lanes::splat(simd, 0.5)) + natural;
            let cell = rounded.max(natural).min(Lanes::splat(simd, NATURAL + last[a]));
            parts[a] = place - (cell - natural);
            let mut stored = [0.0f32; MAX_LANES];
            cell.store(&mut stored);
            for lane in 0..Lanes::<S>::COUNT {
                firsts[lane] += stride * (stored[lane].to_bits() - NATURAL.to_bits()) as usize;
            }
            stride *= self.stored[a];
        }
        (firsts, parts)
    }

    /// Linear between the eight voxels around each place; `start` is the voxel that places are counted from.
    #[inline(always)]
    fn linear<S: Simd>(
        &self,
        simd: S,
        start: usize,
        places: &[Lanes<S>; 3],
        last: &[f32; 3],
        out: &mut [f32; MAX_LANES],
    ) {
        let [nx, ny, _] = self.stored;
        let (firsts, parts) = self.cells(simd, start, places, last);
        let mut corners = [[0.0; MAX_LANES]; 8];
        for lane in 0..Lanes::<S>::COUNT {
            let here = firsts[lane];
            for (row, at) in [here, here + nx, here + nx * ny, here + nx * ny + nx].into_iter().enumerate() {
                let pair = &self.values[at..at + 2];
                corners[2 * row][lane] = pair[0];
                corners[2 * row + 1][lane] = pair[1];
            }
        }
        let between = |low: Lanes<S>, high: Lanes<S>, part: Lanes<S>| (high - low).mul_add(part, low);
        let edge = |row: usize| {
            between(Lanes::load(simd, &corners[2 * row]), Lanes::load(simd, &corners[2 * row + 1]), parts[0])
        };
        let near = between(edge(0), edge(1), parts[1]);
        let far = between(edge(2), edge(3), parts[1]);
        between(near, far, parts[2]).store(out);
    }

    /// A cubic B-spline of the 64 voxels around each place.
    #[inline(always)]
    fn cubic<S: Simd>(
        &self,
        simd: S,
        start: usize,
        places: &[Lanes<S>; 3],
        last: &[f32; 3],
        out: &mut [f32; MAX_LANES],
    ) {
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
        for lane in 0..Lanes::<S>::COUNT {
            let corner = firsts[lane] - (nx * ny + nx + 1);
            let mut sums = [0.0f32; 4];
            for k in 0..4 {
                let mut plane = [0.0f32; 4];
                for j in 0..4 {
                    let at = corner + (k * ny + j) * nx;
                    let Some(row) = self.values[at..].first_chunk::<4>() else { return };
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

impl Row {
    fn new(first: DVec3, last: DVec3) -> Self {
        Self { first, step: (last - first) / (SIDE - 1) as f64 }
    }

    /// The cells between two of its pixels.
    #[inline(always)]
    fn between(&self, from: usize, to: usize) -> Box3 {
        Box3::around([self.first + self.step * from as f64, self.first + self.step * to as f64])
    }
}

impl SheetLines<'_> {
    /// The pixels of a row whose rays are inside the volume in a slab, or in one of those beside it, a bit each.
    #[inline(always)]
    fn inside<S: Simd>(&self, simd: S, slab: u32, y: usize) -> u64 {
        let begin = Lanes::splat(simd, self.slabs.face(slab.saturating_sub(1)));
        let end = Lanes::splat(simd, self.slabs.face(slab + 2));
        let mut bits = 0;
        for x in (0..SIDE).step_by(Lanes::<S>::COUNT) {
            let near = Lanes::load(simd, &self.crossings.near[y * SIDE + x..]).max(begin);
            let far = Lanes::load(simd, &self.crossings.far[y * SIDE + x..]).min(end);
            if near.any_less(far) {
                bits |= ((1 << Lanes::<S>::COUNT) - 1) << x;
            }
        }
        bits & ((1 << SIDE) - 1)
    }

    /// Lattice coordinates of a pixel in the middle of a slab.
    #[inline(always)]
    fn place(&self, slab: u32, x: usize, y: usize) -> DVec3 {
        self.rays.place(self.slopes.ray(x, y), (f64::from(slab) + 0.5) * self.slabs.width)
    }
}

/// The values of a lattice with its rim.
fn with_rim(lattice: &Lattice<'_>) -> Vec<f32> {
    let [nx, ny, nz] = lattice.dims;
    let mut values = vec![0.0; nx * ny * nz];
    values.par_chunks_mut(nx).enumerate().with_min_len(64).for_each_init(Vec::new, |row, (at, out)| {
        lattice.row(at % ny, at / ny, row);
        out.copy_from_slice(row);
    });
    values
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

/// The four shares of a cubic B-spline, a part `t` of a step behind the second voxel.
#[inline(always)]
fn spline<S: Simd>(simd: S, t: Lanes<S>) -> [Lanes<S>; 4] {
    let one = Lanes::splat(simd, 1.0);
    let half = Lanes::splat(simd, 0.5);
    let sixth = Lanes::splat(simd, 1.0 / 6.0);
    let two_thirds = Lanes::splat(simd, 2.0 / 3.0);
    let u = one - t;
    let second = two_thirds - half * t * t * (one + u);
    let third = two_thirds - half * u * u * (one + t);
    [sixth * u * u * u, second, third, sixth * t * t * t]
}
