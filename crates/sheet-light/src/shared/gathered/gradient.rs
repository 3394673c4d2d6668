//! Gradients of the field that sheets read, at the places that are lit: they know nothing of slabs and pixels.
//!
//! By the derivative of the cubic B-spline; of the field that is linear in each cell, whose derivative jumps from cell to cell, by its differences from one step
//! before to one behind, as ray casters have them.

use super::{Gathered, spline};
use crate::shared::gradient_volume::directions;
use crate::shared::lattice::neighbours::lanes;
use crate::shared::params::GatherKernel;
use splat_core::raster::lanes::{Broadcast, Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;

/// How gradients of a lattice are those of the space in which places are asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct KernelGradients {
    /// From places to lattice coordinates.
    lattice_from_place: [[f32; 4]; 3],
    /// By axis of the lattice: the direction of a gradient along it, in the space of places. The longest has length 1, so that no scale of the scene makes a gradient vanish.
    directions: [[f32; 3]; 3],
}

impl KernelGradients {
    /// `rows` lead from places to lattice coordinates.
    pub(crate) fn new(rows: &[[f64; 4]; 3]) -> Self {
        Self { lattice_from_place: rows.map(|row| row.map(|number| number as f32)), directions: directions(rows) }
    }

    /// ∇v at places of the lanes `lane_bits`, in their space, of any length.
    #[inline(always)]
    pub(crate) fn gradients<S: Simd>(
        &self,
        simd: S,
        lattice: &Gathered<'_>,
        places: &[Lanes<S>; 3],
        lane_bits: u32,
    ) -> [Lanes<S>; 3] {
        let mut in_lattice = [simd.lanes(0.0); 3];
        for axis in 0..3 {
            let [x, y, z, start] = self.lattice_from_place[axis];
            let far = simd.lanes(z).mul_add(places[2], simd.lanes(start));
            in_lattice[axis] = simd.lanes(x).mul_add(places[0], simd.lanes(y).mul_add(places[1], far));
        }
        let along = lattice.gradients(simd, &in_lattice, lane_bits);
        let mut out = [simd.lanes(0.0); 3];
        for axis in 0..3 {
            for c in 0..3 {
                out[c] = along[axis].mul_add(simd.lanes(self.directions[axis][c]), out[c]);
            }
        }
        out
    }
}

impl Gathered<'_> {
    /// Derivatives along the axes of the lattice, per step, at places in lattice coordinates; of the lanes that are not `lane_bits` anything.
    #[inline(always)]
    fn gradients<S: Simd>(&self, simd: S, places: &[Lanes<S>; 3], lane_bits: u32) -> [Lanes<S>; 3] {
        let corner = self.first_corner();
        let mut stored = *places;
        for axis in 0..3 {
            stored[axis] = places[axis] + simd.lanes(corner.from(axis, 0.0) as f32);
        }
        match self.kernel {
            GatherKernel::Linear => {
                let one = simd.lanes(1.0);
                let mut out = [one; 3];
                for axis in 0..3 {
                    let mut before = stored;
                    let mut behind = stored;
                    before[axis] = stored[axis] - one;
                    behind[axis] = stored[axis] + one;
                    let rise = self.linear(simd, corner.start, &behind, &corner.last)
                        - self.linear(simd, corner.start, &before, &corner.last);
                    out[axis] = rise * simd.lanes(0.5);
                }
                out
            }
            GatherKernel::Gaussian => self.cubic_gradients(simd, corner.start, &stored, &corner.last, lane_bits),
        }
    }

    /// Derivatives of the cubic B-spline of the 64 voxels around each place.
    #[inline(always)]
    fn cubic_gradients<S: Simd>(
        &self,
        simd: S,
        start: usize,
        places: &[Lanes<S>; 3],
        last: &[f32; 3],
        lane_bits: u32,
    ) -> [Lanes<S>; 3] {
        let [nx, ny, _] = self.stored;
        let (firsts, parts) = self.cells(simd, start, places, last);
        let mut weights = [[[0.0; MAX_LANES]; 4]; 3];
        let mut slopes = [[[0.0; MAX_LANES]; 4]; 3];
        for axis in 0..3 {
            let weights_of_axis = spline(simd, parts[axis]);
            let slopes_of_axis = spline_slopes(simd, parts[axis]);
            for n in 0..4 {
                weights_of_axis[n].store(&mut weights[axis][n]);
                slopes_of_axis[n].store(&mut slopes[axis][n]);
            }
        }
        let mut out = [[0.0; MAX_LANES]; 3];
        for lane in lanes(lane_bits & ((1 << Lanes::<S>::COUNT) - 1)) {
            let corner = firsts[lane] - (nx * ny + nx + 1);
            // Four columns each: sums of values, and of their derivatives along y and z.
            let mut values = [0.0f32; 4];
            let mut along_y = [0.0f32; 4];
            let mut along_z = [0.0f32; 4];
            for k in 0..4 {
                let mut plane = [0.0f32; 4];
                let mut plane_along_y = [0.0f32; 4];
                for j in 0..4 {
                    let at = corner + (k * ny + j) * nx;
                    let Some(row) = self.values[at..].first_chunk::<4>() else { continue };
                    let weight = weights[1][j][lane];
                    let slope = slopes[1][j][lane];
                    for c in 0..4 {
                        plane[c] = weight.mul_add(row[c], plane[c]);
                        plane_along_y[c] = slope.mul_add(row[c], plane_along_y[c]);
                    }
                }
                let weight = weights[2][k][lane];
                let slope = slopes[2][k][lane];
                for c in 0..4 {
                    values[c] = weight.mul_add(plane[c], values[c]);
                    along_y[c] = weight.mul_add(plane_along_y[c], along_y[c]);
                    along_z[c] = slope.mul_add(plane[c], along_z[c]);
                }
            }
            for c in 0..4 {
                out[0][lane] = slopes[0][c][lane].mul_add(values[c], out[0][lane]);
                out[1][lane] = weights[0][c][lane].mul_add(along_y[c], out[1][lane]);
                out[2][lane] = weights[0][c][lane].mul_add(along_z[c], out[2][lane]);
            }
        }
        [Lanes::load(simd, &out[0]), Lanes::load(simd, &out[1]), Lanes::load(simd, &out[2])]
    }
}

/// The derivatives of the four shares of a cubic B-spline, a part `t` of a step behind the second voxel.
#[inline(always)]
fn spline_slopes<S: Simd>(simd: S, t: Lanes<S>) -> [Lanes<S>; 4] {
    let half = simd.lanes(0.5);
    let one_and_half = simd.lanes(1.5);
    let two = simd.lanes(2.0);
    let u = simd.lanes(1.0) - t;
    [simd.lanes(-0.5) * u * u, t * (one_and_half * t - two), u * (two - one_and_half * u), half * t * t]
}
