//! Tensor products on a lattice: interpolated values with derivatives, and the range of control points.

use super::stencil::{Control, Stencil};
use splat_core::Grid;
use splat_core::glam::{DMat3, DVec3};

/// Value and gradient with respect to lattice coordinates.
pub(super) type Slope = (f64, DVec3);

/// The values that three lists of indices choose, [k][j][i].
#[inline(always)]
fn gather<const N: usize>(grid: &Grid, index: [&[usize; N]; 3]) -> [[[f64; N]; N]; N] {
    let [nx, ny, _] = grid.dims;
    let first = index[0][0];
    // Off the border values lie side by side.
    let whole = index[0][N - 1] == first + N - 1;
    let mut block = [[[0.0; N]; N]; N];
    // Loops: what closures do would not be compiled for the instruction set at hand.
    for k in 0..N {
        for j in 0..N {
            let row = &grid.values[(index[2][k] * ny + index[1][j]) * nx..][..nx];
            match row[first..].first_chunk::<N>() {
                Some(values) if whole => {
                    for i in 0..N {
                        block[k][j][i] = f64::from(values[i]);
                    }
                }
                _ => {
                    for i in 0..N {
                        block[k][j][i] = f64::from(row[index[0][i]]);
                    }
                }
            }
        }
    }
    block
}

#[inline(always)]
fn dot<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    let mut sum = a[0] * b[0];
    for i in 1..N {
        sum += a[i] * b[i];
    }
    sum
}

/// Value and gradient. Rows along x stay whole to the end: their `N` sums are made side by side.
#[inline(always)]
pub(super) fn slope<const N: usize>(grid: &Grid, at: &[Stencil<N>; 3]) -> Slope {
    let block = gather(grid, [&at[0].index, &at[1].index, &at[2].index]);
    let [along, y, z] = at.each_ref().map(|a| &a.weight);
    let mut value = [0.0; N];
    let mut by_y = [0.0; N];
    let mut by_z = [0.0; N];
    for k in 0..N {
        let mut plane = [0.0; N];
        let mut derived = [0.0; N];
        for j in 0..N {
            for i in 0..N {
                plane[i] += block[k][j][i] * y[0][j];
                derived[i] += block[k][j][i] * y[1][j];
            }
        }
        for i in 0..N {
            value[i] += plane[i] * z[0][k];
            by_y[i] += derived[i] * z[0][k];
            by_z[i] += plane[i] * z[1][k];
        }
    }
    let [x, derived] = [&along[0], &along[1]];
    (dot(&value, x), DVec3::new(dot(&value, derived), dot(&by_y, x), dot(&by_z, x)))
}

/// Second derivatives with respect to lattice coordinates.
pub(super) fn hessian<const N: usize>(grid: &Grid, at: &[Stencil<N>; 3]) -> DMat3 {
    let block = gather(grid, [&at[0].index, &at[1].index, &at[2].index]);
    let sum = |times: [usize; 3]| {
        let [x, y, z] = [0, 1, 2].map(|a| &at[a].weight[times[a]]);
        let row = |k: usize, j: usize| dot(&block[k][j], x) * y[j] * z[k];
        (0..N).map(|k| (0..N).map(|j| row(k, j)).sum::<f64>()).sum::<f64>()
    };
    let xy = sum([1, 1, 0]);
    let yz = sum([0, 1, 1]);
    let zx = sum([1, 0, 1]);
    DMat3::from_cols(
        DVec3::new(sum([2, 0, 0]), xy, zx),
        DVec3::new(xy, sum([0, 2, 0]), yz),
        DVec3::new(zx, yz, sum([0, 0, 2])),
    )
}

/// Least and greatest control point on a stretch of one cell; the interpolation stays between them. `N` control points that follow
/// one another along x are made side by side.
#[inline(always)]
pub(super) fn control_range<const N: usize>(grid: &Grid, at: &[Control<N>; 3]) -> [f64; 2] {
    let block = gather(grid, [&at[0].index, &at[1].index, &at[2].index]);
    let [x, y, z] = [&at[0].row, &at[1].row, &at[2].row];
    let mut columns = [[0.0; N]; N];
    for e in 0..N {
        for i in 0..N {
            columns[i][e] = x[e][i];
        }
    }
    let mut low = [f64::INFINITY; N];
    let mut high = [f64::NEG_INFINITY; N];
    for c in 0..N {
        let mut plane = [[0.0; N]; N];
        for k in 0..N {
            for j in 0..N {
                for i in 0..N {
                    plane[j][i] += block[k][j][i] * z[c][k];
                }
            }
        }
        for d in 0..N {
            let mut row = [0.0; N];
            let mut control = [0.0; N];
            for j in 0..N {
                for i in 0..N {
                    row[i] += plane[j][i] * y[d][j];
                }
            }
            for i in 0..N {
                for e in 0..N {
                    control[e] += row[i] * columns[i][e];
                }
            }
            for e in 0..N {
                low[e] = if control[e] < low[e] { control[e] } else { low[e] };
                high[e] = if control[e] > high[e] { control[e] } else { high[e] };
            }
        }
    }
    let mut range = [f64::INFINITY, f64::NEG_INFINITY];
    for e in 0..N {
        range = [range[0].min(low[e]), range[1].max(high[e])];
    }
    range
}
