//! NRRD (`.nrrd`, `.nhdr`) → a volume of scalars in the file's own axes and units.
//!
//! Read are three-dimensional volumes of real scalars or colours and series of them, encoded raw, gzip or as text, in one file or
//! with one data file in the header's folder or below. Axes: `space directions`, else `spacings`, else 1; `space origin`, else 0. Directions
//! in a patient's space that points left or to the back are turned to right, anterior, superior, as NIfTI has them.

mod axes;
mod header;

use super::selection::Selection;
use super::voxels::{self, Stored};
use crate::error::{Place, ReadError};
use crate::stream::detached::DataOf;
use crate::stream::input::{self, Stream};
use crate::text::Words;
use crate::{Notes, ReadParams};
use axes::{Meaning, Other};
use header::{Encoding, Header};
use splat_core::Grid;
use std::path::Path;

const HINT: &str = "the file is truncated or damaged, or its header states other sizes";

/// Reads a volume; `path` is where the header was read from, if from a file.
pub(crate) fn read(
    mut stream: Stream<'_>,
    path: Option<&Path>,
    params: &ReadParams,
    notes: &mut Notes,
) -> Result<Grid, ReadError> {
    let header = header::parse(header_bytes(&mut stream)?)?;
    let axes = &header.axes;
    let kind = header.kind;
    let big_endian = header.big_endian;
    let scaling = (1.0, 0.0);
    let stored = Stored { kind, big_endian, dims: axes.sizes, selection: selection(&header, params, notes)?, scaling };
    stored.check(axes.place_of_sizes, HINT)?;
    input::hold("the voxels", stored.count() * size_of::<f32>() as u64, params)?;
    if let Some(space) = axes.converted_from {
        notes.remarks.push(format!("space: {space}, converted to right-anterior-superior"));
    }
    let origin = axes.origin;
    let steps = axes.steps;
    let dims = axes.sizes.map(|n| n as usize);
    let data = DataOf { header: path, end: (header.end, header.lines), file: header.data_file.as_ref() };
    let values = data.read(stream, params, |data, lines| voxels_of(data, &header, lines, &stored, params))?;
    Ok(Grid { origin, axes: steps, dims, values })
}

/// Which of the numbers are read.
fn selection(header: &Header, params: &ReadParams, notes: &mut Notes) -> Result<Selection, ReadError> {
    let axes = &header.axes;
    match axes.other {
        None => Selection::of_frames(1, axes.place_of_sizes, params, notes),
        Some(Other { size, meaning: Meaning::Series, is_fastest: false, place }) => {
            Selection::of_frames(size, place, params, notes)
        }
        Some(Other { size, meaning: Meaning::Series, is_fastest: true, place }) => {
            Selection::of_frames(size, place, params, notes).map(Selection::mingled)
        }
        Some(Other { size, meaning, place, .. }) => Selection::of_frames(1, place, params, notes)?.with_numbers(
            size,
            header.kind,
            meaning == Meaning::Color,
            place,
            notes,
        ),
    }
}

/// The voxels of a stream that begins with the data, after so many lines of the file.
fn voxels_of(
    mut stream: Stream<'_>,
    header: &Header,
    lines: u64,
    stored: &Stored,
    params: &ReadParams,
) -> Result<Vec<f32>, ReadError> {
    skip_lines(&mut stream, header.line_skip)?;
    match header.encoding {
        Encoding::Text => {
            let text = stream.rest()?;
            voxels::whole_text(Words::new(&text, 0, lines + header.line_skip + 1), stored, params, HINT)
        }
        Encoding::Raw => voxels::behind(stream, header.byte_skip, stored, params, HINT),
        Encoding::Gzip => voxels::behind(stream.gunzip(), header.byte_skip, stored, params, HINT),
    }
}

/// The bytes up to the empty line after the header, and some more; all of them where there is none.
fn header_bytes<'a>(stream: &'a mut Stream<'_>) -> Result<&'a [u8], ReadError> {
    let ends = |head: &[u8]| [&b"\n\n"[..], b"\n\r\n", b"\r\r"].iter().any(|e| head.windows(e.len()).any(|w| w == *e));
    stream.peek_until(ends, "an empty line after the header", HINT)
}

fn skip_lines(stream: &mut Stream<'_>, lines: u64) -> Result<(), ReadError> {
    for _ in 0..lines {
        let mut byte = [0];
        while byte != *b"\n" {
            if stream.fill(&mut byte)? == 0 {
                return Err(ReadError::input(Place::File, format!("{lines} lines before the data"), "fewer", HINT));
            }
        }
    }
    Ok(())
}
