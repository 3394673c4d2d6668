//! What is in a data file, measured: for `organza info`.

use crate::NamedTable;
use crate::histogram::Histogram;
use crate::labels::{Labels, Reading};
use crate::mesh_faults::{MeshFaults, mesh_faults};
use crate::spacing::{duplicates, median_spacing};
use crate::stands::{cloud_stands_along, lies_flat_along, stands_along};
use convert::{FillValue, Strays, looks_like_degrees};
use organza::scene::LabelTable;
use organza::{Error, printable};
use read::{Loaded, Mended, NamedColumn, ReadParams, Textures, stated_up_axis, up_axis};
use splat_core::glam::{DVec3, Vec3};
use splat_core::{Aabb, Association, DAabb, Grid, MemoryAccount, Mesh, RadianceImage, RawPoints, UpAxis};
use std::collections::HashSet;
use std::path::Path;

/// Bins of a histogram of values.
const BINS: usize = 16;
/// Bins by which shares of the values are found.
const FINE_BINS: usize = 4096;
/// Shares of the values whose bounds are told.
const SHARES: [f64; 5] = [0.01, 0.25, 0.5, 0.75, 0.99];

/// What a data file holds.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Facts {
    /// `mesh`, `volume`, `points` or `image`.
    pub kind: &'static str,
    /// Which reader read it.
    pub format: String,
    /// Length of the file.
    pub bytes: u64,
    /// How many there are of what: `vertices`, `triangles`, `points`, `x`, `y`, `z` of a volume's lattice, or
    /// `columns` and `rows` of an image.
    pub counts: Vec<(&'static str, u64)>,
    /// Attributes beside positions: `normal`, `color`, `value`, `classification`.
    pub attributes: Vec<&'static str>,
    /// In the file's own coordinates; `None` for an empty file.
    pub bounds: Option<DAabb>,
    /// The unit of lengths, such as `mm`, where the file or its format states one.
    pub unit: Option<String>,
    /// Median distance of a point to its nearest neighbour, of a sample of 1000.
    pub spacing: Option<f64>,
    /// Points that lie where another one lies.
    pub duplicates: Option<u64>,
    /// Columns: the steps of a volume along i, j and k.
    pub steps: Option<[DVec3; 3]>,
    /// Lowest and highest value of a volume or an image.
    pub range: Option<[f32; 2]>,
    /// Values of a volume.
    pub histogram: Option<Histogram>,
    /// Shares of the values, and the value below which each lies.
    pub quantiles: Vec<(f64, f64)>,
    /// Name, lowest and highest number of columns beside positions; of points those that they can be coloured and kept by, of
    /// meshes those that they can be coloured by.
    pub columns: Vec<(String, [f64; 2])>,
    /// The element, vertex or face, that each column of a mesh has a number for, by the column's name.
    pub associations: Vec<(String, Association)>,
    /// Labels of a volume that has such, by rising number; 0, which is nothing, is left out.
    pub labels: Vec<LabelFact>,
    /// Faults of a mesh.
    pub faults: Option<MeshFaults>,
    /// Columns, fields and statements of the file that are not used, as the file names them.
    pub unused: Vec<String>,
    /// What was made of the data, one sentence each.
    pub remarks: Vec<String>,
    /// What was mended in the file or left out of it, one sentence a kind of fault.
    pub mended: Vec<String>,
    /// What of the data a picture does not show as it is, one sentence each.
    pub warnings: Vec<String>,
    /// The axis that points up where a scene says `up = "auto"`.
    pub up: UpAxis,
    /// Whether the file's format says so; else it is y, as nothing says another.
    pub is_up_stated: bool,
    /// The axis that a first scene has point up in its place, where the format says nothing of it and the data stands along that axis.
    pub stands: Option<UpAxis>,
}

/// A label of a volume.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LabelFact {
    /// Its number.
    pub number: u64,
    /// Its name in the table, empty where that has none.
    pub name: String,
    /// Voxels that have it.
    pub voxels: u64,
    /// Whether the table hides it.
    pub is_hidden: bool,
}

