//! A data file as a first scene takes it: what it holds, and the name of its object.

use crate::facts::bounds_of;
use crate::preset::Wish;
use crate::stands::{cloud_stands_along, extent, lies_before_camera, lies_flat_along, stands_along};
use organza::{Context, Error, SourceData, printable, scene};
use read::{ReadParams, stated_up_axis};
use splat_core::{Mesh, UpAxis};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// A data file that was read.
#[derive(Debug)]
pub struct DataFile {
    /// The file, as it was named.
    pub path: PathBuf,
    /// What it holds.
    pub data: SourceData,
    /// Which of its axes points up, if its format says so.
    pub stated_up: Option<UpAxis>,
    /// Which one points up by how it stands, where its format says nothing of that.
    pub stands: Option<UpAxis>,
    /// Whether x and y of its points look like degrees.
    pub degrees: bool,
    /// The array of a VTK volume that was asked for.
    pub array: Option<String>,
    /// The value of the voxels of a volume that have none, which are NaN in [`Self::data`].
    pub nodata: Option<f32>,
    /// Why a volume has no such array.
    pub array_error: Option<Error>,
    /// The value of a volume outside of the cells that it was sampled from; `None` where its voxels are those of the file.
    pub value_outside: Option<f64>,
    /// The column of a mesh that was asked for, or that its file shows.
    pub column: Option<ShownColumn>,
    /// All columns that a mesh may be coloured by.
    pub columns: Vec<String>,
}

/// The column of a mesh that a first scene may colour it by.
#[derive(Debug, Clone, PartialEq)]
pub struct ShownColumn {
    /// Its name, as `color_by` takes it.
    pub name: String,
    /// Its least and its greatest finite number.
    pub range: [f64; 2],
    /// How many numbers it has, if these are few whole ones from −1 on, which often stands for none.
    pub labels: Option<usize>,
}

impl ShownColumn {
    /// A column of a mesh by its name; `None` where the mesh has no such column, and where that has no finite number.
    fn of_mesh(mesh: &Mesh, name: &str) -> Option<Self> {
        /// Numbers up to which whole ones may be labels.
        const MOST_LABELS: usize = 256;
        let column = mesh.columns.iter().find(|column| column.name == name)?;
        let numbers = || column.values.iter().copied().filter(|number| number.is_finite());
        let range = [numbers().fold(f64::INFINITY, f64::min), numbers().fold(f64::NEG_INFINITY, f64::max)];
        let is_label = |number: f64| number >= -1.0 && number.fract() == 0.0;
        let mut known = BTreeSet::new();
        let are_few = numbers().all(|number| {
            known.insert(number as i64);
            is_label(number) && known.len() <= MOST_LABELS
        });
        let labels = (are_few && known.len() > 1).then_some(known.len());
        (range[0] <= range[1]).then(|| Self { name: name.to_owned(), range, labels })
    }

    /// Whether all its numbers are one.
    pub(crate) fn is_constant(&self) -> bool {
        self.range[0] == self.range[1]
    }
}

impl DataFile {
    /// Reads a file with the column that `wish` names, or takes it from those that were read before; refuses what a scene shows nothing of.
    ///
    /// # Errors
    /// As [`organza::Files::read`]; [`Error::Input`] for a file without points or faces, and for an image.
    pub fn read(path: &Path, wish: &Wish, context: Context<'_>) -> Result<Self, Error> {
        let Context { files, options, progress } = context;
        let columns = wish.color_by.iter().cloned().collect();
        let params = ReadParams { columns, surfaces: !wish.shows_inside(), ..options.read_params() };
        let mut data = files.read(path, &params, progress)?;
        let mut column = None;
        if let SourceData::Mesh(mesh) = &data
            && let Some(name) = wish.color_by.clone().or_else(|| files.shown_column(path))
        {
            let mesh = if mesh.columns.iter().any(|column| column.name == name) {
                mesh.clone()
            } else {
                match files.read(path, &ReadParams { columns: vec![name.clone()], ..params.clone() }, progress)? {
                    SourceData::Mesh(with_column) => with_column,
                    _ => mesh.clone(),
                }
            };
            column = ShownColumn::of_mesh(&mesh, &name);
            data = SourceData::Mesh(mesh);
        }
        let mut array = None;
        let mut array_error = None;
        if let (SourceData::Grid(_), Some(name)) = (&data, &wish.color_by) {
            let params = ReadParams { array: Some(name.clone()), ..options.read_params() };
            match files.read(path, &params, progress) {
                Ok(of_array) => {
                    data = of_array;
                    array = Some(name.clone());
                }
                Err(Error::Cancelled) => return Err(Error::Cancelled),
                Err(error) => array_error = Some(error),
            }
        }
        let stated_up = stated_up_axis(path);
        let value_outside = files.value_outside(path);
        let columns = files.named_columns(path);
        Ok(Self { array, array_error, value_outside, column, columns, ..Self::of_data(path, data, stated_up, wish)? })
    }

