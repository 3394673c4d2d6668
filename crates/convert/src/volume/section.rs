//! A plane through a volume as triangles, coloured by the volume's values.

use crate::{ConvertError, SplatParams};
use field::{GridField, Inside};
use splat_core::glam::DVec3;
use splat_core::{Grid, Interpolation, Mesh, Progress, ScalarField, TransferFunction};
use std::sync::Arc;

/// Most squares along one side of the plane.
const MOST_SQUARES: f64 = 4096.0;

/// A plane through a volume, in the volume's space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Section {
    /// A point that the plane goes through.
    pub center: DVec3,
    /// Its normal, of length 1.
    pub normal: DVec3,
    /// Side of the squares that it is made of, about, object units, > 0; no side has more than 4096 of them.
    pub spacing: f64,
}

/// The part of a plane within a volume's lattice, in squares that are cut off at its border.
///
/// Colours are those that `transfer` gives the trilinear values at the squares' corners; its extinctions are not used. A plane
/// beside the lattice gives a mesh without triangles. Of `splat` only the name is used, for errors. Rows of squares are reported
/// to `progress`, and work stops where that is cancelled.
///
/// ```
/// use convert::{Section, SplatParams, volume_section};
/// use splat_core::glam::{DMat3, DVec3};
/// use splat_core::{Grid, TransferFunction, TransferPoint};
/// // Values grow along x, and so does red.
/// let values = (0..27).map(|k| (k % 3) as f32).collect();
/// let grid = Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims: [3; 3], values };
/// let point = |value| TransferPoint { value, color: [value, 0.0, 0.0], extinction: 0.0 };
/// let transfer = TransferFunction::new(vec![point(0.0), point(2.0)]).unwrap();
/// let middle = Section { center: DVec3::ONE, normal: DVec3::Z, spacing: 0.5 };
/// let mesh = volume_section(grid.into(), &transfer, &middle, &SplatParams::default(), None).unwrap();
/// for (p, color) in mesh.position.iter().zip(&mesh.color) {
///     assert!((mesh.origin.x + f64::from(p.x) - f64::from(color[0])).abs() < 1e-6);
/// }
/// ```
///
/// # Errors
/// [`ConvertError::Input`] for a grid that is not valid, [`ConvertError::Cancelled`].
pub fn volume_section(
    grid: Arc<Grid>,
    transfer: &TransferFunction,
    section: &Section,
    splat: &SplatParams,
    progress: Option<&Progress>,
) -> Result<Mesh, ConvertError> {
    let Section { center, normal, spacing } = *section;
    let quiet = Progress::new();
    let progress = progress.unwrap_or(&quiet);
    let wrong = |source| ConvertError::Input { object: splat.object_name.clone(), source };
    let field = GridField::new(grid.clone(), Interpolation::Trilinear, 0.0, Inside::Below).map_err(wrong)?;
    let bounds = field.bounds();
    let reach = 0.5 * bounds.diagonal();
    // The place of the plane nearest to the middle of the volume, so that it does not matter which point was given.
    let middle = bounds.center();
    let center = middle - normal * normal.dot(middle - center);
    let (u, v) = normal.any_orthonormal_pair();
    let n = (2.0 * reach / spacing).ceil().clamp(1.0, MOST_SQUARES);
    let step = 2.0 * reach / n;
    let index = grid.axes.inverse();
    let last = DVec3::from_array(grid.dims.map(|n| (n - 1) as f64));
    let mut mesh = Mesh { origin: center, ..Mesh::default() };
    progress.add_total(n as u64);
    for k in 0..(n * n) as u64 {
        if k % n as u64 == 0 {
            progress.tick(1).map_err(|_| ConvertError::Cancelled)?;
        }
        let at = |i: f64, j: f64| center + u * (i * step - reach) + v * (j * step - reach);
        let i = (k % n as u64) as f64;
        let j = (k / n as u64) as f64;
        let square = [at(i, j), at(i + 1.0, j), at(i + 1.0, j + 1.0), at(i, j + 1.0)];
        let polygon = within(square.to_vec(), |p| index * (p - grid.origin), last);
        let first = mesh.position.len() as u32;
        for p in &polygon {
            mesh.position.push((*p - center).as_vec3());
            mesh.normal.push(normal.as_vec3());
            mesh.color.push(transfer.at(field.value(*p) as f32).color);
        }
        mesh.triangles.extend((2..polygon.len() as u32).map(|c| [first, first + c - 1, first + c]));
    }
    Ok(mesh)
}

/// A convex polygon cut off where its lattice coordinates leave 0 … `last` (Sutherland and Hodgman 1974).
fn within(mut polygon: Vec<DVec3>, coordinates: impl Fn(DVec3) -> DVec3, last: DVec3) -> Vec<DVec3> {
    for side in 0..6 {
        let axis = side / 2;
        let inside = |p: DVec3| {
            let c = coordinates(p)[axis];
            if side % 2 == 0 { c } else { last[axis] - c }
        };
        if polygon.iter().all(|p| inside(*p) >= 0.0) {
            continue;
        }
        let mut cut = Vec::with_capacity(polygon.len() + 1);
        for (k, &p) in polygon.iter().enumerate() {
            let next = polygon[(k + 1) % polygon.len()];
            let a = inside(p);
            let b = inside(next);
            if a >= 0.0 {
                cut.push(p);
            }
            if (a >= 0.0) != (b >= 0.0) {
                cut.push(p + (next - p) * (a / (a - b)));
            }
        }
        polygon = cut;
    }
    polygon
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::TransferPoint;
    use splat_core::glam::DMat3;

    #[test]
    fn a_slice_ends_where_the_volume_does_and_has_its_colours() {
        let values: Vec<f32> = (0..64).map(|i| (i % 4) as f32).collect();
        let grid = Grid { origin: DVec3::ONE, axes: DMat3::from_diagonal(DVec3::splat(0.5)), dims: [4; 3], values };
        let point = |value, red| TransferPoint { value, color: [red, 0.0, 1.0], extinction: 0.0 };
        let transfer = TransferFunction::new(vec![point(0.0, 0.0), point(3.0, 3.0)]).unwrap();
        let normal = DVec3::new(0.0, 1.0, 1.0).normalize();
        let center = DVec3::splat(1.75);
        let splat = SplatParams::default();
        let mesh =
            volume_section(grid.into(), &transfer, &Section { center, normal, spacing: 0.2 }, &splat, None).unwrap();
        let total = mesh.area();
        assert!((total - 1.5 * 1.5 * 2f64.sqrt()).abs() < 1e-5, "{total}");
        for (p, color) in mesh.position.iter().zip(&mesh.color) {
            let p = mesh.origin + p.as_dvec3();
            assert!((f64::from(color[0]) - (p.x - 1.0) * 2.0).abs() < 1e-5 && color[2] == 1.0, "{p}: {color:?}");
        }
    }
}
