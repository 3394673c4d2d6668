//! Area of a disc that another one covers, Eq. 8: the points x of disc i with d₁ = |(x − p_j)·n_j| < ε whose projection onto the
//! plane of disc j lies within that disc.
//!
//! In the plane of disc i, with t along the offset of the centres and s across it, disc i and the projection of disc j are conics,
//! which cut a line of constant t in a chord each; |d₁| < ε cuts it in a third. The length that all three share is integrated over
//! t by Gauss-Chebyshev nodes of the second kind, which know that chords begin and end as square roots do: one disc alone has
//! its area exactly. Shares are within 0.01 for a lens of two circles, 0.025 for tilted ellipses, and 0.1 where discs so
//! steep to one another that ε cuts a strip out of them: they serve to compare overlaps.

use super::graph::OverlapGraph;
use super::surfels::{CHUNK, Surfel};
use rayon::prelude::*;
use splat_core::glam::DVec3;
use std::f64::consts::PI;
use std::ops::Range;

/// Nodes of the quadrature.
const NODES: usize = 8;

/// cos(kπ/9) for k = 1 … 8.
const COSINES: [f32; NODES] =
    [0.939_692_6, 0.766_044_44, 0.5, 0.173_648_18, -0.173_648_18, -0.5, -0.766_044_44, -0.939_692_6];

/// π/9·sin(kπ/9) for k = 1 … 8.
const WEIGHTS: [f32; NODES] =
    [0.119_387_55, 0.224_375_2, 0.302_299_9, 0.343_762_76, 0.343_762_76, 0.302_299_9, 0.224_375_2, 0.119_387_55];

/// Coefficients of conics seen edge-on, which would be 0, in units of the disc.
const LEAST: f64 = 1e-12;

/// A share of 1, as a whole number.
pub(crate) const WHOLE: f64 = 65535.0;

/// Chords of an ellipse, A·s² + 2(b₁t + b₀)s + (c₂t² + c₁t + c₀) ≤ 0.
struct Chords {
    /// −b/A, by rising powers of t.
    middle: [f64; 2],
    /// (b² − A·c)/A², by rising powers of t.
    half_squared: [f64; 3],
}

impl Chords {
    /// Chords along `s` of the projection onto a disc's plane; `offset` is its centre, lengths are in some unit.
    fn new(disc: &Surfel, axes: &[DVec3; 3], unit: f64) -> Self {
        if disc.is_circle() { Self::circle(disc, axes, unit) } else { Self::ellipse(disc, axes, unit) }
    }

    /// The squared distance from the centre of a circle's projection is vᵀ(1 − n·nᵀ)v.
    fn circle(disc: &Surfel, [s, t, offset]: &[DVec3; 3], unit: f64) -> Self {
        let normal = disc.normal.as_dvec3();
        let [of_s, of_t, of_offset] = [normal.dot(*s), normal.dot(*t), normal.dot(*offset)];
        let radius = f64::from(disc.across) / unit;
        // In units of the radius squared; s is a unit vector across the offset.
        Self::of_form(
            1.0 - of_s * of_s,
            [of_s * of_offset, -of_s * of_t],
            [
                offset.length_squared() - of_offset * of_offset - radius * radius,
                -2.0 * (t.dot(*offset) - of_t * of_offset),
                1.0 - of_t * of_t,
            ],
        )
    }

    /// That of an ellipse is the sum of squares along its semi-axes, each in its own unit.
    fn ellipse(disc: &Surfel, directions: &[DVec3; 3], unit: f64) -> Self {
        let axes = disc.axes().map(|a| a * (unit / a.length_squared()));
        let [s, t, offset] = directions.map(|v| axes.map(|a| a.dot(v)));
        let product = |v: [f64; 2], w: [f64; 2]| v[0] * w[0] + v[1] * w[1];
        Self::of_form(
            product(s, s),
            [-product(s, offset), product(s, t)],
            [product(offset, offset) - 1.0, -2.0 * product(t, offset), product(t, t)],
        )
    }

    fn of_form(a: f64, b: [f64; 2], c: [f64; 3]) -> Self {
        let a = a.max(LEAST);
        let per = 1.0 / a;
        let square = (b[1] * b[1] - a * c[2]) * per * per;
        Self {
            middle: b.map(|b| -b * per),
            half_squared: [
                (b[0] * b[0] - a * c[0]) * per * per,
                (2.0 * b[0] * b[1] - a * c[1]) * per * per,
                square.min(-LEAST),
            ],
        }
    }

    /// Where there are chords; `None` where there are none.
    fn extent(&self) -> Option<[f64; 2]> {
        let [constant, linear, square] = self.half_squared;
        let (center, inside) = (-0.5 * linear / square, 0.25 * linear * linear - square * constant);
        let half = inside.max(0.0).sqrt() / -square;
        (inside > 0.0).then_some([center - half, center + half])
    }

