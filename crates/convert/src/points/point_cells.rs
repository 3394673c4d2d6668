//! The volume of each point as matter: its share of the Voronoi cell of its place.

use crate::points::cell_volume::cell_volumes;
use crate::points::place_order::{canonical_order, distinct_places};
use crate::{ConvertError, SplatParams};
use splat_core::glam::Vec3;
use splat_core::{PointCell, Progress, RawPoints};

/// Computes the Voronoi cell of every point before thinning, so that kept points have the volume that they had in the full cloud. Of
/// `splat` the name is used.
///
/// # Errors
/// [`ConvertError::Input`] or [`ConvertError::Cancelled`].
pub fn with_cells(
    points: RawPoints,
    splat: &SplatParams,
    progress: Option<&Progress>,
) -> Result<RawPoints, ConvertError> {
    points.validate().map_err(|e| splat.input(e))?;
    let order = canonical_order(&points);
    let (distinct, starts) = distinct_places(&points, &order);
    let cells = cells_of(&order, &distinct, &starts, progress.unwrap_or(&Progress::new()))?;
    Ok(RawPoints { cells, ..points })
}

/// What each point stands for, by its id: `starts` says where those of each place begin in `order`.
pub(crate) fn cells_of(
    order: &[u32],
    distinct: &[Vec3],
    starts: &[u32],
    progress: &Progress,
) -> Result<Vec<PointCell>, ConvertError> {
    let volumes = cell_volumes(distinct, progress)?;
    let mut cells = vec![PointCell::default(); order.len()];
    for (volume, range) in volumes.iter().zip(starts.windows(2)) {
        let sharers = &order[range[0] as usize..range[1] as usize];
        let cell = PointCell { volume: volume / sharers.len() as f64, spacing: libm::cbrt(*volume) };
        sharers.iter().for_each(|i| cells[*i as usize] = cell);
    }
    Ok(cells)
}

/// Cuts cells to the cube of `largest` times the median edge; gives that edge, and how many were cut. Points of a place without another one
/// share a cube of the edge `lone`.
pub(crate) fn cut_outliers(cells: &mut [PointCell], lone: f64, largest: f64) -> (f64, u64) {
    let is_alone = |c: &PointCell| c.volume == f64::INFINITY;
    let sharers = cells.iter().filter(|c| is_alone(c)).count() as f64;
    let of_lone = PointCell { volume: lone.powi(3) / sharers, spacing: lone };
    cells.iter_mut().filter(|c| is_alone(c)).for_each(|c| *c = of_lone);
    let mut spacings: Vec<f64> = cells.iter().map(|c| c.spacing).collect();
    if spacings.is_empty() {
        return (0.0, 0);
    }
    let middle = spacings.len() / 2;
    let median = *spacings.select_nth_unstable_by(middle, f64::total_cmp).1;
    let most = largest * median;
    let mut cut = 0;
    for cell in cells.iter_mut().filter(|c| c.spacing > most) {
        cell.volume *= (most / cell.spacing).powi(3);
        cell.spacing = most;
        cut += 1;
    }
    (median, cut)
}
