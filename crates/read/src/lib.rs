//! Reading files: meshes (PLY, STL, OBJ, OFF, glTF), point clouds (PLY, OBJ, OFF, PCD, glTF, XYZ, CSV, LAS, LAZ, E57), 3D Gaussians (PLY, packed
//! PLY, .splat, .ksplat, SPZ, SOG), volumes (NIfTI,
//! NRRD, MetaImage, DICOM, VTK, TIFF, folders of slices, raw) and images of radiance (Radiance HDR, OpenEXR, PNG), each also inside gzip.
//!
//! No input makes a reader panic or take memory that the file does not stand for: sizes that a header announces are
//! checked against the length of the file before anything is allocated.

//!
//! ```
//! use read::{Loaded, ReadParams};
//! let (loaded, notes) = read::bytes("two.xyz", b"0 0 1\n2 0 1\n", &ReadParams::default(), None).unwrap();
//! let Loaded::Points(points) = loaded else { panic!("points") };
//! assert_eq!((points.len(), notes.format.as_str()), (2, "Xyz"));
//! ```
#![forbid(unsafe_code)]
#![cfg_attr(
    not(all(
        feature = "ply",
        feature = "obj",
        feature = "off",
        feature = "gltf",
        feature = "sog",
        feature = "las",
        feature = "e57",
        feature = "nifti",
        feature = "vti",
        feature = "vtk",
        feature = "tiff",
        feature = "exr",
        feature = "png"
    )),
    allow(
        dead_code,
        unused_imports,
        unused_variables,
        unused_mut,
        reason = "fewer readers leave parts that all share unused"
    )
)]

mod error;
mod format;
mod guarded;
mod images;
mod label_rows;
mod meshes;
mod points;
mod reading;
mod stream;
mod text;
mod volumes;

pub use error::{Fault, Place, ReadError};
pub use format::unread::is_foreign_json;
pub use format::up::{stated_up_axis, up_axis};
pub use guarded::panic_is_input_error;
pub use label_rows::{LabelRow, LabelRows, label_rows, label_rows_of_bytes};
#[cfg(feature = "textures")]
pub use meshes::paint::Painting;
#[cfg(feature = "textures")]
pub use meshes::rgba::Rgba;
#[cfg(feature = "ply")]
pub use meshes::textured::{
    PaintingParts, TextureImage, TexturePlaces, painting_of_parts, parts_of_painting, smoothed_in_memory,
    textured_in_memory,
};
pub use reading::{Fix, Mended, NamedColumn, Notes, Textures};
/// The nouns that this crate takes and returns.
pub use splat_core;

use format::up::unpacked_beginning;
use format::{Format, folder, format_of, is_raw, unread};
#[cfg(feature = "exr")]
use images::openexr;
#[cfg(feature = "png")]
use images::png;
use images::radiance;
#[cfg(feature = "gltf")]
use meshes::gltf;
#[cfg(feature = "obj")]
use meshes::obj;
#[cfg(feature = "off")]
use meshes::off;
use meshes::outwards::turn_outwards;
#[cfg(feature = "ply")]
use meshes::ply;
use meshes::stl;
#[cfg(feature = "e57")]
use points::e57;
use points::extras::LONGEST_NAME;
#[cfg(feature = "las")]
use points::las;
#[cfg(feature = "sog")]
use points::sog;
use points::{ksplat, pcd, splat, spz, xyz};
use rayon::prelude::*;
use reading::Reading;
use splat_core::glam::{DMat3, DVec3};
use splat_core::points::attributes::attribute;
use splat_core::text::{counted, escaped, escaped_path};
use splat_core::{Grid, MemoryAccount, Mesh, Progress, RadianceImage, RawPoints};
use std::path::{Path, PathBuf};
use stream::input;
use stream::input::Stream;
#[cfg(feature = "nifti")]
use volumes::nifti;
#[cfg(any(feature = "tiff", feature = "png"))]
use volumes::slices;
#[cfg(feature = "tiff")]
use volumes::tiff;
#[cfg(feature = "vti")]
use volumes::vti;
#[cfg(feature = "vtk")]
use volumes::vtk;
use volumes::{dicom, lattice, metaimage, nrrd, raw, rounded};

