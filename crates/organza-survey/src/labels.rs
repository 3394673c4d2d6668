//! Volumes of labels: whole numbers that name regions, 0 what belongs to none. Their values are no amounts: none of them is thinner than another.

use organza::scene::LabelTable;
use splat_core::Grid;
use splat_core::text::counted;
use std::collections::BTreeSet;

/// Share of neighbours that have the same label, of those of which one has a label: regions are larger than their borders.
const SAME: f64 = 0.7;
/// The same of one label, and the share of labels that have it: the greys of a smoothed edge lie in shells a voxel thick.
const SAME_OF_ONE: f64 = 0.4;
const SOLID: f64 = 0.5;
/// Share of other neighbours between whose numbers the volume has further ones: measured values rise from each to the next one that occurs, labels of
/// regions that touch do not. Numbers alone tell nothing, as greys may be stretched over all bytes.
const JUMPS: f64 = 0.25;
/// The share of [`SAME`], and most numbers, of labels whatever touches what: regions that lie within each other may rise by steps, too.
const NESTED: f64 = 0.9;
const FEW: usize = 32;
/// Numbers from which equal steps above 1 between them are those of greys that were made fewer.
const EVEN: usize = 8;
/// Numbers from which a volume of few values has labels, whatever these are; fewer ones have to be small, so many times their count at most, or have no
/// common divisor. Amounts of phantoms are hundreds.
const MANY: usize = 5;
const SMALL: usize = 4;
/// Most labels that are counted.
const MOST: usize = 4096;
/// Numbers whose rank is listed rather than searched.
const LISTED: u64 = 1 << 20;

/// The labels of a volume, by rising number; 0 among them where some voxels have none.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Labels(pub(crate) Vec<f64>);

impl Labels {
    /// What is said of them.
    pub(crate) fn said(&self) -> String {
        /// Labels up to which each is named.
        const NAMED: usize = 16;
        let known = || self.0.iter().filter(|label| **label > 0.0);
        let names: Vec<String> = known().take(NAMED).map(f64::to_string).collect();
        let more = if known().count() > NAMED { " …" } else { "" };
        let count = counted(known().count() as u64, "label");
        format!(
            "its whole numbers look like {count}, not amounts: {}{more}; `mesh = ` draws the surface of each",
            names.join(", ")
        )
    }

    /// `None` for a volume whose values are amounts.
    pub(crate) fn from_grid(grid: &Grid) -> Option<Self> {
        if !grid.values.iter().all(is_label) {
            return None;
        }
        let mut touching = 0u64;
        let mut same = 0u64;
        each_pair(grid, |a, b| {
            touching += 1;
            same += u64::from(a == b);
        });
        let others = touching - same;
        if touching == 0 || others == 0 || (same as f64) < SAME * touching as f64 {
            return None;
        }
        let known = Self::of_whole_numbers(grid)?;
        let ranks = Ranks::new(&known.0);
        let mut jumps = 0u64;
        // Of each label its neighbours, and those of them that have it too.
        let mut counts = vec![[0u64; 2]; known.0.len()];
        each_pair(grid, |a, b| {
            let rank = ranks.rank(a);
            counts[rank][0] += 1;
            if a == b {
                counts[rank][1] += 1;
                return;
            }
            let other = ranks.rank(b);
            counts[other][0] += 1;
            jumps += u64::from(rank.abs_diff(other) >= 2);
        });
        let is_solid = |[neighbours, same]: &&[u64; 2]| *same as f64 >= SAME_OF_ONE * *neighbours as f64;
        let regions = || counts.iter().zip(&known.0).filter(|(_, label)| **label > 0.0).map(|(counts, _)| counts);
        if (regions().filter(is_solid).count() as f64) < SOLID * regions().count() as f64 {
            return None;
        }
        known
            .are_numbered(jumps as f64 >= JUMPS * others as f64, same as f64 >= NESTED * touching as f64)
            .then_some(known)
    }

    /// Those of a volume for which there is a table: it looks like one of labels, or the table has all of its numbers.
    pub(crate) fn by_table(grid: &Grid, table: &LabelTable) -> Option<Self> {
        let is_in_table = |known: &Self| known.0.iter().all(|label| *label == 0.0 || table.get(*label).is_some());
        Self::of_whole_numbers(grid)
            .filter(|known| known.0.iter().any(|label| *label > 0.0) && is_in_table(known))
            .or_else(|| Self::from_grid(grid))
    }

