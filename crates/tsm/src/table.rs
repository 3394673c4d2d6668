//! Lists of (distance, absorbance) per cell, in compressed rows.
//!
//! Entries come in chunks of splats; each chunk is parted by ranges of cells, then each range gathers its parts, counts
//! them into cells and sorts every cell by distance: O(n log n) even when all points lie on one ray, where the paper's
//! insertion lists are O(n²). Sums are 64-bit fixed point, so that neither the order of equal distances nor the thread
//! count changes a bit, and 10⁶ absorbances of 10⁻⁶ add up to 1.

mod list;

use crate::building::entries::Entries;
use crate::building::sort::sort;
pub(crate) use list::{ENOUGH, List};
use rayon::prelude::*;
use splat_core::raster::lanes::MAX_LANES;
use std::ops::Range;

/// Fixed point: 2⁴⁴ units an absorbance of 1.
const FIXED: f64 = (1u64 << 44) as f64;
/// Entries of a range that a core's cache holds while they are sorted.
const RANGE_ENTRIES: f64 = 32_768.0;
/// Entries that are looked at together.
pub(crate) const WINDOW: usize = MAX_LANES;
/// Least and greatest number of ranges.
const RANGES: [f64; 2] = [64.0, 1024.0];

/// A limit of absorbance in fixed point, at least 0. It is taken 2⁻²⁰ low: f32 parts of a sum may each be rounded down, and
/// the verdict must not depend on their number.
pub(crate) fn stop_of(limit: f32) -> i64 {
    ((f64::from(limit) * (1.0 - 2f64.powi(-20)) * FIXED) as i64).max(0)
}

/// Ranges of cells that are gathered together.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ranges {
    shift: u32,
    count: usize,
    cells: usize,
}

impl Ranges {
    /// Ranges of a power of two of cells, as many as `entries` in all call for.
    pub(crate) fn new(cells: usize, entries: f64) -> Self {
        let ranges = (entries / RANGE_ENTRIES).clamp(RANGES[0], RANGES[1]) as usize;
        let shift = cells.div_ceil(ranges).next_power_of_two().ilog2();
        Self { shift, count: (cells.max(1)).div_ceil(1 << shift), cells }
    }
}

impl Ranges {
    /// Cells of the table.
    pub(crate) fn cells(self) -> usize {
        self.cells
    }

    /// Cells of a range; the last one may have fewer.
    pub(crate) fn cells_of_a_range(self) -> usize {
        1 << self.shift
    }
}

#[cfg(feature = "gpu")]
impl Ranges {
    /// Number of ranges.
    pub(crate) fn count(self) -> usize {
        self.count
    }

    /// Where a range begins; the cells of the table for the one behind the last.
    pub(crate) fn first_cell(self, range: usize) -> usize {
        self.cells.min(range << self.shift)
    }
}

/// The entries of one chunk, parted by ranges.
#[derive(Debug, Clone)]
pub(crate) struct Parted<const C: usize> {
    start: Vec<u32>,
    cell: Vec<u32>,
    distance: Vec<f32>,
    absorbance: Vec<[f32; C]>,
}

impl<const C: usize> Parted<C> {
    /// Parts one chunk.
    pub(crate) fn new(entries: &Entries<C>, ranges: Ranges) -> Self {
        let n = entries.len;
        let cells = &entries.cell[..n];
        let mut start = vec![0u32; ranges.count + 1];
        for &c in cells {
            start[(c >> ranges.shift) as usize] += 1;
        }
        let mut sum = 0;
        for s in &mut start {
            sum += std::mem::replace(s, sum);
        }
        let mut cell = vec![0u32; n];
        let mut distance = vec![0f32; n];
        let mut absorbance = vec![[0f32; C]; n];
        for ((&c, d), a) in cells.iter().zip(&entries.distance).zip(&entries.absorbance) {
            let slot = &mut start[(c >> ranges.shift) as usize];
            let i = *slot as usize;
            cell[i] = c;
            distance[i] = *d;
            absorbance[i] = *a;
            *slot += 1;
        }
        // Now every slot holds where its range ends.
        Self { start, cell, distance, absorbance }
    }

    /// Where the entries of a range lie.
    #[inline]
    pub(crate) fn range(&self, r: usize) -> Range<usize> {
        let begin = if r == 0 { 0 } else { self.start[r - 1] };
        begin as usize..self.start[r] as usize
    }

