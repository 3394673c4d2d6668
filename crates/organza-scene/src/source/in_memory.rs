//! Data that a program has in memory: its scenes name it as `memory:NAME` where others name a file.

use crate::{Error, shown};
use read::Painting;
use sha2::{Digest, Sha256};
use splat_core::{Grid, Mesh, RadianceImage, RawPoints};
use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What a source that names data in memory begins with.
const MARK: &str = "memory:";
/// Longest name, bytes.
const LONGEST_NAME: usize = 200;

/// What a file holds, or a program has in memory.
#[derive(Debug, Clone)]
pub enum SourceData {
    /// Triangles.
    Mesh(Arc<Mesh>),
    /// Triangles with colours that lie between their vertices, as those of a texture do.
    Painted(Arc<Mesh>, Arc<Painting>),
    /// Points without faces.
    Points(Arc<RawPoints>),
    /// A regular volume.
    Grid(Arc<Grid>),
    /// An image of radiance.
    Image(Arc<RadianceImage>),
}

impl SourceData {
    /// Bytes that it holds.
    pub fn bytes(&self) -> u64 {
        match self {
            Self::Mesh(mesh) => mesh.bytes(),
            Self::Painted(mesh, painting) => mesh.bytes() + painting.bytes(),
            Self::Points(points) => points.bytes(),
            Self::Grid(grid) => grid.bytes(),
            Self::Image(image) => image.bytes(),
        }
    }

    /// Whether both are the same data in the same memory.
    pub fn is_same(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Mesh(one), Self::Mesh(other)) => Arc::ptr_eq(one, other),
            (Self::Painted(one, painting), Self::Painted(other, other_painting)) => {
                Arc::ptr_eq(one, other) && Arc::ptr_eq(painting, other_painting)
            }
            (Self::Points(one), Self::Points(other)) => Arc::ptr_eq(one, other),
            (Self::Grid(one), Self::Grid(other)) => Arc::ptr_eq(one, other),
            (Self::Image(one), Self::Image(other)) => Arc::ptr_eq(one, other),
            _ => false,
        }
    }

    /// Checks what readers of files check: lengths of columns, indices, numbers. Voxels may be NaN, which stands for no value.
    fn validate(&self) -> Result<(), splat_core::Error> {
        match self {
            Self::Mesh(mesh) => mesh.validate(),
            Self::Painted(mesh, painting) => {
                mesh.validate()?;
                let painted = painting.len();
                if painted != mesh.position.len() {
                    return Err(splat_core::Error::invalid(
                        "painting",
                        0,
                        "vertices",
                        painted,
                        "as many as the mesh has",
                    ));
                }
                Ok(())
            }
            Self::Points(points) => points.validate(),
            Self::Image(image) => image.validate(),
            Self::Grid(grid) => {
                let lattice = Grid { values: vec![0.0; grid.values.len().min(1)], dims: [1; 3], ..**grid };
                lattice.validate()?;
                let voxels = grid.dims.iter().try_fold(1usize, |product, side| product.checked_mul(*side));
                if voxels != Some(grid.values.len()) {
                    let expected = "as many lattice points as values";
                    return Err(splat_core::Error::invalid("grid", 0, "dims", grid.dims, expected));
                }
                match grid.values.iter().position(|value| value.is_infinite()) {
                    Some(i) => Err(splat_core::Error::invalid("voxel", i, "value", grid.values[i], "a finite number")),
                    None => Ok(()),
                }
            }
        }
    }

    /// Takes every number of it.
    fn digest(&self, hasher: &mut Sha256) {
        let vectors = |hasher: &mut Sha256, rows: &[splat_core::glam::Vec3]| {
            rows.iter().for_each(|row| hasher.update(bytemuck::bytes_of(row)));
        };
        match self {
            Self::Painted(mesh, painting) => {
                Self::Mesh(mesh.clone()).digest(hasher);
                painting.digest(&mut |bytes| hasher.update(bytes));
            }
            Self::Mesh(mesh) => {
                hasher.update(bytemuck::bytes_of(&mesh.origin));
                vectors(hasher, &mesh.position);
                vectors(hasher, &mesh.normal);
                hasher.update(bytemuck::cast_slice(&mesh.color));
                hasher.update(bytemuck::cast_slice(&mesh.opacity));
                hasher.update(bytemuck::cast_slice(&mesh.triangles));
                for column in &mesh.columns {
                    hasher.update(format!("{} of {}\n", column.name, column.association.name()));
                    hasher.update(bytemuck::cast_slice(&column.values));
                }
            }
            Self::Grid(grid) => {
                hasher.update(bytemuck::bytes_of(&grid.origin));
                hasher.update(bytemuck::cast_slice(&grid.axes.to_cols_array()));
                hasher.update(grid.dims.map(|side| side as u64).map(u64::to_le_bytes).as_flattened());
                hasher.update(bytemuck::cast_slice(&grid.values));
            }
            Self::Image(image) => {
                hasher.update(bytemuck::cast_slice(&image.size));
                hasher.update(bytemuck::cast_slice(&image.pixels));
            }
            // Its columns are many, and every number is written so that it reads back the same.
            Self::Points(points) => hasher.update(format!("{points:?}")),
        }
    }
}