    /// Data that a program has in memory under this name, and the axis of it that points up, where that is known; of points all columns are there.
    ///
    /// # Errors
    /// [`Error::Input`] for a mesh without faces, no points, and an image.
    pub fn in_memory(name: &str, data: SourceData, up: Option<UpAxis>, wish: &Wish) -> Result<Self, Error> {
        Self::of_data(Path::new(&scene::source_in_memory(name)), data, up, wish)
    }

    /// What a first scene asks of data.
    fn of_data(path: &Path, mut data: SourceData, stated_up: Option<UpAxis>, wish: &Wish) -> Result<Self, Error> {
        let mut nodata = None;
        if let SourceData::Grid(grid) = &data
            && let Some(fill) = convert::FillValue::of_grid(grid)
        {
            nodata = Some(fill.value);
            data = SourceData::Grid(convert::without_value(grid, fill.value).0.into());
        }
        let refuse = |message: &str, hint: &str| Err(Error::input(printable(path), message, hint));
        match &data {
            SourceData::Mesh(mesh) | SourceData::Painted(mesh, _) if mesh.triangles.is_empty() => {
                refuse("expected at least one face or line, found none", "save its surface as triangles")
            }
            SourceData::Points(points) if points.is_empty() => refuse("expected at least one point, found none", ""),
            SourceData::Grid(grid) if grid.values.iter().all(|value| value.is_nan()) => {
                refuse("expected at least one number, found NaN in all voxels", "")
            }
            SourceData::Image(_) => {
                let message = "an image of radiance is an environment, and not a thing to look at";
                refuse(message, "name it in a scene: [background] environment = \"FILE\"")
            }
            _ => {
                let stands = match &data {
                    SourceData::Mesh(mesh) | SourceData::Painted(mesh, _) => stands_along(mesh.bounds()),
                    SourceData::Points(points) => {
                        let stands = bounds_of(points.origin, &points.position).and_then(cloud_stands_along);
                        let positions = points.position.iter().map(|p| points.origin + p.as_dvec3());
                        stands.or_else(|| lies_before_camera(positions).then_some(UpAxis::MinusY))
                    }
                    SourceData::Grid(grid) => lies_flat_along(extent(grid)),
                    SourceData::Image(_) => None,
                };
                let degrees = matches!(&data, SourceData::Points(points) if convert::looks_like_degrees(points));
                // Heights are along z then.
                let stands = if degrees { Some(UpAxis::Z) } else { stands };
                let stands = stands.filter(|_| stated_up.is_none() && wish.up.is_none());
                Ok(Self {
                    path: path.to_owned(),
                    data,
                    stated_up,
                    stands,
                    degrees,
                    array: None,
                    nodata,
                    array_error: None,
                    value_outside: None,
                    column: None,
                    columns: Vec::new(),
                })
            }
        }
    }

    /// A name for its object: that of the file, with what would part a path of `--set` replaced.
    pub(crate) fn name(&self) -> String {
        if let Some(name) = scene::name_in_memory(&self.path) {
            return named(name);
        }
        let name = self.path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let stem = name.strip_suffix(".gz").unwrap_or(&name);
        let stem = stem.rsplit_once('.').map_or(stem, |(stem, _)| stem);
        named(stem)
    }

    /// Whether its data has colours of its own, those of splats too.
    pub(crate) fn is_colored(&self) -> bool {
        self.has_colors() || matches!(&self.data, SourceData::Points(points) if !points.ready.cloud.is_empty())
    }

    /// Whether its vertices or points have colours that show something.
    pub(crate) fn has_colors(&self) -> bool {
        !self.colors().is_empty() && !self.is_black()
    }

    /// Whether all its colours are black: those of a file that has room for colours, and none.
    pub(crate) fn is_black(&self) -> bool {
        // Between vertices a texture may have other colours.
        let has_texture = matches!(self.data, SourceData::Painted(..));
        !has_texture && !self.colors().is_empty() && self.colors().iter().all(|color| *color == [0.0; 3])
    }

    fn colors(&self) -> &[[f32; 3]] {
        match &self.data {
            SourceData::Mesh(mesh) | SourceData::Painted(mesh, _) => &mesh.color,
            SourceData::Points(points) => &points.color,
            _ => &[],
        }
    }

