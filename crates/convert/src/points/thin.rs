//! Fewer raw points: those of one cell of a lattice become one, their mean.

use crate::common::columns::CHUNK;
use crate::points::place_order::compare;
use crate::{ConvertError, SplatParams};
use rayon::prelude::*;
use splat_core::glam::{DVec3, Vec3};
use splat_core::points::attributes::is_id;
use splat_core::{Column, Gaussians, RawPoints, ReadySplats};

/// Thins points to a distance of about `spacing`, units of the file. The points of each cell of a lattice with that step become one point. It
/// has their mean place, normal, colour, value, opacity and further columns, and the class, `footprint` and `material` of the first. The
/// lattice has a point at zero of the file's coordinates, so nothing depends on the order of the points.
///
/// ```
/// use splat_core::RawPoints;
/// use convert::{SplatParams, thinned};
/// use splat_core::glam::Vec3;
/// let position = (0..100).map(|i| Vec3::new(i as f32, 0.0, 0.0)).collect();
/// let points = RawPoints { position, ..RawPoints::default() };
/// let thin = thinned(&points, 10.0, &SplatParams::default()).unwrap();
/// assert_eq!(thin.len(), 10);
/// assert_eq!(thin.position[0], Vec3::new(4.5, 0.0, 0.0));
/// ```
///
/// # Errors
/// [`ConvertError::Parameter`] for a spacing that is no length, for Gaussians and for splats, [`ConvertError::Input`] for points that are no numbers.
pub fn thinned(points: &RawPoints, spacing: f64, params: &SplatParams) -> Result<RawPoints, ConvertError> {
    params.check_spacing(spacing)?;
    if !points.gaussians.is_empty() {
        return Err(params.bad("spacing", spacing, "none: 3D Gaussians have no mean that looks like them"));
    }
    if !points.ready.cloud.is_empty() {
        return Err(params.bad("spacing", spacing, "none: splats of a file have no mean that looks like them"));
    }
    points.validate().map_err(|e| params.input(e))?;
    let cells = cells(points, spacing);
    let ranges: Vec<&[([f64; 3], u32)]> = cells.chunk_by(|a, b| a.0 == b.0).collect();
    let mean = |column: &[Vec3]| -> Vec<Vec3> {
        let cell_mean = |r: &&[([f64; 3], u32)]| mean(r, |i| column[i].as_dvec3()).as_vec3();
        if column.is_empty() { Vec::new() } else { ranges.par_iter().with_min_len(CHUNK).map(cell_mean).collect() }
    };
    let color: Vec<Vec3> = points.color.iter().map(|c| Vec3::from_array(*c)).collect();
    let numbers = |column: &[f32]| -> Vec<f32> {
        let column: Vec<Vec3> = column.iter().map(|v| Vec3::splat(*v)).collect();
        mean(&column).into_iter().map(|v| v.x).collect()
    };
    let column = |c: &Column| {
        let cell_value = |r: &&[([f64; 3], u32)]| match is_id(&c.name) {
            true => c.values[r[0].1 as usize],
            false => r.iter().map(|(_, i)| c.values[*i as usize]).sum::<f64>() / r.len() as f64,
        };
        Column { name: c.name.clone(), values: ranges.iter().map(cell_value).collect() }
    };
    let first = |r: &&[([f64; 3], u32)]| points.classification[r[0].1 as usize];
    Ok(RawPoints {
        origin: points.origin,
        position: mean(&points.position),
        normal: mean(&points.normal).into_iter().map(Vec3::normalize_or_zero).collect(),
        color: mean(&color).into_iter().map(|c| c.to_array()).collect(),
        value: numbers(&points.value),
        is_intensity: points.is_intensity,
        opacity: numbers(&points.opacity),
        classification: if points.classification.is_empty() { Vec::new() } else { ranges.iter().map(first).collect() },
        columns: points.columns.iter().map(column).collect(),
        cells: Vec::new(),
        lattice: None,
        dropped: points.dropped,
        gaussians: Gaussians::default(),
        ready: ReadySplats::default(),
    })
}

/// The cell of every point, by cell; within one in an order that the file's does not change.
pub(crate) fn cells(points: &RawPoints, spacing: f64) -> Vec<([f64; 3], u32)> {
    let cell = |(i, p): (usize, &Vec3)| {
        // Plus zero, for there is but one cell at zero.
        let at = ((points.origin + p.as_dvec3()) / spacing).floor() + 0.0;
        (at.to_array(), i as u32)
    };
    let mut cells: Vec<([f64; 3], u32)> =
        points.position.par_iter().enumerate().with_min_len(CHUNK).map(cell).collect();
    cells.par_sort_unstable_by(|a, b| {
        let by_cell = (0..3).fold(std::cmp::Ordering::Equal, |o, k| o.then(a.0[k].total_cmp(&b.0[k])));
        by_cell.then_with(|| compare(points, a.1 as usize, b.1 as usize))
    });
    cells
}

fn mean(cell: &[([f64; 3], u32)], vector: impl Fn(usize) -> DVec3) -> DVec3 {
    cell.iter().map(|(_, i)| vector(*i as usize)).sum::<DVec3>() / cell.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(position: Vec<Vec3>) -> RawPoints {
        let color = position.iter().map(|p| [p.x.abs(), 0.5, 0.25]).collect();
        let value = position.iter().map(|p| p.y).collect();
        let opacity = position.iter().map(|p| p.y.abs().min(1.0)).collect();
        RawPoints { position, color, value, opacity, ..RawPoints::default() }
    }

    #[test]
    fn a_square_lattice_becomes_a_coarser_one_with_the_means_of_its_attributes() {
        let fine = (0..64).map(|i| Vec3::new((i % 8) as f32 - 4.0, (i / 8) as f32 - 4.0, 0.0)).collect();
        let thin = thinned(&points(fine), 2.0, &SplatParams::default()).expect("good points");
        assert_eq!(thin.len(), 16);
        assert_eq!(thin.position[0], Vec3::new(-3.5, -3.5, 0.0));
        assert_eq!((thin.color[0], thin.value[0]), ([3.5, 0.5, 0.25], -3.5));
        // Of the cells from y = 0 to 2 half of the points have none.
        assert_eq!((thin.opacity[0], thin.opacity[2]), (1.0, 0.5));
    }

    #[test]
    fn neither_the_order_of_the_points_nor_a_power_of_two_changes_a_bit() {
        let at = |i: u32| Vec3::new(((i * 37) % 101) as f32 * 0.173, ((i * 53) % 89) as f32 * 0.291, (i % 7) as f32);
        let forth: Vec<Vec3> = (0..500).map(at).collect();
        let back: Vec<Vec3> = forth.iter().rev().copied().collect();
        let thin = |p: Vec<Vec3>, h: f64| thinned(&points(p), h, &SplatParams::default()).expect("good points");
        let once = thin(forth.clone(), 1.1);
        assert_eq!(once, thin(back, 1.1));
        let large = thin(forth.iter().map(|p| *p * 1024.0).collect(), 1.1 * 1024.0);
        assert_eq!(large.position, once.position.iter().map(|p| *p * 1024.0).collect::<Vec<_>>());
        assert!(once.len() < 500);
    }

    #[test]
    fn points_farther_apart_than_the_spacing_stay_as_they_are() {
        let fine: Vec<Vec3> = (0..10).map(|i| Vec3::new(i as f32, 0.0, 0.0)).collect();
        let thin = thinned(&points(fine.clone()), 0.7, &SplatParams::default()).expect("good points");
        assert_eq!(thin.position, fine);
    }
}
