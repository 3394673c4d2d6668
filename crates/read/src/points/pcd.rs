//! PCD (Point Cloud Library), text, binary and compressed → raw points.
//!
//! Kept are `x y z`, `normal_x normal_y normal_z`, `rgb` or `rgba`, `intensity` and `opacity`; other fields are named. The
//! parser is our own: counts of a header are checked against the file before anything is allocated, and places down to
//! the column are asked of it. Points without a place, which depth cameras write as NaN where they see nothing, are left
//! out and counted; an infinite coordinate is refused. Zeros behind the last point, up to a whole page, are PCL's own padding.

mod body;
mod columns;
mod header;
mod lzf;

use crate::error::{Place, ReadError};
use crate::reading::Reading;
use crate::stream::input;
use body::{Bytes, Text};
use columns::Columns;
use header::{Data, Header};
use splat_core::RawPoints;

const TRUNCATED: &str = "the file is truncated or damaged; fetch it again";
const LONGER: &str =
    "the header announces fewer points, or smaller ones, than the file holds: mend POINTS, SIZE or COUNT";

/// Reads a PCD file.
pub(crate) fn read(content: &[u8], reading: &mut Reading<'_>) -> Result<RawPoints, ReadError> {
    let header = header::parse(content)?;
    let mut columns = Columns::new(&header, reading)?;
    let body = &content[header.body..];
    match header.data {
        Data::Text => Text::new(content, &header).read(&header, &mut columns, reading)?,
        Data::Binary => {
            let record = header.record();
            let needed = header.bytes()?;
            if !is_padded(body, needed) {
                return Err(other_length(&header, needed, body.len()));
            }
            let layout = header.fields.iter().map(|f| [f.offset, record]).collect();
            Bytes::new(body, header.body, layout).read(&header, &mut columns, reading)?;
        }
        Data::Compressed => {
            let unpacked = unpacked(body, &header, reading)?;
            // One field after the other, each of all points.
            let points = header.points as usize;
            let layout = header.fields.iter().map(|f| [f.offset * points, f.size * f.count]).collect();
            Bytes::new(&unpacked, header.body, layout).read(&header, &mut columns, reading)?;
        }
    }
    columns.into_points(reading)
}

fn other_length(header: &Header, needed: u64, found: usize) -> ReadError {
    let expected = format!("{needed} bytes, {} points of {} each", header.points, header.record());
    let hint = if found as u64 > needed { LONGER } else { TRUNCATED };
    ReadError::input(Place::Byte(header.body as u64), expected, found.to_string(), hint)
}

/// Whether so many bytes are there, with nothing but zeros behind them: PCL fills its files up to whole pages of memory.
fn is_padded(bytes: &[u8], needed: u64) -> bool {
    let padding = usize::try_from(needed).ok().and_then(|needed| bytes.get(needed..));
    padding.is_some_and(|padding| padding.iter().all(|byte| *byte == 0))
}

/// The bytes of all points out of their compressed form: its length, that of the points, then LZF.
fn unpacked(body: &[u8], header: &Header, reading: &Reading<'_>) -> Result<Vec<u8>, ReadError> {
    let at = Place::Byte(header.body as u64);
    let number = |i: usize| body.get(i..)?.first_chunk().map(|b| u64::from(u32::from_le_bytes(*b)));
    let (Some(stored), Some(announced)) = (number(0), number(4)) else {
        return Err(ReadError::input(at, "two lengths of 4 bytes", format!("{} bytes", body.len()), TRUNCATED));
    };
    let needed = header.bytes()?;
    if announced != needed {
        let expected = format!("{needed} bytes unpacked, {} points of {} each", header.points, header.record());
        return Err(ReadError::input(at, expected, announced.to_string(), TRUNCATED));
    }
    let packed = &body[8..];
    if !is_padded(packed, stored) {
        let expected = format!("{stored} bytes, as announced");
        let hint = if packed.len() as u64 > stored { LONGER } else { TRUNCATED };
        return Err(ReadError::input(at, expected, packed.len().to_string(), hint));
    }
    let packed = &packed[..stored as usize];
    // An empty cloud may be written without anything.
    if needed == 0 {
        return Ok(Vec::new());
    }
    if needed > stored.saturating_mul(lzf::MAX_RATIO) {
        let expected = format!("at most {} bytes unpacked from each", lzf::MAX_RATIO);
        return Err(ReadError::input(at, expected, format!("{needed} from {stored}"), TRUNCATED));
    }
    input::hold("the unpacked points", needed, reading.params)?;
    let mut unpacked = Vec::new();
    input::reserve(&mut unpacked, needed as usize)?;
    lzf::unpack(packed, &mut unpacked, needed as usize).map_err(|byte| {
        let place = Place::Byte((header.body + 8 + byte) as u64);
        ReadError::input(place, format!("LZF of {needed} bytes"), "something else", TRUNCATED)
    })?;
    Ok(unpacked)
}
