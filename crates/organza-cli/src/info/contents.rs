//! What is in a data file, without a scene.

use convert::RawPoints;
use convert::read::{Loaded, Mended, ReadParams, UpAxis, up_axis};
use organza::Error;
use splat_core::glam::{DVec3, Vec3};
use splat_core::{Aabb, DAabb, Grid, Limits, Mesh, RadianceImage};
use std::path::Path;

/// What a data file holds.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct FileInfo {
    /// `mesh`, `volume`, `points` or `image`.
    pub(super) kind: &'static str,
    /// Length of the file.
    pub(super) bytes: u64,
    /// How many there are of what: `vertices`, `triangles`, `points`, `x`, `y`, `z` of a volume's lattice, or
    /// `columns` and `rows` of an image.
    pub(super) counts: Vec<(&'static str, u64)>,
    /// Attributes beside positions: `normal`, `color`, `value`, `classification`.
    pub(super) attributes: Vec<&'static str>,
    /// In the file's own coordinates; `None` for an empty file.
    pub(super) bounds: Option<DAabb>,
    /// Lowest and highest value of a volume or an image.
    pub(super) range: Option<[f32; 2]>,
    /// Columns, fields and statements of the file that are not used, as the file names them.
    pub(super) unused: Vec<String>,
    /// What was made of the data, one sentence each.
    pub(super) remarks: Vec<String>,
    /// What was mended in the file or left out of it, one sentence a kind of fault.
    pub(super) mended: Vec<String>,
    /// The axis that points up where a scene says `up = "auto"`.
    pub(super) up: UpAxis,
}

/// Reads a data file of at most `max_bytes` and describes it; `strict` refuses a file with a fault that could be mended.
///
/// # Errors
/// [`Error::Io`] for the file system, [`Error::Input`] for a file that is not what its name says, [`Error::Limit`] for
/// one that would take more than `max_bytes`.
pub(super) fn contents(path: &Path, max_bytes: u64, strict: bool) -> Result<FileInfo, Error> {
    let params = ReadParams { limits: Limits::bytes(max_bytes), strict, ..ReadParams::default() };
    let read = convert::read::file(path, &params, None);
    let (data, notes) = read.map_err(|e| Error::from_read(path, &e))?;
    let bytes = std::fs::metadata(path).map_err(|e| Error::io(path, "cannot read", e))?.len();
    let info = match data {
        Loaded::Mesh(mesh) => of_mesh(&mesh),
        Loaded::Points(points) => of_points(&points),
        Loaded::Grid(grid) => of_grid(&grid),
        Loaded::Image(image) => of_image(&image),
        _ => return Err(Error::Internal("a reader gave data of no known kind".into())),
    };
    let remarks = notes.remarks.into_iter().chain(info.remarks).collect();
    let mended = notes.mended.iter().map(Mended::to_string).collect();
    Ok(FileInfo { bytes, unused: notes.unused, remarks, mended, up: up_axis(path), ..info })
}

fn present(columns: &[(&'static str, bool)]) -> Vec<&'static str> {
    columns.iter().filter(|(_, on)| *on).map(|(name, _)| *name).collect()
}

fn bounds_of(origin: DVec3, positions: &[Vec3]) -> Option<DAabb> {
    let bounds = Aabb::of_points(positions);
    (!bounds.is_empty()).then(|| DAabb::new(origin + bounds.min.as_dvec3(), origin + bounds.max.as_dvec3()))
}

fn of_mesh(mesh: &Mesh) -> FileInfo {
    FileInfo {
        kind: "mesh",
        counts: vec![("vertices", mesh.position.len() as u64), ("triangles", mesh.triangles.len() as u64)],
        attributes: present(&[("normal", !mesh.normal.is_empty()), ("color", !mesh.color.is_empty())]),
        bounds: bounds_of(mesh.origin, &mesh.position),
        ..FileInfo::default()
    }
}

fn of_points(points: &RawPoints) -> FileInfo {
    FileInfo {
        kind: "points",
        counts: vec![("points", points.position.len() as u64)],
        attributes: present(&[
            ("normal", !points.normal.is_empty()),
            ("color", !points.color.is_empty()),
            ("value", !points.value.is_empty()),
            ("opacity", !points.opacity.is_empty()),
            ("classification", !points.classification.is_empty()),
        ]),
        remarks: if points.color.is_empty() {
            Vec::new()
        } else {
            vec!["colours are drawn as they are, without light, unless the scene names a material".to_owned()]
        },
        bounds: bounds_of(points.origin, &points.position),
        ..FileInfo::default()
    }
}

fn of_grid(grid: &Grid) -> FileInfo {
    let [x, y, z] = grid.dims;
    // The corners of the lattice bound it, sheared or not.
    let last = |bit: usize, n: usize| if bit == 0 { 0 } else { n.saturating_sub(1) };
    let corners = (0..8).map(|c| grid.position(last(c & 1, x), last(c & 2, y), last(c & 4, z)));
    let range = grid.values.iter().fold([f32::INFINITY, f32::NEG_INFINITY], |r, v| [r[0].min(*v), r[1].max(*v)]);
    FileInfo {
        kind: "volume",
        counts: vec![("x", x as u64), ("y", y as u64), ("z", z as u64)],
        bounds: Some(DAabb::of_points(corners)),
        range: (!grid.values.is_empty()).then_some(range),
        ..FileInfo::default()
    }
}

fn of_image(image: &RadianceImage) -> FileInfo {
    let values = image.pixels.iter().flatten();
    let range = values.fold([f32::INFINITY, f32::NEG_INFINITY], |r, v| [r[0].min(*v), r[1].max(*v)]);
    FileInfo {
        kind: "image",
        counts: vec![("columns", u64::from(image.size[0])), ("rows", u64::from(image.size[1]))],
        range: Some(range),
        ..FileInfo::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::glam::DMat3;

    #[test]
    fn a_mirrored_volume_has_ordered_bounds() {
        let axes = DMat3::from_diagonal(DVec3::new(-1.0, 2.0, 3.0));
        let grid = Grid { origin: DVec3::ONE, axes, dims: [2, 2, 1], values: vec![3.0, -1.0, 2.0, 0.0] };
        let info = of_grid(&grid);
        assert_eq!(info.bounds, Some(DAabb::new(DVec3::new(0.0, 1.0, 1.0), DVec3::new(1.0, 3.0, 1.0))));
        assert_eq!(info.range, Some([-1.0, 3.0]));
    }

    #[test]
    fn an_empty_mesh_has_no_bounds() {
        assert_eq!(of_mesh(&Mesh::default()).bounds, None);
    }
}
