//! Area of a disc that another one covers, Eq. 8: the points x of disc i with d₁ = |(x − p_j)·n_j| < ε whose projection onto the
//! plane of disc j lies within that disc.
//!
//! In units of its semi-axes disc i is a unit circle. There the projection of disc j cuts a line of constant t, which runs along the offset of
//! the centres, in a chord along s, the circle in another, and |d₁| < ε in a third. The length that all three share is integrated over
//! t by Gauss-Chebyshev nodes of the second kind, which suit chords that begin and end like square roots: a single disc has
//! its exact area. Shares are within 0.01 for a lens of two circles, 0.025 for tilted ellipses, and 0.1 where discs are so
//! steep to one another that ε cuts a strip out of them. This suffices to compare overlaps.
//!
//! Places are subtracted in f64. The code works in units of the disc, sixteen pairs of discs at a time.

use super::graph::{OverlapGraph, chunks, cut};
use super::surfels::{CHUNK, Surfel};
use rayon::prelude::*;
use splat_core::glam::Vec3;
use splat_core::raster::lanes::{Broadcast, Lanes, MAX_LANES};
use splat_core::raster::pulp::{self, Simd};
use std::f32::consts::PI;

/// Nodes of the quadrature, cos(kπ/9) for k = 1 … 8, with π/9·sin(kπ/9).
const NODES: [[f32; 2]; 8] = [
    [0.939_692_6, 0.119_387_55],
    [0.766_044_44, 0.224_375_2],
    [0.5, 0.302_299_9],
    [0.173_648_18, 0.343_762_76],
    [-0.173_648_18, 0.343_762_76],
    [-0.5, 0.302_299_9],
    [-0.766_044_44, 0.224_375_2],
    [-0.939_692_6, 0.119_387_55],
];

/// Slopes of conics seen edge-on and of lines along s, which would be 0.
const LEAST: f32 = 1e-6;

/// Radii over one another beyond which the smaller disc is a point.
const MOST_RATIO: f64 = 1e9;

/// A share of 1, as a whole number.
pub(crate) const WHOLE: f64 = 65535.0;

/// ε of Eq. 8 for two discs: a share of the mean of their reaches.
pub(crate) fn epsilon_of(a: &Surfel, b: &Surfel, gap: f32) -> f64 {
    0.5 * f64::from(gap) * (f64::from(a.reach) + f64::from(b.reach))
}

/// For each entry of the graph's lists the share of the node's disc that its neighbour covers, over 1/65535.
pub(crate) fn covered_shares(graph: &OverlapGraph, gap: f32) -> Vec<u16> {
    fill(graph, gap, |share, _| (share * WHOLE as f32 + 0.5) as u16)
}

/// For each entry the mean of the shares that both discs cover of one another, over 1/65535; the same from both sides.
/// No edge has less than 1: discs that overlap by Eq. 5 alone should not share a group either where others may.
pub(crate) fn mutual_shares(graph: &OverlapGraph, gap: f32) -> Vec<u16> {
    fill(graph, gap, |share, converse| ((0.5 * (share + converse) * WHOLE as f32 + 0.5) as u16).max(1))
}

/// One value for each entry of the graph's lists, made of the shares that the node's disc and its neighbour have covered.
fn fill(graph: &OverlapGraph, gap: f32, value: impl Fn(f32, f32) -> u16 + Sync) -> Vec<u16> {
    let planes: Vec<Plane> =
        (0..graph.nodes()).into_par_iter().with_min_len(CHUNK).map(|node| Plane::new(graph.surfel(node))).collect();
    let mut values = vec![0; graph.rows(0..graph.nodes()).len()];
    let chunks = chunks(graph.nodes());
    let parts = cut(&mut values, chunks.iter().map(|nodes| graph.rows(nodes.clone()).len()));
    chunks.into_par_iter().zip(parts).for_each(|(nodes, part)| {
        let mut entries = nodes.flat_map(|node| graph.neighbors(node).iter().map(move |&n| [node, n as usize]));
        let mut pairs = Pairs::default();
        for part in part.chunks_mut(MAX_LANES) {
            for (k, pair) in (0..part.len()).zip(&mut entries) {
                pairs.set(k, pair.map(|n| graph.surfel(n)), pair.map(|n| &planes[n]));
            }
            let [forward, converse] = pulp::Arch::new().dispatch(Covered { pairs: &pairs, gap });
            let shares = forward.into_iter().zip(converse);
            part.iter_mut().zip(shares).for_each(|(to, (share, converse))| *to = value(share, converse));
        }
    });
    values
}

