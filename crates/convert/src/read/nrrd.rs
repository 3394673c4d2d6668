//! NRRD (`.nrrd`, `.nhdr`) → a volume of scalars in the file's own axes and units.
//!
//! Read are three-dimensional volumes of real scalars, encoded raw, gzip or as text, in one file or with one data file
//! in the header's folder or below. Axes: `space directions`, else `spacings`, else 1; `space origin`, else 0. Directions
//! in a patient's space that points left or to the back are turned to right, anterior, superior, as NIfTI has them.

mod header;

use super::input::{self, Stream};
use super::text::Lines;
use super::voxels::{self, Stored};
use super::{Notes, ReadParams};
use crate::error::{Place, ReadError, escaped};
use header::{Encoding, Header};
use splat_core::Grid;
use std::path::{Component, Path};

const HINT: &str = "the file is truncated or damaged, or its header states other sizes";

/// Longest header; real ones have some hundred bytes.
const MAX_HEADER: usize = 16 << 20;

/// Reads a volume; `path` is where the header was read from, if from a file.
pub(super) fn read(
    mut stream: Stream<'_>,
    path: Option<&Path>,
    params: &ReadParams,
    notes: &mut Notes,
) -> Result<Grid, ReadError> {
    let header = header::parse(header_bytes(&mut stream)?)?;
    let count = header.sizes.iter().try_fold(1u64, |n, s| n.checked_mul(*s)).filter(|n| *n <= 1 << 40);
    let count = count.ok_or_else(|| {
        let found = format!("{:?}", header.sizes);
        ReadError::input(header.place_of_sizes, "at most 2^40 voxels", found, HINT)
    })?;
    input::check_bytes("the voxels", count * size_of::<f32>() as u64, params)?;
    if let Some(space) = header.converted_from {
        notes.remarks.push(format!("space: {space}, converted to right-anterior-superior"));
    }
    let (mut stream, lines) = match &header.data_file {
        None => {
            stream.skip(header.end as u64)?;
            (stream, header.lines)
        }
        Some((name, place)) => (detached(name, *place, path, params)?, 0),
    };
    skip_lines(&mut stream, header.line_skip)?;
    let (kind, big_endian, scaling) = (header.kind, header.big_endian, (1.0, 0.0));
    let stored = Stored { kind, big_endian, dims: header.sizes, scaling };
    let values = match header.encoding {
        Encoding::Text => text(&stream.rest()?, count, lines + header.line_skip)?,
        Encoding::Raw if header.byte_skip == -1 => last(stream, &stored, params)?,
        Encoding::Raw => binary(stream, &header, &stored, params)?,
        Encoding::Gzip => binary(stream.gunzip(), &header, &stored, params)?,
    };
    Ok(Grid { origin: header.origin, axes: header.axes, dims: header.sizes.map(|n| n as usize), values })
}

/// The bytes up to the empty line after the header, and some more; all of them where there is none.
fn header_bytes<'a>(stream: &'a mut Stream<'_>) -> Result<&'a [u8], ReadError> {
    let ends = |head: &[u8]| [&b"\n\n"[..], b"\n\r\n", b"\r\r"].iter().any(|e| head.windows(e.len()).any(|w| w == *e));
    let mut length = 1 << 12;
    loop {
        let head = stream.peek(length)?;
        if head.len() < length || ends(head) {
            return stream.peek(length);
        }
        if length >= MAX_HEADER {
            let expected = format!("an empty line after at most {MAX_HEADER} bytes of header");
            return Err(ReadError::input(Place::Byte(0), expected, "a longer header", HINT));
        }
        length *= 4;
    }
}

/// Voxels after the bytes to be skipped.
fn binary(
    mut stream: Stream<'_>,
    header: &Header,
    stored: &Stored,
    params: &ReadParams,
) -> Result<Vec<f32>, ReadError> {
    let skipped = match u64::try_from(header.byte_skip) {
        Ok(n) if stream.left().is_none_or(|left| n <= left) => stream.skip(n)? == n,
        _ => false,
    };
    if skipped {
        return voxels::read(&mut stream, stored, params, HINT);
    }
    let found = format!("byte skip {}", header.byte_skip);
    Err(ReadError::input(Place::File, "a number of bytes before the voxels, within the data", found, HINT))
}

/// Voxels that the data ends with, whatever comes before.
fn last(stream: Stream<'_>, stored: &Stored, params: &ReadParams) -> Result<Vec<f32>, ReadError> {
    let data = stream.rest()?;
    let Some(start) = (data.len() as u64).checked_sub(stored.bytes()) else {
        let found = format!("{} bytes, byte skip -1", data.len());
        return Err(ReadError::input(Place::File, format!("{} bytes of voxels", stored.bytes()), found, HINT));
    };
    voxels::read(&mut Stream::of(&data[start as usize..], params), stored, params, HINT)
}

/// Exactly `count` numbers in text, after so many lines of the file.
fn text(stored: &[u8], count: u64, before: u64) -> Result<Vec<f32>, ReadError> {
    let wrong = |found: String| ReadError::input(Place::File, format!("{count} voxels"), found, HINT);
    let mut values = Vec::new();
    // A digit and a blank each, but for the last one: the text cannot hold more, whatever the header says.
    input::reserve(&mut values, count.min((stored.len() as u64).div_ceil(2)) as usize)?;
    let mut lines = Lines::after(stored, before);
    while let Some(line) = lines.next()? {
        for word in line.words(true) {
            let value = word.number()? as f32;
            if !value.is_finite() {
                let expected = "a value that fits a 32-bit float";
                return Err(ReadError::input(Place::File, expected, word.shown(), "scale the values"));
            }
            if values.len() as u64 == count {
                return Err(wrong("more".to_owned()));
            }
            values.push(value);
        }
    }
    if values.len() as u64 == count { Ok(values) } else { Err(wrong(values.len().to_string())) }
}

/// The content of the data file that a header names.
fn detached(
    name: &str,
    place: Place,
    header: Option<&Path>,
    params: &ReadParams,
) -> Result<Stream<'static>, ReadError> {
    let shown = || format!("'{}'", escaped(name.as_bytes(), 60));
    let refused = |expected: &str| {
        Err(ReadError::input(place, expected, shown(), "put the data beside the header and name it without folders"))
    };
    if name.contains("://") || name.contains('%') || name.starts_with("LIST") {
        return refused("one data file in the header's folder");
    }
    let within = |c: Component<'_>| matches!(c, Component::Normal(_) | Component::CurDir);
    if !Path::new(name).components().all(within) {
        return refused("a data file in the header's folder or below");
    }
    let Some(header) = header else {
        return refused("a header and its data in one file, as it was read from memory");
    };
    let folder = header.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let path = folder.join(name);
    // Links are followed before they are judged.
    if let (Ok(data), Ok(root)) = (path.canonicalize(), folder.canonicalize()) {
        if !data.starts_with(&root) {
            return refused("a data file in the header's folder or below, links followed");
        }
        if header.canonicalize().is_ok_and(|h| h == data) {
            return refused("a data file that is not the header itself");
        }
    }
    Stream::open(&path, params).map_err(|e| {
        let expected = format!("the data file {}: {}", shown(), e.expected);
        ReadError { expected, ..e }
    })
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
