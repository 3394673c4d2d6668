//! PNG (`.png`): pictures of 8 or 16 bits, grey or in colour, as displays show them (sRGB); they become linear radiance, 1 for white. Where
//! samples are no colours but numbers, they stay what they are, over the largest.

use crate::check_image;
use crate::error::{Place, ReadError};
use crate::reading::Reading;
use crate::stream::input::{check_deflated, hold, reserve};
use crate::volumes::slices::{LISTED_COLORS, Slice};
use crate::volumes::voxels::Kind;
use image::codecs::png::PngDecoder;
use image::{ColorType, DynamicImage, ImageDecoder};
use splat_core::RadianceImage;
use splat_core::srgb::linear_from_srgb;
use splat_core::text::escaped;
use std::io::Cursor;

/// Chunks that say other colours, or other pictures, than are read.
const NOT_USED: [&[u8]; 5] = [b"gAMA", b"cHRM", b"iCCP", b"cICP", b"acTL"];
const MARK: usize = 8;
/// The byte of the header that says what colours are, and its value where they are those of a list.
const COLOR_TYPE: usize = 25;
const LISTED: u8 = 3;

const DAMAGED: &str = "the file is truncated or damaged; save it anew, as PNG of 8 or 16 bits";

pub(crate) fn read(content: &[u8], reading: &mut Reading<'_>) -> Result<RadianceImage, ReadError> {
    let decoder = opened(content, reading)?;
    let (width, height) = decoder.dimensions();
    // Two copies exist at a time: the decoded image, and the same with four channels of 16 bits.
    let pixels = u64::from(width) * u64::from(height);
    hold("the decoded image", decoder.total_bytes().saturating_add(8 * pixels), reading.params)?;
    let mut pixels = Vec::new();
    reserve(&mut pixels, width as usize * height as usize)?;
    reading.go_on()?;
    let chunks = chunks(content)?;
    reading.notes.not_used(NOT_USED.into_iter().filter(|name| chunks.contains(name)));
    let decoded = DynamicImage::from_decoder(decoder).map_err(damaged)?;
    reading.go_on()?;
    if reading.params.is_coverage {
        let whole = |v: u16| f32::from(v) / f32::from(u16::MAX);
        match decoded.color().has_alpha() {
            true => pixels.extend(decoded.into_rgba16().pixels().map(|p| [whole(p.0[3]); 3])),
            false => pixels.extend(decoded.into_luma16().pixels().map(|p| [whole(p.0[0]); 3])),
        }
        return Ok(RadianceImage { size: [width, height], pixels });
    }
    let is_whole = !decoded.color().has_alpha() || decoded.to_rgba16().pixels().all(|p| p.0[3] == u16::MAX);
    if !is_whole {
        let hint = "an image of radiance hides nothing: flatten it onto a colour first";
        return Err(ReadError::input(Place::File, "opaque pixels", "some that are translucent", hint));
    }
    let value = |v: f64| if reading.params.is_data { v as f32 } else { linear_from_srgb(v) };
    let values: Vec<f32> = (0..=u16::MAX).map(|v| value(f64::from(v) / f64::from(u16::MAX))).collect();
    pixels.extend(decoded.into_rgb16().pixels().map(|p| p.0.map(|v| values[v as usize])));
    Ok(RadianceImage { size: [width, height], pixels })
}

/// The decoder of an image whose size is checked.
fn opened<'c>(content: &'c [u8], reading: &Reading<'_>) -> Result<PngDecoder<Cursor<&'c [u8]>>, ReadError> {
    let decoder = PngDecoder::new(Cursor::new(content)).map_err(damaged)?;
    let (width, height) = decoder.dimensions();
    check_image([width, height], reading.params)?;
    // Rows are packed in whole bytes: a mask of black and white has one bit a pixel.
    let row = u64::from(width) * u64::from(decoder.original_color_type().bits_per_pixel());
    check_deflated(row.div_ceil(8) * u64::from(height), content.len() as u64, "the packed image")?;
    Ok(decoder)
}

