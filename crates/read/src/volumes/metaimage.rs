//! MetaImage (`.mha`, `.mhd`) → a volume of scalars, of a series one frame, of colours their luma.
//!
//! The voxels follow the header or lie in one data file in its folder or below, binary, as one zlib stream or as text.
//! Its space is that of ITK, which points left, to the back and up: it is turned to right, anterior, superior, as NIfTI has it.

mod header;

use super::selection::Selection;
use super::voxels::{self, Stored};
use crate::error::{Place, ReadError};
use crate::stream::detached::DataOf;
use crate::stream::input::Stream;
use crate::text::Words;
use crate::{Notes, ReadParams};
use header::Header;
use splat_core::Grid;
use splat_core::glam::{DMat3, DVec3};
use std::path::Path;

const HINT: &str = "the file is truncated or damaged, or its header states other sizes";

/// How the axes of the file point along right, anterior and superior.
const SIGNS: DVec3 = DVec3::new(-1.0, -1.0, 1.0);

/// Reads a volume; `path` is where the header was read from, if from a file.
pub(crate) fn read(
    mut stream: Stream<'_>,
    path: Option<&Path>,
    params: &ReadParams,
    notes: &mut Notes,
) -> Result<Grid, ReadError> {
    let header = header::parse(stream.peek_until(header::ends, "a field ElementDataFile after a header", HINT)?)?;
    let selection = Selection::of_frames(header.frames, header.place_of_sizes, params, notes)?.with_numbers(
        header.numbers,
        header.kind,
        false,
        header.place_of_numbers,
        notes,
    )?;
    let kind = header.kind;
    let big_endian = header.big_endian;
    let stored = Stored { kind, big_endian, dims: header.sizes, selection, scaling: (1.0, 0.0) };
    stored.check(header.place_of_sizes, HINT)?;
    notes.not_used(header.unused.iter().map(String::as_bytes));
    notes.remarks.push("space: left-posterior-superior, converted to right-anterior-superior".to_owned());
    let data = DataOf { header: path, end: (header.end, header.lines), file: header.data_file.as_ref() };
    let values = data.read(stream, params, |data, lines| voxels_of(data, &header, lines, &stored, params))?;
    let dims = header.sizes.map(|n| n as usize);
    Ok(Grid { origin: SIGNS * header.origin, axes: DMat3::from_diagonal(SIGNS) * header.axes, dims, values })
}

/// The voxels of a stream that begins with the data, after so many lines of the file.
fn voxels_of(
    mut stream: Stream<'_>,
    header: &Header,
    lines: u64,
    stored: &Stored,
    params: &ReadParams,
) -> Result<Vec<f32>, ReadError> {
    if header.is_text {
        let text = stream.rest()?;
        return voxels::whole_text(Words::new(&text, 0, lines + 1), stored, params, HINT);
    }
    if !header.is_compressed {
        return voxels::behind(stream, header.header_size, stored, params, HINT);
    }
    let skip = header.header_size.max(0) as u64;
    if header.header_size < 0 || stream.skip(skip)? < skip {
        let expected = "a HeaderSize from 0 to the length of the compressed data";
        return Err(ReadError::input(Place::File, expected, header.header_size.to_string(), HINT));
    }
    // What writes it means zlib, and what reads it takes gzip too.
    let is_gzip = stream.peek(2)? == [0x1f, 0x8b];
    let mut unpacked = if is_gzip { stream.gunzip() } else { stream.inflate() };
    voxels::read(&mut unpacked, stored, params, HINT)
}
