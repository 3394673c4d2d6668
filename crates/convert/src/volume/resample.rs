//! Finer lattices for volumes whose steps differ, so that isotropic kernels sum to a homogeneous medium.
//!
//! A lattice of kernels is smooth when σ·g ≥ 2π·0.8 for its shortest reciprocal vector g; R follows from the spacing
//! h = 2π/g. A CT of 0.7 × 0.7 × 2.5 mm would need kernels of 2.5 mm. So the long axis is split: the cell of each
//! voxel into f cells, values between voxels by trilinear interpolation, values beyond the last voxel repeated. Every
//! cell is covered once, so Σ K stays σ_t·V.

use crate::volume::volume_points::check_lattice;
use crate::{ConvertError, SplatParams};
use rayon::prelude::*;
use splat_core::{
    Grid,
    glam::{DMat3, DVec3},
};

/// Factors per axis that make the steps of a lattice like the shortest one, times `refine`.
pub(crate) fn factors(axes: &DMat3, refine: u32) -> [usize; 3] {
    let steps = [axes.x_axis, axes.y_axis, axes.z_axis].map(DVec3::length);
    let shortest = steps[0].min(steps[1]).min(steps[2]);
    // A step may be a quarter longer than the shortest before it is split: the radius follows the longest.
    steps.map(|s| ((s / shortest - 0.25).ceil().clamp(1.0, 1e6) as usize).saturating_mul(refine.max(1) as usize))
}

/// The spacing h that kernels need on this lattice: 2π over its shortest reciprocal vector.
pub(crate) fn kernel_spacing(axes: &DMat3) -> f64 {
    let reciprocal = axes.inverse().transpose();
    let mut shortest = f64::INFINITY;
    for n in 1..27 {
        let c = DVec3::new(f64::from(n % 3) - 1.0, f64::from(n / 3 % 3) - 1.0, f64::from(n / 9) - 1.0);
        if c != DVec3::ZERO {
            shortest = shortest.min((reciprocal * c).length());
        }
    }
    1.0 / shortest.min((reciprocal * DVec3::NEG_ONE).length())
}

/// Resamples the grid, coarser or finer. The new steps are at most `spacing` long (but for rounding), units of the grid, and as alike as
/// whole numbers of cells allow. The new grid fills the same place; values are interpolated trilinearly.
///
/// ```
/// use convert::{SplatParams, resampled};
/// use splat_core::{Grid, glam::{DMat3, DVec3}};
/// let values = (0..64).map(|i| (i % 4) as f32).collect();
/// let grid = Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims: [4, 4, 4], values };
/// let coarse = resampled(&grid, 2.0, &SplatParams::default()).unwrap();
/// assert_eq!((coarse.dims, coarse.values[0], coarse.values[1]), ([2, 2, 2], 0.5, 2.5));
/// ```
///
/// # Errors
/// [`ConvertError::Parameter`] for a spacing that is no length, [`ConvertError::Input`] for an invalid grid,
/// [`ConvertError::Limit`] before memory is taken.
pub fn resampled(grid: &Grid, spacing: f64, params: &SplatParams) -> Result<Grid, ConvertError> {
    params.check_spacing(spacing)?;
    grid.validate().map_err(|e| params.input(e))?;
    let steps = [grid.axes.x_axis, grid.axes.y_axis, grid.axes.z_axis].map(DVec3::length);
    // Headers round steps to f32: no cell more for that.
    let cells = |a: usize| ((grid.dims[a] as f64 * steps[a] / spacing) * (1.0 - 1e-6)).ceil().max(1.0);
    let dims = [cells(0), cells(1), cells(2)];
    check_lattice(params, dims)?;
    Ok(resample(grid, dims.map(|n| n as usize)))
}

/// The grid's place filled with `dims` cells, values by trilinear interpolation.
pub(crate) fn resample(grid: &Grid, dims: [usize; 3]) -> Grid {
    let ratio = DVec3::from_array([0, 1, 2].map(|a| grid.dims[a] as f64 / dims[a] as f64));
    let axes = grid.axes * DMat3::from_diagonal(ratio);
    // Centre of the first new cell; the first old one is centred at lattice point 0.
    let origin = grid.origin + grid.axes * ((ratio - DVec3::ONE) * 0.5);
    let place = |i: usize, a: usize| -> (usize, usize, f32) {
        let at = (i as f64 + 0.5) * grid.dims[a] as f64 / dims[a] as f64 - 0.5;
        let at = at.clamp(0.0, (grid.dims[a] - 1) as f64);
        let low = at as usize;
        (low, (low + 1).min(grid.dims[a] - 1), (at - low as f64) as f32)
    };
    let columns: Vec<(usize, usize, f32)> = (0..dims[0]).map(|i| place(i, 0)).collect();
    let mut values = vec![0.0f32; dims[0] * dims[1] * dims[2]];
    values.par_chunks_mut(dims[0]).with_min_len(16).enumerate().for_each(|(row, out)| {
        let (j0, j1, v) = place(row % dims[1], 1);
        let (k0, k1, w) = place(row / dims[1], 2);
        let source = |j: usize, k: usize| &grid.values[(k * grid.dims[1] + j) * grid.dims[0]..][..grid.dims[0]];
        let [a, b, c, d] = [source(j0, k0), source(j1, k0), source(j0, k1), source(j1, k1)];
        let mix = |x: f32, y: f32, t: f32| x + (y - x) * t;
        let at = |i: usize| mix(mix(a[i], b[i], v), mix(c[i], d[i], v), w);
        for (value, &(i0, i1, u)) in out.iter_mut().zip(&columns) {
            *value = mix(at(i0), at(i1), u);
        }
    });
    Grid { origin, axes, dims, values }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_linear_field_stays_linear_and_cells_are_covered_once() {
        let value = |i: usize, j: usize, k: usize| (i as f32) + 2.0 * (j as f32) - 4.0 * (k as f32);
        let values = (0..60).map(|n| value(n % 3, n / 3 % 4, n / 12)).collect();
        let axes = DMat3::from_diagonal(DVec3::new(1.0, 1.0, 3.0));
        let grid = Grid { origin: DVec3::new(5.0, 0.0, 0.0), axes, dims: [3, 4, 5], values };
        let f = factors(&grid.axes, 2);
        assert_eq!(f, [2, 2, 6]);
        let fine = resample(&grid, [0, 1, 2].map(|a| grid.dims[a] * f[a]));
        assert!((fine.cell_volume() * fine.values.len() as f64 - 3.0 * 60.0).abs() < 1e-9);
        let p = fine.position(3, 3, 13);
        let index = DVec3::new(p.x - 5.0, p.y, p.z / 3.0);
        let expected = index.x + 2.0 * index.y - 4.0 * index.z;
        let found = f64::from(fine.at_clamped(3, 3, 13));
        assert!((found - expected).abs() < 1e-5, "{found} {expected}");
    }

    #[test]
    fn kernel_spacing_is_the_longest_step_of_an_orthogonal_lattice() {
        assert!((kernel_spacing(&DMat3::from_diagonal(DVec3::new(1.0, -2.0, 0.5))) - 2.0).abs() < 1e-12);
        // Sheared by one whole step it is the same lattice.
        let sheared = DMat3::from_cols(DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Z);
        assert!((kernel_spacing(&sheared) - 1.0).abs() < 1e-12);
    }
}
