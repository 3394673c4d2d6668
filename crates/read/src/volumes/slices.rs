//! A folder that has a file for each slice (TIFF or PNG) → a volume. Slices lie in the order of the numbers in their names, from front to back.

mod names;

use super::selection::{Selection, Value};
use super::voxels::{self, Kind, Stored};
use super::{lattice, rounded, upright};
use crate::ReadParams;
use crate::error::{Fault, Place, ReadError};
use crate::format::folder::check_inside;
use crate::reading::Reading;
use crate::stream::input::Stream;
use splat_core::Grid;
use splat_core::glam::DVec3;
use splat_core::text::{escaped, escaped_path};
use std::path::{Path, PathBuf};

const HINT: &str = "put the slices of one volume into a folder of their own, in one format, size and type";

/// What is said of slices whose numbers are ranks in a list of colours.
pub(crate) const LISTED_COLORS: &str =
    "numbers stand for colours of a list, which is not used: they are read as they are stored";

/// The numbers of one slice.
pub(crate) struct Slice {
    /// Columns and rows.
    pub(crate) size: [u32; 2],
    pub(crate) kind: Kind,
    /// Numbers of a pixel.
    pub(crate) numbers: u64,
    pub(crate) is_color: bool,
    pub(crate) big_endian: bool,
    /// The numbers, row by row.
    pub(crate) bytes: Vec<u8>,
    /// Width and height of a pixel, where they are stated.
    pub(crate) width: Option<[f64; 2]>,
}

impl Slice {
    /// What all slices have to share.
    fn shown(&self) -> String {
        let [width, height] = self.size;
        let kind = format!("{:?}", self.kind).to_lowercase();
        format!("{width} x {height} pixels of {} x {kind}", self.numbers)
    }
}

/// Kinds of files that slices may be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Picture {
    Tiff,
    Png,
}

impl Picture {
    fn named(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            #[cfg(feature = "tiff")]
            "tif" | "tiff" => Some(Self::Tiff),
            #[cfg(feature = "png")]
            "png" => Some(Self::Png),
            _ => None,
        }
    }
}

/// Whether a folder has files that may be slices.
pub(crate) fn has_slices(files: &[PathBuf]) -> bool {
    files.iter().any(|file| Picture::named(file).is_some())
}

/// Reads the volume of the slices of a folder.
pub(crate) fn read(folder: &Path, files: Vec<PathBuf>, reading: &mut Reading<'_>) -> Result<Grid, ReadError> {
    let mut slices: Vec<(Picture, PathBuf)> = Vec::new();
    for file in files {
        match Picture::named(&file) {
            Some(picture) => slices.push((picture, file)),
            None => reading.notes.not_used([format!("file {}", name_of(&file)).as_bytes()]),
        }
    }
    let (first_picture, first_file) = &slices[0];
    if let Some((_, other)) = slices.iter().find(|(picture, _)| picture != first_picture) {
        let expected = format!("slices of one format, {first_picture:?} as '{}'", shown(first_file));
        return Err(ReadError::input(Place::File, expected, format!("'{}'", shown(other)), HINT));
    }
    let names: Vec<String> = slices.iter().map(|(_, file)| name_of(file)).collect();
    names::check(&names, &mut reading.notes)?;
    let mut values = Vec::new();
    let mut like: Option<(Stored, String, Option<[f64; 2]>)> = None;
    for (picture, file) in &slices {
        reading.go_on()?;
        let told = |e: ReadError| in_slice(file, e);
        check_inside(folder, file)?;
        let slice = slice(*picture, file, reading).map_err(told)?;
        if like.is_none() {
            let stored = stored(&slice, slices.len() as u64, reading).map_err(told)?;
            values = voxels::room(&stored, reading.params)?;
            like = Some((stored, slice.shown(), slice.width));
        }
        let Some((stored, expected, _)) = &like else { continue };
        if slice.shown() != *expected {
            let expected = format!("slices like the first, '{}', of {expected}", shown(first_file));
            return Err(ReadError::input(
                Place::File,
                expected,
                format!("{} in '{}'", slice.shown(), shown(file)),
                HINT,
            ));
        }
        voxels::append(&mut values, &slice.bytes, &Stored { big_endian: slice.big_endian, ..*stored });
    }
    let Some((stored, _, width)) = like else {
        return Err(ReadError::input(Place::File, "slices", "none", HINT));
    };
    voxels::check_finite(&values, |_| Place::File)?;
    let steps = steps(width, reading);
    let (origin, axes) = upright(stored.dims, steps);
    lattice::check(origin, &axes, Place::File, HINT)?;
    Ok(Grid { origin, axes, dims: stored.dims.map(|n| n as usize), values })
}

