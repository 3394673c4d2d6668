//! SPZ of Niantic, versions 1 to 4: all places, opacities, colours, deviations, rotations and harmonics one after the other. Versions 1 to 3
//! have a header of 16 bytes and lie inside gzip or not; version 4 has one of 32 bytes, a list of its parts, and packs each with Zstandard.
//!
//! Places are half floats in version 1, later whole numbers of 24 bits over 2^fraction; opacities bytes; colours bytes around ½ with a step
//! of 1/(255·0.15) in the constant harmonic; logarithms of deviations sixteenths of a byte less 10. Versions 1 and 2 have x, y and z of a
//! rotation as bytes, later ones the three smallest numbers of it in ten bits each with the place of the largest before them. Other harmonics
//! are bytes around 128 over 128.

use super::gaussians::{self, Gathered, Gaussian, exponentials, refused};
use crate::error::{Place, ReadError};
use crate::reading::Reading;
use crate::stream::input;
use half::f16;
use splat_core::glam::DVec3;
use splat_core::{Gaussians, RawPoints};
use std::borrow::Cow;
use std::f64::consts::FRAC_1_SQRT_2;

/// Its first bytes, once it is unpacked.
const MARK: &[u8] = b"NGSP";
/// Bytes of the header up to version 3, and of the part that all versions have.
const HEADER: usize = 16;
/// Bytes of the header of version 4.
const LONG_HEADER: usize = 32;
/// Bytes of the entry of a part in the list of version 4: its packed and its unpacked length.
const ENTRY: usize = 16;
/// Step of the constant harmonic.
const COLOR_SCALE: f64 = 0.15;
/// The flag of Gaussians that were trained with a filter that keeps their light.
const ANTIALIASED: u8 = 1;
/// The flag of a file with extensions.
const EXTENDED: u8 = 2;
/// The extension that states other axes.
const AXES: u32 = 0xadbe_0003;
/// The highest degree that a file may have. Coefficients of degree 4 are read over.
const MOST_STORED_DEGREE: u8 = 4;

const TRUNCATED: &str = "the file is truncated or damaged; fetch it again";

struct Header {
    version: u32,
    count: usize,
    /// Degree of the stored harmonics.
    degree: u8,
    fraction: u8,
    flags: u8,
}

impl Header {
    /// Bytes of a Gaussian in each part.
    fn widths(&self) -> [usize; 6] {
        let place = if self.version == 1 { 6 } else { 9 };
        let rotation = if self.version <= 2 { 3 } else { 4 };
        [place, 1, 3, 3, rotation, 3 * coefficients(self.degree)]
    }
}

/// Coefficients of one colour beside the constant.
fn coefficients(degree: u8) -> usize {
    (usize::from(degree) + 1).pow(2) - 1
}

/// A part of version 4 as it is stored.
#[cfg(feature = "spz4")]
struct Packed<'a> {
    part: usize,
    /// Its first byte in the file.
    at: usize,
    bytes: &'a [u8],
    /// Bytes of it once it is unpacked.
    length: usize,
}

/// Bytes of all Gaussians, part by part.
struct Parts<'a> {
    bytes: Vec<Cow<'a, [u8]>>,
    /// Bytes of a Gaussian in each.
    widths: [usize; 6],
    /// Where places begin in the file, and bytes from one to the next; `None` where they are packed.
    places: Option<usize>,
}

impl Parts<'_> {
    fn bytes_of(&self, part: usize, i: usize) -> &[u8] {
        &self.bytes[part][self.widths[part] * i..][..self.widths[part]]
    }
}