/// Data that scenes may name, by name. Two are equal where they hold the same data in the same memory.
///
/// ```
/// use organza_scene::{InMemory, LoadOptions, SourceData, parse};
/// use splat_core::{Mesh, glam::DVec3};
/// let mut in_memory = InMemory::default();
/// let sheet = Mesh::rectangle(DVec3::ZERO, DVec3::X, DVec3::Y);
/// in_memory.insert("sheet", SourceData::Mesh(sheet.into())).unwrap();
/// let options = LoadOptions { in_memory, ..LoadOptions::default() };
/// let text = b"version = 1\n[camera]\nauto = true\nsize = [32, 32]\n[[object]]\nname = 'a'\nmesh = 'memory:sheet'\n";
/// assert!(parse("a.toml".as_ref(), text, &options).is_ok());
/// // A file of that name is not meant: what is not in memory is refused.
/// assert!(parse("a.toml".as_ref(), text, &LoadOptions::default()).is_err());
/// ```
#[derive(Clone, Default)]
pub struct InMemory {
    by_name: BTreeMap<String, SourceData>,
}

impl InMemory {
    /// Adds data under a name, in the place of what had that name before.
    ///
    /// # Errors
    /// [`Error::Usage`] for a name that is empty, long or has control characters, and for data that no file may hold: columns of other lengths, indices
    /// of vertices that are not there, numbers that are not finite.
    pub fn insert(&mut self, name: &str, data: SourceData) -> Result<(), Error> {
        if name.is_empty() || name.len() > LONGEST_NAME || name.chars().any(char::is_control) {
            let message = format!("expected a name of 1 to {LONGEST_NAME} bytes without control characters");
            return Err(Error::usage(format!("{message}, found \"{}\"", shown(name)), ""));
        }
        data.validate().map_err(|error| Error::usage(format!("{}: {error}", source_of(name)), ""))?;
        self.by_name.insert(name.to_owned(), data);
        Ok(())
    }

    /// The data of a source that a checked scene names; `None` for a file.
    pub fn get(&self, source: &Path) -> Option<&SourceData> {
        self.by_name.get(name_of(source)?)
    }

    /// The names.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.by_name.keys().map(String::as_str)
    }

    /// Adds all numbers of the data of a source.
    pub(crate) fn digest(&self, source: &Path, hasher: &mut Sha256) {
        if let Some(data) = self.get(source) {
            data.digest(hasher);
        }
    }
}

impl PartialEq for InMemory {
    fn eq(&self, other: &Self) -> bool {
        let pairs = || self.by_name.iter().zip(&other.by_name);
        let is_same = pairs().all(|(one, other)| one.0 == other.0 && one.1.is_same(other.1));
        self.by_name.len() == other.by_name.len() && is_same
    }
}

/// The names alone: data is large.
impl fmt::Debug for InMemory {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_set().entries(self.by_name.keys()).finish()
    }
}

/// The name that a source gives data in memory; `None` for a file.
pub fn name_of(source: &Path) -> Option<&str> {
    source.to_str()?.strip_prefix(MARK)
}

/// How a scene names data in memory.
pub fn source_of(name: &str) -> String {
    format!("{MARK}{name}")
}

/// A source as a scene has it, if that names data in memory: the path that stands for it, or why there is none, with a hint.
pub(crate) fn resolve(text: &str, in_memory: &InMemory) -> Option<Result<PathBuf, (String, String)>> {
    let name = text.strip_prefix(MARK)?;
    let path = PathBuf::from(text);
    if in_memory.get(&path).is_some() {
        return Some(Ok(path));
    }
    let known: Vec<String> = in_memory.names().map(|name| format!("\"{}\"", shown(&source_of(name)))).collect();
    let hint = if known.is_empty() {
        "only a program that hands its data over can name it so; a file of that name is \"./memory:…\"".to_owned()
    } else {
        format!("there is {}", known.join(", "))
    };
    Some(Err((format!("no data in memory is called `{}`", shown(name)), hint)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::glam::{DMat3, DVec3, Vec3};

    fn grid(values: Vec<f32>) -> SourceData {
        SourceData::Grid(Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims: [2, 1, 1], values }.into())
    }

    #[test]
    fn data_that_no_file_may_hold_is_refused() {
        let mut in_memory = InMemory::default();
        let points =
            |position: Vec3| SourceData::Points(RawPoints { position: vec![position], ..RawPoints::default() }.into());
        let flat = Grid { origin: DVec3::ZERO, axes: DMat3::ZERO, dims: [2, 1, 1], values: vec![0.0; 2] };
        let faces = Mesh { position: vec![Vec3::ZERO], triangles: vec![[0, 0, 1]], ..Mesh::default() };
        for (data, said) in [
            (points(Vec3::NAN), "position"),
            (grid(vec![1.0]), "as many lattice points as values"),
            (grid(Vec::new()), "lattice points"),
            (grid(vec![f32::INFINITY, 0.0]), "voxel"),
            (SourceData::Grid(flat.into()), "span space"),
            (SourceData::Mesh(faces.into()), "vertex index"),
        ] {
            let refused = in_memory.insert("a", data).unwrap_err().to_string();
            assert!(refused.contains(said) && refused.contains("memory:a"), "{refused}");
        }
        for name in ["", "a\nb", &"a".repeat(LONGEST_NAME + 1)] {
            assert!(in_memory.insert(name, points(Vec3::ZERO)).is_err(), "{name:?}");
        }
        assert!(in_memory.insert("a", grid(vec![f32::NAN, 1.0])).is_ok(), "a voxel without a value");
    }

    #[test]
    fn equal_is_what_lies_in_the_same_memory() {
        let data = grid(vec![0.0, 1.0]);
        let with = |name: &str, data: &SourceData| {
            let mut in_memory = InMemory::default();
            in_memory.insert(name, data.clone()).unwrap();
            in_memory
        };
        assert_eq!(with("a", &data), with("a", &data));
        assert_ne!(with("a", &data), with("b", &data));
        assert_ne!(with("a", &data), with("a", &grid(vec![0.0, 1.0])));
        assert_ne!(with("a", &data), InMemory::default());
    }
}
