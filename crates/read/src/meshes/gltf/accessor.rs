//! Buffers, and the numbers that accessors find in them.

use super::document::{Accessor, Document, Stored};
use super::{HINT, wrong};
use crate::error::ReadError;
use crate::reading::Reading;
use crate::stream::beside::{self, Beside};
use crate::stream::input::{self, Content};
use splat_core::Reservation;
use std::borrow::Cow;

const I8: u32 = 5120;
const U8: u32 = 5121;
const I16: u32 = 5122;
const U16: u32 = 5123;
const U32: u32 = 5125;
const F32: u32 = 5126;

/// The bytes that the description speaks of.
pub(super) struct Buffers<'a> {
    document: &'a Document,
    bytes: Vec<Cow<'a, [u8]>>,
    /// Bytes of all of them.
    total: u64,
    /// Memory of those that were fetched.
    held: Vec<Reservation>,
}

/// Numbers of an accessor as they lie in its buffer.
struct View<'a> {
    bytes: &'a [u8],
    stride: usize,
    size: usize,
    kind: u32,
}

impl<'a> Buffers<'a> {
    /// Fetches all buffers: those of the file, those written into its description, and files in its folder.
    pub(super) fn load(
        document: &'a Document,
        binary: Option<&'a [u8]>,
        beside: &Beside<'_>,
        reading: &Reading<'_>,
    ) -> Result<Self, ReadError> {
        let mut buffers = Self { document, bytes: Vec::new(), total: 0, held: Vec::new() };
        for (i, buffer) in document.buffers.iter().enumerate() {
            reading.go_on()?;
            let mut bytes = match (&buffer.uri, binary) {
                (None, Some(binary)) if i == 0 => Cow::Borrowed(binary),
                (None, _) => return Err(wrong(format!("bytes of buffer {i}"), "neither a chunk nor a uri".into())),
                (Some(uri), _) => {
                    let (fetched, held) = fetch(uri, &format!("buffer {i}"), beside, reading)?.into_parts();
                    buffers.held.push(held);
                    Cow::Owned(fetched)
                }
            };
            if bytes.len() < buffer.byte_length {
                let expected = format!("buffer {i} of {} bytes", buffer.byte_length);
                return Err(wrong(expected, format!("{} bytes", bytes.len())));
            }
            match &mut bytes {
                Cow::Borrowed(all) => *all = &all[..buffer.byte_length],
                Cow::Owned(all) => all.truncate(buffer.byte_length),
            }
            buffers.total += bytes.len() as u64;
            buffers.bytes.push(bytes);
        }
        Ok(buffers)
    }

    /// The bytes of a view.
    pub(super) fn view(&self, index: usize) -> Result<&[u8], ReadError> {
        let views = &self.document.buffer_views;
        let view = views.get(index).ok_or_else(|| missing("buffer view", index, views.len()))?;
        let buffer = self.bytes.get(view.buffer).ok_or_else(|| missing("buffer", view.buffer, self.bytes.len()))?;
        let bytes = buffer.get(view.byte_offset..).and_then(|rest| rest.get(..view.byte_length));
        bytes.ok_or_else(|| {
            let found = format!("{} bytes from byte {} on", view.byte_length, view.byte_offset);
            wrong(format!("buffer view {index} within the {} bytes of its buffer", buffer.len()), found)
        })
    }

