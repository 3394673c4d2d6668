//! SPZ of Niantic, versions 2 and 3, inside gzip or not: a header of 16 bytes, then all places, opacities, colours, deviations, rotations
//! and harmonics one after the other.
//!
//! Places are whole numbers of 24 bits over 2^fraction; opacities bytes; colours bytes around ½ with a step of 1/(255·0.15) in the constant
//! harmonic; logarithms of deviations sixteenths of a byte less 10. Version 2 has x, y and z of a rotation as bytes, version 3 the three
//! smallest numbers of it in ten bits each with the place of the largest before them. Other harmonics are bytes around 128 over 128.

use super::gaussians::{self, Gathered, Gaussian, exponentials, refused};
use crate::error::{Place, ReadError};
use crate::reading::Reading;
use splat_core::glam::DVec3;
use splat_core::{Gaussians, RawPoints};
use std::f64::consts::FRAC_1_SQRT_2;

/// Its first bytes, once it is unpacked.
const MARK: &[u8] = b"NGSP";
/// Bytes of the header.
const HEADER: usize = 16;
/// Step of the constant harmonic.
const COLOR_SCALE: f64 = 0.15;
/// The flag of Gaussians that were trained with a filter that keeps their light.
const ANTIALIASED: u8 = 1;

struct Header {
    version: u32,
    count: usize,
    degree: u8,
    fraction: u8,
}

/// Reads an SPZ file that is unpacked.
pub(crate) fn read(content: &[u8], reading: &mut Reading<'_>) -> Result<RawPoints, ReadError> {
    let header = header(content, reading)?;
    let Header { version, count, degree, fraction } = header;
    let others = (usize::from(degree) + 1).pow(2) - 1;
    let widths = [9, 1, 3, 3, if version == 2 { 3 } else { 4 }, 3 * others];
    let bytes = HEADER as u128 + count as u128 * widths.iter().sum::<usize>() as u128;
    if content.len() as u128 != bytes {
        let expected = format!("{bytes} bytes for {count} Gaussians of degree {degree}");
        let is_longer = content.len() as u128 > bytes;
        let hint = if is_longer {
            "the file holds more than its header announces: save it anew, such as with SuperSplat"
        } else {
            "the file is truncated or damaged; fetch it again"
        };
        return Err(ReadError::input(Place::Byte(content.len() as u64), expected, format!("{}", content.len()), hint));
    }
    let mut gathered = Gathered::new(count, degree, reading.params)?;
    let starts = widths.iter().scan(HEADER, |at, width| Some(std::mem::replace(at, *at + width * count)));
    let starts: Vec<usize> = starts.collect();
    for i in 0..count {
        if i.is_multiple_of(1 << 14) {
            reading.go_on()?;
        }
        let bytes = |part: usize| &content[starts[part] + widths[part] * i..][..widths[part]];
        let byte = |part: usize, k: usize| f64::from(bytes(part)[k]);
        let gaussian = Gaussian {
            position: DVec3::from_array([0, 1, 2].map(|k| fixed(&bytes(0)[3 * k..], fraction))),
            deviation: exponentials(DVec3::from_array([0, 1, 2].map(|k| byte(3, k) / 16.0 - 10.0))),
            rotation: if version == 2 { first_three(bytes(4)) } else { smallest_three(bytes(4)) },
            opacity: byte(1, 0) / 255.0,
        };
        let constant = [0, 1, 2].map(|c| (byte(2, c) / 255.0 - 0.5) / COLOR_SCALE);
        let harmonic = |k: usize| match k {
            0 => constant,
            k => [0, 1, 2].map(|c| (byte(5, 3 * (k - 1) + c) - 128.0) / 128.0),
        };
        let place = Place::Byte((starts[0] + widths[0] * i) as u64);
        gathered.push(&gaussian, (0..others + 1).map(harmonic)).map_err(|wrong| refused(place, i as u64, wrong))?;
    }
    gathered.finish(Place::Byte(HEADER as u64))
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
    if !(2..=3).contains(&version) {
        let hint = "save it anew with a current program, as SPZ of version 3 or as PLY";
        return Err(ReadError::input(Place::Byte(4), "version 2 or 3", version.to_string(), hint));
    }
    let damaged = |at, expected, found: u8| {
        Err(ReadError::input(Place::Byte(at), expected, found.to_string(), "the file is damaged"))
    };
    if degree > Gaussians::MOST_DEGREE {
        return damaged(12, "harmonics of degree 0 to 3", degree);
    }
    if fraction > 23 {
        return damaged(13, "at most 23 bits behind the point of a place", fraction);
    }
    if flags & ANTIALIASED != 0 {
        reading.notes.remark(gaussians::ANTIALIASED);
    }
    Ok(Header { version, count: word(8) as usize, degree, fraction })
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
