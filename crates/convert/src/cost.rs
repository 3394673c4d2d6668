//! Splats and bytes of a conversion before it is done, from its parameters and its input.
//!
//! | input | splats | exact? |
//! |---|---|---|
//! | mesh | Σ pieces of its triangles' splits | yes |
//! | raw points | one a point | yes; fewer where duplicates are merged |
//! | raw points as a medium | one a point with extinction, or one a cell of the lattice that makes them fewer | yes |
//! | volume | cells with extinction; where steps are split voxels with extinction, times the factors | where none is split |
//! | zero set | 2·A/h², A from a mesh of 48 cells a side | within some ten percent; flat faces along the lattice have half of that |
//! | density, procedural cloud | lattice points times the share of a coarse lattice whose extinction is kept | within some percent |
//! | box, ball, parallelogram | cells that a cut leaves; for a ball π/6 of all | yes; a ball within some percent, a cut ball at most |
//!
//! `at_most` is an upper bound in every case; limits of memory are planned with it.

use crate::common::columns::ColumnSet;
use crate::field_points::{area, coarse_mesh, density_lattice, surface_lattice, surface_spacing};
use crate::mesh::borders::open_edges;
use crate::mesh::mesh_points;
use crate::points::{matter, surfels};
use crate::volume::keep::Keep;
#[cfg(feature = "noise")]
use crate::volume::procedural::CloudShape;
use crate::volume::resample;
use crate::volume::shapes::{HomogeneousMedium, Lattice, MediumBody, Rectangle, rectangle_columns, rectangle_counts};
use crate::volume::volume_points::lattice_factors;
use crate::{ConvertError, DensityParams, MatterParams, MeshParams, SplatParams, SurfelParams, VolumeParams};
use splat_core::RawPoints;
use splat_core::{
    Clip, DAabb, Grid, Mesh, ScalarField, TransferFunction,
    glam::{DMat3, DVec3},
};

/// Splats of a zero set over its area over h²: cells of √2·h make two triangles each, whose pieces are smaller than h².
pub const ZERO_SET_EXCESS: f64 = 2.0;

/// Points along the longest side of the lattice that a field is looked at on.
const COARSE: f64 = 32.0;

/// The predicted result of a conversion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Prediction {
    /// Splats, see the table above.
    pub splats: u64,
    /// Never more splats than that; `None` where nothing but the limit of the parameters is known.
    pub at_most: Option<u64>,
    /// Whether `splats` are counted rather than estimated.
    pub is_exact: bool,
    /// Bytes of the cloud with that many `splats`.
    pub bytes: u64,
}

impl Prediction {
    fn new(splats: f64, at_most: Option<f64>, columns: ColumnSet) -> Self {
        // Floats become the nearest integer in range.
        let splats = splats.round() as u64;
        let bytes = splats.saturating_mul(columns.bytes_per_splat());
        Self { splats, at_most: at_most.map(|n| n as u64), is_exact: false, bytes }
    }

    fn exact(splats: f64, columns: ColumnSet) -> Self {
        Self { is_exact: true, ..Self::new(splats, Some(splats), columns) }
    }
}

/// Of [`crate::mesh_to_points`].
///
/// ```
/// use convert::{Density, MeshParams, cost, mesh_to_points};
/// use splat_core::{Mesh, glam::Vec3};
/// let mesh = Mesh { position: vec![Vec3::ZERO, Vec3::X, Vec3::Y], triangles: vec![[0, 1, 2]], ..Mesh::default() };
/// let params = MeshParams { density: Density::Spacing(0.1), ..MeshParams::default() };
/// let predicted = cost::mesh(&mesh, &params).unwrap();
/// assert_eq!(predicted.bytes, mesh_to_points(&mesh, &params, None).unwrap().0.bytes());
/// ```
///
/// # Errors
/// As the conversion.
pub fn mesh(mesh: &Mesh, params: &MeshParams) -> Result<Prediction, ConvertError> {
    let plan = mesh_points::plan(mesh, params)?;
    Ok(Prediction::exact(plan.report.splats as f64, plan.columns))
}

