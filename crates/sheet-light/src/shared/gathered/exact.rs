//! The slow form in f64 of what sheets read.

use super::RIM;
use super::filter::taps;
use crate::shared::lattice::Lattice;
use crate::shared::params::GatherKernel;
use crate::{KernelShape, Volume};
use splat_core::glam::DVec3;
use splat_core::{Grid, Packing};

/// The lattice of a volume.
pub(crate) struct Exact {
    kernel: GatherKernel,
    values: Vec<f64>,
    dims: [usize; 3],
}

impl Exact {
    pub(crate) fn new(volume: &Volume<'_>, kernel: GatherKernel) -> Self {
        let values = match kernel {
            GatherKernel::Linear => volume.grid.values.iter().map(|v| f64::from(*v)).collect(),
            GatherKernel::Gaussian => filtered(volume.grid),
        };
        Self { kernel, values, dims: volume.grid.dims }
    }

    /// The value at a place in lattice coordinates.
    pub(crate) fn at(&self, place: DVec3) -> f64 {
        let (cell, weights) = self.kernel.cell(self.dims, place, None);
        self.sum(cell, &weights)
    }

    /// The derivatives there along the axes of the lattice, per step, as [`Gradients::Kernel`](crate::Gradients::Kernel) has them.
    pub(crate) fn gradient(&self, place: DVec3) -> DVec3 {
        let along = |axis: usize| match self.kernel {
            GatherKernel::Linear => {
                let step = DVec3::AXES[axis];
                0.5 * (self.at(place + step) - self.at(place - step))
            }
            GatherKernel::Gaussian => {
                let (cell, weights) = self.kernel.cell(self.dims, place, Some(axis));
                self.sum(cell, &weights)
            }
        };
        DVec3::new(along(0), along(1), along(2))
    }

    fn sum(&self, cell: [usize; 3], weights: &[[f64; 4]; 3]) -> f64 {
        let lattice = Lattice::over(&[], self.dims, Packing::Cartesian, RIM);
        let before = self.kernel.reach()[0];
        let [nx, ny, _] = self.dims;
        let mut sum = 0.0;
        for n in 0..64 {
            let steps = [n % 4, n / 4 % 4, n / 16];
            let weight = weights[0][steps[0]] * weights[1][steps[1]] * weights[2][steps[2]];
            if weight == 0.0 {
                continue;
            }
            let terms = [0, 1, 2].map(|a| lattice.terms(a, cell[a] + steps[a] - before));
            for (c, k) in terms[2] {
                for (b, j) in terms[1] {
                    sum += terms[0]
                        .iter()
                        .map(|(a, i)| weight * a * b * c * self.values[(k * ny + j) * nx + i])
                        .sum::<f64>();
                }
            }
        }
        sum
    }
}

impl GatherKernel {
    /// The first voxel of the cell of a place, counted with the rim, and the shares of its neighbours along each axis, along one of them their derivatives. Far
    /// outside those of the nearest place that the lattice goes on to.
    fn cell(self, dims: [usize; 3], place: DVec3, derived: Option<usize>) -> ([usize; 3], [[f64; 4]; 3]) {
        let mut cell = [0usize; 3];
        let mut weights = [[0.0f64; 4]; 3];
        for a in 0..3 {
            let last = dims[a] as f64;
            let inside = place[a].clamp(-1.0, last);
            let low = inside.floor().min(last - 1.0);
            cell[a] = (low + RIM[a] as f64) as usize;
            weights[a] = if derived == Some(a) { spline_slopes(inside - low) } else { self.weights(inside - low) };
        }
        (cell, weights)
    }

    /// Shares of the voxels along an axis, a part `t` of a step behind the cell's first; the last of them 0 where there are fewer than four.
    fn weights(self, t: f64) -> [f64; 4] {
        match self {
            Self::Linear => [1.0 - t, t, 0.0, 0.0],
            Self::Gaussian => {
                let u = 1.0 - t;
                let sixth = 1.0 / 6.0;
                [
                    sixth * u * u * u,
                    (2.0 / 3.0) - 0.5 * t * t * (1.0 + u),
                    (2.0 / 3.0) - 0.5 * u * u * (1.0 + t),
                    sixth * t * t * t,
                ]
            }
        }
    }
}

/// Derivatives of the shares of a cubic B-spline.
fn spline_slopes(t: f64) -> [f64; 4] {
    let u = 1.0 - t;
    [-0.5 * u * u, 1.5 * t * t - 2.0 * t, 2.0 * u - 1.5 * u * u, 0.5 * t * t]
}

/// The filtered values of a lattice.
fn filtered(grid: &Grid) -> Vec<f64> {
    let taps = taps(&KernelShape::default());
    let mut values: Vec<f64> = grid.values.iter().map(|v| f64::from(*v)).collect();
    let strides = [1, grid.dims[0], grid.dims[0] * grid.dims[1]];
    for a in 0..3 {
        let count = grid.dims[a] as isize;
        let old = values.clone();
        for (n, value) in values.iter_mut().enumerate() {
            let at = (n / strides[a] % grid.dims[a]) as isize;
            let inside = |i: isize| old[n - at as usize * strides[a] + i.clamp(0, count - 1) as usize * strides[a]];
            let beyond = |i: isize| match i {
                i if i < 0 => 2.0 * inside(0) - inside(-i),
                i if i >= count => 2.0 * inside(count - 1) - inside(2 * (count - 1) - i),
                i => inside(i),
            };
            let beside = |m: isize| taps[m as usize] * (beyond(at - m) + beyond(at + m));
            *value = taps[0] * old[n] + beside(1) + beside(2) + beside(3);
        }
    }
    values
}