/// Reads a data file of at most `max_bytes` and measures it; `table` names the labels of a volume; `strict` refuses a file with a fault that could be mended.
///
/// # Errors
/// [`Error::Io`] for the file system, [`Error::Input`] for a file that is not what its name says, [`Error::Limit`] for
/// one that would take more than `max_bytes`.
pub fn facts(path: &Path, table: Option<&NamedTable>, max_bytes: u64, strict: bool) -> Result<Facts, Error> {
    let memory = MemoryAccount::new(max_bytes);
    let params = ReadParams { memory, strict, ranges: true, textures: Textures::Undecoded, ..ReadParams::default() };
    let read = read::file(path, &params, None);
    let (data, notes) = read.map_err(|e| Error::from_read(path, &e))?;
    let files = read::files_of(path).map_err(|e| Error::from_read(path, &e))?;
    let length = |file: &Path| std::fs::metadata(file).map(|about| about.len());
    let bytes = files.iter().map(|file| length(file)).sum::<Result<u64, _>>();
    let bytes = bytes.map_err(|e| Error::io(path, "cannot read", e))?;
    let facts = match data {
        Loaded::Mesh(mesh) => of_mesh(&mesh, &notes.columns, up_axis(path)),
        Loaded::Points(points) => of_points(&points, &notes.columns, up_axis(path)),
        Loaded::Grid(grid) => of_grid(&grid, table),
        Loaded::Image(image) => of_image(&image),
        _ => return Err(Error::Internal("a reader gave data of no known kind".into())),
    };
    // What a scene can ask for by name is no longer without use.
    let columns: HashSet<&str> = notes.columns.iter().map(|column| column.name.as_str()).collect();
    let is_column = |name: &String| columns.contains(name.as_str());
    let unused = notes.unused.iter().filter(|name| !is_column(name)).cloned().collect();
    let of_table = table.into_iter().flat_map(|NamedTable { path, remarks, .. }| {
        remarks.iter().map(move |remark| format!("{}: {remark}", printable(path)))
    });
    let remarks = notes.remarks.into_iter().chain(facts.remarks).chain(of_table).collect();
    let mended = notes.mended.iter().map(Mended::to_string).collect();
    let warnings = notes.warnings;
    let unit = notes.unit;
    let stated = stated_up_axis(path);
    let stands = facts.bounds.filter(|_| stated.is_none()).and_then(|bounds| match facts.kind {
        "mesh" => stands_along(bounds),
        "points" => cloud_stands_along(bounds),
        "volume" => lies_flat_along(bounds),
        _ => None,
    });
    let up = stated.unwrap_or_default();
    let is_up_stated = stated.is_some();
    Ok(Facts {
        bytes,
        format: notes.format,
        unit,
        unused,
        remarks,
        mended,
        warnings,
        up,
        is_up_stated,
        stands,
        ..facts
    })
}

impl Facts {
    /// Distance of the data from the origin over its size; `None` without bounds or size.
    pub fn far(&self) -> Option<f64> {
        let bounds = self.bounds.filter(|b| b.diagonal() > 0.0)?;
        Some(bounds.center().length() / bounds.diagonal())
    }
}