/// The spacing that [`crate::Density::Auto`] takes for a mesh that had `triangles` triangles before they were divided, world units; `None` for a mesh without
/// area.
pub fn usual_spacing(mesh: &Mesh, triangles: u64, splat: &SplatParams) -> Option<f64> {
    let area = mesh.area() * splat.transform.scale * splat.transform.scale;
    let spacing = mesh_points::auto_spacing(mesh, area, triangles.max(1), splat);
    (spacing > 0.0 && spacing.is_finite()).then_some(spacing)
}

/// Of [`crate::raw_to_surfels`]; with merged duplicates as if there were none.
///
/// # Errors
/// As the conversion.
pub fn raw_points(points: &RawPoints, params: &SurfelParams) -> Result<Prediction, ConvertError> {
    surfels::check(points, params)?;
    Ok(Prediction::exact(surfels::count(points, params) as f64, surfels::column_set(points, params)))
}

/// Of [`crate::raw_to_matter`].
///
/// # Errors
/// As the conversion.
pub fn raw_matter(points: &RawPoints, params: &MatterParams) -> Result<Prediction, ConvertError> {
    matter::check(points, params)?;
    let splats = matter::count(points, params) as f64;
    params.splat.check_cloud(splats, matter::column_set(points, params))?;
    Ok(Prediction::exact(splats, matter::column_set(points, params)))
}

/// Of [`crate::volume_to_points`].
///
/// # Errors
/// As the conversion, but for too many splats.
pub fn volume(grid: &Grid, tf: &TransferFunction, params: &VolumeParams) -> Result<Prediction, ConvertError> {
    let p = &params.splat;
    params.check()?;
    grid.validate().map_err(|e| p.input(e))?;
    let factors = lattice_factors(grid, params)?;
    let keep = Keep::new(tf, grid, params);
    if factors == [1; 3] {
        return Ok(Prediction::exact(keep.count() as f64, params.column_set()));
    }
    let finer = factors.iter().map(|f| *f as f64).product::<f64>();
    // Cells around the border of what has extinction count too: finer ones are as much thinner, and about half of them bend little
    // enough to go by their voxel.
    let inside = keep.count_voxels() as f64;
    let kept = inside + (keep.count() as f64 - inside).max(0.0) / (2.0 * libm::cbrt(finer));
    Ok(Prediction::new(kept * finer, Some(grid.values.len() as f64 * finer), params.column_set()))
}

/// Of [`crate::surface_to_points`]; the field is looked at on a coarse lattice.
///
/// # Errors
/// As the conversion, but for too many splats.
pub fn surface<F: ScalarField + ?Sized>(
    field: &F,
    bounds: DAabb,
    params: &MeshParams,
) -> Result<Prediction, ConvertError> {
    params.splat.check()?;
    let spacing = surface_spacing(field, bounds, params)?;
    let coarse = if params.shows() { coarse_mesh(field, bounds, spacing, &params.splat)? } else { Mesh::default() };
    // As if it were smooth.
    let tangent = params.splat.shows_images() || params.opacity >= 1.0 && !open_edges(&coarse).is_empty();
    let columns = ColumnSet { tangent, ..mesh_points::column_set(params.opacity) };
    Ok(Prediction::new(ZERO_SET_EXCESS * area(&coarse) / (spacing * spacing), None, columns))
}

/// About how many values of the field [`crate::surface_to_points`] asks for: a field whose bounds exclude nothing is
/// evaluated on the whole lattice.
///
/// # Errors
/// As the conversion.
pub fn surface_evaluations<F: ScalarField + ?Sized>(
    field: &F,
    bounds: DAabb,
    params: &MeshParams,
) -> Result<f64, ConvertError> {
    params.splat.check()?;
    Ok(field::evaluations(field, &surface_lattice(field, bounds, params)?))
}

/// The number of field values that [`crate::density_to_points`] evaluates.
///
/// # Errors
/// As the conversion.
pub fn density_evaluations(bounds: DAabb, params: &DensityParams) -> Result<f64, ConvertError> {
    params.volume.check()?;
    Ok(density_lattice(bounds, params)?.cells.iter().map(|n| *n as f64).product())
}

/// Of [`crate::density_to_points`]; the field is looked at on a coarse lattice.
///
/// # Errors
/// As the conversion, but for too many splats.
pub fn density<F: ScalarField + ?Sized>(
    field: &F,
    bounds: DAabb,
    params: &DensityParams,
) -> Result<Prediction, ConvertError> {
    params.volume.check()?;
    let lattice = density_lattice(bounds, params)?;
    let low = lattice.low + 0.5 * lattice.step;
    let extinction = |p: DVec3| params.extinction * field.value(p);
    Ok(sampled(extinction, low, lattice.step, lattice.cells, &params.volume))
}

