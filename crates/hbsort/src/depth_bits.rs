//! Second level of the order by depth bits: the splats of one range of keys in the order (depth, place), with the
//! slices marked where ⌊(d − near)/ε⌋ changes.
//!
//! The keys of a range differ in few bits, so one to three passes of a least-significant-digit radix sort order it
//! inside the cache.

use crate::buckets::MARK;
use crate::first_level::Distributed;
use crate::ranges::{KeyRange, Ranges};
use crate::scratch::{BucketSlices, Leaf};
use crate::slicing::Slicing;
use rayon::prelude::*;
use std::sync::{Mutex, PoisonError};

/// Bits of the widest digit: its counts fit the first-level cache.
const DIGIT_BITS: u32 = 11;

/// Values of the widest digit.
pub(crate) const DIGITS: usize = 1 << DIGIT_BITS;

/// Digits of the widest range, 32 bits.
pub(crate) const MOST_PASSES: usize = 3;

/// Entries that a leaf holds for `n` splats: twice the average range.
pub(crate) fn leaf_capacity(n: usize, buckets: usize) -> usize {
    (2 * n / buckets).max(1 << 14).min(n)
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
        let keys = self.ranges.keys_of(b);
        // No leaf is held here: the parallel sort may run another bucket on this thread.
        if out.len() > self.leaf_capacity {
            return if keys.bits <= DIGIT_BITS { self.order_few_keys(b, keys, out) } else { self.order_large(b, out) };
        }
        // Each thread of the pool has its own leaf, so no lock waits.
        let thread = rayon::current_thread_index().unwrap_or(0) % leaves.len();
        let mut leaf = leaves[thread].lock().unwrap_or_else(PoisonError::into_inner);
        let sorted = self.order_in_leaf(b, keys, &mut leaf, out.len());
        self.mark_slices(out, sorted)
    }

    /// The entries of bucket `b`, sorted in one half of the leaf.
    fn order_in_leaf<'l>(&self, b: usize, keys: KeyRange, leaf: &'l mut Leaf, n: usize) -> &'l [u64] {
        let passes = keys.bits.div_ceil(DIGIT_BITS).max(1);
        let digits = Digits { first: keys.first, width: keys.bits.div_ceil(passes), passes };
        let counts = &mut leaf.counts[..MOST_PASSES * DIGITS];
        self.count(b, digits, counts);
        let (from, to) = leaf.entries.split_at_mut(self.leaf_capacity);
        let mut from = &mut from[..n];
        let mut to = &mut to[..n];
        let parts = self.distributed.parts(b).flat_map(|(_, part)| [part]);
        scatter(parts, |e| digits.digit(e, 0), &mut counts[..DIGITS], from);
        for pass in 1..passes {
            let cursors = &mut counts[pass as usize * DIGITS..][..DIGITS];
            scatter([&*from], |e| digits.digit(e, pass), cursors, to);
            std::mem::swap(&mut from, &mut to);
        }
        from
    }

    /// Histograms and exclusive scans of all digits.
    fn count(&self, b: usize, digits: Digits, counts: &mut [u32]) {
        counts[..digits.passes as usize * DIGITS].fill(0);
        let [low, middle, high] = [0, 1, 2].map(|pass| pass * DIGITS);
        for (_, part) in self.distributed.parts(b) {
            match digits.passes {
                1 => part.iter().for_each(|&e| counts[digits.digit(e, 0)] += 1),
                2 => part.iter().for_each(|&e| {
                    counts[low + digits.digit(e, 0)] += 1;
                    counts[middle + digits.digit(e, 1)] += 1;
                }),
                _ => part.iter().for_each(|&e| {
                    counts[low + digits.digit(e, 0)] += 1;
                    counts[middle + digits.digit(e, 1)] += 1;
                    counts[high + digits.digit(e, 2)] += 1;
                }),
            }
        }
        for counts in counts.chunks_exact_mut(DIGITS).take(digits.passes as usize) {
            let mut start = 0;
            counts[..1 << digits.width].iter_mut().for_each(|c| start += std::mem::replace(c, start));
        }
    }

    /// A range that outgrew the leaf, of so few keys that counting orders it at once.
    fn order_few_keys(&self, b: usize, keys: KeyRange, out: &mut [u32]) -> BucketSlices {
        let digits = Digits { first: keys.first, width: keys.bits, passes: 1 };
        let mut cursors = [0; DIGITS];
        self.count(b, digits, &mut cursors);
        for (_, part) in self.distributed.parts(b) {
            for &entry in part {
                let cursor = &mut cursors[digits.digit(entry, 0)];
                out[*cursor as usize] = (self.id_of)(entry as u32);
                *cursor += 1;
            }
        }
        let mut found = Found::default();
        let mut begin = 0;
        for (key, &end) in (keys.first..).zip(&cursors[..1 << keys.bits]) {
            if end > begin && found.is_new(self.slice_of_key(key)) {
                out[begin as usize] |= MARK;
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

    /// Writes the ids of sorted entries, and marks where slices begin.
    fn mark_slices(&self, out: &mut [u32], sorted: &[u64]) -> BucketSlices {
        let mut found = Found::default();
        let mut within = None;
        for (out, &entry) in out.iter_mut().zip(sorted) {
            let key = (entry >> 32) as u32;
            *out = (self.id_of)(entry as u32);
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

/// The digits of the keys of one range.
#[derive(Clone, Copy)]
struct Digits {
    first: u32,
    /// Bits of each digit.
    width: u32,
    passes: u32,
}

impl Digits {
    /// Digit `pass` of an entry, the least significant first.
    #[inline(always)]
    fn digit(self, entry: u64, pass: u32) -> usize {
        // A key of 32 bits is never shifted by more than 22.
        let digit = ((entry >> 32) as u32 - self.first) >> (pass * self.width);
        digit as usize & ((1 << self.width) - 1) & (DIGITS - 1)
    }
}

/// One stable pass of counting sort.
#[inline(always)]
fn scatter<'e>(
    parts: impl IntoIterator<Item = &'e [u64]>,
    digit_of: impl Fn(u64) -> usize,
    cursors: &mut [u32],
    to: &mut [u64],
) {
    for part in parts {
        for &entry in part {
            let cursor = &mut cursors[digit_of(entry)];
            to[*cursor as usize] = entry;
            *cursor += 1;
        }
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