/// Reads an SPZ file; up to version 3 it is unpacked from gzip already.
pub(crate) fn read(content: &[u8], reading: &mut Reading<'_>) -> Result<RawPoints, ReadError> {
    let header = header(content, reading)?;
    let Header { version, count, degree: stored, fraction, .. } = header;
    let parts =
        if version == 4 { unpacked(content, &header, reading)? } else { stored_parts(content, &header, reading)? };
    let degree = stored.min(Gaussians::MOST_DEGREE);
    if degree < stored {
        reading
            .notes
            .warnings
            .push("its harmonics of degree 4 are left out: colours change less with the direction".to_owned());
    }
    let mut gathered = Gathered::new(count, degree, reading.params)?;
    for i in 0..count {
        if i.is_multiple_of(1 << 14) {
            reading.go_on()?;
        }
        let byte = |part: usize, k: usize| f64::from(parts.bytes_of(part, i)[k]);
        let coordinate = |k: usize| {
            let bytes = parts.bytes_of(0, i);
            if version == 1 {
                f16::from_le_bytes([bytes[2 * k], bytes[2 * k + 1]]).to_f64()
            } else {
                fixed(&bytes[3 * k..], fraction)
            }
        };
        let gaussian = Gaussian {
            position: DVec3::from_array([0, 1, 2].map(coordinate)),
            deviation: exponentials(DVec3::from_array([0, 1, 2].map(|k| byte(3, k) / 16.0 - 10.0))),
            rotation: if version <= 2 {
                first_three(parts.bytes_of(4, i))
            } else {
                smallest_three(parts.bytes_of(4, i))
            },
            opacity: byte(1, 0) / 255.0,
        };
        let constant = [0, 1, 2].map(|c| (byte(2, c) / 255.0 - 0.5) / COLOR_SCALE);
        let harmonic = |k: usize| match k {
            0 => constant,
            k => [0, 1, 2].map(|c| (byte(5, 3 * (k - 1) + c) - 128.0) / 128.0),
        };
        let place = parts.places.map_or(Place::File, |start| Place::Byte((start + header.widths()[0] * i) as u64));
        let taken = gathered.push(&gaussian, (0..coefficients(degree) + 1).map(harmonic));
        taken.map_err(|wrong| refused(place, i as u64, wrong))?;
    }
    gathered.finish(Place::Byte(HEADER as u64))
}

/// The parts of versions 1 to 3, which follow each other.
fn stored_parts<'a>(content: &'a [u8], header: &Header, reading: &mut Reading<'_>) -> Result<Parts<'a>, ReadError> {
    let widths = header.widths();
    let Header { count, degree, flags, .. } = *header;
    let bytes = HEADER as u128 + count as u128 * widths.iter().sum::<usize>() as u128;
    let is_longer = content.len() as u128 > bytes;
    if is_longer && flags & EXTENDED != 0 {
        reading.notes.remark("its extensions are not read");
    } else if content.len() as u128 != bytes {
        let expected = format!("{bytes} bytes for {count} Gaussians of degree {degree}");
        let hint = if is_longer {
            "the file holds more than its header announces: save it anew, such as with SuperSplat"
        } else {
            TRUNCATED
        };
        return Err(ReadError::input(Place::Byte(content.len() as u64), expected, format!("{}", content.len()), hint));
    }
    let mut rest = &content[HEADER..];
    let mut parts = Vec::new();
    for width in widths {
        let (part, behind) = rest.split_at(width * count);
        parts.push(Cow::Borrowed(part));
        rest = behind;
    }
    Ok(Parts { bytes: parts, widths, places: Some(HEADER) })
}