/// Semi-axes of a disc in units of its reach.
struct Plane([Vec3; 2]);

impl Plane {
    fn new(disc: &Surfel) -> Self {
        let unit = 1.0 / f64::from(disc.reach);
        Self(disc.axes().map(|axis| (axis * unit).as_vec3()))
    }
}

/// Numbers of sixteen pairs.
type Line = [f32; MAX_LANES];

/// One disc of each pair.
#[derive(Default)]
struct Side {
    /// In units of its reach.
    axes: [[Line; 3]; 2],
    normal: [Line; 3],
    /// From its centre to that of the other, in the same unit.
    offset: [Line; 3],
    /// Reach of the other.
    ratio: Line,
}

/// Sixteen pairs of discs.
#[derive(Default)]
struct Pairs([Side; 2]);

impl Pairs {
    /// Pair `k`; either disc sees the other as it would be seen if it came second.
    fn set(&mut self, k: usize, discs: [&Surfel; 2], planes: [&Plane; 2]) {
        for (i, side) in self.0.iter_mut().enumerate() {
            let disc = discs[i];
            let other = discs[1 - i];
            let Plane([first, second]) = planes[i];
            let unit = 1.0 / f64::from(disc.reach);
            let [a, b] = &mut side.axes;
            put(a, k, *first);
            put(b, k, *second);
            put(&mut side.normal, k, disc.normal);
            put(&mut side.offset, k, (other.from(disc) * unit).as_vec3());
            side.ratio[k] = (f64::from(other.reach) * unit).clamp(1.0 / MOST_RATIO, MOST_RATIO) as f32;
        }
    }
}

fn put(lines: &mut [Line; 3], k: usize, v: Vec3) {
    lines.iter_mut().zip(v.to_array()).for_each(|(line, v)| line[k] = v);
}

/// For sixteen pairs the share that each disc has covered by the other, A_ij/(π·r_i²), in \[0, 1\].
struct Covered<'a> {
    pairs: &'a Pairs,
    gap: f32,
}

impl pulp::WithSimd for Covered<'_> {
    type Output = [Line; 2];

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> [Line; 2] {
        let Pairs([a, b]) = self.pairs;
        let mut shares = [[0.0; MAX_LANES]; 2];
        for lane in (0..MAX_LANES).step_by(Lanes::<S>::COUNT) {
            covered(simd, lane, a, b, self.gap).store(&mut shares[0][lane..]);
            covered(simd, lane, b, a, self.gap).store(&mut shares[1][lane..]);
        }
        shares
    }
}

/// Three numbers a lane.
type Vector<S> = [Lanes<S>; 3];

#[inline(always)]
fn load<S: Simd>(simd: S, lane: usize, lines: &[Line; 3]) -> Vector<S> {
    [Lanes::load(simd, &lines[0][lane..]), Lanes::load(simd, &lines[1][lane..]), Lanes::load(simd, &lines[2][lane..])]
}

#[inline(always)]
fn dot<S: Simd>(a: Vector<S>, b: Vector<S>) -> Lanes<S> {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]))
}

/// Directions of s and t in a disc's plane, by its semi-axes a and b.
struct Frame<S: Simd> {
    a: Vector<S>,
    b: Vector<S>,
    /// t along both.
    t: [Lanes<S>; 2],
    /// To the other disc's centre.
    offset: Vector<S>,
}

/// A number that is linear in (s, t): by s, which is never 0, by t, and at the other disc's centre.
struct Linear<S: Simd> {
    s: Lanes<S>,
    t: Lanes<S>,
    center: Lanes<S>,
}

impl<S: Simd> Frame<S> {
    /// The place along a vector, times `per`.
    #[inline(always)]
    fn along(&self, simd: S, v: Vector<S>, per: Lanes<S>) -> Linear<S> {
        let [x, y] = self.t;
        let least = simd.lanes(LEAST);
        let p = dot(v, self.a) * per;
        let q = dot(v, self.b) * per;
        let s = q * x - p * y;
        Linear { s: least.where_less_or(s.abs(), least, s), t: p.mul_add(x, q * y), center: dot(v, self.offset) * per }
    }

