//! Area of a disc that another one covers, Eq. 8: the points x of disc i with d₁ = |(x − p_j)·n_j| < ε whose projection onto the
//! plane of disc j lies within that disc.
//!
//! In the plane of disc i, with t along the offset of the centres and s across it, disc i and the projection of disc j are conics,
//! which cut a line of constant t in a chord each; |d₁| < ε cuts it in a third. The length that all three share is integrated over
//! t by Gauss-Chebyshev nodes of the second kind, which know that chords begin and end as square roots do: one disc alone has
//! its area exactly, a lens of two circles within 1 % of the disc's.

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
pub(crate) fn mutual_shares(graph: &OverlapGraph, gap: f32) -> Vec<u16> {
    let later = fill(graph, |node, n| {
        if n < node {
            return 0;
        }
        let (a, b) = (graph.surfel(node), graph.surfel(n));
        let epsilon = epsilon_of(a, b, gap);
        (0.5 * (covered_share(a, b, epsilon) + covered_share(b, a, epsilon)) * WHOLE + 0.5) as u16
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
