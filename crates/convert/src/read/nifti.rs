//! NIfTI-1 in one file (`.nii`, `.nii.gz`) → a volume of scalars in the file's world coordinates (millimetres mostly).
//!
//! Affine: sform if its code is positive, else qform, else the voxel size alone (NIfTI-1 methods 3, 2 and 1).
//! Values: stored · scl_slope + scl_inter, as they are where the slope is 0 or NaN.

use super::{ReadLimits, input};
use crate::error::{Place, ReadError};
use ::nifti::{NiftiHeader, NiftiType};
use rayon::prelude::*;
use splat_core::Grid;
use splat_core::glam::{DMat3, DVec3};

const HEADER: usize = 348;
const HINT: &str = "the file is truncated, damaged or not NIfTI-1";
/// Voxels converted by one task.
const CHUNK: usize = 1 << 16;

/// Reads a volume.
pub(super) fn read(content: &[u8], limits: &ReadLimits) -> Result<Grid, ReadError> {
    let (header, big_endian) = header(content)?;
    let dims = dims(&header)?;
    let kind = header.data_type().ok().filter(|k| size_of_scalar(*k).is_some()).ok_or_else(|| {
        let expected = "a datatype of real scalars: 8- to 64-bit integers, 32- or 64-bit floats";
        ReadError::input(Place::Byte(70), expected, format!("code {}", header.datatype), "convert the volume first")
    })?;
    let raw = raw_voxels(content, &header, dims, kind, limits)?;
    let (origin, axes) = affine(&header);
    let volume = axes.determinant();
    if !(origin.is_finite() && volume.is_finite() && volume != 0.0) {
        let found = format!("origin {origin}, axes {axes}");
        return Err(ReadError::input(Place::Byte(252), "an affine of three independent finite axes", found, HINT));
    }
    let values = values(raw, kind, big_endian, scaling(&header)?)?;
    if let Some(i) = values.par_iter().position_first(|v| !v.is_finite()) {
        let found = format!("{} at voxel {i}", values[i]);
        let hint = "replace NaN by the background value first";
        let place = Place::Byte(header.vox_offset as u64 + i as u64 * size_of_scalar(kind).unwrap_or(0));
        return Err(ReadError::input(place, "finite values that fit 32-bit floats", found, hint));
    }
    Ok(Grid { origin, axes, dims, values })
}

/// The header, and whether the file is big endian.
fn header(content: &[u8]) -> Result<(NiftiHeader, bool), ReadError> {
    let Some(bytes) = content.get(..HEADER) else {
        let found = format!("{} bytes", content.len());
        return Err(ReadError::input(Place::Byte(0), format!("a header of {HEADER} bytes"), found, HINT));
    };
    let size = [bytes[0], bytes[1], bytes[2], bytes[3]];
    let big_endian = match (i32::from_le_bytes(size), i32::from_be_bytes(size)) {
        (348, _) => false,
        (_, 348) => true,
        (540, _) | (_, 540) => {
            let hint = "save the volume as NIfTI-1";
            return Err(ReadError::input(Place::Byte(0), "a NIfTI-1 header", "a NIfTI-2 header", hint));
        }
        (n, _) => return Err(ReadError::input(Place::Byte(0), "a header size of 348", n.to_string(), HINT)),
    };
    if &bytes[344..348] != b"n+1\0" {
        let hint = "pairs of .hdr and .img are not read; save the volume as one .nii file";
        let found = crate::error::escaped(&bytes[344..348], 4);
        return Err(ReadError::input(
            Place::Byte(344),
            "'n+1', header and voxels in one file",
            format!("'{found}'"),
            hint,
        ));
    }
    let header = NiftiHeader::from_reader(bytes)
        .map_err(|e| ReadError::input(Place::Byte(0), "a NIfTI-1 header", e.to_string(), HINT))?;
    // The crate guesses the byte order from the number of dimensions; it has to agree with the header's size.
    if header.sizeof_hdr != HEADER as i32 {
        return Err(ReadError::input(Place::Byte(40), "1 to 7 dimensions", header.dim[0].to_string(), HINT));
    }
    Ok((header, big_endian))
}

fn dims(header: &NiftiHeader) -> Result<[usize; 3], ReadError> {
    let wrong = |expected: &str| {
        let hint = "extract one 3D volume from the series first";
        Err(ReadError::input(Place::Byte(40), expected, format!("{:?}", header.dim), hint))
    };
    let rank = usize::from(header.dim[0]);
    if !(3..=7).contains(&rank) {
        return wrong("a volume of 3 dimensions");
    }
    if header.dim[1..=rank].iter().any(|d| !(1..=i16::MAX as u16).contains(d)) {
        return wrong("dimensions from 1 to 32767");
    }
    if header.dim[4..=rank.max(3)].iter().any(|d| *d != 1) {
        return wrong("one 3D volume of one value a voxel");
    }
    Ok([1, 2, 3].map(|i| usize::from(header.dim[i])))
}

