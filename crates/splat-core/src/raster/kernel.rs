//! The profile of a footprint as a fragment evaluates it: a polynomial in t = 1 − s where one of degree 10 suffices.
//!
//! With q = cutoff²/2 the profile of [`Footprint`] is the tail of an exponential series,
//! w = e^−q·Σ_{k≥3} (qt)^k/k! = t³·G(t). G is smooth and positive, so for q ≤ 4.5 the polynomial of
//! degree 7 through the Chebyshev points of \[0.2, 1\] stands for it: |error of w| < 4·10⁻⁷ (the profile is about 1 at
//! its centre). The interval leaves out small t, where t³ forgives all. w and its first two slopes vanish at the rim
//! by the factor t³, so the area outside needs no mask but t = max(1 − s, 0). Sharper footprints are evaluated by the
//! exponential.

use super::lanes::{Lanes, exp_neg};
use crate::Footprint;
use pulp::Simd;
use std::f64::consts::PI;

/// Coefficients of the polynomial.
const TERMS: usize = 8;

/// Numbers of a footprint on a device, in fours.
#[cfg(feature = "gpu")]
pub(crate) const TABLE: usize = 16;

/// The greatest q for which a polynomial is used; that of the default cutoff of 3.
const POLYNOMIAL_LIMIT: f32 = 4.5;

/// Where the interval of the fit begins.
const FIT_BEGIN: f64 = 0.2;

/// One footprint, ready for fragments.
#[derive(Debug, Clone, PartialEq)]
pub struct Kernel {
    pub(crate) cutoff: f32,
    /// 1/∫w dA for R = 1.
    pub(crate) norm: f32,
    /// Half the width of its share before a plane, [`Lanes::share_in_front`], for R = 1.
    pub(crate) depth: f32,
    /// Spacing of the lattice that it is meant for, for R = 1.
    pub(crate) spacing: f32,
    /// For depths: what an optical depth is multiplied with, the constant and the slope in s.
    pub(crate) narrowing: [f32; 2],
    /// q.
    sharpness: f32,
    /// e^−q.
    rim: f32,
    /// G, the constant term first; only when `smooth`.
    g: [f32; TERMS],
    smooth: bool,
}

impl Kernel {
    /// Of a footprint.
    pub fn new(footprint: &Footprint) -> Self {
        let sharpness = footprint.sharpness();
        let smooth = sharpness <= POLYNOMIAL_LIMIT;
        Self {
            cutoff: footprint.cutoff,
            norm: footprint.norm() as f32,
            depth: depth_of(footprint),
            spacing: footprint.spacing_for_radius(1.0),
            narrowing: footprint.narrowing(),
            sharpness,
            rim: exp_neg(sharpness),
            g: if smooth { fit(f64::from(sharpness)) } else { [0.0; TERMS] },
            smooth,
        }
    }

    /// The numbers that [`Kernel::profile`] computes with: G, q, e^−q, 1 where G holds; then the spacing and the narrowing.
    #[cfg(feature = "gpu")]
    pub(crate) fn table(&self) -> [f32; TABLE] {
        let mut table = [0.0; TABLE];
        table[..TERMS].copy_from_slice(&self.g);
        let smooth = f32::from(u8::from(self.smooth));
        let [constant, slope] = self.narrowing;
        table[TERMS..TERMS + 6].copy_from_slice(&[self.sharpness, self.rim, smooth, self.spacing, constant, slope]);
        table
    }

    /// w at t = max(1 − s, 0), 1 − e^−q·(1 + q + q²/2) at the centre.
    #[inline(always)]
    pub fn profile<S: Simd>(&self, simd: S, t: Lanes<S>) -> Lanes<S> {
        let of = |v: f32| Lanes::splat(simd, v);
        if self.smooth {
            // Pairs first: half the latency of Horner's scheme.
            let g = &self.g;
            let t2 = t * t;
            let (a, b) = (of(g[1]).mul_add(t, of(g[0])), of(g[3]).mul_add(t, of(g[2])));
            let (c, d) = (of(g[5]).mul_add(t, of(g[4])), of(g[7]).mul_add(t, of(g[6])));
            let (low, high) = (b.mul_add(t2, a), d.mul_add(t2, c));
            return high.mul_add(t2 * t2, low) * (t2 * t);
        }
        let q = of(self.sharpness);
        let r = q * t;
        let taper = of(self.rim) * (of(1.0) + r + of(0.5) * r * r);
        ((q - r).exp_neg() - taper).max(of(0.0)).where_less(of(0.0), t)
    }
}

