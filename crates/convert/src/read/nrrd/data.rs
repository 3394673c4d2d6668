//! Stored voxels → f32.

use super::HINT;
use super::header::{Header, Kind};
use crate::error::{Place, ReadError};
use crate::read::input;
use crate::read::text::Lines;
use rayon::prelude::*;

/// Voxels converted by one task.
const CHUNK: usize = 1 << 16;

/// Exactly `count` numbers; `at` is their byte offset in the file.
pub(super) fn binary(stored: &[u8], header: &Header, count: u64, at: usize) -> Result<Vec<f32>, ReadError> {
    let needed = count * header.kind.size();
    if stored.len() as u64 != needed {
        let [x, y, z] = header.sizes;
        let expected = format!("{needed} bytes of voxels ({x} x {y} x {z} x {} bytes)", header.kind.size());
        return Err(ReadError::input(Place::Byte(at as u64), expected, stored.len().to_string(), HINT));
    }
    macro_rules! decode {
        ($t:ty) => {
            convert(stored, |b: [u8; size_of::<$t>()]| {
                let value = if header.big_endian { <$t>::from_be_bytes(b) } else { <$t>::from_le_bytes(b) };
                value as f32
            })
        };
    }
    let values = match header.kind {
        Kind::I8 => decode!(i8),
        Kind::U8 => decode!(u8),
        Kind::I16 => decode!(i16),
        Kind::U16 => decode!(u16),
        Kind::I32 => decode!(i32),
        Kind::U32 => decode!(u32),
        Kind::I64 => decode!(i64),
        Kind::U64 => decode!(u64),
        Kind::F32 => decode!(f32),
        Kind::F64 => decode!(f64),
    }?;
    if let Some(i) = values.par_iter().position_first(|v| !v.is_finite()) {
        let found = format!("{} at voxel {i}", values[i]);
        let hint = "replace NaN by the background value first";
        return Err(ReadError::input(Place::File, "finite values that fit 32-bit floats", found, hint));
    }
    Ok(values)
}

fn convert<const N: usize>(raw: &[u8], decode: impl Fn([u8; N]) -> f32 + Sync) -> Result<Vec<f32>, ReadError> {
    let (stored, _) = raw.as_chunks::<N>();
    let mut values = Vec::new();
    input::reserve(&mut values, stored.len())?;
    values.par_extend(stored.par_iter().with_min_len(CHUNK).map(|b| decode(*b)));
    Ok(values)
}

/// Exactly `count` numbers in text.
pub(super) fn text(stored: &[u8], count: u64) -> Result<Vec<f32>, ReadError> {
    let mut lines = Lines::new(stored);
    let mut values = Vec::new();
    while let Some(line) = lines.next()? {
        for word in line.words(true) {
            let value = word.number()? as f32;
            if !value.is_finite() {
                let expected = "a value that fits a 32-bit float";
                return Err(ReadError::input(Place::File, expected, word.shown(), "scale the values"));
            }
            input::reserve(&mut values, 1)?;
            values.push(value);
        }
    }
    if values.len() as u64 != count {
        return Err(ReadError::input(Place::File, format!("{count} voxels"), values.len().to_string(), HINT));
    }
    Ok(values)
}
