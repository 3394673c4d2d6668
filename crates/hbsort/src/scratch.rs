//! Buffers that live from one sort to the next, and facts about the last sort.

use crate::Error;
use splat_core::{Exceeded, SliceOrder};
use std::sync::Mutex;

/// Splats that one task distributes at a time. A constant, never a share of the threads; small enough that the task's
/// keys and entries stay in the second-level cache, and that a place in it fits 16 bits.
pub(crate) const CHUNK: usize = 1 << 15;

/// Splats that an order can name: the top bit of an id marks the first splat of a slice while sorting.
pub(crate) const MOST_SPLATS: u64 = 1 << 31;

/// The rule that determined ε.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ThicknessRule {
    /// Nothing was kept: there are no slices.
    #[default]
    None,
    /// The caller gave it.
    Given,
    /// The smallest splat radius.
    SmallestRadius,
    /// The first percentile of the radii: the smallest would have ruled, see [`crate::Thickness::Auto`].
    Percentile,
}

/// The method that ordered the splats.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Method {
    /// Nothing was kept.
    #[default]
    None,
    /// Two levels of buckets (Gunjee 2007, Figure 9); inside a slice, by id.
    TwoLevels,
    /// By the bits of the depth, then by id: exact mode, more slices than [`crate::Params::max_slices`], or most of very
    /// many splats in one first-level bucket, which would be one thread's work.
    DepthBits,
}

/// The report of a sort; [`Scratch::info`].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SortInfo {
    /// Splats or depths that went in.
    pub items_in: u64,
    /// The rule that determined ε.
    pub rule: ThicknessRule,
    /// The method that ordered the splats.
    pub method: Method,
    /// Buckets of the first level: N of Eq. 11, or the key ranges of the order by depth bits.
    pub buckets: u32,
    /// Bytes that the sort used beside its input and its result.
    pub bytes: u64,
}

/// Buffers of a sort, kept for the next one: at most 8 bytes a splat plus the buckets, see
/// [`crate::cost::scratch_bytes`].
#[derive(Debug, Default)]
pub struct Scratch {
    pub(crate) entries: Vec<u64>,
    pub(crate) rows: Vec<u32>,
    pub(crate) bucket_starts: Vec<u32>,
    pub(crate) bucket_slices: Vec<BucketSlices>,
    pub(crate) samples: Vec<u32>,
    pub(crate) bucket_of_bin: Vec<u16>,
    pub(crate) leaves: Vec<Mutex<Leaf>>,
    pub(crate) info: SortInfo,
    spare: SliceOrder,
}

/// The slices found in one first-level bucket.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct BucketSlices {
    /// How many begin in it.
    pub(crate) count: u32,
    /// Slice of its first and of its last splat.
    pub(crate) ends: [u64; 2],
}

/// Where one thread sorts one bucket by depth bits.
#[derive(Debug, Default)]
pub(crate) struct Leaf {
    pub(crate) entries: Vec<u64>,
    pub(crate) counts: Vec<u32>,
}

impl Scratch {
    /// Empty buffers; the first sort makes them.
    pub fn new() -> Self {
        Self::default()
    }

    /// The report of the last successful sort.
    pub fn info(&self) -> &SortInfo {
        &self.info
    }

    /// Gives the buffers of an order that is no longer needed to the next sort, which then allocates nothing as long
    /// as it is no larger.
    pub fn recycle(&mut self, order: SliceOrder) {
        self.spare = order;
    }

    /// Bytes held, the recycled order not counted.
    pub fn bytes(&self) -> u64 {
        let leaves: u64 = self.leaves.iter().map(leaf_bytes).sum();
        bytes_of(&self.entries)
            + bytes_of(&self.rows)
            + bytes_of(&self.bucket_starts)
            + bytes_of(&self.bucket_slices)
            + bytes_of(&self.samples)
            + bytes_of(&self.bucket_of_bin)
            + leaves
    }

    /// An order to fill, with the recycled buffers and room for `n` ids.
    pub(crate) fn take_order(&mut self, n: usize) -> Result<SliceOrder, Error> {
        let spare = std::mem::take(&mut self.spare);
        let mut ids = spare.input_from_sorted;
        let mut slice_starts = spare.slice_starts;
        let mut slice_indices = spare.slice_indices;
        resize(&mut ids, n)?;
        slice_starts.clear();
        slice_indices.clear();
        Ok(SliceOrder { input_from_sorted: ids, slice_starts, slice_indices, ..SliceOrder::default() })
    }
}

fn leaf_bytes(leaf: &Mutex<Leaf>) -> u64 {
    // A leaf that panicked is poisoned, but its buffers are still whole.
    let leaf = leaf.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    bytes_of(&leaf.entries) + bytes_of(&leaf.counts)
}

fn bytes_of<T>(buffer: &Vec<T>) -> u64 {
    (buffer.capacity() * size_of::<T>()) as u64
}

/// Makes `buffer` `n` entries long; entries that were there keep their value, which the caller overwrites.
pub(crate) fn resize<T: Clone + Default>(buffer: &mut Vec<T>, n: usize) -> Result<(), Error> {
    let refused = |_| {
        let what = "a buffer of the sort".into();
        let hint = "free memory, or sort parts of the cloud".into();
        let needed = (n as u64).saturating_mul(size_of::<T>() as u64);
        Error::Limit(Exceeded { what, needed, limit: None, unit: "bytes", hint })
    };
    if buffer.capacity() < n {
        // Nothing of the old content is wanted: no copy, and fresh pages that the system has already cleared.
        *buffer = Vec::new();
        buffer.try_reserve_exact(n).map_err(refused)?;
    }
    buffer.resize(n, T::default());
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_buffer_that_no_memory_holds_is_refused_and_empty() {
        let mut buffer = vec![1u64; 8];
        let n = usize::MAX / size_of::<u64>();
        let refused = resize(&mut buffer, n).unwrap_err();
        assert!(matches!(refused, Error::Limit(Exceeded { needed, .. }) if needed == 8 * n as u64), "{refused}");
        assert!(buffer.is_empty());
    }
}
