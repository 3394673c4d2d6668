//! Finds all roots of f − c on a piece of a line.
//!
//! A piece is dropped when a bound of the field's gradient, or its own over the ball around the piece, excludes c. Where the
//! ends differ in sign and the cubic with the values and slopes of both ends is monotone (slopes at most 3 times the chord's:
//! de Boor and Swartz), there is one root, found by bracketing (Illinois). Otherwise slopes tell: where f runs towards c from
//! both ends there is an extremum between, which is looked for; it either shows two roots, or a double root where it touches
//! c, or none. The remaining pieces are halved, and after [`DEPTH`] halvings counted as unproven.

use crate::surfaces::implicit::ImplicitSurface;
use glam::DVec3;
use splat_core::glam;

/// Halvings of a piece of which nothing is proven.
const DEPTH: u32 = 4;

/// An extremum whose value is this share of the values at the ends touches c: a double root.
const TOUCH: f64 = 1e-10;

/// A place on the line with f − c there.
#[derive(Debug, Clone, Copy)]
pub(crate) struct At {
    pub(crate) t: f64,
    pub(crate) f: f64,
}

/// f − c along o + t·d.
pub(crate) struct Line<'a> {
    pub(crate) surface: ImplicitSurface<'a>,
    pub(crate) o: DVec3,
    pub(crate) d: DVec3,
    /// Greatest |∇f| where it is searched; infinite where none is known.
    pub(crate) steepest: f64,
}

/// Results of the search along a piece.
#[derive(Debug, Default)]
pub(crate) struct Found {
    /// Roots, each with a place beside it where the gradient is not zero even if the root is a double one.
    pub(crate) roots: Vec<(f64, f64)>,
    /// Pieces that may hide a pair of roots.
    pub(crate) unproven: u64,
    /// A value that was not finite.
    pub(crate) broken: u64,
}