/// The parts of version 4, unpacked.
#[cfg(feature = "spz4")]
fn unpacked<'a>(content: &'a [u8], header: &Header, reading: &mut Reading<'_>) -> Result<Parts<'a>, ReadError> {
    use rayon::prelude::*;
    let widths = header.widths();
    let wrong = |at: usize, expected: String, found: String| {
        Err(ReadError::input(Place::Byte(at as u64), expected, found, TRUNCATED))
    };
    if content.len() < LONG_HEADER {
        return wrong(0, "a header of 32 bytes".to_owned(), format!("{} bytes", content.len()));
    }
    let number = |at: usize| u64::from_le_bytes(std::array::from_fn(|b| content[at + b]));
    let list = u32::from_le_bytes(std::array::from_fn(|b| content[16 + b])) as usize;
    let filled: Vec<usize> = (0..widths.len()).filter(|part| widths[*part] * header.count > 0).collect();
    let stored = usize::from(content[15]);
    if stored != filled.len() {
        return wrong(
            15,
            format!("{} parts for {} Gaussians of degree {}", filled.len(), header.count, header.degree),
            stored.to_string(),
        );
    }
    let data = list.saturating_add(ENTRY * filled.len());
    if list < LONG_HEADER || data > content.len() {
        let expected = format!("a list of {} parts from byte 32 on, within {} bytes", filled.len(), content.len());
        return wrong(16, expected, format!("one at byte {list}"));
    }
    if header.flags & EXTENDED != 0 {
        name_extensions(&content[LONG_HEADER..list], reading);
    }
    let total = header.count as u64 * widths.iter().sum::<usize>() as u64;
    input::check_packed(total, content.len() as u64, "SPZ")?;
    input::hold("the unpacked parts", total, reading.params)?;
    let mut at = data;
    let mut found = Vec::new();
    for (k, part) in filled.iter().enumerate() {
        let entry = list + ENTRY * k;
        let length = widths[*part] as u64 * header.count as u64;
        if number(entry + 8) != length {
            return wrong(entry + 8, format!("{length} bytes of part {k}"), number(entry + 8).to_string());
        }
        let packed = usize::try_from(number(entry)).ok().and_then(|length| content[at..].get(..length));
        let Some(packed) = packed else {
            return wrong(
                entry,
                format!("part {k} within the {} bytes of the file", content.len()),
                format!("{} bytes from byte {at} on", number(entry)),
            );
        };
        found.push(Packed { part: *part, at, bytes: packed, length: length as usize });
        at += packed.len();
    }
    if at != content.len() {
        return wrong(
            at,
            "the end of the file after the last part".to_owned(),
            format!("{} bytes more", content.len() - at),
        );
    }
    let unpack = |packed: Packed<'_>| Ok((packed.part, unpack(&packed)?));
    let done: Vec<(usize, Vec<u8>)> = found.into_par_iter().map(unpack).collect::<Result<_, ReadError>>()?;
    let mut bytes = vec![Cow::Borrowed(&content[..0]); widths.len()];
    done.into_iter().for_each(|(part, unpacked)| bytes[part] = Cow::Owned(unpacked));
    Ok(Parts { bytes, widths, places: None })
}

/// Without its decoder version 4 is refused.
#[cfg(not(feature = "spz4"))]
fn unpacked<'a>(_: &'a [u8], _: &Header, _: &mut Reading<'_>) -> Result<Parts<'a>, ReadError> {
    Err(ReadError::input(Place::Byte(4), "SPZ up to version 3", "version 4", "build with the feature spz4"))
}

/// Unpacks a part, which has to have its length.
#[cfg(feature = "spz4")]
fn unpack(packed: &Packed<'_>) -> Result<Vec<u8>, ReadError> {
    /// Encoders that do not know the length beforehand announce a window of up to 8 MiB.
    const WINDOW: u64 = 8 << 20;
    let Packed { at, bytes, length, .. } = *packed;
    let wrong = |found: String| {
        ReadError::input(Place::Byte(at as u64), format!("{length} bytes packed with Zstandard"), found, TRUNCATED)
    };
    let mut unpacked = Vec::new();
    input::reserve(&mut unpacked, length)?;
    unpacked.resize(length, 0);
    let mut decoder = ruzstd::decoding::FrameDecoder::new();
    decoder.set_max_window_size(WINDOW.max(length as u64));
    // The decoder indexes tables with what it finds in a stream without a checksum.
    let filled = crate::guarded::guarded(|| decoder.decode_all(bytes, &mut unpacked).map_err(|e| e.to_string()));
    match filled.map_err(wrong)? {
        filled if filled == length => Ok(unpacked),
        filled => Err(wrong(format!("{filled} bytes"))),
    }
}

/// Names the extensions between the header and the list of parts: a type and a length, four bytes each, then the data.
#[cfg(feature = "spz4")]
fn name_extensions(mut records: &[u8], reading: &mut Reading<'_>) {
    while let Some((head, rest)) = records.split_first_chunk::<8>() {
        let kind = u32::from_le_bytes([head[0], head[1], head[2], head[3]]);
        let length = u32::from_le_bytes([head[4], head[5], head[6], head[7]]) as usize;
        reading.notes.not_used([format!("extension {kind:#010x}").as_bytes()]);
        if kind == AXES {
            let warning =
                "an extension that is not read states its axes, and y is taken to point up: set `up`, or turn it";
            reading.notes.warnings.push(warning.to_owned());
        }
        records = rest.get(length..).unwrap_or_default();
    }
}

