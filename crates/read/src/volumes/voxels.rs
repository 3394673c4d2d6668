//! Stored voxels of any number type → f32, block by block, so that a volume is not in memory twice.

use super::selection::Selection;
use crate::ReadParams;
use crate::error::{Place, ReadError};
use crate::stream::input::{self, Stream};
use crate::text::Words;
use rayon::prelude::*;

/// Voxels converted by one task.
const CHUNK: usize = 1 << 16;
/// Bytes read at once, about, and the most of one voxel.
const BLOCK: u64 = 8 << 20;
/// What is wrong with a file that has more voxels than were announced.
const LONGER: &str = "the file holds more than its header or its name states: the sizes, the type or the number of frames are other ones";
/// Most numbers in a file.
const MAX_NUMBERS: u64 = 1 << 45;

/// Type of one stored number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
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
    /// Bytes of a number.
    pub(crate) fn size(self) -> u64 {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// The numbers of as many bytes.
    #[cfg(any(feature = "vti", feature = "vtk"))]
    pub(crate) fn numbers(self, bytes: &[u8], big_endian: bool) -> impl Iterator<Item = f64> {
        bytes.chunks_exact(self.size() as usize).map(move |b| {
            let mut le = [0; 8];
            le[..b.len()].copy_from_slice(b);
            if big_endian {
                le[..b.len()].reverse();
            }
            let whole = u64::from_le_bytes(le);
            match self {
                Self::U8 | Self::U16 | Self::U32 | Self::U64 => whole as f64,
                Self::I8 => f64::from(whole as i8),
                Self::I16 => f64::from(whole as i16),
                Self::I32 => f64::from(whole as i32),
                Self::I64 => whole as i64 as f64,
                Self::F32 => f64::from(f32::from_bits(whole as u32)),
                Self::F64 => f64::from_bits(whole),
            }
        })
    }
}

/// How the voxels of a volume are stored.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stored {
    pub(crate) kind: Kind,
    pub(crate) big_endian: bool,
    pub(crate) dims: [u64; 3],
    pub(crate) selection: Selection,
    /// Slope and intercept of the values; (1, 0) for none.
    pub(crate) scaling: (f64, f64),
}

impl Stored {
    /// Refuses sizes whose product is out of reach; the other methods ask for this first.
    pub(crate) fn check(&self, place: Place, hint: &'static str) -> Result<(), ReadError> {
        let Selection { frames, numbers, .. } = self.selection;
        let sizes = self.dims.into_iter().chain([frames, numbers]);
        if sizes.into_iter().try_fold(1u64, |n, s| n.checked_mul(s)).is_none_or(|n| n > MAX_NUMBERS) {
            let found = format!("{:?}, {frames} times, {numbers} numbers each", self.dims);
            return Err(ReadError::input(place, "at most 2^45 voxels", found, hint));
        }
        if self.voxel_bytes() > BLOCK {
            let expected = format!("at most {BLOCK} bytes a voxel");
            return Err(ReadError::input(place, expected, self.voxel_bytes().to_string(), hint));
        }
        Ok(())
    }

    /// Voxels of the volume.
    pub(crate) fn count(&self) -> u64 {
        self.dims.iter().product()
    }

    /// Bytes of one frame.
    fn frame_bytes(&self) -> u64 {
        self.count() * self.voxel_bytes()
    }

    /// Bytes of one voxel.
    fn voxel_bytes(&self) -> u64 {
        self.selection.numbers * self.kind.size()
    }

    /// Bytes of all numbers.
    pub(crate) fn bytes(&self) -> u64 {
        self.frame_bytes() * self.selection.frames
    }

    /// The value of a voxel with these numbers.
    fn value(&self, number: impl Fn(usize) -> f64) -> f32 {
        let value = self.selection.value.evaluate(number);
        match self.scaling {
            (1.0, 0.0) => value as f32,
            (slope, intercept) => (value * slope + intercept) as f32,
        }
    }

    /// Its sizes in words.
    fn shown(&self) -> String {
        let [x, y, z] = self.dims;
        let Selection { frames, numbers, .. } = self.selection;
        let times = |n: u64, what: &str| if n == 1 { String::new() } else { format!(" x {n} {what}") };
        format!("{x} x {y} x {z}{}{}", times(numbers, "numbers"), times(frames, "frames"))
    }
}

/// Reads the voxels, with which the stream has to end; `hint` says what is wrong if it does not.
pub(crate) fn read(
    stream: &mut Stream<'_>,
    stored: &Stored,
    params: &ReadParams,
    hint: &'static str,
) -> Result<Vec<f32>, ReadError> {
    let needed = stored.bytes();
    let at = stream.position();
    let wrong = |found: String, hint: &'static str| {
        let expected = format!("{needed} bytes of voxels ({} x {} bytes)", stored.shown(), stored.kind.size());
        Err(ReadError::input(Place::Byte(at), expected, found, hint))
    };
    if let Some(left) = stream.left().filter(|left| *left != needed) {
        return wrong(left.to_string(), if left > needed { LONGER } else { hint });
    }
    stream.expect(needed)?;
    let mut values = room(stored, params)?;
    let start = stored.frame_bytes() * stored.selection.frame;
    let mut got = stream.skip(start)?;
    if got == start {
        got += frame(stream, stored, &mut values)?;
    }
    // Of the frames behind it only the length matters; one byte more is too much already, however many there are.
    if got == start + stored.frame_bytes() {
        got += stream.skip(needed - got + 1)?;
    }
    match got {
        n if n < needed => return wrong(n.to_string(), hint),
        n if n > needed => return wrong(format!("more than {needed}"), LONGER),
        _ => {}
    }
    check_finite(&values, |i| Place::Byte(at + start + i as u64 * stored.voxel_bytes()))?;
    Ok(values)
}

