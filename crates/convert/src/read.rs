//! Reading files: meshes and point clouds (PLY, LAS, LAZ) and volumes (NIfTI), each also inside gzip.
//!
//! No input makes a reader panic or take memory that the file does not stand for: sizes that a header announces are
//! checked against the length of the file before anything is allocated.

#[cfg(any(feature = "ply", feature = "las"))]
mod color;
mod input;
#[cfg(feature = "las")]
mod las;
#[cfg(feature = "las")]
mod laz;
#[cfg(feature = "nifti")]
mod nifti;
#[cfg(feature = "ply")]
mod origin;
#[cfg(feature = "ply")]
mod ply;
#[cfg(any(feature = "ply", feature = "obj"))]
mod polygon;

#[cfg(feature = "las")]
pub use laz::panic_is_input_error;

use crate::error::{Place, ReadError, escaped, escaped_path};
use crate::raw_points::RawPoints;
use splat_core::{Grid, Mesh};
use std::path::Path;

/// How much a file may ask for, and what happens to points that are no numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReadLimits {
    /// Most bytes that the file, its decompressed form or the columns made from it may each take.
    pub max_bytes: u64,
    /// Whether points of a cloud with a coordinate that is not finite are left out and counted in
    /// [`RawPoints::dropped`] instead of refused. Vertices of a mesh are always refused.
    pub drop_invalid: bool,
}

impl Default for ReadLimits {
    /// 4 GiB, nothing dropped.
    fn default() -> Self {
        Self { max_bytes: 4 << 30, drop_invalid: false }
    }
}

/// What a file holds, in the file's own axes and units.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Loaded {
    /// Vertices with faces.
    Mesh(Mesh),
    /// Points without faces.
    Points(RawPoints),
    /// A regular volume.
    Grid(Grid),
}

/// Reads a regular file; its first bytes tell the format, its extension only words the error if they do not.
///
/// # Errors
/// [`ReadError`] with the file's name, the place, what was expected and what was found.
pub fn file(path: &Path, limits: &ReadLimits) -> Result<Loaded, ReadError> {
    let name = escaped_path(path);
    let content = input::regular_file(path, limits).map_err(|e| e.in_file(&name))?;
    parse(path, content, limits).map_err(|e| e.in_file(&name))
}

/// Reads a file that is in memory already; `name` serves messages and tells the format where the content does not.
///
/// # Errors
/// [`ReadError`] as [`file()`] gives it.
pub fn bytes(name: &str, content: &[u8], limits: &ReadLimits) -> Result<Loaded, ReadError> {
    parse(Path::new(name), content.to_vec(), limits).map_err(|e| e.in_file(&escaped(name.as_bytes(), usize::MAX)))
}

fn parse(path: &Path, content: Vec<u8>, limits: &ReadLimits) -> Result<Loaded, ReadError> {
    let content = if content.starts_with(&[0x1f, 0x8b]) { input::gunzip(&content, limits)? } else { content };
    match format_of(path, &content) {
        #[cfg(feature = "ply")]
        Some(Format::Ply) => ply::read(&content, limits),
        #[cfg(feature = "las")]
        Some(Format::Las) => las::read(&content, limits).map(Loaded::Points),
        #[cfg(feature = "nifti")]
        Some(Format::Nifti) => nifti::read(&content, limits).map(Loaded::Grid),
        #[allow(unreachable_patterns, reason = "reached where a reader is not compiled in")]
        Some(format) => Err(ReadError::input(
            Place::File,
            "a format that this build reads",
            format!("{format:?}"),
            "build with the feature of that name",
        )),
        None => Err(ReadError::input(
            Place::Byte(0),
            "'ply', 'LASF' or a NIfTI-1 header",
            format!("'{}' ({} bytes)", escaped(&content[..content.len().min(16)], 16), content.len()),
            "PLY, LAS, LAZ and NIfTI files are read, each also inside gzip",
        )),
    }
}

#[derive(Debug, Clone, Copy)]
enum Format {
    Ply,
    Las,
    Nifti,
}

fn format_of(path: &Path, content: &[u8]) -> Option<Format> {
    let content = content.strip_prefix(b"\xef\xbb\xbf").unwrap_or(content);
    if content.starts_with(b"ply") {
        return Some(Format::Ply);
    }
    if content.starts_with(b"LASF") {
        return Some(Format::Las);
    }
    if content.get(344..347).is_some_and(|magic| magic == b"n+1" || magic == b"ni1") {
        return Some(Format::Nifti);
    }
    let name = path.file_name()?.to_string_lossy().to_ascii_lowercase();
    let name = name.strip_suffix(".gz").unwrap_or(&name);
    match name.rsplit_once('.')?.1 {
        "ply" => Some(Format::Ply),
        "las" | "laz" => Some(Format::Las),
        "nii" | "hdr" => Some(Format::Nifti),
        _ => None,
    }
}
