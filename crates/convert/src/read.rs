//! Reading files: meshes (PLY, STL, OBJ), point clouds (PLY, OBJ, XYZ, CSV, LAS, LAZ), volumes (NIfTI, NRRD) and images of radiance
//! (Radiance HDR, OpenEXR, PNG), each also inside gzip.
//!
//! No input makes a reader panic or take memory that the file does not stand for: sizes that a header announces are
//! checked against the length of the file before anything is allocated.

#[cfg(any(feature = "ply", feature = "las", feature = "xyz", feature = "png"))]
mod color;
#[cfg(any(feature = "ply", feature = "stl", feature = "obj", feature = "xyz", feature = "nrrd"))]
mod decimal;
#[cfg_attr(not(feature = "ply"), allow(dead_code, reason = "each format uses a part of it"))]
mod input;
#[cfg(feature = "las")]
mod las;
#[cfg(any(feature = "nrrd", feature = "nifti"))]
mod lattice;
#[cfg(feature = "las")]
mod laz;
#[cfg(feature = "nifti")]
mod nifti;
#[cfg(feature = "nrrd")]
mod nrrd;
#[cfg(feature = "obj")]
mod obj;
#[cfg(feature = "exr")]
mod openexr;
#[cfg(any(feature = "ply", feature = "stl", feature = "obj", feature = "xyz"))]
mod origin;
#[cfg(feature = "ply")]
mod ply;
#[cfg(feature = "png")]
mod png;
#[cfg(any(feature = "ply", feature = "obj"))]
mod polygon;
#[cfg(feature = "hdr")]
mod radiance;
mod reading;
#[cfg(feature = "obj")]
mod statements;
#[cfg(feature = "stl")]
mod stl;
#[cfg(any(feature = "stl", feature = "obj", feature = "xyz", feature = "nrrd"))]
mod text;
mod up;
#[cfg(any(feature = "nrrd", feature = "nifti"))]
mod voxels;
#[cfg(feature = "xyz")]
mod xyz;

#[cfg(feature = "las")]
pub use laz::panic_is_input_error;
pub use reading::{Fix, Mended, Notes};
pub use up::{UpAxis, up_axis};

use crate::error::{Place, ReadError, escaped, escaped_path};
use crate::raw_points::RawPoints;
use input::Stream;
use reading::Reading;
use splat_core::{Grid, Limits, Mesh, Progress, RadianceImage};
use std::path::Path;

/// How much a file may ask for, and what happens to what is wrong in it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReadParams {
    /// Bytes that the file, its decompressed form and the columns made from it may each take; elements are not counted.
    pub limits: Limits,
    /// Whether points of a cloud with a coordinate that is not finite are left out and counted in
    /// [`RawPoints::dropped`] instead of refused. Vertices of a mesh are always refused.
    pub drop_invalid: bool,
    /// Whether a file with a fault that could be mended (see [`Fix`]) is refused instead.
    pub strict: bool,
}

impl Default for ReadParams {
    /// 4 GiB, nothing dropped, what can be mended is mended.
    fn default() -> Self {
        Self { limits: Limits::bytes(4 << 30), drop_invalid: false, strict: false }
    }
}

/// What a file holds, in the file's own axes and units. Meshes face outwards, also where the file's do not.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Loaded {
    /// Vertices with faces.
    Mesh(Mesh),
    /// Points without faces.
    Points(RawPoints),
    /// A regular volume.
    Grid(Grid),
    /// An image of radiance.
    Image(RadianceImage),
}