    fn at(&self, t: f32) -> [f32; 2] {
        let [constant, linear, square] = self.half_squared.map(|v| v as f32);
        let middle = self.middle[0] as f32 + self.middle[1] as f32 * t;
        let half = (constant + t * (linear + t * square)).max(0.0).sqrt();
        [middle - half, middle + half]
    }
}

/// Share of `disc`'s area that `other` covers, A_ij/(π·r_i²), in \[0, 1\]; `epsilon` is a length.
pub(crate) fn covered_share(disc: &Surfel, other: &Surfel, epsilon: f64) -> f64 {
    let unit = f64::from(disc.reach);
    let offset = other.from(disc) / unit;
    let (normal, facing) = (disc.normal.as_dvec3(), other.normal.as_dvec3());
    let within = offset - normal * normal.dot(offset);
    let t = within.try_normalize().unwrap_or_else(|| normal.any_orthonormal_vector());
    let s = normal.cross(t);
    let own = Chords::new(disc, &[s, t, DVec3::ZERO], unit);
    let theirs = Chords::new(other, &[s, t, offset], unit);
    let (Some(mine), Some(yours)) = (own.extent(), theirs.extent()) else { return 0.0 };
    let (low, high) = (mine[0].max(yours[0]), mine[1].min(yours[1]));
    if low >= high {
        return 0.0;
    }
    // d₁ at (s, t): distance[0] + distance[1]·t + slope·s.
    let slope = facing.dot(s);
    let per = -1.0 / if slope.abs() < LEAST { LEAST } else { slope };
    let strip = Strip {
        center: [-facing.dot(offset) * per, facing.dot(t) * per].map(|v| v as f32),
        reach: (epsilon / unit * per).abs() as f32,
    };
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
    let area = half * common_length([middle as f32, half as f32], [&own, &theirs], &strip);
    let radius = disc.mean_radius() / unit;
    (area / (PI * radius * radius)).min(1.0)
}

/// Where |d₁| < ε along a line of constant t.
struct Strip {
    /// By rising powers of t.
    center: [f32; 2],
    reach: f32,
}

/// Quadrature over \[middle − half, middle + half\], per half, of what chords and strip share; in f32, of which vectors hold more.
fn common_length([middle, half]: [f32; 2], [own, theirs]: [&Chords; 2], strip: &Strip) -> f64 {
    let lengths = COSINES.map(|cosine| {
        let t = middle + half * cosine;
        let (mine, yours) = (own.at(t), theirs.at(t));
        let center = strip.center[0] + strip.center[1] * t;
        let from = mine[0].max(yours[0]).max(center - strip.reach);
        let to = mine[1].min(yours[1]).min(center + strip.reach);
        (to - from).max(0.0)
    });
    f64::from(lengths.iter().zip(WEIGHTS).map(|(length, weight)| length * weight).sum::<f32>())
}

/// ε of Eq. 8 for two discs: a share of the mean of their reaches.
pub(crate) fn epsilon_of(a: &Surfel, b: &Surfel, gap: f32) -> f64 {
    0.5 * f64::from(gap) * (f64::from(a.reach) + f64::from(b.reach))
}

/// For each entry of the graph's lists the share of the node's disc that its neighbour covers, over 1/65535.
pub(crate) fn covered_shares(graph: &OverlapGraph, gap: f32) -> Vec<u16> {
    fill(graph, |node, n| {
        let (a, b) = (graph.surfel(node), graph.surfel(n));
        (covered_share(a, b, epsilon_of(a, b, gap)) * WHOLE + 0.5) as u16
    })
}

/// For each entry the mean of the shares that both discs cover of one another, over 1/65535; the same from both sides.
/// No edge has less than 1: discs that overlap by Eq. 5 alone should not share a group either where others may.
pub(crate) fn mutual_shares(graph: &OverlapGraph, gap: f32) -> Vec<u16> {
    let later = fill(graph, |node, n| {
        if n < node {
            return 0;
        }
        let (a, b) = (graph.surfel(node), graph.surfel(n));
        let epsilon = epsilon_of(a, b, gap);
        ((0.5 * (covered_share(a, b, epsilon) + covered_share(b, a, epsilon)) * WHOLE + 0.5) as u16).max(1)
    });
    let rank =
        |node: usize, n: usize| graph.row(node).start + graph.neighbors(node).partition_point(|&m| (m as usize) < n);
    fill(graph, |node, n| later[if n < node { rank(n, node) } else { rank(node, n) }])
}

