//! Radiance HDR (`.hdr`, `.pic`): a text header, and scanlines of pixels with one exponent for three mantissas (Ward 1991), in either
//! of their run-length codes.
//!
//! Scanlines are unpacked one by one, so memory grows with what the file holds and not with what it announces.

use crate::error::{Place, ReadError};
use crate::reading::Reading;
use crate::stream::input::{check_packed, reserve};
use crate::{ReadParams, check_image};
use splat_core::RadianceImage;
use splat_core::text::escaped;

const TRUNCATED: &str = "the file is truncated or damaged; fetch it again";
/// Widths that the newer code of scanlines can have.
const NEWER: std::ops::RangeInclusive<usize> = 8..=32767;

/// What the header says.
struct Header {
    size: [u32; 2],
    /// Factors on radiance that the stored numbers have, per channel.
    exposure: [f64; 3],
    /// Bytes of the header.
    length: usize,
}

pub(crate) fn read(content: &[u8], reading: &mut Reading<'_>) -> Result<RadianceImage, ReadError> {
    let header = header(content, reading)?;
    check_size(&header, content.len(), reading.params)?;
    let [width, height] = header.size.map(|s| s as usize);
    let mut pixels = Vec::new();
    let mut scanlines = Scanlines { content, at: header.length };
    let mut row = vec![[0; 4]; width];
    for y in 0..height {
        reading.go_on()?;
        let begin = scanlines.at;
        scanlines.next(&mut row).map_err(|fault| fault.into_error(y, header.size))?;
        reserve(&mut pixels, width)?;
        for (x, pixel) in row.iter().enumerate() {
            let radiance = radiance(*pixel, header.exposure);
            if !radiance.iter().all(|v| v.is_finite()) {
                let found = format!("{radiance:?} at pixel ({x}, {y}), of the scanline that begins here");
                let hint = "its exposure or exponents are wrong; write the image anew";
                return Err(ReadError::input(
                    Place::Byte(begin as u64),
                    "radiance that fits 32-bit floats",
                    found,
                    hint,
                ));
            }
            pixels.push(radiance);
        }
    }
    if scanlines.at < content.len() {
        let expected = format!("the end of the file after {height} scanlines");
        let found = format!("{} bytes more", content.len() - scanlines.at);
        let hint = "the size in its header is wrong, or something was added to the file";
        return Err(ReadError::input(Place::Byte(scanlines.at as u64), expected, found, hint));
    }
    Ok(RadianceImage { size: header.size, pixels })
}

fn check_size(header: &Header, stored: usize, params: &ReadParams) -> Result<(), ReadError> {
    check_packed(check_image(header.size, params)?, stored as u64, "the packed image")
}

/// Linear radiance of three mantissas and an exponent, without the factors that the file was written with.
fn radiance(bytes: [u8; 4], exposure: [f64; 3]) -> [f32; 3] {
    let [r, g, b, e] = bytes;
    // 2^(e − 136), and 0 for e = 0.
    let unit = if e == 0 { 0.0 } else { f64::from_bits((u64::from(e) + 1023 - 136) << 52) };
    let mantissas = [r, g, b].map(f64::from);
    std::array::from_fn(|c| (mantissas[c] * unit / exposure[c]) as f32)
}

fn header(content: &[u8], reading: &mut Reading<'_>) -> Result<Header, ReadError> {
    let mut at = 0;
    let mut line = 0;
    let mut next = || {
        let rest = &content[at..];
        let Some(length) = rest.iter().position(|b| *b == b'\n') else {
            let expected = "a header, an empty line and a line of the size";
            return Err(ReadError::input(
                Place::Byte(content.len() as u64),
                expected,
                "the end of the file",
                TRUNCATED,
            ));
        };
        at += length + 1;
        line += 1;
        Ok((&rest[..length], line, at))
    };
    let mut exposure = [1.0; 3];
    let (size, line, length) = loop {
        let (text, line, _) = next()?;
        if text.is_empty() {
            break next()?;
        }
        statement(text, line, &mut exposure, reading)?;
    };
    Ok(Header { size: size_of_image(size, line)?, exposure, length })
}

/// A line `NAME=VALUE` of the header; comments and commands have no part in the picture.
fn statement(text: &[u8], line: u64, exposure: &mut [f64; 3], reading: &mut Reading<'_>) -> Result<(), ReadError> {
    let place = Place::Line { line, column: 0 };
    let refused =
        |expected: &str, hint| Err(ReadError::input(place, expected, format!("'{}'", escaped(text, 60)), hint));
    let Some(split) = text.iter().position(|b| *b == b'=').filter(|_| text[0] != b'#') else { return Ok(()) };
    let name = text[..split].trim_ascii();
    let value = String::from_utf8_lossy(&text[split + 1..]);
    let numbers: Vec<f64> = value.split_ascii_whitespace().map_while(|word| word.parse().ok()).collect();
    let are_factors = |n: usize| numbers.len() == n && numbers.iter().all(|v| v.is_finite() && *v > 0.0);
    match name {
        b"FORMAT" if value.trim() != "32-bit_rle_rgbe" => {
            return refused("FORMAT=32-bit_rle_rgbe", "convert it to RGB, by pvalue or ra_xyze -r for instance");
        }
        b"EXPOSURE" if !are_factors(1) => return refused("EXPOSURE= and a number above 0", "correct the header"),
        b"COLORCORR" if !are_factors(3) => {
            return refused("COLORCORR= and three numbers above 0", "correct the header");
        }
        b"EXPOSURE" => exposure.iter_mut().for_each(|e| *e *= numbers[0]),
        b"COLORCORR" => exposure.iter_mut().zip(&numbers).for_each(|(e, n)| *e *= n),
        // Colours are taken as linear Rec.709, whose primaries nearly all files have.
        b"PRIMARIES" => reading.notes.not_used([name]),
        _ => {}
    }
    Ok(())
}

