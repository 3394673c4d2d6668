//! OpenEXR (`.exr`): the first part with channels R, G and B, in 16 or 32 bits, by scanlines or tiles; of images of several
//! resolutions the largest.

use crate::check_image;
use crate::error::{Place, ReadError};
use crate::reading::Reading;
use crate::stream::input::{check_deflated, check_packed, hold, reserve};
use ::exr::math::Vec2;
use ::exr::meta::header::Header;
use ::exr::meta::{BlockDescription, MetaData};
use ::exr::prelude::{ReadChannels, ReadLayers, ReadSpecificChannel};
use splat_core::RadianceImage;
use splat_core::text::escaped;
use std::io::Cursor;

const CHANNELS: [&str; 3] = ["R", "G", "B"];
const ALPHA: &str = "A";
/// How bright red, green and blue of Rec.709 are.
const LUMINANCE: [f32; 3] = [0.2126, 0.7152, 0.0722];
/// Blocks that are in memory at a time, at most.
const BLOCKS_AT_ONCE: u64 = 64;
/// Images of longer sides than this are decoded by several threads.
const LONGEST_ALONE: u32 = 1024;

pub(crate) fn read(content: &[u8], reading: &mut Reading<'_>) -> Result<RadianceImage, ReadError> {
    let meta = MetaData::read_from_buffered(Cursor::new(content), false).map_err(damaged)?;
    let header = first_in_color(&meta)?;
    let size = checked_size(header)?;
    let has_alpha = header.channels.list.iter().any(|c| c.name.to_string() == ALPHA);
    check_image(size, reading.params)?;
    let stored = u64::from(size[0]) * u64::from(size[1]) * header.channels.bytes_per_pixel as u64;
    check_deflated(stored, content.len() as u64, "the packed image")?;
    // Blocks are decoded one by one, or some at a time.
    let blocks = meta.headers.iter().map(block_bytes).max().unwrap_or(0).saturating_mul(BLOCKS_AT_ONCE);
    hold("blocks of the image", blocks.min(2 * stored), reading.params)?;
    meta.headers
        .iter()
        .try_for_each(|header| check_packed(block_bytes(header), content.len() as u64, "a packed tile"))?;
    // Asked for first, where an allocator that has no room can still be told.
    let mut room: Vec<[f32; 3]> = Vec::new();
    reserve(&mut room, size[0] as usize * size[1] as usize)?;
    drop(room);
    reading.go_on()?;
    let is_coverage = reading.params.is_coverage;
    let shown = move |r: f32, g: f32, b: f32, a: f32| match (is_coverage, has_alpha) {
        (false, _) => [r, g, b],
        (true, true) => [a; 3],
        (true, false) => [LUMINANCE[0] * r + LUMINANCE[1] * g + LUMINANCE[2] * b; 3],
    };
    let reader = ::exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .specific_channels()
        .required(CHANNELS[0])
        .required(CHANNELS[1])
        .required(CHANNELS[2])
        .optional(ALPHA, 1.0)
        .collect_pixels(
            |size: Vec2<usize>, _: &_| (size.0, vec![[0.0f32; 3]; size.0 * size.1]),
            move |(width, pixels): &mut (usize, Vec<[f32; 3]>), at: Vec2<usize>, (r, g, b, a): (f32, f32, f32, f32)| {
                pixels[at.1 * *width + at.0] = shown(r, g, b, a);
            },
        )
        .first_valid_layer()
        .all_attributes();
    // Its threads are started anew for each file, beside those that read other files.
    let reader = if size[0].max(size[1]) <= LONGEST_ALONE { reader.non_parallel() } else { reader };
    let image = reader.from_buffered(Cursor::new(content)).map_err(damaged)?;
    let (width, pixels) = image.layer_data.channel_data.pixels;
    if [width, pixels.len()] != [size[0] as usize, size[0] as usize * size[1] as usize] {
        return Err(refused(
            format!("{} x {} pixels", size[0], size[1]),
            format!("{} in rows of {width}", pixels.len()),
        ));
    }
    let image = RadianceImage { size, pixels };
    check_radiance(&image)?;
    Ok(image)
}

