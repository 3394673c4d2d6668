//! Second level of the order by depth bits: the splats of one range of keys in the order (depth, place), with the
//! slices marked where ⌊(d − near)/ε⌋ changes.
//!
//! About as many equal sub-ranges as splats, one counting pass into a buffer in the cache, then insertion: nearly
//! every sub-range holds one or two. A sub-range that many splats crowd into is sorted by comparison.

use crate::buckets::MARK;
use crate::first_level::Distributed;
use crate::ranges::Ranges;
use crate::scratch::{BucketSlices, Leaf};
use crate::slicing::Slicing;
use rayon::prelude::*;
use std::sync::{Mutex, PoisonError};

/// Most sub-ranges of a range: their counts fit the first-level cache.
pub(crate) const MOST_SUB_RANGES: usize = 1 << 13;

/// Splats in one sub-range that insertion still sorts well.
const CROWD: u32 = 24;

/// Entries that a leaf holds for `n` splats: several times the average range.
pub(crate) fn leaf_capacity(n: usize, buckets: usize) -> usize {
    (4 * n / buckets).max(1 << 14).min(n)
}

/// One sort by depth bits.
pub(crate) struct DepthBits<'a, D, I> {
    pub(crate) slicing: &'a Slicing,
    pub(crate) ranges: Ranges<'a>,
    pub(crate) distributed: Distributed<'a, u64>,
    /// Entries that a leaf holds.
    pub(crate) leaf_capacity: usize,
    /// Depth of an input place, for ranges that are larger than a leaf.
    pub(crate) depth_at: D,
    /// Id of an input place.
    pub(crate) id_of: I,
}