/// `-Y HEIGHT +X WIDTH`: rows from the top, columns from the left.
fn size_of_image(text: &[u8], line: u64) -> Result<[u32; 2], ReadError> {
    let words = String::from_utf8_lossy(text);
    let words: Vec<&str> = words.split_ascii_whitespace().collect();
    if let ["-Y", height, "+X", width] = words[..]
        && let (Ok(width), Ok(height)) = (width.parse(), height.parse())
    {
        return Ok([width, height]);
    }
    let found = format!("'{}'", escaped(text, 60));
    let hint = "other orders of pixels are not read; write the image anew";
    Err(ReadError::input(Place::Line { line, column: 0 }, "-Y HEIGHT +X WIDTH", found, hint))
}

/// Scanlines that follow each other.
struct Scanlines<'a> {
    content: &'a [u8],
    at: usize,
}

/// What is wrong in a scanline, and where.
struct Fault {
    at: usize,
    expected: String,
    found: String,
}

impl Fault {
    fn into_error(self, y: usize, size: [u32; 2]) -> ReadError {
        let [_, height] = size;
        let Self { at, expected, found } = self;
        let expected = format!("{expected} in scanline {y} of {height}");
        ReadError::input(Place::Byte(at as u64), expected, found, TRUNCATED)
    }
}

impl Scanlines<'_> {
    fn next(&mut self, row: &mut [[u8; 4]]) -> Result<(), Fault> {
        let [a, b, high, low] = self.pixel(0, row.len())?;
        if [a, b] != [2, 2] || high >= 128 || !NEWER.contains(&row.len()) {
            self.at -= 4;
            return self.older(row);
        }
        let announced = usize::from(high) << 8 | usize::from(low);
        if announced != row.len() {
            return Err(self.fault(4, format!("{} pixels", row.len()), announced.to_string()));
        }
        (0..4).try_for_each(|channel| self.channel(row, channel))
    }

    /// One channel of a scanline: runs of one value, and stretches of values.
    fn channel(&mut self, row: &mut [[u8; 4]], channel: usize) -> Result<(), Fault> {
        let mut x = 0;
        while x < row.len() {
            let code = usize::from(self.take(1, x, row.len())?[0]);
            let length = if code > 128 { code - 128 } else { code };
            if length == 0 || x + length > row.len() {
                let expected = format!("1 to {} pixels", row.len() - x);
                return Err(self.fault(1, expected, length.to_string()));
            }
            let values = self.take(if code > 128 { 1 } else { length }, x, row.len())?;
            for (k, pixel) in row[x..x + length].iter_mut().enumerate() {
                pixel[channel] = values[k.min(values.len() - 1)];
            }
            x += length;
        }
        Ok(())
    }

    /// A scanline of whole pixels, of which (1, 1, 1, n) repeats the last one n times, and one after it n·256 times.
    fn older(&mut self, row: &mut [[u8; 4]]) -> Result<(), Fault> {
        let mut x = 0;
        let mut shift = 0;
        while x < row.len() {
            let pixel = self.pixel(x, row.len())?;
            let length = if pixel[..3] != [1; 3] {
                shift = 0;
                row[x] = pixel;
                1
            } else {
                // Wider images than 2^24 pixels are not read.
                let run = usize::from(pixel[3]) << shift;
                if x == 0 || shift > 16 || x + run > row.len() {
                    let expected =
                        if x == 0 { "a first pixel".to_owned() } else { format!("at most {} pixels", row.len() - x) };
                    return Err(self.fault(4, expected, format!("a run of {run}")));
                }
                shift += 8;
                let last = row[x - 1];
                row[x..x + run].fill(last);
                run
            };
            x += length;
        }
        Ok(())
    }

    fn pixel(&mut self, x: usize, width: usize) -> Result<[u8; 4], Fault> {
        let bytes = self.take(4, x, width)?;
        Ok([bytes[0], bytes[1], bytes[2], bytes[3]])
    }

    /// The next bytes; `x` of `width` pixels are known.
    fn take(&mut self, count: usize, x: usize, width: usize) -> Result<&[u8], Fault> {
        let Some(bytes) = self.content.get(self.at..self.at + count) else {
            self.at = self.content.len();
            return Err(self.fault(0, format!("{} more pixels", width - x), "the end of the file".to_owned()));
        };
        self.at += count;
        Ok(bytes)
    }

    /// A fault in what begins so many bytes before.
    fn fault(&self, before: usize, expected: String, found: String) -> Fault {
        Fault { at: self.at - before, expected, found }
    }
}
