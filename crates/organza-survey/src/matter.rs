//! Which values of a volume are matter and which are what is around it.
//!
//! What is around a scanned body is quiet and lies at the border of the volume: the median of the border's values is that of air, as far
//! as they differ little from it. A threshold by Otsu parts matter from it, on the side of it where more values lie. A volume
//! whose border is not quiet is matter all through; then its higher values show.

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
}

/// Hounsfield units between which values are taken for such.
const UNITS: [f64; 2] = [-500.0, 100.0];

impl Matter {
    /// `None` for a volume of one value.
    pub(crate) fn of(grid: &Grid) -> Option<Self> {
        let range = usual_range(&grid.values)?;
        let histogram = Histogram::new(&grid.values, range, BINS);
        let spread = histogram.high - histogram.low;
        let mut border = border(grid);
        let [low, air, high] = [0.1, 0.5, 0.9].map(|share| quantile_of(&mut border, share));
        if high - low >= QUIET * spread {
            let (first, last) = (histogram.quantile(0.4), histogram.quantile(0.998));
            let last = if last > first { last } else { histogram.high };
            return Some(Self { histogram, air: None, first, last });
        }
        let middle = histogram.bin(air);
        // Farther away than air scatters by itself.
        let (low, high) = (histogram.bin(low), histogram.bin(high));
        let above = sum(&histogram.counts[(2 * high - low + 1).min(BINS)..]);
        let below = sum(&histogram.counts[..(2 * low).saturating_sub(high)]);
        let (first, last) = if above >= below {
            let parting = histogram.parting(middle..BINS);
            (air + FOOT * (parting - air), densest(&histogram, histogram.bin(parting)..BINS, 0.99))
        } else {
            let parting = histogram.parting(0..middle + 1);
            (air + FOOT * (parting - air), densest(&histogram, 0..histogram.bin(parting) + 1, 0.01))
        };
        // Matter of one value is a step, not a ramp.
        let least = histogram.width() * if above >= below { 1.0 } else { -1.0 };
        let last = if (last - first) / least < 1.0 { first + least } else { last };
        Some(Self { histogram, air: Some(air), first, last })
    }

    /// Whether values look like Hounsfield units, of air to bone.
    pub(crate) fn has_units(&self) -> bool {
        self.histogram.low < UNITS[0] && self.histogram.high > UNITS[1]
    }

    /// The value that parts what is dense from the rest of matter: bone from flesh.
    pub(crate) fn dense(&self) -> f64 {
        let (a, b) = (self.histogram.bin(self.first), self.histogram.bin(self.last));
        self.histogram.parting(a.min(b)..a.max(b) + 1)
    }

    /// The most frequent value of matter that is no air: of soft tissue in a body.
    pub(crate) fn bulk(&self) -> f64 {
        let (a, b) = (self.histogram.bin(self.first), self.histogram.bin(self.last));
        let bins = a.min(b)..a.max(b) + 1;
        // Bins beside it count, so that one that is full by chance is none.
        let around = |i: &usize| sum(&self.histogram.counts[i.saturating_sub(4)..(i + 5).min(BINS)]);
        self.histogram.middle(bins.max_by_key(around).unwrap_or(a))
    }
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
    let mut some: Vec<f32> = values.iter().copied().step_by(step).collect();
    let usual = [quantile_of(&mut some, OUTLIERS), quantile_of(&mut some, 1.0 - OUTLIERS)];
    if usual[1] > usual[0] {
        return Some(usual);
    }
    let [low, high] = values.iter().fold([f32::INFINITY, f32::NEG_INFINITY], |r, v| [r[0].min(*v), r[1].max(*v)]);
    (high > low).then(|| [f64::from(low), f64::from(high)])
}

/// The values on the six sides of a volume.
fn border(grid: &Grid) -> Vec<f32> {
    let [nx, ny, nz] = grid.dims;
    let mut all = Vec::new();
    for (row, values) in grid.values.chunks(nx).enumerate() {
        let (j, k) = (row % ny, row / ny);
        if j == 0 || k == 0 || j + 1 == ny || k + 1 == nz {
            all.extend_from_slice(values);
        } else {
            all.extend([values[0], values[nx - 1]]);
        }
    }
    all
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
            let matter = Matter::of(&ball(air, flesh, core)).unwrap();
            let (a, f, c) = (f64::from(air), f64::from(flesh), f64::from(core));
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
    fn a_volume_that_fills_its_box_has_no_air_and_one_of_one_value_no_matter() {
        let n = 16;
        let values = (0..n * n * n).map(|i| (i % n) as f32).collect();
        let ramp = Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims: [n; 3], values };
        let matter = Matter::of(&ramp).unwrap();
        assert_eq!(matter.air, None);
        assert!(matter.first < matter.last);
        let flat = Grid { values: vec![3.0; n * n * n], ..ramp };
        assert_eq!(Matter::of(&flat), None);
    }
}
