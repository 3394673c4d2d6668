//! The pages of an E57 file: each ends with the sum of its bytes, and what they hold is one run of bytes.

use super::damaged;
use crate::error::ReadError;
use crate::reading::Reading;
use crate::stream::input::{self, Content};
use rayon::prelude::*;
use splat_core::Reservation;

/// Bytes of the header of the file.
const HEADER: usize = 48;
/// Bytes of the sum at the end of a page.
const SUM: usize = 4;
/// Sizes of pages that are taken; writers write 1024.
const SIZES: std::ops::RangeInclusive<usize> = 64..=1 << 20;
/// Bytes that a byte of the description takes as a tree, at most.
const DESCRIBED: u64 = 16;
/// Pages that one task checks.
const TASK: usize = 64;

/// The bytes of all pages, without the sums.
pub(super) struct Pages {
    bytes: Vec<u8>,
    /// Bytes of a page with its sum.
    size: usize,
    /// Where the description lies in the bytes.
    pub(super) description: std::ops::Range<usize>,
    /// For as long as the bytes are there.
    _held: Reservation,
}

impl Pages {
    /// Checks the header and the sums of a file.
    pub(super) fn new(content: Content, reading: &Reading<'_>) -> Result<Self, ReadError> {
        let (mut content, held) = content.into_parts();
        let Some(header) = content.first_chunk::<HEADER>() else {
            return Err(damaged(0, format!("a header of {HEADER} bytes"), format!("{} bytes", content.len())));
        };
        let number = |at: usize| header[at..at + 8].iter().rev().fold(0, |n, b| n << 8 | u64::from(*b));
        let version = number(8);
        if version != 1 {
            let found = format!("{}.{}", version & 0xffff_ffff, version >> 32);
            return Err(damaged(8, "version 1.0 of E57", found));
        }
        let [length, place, description] = [number(16), number(24), number(32)];
        if length != content.len() as u64 {
            return Err(damaged(16, format!("{length} bytes, as the header says"), content.len().to_string()));
        }
        let size = usize::try_from(number(40)).ok().filter(|size| SIZES.contains(size));
        let size = size.filter(|size| content.len().is_multiple_of(*size)).ok_or_else(|| {
            let expected = format!("pages of {} to {} bytes that fill the file", SIZES.start(), SIZES.end());
            damaged(40, expected, number(40).to_string())
        })?;
        let wrong = content.par_chunks(size).with_min_len(TASK).position_first(|page| {
            let (bytes, sum) = page.split_at(size - SUM);
            checksum(bytes).to_be_bytes() != sum
        });
        if let Some(page) = wrong {
            return Err(damaged((page * size) as u64, "a page with the sum at its end", "another sum"));
        }
        reading.go_on()?;
        let pages = content.len() / size;
        for page in 1..pages {
            content.copy_within(page * size..(page + 1) * size - SUM, page * (size - SUM));
        }
        content.truncate(pages * (size - SUM));
        let mut file = Self { bytes: content, size, description: 0..0, _held: held };
        let start = file.place(place, 24)?;
        let end = usize::try_from(description).ok().and_then(|n| start.checked_add(n));
        let end = end.filter(|end| *end <= file.bytes.len());
        let left = file.bytes.len() - start;
        file.description = start
            ..end.ok_or_else(|| {
                damaged(32, format!("a description of at most {left} bytes"), description.to_string())
            })?;
        input::hold("the description", description.saturating_mul(DESCRIBED), reading.params)?;
        Ok(file)
    }

    /// Where among the bytes a place of the file lies, which is told of at a byte of it.
    pub(super) fn place(&self, byte: u64, told: u64) -> Result<usize, ReadError> {
        let place = usize::try_from(byte).ok().map(|byte| (byte / self.size, byte % self.size));
        let place =
            place.filter(|(page, within)| *within < self.size - SUM && *page < self.bytes.len() / (self.size - SUM));
        let place = place.map(|(page, within)| page * (self.size - SUM) + within);
        place.ok_or_else(|| damaged(told, "a place in a page of the file", byte.to_string()))
    }

    /// Where one of the bytes lies in the file.
    pub(super) fn byte(&self, at: usize) -> u64 {
        (at + at / (self.size - SUM) * SUM) as u64
    }

    pub(super) fn bytes(&self) -> &[u8] {
        &self.bytes
    }
}

/// Sums of single bytes: CRC-32C, G. Castagnoli et al. 1993, in its reflected form.
const TABLE: [u32; 256] = {
    let mut table = [0; 256];
    let mut byte = 0;
    while byte < 256 {
        let mut sum = byte as u32;
        let mut bit = 0;
        while bit < 8 {
            sum = if sum & 1 == 1 { sum >> 1 ^ 0x82f6_3b78 } else { sum >> 1 };
            bit += 1;
        }
        table[byte] = sum;
        byte += 1;
    }
    table
};

fn checksum(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0, |sum, byte| TABLE[(sum as u8 ^ byte) as usize] ^ sum >> 8)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The check value of the CRC catalogue.
    #[test]
    fn the_sum_is_that_of_castagnoli() {
        assert_eq!(checksum(b"123456789"), 0xe306_9283);
    }
}
