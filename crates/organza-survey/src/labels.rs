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
/// The share of [`JUMPS`] below which numbers rise by steps only, as those of a smooth picture and of regions within each other do.
const ORDERED: f64 = 0.01;
/// One part more for so many regions within each other: a thin one may be broken once.
const MORE_PARTS: usize = 4;
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
    /// How `info` reports them.
    pub(crate) fn said(&self) -> String {
        let known: Vec<f64> = self.regions().collect();
        let count = counted(known.len() as u64, "label");
        format!(
            "its whole numbers look like {count}, not amounts: {}; `mesh = ` draws the surface of each, `volume = ` takes them for amounts",
            listed(&known)
        )
    }

    /// A sentence about amounts, with `way`, which draws labels, where the volume can have such.
    pub(crate) fn doubt(said: &str, grid: &Grid, way: &str) -> String {
        let can = Self::whole(grid).is_ok();
        format!("{said}; {}", if can { way } else { "labels are whole numbers from 0, or -1 for none" })
    }

    /// The numbers of regions, by rising number.
    pub(crate) fn regions(&self) -> impl Iterator<Item = f64> {
        self.0.iter().copied().filter(|label| *label > 0.0)
    }

    /// The labels of a volume of such; of amounts that could be labels as well, the reason why they are taken for amounts.
    pub(crate) fn from_grid(grid: &Grid) -> Reading {
        let doubtful = |reason: &str| match few_numbers(grid) {
            Some(numbers) => Reading::Doubtful(format!(
                "its {} ({}) are taken for amounts, not for labels: {reason}",
                counted(numbers.len() as u64, "whole number"),
                listed(&numbers)
            )),
            None => Reading::Amounts,
        };
        if let Some(odd) = grid.values.iter().find(|value| !is_label(value)) {
            return doubtful(&format!("{odd} names no region"));
        }
        let within_layers = count_pairs(grid, false);
        // Regions that lie on each other meet between layers alone, which else are too far apart to tell.
        let between_layers = within_layers[0] == within_layers[1];
        let [touching, same] = if between_layers { count_pairs(grid, true) } else { within_layers };
        let others = touching - same;
        if touching == 0 || others == 0 {
            return doubtful("nothing parts regions");
        }
        if (same as f64) < SAME * touching as f64 {
            return doubtful("voxels of one number are scattered");
        }
        let Some(known) = Self::of_whole_numbers(grid) else { return Reading::Amounts };
        let ranks = Ranks::new(&known.0);
        let mut jumps = 0u64;
        // Of each label its neighbours, and those of them that have it too.
        let mut counts = vec![[0u64; 2]; known.0.len()];
        each_pair(grid, between_layers, |a, b| {
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
            return doubtful("voxels of one number are scattered");
        }
        if known.0.len() > 2 && (jumps as f64) < ORDERED * others as f64 && !known.are_nested(grid) {
            return doubtful("they rise by steps, as the greys of a smooth picture do");
        }
        let has_jumps = jumps as f64 >= JUMPS * others as f64;
        match known.are_numbered(has_jumps, same as f64 >= NESTED * touching as f64) {
            true => Reading::Labels(known),
            false if known.0.len() <= 2 => doubtful("two numbers may be a mask, too"),
            false => doubtful("they have the steps of amounts"),
        }
    }

    /// The labels of a volume for which there is a table: it looks like one of labels, or the table has all of its numbers.
    ///
    /// # Errors
    /// The reason why it has none, as the end of a sentence.
    pub(crate) fn by_table(grid: &Grid, table: &LabelTable) -> Result<Self, String> {
        let known = Self::whole(grid)?;
        let missing: Vec<f64> = known.regions().filter(|label| table.get(*label).is_none()).collect();
        if missing.is_empty() {
            return Ok(known);
        }
        match Self::from_grid(grid) {
            Reading::Labels(labels) => Ok(labels),
            Reading::Doubtful(_) | Reading::Amounts => Err(format!(
                "the table lacks {} of its {}: {}",
                missing.len(),
                counted(known.regions().count() as u64, "number"),
                listed(&missing)
            )),
        }
    }

    /// The labels of a volume that a user calls one of labels.
    ///
    /// # Errors
    /// The reason why it can have none, as the end of a sentence.
    pub(crate) fn whole(grid: &Grid) -> Result<Self, String> {
        if let Some(odd) = grid.values.iter().find(|value| !is_label(value)) {
            return Err(format!("it has the value {odd}, and labels are whole numbers from 0, or -1 for none"));
        }
        let known = Self::of_whole_numbers(grid).ok_or_else(|| format!("it has more than {MOST} numbers"))?;
        if known.regions().next().is_none() { Err("it has no number above 0".to_owned()) } else { Ok(known) }
    }

    /// The numbers of a volume of whole ones from 0 on, where -1 is as 0; `None` for another one, and for one of too many.
    pub(crate) fn of_whole_numbers(grid: &Grid) -> Option<Self> {
        let mut known = BTreeSet::new();
        let mut last = f32::NAN;
        for value in &grid.values {
            if !is_label(value) {
                return None;
            }
            if *value != last && !value.is_nan() {
                last = *value;
                known.insert(last.max(0.0) as u64);
            }
            if known.len() > MOST {
                return None;
            }
        }
        Some(Self(known.into_iter().map(|label| label as f64).collect()))
    }

    /// Whether regions whose numbers rise by steps lie within each other, each in one part; the greys of a picture lie in many.
    fn are_nested(&self, grid: &Grid) -> bool {
        let steps = || self.0.windows(2).map(|pair| pair[1] - pair[0]);
        let least = steps().fold(f64::INFINITY, f64::min);
        let are_even = least >= 2.0 && steps().all(|step| step <= least + 1.0);
        !are_even && parts(grid) <= self.0.len() + self.0.len() / MORE_PARTS
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

/// The meaning of the values of a volume.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Reading {
    Labels(Labels),
    /// Amounts that could be labels as well: a sentence about them, with the reason.
    Doubtful(String),
    Amounts,
}

impl Reading {
    /// The labels, if they are such.
    pub(crate) fn labels(self) -> Option<Labels> {
        if let Self::Labels(labels) = self { Some(labels) } else { None }
    }
}

/// Whether a voxel may have a label, or none.
fn is_label(value: &f32) -> bool {
    value.is_nan() || *value == -1.0 || (*value >= 0.0 && value.fract() == 0.0)
}

/// The numbers of a volume that has a few whole ones, rising; `None` for another one.
fn few_numbers(grid: &Grid) -> Option<Vec<f64>> {
    let mut known: Vec<f32> = Vec::new();
    let mut last = f32::NAN;
    for value in grid.values.iter().filter(|value| !value.is_nan()) {
        if *value == last {
            continue;
        }
        last = *value;
        if value.fract() != 0.0 {
            return None;
        }
        if let Err(place) = known.binary_search_by(|number| number.total_cmp(&(value + 0.0))) {
            known.insert(place, value + 0.0);
        }
        if known.len() > FEW {
            return None;
        }
    }
    (known.len() >= 2).then(|| known.into_iter().map(f64::from).collect())
}

/// Some numbers in words.
fn listed(numbers: &[f64]) -> String {
    /// Numbers up to which each is named.
    const NAMED: usize = 16;
    let names: Vec<String> = numbers.iter().take(NAMED).map(f64::to_string).collect();
    let more = numbers.len().saturating_sub(NAMED);
    names.join(", ") + &if more > 0 { format!(" and {more} more") } else { String::new() }
}

/// How many connected parts of one number a volume has, by common faces.
fn parts(grid: &Grid) -> usize {
    let [columns, rows, _] = grid.dims;
    // Each part is a tree of places, whose root is its first one.
    let mut above: Vec<u32> = Vec::new();
    let root = |above: &[u32], mut place: u32| {
        while above[place as usize] != place {
            place = above[place as usize];
        }
        place
    };
    let number = |at: usize| grid.values[at].max(0.0);
    let layer = columns * rows;
    let mut places = vec![0u32; layer];
    let mut parts = 0;
    for (at, place) in (0..grid.values.len()).map(|at| (at, at % layer)) {
        let before = [
            (place % columns > 0).then(|| (at - 1, place - 1)),
            (place >= columns).then(|| (at - columns, place - columns)),
            (at >= layer).then(|| (at - layer, place)),
        ];
        let mut found: Option<u32> = None;
        for (_, of_other) in before.into_iter().flatten().filter(|(other, _)| number(*other) == number(at)) {
            let other = root(&above, places[of_other]);
            match found {
                Some(first) if first != other => {
                    let [low, high] = [first.min(other), first.max(other)];
                    above[high as usize] = low;
                    found = Some(low);
                    parts -= 1;
                }
                _ => found = Some(other),
            }
        }
        places[place] = found.unwrap_or_else(|| {
            parts += 1;
            above.push(above.len() as u32);
            above.len() as u32 - 1
        });
    }
    parts
}

/// How many pairs of neighbours there are, and how many of the same label.
fn count_pairs(grid: &Grid, between_layers: bool) -> [u64; 2] {
    let mut counts = [0u64; 2];
    each_pair(grid, between_layers, |a, b| {
        counts[0] += 1;
        counts[1] += u64::from(a == b);
    });
    counts
}

/// Each two voxels that are neighbours in a layer, or in the next one too, and one of which has a label.
fn each_pair(grid: &Grid, between_layers: bool, mut pair: impl FnMut(f32, f32)) {
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
        if let Some(before) = row.checked_sub(rows).filter(|_| between_layers) {
            let before = &grid.values[before * columns..(before + 1) * columns];
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

    fn labels(grid: &Grid) -> Option<Labels> {
        Labels::from_grid(grid).labels()
    }

    /// White noise, blurred by a Gaussian and quantised to so many greys over its range.
    fn noise(size: usize, sigma: f64, greys: f64) -> Grid {
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64
        };
        let mut values: Vec<f64> = (0..size.pow(3)).map(|_| random()).collect();
        let reach = (3.0 * sigma) as i64;
        let weights: Vec<f64> = (-reach..=reach).map(|d| libm::exp(-0.5 * (d as f64 / sigma).powi(2))).collect();
        for stride in [1, size, size * size] {
            let at = |i: usize, d: i64| {
                let place = (i / stride % size) as i64;
                let moved = (place + d).rem_euclid(size as i64);
                (i as i64 + (moved - place) * stride as i64) as usize
            };
            let blurred = |i: usize| weights.iter().zip(-reach..).map(|(w, d)| w * values[at(i, d)]).sum();
            values = (0..values.len()).map(blurred).collect();
        }
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let grey = |value: &f64| ((value - low) / (high - low) * greys).floor().min(greys - 1.0) as f32;
        Grid { dims: [size; 3], values: values.iter().map(grey).collect(), ..volume(|_, _, _| 0.0) }
    }

    #[test]
    fn smooth_noise_in_few_greys_is_amounts_and_the_doubt_is_told() {
        for (size, sigma, greys) in [(64, 6.0, 6.0), (48, 6.0, 6.0), (48, 6.0, 4.0), (48, 4.0, 12.0)] {
            let found = Labels::from_grid(&noise(size, sigma, greys));
            let Reading::Doubtful(said) = found else { panic!("{size} {sigma} {greys}: {found:?}") };
            assert!(said.contains("taken for amounts") && said.contains("rise by steps"), "{said}");
        }
    }

    #[test]
    fn regions_that_all_touch_are_labels_and_a_mask_is_told() {
        // Three sectors around an edge, without nothing around them.
        let sectors = volume(|x, y, _| if y < 10 { 1.0 } else { 2.0 + f32::from(u8::from(x < 10)) });
        assert_eq!(labels(&sectors), Some(Labels(vec![1.0, 2.0, 3.0])));
        let centers = [[4, 5, 6], [15, 6, 9], [9, 15, 12]];
        let cells = volume(|x, y, z| {
            let far = |c: [usize; 3]| x.abs_diff(c[0]).pow(2) + y.abs_diff(c[1]).pow(2) + z.abs_diff(c[2]).pow(2);
            (0..3).min_by_key(|i| far(centers[*i])).map_or(0.0, |i| 1.0 + i as f32)
        });
        assert_eq!(labels(&cells), Some(Labels(vec![1.0, 2.0, 3.0])));
        let layers = volume(|_, _, z| 1.0 + (z / 7) as f32);
        assert_eq!(labels(&layers), Some(Labels(vec![1.0, 2.0, 3.0])));
        let told = |grid: &Grid| match Labels::from_grid(grid) {
            Reading::Doubtful(said) => said,
            other => panic!("{other:?}"),
        };
        assert!(told(&bars(|_| 5.0)).starts_with("its 2 whole numbers (0, 5) are taken for amounts"));
        assert!(told(&bars(|rank| -3.0 * rank as f32)).ends_with("-3 names no region"));
        let around = |grid: Grid| Grid {
            values: grid.values.iter().map(|v| if *v == 0.0 { -1.0 } else { *v }).collect(),
            ..grid
        };
        assert_eq!(labels(&around(bars(|rank| rank as f32))).map(|known| known.0.len()), Some(5));
        assert_eq!(Labels::from_grid(&volume(|x, y, z| (x + 20 * (y + 20 * z)) as f32)), Reading::Amounts);
    }

    #[test]
    fn a_table_that_lacks_a_number_names_it() {
        let table = LabelTable::from_iter([(5, organza::scene::Label::default())]);
        assert_eq!(Labels::by_table(&bars(|_| 5.0), &table), Ok(Labels(vec![0.0, 5.0])));
        let two = bars(|rank| if rank > 2 { 200.0 } else { 5.0 });
        assert_eq!(Labels::by_table(&two, &table), Err("the table lacks 1 of its 2 numbers: 200".to_owned()));
        let half = bars(|rank| rank as f32 + 0.5);
        assert!(Labels::by_table(&half, &table).is_err_and(|said| said.starts_with("it has the value 1.5")));
    }

    #[test]
    fn regions_of_one_number_are_labels_and_amounts_are_none() {
        assert_eq!(labels(&bars(|rank| rank as f32)), Some(Labels(vec![0.0, 1.0, 2.0, 3.0, 4.0])));
        assert_eq!(labels(&bars(|rank| (rank * rank * 100) as f32)).map(|l| l.0.len()), Some(5));
        assert_eq!(labels(&bars(|rank| rank.min(2) as f32)).map(|l| l.0.len()), Some(3));
        // A mask, a phantom of two amounts, a fraction, a negative number.
        assert_eq!(labels(&bars(|_| 255.0)), None);
        assert_eq!(labels(&bars(|rank| if rank > 2 { 200.0 } else { 100.0 })), None);
        assert_eq!(labels(&bars(|rank| rank as f32 + 0.5)), None);
        assert_eq!(labels(&bars(|rank| -(rank as f32))), None);
        // Shells around each other.
        let shell = |x: usize, y: usize, z: usize| {
            let from_middle = [x, y, z].map(|n| n.abs_diff(10)).into_iter().max().unwrap_or(0);
            if from_middle < 9 { (5 - from_middle.min(8) / 2) as f32 } else { 0.0 }
        };
        let shells = Grid { dims: [20; 3], ..volume(shell) };
        assert_eq!(labels(&finer(&shells, 4)).map(|l| l.0.len()), Some(6));
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
        assert_eq!(labels(&nested), Some(Labels(vec![0.0, 1.0, 2.0, 7.0])));
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
        assert_eq!(labels(&two), Some(Labels(vec![0.0, 3.0, 7.0])));
        let hippocampi =
            Grid { values: two.values.iter().map(|v| [0.0, 17.0, 53.0][(*v as usize).div_ceil(4)]).collect(), ..two };
        assert_eq!(labels(&hippocampi), Some(Labels(vec![0.0, 17.0, 53.0])));
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
                assert_eq!(labels(&fine(factor)), None, "{greys} greys times {factor}");
            }
        }
        let soft = |x: usize, _: usize, _: usize| (20.0 * (x as f32 - 9.0)).clamp(0.0, 255.0);
        assert_eq!(labels(&volume(soft)), None);
        // A volume without any value in some voxels.
        let mut gaps = bars(|rank| rank as f32);
        gaps.values[0] = f32::NAN;
        assert_eq!(labels(&gaps).map(|l| l.0.len()), Some(5));
        // What rises by steps, and what scatters.
        assert_eq!(labels(&volume(|x, y, z| ((x + y + z) / 4) as f32)), None);
        assert_eq!(labels(&volume(|x, y, z| ((x * 7919 + y * 104_729 + z * 31) % 251) as f32)), None);
    }
}