/// Reads a regular file, and says what there is to say of it; its first bytes tell the format, its extension only words the
/// error if they do not. Reading stops where `progress` is cancelled.
///
/// # Errors
/// [`ReadError`] with the file's name, the place, what was expected and what was found, and one with
/// [`Fault::Cancelled`](crate::Fault::Cancelled).
pub fn file(path: &Path, params: &ReadParams, progress: Option<&Progress>) -> Result<(Loaded, Notes), ReadError> {
    let name = escaped_path(path);
    let mut reading = Reading::new(params, progress);
    let stream = Stream::open(path, params);
    let loaded = stream.and_then(|stream| whole(path, stream, Some(path), &mut reading));
    Ok((loaded.map_err(|e| e.in_file(&name))?, reading.finish(&name)))
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
    let mut reading = Reading::new(params, progress);
    let loaded = whole(Path::new(name), Stream::of(content, params), None, &mut reading);
    Ok((loaded.map_err(|e| e.in_file(&shown))?, reading.finish(&shown)))
}

/// The content with meshes turned outwards.
fn whole(
    path: &Path,
    stream: Stream<'_>,
    place: Option<&Path>,
    reading: &mut Reading<'_>,
) -> Result<Loaded, ReadError> {
    let loaded = parse(path, stream, place, reading)?;
    #[cfg(any(feature = "ply", feature = "stl", feature = "obj"))]
    if let Loaded::Mesh(mut mesh) = loaded {
        for _ in 0..crate::outwards::turn_outwards(&mut mesh) {
            reading.mend((Fix::InsideOut, Place::File, None), || {
                let hint = "turn the faces around, or leave out --strict";
                ReadError::input(Place::File, "surfaces whose faces are wound outwards", "one that is inside out", hint)
            })?;
        }
        return Ok(Loaded::Mesh(mesh));
    }
    Ok(loaded)
}

/// Bytes that tell the format.
const MARK: usize = 512;

/// `place` is where the file lies, for headers that name another one.
#[cfg_attr(
    not(feature = "nrrd"),
    allow(unused_variables, unused_mut, reason = "no other format has detached headers, some have nothing to note")
)]
fn parse(
    path: &Path,
    mut stream: Stream<'_>,
    place: Option<&Path>,
    reading: &mut Reading<'_>,
) -> Result<Loaded, ReadError> {
    reading.go_on()?;
    let params = reading.params;
    if stream.peek(2)? == [0x1f, 0x8b] {
        stream = stream.gunzip();
    }
    let head = stream.peek(MARK)?;
    let format = format_of(path, head);
    if head.is_empty() && matches!(format, Some(Format::Obj | Format::Xyz)) {
        let hint = "the file is truncated, or was never written";
        return Err(ReadError::input(Place::Byte(0), "vertices or points", "an empty file", hint));
    }
    match format {
        #[cfg(feature = "ply")]
        Some(Format::Ply) => {
            let content = stream.rest()?;
            let loaded = ply::read(&content, reading)?;
            reading.notes.not_used(ply::unused(&content)?.iter().map(Vec::as_slice));
            Ok(loaded)
        }
        #[cfg(feature = "stl")]
        Some(Format::Stl) => stl::read(&stream.rest()?, reading).map(Loaded::Mesh),
        #[cfg(feature = "obj")]
        Some(Format::Obj) => {
            let content = stream.rest()?;
            reading.notes.not_used(statements::unused(&content));
            obj::read(&content, reading)
        }
        #[cfg(feature = "xyz")]
        Some(Format::Xyz) => xyz::read(&stream.rest()?, params, &mut reading.notes).map(Loaded::Points),
        #[cfg(feature = "nrrd")]
        Some(Format::Nrrd) => nrrd::read(stream, place, params, &mut reading.notes).map(Loaded::Grid),
        #[cfg(feature = "las")]
        Some(Format::Las) => las::read(stream.rest()?, params, &mut reading.notes).map(Loaded::Points),
        #[cfg(feature = "nifti")]
        Some(Format::Nifti) => nifti::read(stream, params).map(Loaded::Grid),
        #[cfg(feature = "hdr")]
        Some(Format::Hdr) => radiance::read(&stream.rest()?, reading).map(Loaded::Image),
        #[cfg(feature = "exr")]
        Some(Format::Exr) => openexr::read(&stream.rest()?, reading).map(Loaded::Image),
        #[cfg(feature = "png")]
        Some(Format::Png) => png::read(&stream.rest()?, reading).map(Loaded::Image),
        #[allow(unreachable_patterns, reason = "reached where a reader is not compiled in")]
        Some(format) => Err(ReadError::input(
            Place::File,
            "a format that this build reads",
            format!("{format:?}"),
            "build with the feature of that name",
        )),
        None => Err(unknown(head)),
    }
}