    /// Number of entries.
    pub(crate) fn len(&self) -> usize {
        self.cell.len()
    }

    /// The cell of each entry.
    pub(crate) fn cells(&self) -> &[u32] {
        &self.cell
    }

    /// The distance of each entry.
    pub(crate) fn distances(&self) -> &[f32] {
        &self.distance
    }

    /// The absorbance of each entry.
    pub(crate) fn absorbances(&self) -> &[[f32; C]] {
        &self.absorbance
    }

    /// Cells, distances and absorbances of the entries of neighbouring ranges.
    #[cfg(feature = "gpu")]
    pub(crate) fn entries_of(&self, ranges: Range<usize>) -> (&[u32], &[f32], &[[f32; C]]) {
        let begin = if ranges.is_empty() { 0 } else { self.range(ranges.start).start };
        let end = if ranges.is_empty() { 0 } else { self.range(ranges.end - 1).end };
        (&self.cell[begin..end], &self.distance[begin..end], &self.absorbance[begin..end])
    }
}

/// Sorted lists of every cell.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Lists<const C: usize> {
    /// First entry of each cell, and number of entries kept.
    span: Vec<[u32; 2]>,
    /// Of all entries, and a [`WINDOW`] and one more.
    distance: Vec<f32>,
    total: Vec<[f32; C]>,
    kept: u64,
}

impl<const C: usize> Lists<C> {
    /// Gathers, sorts and sums; a list stops when its least absorbed channel reaches `limit`. There are fewer than 2³²
    /// entries.
    pub(crate) fn new(parted: &[Parted<C>], ranges: Ranges, limit: f32) -> Self {
        let entries: usize = parted.iter().map(Parted::len).sum();
        let mut span = vec![[0u32; 2]; ranges.cells];
        let mut distance = vec![0f32; entries + WINDOW + 1];
        let mut total = vec![[0f32; C]; entries + WINDOW + 1];
        let mut tasks = Vec::with_capacity(ranges.count);
        let mut distances = distance.as_mut_slice();
        let mut totals = total.as_mut_slice();
        let mut first = 0u32;
        for (range, span) in span.chunks_mut(1 << ranges.shift).enumerate() {
            let n: usize = parted.iter().map(|p| p.range(range).len()).sum();
            let (distance, total);
            (distance, distances) = distances.split_at_mut(n);
            (total, totals) = totals.split_at_mut(n);
            tasks.push(Task { range, first, span, distance, total });
            first = first.wrapping_add(n as u32);
        }
        let stop = stop_of(limit);
        let run = |gathered: &mut Gathered<C>, task: Task<'_, C>| {
            pulp::Arch::new().dispatch(Run { task, parted, shift: ranges.shift, stop, gathered })
        };
        let kept = tasks.into_par_iter().map_init(Gathered::default, run).sum();
        Self { span, distance, total, kept }
    }

    /// Lists that were sorted and summed elsewhere; `None` where a cell's list is not among the entries.
    #[cfg(feature = "gpu")]
    pub(crate) fn from_parts(span: Vec<[u32; 2]>, mut distance: Vec<f32>, mut total: Vec<[f32; C]>) -> Option<Self> {
        let fits =
            |[begin, kept]: &[u32; 2]| begin.checked_add(*kept).is_some_and(|end| end as usize <= distance.len());
        let known = span.iter().all(fits) && total.len() == distance.len();
        if !known {
            return None;
        }
        distance.extend([0.0; WINDOW + 1]);
        total.extend([[0.0; C]; WINDOW + 1]);
        let kept = span.iter().map(|[_, kept]| u64::from(*kept)).sum();
        Some(Self { span, distance, total, kept })
    }

    /// First entry and number of knots of each cell, distances, totals.
    #[cfg(feature = "gpu")]
    pub(crate) fn parts(&self) -> (&[[u32; 2]], &[f32], &[[f32; C]]) {
        let entries = self.entries() as usize;
        (&self.span, &self.distance[..entries], &self.total[..entries])
    }

    /// Entries before equal distances were merged and lists were cut.
    pub(crate) fn entries(&self) -> u64 {
        (self.distance.len() - (WINDOW + 1)) as u64
    }

    /// Entries after that.
    pub(crate) fn kept(&self) -> u64 {
        self.kept
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> u64 {
        let lists = size_of_val(&*self.distance) + size_of_val(&*self.total);
        (lists + size_of_val(&*self.span)) as u64
    }
}

