//! The profile of a footprint as a fragment evaluates it: a polynomial in t = 1 − s where one of degree 10 suffices.
//!
//! With q = cutoff²/2 the profile of [`Footprint`] is the tail of an exponential series,
//! w = e^−q·Σ_{k≥3} (qt)^k/k! = t³·G(t). G is smooth and positive, so for q ≤ 4.5 the polynomial of
//! degree 7 through the Chebyshev points of \[0.2, 1\] stands for it: |error of w| < 4·10⁻⁷ (the profile is about 1 at
//! its centre). The interval leaves out small t, where t³ forgives all. w and its first two slopes vanish at the rim
//! by the factor t³, so the area outside needs no mask but t = max(1 − s, 0). Sharper footprints are evaluated by the
//! exponential.
//!
//! The share of a kernel before a plane, [`Footprint::share_before`], is the distribution function of a triweight and a
//! correction, with the factor (1 + t)⁴, so that a small share keeps its digits:
//!
//! C(t) = (1 + t)⁴·(½ − t(29/32 − t(5/8 − 5t/32)) + t(1 − t)⁴·E(t²))
//!
//! where the polynomial E makes |error of C| < 10⁻⁶, that of its own rounding, for cutoffs up to 3, 2·10⁻⁵ beyond. Wider footprints than of 4.3
//! deviations are narrowed to these: less than 2·10⁻⁵ of them lies beyond.

use super::lanes::{Broadcast, Lanes, exp_neg};
use crate::{Footprint, FootprintImage, FootprintStack};
use pulp::Simd;
use std::f64::consts::PI;
use std::sync::Arc;

/// Coefficients of the polynomial.
const TERMS: usize = 8;

/// Numbers of a footprint on a device, in fours.
#[cfg(feature = "gpu")]
pub(crate) const TABLE: usize = 20;

/// The greatest q for which a polynomial is used; that of the default cutoff of 3.
const POLYNOMIAL_LIMIT: f32 = 4.5;

/// The interval in t that the fit of G holds for.
const PROFILE_FIT: [f64; 2] = [0.2, 1.0];

/// Coefficients of E.
pub(crate) const SHARE_TERMS: usize = 6;

/// The interval in t² that the fit of E holds for: beyond, (1 − t²)⁴ forgives all.
const SHARE_FIT: [f64; 2] = [0.0, 0.6];

/// Deviations within which a kernel has its share before a plane.
const SHARE_DEVIATIONS: f32 = 4.3;

/// One footprint, ready for fragments.
#[derive(Debug, Clone, PartialEq)]
pub struct Kernel {
    pub(crate) cutoff: f32,
    /// 1/∫w dA for R = 1.
    pub(crate) norm: f32,
    /// Half the width of its share before a plane, [`Kernel::share_before`], for R = 1.
    pub(crate) half_width: f32,
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
    /// E, the constant term first.
    share: [f32; SHARE_TERMS],
    /// What discs show in the place of the profile.
    pub(crate) pattern: Option<Pattern>,
}

/// The image of a footprint that is one.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Pattern {
    pub(crate) image: Arc<FootprintImage>,
    /// Integral of the profile.
    pub(crate) integral: f32,
    /// Profile at the rim of the circle that is as large as what the image covers.
    pub(crate) solid_profile: f32,
}

impl Kernel {
    /// Of a footprint.
    pub fn new(footprint: &Footprint) -> Self {
        let sharpness = footprint.sharpness();
        let smooth = sharpness <= POLYNOMIAL_LIMIT;
        Self {
            cutoff: footprint.cutoff,
            norm: footprint.norm() as f32,
            half_width: half_width(footprint),
            spacing: footprint.spacing_for_radius(1.0),
            narrowing: footprint.narrowing(),
            sharpness,
            rim: exp_neg(sharpness),
            g: if smooth { fit(PROFILE_FIT, |t| tail(f64::from(sharpness), t)) } else { [0.0; TERMS] },
            smooth,
            share: share_terms(footprint),
            pattern: None,
        }
    }