/// Limits of reading, the parts of a file to keep, and the treatment of its faults.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ReadParams {
    /// Account of the bytes that reading holds at a time: whole files, unpacked streams, images, and the data made of them.
    /// All are released when the file is read; a caller that keeps the data accounts [`Loaded::bytes`] for it.
    pub memory: MemoryAccount,
    /// Whether points of a cloud with a coordinate that is not finite are left out and counted in
    /// [`RawPoints::dropped`] instead of refused. Vertices of a mesh are always refused.
    pub drop_invalid: bool,
    /// Whether a file with a fault that could be mended (see [`Fix`]) is refused instead.
    pub strict: bool,
    /// Which volume of a series is read, from 0; other files have a frame 0 alone.
    pub frame: u64,
    /// Points that are wanted at most. Of a file that has levels of detail (COPC) whole levels are read, coarsest first, as far as that
    /// goes, and the coarsest in any case; other files are read whole.
    pub most_points: Option<u64>,
    /// Columns of a mesh that are kept in [`Mesh::columns`], and columns of points that are kept in [`RawPoints::columns`] beside those that have a meaning, each by its name in the file or by one
    /// that [`RawPoints::column`] knows. One that a file of points has not is an error that names those that it has.
    pub columns: Vec<String>,
    /// Name of the array of a VTK file that is the volume's field, of a channel of a TIFF stack, or the UID or description of a DICOM series; `None` for the one that the file names, else the first of one number a
    /// point or cell, the first channel, and the series of most slices. One that the file has not is an error that names those that it has, as one of another format is.
    pub array: Option<String>,
    /// The size of a voxel of a volume, in the place of the file's.
    pub voxel_size: Option<VoxelSize>,
    /// Whether cells of VTK that enclose a volume are read as the faces around them, a mesh with columns, and not as a volume.
    pub surfaces: bool,
    /// Whether points may become a medium: columns `smoothing_length`, `extinction` and `mass` are kept too, beside those that are kept of all
    /// points where there are such, `radius`, `tx`, `ty`, `tz`, `shadow_coefficient`, `footprint` and `material`. Numbers that these cannot have are refused, see
    /// `convert::raw_to_matter` and `convert::raw_to_surfels`.
    pub matter: bool,
    /// Whether the ranges of all columns of points are found, kept or not, for [`Notes::columns`].
    pub ranges: bool,
    /// Whether the samples of a PNG are numbers, from 0 to 1 as they are stored, and no colours of a display.
    pub is_data: bool,
    /// Whether an image says how much of each place something covers, which all three channels then hold: the alpha of a PNG or OpenEXR, or
    /// where it has none how bright it is, the samples of a PNG as numbers.
    pub is_coverage: bool,
    /// The treatment of the textures of a mesh.
    pub textures: Textures,
}

impl Default for ReadParams {
    /// 4 GiB, nothing dropped, what can be mended is mended, the first of a series, all points, no further columns, the first array, pictures in colours of a
    /// display, textures as colours of vertices.
    fn default() -> Self {
        Self {
            memory: MemoryAccount::default(),
            drop_invalid: false,
            strict: false,
            frame: 0,
            most_points: None,
            columns: Vec::new(),
            array: None,
            voxel_size: None,
            surfaces: false,
            matter: false,
            ranges: false,
            is_data: false,
            is_coverage: false,
            textures: Textures::Divided,
        }
    }
}

/// Steps between the voxels of a volume along its three axes, finite and above 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VoxelSize([f64; 3]);

/// None of the steps is NaN.
impl Eq for VoxelSize {}

impl VoxelSize {
    /// `None` unless all steps are finite and above 0.
    ///
    /// ```
    /// use read::VoxelSize;
    /// assert!(VoxelSize::new([0.5, 0.5, 2.0]).is_some() && VoxelSize::new([0.5, 0.0, 2.0]).is_none());
    /// ```
    pub fn new(steps: [f64; 3]) -> Option<Self> {
        steps.iter().all(|step| step.is_finite() && *step > 0.0).then_some(Self(steps))
    }

