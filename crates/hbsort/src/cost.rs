//! Predicted work and memory of a sort, from its size alone; tests compare them with measured ones.

use crate::depth_bits::{DIGITS, MOST_PASSES, leaf_capacity};
use crate::ranges::{BINS, SAMPLERS, bucket_count};
use crate::scratch::{BucketSlices, CHUNK, Method};

/// Bytes of the scratch for `n` splats and `buckets` first-level buckets on `threads` threads: 4 bytes a splat for two
/// levels, 8 by depth bits, plus the buckets. (The result itself takes 4 bytes a kept splat and 12 a non-empty slice.)
pub fn scratch_bytes(method: Method, n: usize, buckets: usize, threads: usize) -> u64 {
    8 * entry_words(method, n) as u64 + bucket_bytes(method, n, buckets, threads)
}

/// The share of [`scratch_bytes`] that buckets take.
pub fn bucket_bytes(method: Method, n: usize, buckets: usize, threads: usize) -> u64 {
    let rows = 4 * n.div_ceil(CHUNK) * (buckets + 1);
    let totals = 4 * (buckets + 1) + size_of::<BucketSlices>() * buckets;
    let leaves = threads * (16 * leaf_capacity(n, buckets.max(1)) + 4 * MOST_PASSES * DIGITS);
    (match method {
        Method::None => 0,
        Method::TwoLevels => rows + totals,
        Method::DepthBits => rows + totals + 4 * SAMPLERS * BINS + 2 * BINS + leaves,
    }) as u64
}

/// First-level buckets: N = ⌈√slices⌉ (Eq. 11), or ranges of about 16384 splats by depth bits.
pub fn buckets(method: Method, n: usize, slices: u64) -> usize {
    match method {
        Method::None => 0,
        Method::TwoLevels => crate::slicing::ceil_sqrt(slices) as usize,
        Method::DepthBits => bucket_count(n),
    }
}

/// 8-byte words of the entries.
pub(crate) fn entry_words(method: Method, n: usize) -> usize {
    match method {
        Method::None => 0,
        Method::TwoLevels => n.div_ceil(2),
        Method::DepthBits => n,
    }
}
