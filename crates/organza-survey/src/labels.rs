//! Volumes of labels: whole numbers that name regions, 0 what belongs to none. Their values are no amounts: none of them is thinner than another.

use splat_core::Grid;
use splat_core::text::counted;
use std::collections::BTreeSet;

/// Share of neighbours that have the same label, of those of which one has a label: regions are larger than their borders.
const SAME: f64 = 0.7;
/// Share of other neighbours whose numbers are no successors: measured values rise by steps, labels of regions that touch do not.
const JUMPS: f64 = 0.25;
/// The share of [`SAME`], and most numbers, of labels whatever touches what: regions that lie within each other may rise by steps, too.
const NESTED: f64 = 0.9;
const FEW: usize = 64;
/// Numbers from which a volume of few values has labels, whatever these are; fewer ones have to be small, so many times their count at most, or have no
/// common divisor. Amounts of phantoms are hundreds.
const MANY: usize = 5;
const SMALL: usize = 4;
/// Most labels that are counted.
const MOST: usize = 4096;

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
        let is_label = |value: &f32| value.is_nan() || (*value >= 0.0 && value.fract() == 0.0);
        if !grid.values.iter().all(is_label) {
            return None;
        }
        let [columns, rows, _] = grid.dims;
        let mut touching = 0u64;
        let mut same = 0u64;
        let mut jumps = 0u64;
        let mut count = |a: f32, b: f32| {
            if a.max(b) > 0.0 {
                touching += 1;
                same += u64::from(a == b);
                jumps += u64::from((a - b).abs() >= 2.0);
            }
        };
        for (row, values) in grid.values.chunks(columns).enumerate() {
            values.windows(2).for_each(|pair| count(pair[0], pair[1]));
            if row % rows > 0 {
                let before = &grid.values[(row - 1) * columns..row * columns];
                before.iter().zip(values).for_each(|(a, b)| count(*a, *b));
            }
        }
        let others = touching - same;
        if touching == 0 || others == 0 || (same as f64) < SAME * touching as f64 {
            return None;
        }
        let mut known = BTreeSet::new();
        let mut last = -1.0;
        for value in grid.values.iter().filter(|value| !value.is_nan()) {
            if *value != last {
                last = *value;
                known.insert(last as u64);
            }
            if known.len() > MOST {
                return None;
            }
        }
        let highest = known.last().copied().unwrap_or(0) as usize;
        let jump = jumps as f64 >= JUMPS * others as f64;
        let are_nested = same as f64 >= NESTED * touching as f64 && known.len() <= FEW;
        // A quantity that rises from 2 to 7 takes what lies between.
        let has_holes = highest >= known.len() && known.len() <= FEW && highest < SMALL * known.len();
        if !jump && !are_nested && !has_holes {
            return None;
        }
        let are_small = highest < SMALL * known.len();
        let are_counts = || known.iter().fold(0, |a, b| common_divisor(a, *b)) == 1;
        let are_numbered = known.len() >= MANY || (known.len() >= 3 && (are_small || are_counts()));
        are_numbered.then(|| Self(known.into_iter().map(|label| label as f64).collect()))
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
        // What rises by steps, and what scatters.
        assert_eq!(Labels::from_grid(&volume(|x, y, z| ((x + y + z) / 4) as f32)), None);
        assert_eq!(Labels::from_grid(&volume(|x, y, z| ((x * 7919 + y * 104_729 + z * 31) % 251) as f32)), None);
    }
}