    /// The steps.
    pub fn steps(self) -> [f64; 3] {
        self.0
    }
}

impl ReadParams {
    /// Whether what was read with these is what `others` ask for: they are alike, but for columns that are there beside those.
    pub fn serves(&self, others: &Self) -> bool {
        let alike = *self == Self { columns: self.columns.clone(), ..others.clone() };
        alike && others.columns.iter().all(|name| self.columns.contains(name))
    }
}

/// What a file holds, in the file's own axes and units. Meshes face outwards, also where the file's do not.
#[expect(clippy::large_enum_variant, reason = "there is one a file")]
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Loaded {
    /// Vertices with faces.
    Mesh(Mesh),
    /// The same with colours that lie between the vertices; only with [`Textures::Kept`].
    #[cfg(feature = "textures")]
    Painted(Mesh, Painting),
    /// Points without faces, which may be Gaussians.
    Points(RawPoints),
    /// A regular volume.
    Grid(Grid),
    /// An image of radiance.
    Image(RadianceImage),
}

impl Loaded {
    /// Bytes that it holds.
    pub fn bytes(&self) -> u64 {
        match self {
            Self::Mesh(mesh) => mesh.bytes(),
            #[cfg(feature = "textures")]
            Self::Painted(mesh, painting) => mesh.bytes() + painting.bytes(),
            Self::Points(points) => points.bytes(),
            Self::Grid(grid) => grid.bytes(),
            Self::Image(image) => image.bytes(),
        }
    }
}

/// Reads a regular file, or a folder of slices, and says what there is to say of it; its first bytes tell the format, its extension only words the
/// error if they do not. Reading stops where `progress` is cancelled.
///
/// # Errors
/// [`ReadError`] with the file's name, the place, what was expected and what was found, and one with
/// [`Fault::Cancelled`].
pub fn file(path: &Path, params: &ReadParams, progress: Option<&Progress>) -> Result<(Loaded, Notes), ReadError> {
    let name = escaped_path(path);
    let params = &ReadParams { memory: params.memory.part(), ..params.clone() };
    let mut reading = Reading::new(params, progress);
    let loaded = match std::fs::metadata(path) {
        Ok(about) if about.is_dir() => whole_folder(path, &mut reading),
        _ => Stream::open(path, params).and_then(|stream| whole(path, stream, Some(path), &mut reading)),
    };
    Ok((loaded.map_err(|e| e.in_file(&name))?, reading.finish(&name)))
}

/// The files that a source is made of: itself, or of a folder those in it, in the order of their names.
///
/// # Errors
/// [`ReadError`] for a folder that cannot be read.
pub fn files_of(path: &Path) -> Result<Vec<PathBuf>, ReadError> {
    if std::fs::metadata(path).is_ok_and(|about| about.is_dir()) {
        return folder::files(path).map_err(|e| e.in_file(&escaped_path(path)));
    }
    Ok(vec![path.to_owned()])
}

/// The content of a folder, which has a file for each slice of a volume.
fn whole_folder(path: &Path, reading: &mut Reading<'_>) -> Result<Loaded, ReadError> {
    reading.go_on()?;
    let files = folder::files(path)?;
    let is_slice = |file: &PathBuf| unpacked_beginning(file).is_some_and(|head| dicom::is_dicom(&head));
    if files.iter().take(LOOKED_AT).any(is_slice) {
        "Dicom".clone_into(&mut reading.notes.format);
        let loaded = dicom::read(path, None, reading).map(Loaded::Grid)?;
        return finished(loaded, reading);
    }
    #[cfg(feature = "sog")]
    if let Some(description) = folder::sog_description(&files) {
        let stream = Stream::open(description, reading.params)?;
        return whole(description, stream, Some(description), reading);
    }
    #[cfg(any(feature = "tiff", feature = "png"))]
    if slices::has_slices(&files) {
        "Slices".clone_into(&mut reading.notes.format);
        let loaded = slices::read(path, files, reading).map(Loaded::Grid)?;
        return finished(loaded, reading);
    }
    Err(unread::folder(path))
}