    /// Of all footprints of a stack.
    pub fn of_stack(footprints: &FootprintStack) -> impl Iterator<Item = Self> + '_ {
        footprints.layers().iter().enumerate().map(|(id, layer)| {
            let pattern = footprints.image(id).map(|image| Pattern {
                image: Arc::clone(image),
                integral: (1.0 / layer.norm()) as f32,
                solid_profile: layer.profile(image.solid_area / PI) as f32,
            });
            Self { pattern, ..Self::new(layer) }
        })
    }

    /// The numbers that [`Kernel::profile`] computes with: G, q, e^−q, 1 where G holds; then the spacing, the narrowing and E.
    #[cfg(feature = "gpu")]
    pub(crate) fn table(&self) -> [f32; TABLE] {
        let mut table = [0.0; TABLE];
        table[..TERMS].copy_from_slice(&self.g);
        let smooth = f32::from(u8::from(self.smooth));
        let [constant, slope] = self.narrowing;
        table[TERMS..TERMS + 6].copy_from_slice(&[self.sharpness, self.rim, smooth, self.spacing, constant, slope]);
        table[TERMS + 6..TERMS + 6 + SHARE_TERMS].copy_from_slice(&self.share);
        table
    }

    /// w at t = max(1 − s, 0), 1 − e^−q·(1 + q + q²/2) at the centre.
    #[inline(always)]
    pub fn profile<S: Simd>(&self, simd: S, t: Lanes<S>) -> Lanes<S> {
        if self.smooth {
            // Pairs first: half the latency of Horner's scheme.
            let g = &self.g;
            let t2 = t * t;
            let a = simd.lanes(g[1]).mul_add(t, simd.lanes(g[0]));
            let b = simd.lanes(g[3]).mul_add(t, simd.lanes(g[2]));
            let c = simd.lanes(g[5]).mul_add(t, simd.lanes(g[4]));
            let d = simd.lanes(g[7]).mul_add(t, simd.lanes(g[6]));
            let low = b.mul_add(t2, a);
            let high = d.mul_add(t2, c);
            return high.mul_add(t2 * t2, low) * (t2 * t);
        }
        let q = simd.lanes(self.sharpness);
        let r = q * t;
        let taper = simd.lanes(self.rim) * (simd.lanes(1.0) + r + simd.lanes(0.5) * r * r);
        ((q - r).exp_neg() - taper).max(simd.lanes(0.0)).where_less(simd.lanes(0.0), t)
    }

    /// Share of the kernel before a plane across the ray, `distance` behind its centre in units of [`Kernel::half_width`]·R.
    #[inline(always)]
    pub(crate) fn share_before<S: Simd>(&self, simd: S, distance: Lanes<S>) -> Lanes<S> {
        let t = distance.max(simd.lanes(-1.0)).min(simd.lanes(1.0));
        // Not `map`, which is not compiled into code for vectors.
        let [a, b, c, d, e, f] = self.share;
        let [a, b, c, d, e, f] =
            [simd.lanes(a), simd.lanes(b), simd.lanes(c), simd.lanes(d), simd.lanes(e), simd.lanes(f)];
        let before = simd.lanes(1.0) + t;
        let behind = simd.lanes(1.0) - t;
        let square = t * t;
        let [before, behind] = [before * before, behind * behind];
        let correction = a + square * (b + square * (c + square * (d + square * (e + square * f))));
        let triweight =
            simd.lanes(0.5) - t * (simd.lanes(0.906_25) - t * (simd.lanes(0.625) - t * simd.lanes(0.156_25)));
        before * before * (triweight + t * (behind * behind) * correction)
    }
}

/// Half the width of the share before a plane, for R = 1.
pub(crate) fn half_width(footprint: &Footprint) -> f32 {
    (SHARE_DEVIATIONS / footprint.cutoff).min(1.0)
}

