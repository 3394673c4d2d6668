//! Random numbers of one chunk of one set: a counter from a hash of (seed, stage, set, chunk), and Poisson counts.
//!
//! Poisson variables of small mean by inversion; of mean ≥ 12 by W. Hörmann: *The transformed rejection method for
//! generating Poisson random variables*, Insurance: Mathematics and Economics 12, 1993 (algorithm PTRS), which is exact.

use glam::DVec3;
use splat_core::{glam, rng};

/// The mean from which Poisson variables are drawn by rejection.
pub(crate) const REJECTED_FROM: f64 = 12.0;

/// Increment of a counter from number to number (SplitMix64).
pub(crate) const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// The first word of each counter names the sampler, so that two samplers of one seed share no numbers.
#[derive(Debug, Clone, Copy)]
#[repr(u64)]
pub(crate) enum Stage {
    Mesh = 0x5042_0001,
    Volume,
    Splats,
    Lines,
    Brownian,
    Metropolis,
    Thinning,
    Survey,
    Channels,
    Lattice,
}

/// The numbers of one chunk, in order.
#[derive(Debug, Clone)]
pub(crate) struct Stream {
    state: u64,
}

impl Stream {
    pub(crate) fn new(seed: u64, stage: Stage, set: u64, chunk: u64) -> Self {
        Self { state: rng::bits(seed, stage as u64, set, chunk) }
    }

    /// 64 random bits.
    #[inline]
    pub(crate) fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(GOLDEN);
        scramble(self.state)
    }

    /// Uniform in (0, 1), both ends open.
    #[inline]
    pub(crate) fn unit(&mut self) -> f64 {
        ((self.bits() >> 12) as f64 + 0.5) * (1.0 / (1u64 << 52) as f64)
    }

    /// Two uniform numbers in (0, 1), both ends open, 23 bits each.
    #[inline]
    pub(crate) fn pair(&mut self) -> [f32; 2] {
        pair(self.bits())
    }

    /// Three uniform numbers in (0, 1), both ends open, 21 bits each.
    #[inline]
    pub(crate) fn triple(&mut self) -> [f32; 3] {
        triple(self.bits())
    }

    /// Two independent standard normal numbers (Box-Muller).
    pub(crate) fn normal_pair(&mut self) -> [f64; 2] {
        let radius = (-2.0 * libm::log(self.unit())).sqrt();
        let (sin, cos) = libm::sincos(std::f64::consts::TAU * self.unit());
        [radius * cos, radius * sin]
    }

    /// Three independent standard normal numbers.
    pub(crate) fn normal3(&mut self) -> DVec3 {
        let [x, y] = self.normal_pair();
        DVec3::new(x, y, self.normal_pair()[0])
    }

    /// A uniform point of the unit sphere.
    pub(crate) fn direction(&mut self) -> DVec3 {
        let z = 2.0 * self.unit() - 1.0;
        let (sin, cos) = libm::sincos(std::f64::consts::TAU * self.unit());
        // (1 − z)(1 + z) does not cancel at the poles.
        let r = ((1.0 - z) * (1.0 + z)).sqrt();
        DVec3::new(r * cos, r * sin, z)
    }

    /// A Poisson variable of mean `mean`; 0 for a mean that is not positive.
    pub(crate) fn poisson(&mut self, mean: f64) -> u64 {
        if mean < REJECTED_FROM { self.poisson_by_inversion(mean) } else { self.poisson_by_rejection(mean) }
    }

    fn poisson_by_inversion(&mut self, mean: f64) -> u64 {
        if mean <= 0.0 || mean.is_nan() {
            return 0;
        }
        let mut rest = self.unit();
        let mut p = libm::exp(-mean);
        let mut k = 0;
        while rest > p && k < 200 {
            rest -= p;
            k += 1;
            p *= mean / k as f64;
        }
        k
    }

    fn poisson_by_rejection(&mut self, mean: f64) -> u64 {
        let [b, a, v_r, inverse_alpha] = rejection(mean);
        loop {
            let u = self.unit() - 0.5;
            let v = self.unit();
            let us = 0.5 - u.abs();
            let k = ((2.0 * a / us + b) * u + mean + 0.43).floor();
            if us >= 0.07 && v <= v_r {
                return k as u64;
            }
            if k < 0.0 || (us < 0.013 && v > us) {
                continue;
            }
            let accept = libm::log(v * inverse_alpha / (a / (us * us) + b));
            if accept <= k * libm::log(mean) - mean - ln_factorial(k) {
                return k as u64;
            }
        }
    }
}

/// b, a, v_r and 1/α of PTRS for a mean.
pub(crate) fn rejection(mean: f64) -> [f64; 4] {
    let b = 0.931 + 2.53 * mean.sqrt();
    let a = -0.059 + 0.02483 * b;
    [b, a, 0.9277 - 3.6224 / (b - 2.0), 1.1239 + 1.1328 / (b - 3.4)]
}

