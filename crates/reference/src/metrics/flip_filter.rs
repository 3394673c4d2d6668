//! Separable filters of FLIP, the image continued by its border pixels.

use rayon::prelude::*;

/// A plane of numbers, row by row.
pub(super) struct Plane {
    pub(super) width: usize,
    pub(super) values: Vec<f64>,
}

impl Plane {
    /// Convolves columns with `vertical`, then rows with `horizontal`; both of odd length.
    pub(super) fn filtered(&self, horizontal: &[f64], vertical: &[f64]) -> Self {
        self.along_rows(horizontal).along_columns(vertical)
    }

    fn along_rows(&self, taps: &[f64]) -> Self {
        let width = self.width;
        let reach = (taps.len() / 2) as isize;
        let mut values = vec![0.0; self.values.len()];
        values.par_chunks_mut(width).zip(self.values.par_chunks(width)).for_each(|(out, row)| {
            for (x, out) in out.iter_mut().enumerate() {
                let at = |k: usize| row[clamped(x as isize + k as isize - reach, width)];
                *out = taps.iter().enumerate().map(|(k, t)| t * at(k)).sum();
            }
        });
        Self { width, values }
    }

    fn along_columns(&self, taps: &[f64]) -> Self {
        let width = self.width;
        let reach = (taps.len() / 2) as isize;
        let height = self.values.len() / width;
        let mut values = vec![0.0; self.values.len()];
        values.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
            for (k, tap) in taps.iter().enumerate() {
                let from = clamped(y as isize + k as isize - reach, height) * width;
                out.iter_mut().zip(&self.values[from..from + width]).for_each(|(o, v)| *o += tap * v);
            }
        });
        Self { width, values }
    }
}

fn clamped(at: isize, len: usize) -> usize {
    at.clamp(0, len as isize - 1) as usize
}

/// f(−reach), …, f(reach).
pub(super) fn taps(reach: usize, f: impl Fn(f64) -> f64) -> Vec<f64> {
    (0..=2 * reach).map(|k| f(k as f64 - reach as f64)).collect()
}

/// Scales positive taps to a sum of 1 and negative ones to a sum of −1.
pub(super) fn balanced(taps: Vec<f64>) -> Vec<f64> {
    let positive: f64 = taps.iter().filter(|t| **t > 0.0).sum();
    let negative: f64 = -taps.iter().filter(|t| **t < 0.0).sum::<f64>();
    taps.into_iter().map(|t| if t > 0.0 { t / positive } else { t / negative.max(f64::MIN_POSITIVE) }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_becomes_the_filter_and_borders_repeat() {
        let mut values = vec![0.0; 15];
        values[7] = 1.0;
        let out = Plane { width: 5, values }.filtered(&[1.0, 2.0, 4.0], &[1.0, 1.0, 1.0]);
        assert_eq!(out.values[5..10], [0.0, 4.0, 2.0, 1.0, 0.0]);
        let flat = Plane { width: 3, values: vec![2.0; 9] }.filtered(&[0.25; 4][..3], &[0.0, 1.0, 0.0]);
        assert!(flat.values.iter().all(|v| *v == 1.5));
    }

    #[test]
    fn balanced_taps_sum_to_one_on_each_side() {
        assert_eq!(balanced(vec![-3.0, -1.0, 0.0, 2.0, 2.0]), [-0.75, -0.25, 0.0, 0.5, 0.5]);
    }
}