    /// The place along a semi-axis of the other disc, in units of it and of the reaches' ratio.
    #[inline(always)]
    fn along_axis(&self, simd: S, axis: Vector<S>) -> Linear<S> {
        self.along(simd, axis, simd.lanes(1.0) / dot(axis, axis))
    }
}

/// The share of `disc` that `other` covers.
#[inline(always)]
fn covered<S: Simd>(simd: S, lane: usize, disc: &Side, other: &Side, gap: f32) -> Lanes<S> {
    let zero = simd.lanes(0.0);
    let one = simd.lanes(1.0);
    let least = simd.lanes(LEAST);
    let a = load(simd, lane, &disc.axes[0]);
    let b = load(simd, lane, &disc.axes[1]);
    let offset = load(simd, lane, &disc.offset);
    let ratio = Lanes::load(simd, &disc.ratio[lane..]);
    // t along the offset, in units of the semi-axes.
    let x = dot(a, offset) / dot(a, a);
    let y = dot(b, offset) / dot(b, b);
    let length = x.mul_add(x, y * y).sqrt();
    let per = one / length.max(least);
    let t = [one.where_less_or(length, least, x * per), zero.where_less_or(length, least, y * per)];
    let frame = Frame { a, b, t, offset };
    // What is covered has u² + v² < ratio².
    let u = frame.along_axis(simd, load(simd, lane, &other.axes[0]));
    let v = frame.along_axis(simd, load(simd, lane, &other.axes[1]));
    let square = u.s.mul_add(u.s, v.s * v.s);
    let per_square = one / square;
    let root = square.sqrt() * ratio;
    // How far the line of a t passes by the other's centre, times √square.
    let by = u.s * v.t - v.s * u.t;
    let at = u.s * v.center - v.s * u.center;
    let by = least.where_less_or(by.abs(), least, by);
    let center = at / by;
    let half = root / by.abs();
    let low = (center - half).max(zero - one);
    let high = (center + half).min(one);
    let middle = simd.lanes(0.5) * (low + high);
    let half = (simd.lanes(0.5) * (high - low)).max(zero);
    let slope = u.s.mul_add(u.t, v.s * v.t) * per_square;
    let start = u.s.mul_add(u.center, v.s * v.center) * per_square;
    // d₁ is nowhere constant along s.
    let distance = frame.along(simd, load(simd, lane, &other.normal), one);
    let per = one / distance.s;
    let strip_slope = distance.t * per;
    let strip_start = distance.center * per;
    let reach = simd.lanes(0.5 * gap) * (one + ratio) * per.abs();
    let root_square = root * root;
    let mut sum = zero;
    for [node, weight] in NODES {
        let t = half.mul_add(simd.lanes(node), middle);
        let mine = (one - t * t).max(zero).sqrt();
        let passes = by.mul_add(t, zero - at);
        let yours = (root_square - passes * passes).max(zero).sqrt() * per_square;
        let center = start - slope * t;
        let strip = strip_start - strip_slope * t;
        let from = (zero - mine).max(center - yours).max(strip - reach);
        let to = mine.min(center + yours).min(strip + reach);
        sum = (to - from).max(zero).mul_add(simd.lanes(weight), sum);
    }
    (half * sum * simd.lanes(1.0 / PI)).min(one)
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::rng;
    use std::f64::consts::PI;

    fn circle(center: Vec3, normal: Vec3, radius: f32) -> Surfel {
        Surfel { center, reach: radius, normal: normal.normalize(), across: radius, ..Surfel::default() }
    }

    fn covered_share(disc: &Surfel, other: &Surfel, epsilon: f64) -> f64 {
        let mut pairs = Pairs::default();
        pairs.set(0, [disc, other], [&Plane::new(disc), &Plane::new(other)]);
        let gap = (epsilon / epsilon_of(disc, other, 1.0)) as f32;
        f64::from(pulp::Arch::new().dispatch(Covered { pairs: &pairs, gap })[0][0])
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