fn present(columns: &[(&'static str, bool)]) -> Vec<&'static str> {
    columns.iter().filter(|(_, on)| *on).map(|(name, _)| *name).collect()
}

pub(crate) fn bounds_of(origin: DVec3, positions: &[Vec3]) -> Option<DAabb> {
    let bounds = Aabb::of_points(positions);
    (!bounds.is_empty()).then(|| DAabb::new(origin + bounds.min.as_dvec3(), origin + bounds.max.as_dvec3()))
}

fn range_of(values: impl Iterator<Item = f32>) -> [f32; 2] {
    values.fold([f32::INFINITY, f32::NEG_INFINITY], |r, v| [r[0].min(v), r[1].max(v)])
}

/// The ranges of columns that are there.
fn ranges<const N: usize>(columns: [(&str, Vec<f32>); N]) -> Vec<(String, [f64; 2])> {
    let there = columns.into_iter().filter(|(_, values)| !values.is_empty());
    there.map(|(name, values)| (name.to_owned(), range_of(values.into_iter()).map(f64::from))).collect()
}

/// The range of the coordinate along the axis that points up.
fn height(bounds: DAabb, up: UpAxis) -> (String, [f64; 2]) {
    ("height".to_owned(), [bounds.min, bounds.max].map(|corner| corner.dot(up.direction())))
}

fn of_mesh(mesh: &Mesh, further: &[NamedColumn], up: UpAxis) -> Facts {
    let bounds = bounds_of(mesh.origin, &mesh.position);
    let of_file = further.iter().filter_map(|c| Some((c.name.clone(), c.range?)));
    Facts {
        kind: "mesh",
        counts: vec![("vertices", mesh.position.len() as u64), ("triangles", mesh.triangles.len() as u64)],
        attributes: present(&[
            ("normal", !mesh.normal.is_empty()),
            ("color", !mesh.color.is_empty()),
            ("opacity", !mesh.opacity.is_empty()),
        ]),
        bounds,
        associations: further.iter().filter_map(|c| Some((c.name.clone(), c.association?))).collect(),
        columns: bounds.map(|bounds| height(bounds, up)).into_iter().chain(of_file).collect(),
        faults: Some(mesh_faults(mesh)),
        ..Facts::default()
    }
}

/// What is said of points whose x and y are no lengths.
const DEGREES: &str =
    "x and y look like degrees beside heights in metres: `degrees = true` of an object makes metres of them";

/// What is said of points with colours.
const AS_THEY_ARE: &str = "colours are drawn as they are, without light, unless the scene names a material";

/// What is said of points that are Gaussians.
fn of_gaussians(points: &RawPoints) -> Option<String> {
    let degree = points.gaussians.degree;
    (!points.gaussians.is_empty())
        .then(|| format!("its points are 3D Gaussians, with spherical harmonics of degree {degree}"))
}

/// What is said of points that are splats already.
fn of_splats(points: &RawPoints) -> Option<String> {
    let [medium, surface, opaque] = points.ready.kinds();
    (!points.ready.cloud.is_empty()).then(|| {
        format!("its points are splats: {medium} of media, {surface} of translucent surfaces, {opaque} of opaque ones")
    })
}

fn of_points(points: &RawPoints, further: &[NamedColumn], up: UpAxis) -> Facts {
    let bounds = bounds_of(points.origin, &points.position);
    let of_file = further.iter().filter_map(|c| Some((c.name.clone(), c.range?)));
    Facts {
        kind: "points",
        counts: vec![("points", points.position.len() as u64)],
        attributes: present(&[
            ("normal", !points.normal.is_empty()),
            ("color", !points.color.is_empty()),
            (points.value_name(), !points.value.is_empty()),
            ("opacity", !points.opacity.is_empty() || !points.gaussians.is_empty()),
            ("classification", !points.classification.is_empty()),
        ]),
        remarks: [
            (!points.color.is_empty()).then(|| AS_THEY_ARE.to_owned()),
            of_gaussians(points),
            of_splats(points),
            looks_like_degrees(points).then(|| DEGREES.to_owned()),
        ]
        .into_iter()
        .flatten()
        .collect(),
        bounds,
        spacing: median_spacing(&points.position),
        duplicates: Some(duplicates(&points.position)),
        columns: ranges([
            ("color", points.color.iter().flatten().copied().collect()),
            (points.value_name(), points.value.clone()),
            ("opacity", [&points.opacity[..], &points.gaussians.opacity].concat()),
            ("deviation", points.gaussians.axes.iter().flatten().map(|axis| axis.length()).collect()),
            ("classification", points.classification.iter().map(|c| f32::from(*c)).collect()),
        ])
        .into_iter()
        .chain(bounds.map(|bounds| height(bounds, up)))
        .chain(of_file)
        .chain(points.ready.ranges())
        .collect(),
        ..Facts::default()
    }
}

fn of_grid(grid: &Grid, table: Option<&NamedTable>) -> Facts {
    let [x, y, z] = grid.dims;
    // The corners of the lattice bound it, sheared or not.
    let last = |bit: usize, n: usize| if bit == 0 { 0 } else { n.saturating_sub(1) };
    let corners = (0..8).map(|c| grid.position(last(c & 1, x), last(c & 2, y), last(c & 4, z)));
    let range = range_of(grid.values.iter().copied());
    let wide = (range[1] > range[0]).then(|| range.map(f64::from));
    let reading = match table {
        Some(named) => Labels::by_table(grid, &named.table).map_or_else(
            |reason| {
                Reading::Doubtful(format!(
                    "it is taken for amounts, not for labels of {}: {reason}",
                    printable(&named.path)
                ))
            },
            Reading::Labels,
        ),
        None => Labels::from_grid(grid),
    };
    let said_of_labels = match &reading {
        Reading::Labels(labels) => Some(labels.said()),
        Reading::Doubtful(said) => {
            Some(Labels::doubt(said, grid, "`mesh = ` or `--preset labels` draws the surface of each label"))
        }
        Reading::Amounts => None,
    };
    let is_of_one_value = grid.values.len() > 1 && range[0] == range[1];
    let said_of_one_value =
        is_of_one_value.then(|| format!("every voxel has the value {}, so it shows as a box", range[0]));
    let labels = reading.labels();
    let fine = wide.map(|range| Histogram::new(&grid.values, range, FINE_BINS));
    Facts {
        kind: "volume",
        counts: vec![("x", x as u64), ("y", y as u64), ("z", z as u64)],
        bounds: Some(DAabb::of_points(corners)),
        steps: Some([grid.axes.x_axis, grid.axes.y_axis, grid.axes.z_axis]),
        range: (!grid.values.is_empty()).then_some(range),
        histogram: wide.map(|range| Histogram::new(&grid.values, range, BINS)),
        remarks: [FillValue::of_grid(grid).map(|fill| fill.to_string()), Strays::of_grid(grid).map(|s| s.to_string())]
            .into_iter()
            .flatten()
            .take(1)
            .chain(said_of_labels)
            .chain(said_of_one_value)
            .collect(),
        labels: labels.map_or_else(Vec::new, |labels| label_facts(grid, &labels, table.map(|named| &named.table))),
        quantiles: fine.iter().flat_map(|f| SHARES.map(|share| (share, f.quantile(share)))).collect(),
        ..Facts::default()
    }
}

/// How many voxels have which label.
fn label_facts(grid: &Grid, labels: &Labels, table: Option<&LabelTable>) -> Vec<LabelFact> {
    let mut voxels = vec![0u64; labels.0.len()];
    for value in grid.values.iter().filter(|value| **value > 0.0) {
        if let Ok(rank) = labels.0.binary_search_by(|label| label.total_cmp(&f64::from(*value))) {
            voxels[rank] += 1;
        }
    }
    let fact = |(number, voxels): (&f64, u64)| LabelFact {
        number: *number as u64,
        name: table.and_then(|table| table.name(*number)).unwrap_or_default().to_owned(),
        voxels,
        is_hidden: table.is_some_and(|table| table.opacity(*number) == 0.0),
    };
    labels.0.iter().zip(voxels).filter(|(number, _)| **number > 0.0).map(fact).collect()
}

fn of_image(image: &RadianceImage) -> Facts {
    Facts {
        kind: "image",
        counts: vec![("columns", u64::from(image.size[0])), ("rows", u64::from(image.size[1]))],
        range: Some(range_of(image.pixels.iter().flatten().copied())),
        ..Facts::default()
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
        let facts = of_grid(&grid, None);
        assert_eq!(facts.bounds, Some(DAabb::new(DVec3::new(0.0, 1.0, 1.0), DVec3::new(1.0, 3.0, 1.0))));
        assert_eq!(facts.range, Some([-1.0, 3.0]));
        assert_eq!(facts.histogram.map(|h| h.total()), Some(4));
    }

    #[test]
    fn a_volume_of_one_value_says_that_it_shows_as_a_box() {
        let of_values = |values: Vec<f32>| {
            let axes = DMat3::IDENTITY;
            of_grid(&Grid { origin: DVec3::ZERO, axes, dims: [2, 2, 1], values }, None).remarks
        };
        assert_eq!(of_values(vec![0.0; 4]), ["every voxel has the value 0, so it shows as a box"]);
        let told = of_values(vec![0.0, 0.25, 0.0, 0.75]);
        assert!(told.iter().all(|remark| !remark.contains("box")), "{told:?}");
    }

    #[test]
    fn an_empty_mesh_has_no_bounds_and_one_at_a_place_is_near_or_far() {
        let empty = of_mesh(&Mesh::default(), &[], UpAxis::Y);
        assert_eq!((empty.bounds, empty.far()), (None, None));
        let points = RawPoints {
            origin: DVec3::new(3e6, 0.0, 4e6),
            position: vec![Vec3::new(-0.5, 0.0, 0.0), Vec3::new(0.5, 0.0, 0.0)],
            ..RawPoints::default()
        };
        let facts = of_points(&points, &[], UpAxis::Z);
        assert_eq!((facts.far(), facts.spacing, facts.duplicates), (Some(5e6), Some(1.0), Some(0)));
        assert_eq!(facts.columns, [("height".to_owned(), [4e6, 4e6])]);
    }
}