/// Of [`crate::procedural_cloud`] and [`crate::volume_to_points`] with extinction as it is.
///
/// # Errors
/// As the conversions, but for too many splats.
#[cfg(feature = "noise")]
pub fn procedural(shape: &CloudShape, spacing: f64, params: &VolumeParams) -> Result<Prediction, ConvertError> {
    params.check()?;
    let dims = shape.lattice(spacing, &params.splat)?;
    let noise = noise::Perlin::new(shape.seed);
    let extinction = |p: DVec3| shape.extinction * shape.density_with(&noise, p);
    Ok(sampled(extinction, shape.bounds().min, DVec3::splat(spacing), dims, params))
}

/// Of [`crate::medium`].
///
/// # Errors
/// As the conversion.
pub fn medium(medium: &HomogeneousMedium, clips: &[Clip], params: &SplatParams) -> Result<Prediction, ConvertError> {
    let lattice = Lattice::new(medium, params)?;
    let cells = if medium.extinction > 0.0 { lattice.counts.iter().product::<u64>() as f64 } else { 0.0 };
    let kept = if clips.is_empty() || cells == 0.0 {
        cells
    } else {
        let cut = lattice.cut(clips);
        lattice.offsets().filter(|offset| cut(*offset) > 0.0).count() as f64
    };
    Ok(match medium.body {
        MediumBody::Box(_) => Prediction::exact(kept, ColumnSet::default()),
        MediumBody::Ball { .. } => {
            // Cells that the surface cuts count whole: a shell of about half a cell.
            let inside = std::f64::consts::PI / 6.0 * (libm::cbrt(cells) + 1.0).powi(3);
            Prediction::new(inside.min(kept), Some(kept), ColumnSet::default())
        }
    })
}

/// Of [`crate::rectangle`].
///
/// # Errors
/// As the conversion.
pub fn rectangle(rectangle: &Rectangle, opacity: f64, params: &SplatParams) -> Result<Prediction, ConvertError> {
    let Rectangle { u, v, spacing, .. } = *rectangle;
    params.check()?;
    params.check_spacing(spacing * params.transform.scale)?;
    let splats = rectangle_counts(u, v, spacing).iter().product();
    let columns = rectangle_columns(opacity, params);
    params.check_cloud(splats, columns)?;
    Ok(Prediction::exact(splats, columns))
}

/// Lattice points from `low` on, times the share of a coarser lattice in the same box whose `extinction` is not left out.
fn sampled(
    extinction: impl Fn(DVec3) -> f64,
    low: DVec3,
    step: DVec3,
    dims: [usize; 3],
    params: &VolumeParams,
) -> Prediction {
    let factors = resample::factors(&DMat3::from_diagonal(step), params.refine);
    let n = DVec3::from_array([0, 1, 2].map(|a| dims[a] as f64));
    let longest = n.max_element();
    let coarse = n.to_array().map(|n| (n * (COARSE / longest).min(1.0)).ceil() as usize);
    let stride = n / DVec3::from_array(coarse.map(|c| c as f64));
    let at = |c: [usize; 3]| {
        let index = DVec3::from_array(c.map(|i| i as f64 + 0.5)) * stride - 0.5;
        low + step * index
    };
    let points = coarse[0] * coarse[1] * coarse[2];
    let cell = |i: usize| at([i % coarse[0], i / coarse[0] % coarse[1], i / coarse[0] / coarse[1]]);
    // As the conversion, which works in f32 and leaves out what no line through the lattice shows.
    let longest_path = (n * step).length() * params.splat.transform.scale;
    let threshold = params.omitted_optical_depth / longest_path;
    let is_kept = |extinction: f32| extinction > 0.0 && f64::from(extinction) > threshold;
    let hits = (0..points).filter(|i| is_kept(extinction(cell(*i)) as f32)).count();
    let lattice = [0, 1, 2].map(|a| dims[a] as f64 * factors[a] as f64).iter().product::<f64>();
    Prediction::new(lattice * hits as f64 / points.max(1) as f64, Some(lattice), params.column_set())
}