    fn accessor(&self, index: usize) -> Result<&'a Accessor, ReadError> {
        let accessors = &self.document.accessors;
        accessors.get(index).ok_or_else(|| missing("accessor", index, accessors.len()))
    }

    /// Entries that the accessor says that it has; none of one that is not there, or of which its reader says that the file cannot have as
    /// many.
    pub(super) fn count(&self, index: usize) -> u64 {
        let count = self.document.accessors.get(index).map_or(0, |accessor| accessor.count as u64);
        if input::check_packed(count, self.total, "glTF").is_ok() { count } else { 0 }
    }

    /// Numbers an entry of the accessor has.
    pub(super) fn width(&self, index: usize) -> Result<usize, ReadError> {
        match self.accessor(index)?.shape.as_str() {
            "SCALAR" => Ok(1),
            "VEC2" => Ok(2),
            "VEC3" => Ok(3),
            "VEC4" => Ok(4),
            _ => Err(wrong(format!("accessor {index} of SCALAR, VEC2, VEC3 or VEC4"), "another type".into())),
        }
    }

    /// Vectors of N numbers, integers scaled to [−1, 1] or [0, 1] where the accessor says so.
    pub(super) fn vectors<const N: usize>(
        &self,
        index: usize,
        what: &str,
        reading: &Reading<'_>,
    ) -> Result<Vec<[f32; N]>, ReadError> {
        let accessor = self.accessor(index)?;
        if self.width(index)? != N || accessor.component_type == U32 {
            let expected = format!("{N} floats or small integers an entry of {what} (accessor {index})");
            return Err(wrong(expected, format!("{} of type {}", shown(&accessor.shape), accessor.component_type)));
        }
        let scale = if accessor.normalized { normalized(accessor.component_type) } else { 1.0 };
        let number = |bytes: &[u8], kind| {
            let value = stored(bytes, kind);
            if scale == 1.0 { value } else { (value / scale).max(-1.0) }
        };
        let vector = |view: &View<'_>, i: usize| {
            std::array::from_fn(|n| number(&view.bytes[i * view.stride + n * view.size / N..], view.kind) as f32)
        };
        self.entries(index, N, vector, [0.0; N], reading)
    }

    /// Whole numbers, of vertices.
    pub(super) fn indices(&self, index: usize, reading: &Reading<'_>) -> Result<Vec<u32>, ReadError> {
        let accessor = self.accessor(index)?;
        if self.width(index)? != 1 || !matches!(accessor.component_type, U8 | U16 | U32) {
            let expected = format!("whole numbers of vertices in accessor {index}");
            return Err(wrong(expected, format!("{} of type {}", shown(&accessor.shape), accessor.component_type)));
        }
        self.entries(index, 1, |view, i| stored(&view.bytes[i * view.stride..], view.kind) as u32, 0, reading)
    }

    /// All entries of an accessor, the sparse ones in the place of others.
    fn entries<T: Copy>(
        &self,
        index: usize,
        width: usize,
        entry: impl Fn(&View<'_>, usize) -> T,
        zero: T,
        reading: &Reading<'_>,
    ) -> Result<Vec<T>, ReadError> {
        reading.go_on()?;
        let accessor = self.accessor(index)?;
        let count = accessor.count;
        let kind = accessor.component_type;
        let bytes = (count as u64).saturating_mul(size_of::<T>() as u64);
        let mut entries = Vec::new();
        if let Some(view) = accessor.buffer_view {
            let what = format!("accessor {index}");
            let view = self.strided(view, accessor.byte_offset, count, width, kind, &what)?;
            input::check_bytes("an accessor", bytes, reading.params)?;
            input::reserve(&mut entries, count)?;
            entries.extend((0..count).map(|i| entry(&view, i)));
        } else if accessor.sparse.is_none() {
            return Err(wrong(format!("a buffer view of accessor {index}"), "none".into()));
        } else {
            // Zeros, of which nothing in the file tells that they are so many.
            input::check_packed(bytes, self.total, "glTF")?;
            input::check_bytes("an accessor", bytes, reading.params)?;
            input::reserve(&mut entries, count)?;
            entries.resize(count, zero);
        }
        let Some(sparse) = &accessor.sparse else { return Ok(entries) };
        let Stored { buffer_view, byte_offset, component_type } = sparse.indices;
        let what = format!("the sparse indices of accessor {index}");
        if !matches!(component_type, U8 | U16 | U32) {
            return Err(wrong(format!("whole numbers as {what}"), format!("type {component_type}")));
        }
        let places = self.strided(buffer_view, byte_offset, sparse.count, 1, component_type, &what)?;
        let what = format!("the sparse values of accessor {index}");
        let values = &sparse.values;
        let values = self.strided(values.buffer_view, values.byte_offset, sparse.count, width, kind, &what)?;
        for i in 0..sparse.count {
            let place = stored(&places.bytes[i * places.stride..], places.kind) as usize;
            let target = entries.get_mut(place).ok_or_else(|| missing("entry of a sparse accessor", place, count))?;
            *target = entry(&values, i);
        }
        Ok(entries)
    }

    /// `count` entries of `width` numbers from a byte of a view on, all of them inside it.
    fn strided(
        &self,
        view: usize,
        offset: usize,
        count: usize,
        width: usize,
        kind: u32,
        what: &str,
    ) -> Result<View<'_>, ReadError> {
        let size = width
            * size_of_kind(kind).ok_or_else(|| wrong(format!("a type of numbers of {what}"), kind.to_string()))?;
        let stride = self.document.buffer_views.get(view).and_then(|v| v.byte_stride).unwrap_or(size);
        let bytes = self.view(view)?;
        let needed = count.checked_sub(1).map_or(Some(0), |n| n.checked_mul(stride)?.checked_add(size));
        let rest = bytes.get(offset..).filter(|rest| needed.is_some_and(|n| n <= rest.len()) && stride >= size);
        rest.map(|bytes| View { bytes, stride, size, kind }).ok_or_else(|| {
            let found = format!("{count} of {size} bytes, {stride} apart, from byte {offset} on");
            wrong(format!("{what} within the {} bytes of buffer view {view}", bytes.len()), found)
        })
    }
}

