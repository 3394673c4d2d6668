//! Scattered points become a field whose zero set passes by them: points with normals as they are, others with estimated ones.

use crate::{ConvertError, Orientation, SplatParams, SurfelParams, raw_to_surfels};
use field::{MpuField, MpuParams, MpuReport, SurfaceSample};
use rayon::prelude::*;
use splat_core::glam::DVec3;
use splat_core::{Progress, RawPoints};

/// Makes a field whose zero set passes by the points; normals point to where it is positive.
///
/// Missing normals are estimated as [`raw_to_surfels`] does it, along [`Orientation::Propagate`]. Work stops where `progress` is cancelled.
///
/// ```
/// use convert::points_to_field;
/// use field::MpuParams;
/// use splat_core::{RawPoints, ScalarField, glam::{DVec3, Vec3}};
/// let turn = |i: i32| {
///     let y = 1.0 - 2.0 * (i as f32 + 0.5) / 2000.0;
///     let a = i as f32 * 2.399_963;
///     Vec3::new(a.cos() * (1.0 - y * y).sqrt(), y, a.sin() * (1.0 - y * y).sqrt())
/// };
/// let ball: Vec<Vec3> = (0..2000).map(turn).collect();
/// let points = RawPoints { position: ball.clone(), normal: ball, ..RawPoints::default() };
/// let (field, report) = points_to_field(&points, &MpuParams::default(), None).unwrap();
/// assert!(field.value(DVec3::new(0.6, 0.0, 0.8)).abs() < report.tolerance);
/// assert!(field.value(DVec3::ZERO) < 0.0);
/// ```
///
/// # Errors
/// [`ConvertError::Parameter`] for parameters outside their ranges, fewer than N_min distinct points or points at one
/// place; [`ConvertError::Input`] for points that do not validate; [`ConvertError::Cancelled`].
pub fn points_to_field(
    points: &RawPoints,
    params: &MpuParams,
    progress: Option<&Progress>,
) -> Result<(MpuField, MpuReport), ConvertError> {
    let quiet = Progress::new();
    let progress = progress.unwrap_or(&quiet);
    params.check()?;
    let input = |source| ConvertError::Input { object: params.object_name.clone(), source };
    points.validate().map_err(input)?;
    let complete = points.normal.len() == points.len() && points.normal.iter().all(|n| n.length_squared() > 0.0);
    let (origin, samples) = if complete { given(points) } else { estimated(points, params, progress)? };
    let (field, report) = MpuField::through(origin, samples, params, Some(progress))?;
    Ok((field, MpuReport { points: points.len() as u64, ..report }))
}

fn given(points: &RawPoints) -> (DVec3, Vec<SurfaceSample>) {
    let origin = points.lattice.as_ref().map_or(points.origin, |l| l.offset);
    let position = |i: usize| match &points.lattice {
        Some(l) => l.scale * DVec3::from_array(l.steps[i].map(f64::from)),
        None => points.position[i].as_dvec3(),
    };
    let sample = |i: usize| SurfaceSample { position: position(i), normal: points.normal[i].as_dvec3().normalize() };
    (origin, (0..points.len()).into_par_iter().with_min_len(4096).map(sample).collect())
}

fn estimated(
    points: &RawPoints,
    params: &MpuParams,
    progress: &Progress,
) -> Result<(DVec3, Vec<SurfaceSample>), ConvertError> {
    let splat = SplatParams { object_name: params.object_name.clone(), ..SplatParams::default() };
    let surfels =
        SurfelParams { splat, orientation: Orientation::Propagate, merge_duplicates: true, ..SurfelParams::default() };
    let (cloud, _) = raw_to_surfels(points, &surfels, Some(progress))?;
    let samples = cloud
        .position
        .iter()
        .zip(&cloud.normal)
        .map(|(p, n)| SurfaceSample { position: p.as_dvec3(), normal: n.as_dvec3().normalize() });
    Ok((cloud.origin, samples.collect()))
}
