//! Local fits (Ohtake et al. 2003, section 4): which shape suits the samples of a ball.
//!
//! Samples are taken in the local coordinates y = (p − center)/R with the B-spline weights of the blend, normalised to
//! the sum 1. The usual shape is a height field over the plane across the mean normal n, the minimum of
//! Σ wᵢ(n·yᵢ − h(uᵢ, vᵢ))²; a general quadric, where normals turn by 90° or more, is the minimum of
//! Σ wᵢQ(yᵢ)² + Σ(Q(qⱼ) − dⱼ)²/m over auxiliary places qⱼ (corners and middle of the cell) whose six nearest samples
//! agree on the side; d is the mean of their distances n·(q − p).
//!
//! [`RIDGE`] is added to the squares of second-order coefficients: it closes directions that few samples leave open in
//! favour of the flattest shape. If the samples do not even determine a plane, the fit is the plane through the mean, across the
//! mean normal.
//!
//! Deviations: the height field is tried first wherever it is possible. Edges, corners and quadrics are tried only if it misses
//! the tolerance, and the best shape is kept. A shape whose values run away where the ball has no samples is
//! rejected ([`Ball::believes`]). A cell without samples gets a plane, or a constant with the sign that
//! [`mod@super::side`] finds.

use super::quadric::{Quadric, Shape, active_piece};
use super::samples::{SampleTree, SurfaceSample};
use super::solve::{add_equation, solve};
use super::weight::weight;
use super::{Tolerances, sharp};
use splat_core::glam::DVec3;

/// See the head of the file; in units of the support radius.
const RIDGE: f64 = 1e-7;
/// Samples that decide on the side of an auxiliary place.
const JUDGES: usize = 6;
/// Fewer samples than this get a plane.
const FEWEST_FOR_CURVES: usize = 8;

/// The largest value of a shape over the distance of the nearest sample.
const FARTHEST: f64 = 2.0;
/// What a value may be beyond that, and on the wrong side.
const SLACK: f64 = 0.02;
/// Samples that must agree on the side for a shape to have to.
const WITNESSES: usize = 3;
/// How far the plane of samples around a cell may be off its distance, over that of the nearest.
const AGREES: f64 = 0.25;

/// A ball of samples in its local coordinates.
pub(super) struct Ball {
    pub(super) center: DVec3,
    pub(super) radius: f64,
    /// Samples within the ball, y and normal.
    pub(super) samples: Vec<SurfaceSample>,
    /// Weights, summing to 1.
    pub(super) weights: Vec<f64>,
    /// Samples whose error counts: those within the ball before it was enlarged, |y|² ≤ this.
    pub(super) counted: f64,
}

/// A shape and its largest error, a length in local coordinates.
#[derive(Debug, Clone)]
pub(super) struct Fit {
    pub(super) shape: Shape,
    pub(super) error: f64,
}

/// Scratch of one task.
#[derive(Default)]
pub(super) struct Scratch {
    pub(super) ids: Vec<u32>,
    pub(super) nearest: Vec<(f64, u32)>,
}

/// Corner 0 to 7 of the cube around 0, or its middle.
fn corner_or_middle(half: f64, q: usize) -> DVec3 {
    let sign = |a: usize| if q >> a & 1 == 0 { -half } else { half };
    if q == 8 { DVec3::ZERO } else { DVec3::new(sign(0), sign(1), sign(2)) }
}

impl Ball {
    pub(super) fn new(tree: &SampleTree, ids: &[u32], center: DVec3, radius: f64, before: f64) -> Self {
        let inverse = 1.0 / radius;
        let local = |id: &u32| {
            let s = tree.samples[*id as usize];
            SurfaceSample { position: (s.position - center) * inverse, normal: s.normal }
        };
        let samples: Vec<SurfaceSample> = ids.iter().map(local).collect();
        let mut weights: Vec<f64> = samples.iter().map(|s| weight(s.position.length_squared())).collect();
        let sum: f64 = weights.iter().sum();
        let even = 1.0 / weights.len() as f64;
        weights.iter_mut().for_each(|w| *w = if sum > 0.0 { *w / sum } else { even });
        let counted = (before * inverse) * (before * inverse);
        Self { center, radius, samples, weights, counted }
    }

    /// Taubin's distance |Q|/|∇Q|, the largest over the samples that count; stops above `enough`.
    pub(super) fn error(&self, shape: &Shape, enough: f64) -> f64 {
        let mut worst = 0.0f64;
        for s in self.samples.iter().filter(|s| s.position.length_squared() <= self.counted) {
            let (value, gradient) = active_piece(&shape.pieces, shape.joint, s.position).value_gradient(s.position);
            let error = if value == 0.0 { 0.0 } else { value.abs() / gradient.length() };
            worst = worst.max(error);
            if worst > enough {
                break;
            }
        }
        worst
    }

