//! NRRD (`.nrrd`, `.nhdr`) → a volume of scalars in the file's own axes and units.
//!
//! Read are three-dimensional volumes of real scalars, encoded raw, gzip or as text, in one file or with one data file
//! in the header's folder or below. Axes: `space directions`, else `spacings`, else 1; `space origin`, else 0.

mod data;
mod header;

use super::{ReadLimits, input};
use crate::error::{Place, ReadError, escaped};
use header::{Encoding, Header};
use splat_core::Grid;
use std::borrow::Cow;
use std::path::{Component, Path};

const HINT: &str = "the file is truncated or damaged, or its header states other sizes";

/// Reads a volume; `path` is where the header was read from, if from a file.
pub(super) fn read(content: &[u8], path: Option<&Path>, limits: &ReadLimits) -> Result<Grid, ReadError> {
    let header = header::parse(content)?;
    let count = header.sizes.iter().try_fold(1u64, |n, s| n.checked_mul(*s)).filter(|n| *n <= 1 << 40);
    let count = count.ok_or_else(|| {
        let found = format!("{:?}", header.sizes);
        ReadError::input(header.place_of_sizes, "at most 2^40 voxels", found, HINT)
    })?;
    input::check_bytes("the voxels", count * size_of::<f32>() as u64, limits)?;
    let stored = match &header.data_file {
        None => Cow::Borrowed(content.get(header.end..).unwrap_or_default()),
        Some((name, place)) => Cow::Owned(detached(name, *place, path, limits)?),
    };
    let at = if header.data_file.is_some() { 0 } else { header.end };
    let stored = skip_lines(&stored, header.line_skip)?;
    let unpacked = match header.encoding {
        Encoding::Gzip => Cow::Owned(input::gunzip(stored, limits)?),
        Encoding::Raw | Encoding::Text => Cow::Borrowed(stored),
    };
    let values = match header.encoding {
        Encoding::Text => data::text(&unpacked, count)?,
        Encoding::Raw | Encoding::Gzip => data::binary(skip_bytes(&unpacked, &header, count)?, &header, count, at)?,
    };
    Ok(Grid { origin: header.origin, axes: header.axes, dims: header.sizes.map(|n| n as usize), values })
}

/// The content of the data file that a header names.
fn detached(name: &str, place: Place, header: Option<&Path>, limits: &ReadLimits) -> Result<Vec<u8>, ReadError> {
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
    input::regular_file(&path, limits).map_err(|e| {
        let expected = format!("the data file {}: {}", shown(), e.expected);
        ReadError { expected, ..e }
    })
}

fn skip_lines(mut data: &[u8], lines: u64) -> Result<&[u8], ReadError> {
    for _ in 0..lines {
        let Some(end) = data.iter().position(|b| *b == b'\n') else {
            return Err(ReadError::input(Place::File, format!("{lines} lines before the data"), "fewer", HINT));
        };
        data = &data[end + 1..];
    }
    Ok(data)
}

/// The data after `byte skip`; −1 means that it is what the file ends with.
fn skip_bytes<'a>(data: &'a [u8], header: &Header, count: u64) -> Result<&'a [u8], ReadError> {
    let skip = match header.byte_skip {
        -1 => (data.len() as u64).checked_sub(count * header.kind.size()),
        n => u64::try_from(n).ok().filter(|n| *n <= data.len() as u64),
    };
    skip.map(|n| &data[n as usize..]).ok_or_else(|| {
        let found = format!("{} bytes, byte skip {}", data.len(), header.byte_skip);
        ReadError::input(Place::File, format!("{} bytes of voxels", count * header.kind.size()), found, HINT)
    })
}
