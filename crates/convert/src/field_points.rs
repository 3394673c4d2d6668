//! Scalar fields become splats: zero sets as oriented discs, densities as media.
//!
//! Gunjee 2007 shows fields (Figure 16: fountain and tree) without saying how they are sampled. Here a zero set is meshed
//! by surface nets with cells of √2·h and then goes the way of every mesh, so that its splats are as even as a
//! mesh's; a density is sampled at the middles of lattice cells and goes the way of every volume.

use crate::params::{Density, SplatParams};
use crate::surface_nets::{Lattice, surface_nets};
use crate::volume_points::check_lattice;
use crate::{ConvertError, MeshParams, MeshReport, VolumeParams, VolumeReport, mesh_to_points, volume_to_points};
use rayon::prelude::*;
use splat_core::{
    Cloud, Grid, Mesh, ScalarField, TransferFunction, TransferPoint,
    glam::{DMat3, DVec3},
};

/// Cells of the lattice that a zero set is looked for on, over its splats' spacing.
const CELL_OVER_SPACING: f64 = std::f64::consts::SQRT_2;
/// Cells along the longest side where no spacing is asked for, and of the first look at a surface's area.
const AUTO_CELLS: f64 = 256.0;
const COARSE_CELLS: f64 = 48.0;

/// Meshes the zero set of a field inside a box, cells of about `cell` (object units).
///
/// Normals point to where the field is positive. Parts thinner than a cell are lost, and the surface ends within one
/// cell of the box.
///
/// ```
/// use convert::{ExpressionField, SplatParams, field_to_mesh};
/// use splat_core::glam::DVec3;
/// let ball = ExpressionField::parse("sqrt(x^2 + y^2 + z^2) - 1").unwrap();
/// let mesh = field_to_mesh(&ball, [DVec3::splat(-1.2), DVec3::splat(1.2)], 0.1, &SplatParams::default()).unwrap();
/// assert!(mesh.position.iter().all(|p| (p.length() - 1.0).abs() < 1e-6));
/// ```
///
/// # Errors
/// [`ConvertError::NonFinite`] with the point, [`ConvertError::Parameter`] for an empty box or an absurd cell.
pub fn field_to_mesh<F: ScalarField + ?Sized>(
    field: &F,
    bounds: [DVec3; 2],
    cell: f64,
    splat: &SplatParams,
) -> Result<Mesh, ConvertError> {
    let lattice = lattice(bounds, cell, splat)?;
    surface_nets(field, &lattice, &splat.object_name)
}

/// Splats of the zero set of a field inside a box (object space); `params` as for a mesh, where [`Density::Auto`] is
/// 1/256 of the longest side of the box.
///
/// # Errors
/// As [`field_to_mesh`] and [`mesh_to_points`].
pub fn surface_to_points<F: ScalarField + ?Sized>(
    field: &F,
    bounds: [DVec3; 2],
    params: &MeshParams,
) -> Result<(Cloud, MeshReport), ConvertError> {
    let p = &params.splat;
    p.check()?;
    let longest = (bounds[1] - bounds[0]).max_element();
    let scale = p.transform.scale;
    let spacing = match params.density {
        Density::Spacing(h) => p.check_spacing(h)? / scale,
        Density::Auto => longest / AUTO_CELLS,
        Density::Splats(n) => {
            let coarse = field_to_mesh(field, bounds, longest / COARSE_CELLS, p)?;
            let all = MeshParams { density: Density::Spacing(longest * scale), ..params.clone() };
            let area = mesh_to_points(&coarse, &all)?.1.area / (scale * scale);
            let fine = longest / AUTO_CELLS;
            if area > 0.0 { (area / n.max(1) as f64).sqrt() } else { fine }
        }
    };
    let mesh = field_to_mesh(field, bounds, spacing * CELL_OVER_SPACING, p)?;
    let mesh_params = MeshParams { density: Density::Spacing(spacing * scale), ..params.clone() };
    mesh_to_points(&mesh, &mesh_params)
}

