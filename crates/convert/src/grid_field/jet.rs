//! Tensor products on a lattice: interpolated values with derivatives, and the range of control points.

use super::stencil::{Control, Stencil};
use splat_core::Grid;
use splat_core::glam::{DMat3, DVec3};

/// Value and derivatives with respect to lattice coordinates; those above the order asked for are 0.
#[derive(Debug, Clone, Copy)]
pub(super) struct Jet {
    pub(super) value: f64,
    pub(super) gradient: DVec3,
    pub(super) hessian: DMat3,
}

/// The values that three lists of indices choose, [k][j][i].
fn gather<const N: usize>(grid: &Grid, index: [&[usize; N]; 3]) -> [[[f64; N]; N]; N] {
    let [nx, ny, _] = grid.dims;
    std::array::from_fn(|k| {
        std::array::from_fn(|j| {
            let row = &grid.values[(index[2][k] * ny + index[1][j]) * nx..][..nx];
            std::array::from_fn(|i| f64::from(row[index[0][i]]))
        })
    })
}

fn dot<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    let mut sum = a[0] * b[0];
    for i in 1..N {
        sum += a[i] * b[i];
    }
    sum
}

/// Sums `block` against the stencils of the three axes, derivatives up to order `D` ≤ 2 in all.
pub(super) fn jet<const N: usize, const D: usize>(grid: &Grid, at: &[Stencil<N>; 3]) -> Jet {
    let block = gather(grid, [&at[0].index, &at[1].index, &at[2].index]);
    // Entry [a][b][c]: derived a times along x, b along y, c along z.
    let mut sum = [[[0.0; 3]; 3]; 3];
    for k in 0..N {
        let mut plane = [[0.0; 3]; 3];
        for j in 0..N {
            for a in 0..=D {
                let row = dot(&block[k][j], &at[0].weight[a]);
                for b in 0..=D - a {
                    plane[a][b] += row * at[1].weight[b][j];
                }
            }
        }
        for a in 0..=D {
            for b in 0..=D - a {
                for c in 0..=D - a - b {
                    sum[a][b][c] += plane[a][b] * at[2].weight[c][k];
                }
            }
        }
    }
    let (xy, yz, zx) = (sum[1][1][0], sum[0][1][1], sum[1][0][1]);
    Jet {
        value: sum[0][0][0],
        gradient: DVec3::new(sum[1][0][0], sum[0][1][0], sum[0][0][1]),
        hessian: DMat3::from_cols(
            DVec3::new(sum[2][0][0], xy, zx),
            DVec3::new(xy, sum[0][2][0], yz),
            DVec3::new(zx, yz, sum[0][0][2]),
        ),
    }
}

/// Least and greatest control point on a stretch of one cell; the interpolation stays between them.
pub(super) fn control_range<const N: usize>(grid: &Grid, at: &[Control<N>; 3]) -> [f64; 2] {
    let block = gather(grid, [&at[0].index, &at[1].index, &at[2].index]);
    let along_x = block.map(|plane| plane.map(|row| at[0].row.map(|weights| dot(&row, &weights))));
    let mut range = [f64::INFINITY, f64::NEG_INFINITY];
    let along_y: [[[f64; N]; N]; N] =
        along_x.map(|plane| at[1].row.map(|w| std::array::from_fn(|i| dot(&std::array::from_fn(|j| plane[j][i]), &w))));
    for w in &at[2].row {
        for j in 0..N {
            for i in 0..N {
                let column: [f64; N] = std::array::from_fn(|k| along_y[k][j][i]);
                let control = dot(&column, w);
                range = [range[0].min(control), range[1].max(control)];
            }
        }
    }
    range
}
