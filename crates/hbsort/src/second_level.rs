//! Step 3 (Figure 9): each first-level bucket is distributed into its N slices, straight into its part of the result.

use crate::buckets::MARK;
use crate::first_level::Distributed;
use crate::scratch::BucketSlices;

/// Most second-level buckets.
const MOST_SLICES: usize = 1024;

/// Orders bucket `b` by (slice, place) into `out`, marks the first splat of every slice.
pub(crate) fn slice_bucket(
    distributed: Distributed<'_, u32>,
    b: usize,
    id_of: impl Fn(u32) -> u32,
    out: &mut [u32],
) -> BucketSlices {
    let mut cursors = [0u32; MOST_SLICES];
    for (_, part) in distributed.parts(b) {
        for entry in part {
            cursors[(entry >> 16) as usize & (MOST_SLICES - 1)] += 1;
        }
    }
    let mut starts = [0u32; MOST_SLICES];
    let mut count = 0usize;
    let mut start = 0;
    for cursor in &mut cursors[..distributed.buckets] {
        if *cursor > 0 {
            starts[count] = start;
            count += 1;
        }
        start += std::mem::replace(cursor, start);
    }
    for (begin, part) in distributed.parts(b) {
        for entry in part {
            let cursor = &mut cursors[(entry >> 16) as usize & (MOST_SLICES - 1)];
            out[*cursor as usize] = id_of(begin + (entry & 0xffff));
            *cursor += 1;
        }
    }
    for &start in &starts[..count] {
        out[start as usize] |= MARK;
    }
    // Slices never cross a bucket here, so which they are does not matter: first and last differ from all others.
    let slice = (b * distributed.buckets) as u64;
    BucketSlices { count: count as u32, ends: [slice; 2] }
}
