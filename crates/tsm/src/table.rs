//! Lists of (distance, absorbance) per cell, in compressed rows.
//!
//! Entries come in chunks of splats; each chunk is parted by ranges of cells, then each range gathers its parts, counts
//! them into cells and sorts every cell by distance: O(n log n) even when all points lie on one ray, where the paper's
//! insertion lists are O(n²). Sums are 64-bit fixed point, so that neither the order of equal distances nor the thread
//! count changes a bit, and 10⁶ absorbances of 10⁻⁶ add up to 1.

use rayon::prelude::*;

/// Fixed point: 2⁴⁴ units an absorbance of 1.
const FIXED: f64 = (1u64 << 44) as f64;
/// Lists shorter than this are sorted by comparisons.
const SHORT: usize = 128;
/// Lists from this length on are sorted by eleven bits a pass, shorter ones by eight.
const LONG: usize = 8192;

/// One entry of a list: before sorting `total` is the entry's own absorbance, after it the sum up to and with it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Knot<const C: usize> {
    pub(crate) distance: f32,
    pub(crate) total: [f32; C],
}

impl<const C: usize> Knot<C> {
    const ZERO: Self = Self { distance: 0.0, total: [0.0; C] };
}

/// Entries in the order in which splats made them.
#[derive(Debug, Default)]
pub(crate) struct Entries<const C: usize> {
    pub(crate) cell: Vec<u32>,
    pub(crate) knot: Vec<Knot<C>>,
}

/// Ranges of cells that are gathered together.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ranges {
    shift: u32,
    count: usize,
    cells: usize,
}

impl Ranges {
    /// At most 1024 ranges of a power of two of cells.
    pub(crate) fn new(cells: usize) -> Self {
        let shift = usize::BITS - (cells.saturating_sub(1) >> 10).leading_zeros();
        Self { shift, count: (cells.max(1)).div_ceil(1 << shift), cells }
    }
}

/// The entries of one chunk, parted by ranges.
#[derive(Debug)]
pub(crate) struct Parted<const C: usize> {
    start: Vec<u32>,
    cell: Vec<u32>,
    knot: Vec<Knot<C>>,
}

impl<const C: usize> Parted<C> {
    /// Parts one chunk, keeping the order inside each range.
    pub(crate) fn new(entries: &Entries<C>, ranges: Ranges) -> Self {
        let mut start = vec![0u32; ranges.count + 1];
        for &c in &entries.cell {
            start[(c >> ranges.shift) as usize + 1] += 1;
        }
        (1..start.len()).for_each(|r| start[r] += start[r - 1]);
        let mut next = start.clone();
        let mut cell = vec![0u32; entries.cell.len()];
        let mut knot = vec![Knot::ZERO; entries.cell.len()];
        for (&c, k) in entries.cell.iter().zip(&entries.knot) {
            let slot = &mut next[(c >> ranges.shift) as usize];
            cell[*slot as usize] = c;
            knot[*slot as usize] = *k;
            *slot += 1;
        }
        Self { start, cell, knot }
    }

    fn range(&self, r: usize) -> std::ops::Range<usize> {
        self.start[r] as usize..self.start[r + 1] as usize
    }

    /// Number of entries.
    pub(crate) fn len(&self) -> usize {
        self.cell.len()
    }
}

/// Sorted lists of every cell.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Lists<const C: usize> {
    /// First knot of each cell.
    start: Vec<u32>,
    /// Knots kept of each cell: equal distances are one, and nothing follows the visible limit.
    kept: Vec<u32>,
    knot: Vec<Knot<C>>,
}

impl<const C: usize> Lists<C> {
    /// Gathers, sorts and sums; a list stops when its least absorbed channel reaches `limit`. There are at most 2³²
    /// entries.
    pub(crate) fn new(parted: &[Parted<C>], ranges: Ranges, limit: f32) -> Self {
        let total: usize = parted.iter().map(Parted::len).sum();
        let mut lists =
            Self { start: vec![0; ranges.cells], kept: vec![0; ranges.cells], knot: vec![Knot::ZERO; total] };
        let mut tasks = Vec::with_capacity(ranges.count);
        let width = 1usize << ranges.shift;
        let mut knots = lists.knot.as_mut_slice();
        let mut first = 0u32;
        let cells = lists.start.chunks_mut(width).zip(lists.kept.chunks_mut(width));
        for (r, (start, kept)) in cells.enumerate() {
            let n: usize = parted.iter().map(|p| p.range(r).len()).sum();
            let (mine, rest) = knots.split_at_mut(n);
            knots = rest;
            tasks.push(Task { range: r, first, start, kept, knot: mine });
            first = first.wrapping_add(n as u32);
        }
        tasks.into_par_iter().for_each(|task| task.run(parted, ranges.shift, limit));
        lists
    }