fn header(content: &[u8], reading: &mut Reading<'_>) -> Result<Header, ReadError> {
    let Some((head, _)) = content.split_first_chunk::<HEADER>() else {
        let found = format!("{} bytes", content.len());
        return Err(ReadError::input(Place::Byte(0), "a header of 16 bytes", found, "the file is truncated"));
    };
    let word = |at: usize| u32::from_le_bytes([0, 1, 2, 3].map(|b| head[at + b]));
    if !head.starts_with(MARK) {
        let found = format!("'{}'", splat_core::text::escaped(&head[..4], 4));
        return Err(ReadError::input(Place::Byte(0), "'NGSP', the mark of SPZ", found, "is this an SPZ file?"));
    }
    let version = word(4);
    let degree = head[12];
    let fraction = head[13];
    let flags = head[14];
    if !(1..=4).contains(&version) {
        let hint = "save it anew as SPZ of version 4 or as PLY, such as with SuperSplat";
        return Err(ReadError::input(Place::Byte(4), "version 1 to 4", version.to_string(), hint));
    }
    let damaged = |at, expected: &str, found: u8| {
        Err(ReadError::input(Place::Byte(at), expected, found.to_string(), "the file is damaged"))
    };
    if degree > MOST_STORED_DEGREE {
        return damaged(12, "harmonics of degree 0 to 4", degree);
    }
    if fraction > 23 {
        return damaged(13, "at most 23 bits behind the point of a place", fraction);
    }
    if flags & ANTIALIASED != 0 {
        reading.notes.remark(gaussians::ANTIALIASED);
    }
    Ok(Header { version, count: word(8) as usize, degree, fraction, flags })
}

/// A whole number of 24 bits over 2^fraction.
fn fixed(bytes: &[u8], fraction: u8) -> f64 {
    let whole = i32::from_le_bytes([0, bytes[0], bytes[1], bytes[2]]) >> 8;
    f64::from(whole) / f64::from(1u32 << fraction)
}

/// A quaternion, w first, of which x, y and z are stored and w is not negative.
fn first_three(bytes: &[u8]) -> [f64; 4] {
    let [x, y, z] = [0, 1, 2].map(|k| f64::from(bytes[k]) / 127.5 - 1.0);
    [(1.0 - x * x - y * y - z * z).max(0.0).sqrt(), x, y, z]
}

/// A quaternion, w first, whose largest number is left out of x, y, z, w.
fn smallest_three(bytes: &[u8]) -> [f64; 4] {
    const MOST: u32 = (1 << 9) - 1;
    let mut word = u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
    let largest = (word >> 30) as usize;
    let mut xyzw = [0.0; 4];
    let mut squares = 0.0;
    for k in (0..4).rev().filter(|k| *k != largest) {
        let size = FRAC_1_SQRT_2 * f64::from(word & MOST) / f64::from(MOST);
        xyzw[k] = if word & (MOST + 1) == 0 { size } else { -size };
        squares += size * size;
        word >>= 10;
    }
    xyzw[largest] = (1.0 - squares).max(0.0).sqrt();
    let [x, y, z, w] = xyzw;
    [w, x, y, z]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_worked_out_by_hand() {
        assert_eq!(fixed(&[0x00, 0x10, 0x00], 12), 1.0);
        assert_eq!(fixed(&[0xff, 0xff, 0xff], 0), -1.0);
        assert_eq!(fixed(&[0x00, 0x00, 0x80], 23), -1.0);
        // 255 is 1, 127 and 128 lie half a step around 0.
        assert_eq!(first_three(&[255, 0, 255])[0], 0.0);
        assert!((first_three(&[128, 127, 128])[1] - 1.0 / 255.0).abs() < 1e-15);
        // The largest is w (3); x has the lowest of the three places from above, z the lowest bits: 511 with a sign.
        let word: u32 = 3 << 30 | 511 << 20 | (1 << 9 | 511);
        let [w, x, y, z] = smallest_three(&word.to_le_bytes());
        assert_eq!([x, y, z], [FRAC_1_SQRT_2, 0.0, -FRAC_1_SQRT_2]);
        assert!(w.abs() < 1e-7);
        // The largest is x (0): then y, z and w are stored.
        let [w, x, y, z] = smallest_three(&(511u32 << 20).to_le_bytes());
        assert_eq!([w, z], [0.0; 2]);
        assert!((x - FRAC_1_SQRT_2).abs() < 1e-15 && y == FRAC_1_SQRT_2);
    }
}