/// Two uniform numbers in (0, 1), both ends open, of 64 random bits.
#[inline(always)]
pub(crate) fn pair(bits: u64) -> [f32; 2] {
    [unit_f32(bits >> 41), unit_f32((bits >> 18) & 0x7f_ffff)]
}

/// Three uniform numbers in (0, 1), both ends open, of 64 random bits.
#[inline(always)]
pub(crate) fn triple(bits: u64) -> [f32; 3] {
    let part = |v: u64| ((v & 0x1f_ffff) as i32 as f32 + 0.5) * (1.0 / (1u32 << 21) as f32);
    [part(bits >> 43), part(bits >> 22), part(bits >> 1)]
}

#[inline(always)]
fn unit_f32(bits23: u64) -> f32 {
    (bits23 as i32 as f32 + 0.5) * (1.0 / (1u32 << 23) as f32)
}

/// The SplitMix64 finalizer.
#[inline]
pub(crate) fn scramble(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// ln(k!) for whole k ≥ 0: Stirling's series from 16 on.
fn ln_factorial(k: f64) -> f64 {
    if k < 16.0 {
        return (2..=k as u32).map(|i| libm::log(f64::from(i))).sum();
    }
    let i = 1.0 / k;
    let series = i * (1.0 / 12.0 - i * i * (1.0 / 360.0 - i * i / 1260.0));
    (k + 0.5) * libm::log(k) - k + 0.5 * libm::log(std::f64::consts::TAU) + series
}

/// Two unit vectors that span the plane across the unit vector `d`.
pub(crate) fn across(d: DVec3) -> [DVec3; 2] {
    let (a, b) = d.any_orthonormal_pair();
    [a, b]
}

/// `v` of unit length, or zero for the zero vector; scaled first, so that lengths of 1e±200 neither overflow nor vanish.
pub(crate) fn unit_or_zero(v: DVec3) -> DVec3 {
    let largest = v.abs().max_element();
    if largest > 0.0 && largest.is_finite() { (v / largest).normalize() } else { DVec3::ZERO }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pb15_every_uniform_number_has_a_finite_logarithm() {
        for bits in [0u64, 1, (1 << 23) - 1] {
            let u = unit_f32(bits);
            assert!(u.ln().is_finite() && (1.0 - u).ln().is_finite(), "{bits}");
        }
        // All 2²³ numbers that exist.
        assert!((0..1u64 << 23).all(|b| unit_f32(b) > 0.0 && unit_f32(b) < 1.0));
        let mut stream = Stream { state: 0 };
        for _ in 0..100_000 {
            assert!(stream.normal_pair().iter().all(|x| x.is_finite()));
        }
    }

    #[test]
    fn poisson_counts_have_their_mean_and_variance() {
        for mean in [0.0f64, 0.01, 0.7, 5.0, 11.9, 12.0, 40.0, 1e3, 1e6] {
            const N: usize = 200_000;
            let mut stream = Stream::new(3, Stage::Mesh, 0, mean.to_bits());
            let mut sum = 0.0;
            let mut square = 0.0;
            for _ in 0..N {
                let d = stream.poisson(mean) as f64 - mean;
                sum += d;
                square += d * d;
            }
            let n = N as f64;
            assert!((sum / n).abs() <= 4.5 * (mean / n).sqrt(), "mean {mean}: off by {}", sum / n);
            // Var of the sample variance: (μ + 2μ²)/n.
            let sigma = ((mean + 2.0 * mean * mean) / n).sqrt();
            assert!((square / n - mean).abs() <= 4.5 * sigma, "mean {mean}: variance {}", square / n);
        }
    }

    #[test]
    fn poisson_by_rejection_follows_the_distribution() {
        const N: usize = 400_000;
        let mean = 14.0;
        let mut stream = Stream::new(9, Stage::Mesh, 1, 2);
        let mut counts = [0usize; 64];
        (0..N).for_each(|_| counts[stream.poisson(mean).min(63) as usize] += 1);
        let mut p = (-mean).exp();
        let mut chi2 = 0.0;
        let mut bins = 0;
        for (k, &count) in counts.iter().enumerate() {
            let expected = N as f64 * p;
            if expected >= 10.0 {
                chi2 += (count as f64 - expected).powi(2) / expected;
                bins += 1;
            }
            p *= mean / (k + 1) as f64;
        }
        // 99.9 % point of χ² by Wilson and Hilferty.
        let dof = f64::from(bins - 1);
        let h = 2.0 / (9.0 * dof);
        let limit = dof * (1.0 - h + 3.09 * h.sqrt()).powi(3);
        assert!(chi2 < limit, "χ² {chi2} of {dof}, limit {limit}");
    }
}
