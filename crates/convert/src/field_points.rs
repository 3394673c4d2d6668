//! Scalar fields become splats: zero sets as oriented discs, densities as media.
//!
//! Gunjee 2007 shows fields (Figure 16: fountain and tree) without saying how they are sampled. Here a zero set is meshed
//! by surface nets with cells of √2·h and then goes the way of every mesh, so that its splats are as even as a
//! mesh's; a density is sampled at the middles of lattice cells and goes the way of every volume.

use crate::common::convert_error::check_cancelled;
use crate::common::params::{Density, SplatParams};
use crate::mesh::mesh_points::{corners, mesh_to_points_into};
use crate::mesh::subdivide;
use crate::volume::gaps::ClassifiedGrid;
use crate::volume::volume_points::{most_lattice_points, volume_to_points};
use crate::{ConvertError, MeshParams, MeshReport, VolumeParams, VolumeReport};
use field::{Lattice, surface_nets};
use rayon::prelude::*;
use splat_core::{
    Cloud, DAabb, Grid, Mesh, Progress, ScalarField, Similarity, TransferFunction, TransferPoint,
    glam::{DMat3, DVec3},
};

/// Cells of the lattice that a zero set is looked for on, over its splats' spacing.
const CELL_OVER_SPACING: f64 = std::f64::consts::SQRT_2;
/// Cells along the longest side where no spacing is asked for, and of the first look at a surface's area.
const AUTO_CELLS: f64 = 256.0;
const COARSE_CELLS: f64 = 48.0;
/// Points of that lattice: none is kept, and blocks whose bound excludes zero are not looked at; more take minutes.
const MOST_LOOKED_AT: u64 = u32::MAX as u64;

/// Meshes the zero set of a field inside a box, cells of about `cell` (object units).
///
/// Normals point to where the field is positive. Parts thinner than a cell are lost. The surface ends within one cell of the
/// box, and at the border of the field's domain ([`ScalarField::in_domain`]). Blocks of cells are reported to `progress`, and
/// work stops where that is cancelled.
///
/// ```
/// use field::ExpressionField;
/// use convert::{SplatParams, field_to_mesh};
/// use splat_core::{DAabb, glam::DVec3};
/// let ball = ExpressionField::parse("sqrt(x^2 + y^2 + z^2) - 1").unwrap();
/// let bounds = DAabb::around(DVec3::ZERO, DVec3::splat(1.2));
/// let mesh = field_to_mesh(&ball, bounds, 0.1, &SplatParams::default(), None).unwrap();
/// assert!(mesh.position.iter().all(|p| (p.length() - 1.0).abs() < 1e-6));
/// ```
///
/// # Errors
/// [`ConvertError::NonFinite`] with the point, [`ConvertError::Parameter`] for an empty box or an absurd cell,
/// [`ConvertError::Cancelled`].
pub fn field_to_mesh<F: ScalarField + ?Sized>(
    field: &F,
    bounds: DAabb,
    cell: f64,
    splat: &SplatParams,
    progress: Option<&Progress>,
) -> Result<Mesh, ConvertError> {
    let lattice = lattice(bounds, cell, splat, MOST_LOOKED_AT)?;
    Ok(surface_nets(field, &lattice, &splat.object_name, progress.unwrap_or(&Progress::new()))?)
}