fn size_of_scalar(kind: NiftiType) -> Option<u64> {
    Some(match kind {
        NiftiType::Uint8 | NiftiType::Int8 => 1,
        NiftiType::Uint16 | NiftiType::Int16 => 2,
        NiftiType::Uint32 | NiftiType::Int32 | NiftiType::Float32 => 4,
        NiftiType::Uint64 | NiftiType::Int64 | NiftiType::Float64 => 8,
        _ => return None,
    })
}

/// The stored voxels, exactly as many as the dimensions say.
fn raw_voxels<'a>(
    content: &'a [u8],
    header: &NiftiHeader,
    dims: [usize; 3],
    kind: NiftiType,
    limits: &ReadLimits,
) -> Result<&'a [u8], ReadError> {
    let offset = header.vox_offset;
    if !(offset >= HEADER as f32 && offset.fract() == 0.0 && offset <= content.len() as f32) {
        let expected = format!("an offset of the voxels from {HEADER} to {}", content.len());
        return Err(ReadError::input(Place::Byte(108), expected, offset.to_string(), HINT));
    }
    let count = dims.iter().fold(1u64, |n, d| n * *d as u64); // below 2^45
    let needed = count * size_of_scalar(kind).unwrap_or(0);
    let stored = content.get(offset as usize..).unwrap_or_default();
    if stored.len() as u64 != needed {
        return Err(ReadError::input(
            Place::Byte(offset as u64),
            format!("{needed} bytes of voxels ({} x {} x {} {kind:?})", dims[0], dims[1], dims[2]),
            format!("{}", stored.len()),
            HINT,
        ));
    }
    input::check_bytes("the voxels", count * size_of::<f32>() as u64, limits)?;
    Ok(stored)
}

/// Slope and intercept, (1, 0) where the file asks for none.
fn scaling(header: &NiftiHeader) -> Result<(f64, f64), ReadError> {
    let (slope, intercept) = (header.scl_slope, header.scl_inter);
    if slope == 0.0 || slope.is_nan() {
        return Ok((1.0, 0.0));
    }
    if slope.is_finite() && intercept.is_finite() {
        return Ok((slope.into(), intercept.into()));
    }
    let found = format!("slope {slope}, intercept {intercept}");
    Err(ReadError::input(Place::Byte(112), "a finite slope and intercept", found, HINT))
}

fn values(raw: &[u8], kind: NiftiType, big_endian: bool, (slope, inter): (f64, f64)) -> Result<Vec<f32>, ReadError> {
    macro_rules! decode {
        ($t:ty) => {
            convert(raw, |b: [u8; size_of::<$t>()]| {
                let stored = if big_endian { <$t>::from_be_bytes(b) } else { <$t>::from_le_bytes(b) };
                (stored as f64 * slope + inter) as f32
            })
        };
    }
    match kind {
        NiftiType::Uint8 => decode!(u8),
        NiftiType::Int8 => decode!(i8),
        NiftiType::Uint16 => decode!(u16),
        NiftiType::Int16 => decode!(i16),
        NiftiType::Uint32 => decode!(u32),
        NiftiType::Int32 => decode!(i32),
        NiftiType::Uint64 => decode!(u64),
        NiftiType::Int64 => decode!(i64),
        NiftiType::Float32 => decode!(f32),
        _ => decode!(f64),
    }
}

fn convert<const N: usize>(raw: &[u8], decode: impl Fn([u8; N]) -> f32 + Sync) -> Result<Vec<f32>, ReadError> {
    let (stored, _) = raw.as_chunks::<N>();
    let mut values = Vec::new();
    input::reserve(&mut values, stored.len())?;
    values.par_extend(stored.par_iter().with_min_len(CHUNK).map(|b| decode(*b)));
    Ok(values)
}

/// World position of voxel (0, 0, 0) and the steps along i, j and k.
fn affine(header: &NiftiHeader) -> (DVec3, DMat3) {
    let size = DVec3::new(header.pixdim[1].into(), header.pixdim[2].into(), header.pixdim[3].into());
    if header.sform_code > 0 {
        let rows = [header.srow_x, header.srow_y, header.srow_z];
        let column = |c: usize| DVec3::from_array(rows.map(|r| f64::from(r[c])));
        return (column(3), DMat3::from_cols(column(0), column(1), column(2)));
    }
    if header.qform_code > 0 {
        let [b, c, d] = [header.quatern_b, header.quatern_c, header.quatern_d].map(f64::from);
        let a = (1.0 - (b * b + c * c + d * d)).max(0.0).sqrt();
        let rotation = DMat3::from_quat(splat_core::glam::DQuat::from_xyzw(b, c, d, a).normalize());
        // pixdim[0] is the handedness: −1 mirrors the third axis.
        let mirror = if header.pixdim[0] < 0.0 { -1.0 } else { 1.0 };
        let axes = rotation * DMat3::from_diagonal(size * DVec3::new(1.0, 1.0, mirror));
        return ([header.quatern_x, header.quatern_y, header.quatern_z].map(f64::from).into(), axes);
    }
    (DVec3::ZERO, DMat3::from_diagonal(size))
}