impl<D: Fn(usize) -> f32 + Sync, I: Fn(u32) -> u32 + Sync> DepthBits<'_, D, I> {
    /// Orders bucket `b` by (depth, place) into `out`.
    pub(crate) fn order_bucket(&self, b: usize, leaves: &[Mutex<Leaf>], out: &mut [u32]) -> BucketSlices {
        let n = out.len();
        let (first, bits) = self.ranges.keys_of(b);
        let wanted = (usize::BITS + 1 - n.leading_zeros()).min(MOST_SUB_RANGES.trailing_zeros());
        let sub = SubRanges { first, shift: bits.saturating_sub(wanted), count: 1 << wanted.min(bits) };
        // No leaf is held here: the parallel sort may run another bucket on this thread.
        if sub.shift > 0 && n > self.leaf_capacity {
            return self.order_large(b, out);
        }
        // Each thread of the pool has its own leaf, so no lock waits.
        let own = rayon::current_thread_index().unwrap_or(0) % leaves.len();
        let mut leaf = leaves[own].lock().unwrap_or_else(PoisonError::into_inner);
        self.order_in_leaf(b, sub, &mut leaf, out)
    }

    fn order_in_leaf(&self, b: usize, sub: SubRanges, leaf: &mut Leaf, out: &mut [u32]) -> BucketSlices {
        let counts = &mut leaf.counts[..sub.count];
        let crowded = self.count(b, sub, counts) > CROWD;
        if sub.shift == 0 {
            return self.place_directly(b, sub, counts, out);
        }
        let entries = &mut leaf.entries[..out.len()];
        for (_, part) in self.distributed.parts(b) {
            for &entry in part {
                let cursor = &mut counts[sub.of(entry)];
                entries[*cursor as usize] = entry;
                *cursor += 1;
            }
        }
        if crowded {
            sort_crowds(entries, counts);
        }
        insertion_sort(entries);
        self.mark_slices(out, entries.iter().map(|&e| ((e >> 32) as u32, e as u32)))
    }

    /// Histogram and exclusive scan of the sub-ranges; the greatest count.
    fn count(&self, b: usize, sub: SubRanges, counts: &mut [u32]) -> u32 {
        counts.fill(0);
        for (_, part) in self.distributed.parts(b) {
            for &entry in part {
                counts[sub.of(entry)] += 1;
            }
        }
        let (mut start, mut greatest) = (0, 0);
        for count in counts {
            greatest = greatest.max(*count);
            start += std::mem::replace(count, start);
        }
        greatest
    }

    /// Sub-ranges of a single key need no sort, however many splats they hold.
    fn place_directly(&self, b: usize, sub: SubRanges, cursors: &mut [u32], out: &mut [u32]) -> BucketSlices {
        for (_, part) in self.distributed.parts(b) {
            for &entry in part {
                let cursor = &mut cursors[sub.of(entry)];
                out[*cursor as usize] = (self.id_of)(entry as u32);
                *cursor += 1;
            }
        }
        let mut found = Found::default();
        let (mut begin, mut within) = (0, None);
        for (key, &end) in (sub.first..).zip(cursors.iter()) {
            if end > begin && within.is_none_or(|within| key > within) {
                let slice = self.slice_of_key(key);
                out[begin as usize] |= if found.is_new(slice) { MARK } else { 0 };
                within = Some(self.slicing.surely_within(slice));
            }
            begin = end;
        }
        found.slices
    }

    /// A range that outgrew the leaf, since many splats crowd into few keys of a wide range: by comparison, without
    /// more memory.
    fn order_large(&self, b: usize, out: &mut [u32]) -> BucketSlices {
        let places = self.distributed.parts(b).flat_map(|(_, part)| part.iter().map(|&e| e as u32));
        out.iter_mut().zip(places).for_each(|(out, place)| *out = place);
        let key = |place: u32| self.slicing.relative_key((self.depth_at)(place as usize));
        out.par_sort_unstable_by_key(|&place| (key(place), place));
        let mut found = Found::default();
        for out in out {
            let mark = if found.is_new(self.slice_of_key(key(*out))) { MARK } else { 0 };
            *out = (self.id_of)(*out) | mark;
        }
        found.slices
    }

    fn mark_slices(&self, out: &mut [u32], sorted: impl Iterator<Item = (u32, u32)>) -> BucketSlices {
        let mut found = Found::default();
        let mut within = None;
        for (out, (key, place)) in out.iter_mut().zip(sorted) {
            *out = (self.id_of)(place);
            if within.is_none_or(|within| key > within) {
                let slice = self.slice_of_key(key);
                *out |= if found.is_new(slice) { MARK } else { 0 };
                within = Some(self.slicing.surely_within(slice));
            }
        }
        found.slices
    }

    #[inline(always)]
    fn slice_of_key(&self, relative_key: u32) -> u64 {
        self.slicing.slice_of(self.slicing.depth_of(relative_key))
    }
}

/// Equal parts of one range of keys.
#[derive(Clone, Copy)]
struct SubRanges {
    first: u32,
    shift: u32,
    count: usize,
}

impl SubRanges {
    #[inline(always)]
    fn of(self, entry: u64) -> usize {
        (((entry >> 32) as u32 - self.first) >> self.shift) as usize & (self.count - 1)
    }
}

/// The slices seen so far.
#[derive(Default)]
struct Found {
    slices: BucketSlices,
}

impl Found {
    /// Counts the slice of the next splat; whether it is another one than before.
    #[inline(always)]
    fn is_new(&mut self, slice: u64) -> bool {
        let first = self.slices.count == 0;
        let new = first | (slice != self.slices.ends[1]);
        if first {
            self.slices.ends[0] = slice;
        }
        self.slices.ends[1] = slice;
        self.slices.count += u32::from(new);
        new
    }
}

/// Sorts the sub-ranges that insertion would be slow for; `ends` are those of the sub-ranges.
fn sort_crowds(entries: &mut [u64], ends: &[u32]) {
    let mut begin = 0;
    for &end in ends {
        if end - begin > CROWD {
            entries[begin as usize..end as usize].sort_unstable();
        }
        begin = end;
    }
}

/// Finishes a nearly sorted sequence.
fn insertion_sort(entries: &mut [u64]) {
    for i in 1..entries.len() {
        let entry = entries[i];
        let mut to = i;
        while to > 0 && entries[to - 1] > entry {
            entries[to] = entries[to - 1];
            to -= 1;
        }
        entries[to] = entry;
    }
}