    /// The numbers of a volume of whole ones from 0 on; `None` for another one, and for one of too many.
    pub(crate) fn of_whole_numbers(grid: &Grid) -> Option<Self> {
        let mut known = BTreeSet::new();
        let mut last = -1.0;
        for value in &grid.values {
            if !is_label(value) {
                return None;
            }
            if *value != last && !value.is_nan() {
                last = *value;
                known.insert(last as u64);
            }
            if known.len() > MOST {
                return None;
            }
        }
        Some(Self(known.into_iter().map(|label| label as f64).collect()))
    }

    /// Whether they are numbers that labels have: `have_jumps` where numbers that do not follow each other touch, `are_nested` where regions are large.
    fn are_numbered(&self, have_jumps: bool, are_nested: bool) -> bool {
        let count = self.0.len();
        let highest = self.0.last().copied().unwrap_or(0.0) as usize;
        let steps = || self.0.windows(2).map(|pair| pair[1] - pair[0]);
        let least = steps().fold(f64::INFINITY, f64::min);
        // Rounding makes steps of 3 and 4 from 3.2.
        let is_stretched = count >= EVEN && least >= 2.0 && steps().all(|step| step <= least + 1.0);
        // A quantity that rises from 2 to 7 takes what lies between.
        let has_holes = highest >= count && highest < SMALL * count;
        if !have_jumps && (is_stretched || count > FEW || !(are_nested || has_holes)) {
            return false;
        }
        let are_counts = || self.0.iter().fold(0, |a, b| common_divisor(a, *b as u64)) == 1;
        count >= MANY || (count >= 3 && (highest < SMALL * count || are_counts()))
    }
}

/// Whether a voxel may have a label, or none.
fn is_label(value: &f32) -> bool {
    value.is_nan() || (*value >= 0.0 && value.fract() == 0.0)
}

/// Each two voxels that are neighbours in a layer and one of which has a label.
fn each_pair(grid: &Grid, mut pair: impl FnMut(f32, f32)) {
    let [columns, rows, _] = grid.dims;
    let mut each = |a: f32, b: f32| {
        if a.max(b) > 0.0 {
            // A voxel without a value has no label.
            pair(a.max(0.0), b.max(0.0));
        }
    };
    for (row, values) in grid.values.chunks(columns).enumerate() {
        values.windows(2).for_each(|pair| each(pair[0], pair[1]));
        if row % rows > 0 {
            let before = &grid.values[(row - 1) * columns..row * columns];
            before.iter().zip(values).for_each(|(a, b)| each(*a, *b));
        }
    }
}

/// The ranks of numbers among those that a volume has.
struct Ranks<'a> {
    known: &'a [f64],
    /// Those of the numbers below [`LISTED`].
    listed: Vec<u16>,
}

impl<'a> Ranks<'a> {
    fn new(known: &'a [f64]) -> Self {
        let highest = known.last().map_or(0, |label| *label as u64).min(LISTED);
        let mut listed = vec![0; highest as usize + 1];
        for (rank, label) in known.iter().enumerate().filter(|(_, label)| **label <= highest as f64) {
            listed[*label as usize] = rank as u16;
        }
        Self { known, listed }
    }

    fn rank(&self, value: f32) -> usize {
        let value = f64::from(value);
        let searched = || self.known.partition_point(|label| *label < value).min(self.known.len().saturating_sub(1));
        self.listed.get(value as usize).map_or_else(searched, |rank| usize::from(*rank))
    }
}

