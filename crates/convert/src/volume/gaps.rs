//! Replaces voxels without a value (NaN) by values without extinction, because all other code of this crate takes finite values alone.
//!
//! A gap gets the value without extinction that is nearest to the mean of its neighbours. So a ramp of opacity ends at the gap within one
//! step of the lattice, as it ends at values that are transparent by themselves, and no other value of the transfer function shows between.

use field::Inside;
use splat_core::{Grid, TransferFunction, TransferPoint};

/// Distance of a value without extinction from all others, over their range, where a transfer function has none.
const BELOW: f32 = 1e-3;

/// Whether some voxels have no value.
fn has_gaps(grid: &Grid) -> bool {
    grid.values.iter().any(|value| value.is_nan())
}

/// A volume with the transfer function that classifies it.
pub struct ClassifiedGrid {
    /// Values without gaps.
    pub grid: Grid,
    /// Extinction and colour by value.
    pub transfer: TransferFunction,
}

/// A volume and a transfer function with which voxels that are NaN draw nothing; `None` for a volume without such.
///
/// The transfer function is the given one where that has values without extinction, else it is continued below all values.
pub fn transparent_gaps(grid: &Grid, transfer: &TransferFunction) -> Option<ClassifiedGrid> {
    if !has_gaps(grid) {
        return None;
    }
    let transfer = if clear_ranges(transfer).is_empty() { continued(grid, transfer) } else { transfer.clone() };
    let clear = clear_ranges(&transfer);
    let nearest = |near: f32| {
        let within = clear.iter().map(|[low, high]| near.clamp(*low, *high));
        within.min_by(|a, b| (a - near).abs().total_cmp(&(b - near).abs())).unwrap_or(near)
    };
    let lowest = finite(grid).fold(f32::INFINITY, f32::min);
    Some(ClassifiedGrid { grid: filled(grid, |near| nearest(near.unwrap_or(lowest))), transfer })
}

/// A volume whose voxels that are NaN lie outside of its surface at `level`, as far from it as their neighbours lie inside; `None` for one
/// without such.
pub fn gaps_outside(grid: &Grid, level: f32, inside: Inside) -> Option<Grid> {
    if !has_gaps(grid) {
        return None;
    }
    let most = finite(grid).map(|value| (value - level).abs()).fold(0.0, f32::max).min(f32::MAX);
    let sign = if inside == Inside::Above { -1.0 } else { 1.0 };
    let outside = |near: Option<f32>| {
        let far = near.map_or(most, |near| (near - level).abs());
        let value = level + sign * far.max(1e-3 * most).max(f32::MIN_POSITIVE);
        value.clamp(f32::MIN, f32::MAX)
    };
    Some(filled(grid, outside))
}

/// A volume whose voxels that are NaN have `value`; `None` for one without such.
pub fn gaps_of_value(grid: &Grid, value: f32) -> Option<Grid> {
    has_gaps(grid).then(|| filled(grid, |_| value))
}

fn finite(grid: &Grid) -> impl Iterator<Item = f32> {
    grid.values.iter().copied().filter(|value| value.is_finite())
}

/// Ranges of values that have no extinction, by rising value.
fn clear_ranges(transfer: &TransferFunction) -> Vec<[f32; 2]> {
    let points = transfer.points();
    let mut ranges: Vec<[f32; 2]> = Vec::new();
    for (i, point) in points.iter().enumerate().filter(|(_, point)| point.extinction == 0.0) {
        let low = if i == 0 { f32::MIN } else { point.value };
        let high = if i + 1 == points.len() { f32::MAX } else { point.value };
        match ranges.last_mut() {
            // Between two points without extinction there is none either.
            Some(before) if i > 0 && points[i - 1].extinction == 0.0 => before[1] = high,
            _ => ranges.push([low, high]),
        }
    }
    ranges
}

/// The transfer function with a value without extinction below all values of the volume and its own.
fn continued(grid: &Grid, transfer: &TransferFunction) -> TransferFunction {
    let first = transfer.points()[0];
    let last = transfer.points()[transfer.points().len() - 1];
    let lowest = finite(grid).fold(first.value, f32::min);
    let highest = finite(grid).fold(last.value, f32::max);
    let step = (BELOW * (highest - lowest)).max(f32::EPSILON * lowest.abs().max(highest.abs())).max(f32::MIN_POSITIVE);
    let clear = TransferPoint { value: lowest - 2.0 * step, extinction: 0.0, ..first };
    let edge = TransferPoint { value: lowest - step, ..first };
    TransferFunction::new([clear, edge].into_iter().chain(transfer.points().iter().copied()).collect())
        .unwrap_or_else(|_| transfer.clone())
}

