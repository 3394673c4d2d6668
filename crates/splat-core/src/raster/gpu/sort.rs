//! Steps of the sort by tiles: scans of counts, and passes of a stable radix sort.

use super::SCAN_BLOCK;
use splat_shaders::layouts::{Scan, SortState};
use splat_shaders::{BufferId, Groups, Recording, kernels};
use std::mem::offset_of;

/// Numbers on the device and what scans them.
pub(super) struct Scanned {
    pub(super) scan: BufferId,
    pub(super) numbers: BufferId,
    sums: BufferId,
}

impl Scanned {
    pub(super) fn scratch(r: &mut Recording, names: [&'static str; 3], count: u32) -> Self {
        let words = |n: u32| 4 * u64::from(n);
        Self {
            scan: r.scratch(names[0], size_of::<Scan>() as u64),
            numbers: r.scratch(names[1], words(count)),
            sums: r.scratch(names[2], words(count.div_ceil(SCAN_BLOCK))),
        }
    }

    /// Exclusive scan of the numbers in place.
    pub(super) fn scan(&self, r: &mut Recording, groups: Groups) {
        let Self { scan, numbers, sums } = *self;
        r.dispatch(&kernels::SCAN_REDUCE, groups, &[scan, numbers, sums], &[]);
        r.dispatch(&kernels::SCAN_SPINE, Groups::cover(1), &[scan, sums], &[]);
        r.dispatch(&kernels::SCAN_APPLY, groups, &[scan, numbers, sums], &[]);
    }
}

/// Sorts tiles and ids by the eight bits from `shift` on.
pub(super) fn sort_pass(
    r: &mut Recording,
    shift: u32,
    sort: BufferId,
    [keys, ids]: [BufferId; 2],
    [sorted_keys, sorted_ids]: [BufferId; 2],
    digits: &Scanned,
) {
    let at = |offset| Groups::Indirect { buffer: sort, offset: offset as u64 };
    let groups = at(offset_of!(SortState, sort_groups_x));
    r.dispatch(&kernels::RADIX_HISTOGRAM, groups, &[sort, keys, digits.numbers], &[shift]);
    digits.scan(r, at(offset_of!(SortState, scan_groups_x)));
    let scattered = [sort, keys, ids, digits.numbers, sorted_keys, sorted_ids];
    r.dispatch(&kernels::RADIX_SCATTER, groups, &scattered, &[shift]);
}