impl Line<'_> {
    pub(crate) fn at(&self, t: f64) -> At {
        At { t, f: self.surface.value(self.o + self.d * t) }
    }

    pub(crate) fn slope(&self, t: f64) -> f64 {
        self.surface.field.gradient(self.o + self.d * t).dot(self.d)
    }

    /// Appends all roots between `a` and `b`, both ends open against being counted twice: f = c counts as above c.
    pub(crate) fn roots(&self, a: At, b: At, found: &mut Found) {
        if a.f.is_finite() && b.f.is_finite() {
            self.search([a, b], [None; 2], 0, found);
        } else {
            found.broken += 1;
        }
    }

    /// `slopes` are those at both ends, where they are known.
    fn search(&self, ends: [At; 2], slopes: [Option<f64>; 2], depth: u32, found: &mut Found) {
        let [a, b] = ends;
        let crosses = (a.f < 0.0) != (b.f < 0.0);
        if !crosses && self.excluded(a, b, depth) {
            return;
        }
        let [ga, gb] = [(slopes[0], a), (slopes[1], b)].map(|(slope, at)| slope.unwrap_or_else(|| self.slope(at.t)));
        let up = if b.f < 0.0 { -1.0 } else { 1.0 };
        if crosses {
            // Slopes of 0 to 3 times the chord's: the cubic through both ends rises or falls all the way.
            let chord = (b.f - a.f) / (b.t - a.t);
            let steady = |g: f64| g / chord > 0.0 && g / chord <= 3.0;
            if (steady(ga) && steady(gb)) || depth >= DEPTH {
                found.unproven += u64::from(!(steady(ga) && steady(gb)));
                let t = self.bracket(a, b);
                found.roots.push((t, t));
                return;
            }
        } else if ga * up < 0.0 && gb * up > 0.0 {
            self.extremum(a, b, [ga, gb], up, depth, found);
            return;
        } else if depth >= DEPTH {
            found.unproven += 1;
            return;
        }
        let m = self.at(0.5 * (a.t + b.t));
        if !m.f.is_finite() {
            found.broken += 1;
            return;
        }
        self.search([a, m], [Some(ga), None], depth + 1, found);
        self.search([m, b], [None, Some(gb)], depth + 1, found);
    }

    /// Whether a bound shows that f ≠ c between two places: of the gradient, which costs nothing more, or of the values, which costs
    /// as much as several of them, where no other is known or the piece is not halved any more.
    fn excluded(&self, a: At, b: At, depth: u32) -> bool {
        if a.f.abs() + b.f.abs() > self.steepest * (b.t - a.t) * (1.0 + 1e-12) {
            return true;
        }
        if self.steepest.is_finite() && depth < DEPTH {
            return false;
        }
        let middle = self.o + self.d * (0.5 * (a.t + b.t));
        let half = 0.5 * (b.t - a.t) * (1.0 + 1e-12);
        let level = self.surface.level;
        self.surface.field.bound(middle, half).is_some_and(|(low, high)| low > level || high < level)
    }

    /// f runs towards c from both ends, on the side `up` of it: looks for the place where it turns.
    fn extremum(&self, a: At, b: At, slopes: [f64; 2], up: f64, depth: u32, found: &mut Found) {
        let mut low = a.t;
        let mut high = b.t;
        let [mut g_low, mut g_high] = slopes;
        for step in 0..60 {
            // The root of the slope's chord, and the middle now and then so that the piece surely shrinks.
            let chord = low + (high - low) * (g_low / (g_low - g_high));
            let t = if step % 3 == 2 || !chord.is_finite() { 0.5 * (low + high) } else { chord };
            if !(t > low && t < high) {
                break;
            }
            let m = self.at(t);
            if m.f * up < 0.0 {
                for piece in [[a, m], [m, b]] {
                    self.search(piece, [None; 2], depth.max(DEPTH - 1), found);
                }
                return;
            }
            let g = self.slope(t);
            if g * up < 0.0 {
                (low, g_low) = (t, g)
            } else {
                (high, g_high) = (t, g)
            }
            if g == 0.0 {
                (low, high) = (t, t);
                break;
            }
        }
        let turn = 0.5 * (low + high);
        if self.at(turn).f.abs() <= TOUCH * a.f.abs().max(b.f.abs()) {
            found.roots.push((turn, 0.5 * (turn + b.t)));
        }
    }

    /// The root between two ends of different sign, to 10⁻¹⁰ of the piece: positions are kept with 24 bits.
    fn bracket(&self, a: At, b: At) -> f64 {
        let mut low = a;
        let mut high = b;
        let mut side = 0;
        let small = 1e-10 * (b.t - a.t);
        for step in 0..100 {
            let chord = (low.t * high.f - high.t * low.f) / (high.f - low.f);
            let t = if step % 16 == 15 || !(chord > low.t && chord < high.t) { 0.5 * (low.t + high.t) } else { chord };
            let m = self.at(t);
            if m.f == 0.0 || high.t - low.t <= small || !m.f.is_finite() {
                return t;
            }
            if (m.f < 0.0) == (low.f < 0.0) {
                if (t - low.t).abs() <= small {
                    return t;
                }
                low = m;
                high.f *= if side == -1 { 0.5 } else { 1.0 };
                side = -1;
            } else {
                if (high.t - t).abs() <= small {
                    return t;
                }
                high = m;
                low.f *= if side == 1 { 0.5 } else { 1.0 };
                side = 1;
            }
        }
        0.5 * (low.t + high.t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DMat3;
    use splat_core::{DAabb, ScalarField};

    /// Π(x − root), without a bound.
    struct Roots(&'static [f64]);

    impl ScalarField for Roots {
        fn value(&self, p: DVec3) -> f64 {
            self.0.iter().map(|r| p.x - r).product()
        }

        fn gradient(&self, p: DVec3) -> DVec3 {
            let without =
                |k: usize| -> f64 { (0..self.0.len()).filter(|i| *i != k).map(|i| p.x - self.0[i]).product() };
            DVec3::X * (0..self.0.len()).map(without).sum::<f64>()
        }

        fn hessian(&self, _: DVec3) -> DMat3 {
            DMat3::ZERO
        }

        fn bound(&self, _: DVec3, _: f64) -> Option<(f64, f64)> {
            None
        }
    }

    /// `steepest` bounds the slope there.
    fn found_with(field: &Roots, from: f64, to: f64, steepest: f64) -> Found {
        let surface = ImplicitSurface {
            field,
            level: 0.0,
            bounds: DAabb::new(DVec3::splat(-9.0), DVec3::splat(9.0)),
            inside: None,
        };
        let line = Line { surface, o: DVec3::ZERO, d: DVec3::X, steepest };
        let mut found = Found::default();
        line.roots(line.at(from), line.at(to), &mut found);
        found.roots.sort_by(|a, b| a.0.total_cmp(&b.0));
        found
    }

    fn found(field: &Roots, from: f64, to: f64) -> Found {
        found_with(field, from, to, f64::INFINITY)
    }

    #[test]
    fn a_bound_of_the_gradient_proves_what_halving_does_not_and_loses_no_root() {
        let apart = &Roots(&[1.5, 2.5]);
        let near = &Roots(&[1.000_1, 1.000_2]);
        assert!(found(apart, 0.0, 1.0).unproven > 0);
        assert_eq!(found_with(apart, 0.0, 1.0, 4.0).unproven, 0);
        // f′ is −2.0003 at 0.
        assert!(found_with(near, 0.0, 1.0, 2.01).unproven > 0);
        let pair = &Roots(&[0.499_9, 0.500_1]);
        assert_eq!(found_with(pair, 0.0, 1.0, 1.0).roots.len(), 2);
    }

    #[test]
    fn simple_roots_pairs_and_double_roots_are_found() {
        let cases: [&'static [f64]; 7] = [
            &[0.3],
            &[0.3, 0.7],
            &[0.499_9, 0.500_1],
            &[0.2, 0.5, 0.8],
            &[0.1, 0.100_1, 0.9],
            &[-1.0, 0.6],
            &[0.25, 0.25],
        ];
        for roots in cases {
            let mut expected: Vec<f64> = roots.iter().copied().filter(|r| (0.0..1.0).contains(r)).collect();
            expected.dedup();
            let found = found(&Roots(roots), 0.0, 1.0);
            let places: Vec<f64> = found.roots.iter().map(|r| r.0).collect();
            assert_eq!(places.len(), expected.len(), "{roots:?}: {places:?}");
            let near = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-6;
            assert!(places.iter().zip(&expected).all(near), "{roots:?}: {places:?}");
        }
    }

    #[test]
    fn a_piece_without_roots_has_none_and_a_root_on_a_border_one() {
        assert!(found(&Roots(&[2.0, 3.0]), 0.0, 1.0).roots.is_empty());
        let pieces = [(0.0, 0.25), (0.25, 0.5), (0.5, 1.0)];
        let count: usize = pieces.iter().map(|(a, b)| found(&Roots(&[0.25]), *a, *b).roots.len()).sum();
        assert_eq!(count, 1);
        assert_eq!(found(&Roots(&[f64::NAN]), 0.0, 1.0).broken, 1);
    }
}