/// One value for each entry of the graph's lists, made of the node and its neighbour.
fn fill(graph: &OverlapGraph, value: impl Fn(usize, usize) -> u16 + Sync) -> Vec<u16> {
    let mut values = vec![0; graph.rows(0..graph.nodes()).len()];
    let mut rest = values.as_mut_slice();
    let mut parts: Vec<(Range<usize>, &mut [u16])> = Vec::new();
    for from in (0..graph.nodes()).step_by(CHUNK) {
        let nodes = from..(from + CHUNK).min(graph.nodes());
        let (part, after) = std::mem::take(&mut rest).split_at_mut(graph.rows(nodes.clone()).len());
        rest = after;
        parts.push((nodes, part));
    }
    parts.into_par_iter().for_each(|(nodes, part)| {
        let entries = nodes.flat_map(|node| graph.neighbors(node).iter().map(move |&n| (node, n as usize)));
        part.iter_mut().zip(entries).for_each(|(entry, (node, n))| *entry = value(node, n));
    });
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::glam::Vec3;
    use splat_core::rng;

    fn circle(center: Vec3, normal: Vec3, radius: f32) -> Surfel {
        Surfel { center, reach: radius, normal: normal.normalize(), across: radius, ..Surfel::default() }
    }

    /// Area that two circles of one plane share.
    fn lens(distance: f64, a: f64, b: f64) -> f64 {
        if distance <= (a - b).abs() {
            return PI * a.min(b) * a.min(b);
        }
        let half = |r: f64, other: f64| {
            let cosine = (distance * distance + r * r - other * other) / (2.0 * distance * r);
            r * r * (cosine.acos() - cosine * (1.0 - cosine * cosine).sqrt())
        };
        half(a, b) + half(b, a)
    }

    /// Eq. 8 by many points of the disc.
    fn sampled(disc: &Surfel, other: &Surfel, epsilon: f64) -> f64 {
        const POINTS: usize = 20_000;
        let [a, b] = disc.axes();
        let theirs = other.axes().map(|a| a / a.length_squared());
        let normal = other.normal.as_dvec3();
        let is_covered = |k: &usize| {
            let radius = ((*k as f64 + 0.5) / POINTS as f64).sqrt();
            let (sine, cosine) = (2.399_963_229_728_653 * *k as f64).sin_cos();
            let at = (a * cosine + b * sine) * radius - other.from(disc);
            let along = theirs.map(|a| a.dot(at));
            normal.dot(at).abs() < epsilon && along[0] * along[0] + along[1] * along[1] < 1.0
        };
        (0..POINTS).filter(is_covered).count() as f64 / POINTS as f64
    }

    #[test]
    fn circles_of_one_plane_share_a_lens() {
        for (k, b) in [(1, 1.0), (2, 0.5), (3, 2.0), (4, 0.9)] {
            let (u, _) = Vec3::new(0.3, k as f32, -1.0).normalize().any_orthonormal_pair();
            for step in 0..40 {
                let distance = 0.05 * f64::from(step) * (1.0 + b) / 2.0;
                let normal = Vec3::new(0.3, k as f32, -1.0);
                let disc = circle(Vec3::ONE, normal, 1.0);
                let other = circle(Vec3::ONE + u * distance as f32, normal, b as f32);
                let expected = lens(distance, 1.0, b) / PI;
                let found = covered_share(&disc, &other, 0.5);
                assert!((found - expected).abs() < 0.01, "{distance} {b}: {found} {expected}");
            }
        }
    }

    #[test]
    fn a_disc_covers_all_of_itself_and_nothing_where_it_only_touches() {
        let disc = circle(Vec3::ONE, Vec3::Z, 0.25);
        assert!((covered_share(&disc, &disc, 0.1) - 1.0).abs() < 1e-6);
        assert_eq!(covered_share(&disc, &circle(Vec3::ONE + Vec3::X * 0.5, Vec3::Z, 0.25), 0.1), 0.0);
        // Farther apart than ε.
        assert_eq!(covered_share(&disc, &circle(Vec3::ONE + Vec3::Z * 0.125, Vec3::Z, 0.25), 0.1), 0.0);
    }

    /// Tilted circles and ellipses: where the strip of ε cuts, a few nodes know less.
    #[test]
    fn covered_shares_are_those_of_many_points() {
        let mut worst: [f64; 2] = [0.0; 2];
        for k in 0..400u64 {
            let u = |n| rng::unit_f32(9, 0, k, n) - 0.5;
            let vector = |n| Vec3::new(u(n), u(n + 1), u(n + 2));
            let normal = vector(0).normalize();
            let tilt = if k % 2 == 0 { 0.4 } else { 4.0 };
            let mut disc = circle(vector(3), normal, 1.0);
            let mut other = circle(disc.center + 2.0 * vector(6), normal + tilt * vector(9), 1.0 + u(12));
            if k % 3 == 0 {
                for (surfel, length) in [(&mut disc, 0.6), (&mut other, 1.4)] {
                    surfel.first = surfel.normal.any_orthonormal_vector() * length;
                    surfel.reach = surfel.across.max(length);
                }
            }
            // Without and with a strip that cuts.
            for (worst, epsilon) in worst.iter_mut().zip([10.0, 0.5]) {
                let difference = covered_share(&disc, &other, epsilon) - sampled(&disc, &other, epsilon);
                *worst = worst.max(difference.abs());
            }
        }
        assert!(worst[0] < 0.025 && worst[1] < 0.1, "{worst:?}");
    }
}
