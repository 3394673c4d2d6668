//! First level of the order by depth bits: ranges of keys that hold about as many splats each.
//!
//! Keys are the f32 bits of the depth, so a range adapts to near 1e-5 beside far 1e7, where slices of equal thickness
//! do not (HARD_CASES BS4). Every eighth splat is counted in equal ranges ("bins") of the key; consecutive bins are
//! joined. The choice of ranges affects only the speed, because any monotone map sorts.

use crate::first_level::{MOST_BUCKETS, distribute_chunk};
use crate::scratch::CHUNK;
use crate::slicing::Slicing;
use rayon::prelude::*;

/// Bins of the sampled histogram: the map fits the first-level cache.
pub(crate) const BINS: usize = 1 << 14;

/// Histograms that are counted side by side. A constant, so that the sum does not depend on the threads.
pub(crate) const SAMPLERS: usize = 4;

/// One of so many splats is sampled.
const SAMPLE: usize = 8;

/// Splats in a range on average: few enough for the second-level cache, and so many that the ends of all ranges that a chunk writes to fit
/// the first-level one.
const TARGET: usize = 16384;

/// The monotone map from relative keys to first-level buckets.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ranges<'a> {
    pub(crate) buckets: usize,
    /// Bin = key >> shift.
    shift: u32,
    bucket_of_bin: &'a [u16],
}

/// Keys of one range.
#[derive(Debug, Clone, Copy)]
pub(crate) struct KeyRange {
    /// The smallest that it may hold.
    pub(crate) first: u32,
    /// How many bits key − first takes.
    pub(crate) bits: u32,
}

/// Number of ranges for `n` splats.
pub(crate) fn bucket_count(n: usize) -> usize {
    (n / TARGET).clamp(1, MOST_BUCKETS)
}

impl<'a> Ranges<'a> {
    /// Samples the depths; `samples` holds [`SAMPLERS`] histograms of [`BINS`].
    pub(crate) fn sample(
        slicing: &Slicing,
        depth_at: &(impl Fn(usize) -> f32 + Sync),
        n: usize,
        samples: &mut [u32],
        bucket_of_bin: &'a mut [u16],
    ) -> Self {
        let span = slicing.relative_key(slicing.near).max(slicing.relative_key(slicing.far));
        let shift = (32 - span.leading_zeros()).saturating_sub(BINS.trailing_zeros());
        let share = n.div_ceil(SAMPLERS);
        samples.par_chunks_mut(BINS).enumerate().for_each(|(s, bins)| {
            bins.fill(0);
            for place in (s * share..n.min((s + 1) * share)).step_by(SAMPLE) {
                let depth = depth_at(place);
                if !depth.is_nan() {
                    bins[(slicing.relative_key(depth) >> shift) as usize & (BINS - 1)] += 1;
                }
            }
        });
        let buckets = bucket_count(n);
        equalize(samples, buckets, bucket_of_bin);
        Self { buckets, shift, bucket_of_bin }
    }

    /// The keys of bucket `b`.
    pub(crate) fn keys_of(&self, b: usize) -> KeyRange {
        let first = self.bucket_of_bin.partition_point(|x| usize::from(*x) < b);
        let end = self.bucket_of_bin.partition_point(|x| usize::from(*x) <= b);
        let span = ((end - first).max(1) as u64) << self.shift;
        KeyRange { first: (first as u32) << self.shift, bits: 64 - (span - 1).leading_zeros() }
    }

    /// Distributes the depths into the ranges; an entry is the relative key in the upper and the place in the input in
    /// the lower 32 bits. `keys` holds the bits of the depths, or gets its content from `depths`; afterwards it is used
    /// up.
    pub(crate) fn distribute(
        &self,
        slicing: &Slicing,
        keys: &mut [u32],
        depths: Option<&[f32]>,
        entries: &mut [u64],
        rows: &mut [u32],
    ) {
        let bucket_of = |key: u32| {
            // Culled splats are looked up as well and thrown away, which is cheaper than a branch.
            let bucket = u32::from(self.bucket_of_bin[(key >> self.shift) as usize & (BINS - 1)]);
            if key == CULLED_KEY { self.buckets as u32 } else { bucket }
        };
        keys.par_chunks_mut(CHUNK)
            .zip(entries.par_chunks_mut(CHUNK))
            .zip(rows.par_chunks_mut(self.buckets + 1))
            .enumerate()
            .for_each(|(c, ((keys, entries), row))| {
                let begin = c * CHUNK;
                let depths = depths.map(|d| &d[begin..begin + keys.len()]);
                pulp::Arch::new().dispatch(RelativeKeys { slicing, keys, depths });
                let entry_of = |key: u32, place: u32| u64::from(key) << 32 | u64::from(begin as u32 + place);
                distribute_chunk(keys, bucket_of, entry_of, row, entries);
            });
    }
}

/// The key of a culled splat; kept ones stay below, since the keys of finite depths span less than 2³² − 2²⁴.
const CULLED_KEY: u32 = u32::MAX;

/// Keys of the depths of one chunk, in the form that [`pulp`] compiles once per instruction set.
struct RelativeKeys<'a> {
    slicing: &'a Slicing,
    keys: &'a mut [u32],
    depths: Option<&'a [f32]>,
}

impl pulp::NullaryFnOnce for RelativeKeys<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let slicing = *self.slicing;
        let key_of = |depth: f32| if depth.is_nan() { CULLED_KEY } else { slicing.relative_key(depth) };
        match self.depths {
            None => self.keys.iter_mut().for_each(|k| *k = key_of(f32::from_bits(*k))),
            Some(d) => self.keys.iter_mut().zip(d).for_each(|(k, d)| *k = key_of(*d)),
        }
    }
}

/// Joins consecutive bins to `buckets` ranges of about equal count.
fn equalize(samples: &[u32], buckets: usize, bucket_of_bin: &mut [u16]) {
    let count = |bin: usize| samples.iter().skip(bin).step_by(BINS).map(|&v| u64::from(v)).sum::<u64>();
    let total = (0..BINS).map(count).sum::<u64>().max(1);
    let mut before = 0;
    for (bin, bucket) in bucket_of_bin.iter_mut().enumerate() {
        let here = count(bin);
        // The middle of the bin decides, so that it is less than `total` whenever the bin is not empty.
        let middle = 2 * before + here;
        *bucket = (middle * buckets as u64 / (2 * total)).min(buckets as u64 - 1) as u16;
        before += here;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_monotone_and_about_equal() {
        let mut samples = vec![0; SAMPLERS * BINS];
        for (i, s) in samples.iter_mut().enumerate() {
            *s = (i % BINS % 7) as u32;
        }
        let mut map = vec![0u16; BINS];
        equalize(&samples, 100, &mut map);
        assert!(map.windows(2).all(|w| w[0] <= w[1]));
        let mut held = [0u64; 100];
        for (i, s) in samples.iter().enumerate() {
            held[usize::from(map[i % BINS])] += u64::from(*s);
        }
        let mean = held.iter().sum::<u64>() / 100;
        assert!(held.iter().all(|h| h.abs_diff(mean) <= 2 * 6 * SAMPLERS as u64), "{held:?}");
    }
}