/// The zero set of a field inside a box as triangles that are as fine as splats `spacing` apart (object units): cells of √2
/// `spacing`, vertices and normals of the field. Triangles whose middle lies beyond the border of the field's domain are
/// left out, so an open surface ends within a triangle of the border.
///
/// ```
/// use splat_core::{Clip, DAabb, glam::DVec3};
/// use field::{ClippedField, ExpressionField};
/// use convert::{SplatParams, surface_to_mesh};
/// let ball = ExpressionField::parse("sqrt(x^2 + y^2 + z^2) - 1").unwrap();
/// let above = Clip::HalfSpace { normal: -DVec3::Y, offset: 0.0 };
/// let dome = ClippedField::new(std::sync::Arc::new(ball), vec![above]).unwrap();
/// let bounds = DAabb::around(DVec3::ZERO, DVec3::splat(1.2));
/// let mesh = surface_to_mesh(&dome, bounds, 0.1, &SplatParams::default(), None).unwrap();
/// let lowest = mesh.triangles.iter().flatten().map(|v| mesh.position[*v as usize].y).fold(1.0, f32::min);
/// assert!((lowest + mesh.origin.y as f32).abs() < 0.2);
/// ```
///
/// # Errors
/// As [`field_to_mesh`].
pub fn surface_to_mesh<F: ScalarField + ?Sized>(
    field: &F,
    bounds: DAabb,
    spacing: f64,
    splat: &SplatParams,
    progress: Option<&Progress>,
) -> Result<Mesh, ConvertError> {
    let mut mesh = field_to_mesh(field, bounds, CELL_OVER_SPACING * spacing, splat, progress)?;
    let corner = |v: u32| mesh.position[v as usize].as_dvec3();
    let middle = |t: &[u32; 3]| mesh.origin + (corner(t[0]) + corner(t[1]) + corner(t[2])) / 3.0;
    mesh.triangles = mesh.triangles.iter().copied().filter(|t| field.in_domain(middle(t))).collect();
    Ok(mesh)
}

/// Splats of the zero set of a field inside a box (object space); `params` as for a mesh, where [`Density::Auto`] is
/// 1/256 of the longest side of the box.
///
/// Blocks of the lattice and splats are reported to `progress`, and work stops where that is cancelled.
///
/// # Errors
/// As [`field_to_mesh`] and [`crate::mesh_to_points`].
pub fn surface_to_points<F: ScalarField + ?Sized>(
    field: &F,
    bounds: DAabb,
    params: &MeshParams,
    progress: Option<&Progress>,
) -> Result<(Cloud, MeshReport), ConvertError> {
    let quiet = Progress::new();
    let progress = progress.unwrap_or(&quiet);
    let p = &params.splat;
    p.check()?;
    let spacing = surface_spacing(field, bounds, params)?;
    let lattice = lattice(bounds, spacing * CELL_OVER_SPACING, p, MOST_LOOKED_AT)?;
    let mesh = surface_nets(field, &lattice, &p.object_name, progress)?;
    let density = Density::Spacing(spacing * p.transform.scale);
    let mesh_params = MeshParams { density, ..params.clone() };
    let mut cloud = Cloud::default();
    let report = mesh_to_points_into(&mesh, &mesh_params, &mut cloud, Some(progress))?;
    Ok((in_domain(cloud, field, &p.transform), report))
}

/// Without the splats beyond the border of an open surface.
fn in_domain<F: ScalarField + ?Sized>(cloud: Cloud, field: &F, transform: &Similarity) -> Cloud {
    let local = |p: DVec3| transform.rotation.inverse() * (p - transform.translation) / transform.scale;
    let belongs = |i: &u32| field.in_domain(local(cloud.origin + cloud.position[*i as usize].as_dvec3()));
    let kept: Vec<u32> = (0..cloud.len() as u32).filter(belongs).collect();
    if kept.len() == cloud.len() { cloud } else { cloud.gather(&kept) }
}

/// The lattice that a zero set is looked for on.
pub(crate) fn surface_lattice<F: ScalarField + ?Sized>(
    field: &F,
    bounds: DAabb,
    params: &MeshParams,
) -> Result<Lattice, ConvertError> {
    lattice(bounds, surface_spacing(field, bounds, params)? * CELL_OVER_SPACING, &params.splat, MOST_LOOKED_AT)
}

/// Spacing of the splats of a zero set, object units.
pub(crate) fn surface_spacing<F: ScalarField + ?Sized>(
    field: &F,
    bounds: DAabb,
    params: &MeshParams,
) -> Result<f64, ConvertError> {
    let p = &params.splat;
    let longest = bounds.size().max_element();
    Ok(match params.density {
        Density::Spacing(h) => p.check_spacing(h)? / p.transform.scale,
        Density::Auto => longest / AUTO_CELLS,
        Density::Splats(n) => {
            let area = area(&coarse_mesh(field, bounds, 0.0, p)?);
            if area > 0.0 { (area / n.max(1) as f64).sqrt() } else { longest / AUTO_CELLS }
        }
    })
}

