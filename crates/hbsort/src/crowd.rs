//! Whether most splats crowd into one first-level bucket of equal slices.
//!
//! A single thread sorts such a bucket, and the bucket's part of the result may outgrow the cache. The ranges of the
//! order by depth bits hold about as many splats each, whatever the depths are. So a crowd is ordered by them: in parallel, and
//! finer than slices need. The answer depends on the depths alone, never on the number of threads.

use crate::slicing::Slicing;

/// Fewer splats than this are ordered before a second thread would help.
const MANY: usize = 1 << 18;

/// One of so many splats is looked at.
const SAMPLE: usize = 256;

/// Whether a sample finds half of the kept splats in one first-level bucket; `depth_bits` of each place, NaN for culled
/// ones.
pub(crate) fn crowds(slicing: &Slicing, n: usize, depth_bits: impl Fn(usize) -> u32) -> bool {
    let buckets = slicing.buckets as usize;
    if n < MANY || buckets < 2 {
        return false;
    }
    let mut counts = vec![0u32; buckets + 1];
    for place in (0..n).step_by(SAMPLE) {
        counts[(slicing.split::<false>(depth_bits(place)) >> 16) as usize] += 1;
    }
    let kept = &counts[..buckets];
    let most = kept.iter().max().copied().unwrap_or(0);
    2 * most > kept.iter().sum()
}
