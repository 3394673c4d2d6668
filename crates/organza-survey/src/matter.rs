//! Which values of a volume are matter and which are what is around it.
//!
//! What is around a scanned body is quiet and lies at the border of the volume: the median of the border's values is that of air, as far
//! as they differ little from it. A threshold by Otsu parts matter from it, on the side of it where more values lie. A volume
//! whose border is not quiet is matter all through; then its higher values show. A field of both signs around a quiet or mean value near 0 is
//! matter to both sides of it. Voxels that are NaN are nothing: where they are what is around, all others are matter.

use crate::histogram::{Histogram, quantile_of};
use splat_core::Grid;

/// Bins in which values are parted.
const BINS: usize = 512;
/// Spread of a border's values over that of all, up to which it is quiet.
const QUIET: f64 = 0.2;
/// Share of the values at each end that count as outliers.
const OUTLIERS: f64 = 0.0005;
/// Most values that are looked at for outliers.
const SAMPLE: usize = 1 << 20;
/// How far below the lowest value matter begins to show where gaps are around it, over the spread of the values.
const FOOT_OF_GAPS: f64 = 0.25;
/// Where between air and the threshold matter begins to show.
const FOOT: f64 = 0.6;

/// The values of a volume, parted.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Matter {
    /// All values that are no outliers.
    pub(crate) histogram: Histogram,
    /// The value of what is around, where there is such.
    pub(crate) air: Option<f64>,
    /// The value at which matter begins to show.
    pub(crate) first: f64,
    /// The value of the densest matter; below [`Self::first`] where matter has lower values than air.
    pub(crate) last: f64,
    /// First and last value of the matter on the other side of 0, of a field of both signs.
    pub(crate) opposite: Option<[f64; 2]>,
}

/// The lesser of both ends of the values over the larger, from which a field has both signs.
const BOTH_SIGNS: f64 = 0.1;
/// The distance of what is around from 0 over the spread of the values, up to which it is 0.
const ABOUT_ZERO: f64 = 0.05;
/// Share of the values on the side where fewer lie, of those on the other, from which both sides are matter.
const BOTH_SIDES: f64 = 0.01;

/// Hounsfield units between which values are taken for such.
const UNITS: [f64; 2] = [-500.0, 100.0];
/// Hounsfield units above which a body has little but bone: above flesh and clotted blood, in the lower half of spongy bone.
const DENSE: f64 = 220.0;
/// Hounsfield units below which nothing in a body lies but air: half of the way to water.
const LIGHTEST: f64 = -500.0;

impl Matter {
    /// That of a volume of which nothing else is known.
    #[cfg(test)]
    pub(crate) fn from_grid(grid: &Grid) -> Option<Self> {
        Self::in_surroundings(grid, None)
    }

    /// That of a volume that may have been sampled from cells, with a value `outside` of them: they may fill its border, and what is quiet there is matter
    /// then. `None` for a volume of one value.
    pub(crate) fn in_surroundings(grid: &Grid, outside: Option<f64>) -> Option<Self> {
        let range = usual_range(&grid.values)?;
        let histogram = Histogram::new(&grid.values, range, BINS);
        let spread = histogram.high - histogram.low;
        let (mut border, gaps) = border(grid);
        if gaps > border.len() {
            // What is around has no value: all that has one is matter, the lowest of it thin.
            let first = histogram.low - FOOT_OF_GAPS * spread;
            let last = histogram.high;
            return Some(Self { histogram, air: None, first, last, opposite: None });
        }
        let [low, air, high] = [0.1, 0.5, 0.9].map(|share| quantile_of(&mut border, share));
        let has_air = high - low < QUIET * spread;
        let [low, air, high] = outside.filter(|_| has_air).map_or([low, air, high], |outside| [outside; 3]);
        // Air around a body is what most of a tomogram is; where nothing is quiet, the range has to tell.
        let is_of_units = is_in_units(&histogram) && (!has_air || air < LIGHTEST);
        let is_signed = histogram.low < 0.0 && histogram.high > 0.0 && !is_of_units && has_both_signs(&histogram);
        if !has_air {
            let last = histogram.quantile(0.998);
            if is_signed {
                let opposite = Some([0.0, histogram.quantile(0.002).min(-histogram.width())]);
                return Some(Self { air: None, first: 0.0, last: last.max(histogram.width()), opposite, histogram });
            }
            let first = histogram.quantile(0.4);
            let last = if last > first { last } else { histogram.high };
            return Some(Self { histogram, air: None, first, last, opposite: None });
        }
        // Farther away than air scatters by itself.
        let low = histogram.bin(low);
        let high = histogram.bin(high);
        let above = sum(&histogram.counts[(2 * high - low + 1).min(BINS)..]);
        let below = sum(&histogram.counts[..(2 * low).saturating_sub(high)]);
        let is_above = above >= below;
        let [first, last] = side(&histogram, air, is_above);
        let is_about_zero = is_signed && air.abs() <= ABOUT_ZERO * spread;
        let has_both = is_about_zero && above.min(below) as f64 >= BOTH_SIDES * above.max(below) as f64;
        let opposite = has_both.then(|| side(&histogram, air, !is_above));
        Some(Self { histogram, air: Some(air), first, last, opposite })
    }