/// A zero set by a first look, object space: no finer than the lattice of splats `spacing` apart.
pub(crate) fn coarse_mesh<F: ScalarField + ?Sized>(
    field: &F,
    bounds: DAabb,
    spacing: f64,
    splat: &SplatParams,
) -> Result<Mesh, ConvertError> {
    let cell = (bounds.size().max_element() / COARSE_CELLS).max(spacing * CELL_OVER_SPACING);
    field_to_mesh(field, bounds, cell, splat, None)
}

pub(crate) fn area(mesh: &Mesh) -> f64 {
    mesh.triangles.iter().map(|t| subdivide::measure(corners(mesh, t)).area).sum()
}

/// Parameters of the medium of a density field.
#[derive(Debug, Clone, PartialEq)]
pub struct DensityParams {
    /// Attributes, normals, values, clipping; `splat.color` is the colour of the medium.
    pub volume: VolumeParams,
    /// Distance of lattice points, world units; [`Density::Auto`] is 1/128 of the longest side of the box, and
    /// [`Density::Splats`] counts lattice points.
    pub density: Density,
    /// Extinction where the field is 1, 1/world unit, ≥ 0.
    pub extinction: f64,
}

impl Default for DensityParams {
    fn default() -> Self {
        Self { volume: VolumeParams::default(), density: Density::Auto, extinction: 1.0 }
    }
}

/// Splats of a density: extinction = `extinction`·max(field, 0) inside the box (object space).
///
/// ```
/// use convert::{Density, DensityParams, density_to_points};
/// use field::ExpressionField;
/// use splat_core::{DAabb, glam::DVec3};
/// let fog = ExpressionField::parse("2").unwrap();
/// let params = DensityParams { density: Density::Spacing(0.25), ..DensityParams::default() };
/// let (cloud, _) = density_to_points(&fog, DAabb::new(DVec3::ZERO, DVec3::ONE), &params, None).unwrap();
/// assert_eq!(cloud.cross_section.iter().sum::<f32>(), 2.0);
/// ```
///
/// Lattice points are reported to `progress`, each thrice (sampled, chosen, written), and work stops where that is cancelled.
///
/// # Errors
/// [`ConvertError::NonFinite`] with the point, and as [`crate::volume_to_points`].
pub fn density_to_points<F: ScalarField + ?Sized>(
    field: &F,
    bounds: DAabb,
    params: &DensityParams,
    progress: Option<&Progress>,
) -> Result<(Cloud, VolumeReport), ConvertError> {
    let quiet = Progress::new();
    let progress = progress.unwrap_or(&quiet);
    let p = &params.volume.splat;
    p.check()?;
    if !(params.extinction.is_finite() && params.extinction >= 0.0) {
        return Err(p.bad("extinction", params.extinction, "a finite number ≥ 0"));
    }
    let lattice = density_lattice(bounds, params)?;
    let grid = sample(field, &lattice, p, progress)?;
    let thickest = grid.values.iter().copied().fold(0.0f32, f32::max);
    let extinction = (f64::from(thickest) * params.extinction) as f32;
    let mut points = vec![TransferPoint { value: 0.0, color: p.color, extinction: 0.0 }];
    if thickest > 0.0 {
        points.push(TransferPoint { value: thickest, color: p.color, extinction });
    }
    let tf = TransferFunction::new(points).map_err(|e| p.input(e))?;
    // Extinction is the density's, straight up to where it ends: a cell's middle tells, which the field has exactly.
    let volume = VolumeParams { classification_error: f64::MAX, ..params.volume.clone() };
    volume_to_points(&grid, &tf, &volume, Some(progress))
}

/// The lattice that a density is sampled on.
pub(crate) fn density_lattice(bounds: DAabb, params: &DensityParams) -> Result<Lattice, ConvertError> {
    let p = &params.volume.splat;
    let sides = bounds.size();
    let spacing = match params.density {
        Density::Spacing(h) => p.check_spacing(h)? / p.transform.scale,
        Density::Splats(n) => libm::cbrt(sides.x * sides.y * sides.z / n.max(1) as f64),
        Density::Auto => sides.max_element() / 128.0,
    };
    lattice(bounds, spacing, p, most_lattice_points(p))
}