const DAMAGED: &str =
    "the file is truncated or damaged, or written in another way; save it anew, by scanlines, as ZIP or uncompressed";

fn refused(expected: impl Into<String>, found: impl Into<String>) -> ReadError {
    ReadError::input(Place::File, expected, found, DAMAGED)
}

fn damaged(error: ::exr::error::Error) -> ReadError {
    refused("a complete OpenEXR image", escaped(error.to_string().as_bytes(), 120))
}

/// The first part that is an image of colours.
fn first_in_color(meta: &MetaData) -> Result<&Header, ReadError> {
    if meta.requirements.has_deep_data || meta.headers.iter().any(|h| h.deep) {
        return Err(ReadError::input(Place::File, "one colour a pixel", "a deep image", "flatten it first"));
    }
    let names = |h: &Header| -> Vec<String> { h.channels.list.iter().map(|c| c.name.to_string()).collect() };
    let in_color = |h: &&Header| CHANNELS.iter().all(|c| names(h).iter().any(|n| n == c));
    let Some(header) = meta.headers.iter().find(in_color) else {
        let channels: Vec<String> = meta.headers.iter().flat_map(names).collect();
        let found = format!("'{}'", escaped(channels.join(" ").as_bytes(), 60));
        return Err(ReadError::input(
            Place::File,
            "channels R, G and B",
            found,
            "save it as RGB, without names of layers",
        ));
    };
    Ok(header)
}

/// Most bytes of the tiles or groups of scanlines of a part: the decoder takes room for as many as one says that it has. Tiles may be larger than
/// the image.
fn block_bytes(header: &Header) -> u64 {
    let [width, height] = match header.blocks {
        BlockDescription::Tiles(tiles) => [tiles.tile_size.0, tiles.tile_size.1],
        BlockDescription::ScanLines => [header.layer_size.0, header.compression.scan_lines_per_block()],
    };
    [width, height].iter().fold(header.channels.bytes_per_pixel as u64, |bytes, n| bytes.saturating_mul(*n as u64))
}

/// Width and height of an image that is whole.
fn checked_size(header: &Header) -> Result<[u32; 2], ReadError> {
    let data = header.data_window();
    let whole = header.shared_attributes.display_window;
    if data != whole {
        let show = |w: ::exr::meta::attribute::IntegerBounds| {
            format!("{} x {} at ({}, {})", w.size.0, w.size.1, w.position.0, w.position.1)
        };
        let expected = format!("pixels in the whole display window, {}", show(whole));
        let hint = "an environment has all directions; save it uncropped";
        return Err(ReadError::input(Place::File, expected, show(data), hint));
    }
    let size = [header.layer_size.0, header.layer_size.1].map(u32::try_from);
    match size {
        [Ok(width), Ok(height)] => Ok([width, height]),
        _ => Err(refused("a size of 32-bit numbers", format!("{:?}", header.layer_size))),
    }
}

/// Refuses what is no radiance.
fn check_radiance(image: &RadianceImage) -> Result<(), ReadError> {
    let is_bad = |v: &f32| !(v.is_finite() && *v >= 0.0);
    let Some(k) = image.pixels.iter().position(|p| p.iter().any(is_bad)) else { return Ok(()) };
    let channel = image.pixels[k].iter().position(is_bad).unwrap_or(0);
    let x = k % image.size[0] as usize;
    let y = k / image.size[0] as usize;
    let found = format!("{} in channel {} of pixel ({x}, {y})", image.pixels[k][channel], CHANNELS[channel]);
    let hint = "replace it by 0 or by its neighbours first";
    Err(ReadError::input(Place::File, "radiance: finite numbers ≥ 0", found, hint))
}