/// Reads a file that is in memory already; `name` serves messages and tells the format where the content does not.
///
/// # Errors
/// [`ReadError`] as [`file()`] gives it.
pub fn bytes(
    name: &str,
    content: &[u8],
    params: &ReadParams,
    progress: Option<&Progress>,
) -> Result<(Loaded, Notes), ReadError> {
    let shown = escaped(name.as_bytes(), usize::MAX);
    let params = &ReadParams { memory: params.memory.part(), ..params.clone() };
    let mut reading = Reading::new(params, progress);
    let loaded = whole(Path::new(name), Stream::in_memory(content, params), None, &mut reading);
    Ok((loaded.map_err(|e| e.in_file(&shown))?, reading.finish(&shown)))
}

/// Most bytes that [`meshes::outwards`] takes for a vertex, each of three in a part of its own.
const BYTES_PER_PART: u64 = 13 + 48;

/// Points that are in memory already, as [`file()`] takes them: refused where a column that was asked for is not there. `name` serves messages.
///
/// # Errors
/// [`ReadError`] as [`file()`] gives it.
pub fn points_in_memory(name: &str, points: &RawPoints, params: &ReadParams) -> Result<Notes, ReadError> {
    let mut reading = Reading::new(params, None);
    let unused = points.columns.iter().map(|column| column.name.as_str());
    let unused = unused
        .filter(|name| attribute(name, params.matter).is_none())
        .map(|name| escaped(name.as_bytes(), LONGEST_NAME));
    reading.notes.unused = unused.collect();
    check_columns(points, &mut reading).map_err(|e| e.in_file(name))?;
    Ok(reading.finish(name))
}

/// The same of a volume: refused without any value.
///
/// # Errors
/// [`ReadError`] as [`file()`] gives it.
pub fn grid_in_memory(name: &str, grid: &Grid, params: &ReadParams) -> Result<Notes, ReadError> {
    let mut reading = Reading::new(params, None);
    remark_gaps(grid, &mut reading).map_err(|e| e.in_file(name))?;
    Ok(reading.finish(name))
}

/// The same of the columns of a mesh: those that nobody asked for are named.
///
/// # Errors
/// [`ReadError`] as [`file()`] gives it.
pub fn mesh_columns_in_memory(name: &str, mesh: &Mesh, params: &ReadParams) -> Result<Notes, ReadError> {
    let mut reading = Reading::new(params, None);
    check_mesh_columns(mesh, &reading).map_err(|e| e.in_file(name))?;
    let unused = mesh.columns.iter().filter(|column| !params.columns.contains(&column.name));
    reading.notes.unused = unused.map(|column| escaped(column.name.as_bytes(), LONGEST_NAME)).collect();
    Ok(reading.finish(name))
}

/// The same of a mesh: turned outwards.
///
/// # Errors
/// [`ReadError`] as [`file()`] gives it.
pub fn mesh_in_memory(name: &str, mesh: Mesh, params: &ReadParams) -> Result<(Mesh, Notes), ReadError> {
    let mut reading = Reading::new(params, None);
    check_mesh_columns(&mesh, &reading).map_err(|e| e.in_file(name))?;
    let mesh = outwards(mesh, &mut reading).map_err(|e| e.in_file(name))?;
    Ok((mesh, reading.finish(name)))
}

/// Formats of volumes of which one array, or one channel, is read.
const WITH_ARRAYS: [&str; 4] = ["Vtk", "VtkXml", "Tiff", "Dicom"];

/// The content with meshes turned outwards.
fn whole(
    path: &Path,
    stream: Stream<'_>,
    place: Option<&Path>,
    reading: &mut Reading<'_>,
) -> Result<Loaded, ReadError> {
    let loaded = parse(path, stream, place, reading)?;
    finished(loaded, reading)
}