/// Half the width of the triweight that has the deviation of a footprint of R = 1: its own is a third of it.
pub(crate) fn depth_of(footprint: &Footprint) -> f32 {
    (3.0 * footprint.deviation()) as f32
}

/// The polynomial that equals G at the Chebyshev points.
fn fit(q: f64) -> [f32; TERMS] {
    let node = |k: usize| {
        let angle = (k as f64 + 0.5) * PI / TERMS as f64;
        FIT_BEGIN + (1.0 - FIT_BEGIN) * (0.5 + 0.5 * libm::cos(angle))
    };
    let nodes: [f64; TERMS] = std::array::from_fn(node);
    // Newton's divided differences, then multiplied out from the last.
    let mut newton = nodes.map(|t| tail(q, t));
    for order in 1..TERMS {
        for k in (order..TERMS).rev() {
            newton[k] = (newton[k] - newton[k - 1]) / (nodes[k] - nodes[k - order]);
        }
    }
    let mut g = [0.0; TERMS];
    for k in (0..TERMS).rev() {
        for power in (1..TERMS).rev() {
            g[power] = g[power - 1] - nodes[k] * g[power];
        }
        g[0] = newton[k] - nodes[k] * g[0];
    }
    g.map(|c| c as f32)
}

/// G(t) = q³e^−q·Σ_j (qt)^j/(j + 3)!, all terms positive.
fn tail(q: f64, t: f64) -> f64 {
    let (mut sum, mut term) = (0.0, 1.0 / 6.0);
    for j in 4..64 {
        sum += term;
        term *= q * t / f64::from(j);
    }
    q * q * q * libm::exp(-q) * sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::lanes::MAX_LANES;

    struct Profile<'a>(&'a Kernel, f32);

    impl pulp::WithSimd for Profile<'_> {
        type Output = f32;

        fn with_simd<S: Simd>(self, simd: S) -> f32 {
            let mut out = [0.0; MAX_LANES];
            let t = (Lanes::splat(simd, 1.0) - Lanes::splat(simd, self.1)).max(Lanes::splat(simd, 0.0));
            self.0.profile(simd, t).store(&mut out);
            out[0]
        }
    }

    #[test]
    fn every_cutoff_gives_its_profile() {
        for cutoff in [1.0, 1.5, 2.0, 2.5, 3.0, 3.2, 4.0, 5.0, 8.0] {
            let footprint = Footprint { cutoff };
            let kernel = Kernel::new(&footprint);
            let largest = (0..=4400)
                .map(|i| i as f32 / 4000.0)
                .map(|s| {
                    let got = pulp::Arch::new().dispatch(Profile(&kernel, s));
                    (f64::from(got) - footprint.profile(f64::from(s))).abs()
                })
                .fold(0.0, f64::max);
            assert!(largest < 1e-6, "cutoff {cutoff}: {largest:e}");
        }
    }

    #[test]
    fn narrowed_footprints_keep_their_sum_and_are_as_wide_as_cells() {
        for cutoff in [1.0, 2.0, 3.0, 5.0, 8.0] {
            let footprint = Footprint { cutoff };
            let [constant, slope] = footprint.narrowing().map(f64::from);
            let (n, cell) = (100_000, f64::from(footprint.spacing_for_radius(1.0)));
            let mut sums = [0.0; 3];
            for s in (0..n).map(|i| (f64::from(i) + 0.5) / f64::from(n)) {
                let (w, narrow) = (footprint.profile(s), constant + slope * s);
                [w, w * narrow, w * narrow * s].iter().zip(&mut sums).for_each(|(add, sum)| *sum += add);
            }
            let [all, narrow, width] = sums;
            assert!((narrow / all - 1.0).abs() < 1e-5, "cutoff {cutoff}: {}", narrow / all);
            assert!((width / all - cell * cell / 6.0).abs() < 1e-5, "cutoff {cutoff}: {}", width / all);
        }
    }

    #[test]
    fn nothing_lies_outside_the_rim() {
        for cutoff in [3.0, 5.0] {
            let kernel = Kernel::new(&Footprint { cutoff });
            for s in [1.0, 1.0f32.next_up(), 2.0, 1e30] {
                assert_eq!(pulp::Arch::new().dispatch(Profile(&kernel, s)), 0.0);
            }
        }
    }
}
