//! Splats, or places on polygons, by slab.

use std::ops::Range;

/// Ids slab by slab, ascending within one.
pub(crate) struct BySlab {
    pub(crate) ids: Vec<u32>,
    starts: Vec<u32>,
}

impl BySlab {
    /// Of each splat's slab, below `count`.
    pub(crate) fn new(slabs: &[u32], count: u32) -> Self {
        // starts[s + 1] first counts, then is the running end of slab s.
        let mut starts = vec![0u32; count as usize + 2];
        slabs.iter().for_each(|s| starts[*s as usize + 2] += 1);
        (2..starts.len()).for_each(|s| starts[s] += starts[s - 1]);
        let mut ids = vec![0; slabs.len()];
        for (id, slab) in (0..).zip(slabs) {
            let place = &mut starts[*slab as usize + 1];
            ids[*place as usize] = id;
            *place += 1;
        }
        starts.pop();
        Self { ids, starts }
    }

    fn range(&self, slab: u32) -> Range<usize> {
        self.starts[slab as usize] as usize..self.starts[slab as usize + 1] as usize
    }

    /// The ids of a slab.
    pub(crate) fn in_slab(&self, slab: u32) -> &[u32] {
        &self.ids[self.range(slab)]
    }
}
