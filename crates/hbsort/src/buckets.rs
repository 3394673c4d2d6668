//! Work on all first-level buckets at once: each owns one part of the result, halves go to two threads.

use crate::scratch::BucketSlices;
use std::ops::Range;

/// Set in the id of the first splat of a slice, until the slices are gathered.
pub(crate) const MARK: u32 = 1 << 31;

/// Ids that are searched for marks at once.
const SCAN: usize = 16;

/// Splats below which buckets are not shared with another thread.
const GRAIN: usize = 1 << 15;

/// Runs `order` on every bucket of `range` and its part of `out`; what it returns goes into `found`.
pub(crate) fn for_each(
    range: Range<usize>,
    starts: &[u32],
    out: &mut [u32],
    found: &mut [BucketSlices],
    order: &(impl Fn(usize, &mut [u32]) -> BucketSlices + Sync),
) {
    let Some(middle) = middle_of(&range, starts) else {
        let mut rest = out;
        for (b, found) in range.zip(found) {
            let (part, tail) = rest.split_at_mut((starts[b + 1] - starts[b]) as usize);
            rest = tail;
            *found = if part.is_empty() { BucketSlices::default() } else { order(b, part) };
        }
        return;
    };
    let (out_a, out_b) = out.split_at_mut((starts[middle] - starts[range.start]) as usize);
    let (found_a, found_b) = found.split_at_mut(middle - range.start);
    rayon::join(
        || for_each(range.start..middle, starts, out_a, found_a, order),
        || for_each(middle..range.end, starts, out_b, found_b, order),
    );
}

/// The bucket that halves the splats of `range`; `None` for work too small to share.
fn middle_of(range: &Range<usize>, starts: &[u32]) -> Option<usize> {
    let first = starts[range.start];
    let last = starts[range.end];
    if range.len() < 2 || ((last - first) as usize) < GRAIN {
        return None;
    }
    let inner = &starts[range.start + 1..range.end];
    let half = first + (last - first) / 2;
    Some(range.start + 1 + inner.partition_point(|s| *s < half).min(inner.len() - 1))
}

/// Unmarks the first splat of a bucket that goes on with the slice of the bucket before; how many slices there are.
pub(crate) fn join_slices(starts: &[u32], out: &mut [u32], found: &mut [BucketSlices]) -> usize {
    let mut before = None;
    let mut slices = 0;
    for (b, found) in found.iter_mut().enumerate().filter(|(_, f)| f.count > 0) {
        if before == Some(found.ends[0]) {
            out[starts[b] as usize] &= !MARK;
            found.count -= 1;
        }
        before = Some(found.ends[1]);
        slices += found.count as usize;
    }
    slices
}

/// Turns marks into the starts of the slices, bucket by bucket; `slice_starts` has one place for each mark.
pub(crate) fn gather_marks(
    range: Range<usize>,
    starts: &[u32],
    out: &mut [u32],
    found: &[BucketSlices],
    slice_starts: &mut [u32],
) {
    let Some(middle) = middle_of(&range, starts) else {
        take_marks(starts[range.start], out, slice_starts);
        return;
    };
    let (out_a, out_b) = out.split_at_mut((starts[middle] - starts[range.start]) as usize);
    let (found_a, found_b) = found.split_at(middle - range.start);
    let slices: usize = found_a.iter().map(|f| f.count as usize).sum();
    let (slice_starts_a, slice_starts_b) = slice_starts.split_at_mut(slices);
    rayon::join(
        || gather_marks(range.start..middle, starts, out_a, found_a, slice_starts_a),
        || gather_marks(middle..range.end, starts, out_b, found_b, slice_starts_b),
    );
}

/// Removes the marks of ids that begin at place `first`, and writes where they were.
fn take_marks(first: u32, out: &mut [u32], slice_starts: &mut [u32]) {
    let mut slice_starts = slice_starts.iter_mut();
    for (place, ids) in (first..).step_by(SCAN).zip(out.chunks_mut(SCAN)) {
        // Most slices are longer than this: no mark, and nothing to write.
        if ids.iter().fold(0, |bits, id| bits | id) & MARK == 0 {
            continue;
        }
        for ((place, id), start) in (place..).zip(ids).filter(|(_, id)| **id & MARK != 0).zip(&mut slice_starts) {
            *id &= !MARK;
            *start = place;
        }
    }
}