/// Reads one slice of a volume: its numbers as they are stored.
pub(crate) fn slice(content: &[u8], reading: &mut Reading<'_>) -> Result<Slice, ReadError> {
    let decoder = opened(content, reading)?;
    let size = <[u32; 2]>::from(decoder.dimensions());
    hold("the decoded image", 2 * decoder.total_bytes(), reading.params)?;
    // Profiles and gammas are of displays; the numbers are what counts.
    chunks(content)?;
    if content.get(COLOR_TYPE) == Some(&LISTED) {
        return indices(content, reading);
    }
    let (numbers, is_color, kind) = match decoder.color_type() {
        ColorType::L8 => (1, false, Kind::U8),
        ColorType::La8 => (2, false, Kind::U8),
        ColorType::Rgb8 => (3, true, Kind::U8),
        ColorType::Rgba8 => (4, true, Kind::U8),
        ColorType::L16 => (1, false, Kind::U16),
        ColorType::La16 => (2, false, Kind::U16),
        ColorType::Rgb16 => (3, true, Kind::U16),
        ColorType::Rgba16 => (4, true, Kind::U16),
        other => {
            return Err(ReadError::input(Place::File, "8 or 16 bits a number", format!("{other:?}"), DAMAGED));
        }
    };
    let mut bytes = Vec::new();
    reserve(&mut bytes, decoder.total_bytes() as usize)?;
    bytes.resize(decoder.total_bytes() as usize, 0);
    decoder.read_image(&mut bytes).map_err(damaged)?;
    Ok(Slice { size, kind, numbers, is_color, big_endian: cfg!(target_endian = "big"), bytes, width: None })
}

/// The numbers of a slice whose colours are a list, as a TIFF slice has them.
fn indices(content: &[u8], reading: &mut Reading<'_>) -> Result<Slice, ReadError> {
    let damaged = |e: ::png::DecodingError| {
        ReadError::input(Place::File, "a complete PNG image", escaped(e.to_string().as_bytes(), 120), DAMAGED)
    };
    let mut decoder = ::png::Decoder::new(Cursor::new(content));
    decoder.set_transformations(::png::Transformations::IDENTITY);
    let mut decoder = decoder.read_info().map_err(damaged)?;
    let ::png::Info { width, height, bit_depth, .. } = *decoder.info();
    let bits = bit_depth as usize;
    let Some(room) = decoder.output_buffer_size().filter(|_| matches!(bits, 1 | 2 | 4 | 8)) else {
        return Err(ReadError::input(
            Place::File,
            "numbers of 1 to 8 bits in a list of colours",
            bits.to_string(),
            DAMAGED,
        ));
    };
    let mut packed = Vec::new();
    reserve(&mut packed, room)?;
    packed.resize(room, 0);
    let row = decoder.next_frame(&mut packed).map_err(damaged)?.line_size;
    let mut bytes = Vec::new();
    reserve(&mut bytes, width as usize * height as usize)?;
    let mask = (u16::MAX >> (16 - bits)) as u8;
    for row in packed.chunks_exact(row).take(height as usize) {
        // The first number lies in the highest bits.
        bytes.extend((0..width as usize).map(|x| row[x * bits / 8] >> (8 - bits - x * bits % 8) & mask));
    }
    reading.notes.remark(LISTED_COLORS);
    let big_endian = cfg!(target_endian = "big");
    let size = [width, height];
    Ok(Slice { size, kind: Kind::U8, numbers: 1, is_color: false, big_endian, bytes, width: None })
}

/// Names of the chunks, of which the file is made up to the last byte.
fn chunks(content: &[u8]) -> Result<Vec<&[u8]>, ReadError> {
    let mut at = MARK;
    let mut names = Vec::new();
    while names.last() != Some(&b"IEND".as_slice()) {
        let head = content.get(at..at + 8).and_then(|head| head.split_first_chunk::<4>());
        let next = head.map(|(length, name)| (at as u64 + 12 + u64::from(u32::from_be_bytes(*length)), name));
        let Some((next, name)) = next.filter(|(next, _)| *next <= content.len() as u64) else {
            let found = "the end of the file";
            return Err(ReadError::input(Place::Byte(at as u64), "a whole chunk, the last one IEND", found, DAMAGED));
        };
        names.push(name);
        at = next as usize;
    }
    if at < content.len() {
        let found = format!("{} bytes more", content.len() - at);
        let hint = "something was added to the file";
        return Err(ReadError::input(Place::Byte(at as u64), "the end of the file after IEND", found, hint));
    }
    Ok(names)
}

fn damaged(error: image::ImageError) -> ReadError {
    ReadError::input(Place::File, "a complete PNG image", escaped(error.to_string().as_bytes(), 120), DAMAGED)
}