    /// Whether values look like Hounsfield units, of air to bone: around a body lies air, of about -1000. A field around 0 has none, whatever its
    /// range.
    pub(crate) fn has_units(&self) -> bool {
        is_in_units(&self.histogram) && self.air.is_none_or(|air| air < LIGHTEST)
    }

    /// Whether a tomogram in Hounsfield units has bones: more than a five-hundredth of what is no air is denser than flesh and blood.
    pub(crate) fn has_bones(&self) -> bool {
        const FEW: f64 = 0.002;
        let counts = &self.histogram.counts;
        let above = |value: f64| sum(&counts[self.histogram.bin(value)..]) as f64;
        self.histogram.high > DENSE && above(DENSE) > FEW * above(LIGHTEST)
    }

    /// The value that parts what is dense from the rest of matter: bone from flesh.
    pub(crate) fn dense(&self) -> f64 {
        let a = self.histogram.bin(self.first);
        let b = self.histogram.bin(self.last);
        self.histogram.parting(a.min(b)..a.max(b) + 1)
    }

    /// The most frequent value of matter that is no air: of soft tissue in a body.
    pub(crate) fn bulk(&self) -> f64 {
        let a = self.histogram.bin(self.first);
        let b = self.histogram.bin(self.last);
        let bins = a.min(b)..a.max(b) + 1;
        // Bins beside it count, so that one that is full by chance is none.
        let around = |i: &usize| sum(&self.histogram.counts[i.saturating_sub(4)..(i + 5).min(BINS)]);
        self.histogram.middle(bins.max_by_key(around).unwrap_or(a))
    }
}

/// Whether both ends of the values lie about as far from 0.
fn has_both_signs(histogram: &Histogram) -> bool {
    let [low, high] = [histogram.low.abs(), histogram.high.abs()];
    low.min(high) >= BOTH_SIGNS * low.max(high)
}

/// Whether values reach from air to bone, as Hounsfield units do.
fn is_in_units(histogram: &Histogram) -> bool {
    histogram.low < UNITS[0] && histogram.high > UNITS[1]
}

/// First and last value of the matter above or below air.
fn side(histogram: &Histogram, air: f64, is_above: bool) -> [f64; 2] {
    let middle = histogram.bin(air);
    let (bins, dense) = if is_above { (middle..BINS, 0.99) } else { (0..middle + 1, 0.01) };
    let parting = histogram.parting(bins);
    let first = air + FOOT * (parting - air);
    let of_dense = if is_above { histogram.bin(parting)..BINS } else { 0..histogram.bin(parting) + 1 };
    let last = densest(histogram, of_dense, dense);
    // Matter of one value is a step, not a ramp.
    let least = histogram.width() * if is_above { 1.0 } else { -1.0 };
    [first, if (last - first) / least < 1.0 { first + least } else { last }]
}

fn sum(counts: &[u64]) -> u64 {
    counts.iter().sum()
}

/// The value below which a share of the values in some bins lies.
fn densest(histogram: &Histogram, bins: std::ops::Range<usize>, share: f64) -> f64 {
    let part = Histogram {
        low: histogram.low + bins.start as f64 * histogram.width(),
        high: histogram.low + bins.end as f64 * histogram.width(),
        counts: histogram.counts[bins].to_vec(),
    };
    part.quantile(share)
}

/// Lowest and highest value without outliers; `None` where they are one.
fn usual_range(values: &[f32]) -> Option<[f64; 2]> {
    let step = values.len().div_ceil(SAMPLE).max(1);
    let mut some: Vec<f32> = values.iter().copied().step_by(step).filter(|v| !v.is_nan()).collect();
    let usual = [quantile_of(&mut some, OUTLIERS), quantile_of(&mut some, 1.0 - OUTLIERS)];
    if usual[1] > usual[0] {
        return Some(usual);
    }
    let [low, high] = values.iter().fold([f32::INFINITY, f32::NEG_INFINITY], |r, v| [r[0].min(*v), r[1].max(*v)]);
    (high > low).then(|| [f64::from(low), f64::from(high)])
}