    /// The sorted knots of a cell.
    #[inline]
    pub(crate) fn list(&self, cell: u32) -> &[Knot<C>] {
        let start = self.start[cell as usize] as usize;
        &self.knot[start..start + self.kept[cell as usize] as usize]
    }

    /// Entries before equal distances were merged and lists were cut.
    pub(crate) fn entries(&self) -> u64 {
        self.knot.len() as u64
    }

    /// Entries after that.
    pub(crate) fn knots(&self) -> u64 {
        self.kept.iter().map(|k| u64::from(*k)).sum()
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> u64 {
        (self.knot.len() * size_of::<Knot<C>>() + 8 * self.start.len()) as u64
    }
}

/// One range of cells on its way from parts to lists.
struct Task<'a, const C: usize> {
    range: usize,
    first: u32,
    start: &'a mut [u32],
    kept: &'a mut [u32],
    knot: &'a mut [Knot<C>],
}

impl<const C: usize> Task<'_, C> {
    fn run(self, parted: &[Parted<C>], shift: u32, limit: f32) {
        let base = (self.range << shift) as u32;
        let mut spare = Vec::new();
        for part in parted {
            part.cell[part.range(self.range)].iter().for_each(|c| self.kept[(c - base) as usize] += 1);
        }
        // Exclusive sums; `start` counts up while knots are scattered and is put back afterwards.
        let mut sum = 0;
        for (start, count) in self.start.iter_mut().zip(self.kept.iter()) {
            *start = sum;
            sum += count;
        }
        for part in parted {
            let range = part.range(self.range);
            for (c, k) in part.cell[range.clone()].iter().zip(&part.knot[range]) {
                let slot = &mut self.start[(c - base) as usize];
                self.knot[*slot as usize] = *k;
                *slot += 1;
            }
        }
        for (start, kept) in self.start.iter_mut().zip(self.kept.iter_mut()) {
            let begin = *start - *kept;
            let list = &mut self.knot[begin as usize..*start as usize];
            sort(list, &mut spare);
            *kept = accumulate(list, limit);
            *start = begin.wrapping_add(self.first);
        }
    }
}

/// Sorts by distance. The order of equal distances is free: they are merged by exact sums.
fn sort<const C: usize>(list: &mut [Knot<C>], spare: &mut Vec<Knot<C>>) {
    if list.len() < SHORT {
        list.sort_unstable_by_key(|k| k.distance.to_bits());
        return;
    }
    let bits = |k: &Knot<C>| k.distance.to_bits();
    let (least, most) = list.iter().fold((u32::MAX, 0), |(a, b), k| (a.min(bits(k)), b.max(bits(k))));
    // Distances of one cell differ in their low bits alone.
    let significant = u32::BITS - (most - least).leading_zeros();
    spare.clear();
    spare.resize(list.len(), Knot::ZERO);
    if list.len() < LONG {
        radix::<C, 256>(list, spare, least, significant)
    } else {
        radix::<C, 2048>(list, spare, least, significant)
    }
}

/// Radix sort of the `significant` low bits of the distances' bits above `least`, by digits of `RADIX` values.
fn radix<const C: usize, const RADIX: usize>(
    list: &mut [Knot<C>],
    spare: &mut [Knot<C>],
    least: u32,
    significant: u32,
) {
    let width = RADIX.trailing_zeros();
    let passes = significant.div_ceil(width);
    for pass in 0..passes {
        let digit = |k: &Knot<C>| ((k.distance.to_bits() - least) >> (pass * width)) as usize & (RADIX - 1);
        if pass % 2 == 0 { scatter::<C, RADIX>(list, spare, digit) } else { scatter::<C, RADIX>(spare, list, digit) }
    }
    if passes % 2 == 1 {
        list.copy_from_slice(spare);
    }
}

/// One stable counting pass.
fn scatter<const C: usize, const RADIX: usize>(
    from: &[Knot<C>],
    to: &mut [Knot<C>],
    digit: impl Fn(&Knot<C>) -> usize,
) {
    let mut next = [0u32; RADIX];
    from.iter().for_each(|k| next[digit(k)] += 1);
    let mut sum = 0;
    for slot in &mut next {
        sum += std::mem::replace(slot, sum);
    }
    for knot in from {
        let slot = &mut next[digit(knot)];
        to[*slot as usize] = *knot;
        *slot += 1;
    }
}

