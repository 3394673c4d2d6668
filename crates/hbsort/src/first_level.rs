//! Step 2 (Figure 9): every chunk of the input is distributed into the first-level buckets.
//!
//! Each chunk has separate buckets, side by side in its part of the entries. So chunks share no data, and all writes
//! stay in the cache. A bucket of the whole is the concatenation of the chunks' buckets in the order of the chunks;
//! it never moves.

use crate::scratch::CHUNK;
use crate::slicing::Slicing;
use rayon::prelude::*;
use splat_core::Direction;

/// Most first-level buckets, that of the culled not counted.
pub(crate) const MOST_BUCKETS: usize = 2047;

/// The distributed chunks.
#[derive(Clone, Copy)]
pub(crate) struct Distributed<'a, E> {
    /// Entries, each chunk's in its own [`CHUNK`].
    pub(crate) entries: &'a [E],
    /// For each chunk where its buckets begin, and where the last one ends: one row of `buckets + 1`.
    pub(crate) rows: &'a [u32],
    pub(crate) buckets: usize,
}

impl<'a, E> Distributed<'a, E> {
    /// The parts of bucket `b`, each with the input place where its chunk begins.
    #[inline(always)]
    pub(crate) fn parts(self, b: usize) -> impl Iterator<Item = (u32, &'a [E])> {
        self.rows.chunks_exact(self.buckets + 1).enumerate().map(move |(c, row)| {
            let begin = c * CHUNK;
            (begin as u32, &self.entries[begin + row[b] as usize..begin + row[b + 1] as usize])
        })
    }
}

/// Distributes the depths into N buckets of N slices.
///
/// An entry is the second-level bucket in the upper and the place within the chunk in the lower 16 bits. `keys` holds
/// the bits of the depths, or gets its content from `depths`; afterwards it is used up.
pub(crate) fn distribute(
    slicing: &Slicing,
    keys: &mut [u32],
    depths: Option<&[f32]>,
    entries: &mut [u32],
    rows: &mut [u32],
) {
    let stride = slicing.buckets as usize + 1;
    keys.par_chunks_mut(CHUNK)
        .zip(entries.par_chunks_mut(CHUNK))
        .zip(rows.par_chunks_mut(stride))
        .enumerate()
        .for_each(|(c, ((keys, entries), row))| {
            let depths = depths.map(|d| &d[c * CHUNK..c * CHUNK + keys.len()]);
            match slicing.direction {
                Direction::FrontToBack => pulp::Arch::new().dispatch(Split::<false> { slicing, keys, depths }),
                Direction::BackToFront => pulp::Arch::new().dispatch(Split::<true> { slicing, keys, depths }),
            }
            // The shift drops the first level, which the entry's bucket says, and makes room for the place.
            distribute_chunk(keys, |key| key >> 16, |key, place| key << 16 | place, row, entries);
        });
}

/// Splits the depths of one chunk, in the form that [`pulp`] compiles once per instruction set.
struct Split<'a, const BACK: bool> {
    slicing: &'a Slicing,
    keys: &'a mut [u32],
    depths: Option<&'a [f32]>,
}

impl<const BACK: bool> pulp::NullaryFnOnce for Split<'_, BACK> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        // A copy that lives in registers: the compiler need not fear that writing keys changes it.
        let slicing = *self.slicing;
        match self.depths {
            None => self.keys.iter_mut().for_each(|k| *k = slicing.split::<BACK>(*k)),
            Some(d) => self.keys.iter_mut().zip(d).for_each(|(k, d)| *k = slicing.split::<BACK>(d.to_bits())),
        }
    }
}

/// Distributes the keys of one chunk into `entries`, stably; where the buckets begin goes into `row`.
///
/// The halves of the chunk advance side by side, each with cursors of its own: neighbours often share a bucket, and
/// one cursor would have to wait for its own last step.
#[inline(always)]
pub(crate) fn distribute_chunk<E>(
    keys: &[u32],
    bucket_of: impl Fn(u32) -> u32,
    entry_of: impl Fn(u32, u32) -> E,
    row: &mut [u32],
    entries: &mut [E],
) {
    let slot = |key: u32| bucket_of(key) as usize & MOST_BUCKETS;
    let half = keys.len() / 2;
    let (first, second) = keys.split_at(half);
    let mut cursors = [[0u32; 2]; MOST_BUCKETS + 1];
    for (&a, &b) in first.iter().zip(second) {
        cursors[slot(a)][0] += 1;
        cursors[slot(b)][1] += 1;
    }
    // The second half is one longer when the length is odd.
    for &b in &second[half..] {
        cursors[slot(b)][1] += 1;
    }
    let mut start = 0;
    for ([a, b], row) in cursors.iter_mut().zip(row) {
        *row = start;
        start += std::mem::replace(a, start);
        start += std::mem::replace(b, start);
    }
    let mut place_entry = |half: usize, key: u32, place: usize| {
        let cursor = &mut cursors[slot(key)][half];
        entries[*cursor as usize] = entry_of(key, place as u32);
        *cursor += 1;
    };
    for (place, (&a, &b)) in first.iter().zip(second).enumerate() {
        place_entry(0, a, place);
        place_entry(1, b, half + place);
    }
    for &b in &second[half..] {
        place_entry(1, b, 2 * half);
    }
}

/// Where each bucket of the whole begins in the result, from the rows of the chunks; the last entry is the number of
/// kept splats.
pub(crate) fn scan_buckets(rows: &[u32], bucket_starts: &mut [u32]) {
    bucket_starts.fill(0);
    for row in rows.chunks_exact(bucket_starts.len()) {
        for (total, ends) in bucket_starts.iter_mut().zip(row.windows(2)) {
            *total += ends[1] - ends[0];
        }
    }
    let mut start = 0;
    for total in bucket_starts {
        start += std::mem::replace(total, start);
    }
}
