//! NIfTI-1 and NIfTI-2 in one file (`.nii`, `.nii.gz`) → a volume of scalars in the file's world coordinates (millimetres mostly), of a series
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

/// Bytes of a header of NIfTI-1 and of NIfTI-2.
const HEADER: usize = 348;
const LONG_HEADER: usize = 540;
const HINT: &str = "the file is truncated, damaged or not NIfTI; a Radiance image of this name begins with '#?'";

/// Most voxels along a dimension of NIfTI-2; its numbers have 64 bits.
const LONGEST: i64 = i32::MAX as i64;

/// What a header says, of either version.
struct Header {
    big_endian: bool,
    /// Number of dimensions, and their sizes.
    dim: [i64; 8],
    datatype: i16,
    /// Handedness, and voxel sizes.
    pixdim: [f64; 8],
    /// First byte of the voxels.
    offset: f64,
    slope: f64,
    intercept: f64,
    has_qform: bool,
    has_sform: bool,
    /// The rotation as b, c and d of a quaternion, and the place of the first voxel.
    quaternion: [f64; 3],
    shift: [f64; 3],
    /// The matrix row by row.
    rows: [[f64; 4]; 3],
    places: Places,
}

/// Where the fields stand that are refused.
#[derive(Clone, Copy)]
struct Places {
    /// Bytes of the header.
    end: usize,
    dim: u64,
    datatype: u64,
    offset: u64,
    slope: u64,
    affine: u64,
}

const PLACES: Places = Places { end: HEADER, dim: 40, datatype: 70, offset: 108, slope: 112, affine: 252 };
const LONG_PLACES: Places = Places { end: LONG_HEADER, dim: 16, datatype: 12, offset: 168, slope: 176, affine: 344 };

/// Reads a volume.
pub(crate) fn read(mut stream: Stream<'_>, params: &ReadParams, notes: &mut Notes) -> Result<Grid, ReadError> {
    let header = header(stream.peek(LONG_HEADER)?)?;
    let places = header.places;
    let (dims, frames) = dims(&header)?;
    let kind = NiftiHeader { datatype: header.datatype, ..NiftiHeader::default() }.data_type().ok();
    let (kind, numbers) = kind.and_then(numbers).ok_or_else(|| {
        let expected =
            "a datatype of real scalars or colours: 8- to 64-bit integers, 32- or 64-bit floats, RGB24, RGBA32";
        let found = format!("code {}", header.datatype);
        ReadError::input(Place::Byte(places.datatype), expected, found, "convert the volume first")
    })?;
    let selection = Selection::of_frames(frames, Place::Byte(places.dim), params, notes)?.with_numbers(
        numbers,
        kind,
        true,
        Place::Byte(places.datatype),
        notes,
    )?;
    // The standard scales no colours.
    let scaling = if numbers == 1 { scaling(&header)? } else { (1.0, 0.0) };
    let big_endian = header.big_endian;
    let stored = Stored { kind, big_endian, dims: dims.map(|n| n as u64), selection, scaling };
    stored.check(Place::Byte(places.dim), HINT)?;
    to_voxels(&mut stream, &header)?;
    let (origin, axes) = affine(&header);
    lattice::check(origin, &axes, Place::Byte(places.affine), HINT)?;
    let values = voxels::read(&mut stream, &stored, params, HINT)?;
    Ok(Grid { origin, axes, dims, values })
}

/// The header of either version.
fn header(content: &[u8]) -> Result<Header, ReadError> {
    let Some(size) = content.first_chunk().filter(|_| content.len() >= HEADER) else {
        let found = format!("{} bytes", content.len());
        return Err(ReadError::input(Place::Byte(0), format!("a header of {HEADER} bytes"), found, HINT));
    };
    match (i32::from_le_bytes(*size), i32::from_be_bytes(*size)) {
        (348, _) => short_header(content, false),
        (_, 348) => short_header(content, true),
        (540, _) => long_header(content, false),
        (_, 540) => long_header(content, true),
        (n, _) => Err(ReadError::input(Place::Byte(0), "a header size of 348 or 540", n.to_string(), HINT)),
    }
}

/// Refuses a header whose voxels lie in another file.
fn check_mark(found: &[u8], needed: &[u8], byte: u64) -> Result<(), ReadError> {
    if found == needed {
        return Ok(());
    }
    let hint = "pairs of .hdr and .img are not read; save the volume as one .nii file";
    let expected = format!("'{}', header and voxels in one file", String::from_utf8_lossy(&needed[..3]));
    let found = format!("'{}'", splat_core::text::escaped(found, 8));
    Err(ReadError::input(Place::Byte(byte), expected, found, hint))
}

/// The header of NIfTI-1.
fn short_header(content: &[u8], big_endian: bool) -> Result<Header, ReadError> {
    let bytes = &content[..HEADER];
    check_mark(&bytes[344..348], b"n+1\0", 344)?;
    let header = NiftiHeader::from_reader(bytes)
        .map_err(|e| ReadError::input(Place::Byte(0), "a NIfTI-1 header", e.to_string(), HINT))?;
    // The crate guesses the byte order from the number of dimensions; it has to agree with the header's size.
    if header.sizeof_hdr != HEADER as i32 {
        return Err(ReadError::input(Place::Byte(40), "1 to 7 dimensions", header.dim[0].to_string(), HINT));
    }
    Ok(Header {
        big_endian,
        dim: header.dim.map(|n| i64::from(n.cast_signed())),
        datatype: header.datatype,
        pixdim: header.pixdim.map(f64::from),
        offset: header.vox_offset.into(),
        slope: header.scl_slope.into(),
        intercept: header.scl_inter.into(),
        has_qform: header.qform_code > 0,
        has_sform: header.sform_code > 0,
        quaternion: [header.quatern_b, header.quatern_c, header.quatern_d].map(f64::from),
        shift: [header.quatern_x, header.quatern_y, header.quatern_z].map(f64::from),
        rows: [header.srow_x, header.srow_y, header.srow_z].map(|row| row.map(f64::from)),
        places: PLACES,
    })
}