/// Merges equal distances and replaces absorbances by their running sums; returns the number of knots kept.
///
/// The limit is taken 2⁻²⁰ low: f32 parts of a sum may each be rounded down, and the verdict must not depend on their
/// number.
fn accumulate<const C: usize>(list: &mut [Knot<C>], limit: f32) -> u32 {
    let stop = (f64::from(limit) * (1.0 - 2f64.powi(-20)) * FIXED) as i64;
    let mut sum = [0i64; C];
    let mut kept = 0;
    let mut i = 0;
    while i < list.len() {
        let distance = list[i].distance;
        while i < list.len() && list[i].distance == distance {
            // One entry is held below 2¹⁷, so that the sum of a list that has not stopped cannot overflow.
            (0..C).for_each(|c| sum[c] += (f64::from(list[i].total[c]).min(131_072.0) * FIXED) as i64);
            i += 1;
            if sum.iter().any(|s| *s > i64::MAX / 4) {
                sum = sum.map(|s| s.min(i64::MAX / 4));
            }
        }
        list[kept] = Knot { distance, total: sum.map(|s| (s as f64 / FIXED) as f32) };
        kept += 1;
        if sum.iter().all(|s| *s >= stop) {
            break;
        }
    }
    // What is left over must not tell in which order entries came.
    list[kept..].fill(Knot::ZERO);
    kept as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::InsertionLists;

    fn build(entries: &Entries<1>, cells: usize, limit: f32) -> Lists<1> {
        let ranges = Ranges::new(cells);
        Lists::new(&[Parted::new(entries, ranges)], ranges, limit)
    }

    fn knot(distance: f32, a: f32) -> Knot<1> {
        Knot { distance, total: [a] }
    }

    #[test]
    fn ts06_all_points_in_one_cell() {
        for n in [1000u64, 2000] {
            let mut entries = Entries::<1>::default();
            let mut paper = InsertionLists::new(1, 1e9);
            for i in 0..n {
                let distance = splat_core::rng::unit_f32(6, 0, i, 0);
                entries.cell.push(0);
                entries.knot.push(knot(distance, 1e-3));
                paper.insert(0, distance, 1e-3);
            }
            let lists = build(&entries, 1, 1e9);
            let ours: Vec<f32> = lists.list(0).iter().map(|k| k.distance).collect();
            let theirs: Vec<f32> = paper.list(0).iter().map(|e| e.0).collect();
            assert_eq!(ours, theirs);
            // The paper's insertion steps over n²/4 elements on average; sorting needs n log₂ n comparisons.
            let steps = paper.steps();
            assert!(steps as f64 > 0.2 * (n * n) as f64 && steps > n * 10 * 2, "{steps} steps for {n}");
        }
    }

    #[test]
    fn ts07_verdict_at_the_limit_does_not_depend_on_the_number_of_parts() {
        for n in 1..=400u32 {
            let mut entries = Entries::<1>::default();
            for i in 0..n {
                entries.cell.push(0);
                entries.knot.push(knot(1.0 + i as f32, 2.0 / n as f32));
            }
            entries.cell.push(0);
            entries.knot.push(knot(1e6, 1.0));
            assert_eq!(build(&entries, 1, 2.0).list(0).len() as u32, n, "{n} parts of 2.0 reach the limit of 2.0");
        }
    }

    #[test]
    fn ts08_a_million_small_absorbances_add_up() {
        let n = 1_000_000;
        let mut entries = Entries::<1>::default();
        for i in 0..n {
            entries.cell.push(3);
            entries.knot.push(knot(1.0 + i as f32, 1e-6));
        }
        let lists = build(&entries, 5, 1e9);
        let total = lists.list(3).last().unwrap().total[0];
        let expected = f64::from(1e-6f32) * f64::from(n);
        assert!((f64::from(total) / expected - 1.0).abs() < 1e-6, "{total}");
        assert_eq!(lists.list(2).len() + lists.list(4).len(), 0);
    }

    #[test]
    fn ts11_equal_distances_are_one_knot_in_any_order() {
        let a = [knot(1.0, 0.1), knot(2.0, 0.3), knot(1.0, 0.7), knot(1.0, 0.2)];
        let mut forward = Entries::<1> { cell: vec![0; 4], knot: a.to_vec() };
        let sorted = build(&forward, 1, 9.0);
        forward.knot.reverse();
        assert_eq!(sorted, build(&forward, 1, 9.0));
        assert_eq!(sorted.list(0).len(), 2);
    }
}