/// Entries of one range by cells; buffers of one worker.
#[derive(Debug, Default)]
struct Gathered<const C: usize> {
    /// As [`pack`] makes them.
    key: Vec<u64>,
    /// By slot; unused for one channel.
    absorbance: Vec<[f32; C]>,
    spare: Vec<u64>,
}

/// One range of cells on its way from parts to lists.
struct Task<'a, const C: usize> {
    range: usize,
    first: u32,
    span: &'a mut [[u32; 2]],
    distance: &'a mut [f32],
    total: &'a mut [[f32; C]],
}

/// The work on one range, in the form that [`pulp`] compiles once per instruction set.
struct Run<'a, 'b, const C: usize> {
    task: Task<'a, C>,
    parted: &'b [Parted<C>],
    shift: u32,
    stop: i64,
    gathered: &'b mut Gathered<C>,
}

impl<const C: usize> pulp::NullaryFnOnce for Run<'_, '_, C> {
    type Output = u64;

    #[inline(always)]
    fn call(self) -> u64 {
        self.task.run(self.parted, self.shift, self.stop, self.gathered)
    }
}

impl<const C: usize> Task<'_, C> {
    /// Fills the lists and returns how many entries they keep.
    #[inline(always)]
    fn run(self, parted: &[Parted<C>], shift: u32, stop: i64, gathered: &mut Gathered<C>) -> u64 {
        let base = (self.range << shift) as u32;
        for part in parted {
            part.cell[part.range(self.range)].iter().for_each(|c| self.span[(c - base) as usize][1] += 1);
        }
        let mut sum = 0;
        for span in self.span.iter_mut() {
            span[0] = sum;
            sum += span[1];
        }
        let Gathered { key, absorbance, spare } = gathered;
        key.resize(sum as usize, 0);
        if C > 1 {
            absorbance.resize(sum as usize, [0.0; C]);
        }
        for part in parted {
            let range = part.range(self.range);
            let entries =
                part.cell[range.clone()].iter().zip(&part.distance[range.clone()]).zip(&part.absorbance[range]);
            for ((c, d), a) in entries {
                let slot = &mut self.span[(c - base) as usize][0];
                key[*slot as usize] = pack(*d, a, *slot);
                if C > 1 {
                    absorbance[*slot as usize] = *a;
                }
                *slot += 1;
            }
        }
        let mut count = 0;
        for [start, kept] in self.span {
            let end = *start as usize;
            let begin = end - *kept as usize;
            sort(&mut key[begin..end], spare);
            let distance = &mut self.distance[begin..end];
            let total = &mut self.total[begin..end];
            *kept = sum_up(&key[begin..end], absorbance, stop, distance, total);
            *start = (begin as u32).wrapping_add(self.first);
            count += u64::from(*kept);
        }
        count
    }
}

/// Merges equal distances and writes running sums; returns the number of entries kept.
#[inline(always)]
fn sum_up<const C: usize>(
    list: &[u64],
    absorbances: &[[f32; C]],
    stop: i64,
    distance: &mut [f32],
    total: &mut [[f32; C]],
) -> u32 {
    let mut sum = [0i64; C];
    let mut kept = 0;
    for (i, &key) in list.iter().enumerate() {
        let part = unpack(key, absorbances);
        // One entry is held below 2¹⁷ and a sum below 2¹⁸, so that none overflows.
        (0..C).for_each(|c| sum[c] = (sum[c] + (f64::from(part[c]).min(131_072.0) * FIXED) as i64).min(i64::MAX / 4));
        distance[kept] = f32::from_bits((key >> 32) as u32);
        total[kept] = sum.map(|s| (s as f64 * (1.0 / FIXED)) as f32);
        // The next one at the same distance writes over this one.
        let is_last = list.get(i + 1).is_none_or(|next| (next ^ key) >> 32 != 0);
        kept += usize::from(is_last);
        if is_last && sum.iter().all(|s| *s >= stop) {
            break;
        }
    }
    kept as u32
}

/// A key to sort by: the distance in the upper half; in the lower half the absorbance if there is one, else its slot.
#[inline(always)]
fn pack<const C: usize>(distance: f32, absorbance: &[f32; C], slot: u32) -> u64 {
    let rest = if C == 1 { absorbance[0].to_bits() } else { slot };
    u64::from(distance.max(f32::MIN_POSITIVE).to_bits()) << 32 | u64::from(rest)
}