/// For a file that begins like none that is read.
fn unknown(head: &[u8]) -> ReadError {
    ReadError::input(
        Place::Byte(0),
        "'ply', 'LASF', 'NRRD', '#?', a NIfTI-1, OpenEXR or PNG header, or the extension of a format without a mark",
        format!("'{}'", escaped(&head[..head.len().min(16)], 16)),
        "PLY, STL, OBJ, XYZ, CSV, LAS, LAZ, NIfTI, NRRD, Radiance HDR, OpenEXR and PNG files are read, each also inside gzip",
    )
}

/// Longest side of an image, pixels.
#[cfg(any(feature = "hdr", feature = "exr", feature = "png"))]
const LONGEST_SIDE: u32 = 65536;

/// Bytes of an image of a size that may be read.
#[cfg(any(feature = "hdr", feature = "exr", feature = "png"))]
fn check_image(size: [u32; 2], params: &ReadParams) -> Result<u64, ReadError> {
    if !size.iter().all(|side| (1..=LONGEST_SIDE).contains(side)) {
        let expected = format!("an image of 1 to {LONGEST_SIDE} pixels a side");
        let found = format!("{} x {}", size[0], size[1]);
        return Err(ReadError::input(Place::File, expected, found, "the header is damaged, or make the image smaller"));
    }
    let bytes = size.iter().map(|s| u64::from(*s)).product::<u64>() * size_of::<[f32; 3]>() as u64;
    input::check_bytes("the image", bytes, params)?;
    Ok(bytes)
}

#[derive(Debug, Clone, Copy)]
enum Format {
    Ply,
    Stl,
    Obj,
    Xyz,
    Nrrd,
    Las,
    Nifti,
    Hdr,
    Exr,
    Png,
}

fn format_of(path: &Path, content: &[u8]) -> Option<Format> {
    let content = content.strip_prefix(b"\xef\xbb\xbf").unwrap_or(content);
    if content.starts_with(b"ply") {
        return Some(Format::Ply);
    }
    if content.starts_with(b"LASF") {
        return Some(Format::Las);
    }
    if content.starts_with(b"NRRD000") {
        return Some(Format::Nrrd);
    }
    if content.starts_with(b"#?") {
        return Some(Format::Hdr);
    }
    if content.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
        return Some(Format::Exr);
    }
    if content.starts_with(b"\x89PNG\r\n\x1a\n") {
        return Some(Format::Png);
    }
    if content.get(344..347).is_some_and(|magic| magic == b"n+1" || magic == b"ni1") {
        return Some(Format::Nifti);
    }
    by_name(path).or_else(|| is_stl_text(content).then_some(Format::Stl))
}

#[cfg(feature = "stl")]
fn is_stl_text(content: &[u8]) -> bool {
    stl::is_text(content)
}

#[cfg(not(feature = "stl"))]
fn is_stl_text(_content: &[u8]) -> bool {
    false
}

fn by_name(path: &Path) -> Option<Format> {
    let name = path.file_name()?.to_string_lossy().to_ascii_lowercase();
    let name = name.strip_suffix(".gz").unwrap_or(&name);
    match name.rsplit_once('.')?.1 {
        "ply" => Some(Format::Ply),
        "stl" => Some(Format::Stl),
        "obj" => Some(Format::Obj),
        "xyz" | "csv" | "txt" | "pts" | "asc" => Some(Format::Xyz),
        "nrrd" | "nhdr" => Some(Format::Nrrd),
        "las" | "laz" => Some(Format::Las),
        "nii" | "hdr" => Some(Format::Nifti),
        _ => None,
    }
}
