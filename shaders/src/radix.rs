//! Recording scans and passes of the radix sort, which several stages take.

use crate::layouts::{Scan, SortState};
use crate::{BufferId, Groups, Recording, kernels};
use std::mem::offset_of;

/// Entries that a workgroup sorts.
pub const SORT_BLOCK: u32 = 2048;
/// Numbers that a workgroup scans.
pub const SCAN_BLOCK: u32 = 1024;
/// Values of a digit.
const DIGITS: u32 = 256;

/// Numbers on the device and what scans them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Scanned {
    /// One [`Scan`].
    pub scan: BufferId,
    /// The numbers.
    pub numbers: BufferId,
    /// Sums of their blocks.
    pub sums: BufferId,
}

impl Scanned {
    /// Room for the numbers and for the sums of their blocks, named so.
    pub fn scratch(r: &mut Recording, scan: BufferId, names: [&'static str; 2], count: u32) -> Self {
        let words = |n: u32| 4 * u64::from(n);
        let numbers = r.scratch(names[0], words(count));
        Self { scan, numbers, sums: r.scratch(names[1], words(count.div_ceil(SCAN_BLOCK))) }
    }

    /// Room for the digits of this many entries.
    pub fn digits(r: &mut Recording, scan: BufferId, entries: u32) -> Self {
        Self::scratch(r, scan, ["digit counts", "digit sums"], digit_counts(entries))
    }

    /// Exclusive scan of the numbers in place.
    pub fn record(self, r: &mut Recording, groups: Groups) {
        let Self { scan, numbers, sums } = self;
        r.dispatch(&kernels::SCAN_REDUCE, groups, &[scan, numbers, sums], &[]);
        r.dispatch(&kernels::SCAN_SPINE, Groups::cover(1), &[scan, sums], &[]);
        r.dispatch(&kernels::SCAN_APPLY, groups, &[scan, numbers, sums], &[]);
    }
}

/// One pass of a radix sort: where keys and their companions lie, and where they go.
#[derive(Debug, Clone, Copy)]
pub struct SortPass {
    /// First of the eight bits of the key that are looked at.
    pub shift: u32,
    /// A [`SortState`]: how many entries there are.
    pub state: BufferId,
    /// Keys and companions, as they are.
    pub from: [BufferId; 2],
    /// Keys and companions, sorted.
    pub to: [BufferId; 2],
    /// Room for the counts of the digits.
    pub digits: Scanned,
}

/// Sorts keys and their companions by the eight bits from `shift` on, as many as `state` says; equal digits keep their
/// order.
pub fn sort_pass(r: &mut Recording, pass: SortPass) {
    let SortPass { shift, state, from: [keys, companions], to: [sorted_keys, sorted_companions], digits } = pass;
    let at = |offset| Groups::Indirect { buffer: state, offset: offset as u64 };
    let groups = at(offset_of!(SortState, sort_groups_x));
    r.dispatch(&kernels::RADIX_HISTOGRAM, groups, &[state, keys, digits.numbers], &[shift]);
    digits.record(r, at(offset_of!(SortState, scan_groups_x)));
    let scattered = [state, keys, companions, digits.numbers, sorted_keys, sorted_companions];
    r.dispatch(&kernels::RADIX_SCATTER, groups, &scattered, &[shift]);
}

/// Digit counts of the blocks of this many entries.
fn digit_counts(entries: u32) -> u32 {
    DIGITS * entries.div_ceil(SORT_BLOCK)
}

/// Across and down, as [`Groups::cover`].
fn cover(blocks: u32) -> [u32; 2] {
    [blocks.min(Groups::ACROSS), blocks.div_ceil(Groups::ACROSS)]
}

impl SortState {
    /// A sort of this many entries, where their number is known before: what the device would have prepared.
    pub fn for_entries(entries: u32) -> Self {
        let blocks = entries.div_ceil(SORT_BLOCK);
        let [sort_groups_x, sort_groups_y] = cover(blocks);
        let [scan_groups_x, scan_groups_y] = cover(digit_counts(entries).div_ceil(SCAN_BLOCK));
        Self {
            kept: entries,
            sorted: entries,
            blocks,
            near_key: 0,
            far_key: 0,
            radius_key: 0,
            sort_groups_x,
            sort_groups_y,
            sort_groups_z: 1,
            scan_groups_x,
            scan_groups_y,
            scan_groups_z: 1,
        }
    }
}

impl Scan {
    /// The scan of the digits of this many entries.
    pub fn of_digits(entries: u32) -> Self {
        Self { count: digit_counts(entries), total: 0 }
    }
}