/// The content with meshes turned outwards, as far as the parameters fit it.
fn finished(loaded: Loaded, reading: &mut Reading<'_>) -> Result<Loaded, ReadError> {
    if reading.params.frame > 0 && !matches!(loaded, Loaded::Grid(_)) {
        let expected = "a series of volumes";
        let found = "a file of another kind";
        return Err(ReadError::input(Place::File, expected, found, "leave out `frame`"));
    }
    if reading.params.voxel_size.is_some() && !matches!(loaded, Loaded::Grid(_)) {
        let hint = "leave out `voxel_size`; `transform` has a `scale`";
        return Err(ReadError::input(Place::File, "a volume", "a file of another kind", hint));
    }
    let has_array = matches!(loaded, Loaded::Grid(_)) && WITH_ARRAYS.contains(&reading.notes.format.as_str());
    if let (Some(name), false) = (&reading.params.array, has_array) {
        let found = format!("the array '{}', and a file without arrays", escaped(name.as_bytes(), LONGEST_NAME));
        return Err(ReadError::input(
            Place::File,
            "a volume of VTK or DICOM, or a TIFF stack",
            found,
            "leave out `array`, or `--color-by`, which names it on the command line",
        ));
    }
    match loaded {
        Loaded::Points(points) => check_columns(&points, reading).map(|()| Loaded::Points(points)),
        Loaded::Grid(mut grid) => {
            remark_gaps(&grid, reading)?;
            if let Some(size) = reading.params.voxel_size {
                resize_voxels(&mut grid, size, &mut reading.notes)?;
            }
            Ok(Loaded::Grid(grid))
        }
        Loaded::Mesh(mesh) => {
            check_mesh_columns(&mesh, reading)?;
            let mesh = outwards(mesh, reading)?;
            #[cfg(feature = "textures")]
            if let Some(painting) = reading.painting.take() {
                return Ok(Loaded::Painted(mesh, painting));
            }
            Ok(Loaded::Mesh(mesh))
        }
        #[cfg(feature = "textures")]
        painted @ Loaded::Painted(..) => Ok(painted),
        Loaded::Image(image) => Ok(Loaded::Image(image)),
    }
}

/// Gives voxels the size that was asked for; what the file says of it no longer holds.
fn resize_voxels(grid: &mut Grid, size: VoxelSize, notes: &mut Notes) -> Result<(), ReadError> {
    const HINT: &str = "`voxel_size` and the places of the file are too unlike: check both";
    let before = [grid.axes.x_axis, grid.axes.y_axis, grid.axes.z_axis];
    let steps = size.steps();
    let mut axes = before;
    for (axis, step) in axes.iter_mut().zip(steps) {
        *axis *= step / axis.length();
    }
    let axes = DMat3::from_cols(axes[0], axes[1], axes[2]);
    // The corner of the lattice moves as its steps do, so that a stack lies as if its file stated them.
    grid.origin = axes * (grid.axes.inverse() * grid.origin);
    grid.axes = axes;
    lattice::check(grid.origin, &grid.axes, Place::File, HINT)?;
    notes.remarks.retain(|remark| !remark.starts_with(VOXELS_OF));
    notes.unit = None;
    let shown = |steps: [f64; 3]| steps.map(|step| rounded(step).to_string()).join(" x ");
    let old = before.map(|axis| axis.length());
    if old != steps {
        notes.remark(format!("{VOXELS_OF} {} by `voxel_size`, in the place of {}", shown(steps), shown(old)));
    }
    Ok(())
}

/// The beginning of remarks about the size of voxels.
const VOXELS_OF: &str = "voxels of";

/// The mesh with parts that are inside out turned.
fn outwards(mut mesh: Mesh, reading: &mut Reading<'_>) -> Result<Mesh, ReadError> {
    input::hold("which parts the triangles make", mesh.position.len() as u64 * BYTES_PER_PART, reading.params)?;
    for _ in 0..turn_outwards(&mut mesh) {
        reading.mend(Fix::InsideOut, Place::File, None, || {
            let hint = "turn the faces around, or leave out --strict";
            ReadError::input(Place::File, "surfaces whose faces are wound outwards", "one that is inside out", hint)
        })?;
    }
    Ok(mesh)
}