/// The header of NIfTI-2.
fn long_header(content: &[u8], big_endian: bool) -> Result<Header, ReadError> {
    let Some(bytes) = content.first_chunk::<LONG_HEADER>() else {
        let found = format!("{} bytes", content.len());
        return Err(ReadError::input(Place::Byte(0), format!("a header of {LONG_HEADER} bytes"), found, HINT));
    };
    check_mark(&bytes[4..12], b"n+2\0\r\n\x1a\n", 4)?;
    let wide = |start: usize| -> [u8; 8] {
        let mut little: [u8; 8] = std::array::from_fn(|i| bytes[start + i]);
        if big_endian {
            little.reverse();
        }
        little
    };
    let whole = |start: usize| i64::from_le_bytes(wide(start));
    let number = |start: usize| f64::from_le_bytes(wide(start));
    let code = |start: usize| {
        let four = [0, 1, 2, 3].map(|i| bytes[start + i]);
        if big_endian { i32::from_be_bytes(four) } else { i32::from_le_bytes(four) }
    };
    let datatype = [bytes[12], bytes[13]];
    let row = |start: usize| [0, 1, 2, 3].map(|i| number(start + 8 * i));
    Ok(Header {
        big_endian,
        dim: std::array::from_fn(|i| whole(16 + 8 * i)),
        datatype: if big_endian { i16::from_be_bytes(datatype) } else { i16::from_le_bytes(datatype) },
        pixdim: std::array::from_fn(|i| number(104 + 8 * i)),
        // What is beyond 2^53 is beyond every file.
        offset: whole(168) as f64,
        slope: number(176),
        intercept: number(184),
        has_qform: code(344) > 0,
        has_sform: code(348) > 0,
        quaternion: [352, 360, 368].map(number),
        shift: [376, 384, 392].map(number),
        rows: [400, 432, 464].map(row),
        places: LONG_PLACES,
    })
}

/// Sizes of a volume, and how many there are.
fn dims(header: &Header) -> Result<([usize; 3], u64), ReadError> {
    let wrong = |expected: &str| {
        let hint = "write one volume of scalars, or a series of them in four dimensions";
        Err(ReadError::input(Place::Byte(header.places.dim), expected, format!("{:?}", header.dim), hint))
    };
    let longest = if header.places.end == HEADER { i64::from(i16::MAX) } else { LONGEST };
    let Some(rank) = usize::try_from(header.dim[0]).ok().filter(|rank| (3..=7).contains(rank)) else {
        return wrong("a volume of 3 dimensions");
    };
    if header.dim[1..=rank].iter().any(|d| !(1..=longest).contains(d)) {
        return wrong(&format!("dimensions from 1 to {longest}"));
    }
    if header.dim.iter().take(rank + 1).skip(5).any(|d| *d != 1) {
        return wrong("3D volumes of one value a voxel");
    }
    let frames = if rank > 3 { header.dim[4] } else { 1 };
    Ok(([1, 2, 3].map(|i| header.dim[i] as usize), frames as u64))
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
fn to_voxels(stream: &mut Stream<'_>, header: &Header) -> Result<(), ReadError> {
    let Header { offset, places, .. } = *header;
    let whole = offset >= places.end as f64 && offset.fract() == 0.0;
    let inside = stream.left().is_none_or(|left| offset <= left as f64);
    if whole && inside && stream.skip(offset as u64)? == offset as u64 {
        return Ok(());
    }
    let expected = format!("an offset of the voxels from {} to the end of the file", places.end);
    Err(ReadError::input(Place::Byte(places.offset), expected, offset.to_string(), HINT))
}

/// Slope and intercept, (1, 0) where the file asks for none.
fn scaling(header: &Header) -> Result<(f64, f64), ReadError> {
    let Header { slope, intercept, .. } = *header;
    if slope == 0.0 || slope.is_nan() {
        return Ok((1.0, 0.0));
    }
    if slope.is_finite() && intercept.is_finite() {
        return Ok((slope, intercept));
    }
    let found = format!("slope {slope}, intercept {intercept}");
    Err(ReadError::input(Place::Byte(header.places.slope), "a finite slope and intercept", found, HINT))
}

/// World position of voxel (0, 0, 0) and the steps along i, j and k.
fn affine(header: &Header) -> (DVec3, DMat3) {
    let size = DVec3::new(header.pixdim[1], header.pixdim[2], header.pixdim[3]);
    if header.has_sform {
        let column = |c: usize| DVec3::from_array(header.rows.map(|row| row[c]));
        return (column(3), DMat3::from_cols(column(0), column(1), column(2)));
    }
    if header.has_qform {
        let [b, c, d] = header.quaternion;
        let a = (1.0 - (b * b + c * c + d * d)).max(0.0).sqrt();
        let rotation = DMat3::from_quat(splat_core::glam::DQuat::from_xyzw(b, c, d, a).normalize());
        // pixdim[0] is the handedness: −1 mirrors the third axis.
        let mirror = if header.pixdim[0] < 0.0 { -1.0 } else { 1.0 };
        let axes = rotation * DMat3::from_diagonal(size * DVec3::new(1.0, 1.0, mirror));
        return (header.shift.into(), axes);
    }
    (DVec3::ZERO, DMat3::from_diagonal(size))
}