    /// Mean luminance of its own colours.
    pub(crate) fn luminance(&self) -> Option<f64> {
        let colors = if self.has_colors() { self.colors() } else { &[] };
        let luminance = |c: &[f32; 3]| f64::from(0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]);
        (!colors.is_empty()).then(|| colors.iter().map(luminance).sum::<f64>() / colors.len() as f64)
    }
}

/// A text as a name of an object.
fn named(text: &str) -> String {
    const LONGEST: usize = 60;
    let fits = |c: char| if c.is_alphanumeric() || c == '-' || c == '_' { c } else { '-' };
    let name: String = text.chars().take(LONGEST).map(fits).collect();
    if name.trim_matches('-').is_empty() { "object".to_owned() } else { name }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::preset::Preset;
    use organza::{Files, Progress, RenderOptions};
    use splat_core::glam::{DMat3, DVec3};
    use splat_core::{Grid, RawPoints};

    #[test]
    fn colours_that_are_all_black_are_none() {
        let file = |color: Vec<[f32; 3]>| {
            let points = RawPoints { position: vec![Default::default(); color.len()], color, ..RawPoints::default() };
            DataFile {
                path: "a.las".into(),
                data: SourceData::Points(points.into()),
                stated_up: None,
                stands: None,
                degrees: false,
                array: None,
                nodata: None,
                array_error: None,
                value_outside: None,
                column: None,
                columns: Vec::new(),
            }
        };
        let black = file(vec![[0.0; 3]; 3]);
        assert!(black.is_black() && !black.is_colored() && black.luminance().is_none());
        let dark = file(vec![[0.0; 3], [0.0, 0.0, 1e-3]]);
        assert!(!dark.is_black() && dark.is_colored() && dark.luminance().is_some_and(|l| l > 0.0));
        assert!(!file(Vec::new()).is_black() && !file(Vec::new()).is_colored());
    }

    #[test]
    fn a_volume_without_a_number_is_refused_by_name() {
        let grid = Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims: [2; 3], values: vec![f32::NAN; 8] };
        let error = DataFile::in_memory("fog", SourceData::Grid(grid.into()), None, &Wish::default()).unwrap_err();
        assert!(error.to_string().contains("memory:fog: expected at least one number, found NaN"), "{error}");
    }

    #[test]
    fn the_value_outside_of_cells_comes_from_the_reader_whatever_the_ending() {
        let folder = std::env::temp_dir().join(format!("organza-outside-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder");
        let read = |name: &str, content: &str| {
            let path = folder.join(name);
            std::fs::write(&path, content).expect("a file");
            let context =
                Context { files: &Files::default(), options: &RenderOptions::default(), progress: &Progress::new() };
            // Cells are sampled for what is inside of them.
            let wish = Wish { preset: Some(Preset::named("mri").expect("a look")), ..Wish::default() };
            DataFile::read(&path, &wish, context).expect("a volume").value_outside
        };
        let head = "# vtk DataFile Version 3.0\na\nASCII\nDATASET";
        let cells =
            "UNSTRUCTURED_GRID\nPOINTS 4 float\n0 0 0\n1 0 0\n0 1 0\n0 0 1\nCELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10";
        assert_eq!(read("a.vtk", &format!("{head} {cells}\n")), Some(0.0));
        let voxels = "STRUCTURED_POINTS\nDIMENSIONS 2 1 1\nORIGIN 0 0 0\nSPACING 1 1 1\nPOINT_DATA 2\nSCALARS a float\nLOOKUP_TABLE default\n1 2";
        assert_eq!(read("b.vtk", &format!("{head} {voxels}\n")), None);
        std::fs::remove_dir_all(&folder).expect("its own folder");
    }

    #[test]
    fn objects_are_named_after_files_without_what_parts_paths() {
        let name = |path: &str| {
            let data = SourceData::Points(RawPoints::default().into());
            DataFile {
                path: path.into(),
                data,
                stated_up: None,
                stands: None,
                degrees: false,
                array: None,
                nodata: None,
                array_error: None,
                value_outside: None,
                column: None,
                columns: Vec::new(),
            }
            .name()
        };
        assert_eq!(name("a/bun_zipper.ply.gz"), "bun_zipper");
        assert_eq!(name("head v1.2.nii"), "head-v1-2");
        assert_eq!([name("...."), name("a/..")], ["object", "object"]);
        assert_eq!(name("grün.las"), "grün");
    }
}