/// Says how many voxels have no value, and refuses a volume of nothing else.
fn remark_gaps(grid: &Grid, reading: &mut Reading<'_>) -> Result<(), ReadError> {
    let gaps = grid.values.par_iter().filter(|value| value.is_nan()).count();
    if gaps == 0 {
        return Ok(());
    }
    let voxels = grid.values.len();
    if gaps == voxels {
        let hint = "the values are missing: write the file anew";
        return Err(ReadError::input(Place::File, "a voxel with a value", "NaN in all of them", hint));
    }
    let total = counted(voxels as u64, "voxel");
    reading
        .notes
        .remark(format!("{gaps} of {total} are NaN: they draw nothing, and a slice has its first colour there"));
    Ok(())
}

/// Refuses requested columns that the points lack, and removes kept columns from the notes about unused ones.
fn check_columns(points: &RawPoints, reading: &mut Reading<'_>) -> Result<(), ReadError> {
    let missing = reading.params.columns.iter().find(|name| points.column(name, DVec3::Y).is_none());
    if let Some(missing) = missing {
        return Err(missing_column(missing, points.column_names().collect(), reading));
    }
    let shown: Vec<String> = points.columns.iter().map(|c| escaped(c.name.as_bytes(), LONGEST_NAME)).collect();
    reading.notes.unused.retain(|name| !shown.contains(name));
    Ok(())
}

/// Refuses requested columns that a mesh lacks.
fn check_mesh_columns(mesh: &Mesh, reading: &Reading<'_>) -> Result<(), ReadError> {
    let Some(missing) = reading.params.columns.iter().find(|name| !mesh.has_column(name)) else { return Ok(()) };
    Err(missing_column(missing, mesh.column_names().collect(), reading))
}

/// Returns the error for a missing column; it lists the `known` columns and those of the notes.
fn missing_column(missing: &str, known: Vec<&str>, reading: &Reading<'_>) -> ReadError {
    let further = reading.notes.columns.iter().map(|c| c.name.as_str()).filter(|name| !known.contains(name));
    let names: Vec<&str> = known.iter().copied().chain(further).collect();
    let expected = format!("a column among {}", names.join(", "));
    let shown = escaped(missing.as_bytes(), LONGEST_NAME);
    let is_vector = names.contains(&format!("{shown}:magnitude").as_str());
    let hint = match is_vector {
        true => "it has several numbers: add `:magnitude` for the length of the vector, or `:x` for a component",
        false => "`organza info` says what they hold",
    };
    ReadError::input(Place::File, expected, format!("`{shown}`"), hint)
}

/// Files of a folder that are looked at for what it holds.
const LOOKED_AT: usize = 64;

/// Bytes that tell the format.
const MARK: usize = 4096;

/// `place` is where the file lies, for those that name another one.
fn parse(
    path: &Path,
    mut stream: Stream<'_>,
    place: Option<&Path>,
    reading: &mut Reading<'_>,
) -> Result<Loaded, ReadError> {
    reading.go_on()?;
    if stream.peek(2)? == [0x1f, 0x8b] && !is_raw(path) {
        stream = stream.gunzip();
    }
    let head = stream.peek(MARK)?;
    let format = format_of(path, head);
    if reading.params.is_coverage && !matches!(format, Some(Format::Exr | Format::Png)) {
        return Err(unread::without_coverage(path, head, format));
    }
    // An archive of SOG has the mark of other archives.
    if let (false, Some(error)) = (matches!(format, Some(Format::Sog)), unread::by_mark(path, head)) {
        return Err(error);
    }
    if head.is_empty() && matches!(format, Some(Format::Obj | Format::Xyz)) {
        let hint = "the file is truncated, or was never written";
        return Err(ReadError::input(Place::Byte(0), "vertices or points", "an empty file", hint));
    }
    let Some(format) = format else { return Err(unread::refused(path, head)) };
    reading.notes.format = format!("{format:?}");
    parse_as(format, stream, path, place, reading)
}