    /// A shape and its error, infinite where it cannot be believed.
    fn fit(&self, shape: Shape, enough: f64) -> Fit {
        let error = self.error(&shape, enough);
        let believed = error > enough || self.believes(&shape);
        Fit { shape, error: if believed { error } else { f64::INFINITY } }
    }

    /// Corners of the cube in the support and its middle.
    fn places(&self) -> impl Iterator<Item = DVec3> {
        let half = (self.counted / 3.0).sqrt();
        (0..9).map(move |q| corner_or_middle(half, q))
    }

    /// Whether a shape has values of a distance to the samples, and their side, at these places: samples that cover a part
    /// of the ball let quadratic terms run away in the rest.
    fn believes(&self, shape: &Shape) -> bool {
        self.places().all(|y| {
            let value = active_piece(&shape.pieces, shape.joint, y).value(y);
            let (nearest, low, high) = self.heights(y);
            value.abs() <= FARTHEST * nearest + SLACK
                && (value >= 0.0 || low <= SLACK)
                && (value <= 0.0 || high >= -SLACK)
        })
    }

    /// The shape of a ball that was enlarged because its cell has no samples, `distance` from them at its middle: their
    /// plane where that agrees, within a part of how far the nearest is, and a constant elsewhere.
    pub(super) fn beside(&self, distance: f64, nearest: f64) -> Shape {
        let ids: Vec<usize> = (0..self.samples.len()).collect();
        let plane = Shape::smooth(self.height(&ids, false));
        let off = (plane.pieces[0].constant - distance).abs();
        if off <= AGREES * nearest && self.believes(&plane) {
            plane
        } else {
            Shape::smooth(Quadric { constant: distance, ..Quadric::default() })
        }
    }

    /// Distance of the nearest sample, least and greatest n·(y − p) of the nearest [`WITNESSES`].
    fn heights(&self, y: DVec3) -> (f64, f64, f64) {
        let mut near = [(f64::INFINITY, 0.0); WITNESSES];
        for s in &self.samples {
            let mut new = (s.position.distance_squared(y), s.normal.dot(y - s.position));
            for held in &mut near {
                if new.0 < held.0 {
                    std::mem::swap(held, &mut new);
                }
            }
        }
        let found = near.iter().filter(|n| n.0 < f64::INFINITY).map(|n| n.1);
        let (low, high) = found.fold((f64::INFINITY, f64::NEG_INFINITY), |a, h| (a.0.min(h), a.1.max(h)));
        (near[0].0.sqrt(), low, high)
    }

    /// Weighted mean of normals, or the first sample's where they cancel.
    fn mean_normal(&self, chosen: &[usize]) -> DVec3 {
        let sum: DVec3 = chosen.iter().map(|&i| self.samples[i].normal * self.weights[i]).sum();
        sum.try_normalize().unwrap_or(self.samples[chosen[0]].normal)
    }

    /// The height field of some samples, at least one.
    pub(super) fn height(&self, chosen: &[usize], curved: bool) -> Quadric {
        let n = self.mean_normal(chosen);
        let (u, v) = n.any_orthonormal_pair();
        let frame = [u, v, n];
        let local = chosen.iter().map(|&i| {
            let y = self.samples[i].position;
            (y.dot(u), y.dot(v), y.dot(n), self.weights[i])
        });
        let total: f64 = local.clone().map(|s| s.3).sum();
        // Weights of a part may all be 0 at the rim of the ball.
        let weigh = |w: f64| if total > 0.0 { w / total } else { 1.0 / chosen.len() as f64 };
        let curves = || {
            let mut a = [[0.0; 6]; 6];
            let mut b = [0.0; 6];
            for (u, v, h, w) in local.clone() {
                add_equation(&mut a, &mut b, &[u * u, u * v, v * v, u, v, 1.0], h, weigh(w));
            }
            (0..3).for_each(|i| a[i][i] += RIDGE);
            solve(a, b)
        };
        let plane = || {
            let mut a = [[0.0; 3]; 3];
            let mut b = [0.0; 3];
            for (u, v, h, w) in local.clone() {
                add_equation(&mut a, &mut b, &[u, v, 1.0], h, weigh(w));
            }
            solve(a, b).map(|[d, e, f]| [0.0, 0.0, 0.0, d, e, f])
        };
        let across = || [0.0, 0.0, 0.0, 0.0, 0.0, local.clone().map(|s| weigh(s.3) * s.2).sum()];
        let curved = curved && chosen.len() >= FEWEST_FOR_CURVES;
        let solution = if curved { curves() } else { None };
        Quadric::height(frame, solution.or_else(plane).unwrap_or_else(across))
    }