/// The volume with the gaps that `value` gives, of the mean of the values beside each, if there are some.
fn filled(grid: &Grid, value: impl Fn(Option<f32>) -> f32) -> Grid {
    let [columns, rows, _] = grid.dims;
    let steps = [1, columns, columns * rows];
    let beside = |voxel: usize| {
        let mut sum = 0.0;
        let mut count = 0u32;
        for (axis, step) in steps.into_iter().enumerate() {
            let at = voxel / step % grid.dims[axis];
            let before = (at > 0).then(|| grid.values[voxel - step]);
            let after = (at + 1 < grid.dims[axis]).then(|| grid.values[voxel + step]);
            for near in [before, after].into_iter().flatten().filter(|near| near.is_finite()) {
                sum += f64::from(near);
                count += 1;
            }
        }
        (count > 0).then(|| (sum / f64::from(count)) as f32)
    };
    let filled = |(voxel, known): (usize, &f32)| if known.is_nan() { value(beside(voxel)) } else { *known };
    Grid { values: grid.values.iter().enumerate().map(filled).collect(), ..*grid }
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::glam::{DMat3, DVec3};

    fn row(values: &[f32]) -> Grid {
        Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims: [values.len(), 1, 1], values: values.to_vec() }
    }

    fn transfer(points: &[[f32; 2]]) -> TransferFunction {
        let point =
            |[value, extinction]: &[f32; 2]| TransferPoint { value: *value, color: [1.0; 3], extinction: *extinction };
        TransferFunction::new(points.iter().map(point).collect()).unwrap()
    }

    const GAP: f32 = f32::NAN;

    #[test]
    fn gaps_have_no_extinction_and_the_nearest_such_value() {
        let by = |points: &[[f32; 2]], values: &[f32]| transparent_gaps(&row(values), &transfer(points)).unwrap();
        // A ramp: the foot of it. A notch: its bottom. Air above matter: the value itself.
        let ramp = by(&[[0.0, 0.0], [1.0, 0.0], [2.0, 5.0]], &[GAP, 3.0, GAP, 0.5]);
        assert_eq!((ramp.grid.values, ramp.transfer.points().len()), (vec![1.0, 3.0, 1.0, 0.5], 3));
        assert_eq!(by(&[[-1.0, 2.0], [0.0, 0.0], [1.0, 2.0]], &[7.0, GAP]).grid.values, [7.0, 0.0]);
        assert_eq!(by(&[[0.0, 1.0], [1.0, 0.0]], &[9.0, GAP, GAP]).grid.values[..2], [9.0, 9.0]);
    }

    #[test]
    fn a_transfer_function_without_a_clear_value_gets_one_below_all() {
        let ClassifiedGrid { grid, transfer } =
            transparent_gaps(&row(&[4.0, GAP, -8.0]), &transfer(&[[0.0, 1.0], [1.0, 3.0]])).unwrap();
        assert_eq!(transfer.at(grid.values[1]).extinction, 0.0);
        for (value, extinction) in [(-8.0, 1.0), (0.0, 1.0), (1.0, 3.0), (4.0, 3.0)] {
            assert_eq!(transfer.at(value).extinction, extinction, "{value}");
        }
    }

    #[test]
    fn gaps_lie_outside_of_surfaces_and_volumes_without_any_stay() {
        let grid = row(&[2.0, GAP, GAP, 0.0]);
        let above = gaps_outside(&grid, 1.0, Inside::Above).unwrap();
        assert_eq!(above.values[1..3], [0.0, 0.0]);
        let below = gaps_outside(&grid, 1.0, Inside::Below).unwrap();
        assert_eq!(below.values[1..3], [2.0, 2.0]);
        assert_eq!(gaps_of_value(&grid, 7.0).unwrap().values[1..3], [7.0, 7.0]);
        let whole = row(&[1.0, 2.0]);
        assert!(gaps_of_value(&whole, 0.0).is_none() && gaps_outside(&whole, 0.0, Inside::Above).is_none());
        assert!(transparent_gaps(&whole, &transfer(&[[0.0, 1.0]])).is_none());
    }
}