fn parse_as(
    format: Format,
    stream: Stream<'_>,
    path: &Path,
    place: Option<&Path>,
    reading: &mut Reading<'_>,
) -> Result<Loaded, ReadError> {
    let params = reading.params;
    match format {
        #[cfg(feature = "ply")]
        Format::Ply => ply::read(&stream.rest()?, place, reading),
        Format::Stl => stl::read(&stream.rest()?, reading).map(Loaded::Mesh),
        #[cfg(feature = "obj")]
        Format::Obj => obj::read(&stream.rest()?, place, reading),
        #[cfg(feature = "off")]
        Format::Off => off::read(&stream.rest()?, reading),
        #[cfg(feature = "gltf")]
        Format::Gltf => gltf::read(&stream.rest()?, place, reading),
        Format::Splat => splat::read(&stream.rest()?, reading).map(Loaded::Points),
        Format::Ksplat => ksplat::read(&stream.rest()?, reading).map(Loaded::Points),
        Format::Spz => spz::read(&stream.rest()?, reading).map(Loaded::Points),
        #[cfg(feature = "sog")]
        Format::Sog => sog::read(&stream.rest()?, place, reading).map(Loaded::Points),
        Format::Pcd => pcd::read(&stream.rest()?, reading).map(Loaded::Points),
        Format::Xyz => xyz::read(&stream.rest()?, params, &mut reading.notes).map(Loaded::Points),
        Format::Nrrd => nrrd::read(stream, place, params, &mut reading.notes).map(Loaded::Grid),
        #[cfg(feature = "las")]
        Format::Las => las::read(stream.rest()?, params, &mut reading.notes).map(Loaded::Points),
        #[cfg(feature = "e57")]
        Format::E57 => e57::read(stream.rest()?, reading).map(Loaded::Points),
        #[cfg(feature = "nifti")]
        Format::Nifti => nifti::read(stream, params, &mut reading.notes).map(Loaded::Grid),
        Format::Dicom => {
            let Some(place) = place else {
                let hint = "name the folder of the series, or its first file";
                return Err(ReadError::input(Place::File, "a DICOM file in its folder", "one in memory", hint));
            };
            let folder = place.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
            drop(stream);
            dicom::read(folder, Some(place), reading).map(Loaded::Grid)
        }
        Format::MetaImage => metaimage::read(stream, place, params, &mut reading.notes).map(Loaded::Grid),
        #[cfg(feature = "vti")]
        Format::VtkXml => vti::read(&stream.rest()?, place, reading),
        #[cfg(feature = "vtk")]
        Format::Vtk => vtk::read(&stream.rest()?, reading),
        #[cfg(feature = "tiff")]
        Format::Tiff => tiff::read(stream.rest()?, reading).map(Loaded::Grid),
        Format::Raw => raw::read(stream, path, params, &mut reading.notes).map(Loaded::Grid),
        Format::Hdr => radiance::read(&stream.rest()?, reading).map(Loaded::Image),
        #[cfg(feature = "exr")]
        Format::Exr => openexr::read(&stream.rest()?, reading).map(Loaded::Image),
        #[cfg(feature = "png")]
        Format::Png => png::read(&stream.rest()?, reading).map(Loaded::Image),
        #[allow(unreachable_patterns, reason = "reached where a reader is not compiled in")]
        format => Err(not_compiled_in(format)),
    }
}

fn not_compiled_in(format: Format) -> ReadError {
    let expected = "a format that this build reads";
    let hint = "build with the feature of that name";
    ReadError::input(Place::File, expected, format!("{format:?}"), hint)
}

/// Longest side of an image, pixels.
const LONGEST_SIDE: u32 = 65536;

/// Bytes of an image of a size that may be read, as colours.
fn check_image(size: [u32; 2], params: &ReadParams) -> Result<u64, ReadError> {
    check_sides(size)?;
    let bytes = size.iter().map(|s| u64::from(*s)).product::<u64>() * size_of::<[f32; 3]>() as u64;
    input::hold("the image", bytes, params)?;
    Ok(bytes)
}

/// Refuses an image without pixels, and one that is longer than any.
fn check_sides(size: [u32; 2]) -> Result<(), ReadError> {
    if !size.iter().all(|side| (1..=LONGEST_SIDE).contains(side)) {
        let expected = format!("an image of 1 to {LONGEST_SIDE} pixels a side");
        let found = format!("{} x {}", size[0], size[1]);
        return Err(ReadError::input(Place::File, expected, found, "the header is damaged, or make the image smaller"));
    }
    Ok(())
}

/// The page's example compiles and holds.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Page;