/// The values on the six sides of a volume, and the number of voxels there that have none.
fn border(grid: &Grid) -> (Vec<f32>, usize) {
    let [nx, ny, nz] = grid.dims;
    let mut border = Vec::new();
    for (row, values) in grid.values.chunks(nx).enumerate() {
        let j = row % ny;
        let k = row / ny;
        if j == 0 || k == 0 || j + 1 == ny || k + 1 == nz {
            border.extend_from_slice(values);
        } else {
            border.extend([values[0], values[nx - 1]]);
        }
    }
    let voxels = border.len();
    border.retain(|value| !value.is_nan());
    let gaps = voxels - border.len();
    (border, gaps)
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::glam::{DMat3, DVec3};

    /// A ball of one value, with a denser core, in air with some noise.
    fn ball(air: f32, flesh: f32, core: f32) -> Grid {
        let n = 32;
        let value = |i: usize| {
            let at = DVec3::new((i % n) as f64, (i / n % n) as f64, (i / n / n) as f64) - 15.5;
            let noise = ((i * 7919) % 13) as f32 / 13.0;
            let r = at.length();
            (if r < 5.0 {
                core
            } else if r < 12.0 {
                flesh
            } else {
                air
            }) + noise
        };
        Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims: [n; 3], values: (0..n * n * n).map(value).collect() }
    }

    #[test]
    fn matter_is_told_from_the_air_at_the_border_whichever_is_higher() {
        for (air, flesh, core) in [(0.0, 100.0, 200.0), (-1000.0, 40.0, 900.0), (250.0, 120.0, 20.0)] {
            let matter = Matter::from_grid(&ball(air, flesh, core)).unwrap();
            let a = f64::from(air);
            let f = f64::from(flesh);
            let c = f64::from(core);
            assert!((matter.air.unwrap() - a).abs() < 2.0, "{matter:?}");
            let between = |x: f64, y: f64, z: f64| (x.min(z)..=x.max(z)).contains(&y);
            assert!(
                between(a, matter.first, f) && between(f, matter.last, c + 2.0 * (c - f).signum()),
                "{} {}",
                matter.first,
                matter.last
            );
            assert!((matter.bulk() - f).abs() < 0.02 * (c - a).abs(), "{}", matter.bulk());
        }
    }

    #[test]
    fn a_field_of_both_signs_is_matter_on_both_sides_of_zero() {
        // Balls of +1 and −1 around which there is nothing.
        let plus = ball(0.0, 60.0, 100.0);
        let minus = ball(0.0, 60.0, 100.0);
        let values = plus.values.iter().chain(&minus.values).enumerate();
        let values = values.map(|(i, v)| if i < plus.values.len() { *v } else { -*v }).collect();
        let both = Grid { dims: [32, 32, 64], values, ..plus };
        let matter = Matter::from_grid(&both).unwrap();
        let [first, last] = matter.opposite.unwrap();
        assert!(matter.first * first < 0.0 && matter.last * last < 0.0, "{matter:?}");
        assert!((matter.first + first).abs() < 5.0 && (matter.last + last).abs() < 5.0, "{matter:?}");
        // Without air too.
        let values = (0..4096).map(|i| (i % 16) as f32 - 7.5).collect();
        let ramp = Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims: [16; 3], values };
        let matter = Matter::from_grid(&ramp).unwrap();
        assert!(matter.first == 0.0 && matter.last > 7.0 && matter.opposite.unwrap()[1] < -7.0, "{matter:?}");
        // With the range of a tomogram, too: around it is 0, not air.
        let values = both.values.iter().map(|v| 15.0 * v).collect();
        assert!(
            Matter::from_grid(&Grid { values, ..both.clone() }).is_some_and(|m| m.opposite.is_some() && !m.has_units())
        );
        // Hounsfield units have both signs and are none of those.
        assert_eq!(Matter::from_grid(&ball(-1000.0, 40.0, 900.0)).unwrap().opposite, None);
    }

    #[test]
    fn what_has_no_value_is_nothing_and_all_else_is_matter() {
        let mut grid = ball(f32::NAN, 100.0, 200.0);
        let matter = Matter::from_grid(&grid).unwrap();
        assert!(matter.air.is_none() && matter.first < 100.0 && matter.last > 199.0, "{matter:?}");
        assert_eq!(matter.histogram.total(), grid.values.iter().filter(|v| !v.is_nan()).count() as u64);
        // A gap within changes nothing.
        grid = ball(0.0, 100.0, 200.0);
        let whole = Matter::from_grid(&grid).unwrap();
        grid.values[16 * 32 * 32 + 16 * 32 + 16] = f32::NAN;
        let matter = Matter::from_grid(&grid).unwrap();
        assert!((matter.first - whole.first).abs() < 1.0 && (matter.last - whole.last).abs() < 1.0);
    }

    #[test]
    fn a_hole_in_cells_that_fill_the_box_is_no_matter() {
        let hole = ball(300.5, 0.0, 0.0);
        let matter = Matter::in_surroundings(&hole, Some(0.0)).unwrap();
        assert_eq!(matter.air, Some(0.0));
        assert!(matter.first > 0.0 && matter.last > 300.0, "{matter:?}");
        // Of what comes from elsewhere the border tells.
        assert!((Matter::from_grid(&hole).unwrap().air.unwrap() - 300.5).abs() < 2.0);
    }

    #[test]
    fn a_volume_that_fills_its_box_has_no_air_and_one_of_one_value_no_matter() {
        let n = 16;
        let values = (0..n * n * n).map(|i| (i % n) as f32).collect();
        let ramp = Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims: [n; 3], values };
        let matter = Matter::from_grid(&ramp).unwrap();
        assert_eq!(matter.air, None);
        assert!(matter.first < matter.last);
        let flat = Grid { values: vec![3.0; n * n * n], ..ramp };
        assert_eq!(Matter::from_grid(&flat), None);
    }
}