/// E of a footprint.
pub(crate) fn share_terms(footprint: &Footprint) -> [f32; SHARE_TERMS] {
    let half_width = f64::from(half_width(footprint));
    fit(SHARE_FIT, |square| {
        let t = libm::sqrt(square);
        let triweight = 0.5 + 35.0 / 32.0 * t * (1.0 - square * (1.0 - square * (0.6 - square / 7.0)));
        let rest = (1.0 - square) * (1.0 - square);
        (footprint.share_before(half_width * t) - triweight) / (t * rest * rest)
    })
}

/// The polynomial that equals a function at the Chebyshev points of an interval, the constant term first.
fn fit<const N: usize>(range: [f64; 2], function: impl Fn(f64) -> f64) -> [f32; N] {
    let [begin, end] = range;
    let node = |k: usize| {
        let angle = (k as f64 + 0.5) * PI / N as f64;
        begin + (end - begin) * (0.5 + 0.5 * libm::cos(angle))
    };
    let nodes: [f64; N] = std::array::from_fn(node);
    // Newton's divided differences, then multiplied out from the last.
    let mut newton = nodes.map(function);
    for order in 1..N {
        for k in (order..N).rev() {
            newton[k] = (newton[k] - newton[k - 1]) / (nodes[k] - nodes[k - order]);
        }
    }
    let mut powers = [0.0; N];
    for k in (0..N).rev() {
        for power in (1..N).rev() {
            powers[power] = powers[power - 1] - nodes[k] * powers[power];
        }
        powers[0] = newton[k] - nodes[k] * powers[0];
    }
    powers.map(|c| c as f32)
}

/// G(t) = q³e^−q·Σ_j (qt)^j/(j + 3)!, all terms positive.
fn tail(q: f64, t: f64) -> f64 {
    let mut sum = 0.0;
    let mut term = 1.0 / 6.0;
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
            let t = (simd.lanes(1.0) - simd.lanes(self.1)).max(simd.lanes(0.0));
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
            let n = 100_000;
            let cell = f64::from(footprint.spacing_for_radius(1.0));
            let mut sums = [0.0; 3];
            for s in (0..n).map(|i| (f64::from(i) + 0.5) / f64::from(n)) {
                let w = footprint.profile(s);
                let narrow = constant + slope * s;
                [w, w * narrow, w * narrow * s].iter().zip(&mut sums).for_each(|(add, sum)| *sum += add);
            }
            let [whole, narrow, width] = sums;
            assert!((narrow / whole - 1.0).abs() < 1e-5, "cutoff {cutoff}: {}", narrow / whole);
            assert!((width / whole - cell * cell / 6.0).abs() < 1e-5, "cutoff {cutoff}: {}", width / whole);
        }
    }

    /// The share before a plane by the lanes of this machine.
    struct Share<'a>(&'a Kernel, f32);

    impl pulp::WithSimd for Share<'_> {
        type Output = f32;

        fn with_simd<S: Simd>(self, simd: S) -> f32 {
            let mut out = [0.0; MAX_LANES];
            self.0.share_before(simd, simd.lanes(self.1)).store(&mut out);
            out[0]
        }
    }

    #[test]
    fn shares_before_a_plane_are_those_of_the_footprint() {
        for (cutoff, tolerance) in [(1.0, 1e-6), (2.0, 1e-6), (3.0, 1e-6), (5.0, 2e-5), (8.0, 2e-5)] {
            let footprint = Footprint { cutoff };
            let kernel = Kernel::new(&footprint);
            let share = |t: f32| pulp::Arch::new().dispatch(Share(&kernel, t));
            for i in -1200..=1200 {
                let t = i as f32 / 1000.0;
                let exact = footprint.share_before(f64::from(t * kernel.half_width));
                assert!((f64::from(share(t)) - exact).abs() < tolerance, "cutoff {cutoff}, {t}: {} {exact}", share(t));
            }
            assert_eq!([share(-1.0), share(0.0), share(1.0)], [0.0, 0.5, 1.0]);
            // A tiny share keeps its digits: it grows with the fourth power.
            let growth = share(-0.998) / share(-0.999);
            assert!((growth / 16.0 - 1.0).abs() < 0.02, "cutoff {cutoff}: {growth}");
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
