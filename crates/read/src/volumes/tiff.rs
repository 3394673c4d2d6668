//! TIFF (`.tif`, `.tiff`, BigTIFF) of several pages → a volume whose slices are the pages, of colours their luma; of a series one time, of channels one.
//!
//! Steps: `spacing` and `unit` of ImageJ, `PhysicalSizeX` and so on of OME, and the resolution of the pages. Rows run down the picture and the first page lies in
//! front, as a viewer of pictures shows them, so that nothing is mirrored.

mod description;
mod page;

use super::selection::{Selection, Value, channel_of};
use super::slices::Slice;
use super::voxels::{self, Stored};
use super::{lattice, upright};
use crate::error::{Place, ReadError};
use crate::reading::Reading;
use crate::stream::input::{self, Content};
use description::{Description, Planes};
use page::{Page, Pages, Shape};
use splat_core::Grid;
use splat_core::text::counted;

const HINT: &str = "the file is truncated or damaged, or its description states other sizes";

/// Where the numbers of a slice lie.
#[derive(Clone, Copy)]
enum Plane {
    /// In the page of this rank in the file.
    Page(usize),
    /// From this byte on, as ImageJ stores what needs more than 4 GiB.
    Byte(u64),
}

/// Reads a volume.
pub(crate) fn read(content: Content, reading: &mut Reading<'_>) -> Result<Grid, ReadError> {
    let mut pages = Pages::open(content)?;
    let listed = pages.list(reading)?;
    let first = &listed[0];
    let shape = first.shape;
    check_alike(&listed)?;
    let description = Description::read(&mut pages, first)?;
    let planes = description.planes(listed.len() as u64, shape.numbers)?;
    let slots = slots(&listed, &planes, &mut pages)?;
    let frame = Selection::of_frames(planes.times.count, Place::File, reading.params, &mut reading.notes)?.frame;
    let (selection, channel) = chosen(shape, planes.channels.count, &description.channels, reading)?;
    if planes.are_times {
        reading.notes.remark("the file calls its pages times of one slice: they are drawn as slices");
    }
    let depth = planes.slices.count;
    let stored = Stored {
        kind: shape.kind,
        big_endian: cfg!(target_endian = "big"),
        dims: [shape.size[0].into(), shape.size[1].into(), depth],
        selection,
        scaling: (1.0, 0.0),
    };
    stored.check(Place::File, HINT)?;
    let steps = description.steps(&mut reading.notes);
    let (origin, axes) = upright(stored.dims, steps);
    lattice::check(origin, &axes, Place::File, HINT)?;
    input::hold("a page", 2 * shape.bytes(), reading.params)?;
    let mut values = voxels::room(&stored, reading.params)?;
    let mut numbers = Vec::new();
    for slice in 0..depth {
        reading.go_on()?;
        let rank = planes.rank(slice, channel, frame);
        let stored = match slots[rank as usize] {
            Plane::Page(page) => {
                pages.decode(page, &shape, &mut numbers)?;
                stored
            }
            Plane::Byte(start) => {
                numbers.clear();
                numbers.extend_from_slice(pages.part(start, shape.bytes())?);
                Stored { big_endian: pages.is_big_endian(), ..stored }
            }
        };
        voxels::append(&mut values, &numbers, &stored);
    }
    voxels::check_finite(&values, |_| Place::File)?;
    Ok(Grid { origin, axes, dims: stored.dims.map(|n| n as usize), values })
}

/// Reads one slice of a folder, a file of one page.
pub(super) fn slice(content: Content, reading: &mut Reading<'_>) -> Result<Slice, ReadError> {
    let mut pages = Pages::open(content)?;
    let listed = pages.list(reading)?;
    let [page] = listed.as_slice() else {
        let found = counted(listed.len() as u64, "page");
        let hint = "name this file alone: its pages are the slices of a volume";
        return Err(ReadError::input(Place::File, "one slice a file, of one page", found, hint));
    };
    let shape = page.shape;
    input::hold("a page", 2 * shape.bytes(), reading.params)?;
    let mut bytes = Vec::new();
    pages.decode(page.rank, &shape, &mut bytes)?;
    let width = Description::read(&mut pages, page)?.width();
    let big_endian = cfg!(target_endian = "big");
    Ok(Slice {
        size: shape.size,
        kind: shape.kind,
        numbers: shape.numbers,
        is_color: shape.is_color,
        big_endian,
        bytes,
        width,
    })
}

/// Refuses pages that are not of one size and type.
fn check_alike(listed: &[Page]) -> Result<(), ReadError> {
    let first = &listed[0];
    let Some(other) = listed.iter().find(|page| page.shape != first.shape) else { return Ok(()) };
    let expected = format!("pages like the first, of {}", first.shape);
    let found = format!("{} at page {}", other.shape, other.rank + 1);
    let hint = "save the slices alone, such as with Fiji (Image > Duplicate, File > Save As > Tiff)";
    Err(ReadError::input(Place::File, expected, found, hint))
}

/// Where the numbers of each plane lie.
fn slots(listed: &[Page], planes: &Planes, pages: &mut Pages) -> Result<Vec<Plane>, ReadError> {
    let expected = planes.count();
    if expected == listed.len() as u64 {
        if expected == 1 {
            let hint = "name the folder in which a stack has a file for each slice, or save the stack as one file; heights of GeoTIFF are read as points: \
                `gdal_translate -of XYZ FILE heights.xyz`";
            return Err(ReadError::input(
                Place::File,
                "a stack of two pages or more",
                "one page, a flat picture",
                hint,
            ));
        }
        if planes.slices.count == 1 {
            let found = format!("{} channels of one slice", planes.channels.count);
            let hint = "if they are slices, say so: in Fiji Image > Properties, then File > Save As > Tiff";
            return Err(ReadError::input(Place::File, "a stack of two slices or more", found, hint));
        }
        return Ok(listed.iter().map(|page| Plane::Page(page.rank)).collect());
    }
    let wrong = || {
        let found = counted(listed.len() as u64, "page");
        let hint = "save the stack as one file, such as with Fiji (File > Save As > Tiff)";
        Err(ReadError::input(
            Place::File,
            format!("{expected} pages, as the description of the first says"),
            found,
            hint,
        ))
    };
    let [first] = listed else { return wrong() };
    if !planes.may_follow {
        return wrong();
    }
    let Some(start) = pages.plain_start(first.rank) else { return wrong() };
    let bytes = first.shape.bytes();
    let end = expected.checked_mul(bytes).and_then(|bytes| start.checked_add(bytes));
    if end.is_none_or(|end| end > pages.len()) {
        return wrong();
    }
    Ok((0..expected).map(|rank| Plane::Byte(start + rank * bytes)).collect())
}

/// Which number of a pixel is read, and of which channel; `names` are those that the file gives channels.
fn chosen(
    shape: Shape,
    channels: u64,
    names: &[String],
    reading: &mut Reading<'_>,
) -> Result<(Selection, u64), ReadError> {
    let whole = Selection { frames: 1, frame: 0, numbers: 1, value: Value::Number(0) };
    if shape.is_color {
        let channel = channel_of(channels, names, reading.params, &mut reading.notes)?;
        let selection = whole.with_numbers(shape.numbers, shape.kind, true, Place::File, &mut reading.notes)?;
        return Ok((selection, channel));
    }
    // Channels lie side by side in a pixel, or in pages of their own.
    let channel = channel_of(channels * shape.numbers, names, reading.params, &mut reading.notes)?;
    let value = Value::Number(channel % shape.numbers);
    Ok((Selection { numbers: shape.numbers, value, ..whole }, channel / shape.numbers))
}