/// The steps between voxels, and what is told of them.
fn steps(width: Option<[f64; 2]>, reading: &mut Reading<'_>) -> DVec3 {
    let Some([x, y]) = width else {
        reading.notes.remark("voxels of 1 x 1 x 1: the files state no step. `voxel_size` of an object does, a TIFF stack of ImageJ (Image > Properties in Fiji), an NRRD file by `spacings`");
        return DVec3::ONE;
    };
    let [wide, high] = [x, y].map(rounded);
    reading.notes.remark(format!(
        "voxels of {wide} x {high} by the resolution of the first slice, and as deep as wide: `voxel_size` of an object, or a TIFF stack of ImageJ, states the step between slices (Image > Properties in Fiji)"
    ));
    DVec3::new(x, y, x)
}

/// How the numbers of so many slices like this are stored.
fn stored(slice: &Slice, slices: u64, reading: &mut Reading<'_>) -> Result<Stored, ReadError> {
    let whole = Selection::of_frames(1, Place::File, reading.params, &mut reading.notes)?;
    let selection = if slice.is_color {
        whole.with_numbers(slice.numbers, slice.kind, true, Place::File, &mut reading.notes)?
    } else {
        if slice.numbers > 1 {
            reading.notes.remark("a pixel has several numbers: the first is read");
        }
        Selection { numbers: slice.numbers, value: Value::Number(0), ..whole }
    };
    let dims = [slice.size[0].into(), slice.size[1].into(), slices];
    let stored = Stored { kind: slice.kind, big_endian: slice.big_endian, dims, selection, scaling: (1.0, 0.0) };
    stored.check(Place::File, HINT)?;
    Ok(stored)
}

/// Reads one file, whose memory comes back with it.
fn slice(picture: Picture, file: &Path, reading: &mut Reading<'_>) -> Result<Slice, ReadError> {
    let params = ReadParams { memory: reading.params.memory.part(), ..reading.params.clone() };
    let mut content = Stream::open(file, &params)?;
    let mut within = reading.within(&params);
    let read = content.peek(MARK).map(<[u8]>::to_vec).and_then(|head| {
        let is_png = head.starts_with(b"\x89PNG");
        match picture {
            #[cfg(feature = "tiff")]
            Picture::Tiff if !is_png => super::tiff::slice(content.rest()?, &mut within),
            #[cfg(feature = "png")]
            Picture::Png if is_png => crate::images::png::slice(&content.rest()?, &mut within),
            _ => Err(ReadError::input(
                Place::Byte(0),
                format!("a {picture:?} file, as its name says"),
                "other bytes",
                HINT,
            )),
        }
    });
    reading.notes = within.notes;
    read
}

/// Bytes that tell a PNG file.
const MARK: usize = 4;

/// The error of one slice, which names it.
fn in_slice(file: &Path, error: ReadError) -> ReadError {
    if matches!(error.fault, Fault::Cancelled) {
        return error;
    }
    let expected = format!("the slice '{}': {}", shown(file), error.expected);
    ReadError { expected, ..error }
}

fn name_of(path: &Path) -> String {
    path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
}

fn shown(path: &Path) -> String {
    path.file_name().map_or_else(|| escaped_path(path), |name| escaped(name.as_encoded_bytes(), 60))
}