/// Refuses the first value that is infinite; `place` tells where the value of a rank lies.
pub(crate) fn check_finite(values: &[f32], place: impl Fn(usize) -> Place) -> Result<(), ReadError> {
    let Some(i) = values.par_iter().position_first(|v| v.is_infinite()) else { return Ok(()) };
    let found = format!("{} at voxel {i}", values[i]);
    let hint = "scale the values, or write NaN where there is none: it draws nothing";
    Err(ReadError::input(place(i), "values that fit 32-bit floats", found, hint))
}

/// Reads the voxels behind so many bytes, with which the stream has to end; −1 for whatever comes before.
pub(crate) fn behind(
    mut stream: Stream<'_>,
    skip: i64,
    stored: &Stored,
    params: &ReadParams,
    hint: &'static str,
) -> Result<Vec<f32>, ReadError> {
    if skip == -1 {
        let data = stream.rest()?;
        let Some(start) = (data.len() as u64).checked_sub(stored.bytes()) else {
            let expected = format!("{} bytes of voxels at the end of the data", stored.bytes());
            return Err(ReadError::input(Place::File, expected, format!("{} bytes", data.len()), hint));
        };
        return read(&mut Stream::in_memory(&data[start as usize..], params), stored, params, hint);
    }
    let inside = |n: u64| stream.left().is_none_or(|left| n <= left);
    match u64::try_from(skip).ok().filter(|n| inside(*n)) {
        Some(n) if stream.skip(n)? == n => read(&mut stream, stored, params, hint),
        _ => {
            let expected = "a number of bytes before the voxels, within the data";
            Err(ReadError::input(Place::File, expected, skip.to_string(), hint))
        }
    }
}

/// Room for the values of the volume.
pub(crate) fn room(stored: &Stored, params: &ReadParams) -> Result<Vec<f32>, ReadError> {
    let mut values = Vec::new();
    input::hold("the voxels", stored.count() * size_of::<f32>() as u64, params)?;
    input::reserve(&mut values, stored.count() as usize)?;
    Ok(values)
}

/// Reads one frame; gives how many bytes of it there were.
fn frame(stream: &mut Stream<'_>, stored: &Stored, values: &mut Vec<f32>) -> Result<u64, ReadError> {
    let bytes = stored.frame_bytes();
    let voxel = stored.voxel_bytes();
    let most = (BLOCK / voxel).max(1) * voxel;
    let mut block = vec![0; bytes.min(most) as usize];
    let mut got = 0;
    while got < bytes {
        let part = &mut block[..(bytes - got).min(most) as usize];
        let filled = stream.fill(part)?;
        got += filled as u64;
        if filled < part.len() {
            break;
        }
        append(values, part, stored);
    }
    Ok(got)
}

/// Adds the values of numbers that are stored so.
pub(crate) fn append(values: &mut Vec<f32>, raw: &[u8], stored: &Stored) {
    macro_rules! decode {
        ($t:ty) => {{
            let (numbers, _) = raw.as_chunks::<{ size_of::<$t>() }>();
            let number = |b| if stored.big_endian { <$t>::from_be_bytes(b) } else { <$t>::from_le_bytes(b) };
            match (stored.selection.numbers, stored.scaling) {
                (1, (1.0, 0.0)) => {
                    values.par_extend(numbers.par_iter().with_min_len(CHUNK).map(|b| number(*b) as f32));
                }
                (many, _) => {
                    let voxels = numbers.par_chunks_exact(many as usize).with_min_len(CHUNK);
                    values.par_extend(voxels.map(|voxel| stored.value(|i| number(voxel[i]) as f64)));
                }
            }
        }};
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

/// Reads the voxels from a text, as many as there have to be; `hint` says what is wrong if there are fewer.
pub(crate) fn text(
    words: &mut Words<'_>,
    stored: &Stored,
    params: &ReadParams,
    hint: &'static str,
) -> Result<Vec<f32>, ReadError> {
    let Selection { frames, frame, numbers, .. } = stored.selection;
    let needed = stored.count() * numbers * frames;
    let wrong = |found: usize| {
        let what = if needed == stored.count() { String::new() } else { format!(" ({})", stored.shown()) };
        Err(ReadError::input(Place::File, format!("{needed} voxels{what}"), found.to_string(), hint))
    };
    // A digit and a blank each, but for the last one: the text cannot hold more, whatever the header says.
    if needed > (words.left() as u64).div_ceil(2) {
        return wrong(words.count());
    }
    let mut values = room(stored, params)?;
    let mut voxel = Vec::new();
    for i in 0..needed {
        let Some(word) = words.next() else { return wrong(i as usize) };
        // NaN is a voxel without a value.
        voxel.push(word.decimal().filter(|v| v.is_nan()).map_or_else(|| word.number(), Ok)?);
        if (voxel.len() as u64) < numbers {
            continue;
        }
        if i / (stored.count() * numbers) == frame {
            let value = stored.value(|i| voxel[i]);
            if value.is_infinite() {
                let expected = "a value that fits a 32-bit float";
                return Err(ReadError::input(word.place(), expected, word.shown(), "scale the values"));
            }
            values.push(value);
        }
        voxel.clear();
    }
    Ok(values)
}

/// The same of a text in which nothing else follows.
pub(crate) fn whole_text(
    mut words: Words<'_>,
    stored: &Stored,
    params: &ReadParams,
    hint: &'static str,
) -> Result<Vec<f32>, ReadError> {
    let values = text(&mut words, stored, params, hint)?;
    match words.next() {
        None => Ok(values),
        Some(word) => Err(ReadError::input(word.place(), "the end of the voxels", word.shown(), LONGER)),
    }
}
