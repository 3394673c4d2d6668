//! Values of a volume far from all others: fill values of voxels without data, and strays of a few voxels.

use rayon::prelude::*;
use splat_core::Grid;
use splat_core::text::counted;
use std::fmt;

/// Voxels of one value from which on it may be a fill value: a detector has fewer pixels that are dead.
const LEAST_FILLED: u64 = 8;
/// Distance of a fill value from the nearest other value, over the range of all others. Air around a body lies nearer.
const FILL_GAP: f64 = 8.0;
/// Different values that there are beside a fill value: labels and masks have fewer.
const LEAST_DIFFERENT: usize = 32;
/// Distance of strays from the range of nearly all values, over its width.
const STRAY_GAP: f64 = 100.0;
/// Share of the values at each end that the range of nearly all leaves out.
const STRAY_SHARE: f64 = 0.0005;
/// Voxels for each stray, at least.
const VOXELS_A_STRAY: u64 = 10_000;
/// Values that are put in order to find the range of nearly all.
const SAMPLE: usize = 1 << 18;

/// A value that many voxels have and that lies far from all others, as files without a sign for "no value" write it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FillValue {
    /// The value.
    pub value: f32,
    /// Voxels that have it.
    pub count: u64,
    /// Voxels in all.
    pub voxels: u64,
    /// Least and greatest of the other values.
    pub others: [f32; 2],
}

/// A few voxels whose values lie far from all others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Strays {
    /// Number of voxels.
    pub count: u64,
    /// Voxels in all.
    pub voxels: u64,
    /// The value that lies farthest.
    pub farthest: f32,
    /// Least and greatest value of nearly all others.
    pub others: [f32; 2],
}

/// One end of the values of a volume.
#[derive(Debug, Clone, Copy)]
struct End {
    value: f32,
    count: u64,
    /// The nearest other value.
    next: f32,
}

impl FillValue {
    /// The likely fill value of a volume. Voxels that are NaN do not count.
    pub fn of_grid(grid: &Grid) -> Option<Self> {
        let low = end(&grid.values, |value| value);
        let high = end(&grid.values, |value| -value);
        [(low, high.value), (high, low.value)].into_iter().find_map(|(end, opposite)| {
            let range = (f64::from(opposite) - f64::from(end.next)).abs();
            let gap = (f64::from(end.next) - f64::from(end.value)).abs();
            let stands_apart = end.count >= LEAST_FILLED && range > 0.0 && gap.is_finite() && gap > FILL_GAP * range;
            (stands_apart && has_many_values(&grid.values, end.value)).then(|| Self {
                value: end.value,
                count: end.count,
                voxels: grid.values.len() as u64,
                others: [end.next.min(opposite), end.next.max(opposite)],
            })
        })
    }
}

impl fmt::Display for FillValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let value = written_value(self.value);
        let [low, high] = self.others.map(about);
        write!(
            f,
            "{} of {} have the value {value}, far from all others, which lie from {low} to {high}: it looks like a fill value; \
             nodata = {value} in the [[object]] draws nothing there",
            self.count,
            counted(self.voxels, "voxel")
        )
    }
}

impl Strays {
    /// The strays of a volume; `None` without any, and where the values have no range that nearly all lie in.
    pub fn of_grid(grid: &Grid) -> Option<Self> {
        let values = &grid.values;
        let step = values.len().div_ceil(SAMPLE).max(1);
        let mut some: Vec<f32> = values.iter().copied().step_by(step).filter(|value| !value.is_nan()).collect();
        let last = some.len().checked_sub(1)?;
        let others = [STRAY_SHARE, 1.0 - STRAY_SHARE].map(|share| {
            let rank = (last as f64 * share).round() as usize;
            *some.select_nth_unstable_by(rank, f32::total_cmp).1
        });
        let [low, high] = others.map(f64::from);
        let width = high - low;
        let distance = |value: f32| (low - f64::from(value)).max(f64::from(value) - high);
        let is_stray = |value: &&f32| distance(**value) > STRAY_GAP * width;
        let strays = || values.par_iter().filter(is_stray);
        let count = if width > 0.0 { strays().count() as u64 } else { 0 };
        if count == 0 || count * VOXELS_A_STRAY > values.len() as u64 {
            return None;
        }
        let farthest = *strays().max_by(|a, b| distance(**a).total_cmp(&distance(**b)))?;
        Some(Self { count, voxels: values.len() as u64, farthest, others })
    }
}

impl fmt::Display for Strays {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let farthest = written_value(self.farthest);
        let [low, high] = self.others.map(about);
        let (lie, with) = if self.count == 1 { ("lies", "with") } else { ("lie", "with up to") };
        write!(
            f,
            "{} of {} {lie} far from all others, {with} {farthest}: nearly all values lie from {low} to {high}, which a `transfer` should \
             span; nodata = {farthest} in the [[object]] draws nothing there",
            self.count,
            counted(self.voxels, "voxel")
        )
    }
}

