//! Stored voxels of any number type → f32, block by block, so that a volume is not in memory twice.

use super::ReadParams;
use super::input::{self, Stream};
use crate::error::{Place, ReadError};
use rayon::prelude::*;

/// Voxels converted by one task.
const CHUNK: usize = 1 << 16;
/// Bytes read at once; a multiple of every size.
const BLOCK: usize = 8 << 20;

/// Type of one stored voxel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl Kind {
    /// Bytes of a voxel.
    pub(super) fn size(self) -> u64 {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }
}

/// How the voxels of a volume are stored.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stored {
    pub(super) kind: Kind,
    pub(super) big_endian: bool,
    pub(super) dims: [u64; 3],
    /// Slope and intercept of the values; (1, 0) for none.
    pub(super) scaling: (f64, f64),
}

impl Stored {
    /// Voxels; callers have checked that it is at most 2^45.
    pub(super) fn count(&self) -> u64 {
        self.dims.iter().product()
    }

    /// Bytes of all voxels.
    pub(super) fn bytes(&self) -> u64 {
        self.count() * self.kind.size()
    }
}

/// Reads the voxels, with which the stream has to end; `hint` says what is wrong if it does not.
pub(super) fn read(
    stream: &mut Stream<'_>,
    stored: &Stored,
    params: &ReadParams,
    hint: &'static str,
) -> Result<Vec<f32>, ReadError> {
    let (needed, at) = (stored.bytes(), stream.position());
    let wrong = |found: String| {
        let [x, y, z] = stored.dims;
        let expected = format!("{needed} bytes of voxels ({x} x {y} x {z} x {} bytes)", stored.kind.size());
        Err(ReadError::input(Place::Byte(at), expected, found, hint))
    };
    if let Some(left) = stream.left().filter(|left| *left != needed) {
        return wrong(left.to_string());
    }
    input::check_bytes("the voxels", stored.count() * size_of::<f32>() as u64, params)?;
    stream.expect(needed)?;
    let mut values = Vec::new();
    input::reserve(&mut values, stored.count() as usize)?;
    let mut block = vec![0; (needed as usize).min(BLOCK)];
    let mut left = needed as usize;
    while left > 0 {
        let part = &mut block[..left.min(BLOCK)];
        let got = stream.fill(part)?;
        if got < part.len() {
            return wrong((needed as usize - left + got).to_string());
        }
        append(&mut values, part, stored);
        left -= got;
    }
    // One byte more is too much already, however many there are.
    if stream.fill(&mut [0])? > 0 {
        return wrong(format!("more than {needed}"));
    }
    if let Some(i) = values.par_iter().position_first(|v| !v.is_finite()) {
        let place = Place::Byte(at + i as u64 * stored.kind.size());
        let found = format!("{} at voxel {i}", values[i]);
        let hint = "replace NaN by the background value first";
        return Err(ReadError::input(place, "finite values that fit 32-bit floats", found, hint));
    }
    Ok(values)
}

fn append(values: &mut Vec<f32>, raw: &[u8], stored: &Stored) {
    macro_rules! decode {
        ($t:ty) => {
            convert(values, raw, |b: [u8; size_of::<$t>()]| {
                let value = if stored.big_endian { <$t>::from_be_bytes(b) } else { <$t>::from_le_bytes(b) };
                match stored.scaling {
                    (1.0, 0.0) => value as f32,
                    (slope, intercept) => (value as f64 * slope + intercept) as f32,
                }
            })
        };
    }
    match stored.kind {
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
    }
}

fn convert<const N: usize>(values: &mut Vec<f32>, raw: &[u8], decode: impl Fn([u8; N]) -> f32 + Sync) {
    values.par_extend(raw.as_chunks::<N>().0.par_iter().with_min_len(CHUNK).map(|b| decode(*b)));
}
