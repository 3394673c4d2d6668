//! Convolution of the light buffer with a Gaussian, row by row and column by column: light that spreads on its way.
//!
//! Variances add, so a way in many steps spreads light as one in few. Weights sum to 1, the middle one being 1 less the others; what
//! lies beyond a border is a number: 0 for light that is scattered, and what leaves there has left by the sides.

use super::grid::GridLine;
use libm::{ceil, exp, sqrt};

/// Variance, cells², up to which three weights have it exactly; beyond, samples of the Gaussian do.
const NARROW: f64 = 0.5;

/// Standard deviations that a kernel reaches.
const REACH: f64 = 4.5;

/// Weights of one direction: the middle, then those at 1, 2, …, cells on both sides.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Kernel {
    weights: Vec<f64>,
}

impl Kernel {
    /// Of a variance in cells², ≥ 0.
    pub(crate) fn new(variance: f64) -> Self {
        if variance <= NARROW {
            return Self { weights: vec![1.0 - variance, 0.5 * variance] };
        }
        let reach = ceil(REACH * sqrt(variance)) as usize;
        let sample = |n: usize| exp(-0.5 * (n * n) as f64 / variance);
        let sum = 1.0 + 2.0 * (1..=reach).map(sample).sum::<f64>();
        let mut weights: Vec<f64> = (0..=reach).map(|n| sample(n) / sum).collect();
        weights[0] = 1.0 - 2.0 * weights[1..].iter().sum::<f64>();
        Self { weights }
    }

    /// Whether nothing spreads.
    pub(crate) fn is_point(&self) -> bool {
        self.weights[1..].iter().all(|w| *w == 0.0)
    }

    /// Convolves a line of numbers, beyond which all are `outside`; `before` is room for what they were.
    fn convolve_line(&self, plane: &mut [f64], line: GridLine, outside: f64, before: &mut Vec<f64>) {
        before.clear();
        before.extend((0..line.count).map(|i| plane[line.index(i)]));
        let number = |i: Option<usize>| i.and_then(|i| before.get(i)).copied().unwrap_or(outside);
        for i in 0..line.count {
            let mut sum = self.weights[0] * before[i];
            for (n, weight) in self.weights.iter().enumerate().skip(1) {
                // Both sides first: a mirrored plane gives mirrored bits.
                sum += weight * (number(i.checked_sub(n)) + number(Some(i + n)));
            }
            plane[line.index(i)] = sum;
        }
    }
}

/// Convolves a plane of `width` numbers a row by one kernel along rows and another along columns.
pub(crate) fn convolve(plane: &mut [f64], width: usize, kernels: &[Kernel; 2], outside: f64) {
    let height = plane.len() / width;
    let mut before = Vec::new();
    if !kernels[0].is_point() {
        for y in 0..height {
            let row = GridLine { start: y * width, step: 1, count: width };
            kernels[0].convolve_line(plane, row, outside, &mut before);
        }
    }
    if !kernels[1].is_point() {
        for x in 0..width {
            let column = GridLine { start: x, step: width, count: height };
            kernels[1].convolve_line(plane, column, outside, &mut before);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_constant_buffer_is_constant_after_1000_convolutions() {
        for variance in [0.01, 0.49, 0.51, 4.0, 300.0] {
            let kernel = Kernel::new(variance);
            let mut plane = vec![0.7; 24 * 16];
            (0..1000).for_each(|_| convolve(&mut plane, 24, &[kernel.clone(), kernel.clone()], 0.7));
            assert!(plane.iter().all(|v| (v - 0.7).abs() < 1e-11), "variance {variance}");
        }
    }

    #[test]
    fn ms06_convolution_keeps_energy_and_makes_nothing_negative() {
        let mut plane = vec![0.0; 101 * 101];
        plane[50 * 101 + 50] = 1e4;
        for variance in [0.2, 0.9, 7.0] {
            let kernel = Kernel::new(variance);
            let mut left = plane.clone();
            let before = variance;
            convolve(&mut left, 101, &[kernel.clone(), kernel], 0.0);
            assert!(left.iter().all(|v| *v >= 0.0));
            let sum: f64 = left.iter().sum();
            assert!((sum - 1e4).abs() < 1e-7, "{sum}");
            let second: f64 = (0..101 * 101).map(|k| left[k] * ((k % 101) as f64 - 50.0).powi(2)).sum();
            assert!((second / 1e4 / before - 1.0).abs() < 2e-3, "variance {before}: {}", second / 1e4);
        }
    }

    #[test]
    fn ms07_no_cone_spreads_nothing_and_the_widest_leaves_by_the_sides() {
        let start: Vec<f64> = (0..64).map(|n| f64::from(n % 7)).collect();
        let mut plane = start.clone();
        convolve(&mut plane, 8, &[Kernel::new(0.0), Kernel::new(0.0)], 0.0);
        assert_eq!(plane, start);
        let wide = Kernel::new(16.0);
        convolve(&mut plane, 8, &[wide.clone(), wide], 0.0);
        let sum: f64 = plane.iter().sum();
        let before: f64 = start.iter().sum();
        assert!(plane.iter().all(|v| v.is_finite() && *v >= 0.0) && sum < before && sum > 0.0);
    }

    #[test]
    fn a_mirrored_plane_gives_mirrored_bits() {
        let start: Vec<f64> = (0..60).map(|n| f64::from(n * n % 23) / 7.0).collect();
        let kernel = Kernel::new(1.7);
        let mirror = |plane: &[f64]| plane.chunks(10).flat_map(|row| row.iter().rev().copied()).collect::<Vec<f64>>();
        let mut one = start.clone();
        let mut other = mirror(&start);
        convolve(&mut one, 10, &[kernel.clone(), kernel.clone()], 0.0);
        convolve(&mut other, 10, &[kernel.clone(), kernel], 0.0);
        assert_eq!(mirror(&one), other);
    }
}
