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
const COSINES: [f64; NODES] = [
    0.939_692_620_785_908_4,
    0.766_044_443_118_978,
    0.5,
    0.173_648_177_666_930_35,
    -0.173_648_177_666_930_35,
    -0.5,
    -0.766_044_443_118_978,
    -0.939_692_620_785_908_4,
];

/// π/9·sin(kπ/9) for k = 1 … 8.
const WEIGHTS: [f64; NODES] = [
    0.119_386_546_306_054_42,
    0.224_372_952_493_493_87,
    0.302_299_894_039_036_3,
    0.343_759_498_799_548_35,
    0.343_759_498_799_548_35,
    0.302_299_894_039_036_3,
    0.224_372_952_493_493_87,
    0.119_386_546_306_054_42,
];

/// Coefficients of conics seen edge-on, which would be 0, in units of the disc.
const LEAST: f64 = 1e-12;

/// A share of 1, as a whole number.
pub(crate) const WHOLE: f64 = 65535.0;

/// Chords of an ellipse, A·s² + 2(b₁t + b₀)s + (c₂t² + c₁t + c₀) ≤ 0.
struct Chords {
    /// −b/A.
    middle: [f64; 2],
    /// (b² − A·c)/A², by rising powers of t.
    half_squared: [f64; 3],
}

impl Chords {
    /// Chords along `s` of the projection onto a disc's plane; `offset` is its centre, lengths are in some unit.
    fn new(disc: &Surfel, [s, t, offset]: [DVec3; 3], unit: f64) -> Self {
        let form = form(disc, unit);
        let [of_s, of_t, of_offset] = [s, t, offset].map(form);
        let a = s.dot(of_s).max(LEAST);
        let b = [-s.dot(of_offset), s.dot(of_t)];
        let c = [offset.dot(of_offset) - 1.0, -2.0 * t.dot(of_offset), t.dot(of_t)];
        let per = 1.0 / (a * a);
        Self {
            middle: b.map(|b| -b / a),
            half_squared: [
                (b[0] * b[0] - a * c[0]) * per,
                (2.0 * b[0] * b[1] - a * c[1]) * per,
                ((b[1] * b[1] - a * c[2]) * per).min(-LEAST),
            ],
        }
    }

    /// Where there are chords; reversed where there are none.
    fn extent(&self) -> [f64; 2] {
        let [constant, linear, square] = self.half_squared;
        let (center, inside) = (-0.5 * linear / square, 0.25 * linear * linear - square * constant);
        let half = inside.max(0.0).sqrt() / -square;
        if inside > 0.0 { [center - half, center + half] } else { [1.0, -1.0] }
    }

    fn at(&self, t: f64) -> [f64; 2] {
        let [constant, linear, square] = self.half_squared;
        let middle = self.middle[0] + self.middle[1] * t;
        let half = (constant + t * (linear + t * square)).max(0.0).sqrt();
        [middle - half, middle + half]
    }
}

/// v ↦ M·v with vᵀMv the squared distance from the centre of the projection, in units of the semi-axes.
fn form(disc: &Surfel, unit: f64) -> impl Fn(DVec3) -> DVec3 {
    let normal = disc.normal.as_dvec3();
    let across = f64::from(disc.across) / unit;
    let per = 1.0 / (across * across);
    let axes = (!disc.is_circle()).then(|| disc.axes().map(|a| a * (unit / a.length_squared())));
    move |v| match axes {
        Some([a, b]) => a * a.dot(v) + b * b.dot(v),
        None => (v - normal * normal.dot(v)) * per,
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
    let own = Chords::new(disc, [s, t, DVec3::ZERO], unit);
    let theirs = Chords::new(other, [s, t, offset], unit);
    let (mine, yours) = (own.extent(), theirs.extent());
    let (low, high) = (mine[0].max(yours[0]), mine[1].min(yours[1]));
    if low >= high {
        return 0.0;
    }
    // d₁ at (s, t): distance[0] + distance[1]·t + slope·s.
    let distance = [-facing.dot(offset), facing.dot(t)];
    let slope = facing.dot(s);
    let per = 1.0 / if slope.abs() < LEAST { LEAST } else { slope };
    let reach = (epsilon / unit * per).abs();
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
    let area: f64 = COSINES
        .iter()
        .zip(WEIGHTS)
        .map(|(cosine, weight)| {
            let t = middle + half * cosine;
            let (mine, yours) = (own.at(t), theirs.at(t));
            let center = -(distance[0] + distance[1] * t) * per;
            let from = mine[0].max(yours[0]).max(center - reach);
            let to = mine[1].min(yours[1]).min(center + reach);
            weight * (to - from).max(0.0)
        })
        .sum();
    let radius = disc.mean_radius() / unit;
    (half * area / (PI * radius * radius)).min(1.0)
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
    let rank = |node: usize, n: usize| graph.row(node).start + graph.neighbors(node).partition_point(|&m| (m as usize) < n);
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