    /// The general quadric, or `None` where no auxiliary place is reliable or the system leaves a direction open.
    fn quadric(&self, tree: &SampleTree, half: f64, nearest: &mut Vec<(f64, u32)>) -> Option<Quadric> {
        let mut a = [[0.0; 10]; 10];
        let mut b = [0.0; 10];
        let phi = |y: DVec3| [y.x * y.x, y.y * y.y, y.z * y.z, y.y * y.z, y.z * y.x, y.x * y.y, y.x, y.y, y.z, 1.0];
        for (s, w) in self.samples.iter().zip(&self.weights) {
            add_equation(&mut a, &mut b, &phi(s.position), 0.0, *w);
        }
        let places: Vec<(DVec3, f64)> = (0..9).filter_map(|q| self.auxiliary(tree, half, q, nearest)).collect();
        for (y, distance) in &places {
            add_equation(&mut a, &mut b, &phi(*y), *distance, 1.0 / places.len() as f64);
        }
        (0..6).for_each(|i| a[i][i] += RIDGE);
        let q = if places.is_empty() { None } else { solve(a, b) }?;
        Some(Quadric {
            constant: q[9],
            linear: DVec3::new(q[6], q[7], q[8]),
            diagonal: DVec3::new(q[0], q[1], q[2]),
            mixed: 0.5 * DVec3::new(q[3], q[4], q[5]),
        })
    }

    /// Corner 0 to 7 or middle of the cell in local coordinates and its distance, if the samples agree on its side.
    fn auxiliary(&self, tree: &SampleTree, half: f64, q: usize, nearest: &mut Vec<(f64, u32)>) -> Option<(DVec3, f64)> {
        let at = self.center + corner_or_middle(half, q);
        tree.nearest(at, JUDGES, nearest);
        let distance = |e: &(f64, u32)| {
            let s = &tree.samples[e.1 as usize];
            s.normal.dot(at - s.position)
        };
        let outside = nearest.iter().filter(|e| distance(e) > 0.0).count();
        let inside = nearest.iter().filter(|e| distance(e) < 0.0).count();
        let mean = nearest.iter().map(distance).sum::<f64>() / nearest.len() as f64;
        let agreed = outside == nearest.len() || inside == nearest.len();
        agreed.then(|| ((at - self.center) / self.radius, mean / self.radius))
    }

    /// Whether a normal turns from the mean one by 90° or more.
    fn turns_over(&self, mean: DVec3) -> bool {
        self.samples.iter().any(|s| s.normal.dot(mean) <= 0.0)
    }

    /// The best shape for this ball; `None` where a large part shows nothing that a smaller cell could not show better.
    pub(super) fn best(
        &self,
        tree: &SampleTree,
        half: f64,
        asked: &Tolerances,
        last: bool,
        scratch: &mut Scratch,
    ) -> Option<Fit> {
        let ids: Vec<usize> = (0..self.samples.len()).collect();
        let tolerance = asked.error / self.radius;
        let few = ids.len() <= 2 * asked.samples;
        // A cell that can be divided needs no error beyond the tolerance.
        let enough = if few || last { f64::INFINITY } else { tolerance };
        let over = self.turns_over(self.mean_normal(&ids));
        let mut best: Option<Fit> = None;
        let mut offer = |fit: Fit| {
            if fit.error < best.as_ref().map_or(f64::INFINITY, |b| b.error) {
                best = Some(fit);
            }
            best.as_ref().is_some_and(|b| b.error <= tolerance)
        };
        let mut done = false;
        if !over || few || last {
            done = offer(self.fit(Shape::smooth(self.height(&ids, true)), enough));
        }
        if !done
            && over
            && let Some(q) = self.quadric(tree, half, &mut scratch.nearest)
        {
            done = offer(self.fit(Shape::smooth(q), enough));
        }
        if !done && few && asked.sharp {
            sharp::shapes(self).into_iter().for_each(|shape| {
                offer(self.fit(shape, enough));
            });
        }
        if best.is_none() && (few || last) {
            let shape = Shape::smooth(self.height(&ids, false));
            best = Some(Fit { error: self.error(&shape, f64::INFINITY), shape });
        }
        best
    }
}