/// The bytes that a uri stands for: base64 in itself, or a file in the folder of the description.
pub(super) fn fetch(uri: &str, what: &str, beside: &Beside<'_>, reading: &Reading<'_>) -> Result<Content, ReadError> {
    use base64::Engine as _;
    use base64::engine::general_purpose::STANDARD;
    let Some(data) = uri.strip_prefix("data:") else {
        return beside.open(&beside::from_uri(uri), what, reading.params)?.rest();
    };
    let encoded = data.split_once(";base64,").map(|(_, encoded)| encoded);
    let encoded = encoded.ok_or_else(|| wrong(format!("base64 in the uri of {what}"), "another encoding".into()))?;
    let held = reading.params.memory.take(what, encoded.len() as u64)?;
    let mut bytes = Vec::new();
    input::reserve(&mut bytes, encoded.len())?;
    let decoded = STANDARD.decode_vec(encoded, &mut bytes);
    decoded.map_err(|e| wrong(format!("base64 in the uri of {what}"), e.to_string()))?;
    Ok(Content::new(bytes, held))
}

pub(super) fn missing(what: &str, index: usize, count: usize) -> ReadError {
    ReadError::input(crate::error::Place::File, format!("a {what} below {count}"), index.to_string(), HINT)
}

fn shown(shape: &str) -> String {
    splat_core::text::escaped(shape.as_bytes(), 10)
}

fn size_of_kind(kind: u32) -> Option<usize> {
    match kind {
        I8 | U8 => Some(1),
        I16 | U16 => Some(2),
        U32 | F32 => Some(4),
        _ => None,
    }
}

/// What stands for 1.
fn normalized(kind: u32) -> f64 {
    match kind {
        I8 => 127.0,
        U8 => 255.0,
        I16 => 32_767.0,
        U16 => 65_535.0,
        _ => 1.0,
    }
}

/// The number at the beginning of `bytes`, which are checked to be enough.
fn stored(bytes: &[u8], kind: u32) -> f64 {
    let four = |n: usize| {
        let mut wide = [0; 4];
        wide[..n].copy_from_slice(&bytes[..n]);
        u32::from_le_bytes(wide)
    };
    match kind {
        I8 => f64::from(four(1) as u8 as i8),
        U8 => f64::from(four(1)),
        I16 => f64::from(four(2) as u16 as i16),
        U16 => f64::from(four(2)),
        U32 => f64::from(four(4)),
        _ => f64::from(f32::from_bits(four(4))),
    }
}