/// The greatest common divisor.
fn common_divisor(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { common_divisor(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::glam::{DMat3, DVec3};

    fn volume(value: impl Fn(usize, usize, usize) -> f32) -> Grid {
        let values = (0..20 * 20 * 20).map(|i| value(i % 20, i / 20 % 20, i / 400)).collect();
        Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims: [20; 3], values }
    }

    /// Four bars, each of the label that `label` gives its rank.
    fn bars(label: impl Fn(usize) -> f32) -> Grid {
        volume(|x, y, _| {
            let is_inside = (2..8).contains(&(x % 10)) && (2..8).contains(&(y % 10));
            if is_inside { label(1 + x / 10 + 2 * (y / 10)) } else { 0.0 }
        })
    }

    /// Each voxel so many times along each axis.
    fn finer(grid: &Grid, times: usize) -> Grid {
        let [columns, rows, layers] = grid.dims.map(|n| n * times);
        let value = |i: usize| {
            let [x, y, z] = [i % columns, i / columns % rows, i / (columns * rows)].map(|n| n / times);
            grid.values[x + grid.dims[0] * (y + grid.dims[1] * z)]
        };
        let values = (0..columns * rows * layers).map(value).collect();
        Grid { dims: [columns, rows, layers], values, ..grid.clone() }
    }

    #[test]
    fn regions_of_one_number_are_labels_and_amounts_are_none() {
        assert_eq!(Labels::from_grid(&bars(|rank| rank as f32)), Some(Labels(vec![0.0, 1.0, 2.0, 3.0, 4.0])));
        assert_eq!(Labels::from_grid(&bars(|rank| (rank * rank * 100) as f32)).map(|l| l.0.len()), Some(5));
        assert_eq!(Labels::from_grid(&bars(|rank| rank.min(2) as f32)).map(|l| l.0.len()), Some(3));
        // A mask, a phantom of two amounts, a fraction, a negative number.
        assert_eq!(Labels::from_grid(&bars(|_| 255.0)), None);
        assert_eq!(Labels::from_grid(&bars(|rank| if rank > 2 { 200.0 } else { 100.0 })), None);
        assert_eq!(Labels::from_grid(&bars(|rank| rank as f32 + 0.5)), None);
        assert_eq!(Labels::from_grid(&bars(|rank| -(rank as f32))), None);
        // Shells around each other.
        let shell = |x: usize, y: usize, z: usize| {
            let from_middle = [x, y, z].map(|n| n.abs_diff(10)).into_iter().max().unwrap_or(0);
            if from_middle < 9 { (5 - from_middle.min(8) / 2) as f32 } else { 0.0 }
        };
        let shells = Grid { dims: [20; 3], ..volume(shell) };
        assert_eq!(Labels::from_grid(&finer(&shells, 4)).map(|l| l.0.len()), Some(6));
        // The same in few voxels with a number that is left out, and two regions with small numbers.
        let ball = |center: usize, radius: usize| {
            move |x: usize, y: usize, z: usize| {
                [x.abs_diff(center), y.abs_diff(10), z.abs_diff(10)].iter().map(|d| d * d).sum::<usize>()
                    < radius * radius
            }
        };
        let [around, inner, core] = [ball(10, 9), ball(10, 6), ball(10, 3)];
        let nested = volume(|x, y, z| match (around(x, y, z), inner(x, y, z), core(x, y, z)) {
            (_, _, true) => 7.0,
            (_, true, _) => 2.0,
            (true, ..) => 1.0,
            _ => 0.0,
        });
        assert_eq!(Labels::from_grid(&nested), Some(Labels(vec![0.0, 1.0, 2.0, 7.0])));
        let [left, right] = [ball(5, 5), ball(15, 5)];
        let two = volume(|x, y, z| {
            if left(x, y, z) {
                3.0
            } else if right(x, y, z) {
                7.0
            } else {
                0.0
            }
        });
        assert_eq!(Labels::from_grid(&two), Some(Labels(vec![0.0, 3.0, 7.0])));
        let hippocampi =
            Grid { values: two.values.iter().map(|v| [0.0, 17.0, 53.0][(*v as usize).div_ceil(4)]).collect(), ..two };
        assert_eq!(Labels::from_grid(&hippocampi), Some(Labels(vec![0.0, 17.0, 53.0])));
        // Smooth waves in 81 greys, and in 41 and 16 of all bytes, with and without an order of steps; the same as a mask with soft edges.
        let wave = |x: usize, y: usize, z: usize| {
            let at = |n: usize| libm::sin(n as f64 / 29.0);
            0.5 + 0.25 * (at(x) * at(2 * y) + at(z + 31))
        };
        for greys in [15.0, 40.0, 80.0] {
            let fine = |factor: f64| {
                let value = |i: usize| ((wave(i % 60, i / 60 % 60, i / 3600) * greys).round() * factor).round() as f32;
                Grid { dims: [60; 3], values: (0..60 * 60 * 60).map(value).collect(), ..volume(|_, _, _| 0.0) }
            };
            for factor in [3.0, 255.0 / greys] {
                assert_eq!(Labels::from_grid(&fine(factor)), None, "{greys} greys times {factor}");
            }
        }
        let soft = |x: usize, _: usize, _: usize| (20.0 * (x as f32 - 9.0)).clamp(0.0, 255.0);
        assert_eq!(Labels::from_grid(&volume(soft)), None);
        // A volume without any value in some voxels.
        let mut gaps = bars(|rank| rank as f32);
        gaps.values[0] = f32::NAN;
        assert_eq!(Labels::from_grid(&gaps).map(|l| l.0.len()), Some(5));
        // What rises by steps, and what scatters.
        assert_eq!(Labels::from_grid(&volume(|x, y, z| ((x + y + z) / 4) as f32)), None);
        assert_eq!(Labels::from_grid(&volume(|x, y, z| ((x * 7919 + y * 104_729 + z * 31) % 251) as f32)), None);
    }
}