/// The absorbance of a key.
#[inline(always)]
fn unpack<const C: usize>(key: u64, absorbances: &[[f32; C]]) -> [f32; C] {
    if C == 1 { [f32::from_bits(key as u32); C] } else { absorbances[key as u32 as usize] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::InsertionLists;

    fn build(entries: &Entries<1>, cells: usize, limit: f32) -> Lists<1> {
        let ranges = Ranges::new(cells, entries.len as f64);
        Lists::new(&[Parted::new(entries, ranges)], ranges, limit)
    }

    #[test]
    fn ts06_all_points_in_one_cell() {
        for n in [1000u64, 2000] {
            let mut entries = Entries::<1>::default();
            let mut paper = InsertionLists::new(1, 1e9);
            for i in 0..n {
                let distance = splat_core::rng::unit_f32(6, 0, i, 0);
                entries.push(0, distance, 1e-3, &[1.0; 3]);
                paper.insert(0, distance, 1e-3);
            }
            let lists = build(&entries, 1, 1e9);
            let ours: Vec<f32> = lists.list(0).distance().to_vec();
            let theirs: Vec<f32> = paper.list(0).iter().map(|e| e.0).collect();
            assert_eq!(ours, theirs);
            // The paper's insertion steps over n²/4 elements on average; sorting needs n log₂ n comparisons.
            let steps = paper.steps();
            assert!(steps as f64 > 0.2 * (n * n) as f64 && steps > n * 10 * 2, "{steps} steps for {n}");
        }
    }

    #[test]
    fn opaque_points_in_front_leave_nothing_behind_them_to_keep() {
        for n in [1000u64, 8000] {
            let mut entries = Entries::<1>::default();
            let mut paper = InsertionLists::new(1, 2.0);
            let absorbances = std::iter::once(100.0).chain(std::iter::repeat_n(1e-3, n as usize));
            for (i, absorbance) in (0..).zip(absorbances) {
                let distance = if i == 0 { 0.5 } else { 1.0 + splat_core::rng::unit_f32(6, 0, i, 0) };
                entries.push(0, distance, absorbance, &[1.0; 3]);
                paper.insert(0, distance, absorbance);
            }
            assert_eq!(build(&entries, 1, 2.0).list(0).distance(), [0.5]);
            // One step a point: near O(n), as the paper says of its lists.
            assert_eq!((paper.list(0).len(), paper.steps()), (1, n));
        }
    }

    #[test]
    fn ts07_verdict_at_the_limit_does_not_depend_on_the_number_of_parts() {
        for n in 1..=400u32 {
            let mut entries = Entries::<1>::default();
            for i in 0..n {
                entries.push(0, 1.0 + i as f32, 2.0 / n as f32, &[1.0; 3]);
            }
            entries.push(0, 1e6, 1.0, &[1.0; 3]);
            assert_eq!(build(&entries, 1, 2.0).list(0).len() as u32, n, "{n} parts of 2.0 reach the limit of 2.0");
        }
    }

    #[test]
    fn ts08_a_million_small_absorbances_add_up() {
        let n = 1_000_000;
        let mut entries = Entries::<1>::default();
        for i in 0..n {
            entries.push(3, 1.0 + i as f32, 1e-6, &[1.0; 3]);
        }
        let lists = build(&entries, 5, 1e9);
        let total = lists.list(3).total().last().unwrap()[0];
        let expected = f64::from(1e-6f32) * f64::from(n);
        assert!((f64::from(total) / expected - 1.0).abs() < 1e-6, "{total}");
        assert_eq!(lists.list(2).len() + lists.list(4).len(), 0);
    }

    #[test]
    fn ts11_equal_distances_are_one_knot_in_any_order() {
        let parts = [(1.0, 0.1), (2.0, 0.3), (1.0, 0.7), (1.0, 0.2)];
        let build = |order: [usize; 4]| {
            let mut entries = Entries::<1>::default();
            order.into_iter().for_each(|i| entries.push(0, parts[i].0, parts[i].1, &[1.0; 3]));
            build(&entries, 1, 9.0)
        };
        let sorted = build([0, 1, 2, 3]);
        assert_eq!(sorted, build([3, 2, 1, 0]));
        assert_eq!(sorted.list(0).distance(), [1.0, 2.0]);
    }
}
