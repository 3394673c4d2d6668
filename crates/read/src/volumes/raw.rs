//! Raw voxels (`.raw`) whose file name states their sizes and their type → a volume with steps of 1.
//!
//! The names are those of the Open SciVis Datasets, `NAME_WIDTHxHEIGHTxDEPTH_TYPE.raw`: x fastest, little endian.

use super::selection::Selection;
use super::voxels::{self, Kind, Stored};
use crate::error::{Place, ReadError};
use crate::stream::input::Stream;
use crate::{Notes, ReadParams};
use splat_core::Grid;
use splat_core::glam::{DMat3, DVec3};
use splat_core::text::escaped;
use std::path::Path;

const HINT: &str = "the file is truncated, or its name states other sizes or another type";

/// Reads the volume that the file's name describes.
pub(crate) fn read(
    mut stream: Stream<'_>,
    path: &Path,
    params: &ReadParams,
    notes: &mut Notes,
) -> Result<Grid, ReadError> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let stem = name.split('.').next().unwrap_or_default();
    let (dims, kind) = described(stem).ok_or_else(|| {
        let stem = escaped(stem.as_bytes(), 60);
        let expected =
            format!("sizes and a type in the file's name, such as {stem}_256x256x128_uint8.raw (or int8 … float64)");
        let found = stream.left().map_or_else(|| "none".to_owned(), |n| format!("none, and {n} bytes"));
        let hint = "rename the file, or write a text file NAME.nhdr beside it with the lines NRRD0004; type: uint8; \
                    dimension: 3; sizes: 256 256 128; endian: little; encoding: raw; data file: NAME.raw";
        ReadError::input(Place::File, expected, found, hint)
    })?;
    let selection = Selection::of_frames(1, Place::File, params, notes)?;
    let stored = Stored { kind, big_endian: false, dims, selection, scaling: (1.0, 0.0) };
    stored.check(Place::File, HINT)?;
    let values = voxels::read(&mut stream, &stored, params, HINT)?;
    Ok(Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims: dims.map(|n| n as usize), values })
}

/// Sizes and type, between underscores anywhere in a name.
fn described(stem: &str) -> Option<([u64; 3], Kind)> {
    let parts: Vec<&str> = stem.split('_').collect();
    parts.windows(2).find_map(|pair| Some((sizes(pair[0])?, kind(pair[1])?)))
}

fn sizes(text: &str) -> Option<[u64; 3]> {
    let sizes: Option<Vec<u64>> = text.split('x').map(|n| n.parse().ok().filter(|n| *n > 0)).collect();
    sizes?.try_into().ok()
}

fn kind(name: &str) -> Option<Kind> {
    Some(match name {
        "uint8" => Kind::U8,
        "int8" => Kind::I8,
        "uint16" => Kind::U16,
        "int16" => Kind::I16,
        "uint32" => Kind::U32,
        "int32" => Kind::I32,
        "float32" => Kind::F32,
        "float64" => Kind::F64,
        _ => return None,
    })
}
