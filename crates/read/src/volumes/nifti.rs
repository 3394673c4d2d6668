//! NIfTI-1 in one file (`.nii`, `.nii.gz`) → a volume of scalars in the file's world coordinates (millimetres mostly), of a series
//! one frame, of colours their luma.
//!
//! Affine: sform if its code is positive, else qform, else the voxel size alone (NIfTI-1 methods 3, 2 and 1).
//! Values: stored · scl_slope + scl_inter, as they are where the slope is 0 or NaN.

use super::lattice;
use super::selection::Selection;
use super::voxels::{self, Kind, Stored};
use crate::error::{Place, ReadError};
use crate::stream::input::Stream;
use crate::{Notes, ReadParams};
use ::nifti::{NiftiHeader, NiftiType};
use splat_core::Grid;
use splat_core::glam::{DMat3, DVec3};

const HEADER: usize = 348;
const HINT: &str = "the file is truncated, damaged or not NIfTI-1; a Radiance image of this name begins with '#?'";

/// Reads a volume.
pub(crate) fn read(mut stream: Stream<'_>, params: &ReadParams, notes: &mut Notes) -> Result<Grid, ReadError> {
    let (header, big_endian) = header(stream.peek(HEADER)?)?;
    let (dims, frames) = dims(&header)?;
    let (kind, numbers) = header.data_type().ok().and_then(numbers).ok_or_else(|| {
        let expected =
            "a datatype of real scalars or colours: 8- to 64-bit integers, 32- or 64-bit floats, RGB24, RGBA32";
        ReadError::input(Place::Byte(70), expected, format!("code {}", header.datatype), "convert the volume first")
    })?;
    let selection = Selection::of_frames(frames, Place::Byte(40), params, notes)?.with_numbers(
        numbers,
        kind,
        true,
        Place::Byte(70),
        notes,
    )?;
    // The standard scales no colours.
    let scaling = if numbers == 1 { scaling(&header)? } else { (1.0, 0.0) };
    let stored = Stored { kind, big_endian, dims: dims.map(|n| n as u64), selection, scaling };
    stored.check(Place::Byte(40), HINT)?;
    to_voxels(&mut stream, header.vox_offset)?;
    let (origin, axes) = affine(&header);
    lattice::check(origin, &axes, Place::Byte(252), HINT)?;
    let values = voxels::read(&mut stream, &stored, params, HINT)?;
    Ok(Grid { origin, axes, dims, values })
}

/// The header, and whether the file is big endian.
fn header(content: &[u8]) -> Result<(NiftiHeader, bool), ReadError> {
    let Some(bytes) = content.first_chunk::<HEADER>() else {
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
        let found = splat_core::text::escaped(&bytes[344..348], 4);
        return Err(ReadError::input(
            Place::Byte(344),
            "'n+1', header and voxels in one file",
            format!("'{found}'"),
            hint,
        ));
    }
    let header = NiftiHeader::from_reader(bytes.as_slice())
        .map_err(|e| ReadError::input(Place::Byte(0), "a NIfTI-1 header", e.to_string(), HINT))?;
    // The crate guesses the byte order from the number of dimensions; it has to agree with the header's size.
    if header.sizeof_hdr != HEADER as i32 {
        return Err(ReadError::input(Place::Byte(40), "1 to 7 dimensions", header.dim[0].to_string(), HINT));
    }
    Ok((header, big_endian))
}

/// Sizes of a volume, and how many there are.
fn dims(header: &NiftiHeader) -> Result<([usize; 3], u64), ReadError> {
    let wrong = |expected: &str| {
        let hint = "write one volume of scalars, or a series of them in four dimensions";
        Err(ReadError::input(Place::Byte(40), expected, format!("{:?}", header.dim), hint))
    };
    let rank = usize::from(header.dim[0]);
    if !(3..=7).contains(&rank) {
        return wrong("a volume of 3 dimensions");
    }
    if header.dim[1..=rank].iter().any(|d| !(1..=i16::MAX as u16).contains(d)) {
        return wrong("dimensions from 1 to 32767");
    }
    if header.dim.iter().take(rank + 1).skip(5).any(|d| *d != 1) {
        return wrong("3D volumes of one value a voxel");
    }
    let frames = if rank > 3 { header.dim[4] } else { 1 };
    Ok(([1, 2, 3].map(|i| usize::from(header.dim[i])), frames.into()))
}

/// The numbers of a voxel: their type, and how many there are.
fn numbers(kind: NiftiType) -> Option<(Kind, u64)> {
    let scalar = match kind {
        NiftiType::Rgb24 => return Some((Kind::U8, 3)),
        NiftiType::Rgba32 => return Some((Kind::U8, 4)),
        NiftiType::Uint8 => Kind::U8,
        NiftiType::Int8 => Kind::I8,
        NiftiType::Uint16 => Kind::U16,
        NiftiType::Int16 => Kind::I16,
        NiftiType::Uint32 => Kind::U32,
        NiftiType::Int32 => Kind::I32,
        NiftiType::Uint64 => Kind::U64,
        NiftiType::Int64 => Kind::I64,
        NiftiType::Float32 => Kind::F32,
        NiftiType::Float64 => Kind::F64,
        _ => return None,
    };
    Some((scalar, 1))
}

/// Passes over the header and what may follow it before the voxels.
fn to_voxels(stream: &mut Stream<'_>, offset: f32) -> Result<(), ReadError> {
    let whole = offset >= HEADER as f32 && offset.fract() == 0.0;
    let inside = stream.left().is_none_or(|left| f64::from(offset) <= left as f64);
    if whole && inside && stream.skip(offset as u64)? == offset as u64 {
        return Ok(());
    }
    let expected = format!("an offset of the voxels from {HEADER} to the end of the file");
    Err(ReadError::input(Place::Byte(108), expected, offset.to_string(), HINT))
}

/// Slope and intercept, (1, 0) where the file asks for none.
fn scaling(header: &NiftiHeader) -> Result<(f64, f64), ReadError> {
    let slope = header.scl_slope;
    let intercept = header.scl_inter;
    if slope == 0.0 || slope.is_nan() {
        return Ok((1.0, 0.0));
    }
    if slope.is_finite() && intercept.is_finite() {
        return Ok((slope.into(), intercept.into()));
    }
    let found = format!("slope {slope}, intercept {intercept}");
    Err(ReadError::input(Place::Byte(112), "a finite slope and intercept", found, HINT))
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