/// How a density field becomes a medium.
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
/// use convert::{Density, DensityParams, ExpressionField, density_to_points};
/// use splat_core::glam::DVec3;
/// let fog = ExpressionField::parse("2").unwrap();
/// let params = DensityParams { density: Density::Spacing(0.25), ..DensityParams::default() };
/// let (cloud, _) = density_to_points(&fog, [DVec3::ZERO, DVec3::ONE], &params).unwrap();
/// assert_eq!(cloud.cross_section.iter().sum::<f32>(), 2.0);
/// ```
///
/// # Errors
/// [`ConvertError::NonFinite`] with the point, and as [`volume_to_points`].
pub fn density_to_points<F: ScalarField + ?Sized>(
    field: &F,
    bounds: [DVec3; 2],
    params: &DensityParams,
) -> Result<(Cloud, VolumeReport), ConvertError> {
    let p = &params.volume.splat;
    p.check()?;
    if !(params.extinction.is_finite() && params.extinction >= 0.0) {
        return Err(p.bad("extinction", params.extinction, "a finite number ≥ 0"));
    }
    let sides = bounds[1] - bounds[0];
    let spacing = match params.density {
        Density::Spacing(h) => p.check_spacing(h)? / p.transform.scale,
        Density::Splats(n) => (sides.x * sides.y * sides.z / n.max(1) as f64).cbrt(),
        Density::Auto => sides.max_element() / 128.0,
    };
    let grid = field_to_grid(field, bounds, spacing, p)?;
    let thickest = grid.values.iter().copied().fold(0.0f32, f32::max);
    let extinction = (f64::from(thickest) * params.extinction) as f32;
    let mut points = vec![TransferPoint { value: 0.0, color: p.color, extinction: 0.0 }];
    if thickest > 0.0 {
        points.push(TransferPoint { value: thickest, color: p.color, extinction });
    }
    let tf = TransferFunction::new(points).map_err(|e| p.input(e))?;
    volume_to_points(&grid, &tf, &params.volume)
}

/// Samples a field at the middles of cells of about `spacing` (object units) that fill a box.
///
/// # Errors
/// [`ConvertError::NonFinite`] with the point, also where the value overflows f32; [`ConvertError::Parameter`] for
/// an empty box or an absurd spacing; [`ConvertError::TooMany`].
pub fn field_to_grid<F: ScalarField + ?Sized>(
    field: &F,
    bounds: [DVec3; 2],
    spacing: f64,
    splat: &SplatParams,
) -> Result<Grid, ConvertError> {
    let Lattice { low, step, cells: dims } = lattice(bounds, spacing, splat)?;
    let origin = low + step * 0.5;
    let mut values = vec![0.0f32; dims[0] * dims[1] * dims[2]];
    let failed = values
        .par_chunks_mut(dims[0])
        .enumerate()
        .map(|(row, out)| {
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
    Ok(Grid { origin, axes: DMat3::from_diagonal(step), dims, values })
}

/// The lattice of cells of at most `cell` that fills a box.
fn lattice(bounds: [DVec3; 2], cell: f64, splat: &SplatParams) -> Result<Lattice, ConvertError> {
    let sides = bounds[1] - bounds[0];
    if !(sides.is_finite() && sides.min_element() > 0.0) {
        return Err(splat.bad("box", bounds, "two finite corners, the second above the first on every axis"));
    }
    let cell = splat.check_spacing(cell)?;
    // A side of n cells may come out as n·(1 + ε).
    let cells = sides.to_array().map(|s| (s / cell - 1e-9).ceil().max(1.0));
    check_lattice(splat, cells)?;
    let step = sides / DVec3::from_array(cells);
    Ok(Lattice { low: bounds[0], step, cells: cells.map(|n| n as usize) })
}