/// Samples a field at the middles of cells of about `spacing` (object units) that fill a box. Cells are reported to `progress`,
/// and work stops where that is cancelled.
///
/// # Errors
/// [`ConvertError::NonFinite`] with the point, also where the value overflows f32; [`ConvertError::Parameter`] for
/// an empty box or an absurd spacing; [`ConvertError::Limit`], [`ConvertError::Cancelled`].
pub fn field_to_grid<F: ScalarField + ?Sized>(
    field: &F,
    bounds: DAabb,
    spacing: f64,
    splat: &SplatParams,
    progress: Option<&Progress>,
) -> Result<Grid, ConvertError> {
    let lattice = lattice(bounds, spacing, splat, most_lattice_points(splat))?;
    sample(field, &lattice, splat, progress.unwrap_or(&Progress::new()))
}

/// A density as a volume: extinction, 1/world unit, at the middles of cells that fill its box, with the identity as transfer
/// function. The medium is that of [`density_to_points`], for techniques that draw volumes.
///
/// # Errors
/// As [`density_to_points`].
pub fn density_to_grid<F: ScalarField + ?Sized>(
    field: &F,
    bounds: DAabb,
    params: &DensityParams,
) -> Result<ClassifiedGrid, ConvertError> {
    let splat = &params.volume.splat;
    let mut grid = sample(field, &density_lattice(bounds, params)?, splat, &Progress::new())?;
    let extinction = params.extinction as f32;
    grid.values.iter_mut().for_each(|v| *v = (*v * extinction).max(0.0));
    let most = grid.values.iter().copied().fold(0.0, f32::max);
    let transfer = extinction_as_it_is(f64::from(most), splat)?;
    Ok(ClassifiedGrid { grid, transfer })
}

/// The transfer function that takes values up to `most` as extinction, 1/world unit, in the splats' colour.
///
/// # Errors
/// [`ConvertError::Input`] for what is no finite number.
pub fn extinction_as_it_is(most: f64, params: &SplatParams) -> Result<TransferFunction, ConvertError> {
    let point = |value: f32| TransferPoint { value, color: params.color, extinction: value };
    let most = (most as f32 > 0.0).then_some(most as f32);
    let points = std::iter::once(0.0).chain(most).map(point).collect();
    TransferFunction::new(points).map_err(|source| ConvertError::Input { object: params.object_name.clone(), source })
}

/// The field at the middles of a lattice's cells.
fn sample<F: ScalarField + ?Sized>(
    field: &F,
    lattice: &Lattice,
    splat: &SplatParams,
    progress: &Progress,
) -> Result<Grid, ConvertError> {
    let Lattice { low, step, cells: dims } = *lattice;
    let origin = low + step * 0.5;
    let mut values = vec![0.0f32; dims[0] * dims[1] * dims[2]];
    progress.add_total(values.len() as u64);
    let failed = values
        .par_chunks_mut(dims[0])
        .enumerate()
        .map(|(row, out)| {
            if progress.tick(out.len() as u64).is_err() {
                return None;
            }
            for (i, value) in out.iter_mut().enumerate() {
                let index = DVec3::new(i as f64, (row % dims[1]) as f64, (row / dims[1]) as f64);
                let point = origin + step * index;
                let found = field.value(point);
                *value = found as f32;
                if !value.is_finite() {
                    return Some((point, found));
                }
            }
            None
        })
        // The first row in order, so that the message does not depend on threads.
        .find_map_first(|failure| failure);
    if let Some((point, value)) = failed {
        return Err(ConvertError::NonFinite { object: splat.object_name.clone(), point, value });
    }
    check_cancelled(progress)?;
    Ok(Grid { origin, axes: DMat3::from_diagonal(step), dims, values })
}

/// The lattice of cells of at most `cell` that fills a box, of at most so many points.
fn lattice(bounds: DAabb, cell: f64, splat: &SplatParams, most: u64) -> Result<Lattice, ConvertError> {
    let sides = bounds.size();
    if !bounds.is_solid() {
        return Err(splat.bad(
            "box",
            [bounds.min, bounds.max],
            "two finite corners, the second above the first on every axis",
        ));
    }
    let cell = splat.check_spacing(cell)?;
    // A side of n cells may come out as n·(1 + ε).
    let cells = sides.to_array().map(|s| (s / cell - 1e-9).ceil().max(1.0));
    splat.check_limit(cells.iter().product(), most, "lattice points")?;
    let step = sides / DVec3::from_array(cells);
    Ok(Lattice { low: bounds.min, step, cells: cells.map(|n| n as usize) })
}