/// A volume whose voxels of one value are NaN, which draw nothing, and how many these are. A value counts as this one to four steps of single
/// precision, so that it can be written in decimals.
pub fn without_value(grid: &Grid, value: f32) -> (Grid, u64) {
    let nearest = 4.0 * f32::EPSILON * value.abs();
    let is_it = |known: f32| known == value || (known - value).abs() <= nearest;
    let values: Vec<f32> = grid.values.par_iter().map(|known| if is_it(*known) { f32::NAN } else { *known }).collect();
    let gaps = |values: &[f32]| values.par_iter().filter(|value| value.is_nan()).count() as u64;
    let count = gaps(&values) - gaps(&grid.values);
    (Grid { values, ..*grid }, count)
}

/// A value as a scene can repeat it, without rows of zeros.
pub fn written_value(value: f32) -> String {
    let plain = value.to_string();
    if plain.len() <= 12 { plain } else { format!("{value:e}") }
}

/// Four digits of a value.
fn about(value: f32) -> String {
    format!("{value:.3e}").parse().map_or_else(|_| written_value(value), written_value)
}

/// The least of what `by` makes of the values.
fn end(values: &[f32], by: impl Fn(f32) -> f32 + Sync) -> End {
    let least = values.par_iter().map(|value| by(*value)).filter(|value| !value.is_nan());
    let least = least.reduce(|| f32::INFINITY, f32::min);
    let of_value = |value: &f32| match by(*value) {
        by if by == least => (1, f32::INFINITY),
        by if by > least => (0, by),
        _ => (0, f32::INFINITY),
    };
    let (count, next) = values
        .par_iter()
        .map(of_value)
        .reduce(|| (0, f32::INFINITY), |(count, next), (more, other)| (count + more, f32::min(next, other)));
    End { value: by(least), count, next: by(next) }
}

/// Whether there are many different values beside one.
fn has_many_values(values: &[f32], but: f32) -> bool {
    let mut known: Vec<f32> = Vec::with_capacity(LEAST_DIFFERENT);
    for value in values.iter().filter(|value| !value.is_nan() && **value != but) {
        if !known.contains(value) {
            known.push(*value);
            if known.len() == LEAST_DIFFERENT {
                return true;
            }
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::glam::{DMat3, DVec3};

    fn cube(value: impl Fn(usize) -> f32) -> Grid {
        let values = (0..32 * 32 * 32).map(value).collect();
        Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims: [32; 3], values }
    }

    /// Values from 0 to 1, with another one at every 50th voxel.
    fn filled(value: f32) -> Grid {
        cube(|i| if i % 50 == 3 { value } else { (i % 997) as f32 / 996.0 })
    }

    #[test]
    fn fill_values_of_usual_programs_are_found_with_their_count() {
        for value in [-9999.0, 1e20, 9.969_21e36, -32768.0, -1e30] {
            let found = FillValue::of_grid(&filled(value)).unwrap();
            let grid = filled(value);
            let count = grid.values.iter().filter(|v| **v == value).count() as u64;
            assert_eq!((found.value, found.count, found.others), (value, count, [0.0, 1.0]));
            let (without, gaps) = without_value(&grid, value);
            assert!(gaps == count && without.values[3].is_nan() && without.values[4] == grid.values[4]);
            assert_eq!(FillValue::of_grid(&without), None);
        }
        let text = FillValue::of_grid(&filled(9.969_21e36)).unwrap().to_string();
        assert!(text.contains("656 of 32768 voxels have the value 9.96921e36"), "{text}");
        assert!(text.ends_with("nodata = 9.96921e36 in the [[object]] draws nothing there"), "{text}");
    }

    #[test]
    fn air_masks_labels_and_single_voxels_are_no_fill_values() {
        assert_eq!(FillValue::of_grid(&filled(-2.0)), None);
        assert_eq!(FillValue::of_grid(&cube(|i| if i % 3 == 0 { 255.0 } else { 0.0 })), None);
        assert_eq!(FillValue::of_grid(&cube(|i| if i % 3 == 0 { 2035.0 } else { (i % 5) as f32 })), None);
        assert_eq!(FillValue::of_grid(&cube(|i| if i == 7 { 1e6 } else { (i % 997) as f32 })), None);
        assert_eq!(FillValue::of_grid(&cube(|_| f32::NAN)), None);
    }

    #[test]
    fn a_hot_voxel_is_a_stray_and_a_long_tail_is_none() {
        let hot = Strays::of_grid(&cube(|i| if i == 7 { 1e6 } else { (i % 997) as f32 / 996.0 })).unwrap();
        assert_eq!((hot.count, hot.farthest), (1, 1e6));
        assert!(hot.to_string().starts_with("1 of 32768 voxels lies far from all others, with 1000000: nearly all"));
        assert_eq!(Strays::of_grid(&cube(|i| (-(i as f32) / 3000.0).exp())), None);
        assert_eq!(Strays::of_grid(&cube(|i| if i == 7 { 1.0 } else { 0.0 })), None);
    }

    #[test]
    fn a_value_is_found_as_decimals_tell_it() {
        let (_, count) = without_value(&filled(9.969_209_968_386_869e36_f64 as f32), 9.969_21e36);
        assert_eq!(count, 656);
    }
}
