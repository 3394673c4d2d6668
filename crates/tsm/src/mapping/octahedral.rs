//! The equal-area octahedral map of the sphere.
//!
//! In the octant x, y, z ≥ 0, with polar angle θ and azimuth φ, p = 2φ/π and r = √(1 − cos θ):
//!
//! X = r(1 − p), Y = r·p, dX dY = r dr dp = sin θ dθ dφ/π = dω/π
//!
//! so the square \[−1, 1\]² of area 4 covers 4π and each of the n² cells has the solid angle 4π/n². z < 0 folds over
//! the diagonals by (X, Y) → (1 − Y, 1 − X).
//!
//! Beyond the paper, whose polar rows differ in solid angle by 115:1 at 180 rows. 1 − cos θ is taken as
//! sin²θ/(1 + cos θ), so that directions near the poles keep their digits.

use super::{Crease, Mapping, Place, Ray, View};
use glam::{Vec2, Vec3};
use rayon::prelude::*;

/// Directions per task.
const CHUNK: usize = 1 << 12;

/// 2/π·atan(√s)/√s on [0, 1], a Chebyshev fit; the product with √s errs by less than 5e-8.
const ATAN: [f32; 8] = [
    std::f32::consts::FRAC_2_PI,
    -0.212_196_91,
    0.127_113_63,
    -0.089_147_71,
    0.062_827_15,
    -0.037_452_184,
    0.015_139_148,
    -0.002_902_853_7,
];

/// sin(π/2·p)/p in powers of p² on [0, 1]; errs by less than 1e-8.
const SIN: [f32; 5] = [std::f32::consts::FRAC_PI_2, -0.645_963_8, 0.079_689_92, -0.004_674_143_6, 0.000_151_671_7];

/// Least r from which a place is continued across a diagonal.
const LEAST_CONTINUED: f32 = 0.25;

/// Equal-area octahedral table of n × n cells.
#[derive(Debug, Clone, PartialEq)]
pub struct Octahedral {
    n: u32,
    inverse_measure: f32,
    /// Directions of the cell centres with column and row ≥ n/2; the others are mirror images.
    quarter: Vec<Vec3>,
}

impl Octahedral {
    /// A table of `n` × `n` cells, 1 ≤ n ≤ 32768.
    pub fn new(n: u32) -> Self {
        let n = n.clamp(1, 1 << 15);
        let half = n.div_ceil(2);
        let centre = |i: u32| f64::from(2 * (i + n / 2) + 1) / f64::from(n) - 1.0;
        let places = (0..half * half).into_par_iter().with_min_len(CHUNK);
        let quarter = places.map(|k| direction([centre(k % half), centre(k / half)])).collect();
        let inverse_measure = (f64::from(n).powi(2) / (4.0 * std::f64::consts::PI)) as f32;
        Self { n, inverse_measure, quarter }
    }

    /// Bytes of the direction table.
    pub fn bytes(n: u32) -> u64 {
        u64::from(n.div_ceil(2)).pow(2) * size_of::<Vec3>() as u64
    }
}

#[cfg(feature = "gpu")]
impl Octahedral {
    /// Directions of the cell centres with column and row ≥ n/2, row by row.
    pub(crate) fn quarter(&self) -> &[Vec3] {
        &self.quarter
    }
}

/// A place among the edges of its octant, in cells.
struct Edges {
    /// From the middle of the table, mirrored to the first quadrant.
    q: Vec2,
    /// Whether z ≥ 0.
    upper: bool,
    /// From the rim of a footprint to the edges along rows and columns, and to the diagonal; negative across them.
    to_line: Vec2,
    to_diagonal: f32,
}

impl Octahedral {
    #[inline(always)]
    fn edges(&self, at: Vec2, half: Vec2) -> Edges {
        let side = 0.5 * self.n as f32;
        let q = (at - side).abs();
        let upper = q.x + q.y <= side;
        let to_line = if upper { q } else { side - q } - half;
        let to_diagonal = (q.x + q.y - side).abs() - (half.x + half.y);
        Edges { q, upper, to_line, to_diagonal }
    }
}

/// Unit direction at (X, Y) ∈ [0, 1]².
fn direction(place: [f64; 2]) -> Vec3 {
    let [x, y] = place;
    let upper = x + y <= 1.0;
    let (x, y) = if upper { (x, y) } else { (1.0 - y, 1.0 - x) };
    let r = x + y;
    let phi = if r > 0.0 { std::f64::consts::FRAC_PI_2 * y / r } else { 0.0 };
    let sin_theta = r * (2.0 - r * r).max(0.0).sqrt();
    let z = if upper { 1.0 - r * r } else { r * r - 1.0 };
    Vec3::new((sin_theta * libm::cos(phi)) as f32, (sin_theta * libm::sin(phi)) as f32, z as f32)
}

/// Azimuth in the first quadrant as a share of a right angle.
#[inline(always)]
fn quadrant_share(x: f32, y: f32) -> f32 {
    let (low, high) = if x < y { (x, y) } else { (y, x) };
    let t = if high > 0.0 { low / high } else { 0.0 };
    let s = t * t;
    let share = t * ATAN.iter().rev().fold(0.0, |sum, c| sum * s + c);
    if x < y { 1.0 - share } else { share }
}

impl Mapping for Octahedral {
    #[inline(always)]
    fn size(&self) -> [u32; 2] {
        [self.n, self.n]
    }

    #[inline(always)]
    fn locate(&self, p: Vec3) -> Option<Place> {
        let view = self.view(p);
        view.is_seen.then_some(view.place)
    }

    #[inline(always)]
    fn gradients(&self, p: Vec3) -> [Vec3; 2] {
        self.view(p).gradients
    }

    #[inline(always)]
    fn view(&self, p: Vec3) -> View {
        let distance = p.length();
        let d = p.abs() / distance;
        let half = 0.5 * self.n as f32;
        let mirror = Vec3::ONE.copysign(p);
        let is_lower = p.z < 0.0;
        let sin_sq = d.x * d.x + d.y * d.y;
        let r = (sin_sq / (1.0 + d.z)).sqrt();
        let share = quadrant_share(d.x, d.y);
        let x = r * (1.0 - share);
        let y = r * share;
        let (x, y) = if is_lower { (1.0 - y, 1.0 - x) } else { (x, y) };
        let at = Vec2::new(half + half * x.copysign(p.x), half + half * y.copysign(p.y));
        let sin = sin_sq.sqrt();
        let (cos_phi, sin_phi) = if sin > 0.0 { (d.x / sin, d.y / sin) } else { (1.0, 0.0) };
        let root = (1.0 + d.z).sqrt();
        let along_theta = Vec3::new(d.z * cos_phi, d.z * sin_phi, -sin) * (0.5 * root);
        let along_phi = Vec3::new(-sin_phi, cos_phi, 0.0) * (std::f32::consts::FRAC_2_PI / root);
        let gx = along_theta * (1.0 - share) - along_phi;
        let gy = along_theta * share + along_phi;
        let signs = mirror * (half / distance);
        let (gx, gy) = if is_lower { (-gy, -gx) } else { (gx, gy) };
        let place = Place { at, distance };
        View { place, gradients: [gx * signs * mirror.x, gy * signs * mirror.y], is_seen: distance > 0.0 }
    }

    #[inline(always)]
    fn wrap(&self, mut column: i32, mut row: i32) -> Option<u32> {
        let n = self.n as i32;
        if !(0..n).contains(&column) {
            column = if column < 0 { -1 - column } else { 2 * n - 1 - column };
            row = n - 1 - row;
        }
        if !(0..n).contains(&row) {
            row = if row < 0 { -1 - row } else { 2 * n - 1 - row };
            column = n - 1 - column;
        }
        ((0..n).contains(&column) && (0..n).contains(&row)).then(|| row as u32 * self.n + column as u32)
    }

    #[inline(always)]
    fn ray(&self, at: Vec2) -> Ray {
        let square = at * (2.0 / self.n as f32) - 1.0;
        let q = square.abs().min(Vec2::ONE);
        let upper = q.x + q.y <= 1.0;
        let q = if upper { q } else { Vec2::new(1.0 - q.y, 1.0 - q.x) };
        let r = q.x + q.y;
        let share = if r > 0.0 { q.y / r } else { 0.0 };
        let sin = |p: f32| p * SIN.iter().rev().fold(0.0, |sum, c| sum * (p * p) + c);
        let sin_theta = r * (2.0 - r * r).max(0.0).sqrt();
        let z = if upper { 1.0 - r * r } else { r * r - 1.0 };
        let x = sin_theta * sin(1.0 - share);
        let y = sin_theta * sin(share);
        Ray { base: Vec3::ZERO, direction: Vec3::new(x.copysign(square.x), y.copysign(square.y), z) }
    }

    #[inline(always)]
    fn cell_ray(&self, cell: u32) -> Ray {
        self.ray_of(cell % self.n, cell / self.n)
    }

    #[inline(always)]
    fn ray_of(&self, column: u32, row: u32) -> Ray {
        let n = self.n;
        let mirrored = |i: u32| if 2 * i + 1 >= n { (i - n / 2, 1.0) } else { ((n - 1) / 2 - i, -1.0) };
        let (i, sign_x) = mirrored(column);
        let (j, sign_y) = mirrored(row);
        // Beyond the table any ray does.
        let d = self.quarter.get((j * n.div_ceil(2) + i) as usize).copied().unwrap_or(Vec3::Z);
        Ray { base: Vec3::ZERO, direction: Vec3::new(d.x * sign_x, d.y * sign_y, d.z) }
    }

    fn measure(&self, _cell: u32) -> f64 {
        4.0 * std::f64::consts::PI / f64::from(self.n).powi(2)
    }

    #[inline(always)]
    fn inverse_measure(&self, _column: u32, _row: u32) -> f32 {
        self.inverse_measure
    }

    #[inline(always)]
    fn is_folded(&self) -> bool {
        true
    }

    #[inline(always)]
    fn is_creased(&self, at: Vec2, half: Vec2) -> bool {
        let edges = self.edges(at, half);
        edges.to_line.min_element().min(edges.to_diagonal) < 0.0
    }

    #[inline(always)]
    fn crease(&self, at: Vec2, half: Vec2) -> Option<Crease> {
        let side = 0.5 * self.n as f32;
        let Edges { q, upper, to_line, to_diagonal } = self.edges(at, half);
        let nearest = to_line.min_element().min(to_diagonal);
        if nearest >= 0.0 {
            return None;
        }
        let (there, jacobian, line) = if to_diagonal == nearest {
            across_diagonal(q, side, upper)
        } else {
            across_line(q, side, upper, to_line.x > to_line.y)
        };
        // Back from the mirrored quadrant.
        let mirror = Vec2::ONE.copysign(at - side);
        let signs = mirror.x * mirror.y;
        let [a, b, c] = line;
        Some(Crease {
            at: there * mirror + side,
            jacobian: [
                Vec2::new(jacobian[0].x, signs * jacobian[0].y),
                Vec2::new(signs * jacobian[1].x, jacobian[1].y),
            ],
            line: [a * mirror.x, b * mirror.y, c - (a * mirror.x + b * mirror.y) * side],
        })
    }

    #[inline(always)]
    fn clearance(&self, at: Vec2, half: Vec2) -> f32 {
        // The middle, the middles of the sides and the corners of the table: all at multiples of half a side.
        let side = 0.5 * self.n as f32;
        (at - (at / side).round() * side).length() / half.max_element()
    }
}

/// Where a place lies in the continued coordinates of the octant beyond an edge, their derivatives, and the line.
type Across = (Vec2, [Vec2; 2], [f32; 3]);

/// Across a middle line or a side of the table: with e the distance to it, X = r − e on both sides, so that the octant
/// beyond, continued, has X + 2e in place of X. `rows` where the edge runs along rows.
fn across_line(q: Vec2, side: f32, upper: bool, rows: bool) -> Across {
    let shear = |along: f32, across: f32| if upper { along + 2.0 * across } else { along + 2.0 * (across - side) };
    let (sign, c) = if upper { (1.0, 0.0) } else { (-1.0, side) };
    if rows {
        (Vec2::new(shear(q.x, q.y), q.y), [Vec2::new(1.0, 2.0), Vec2::Y], [0.0, sign, c])
    } else {
        (Vec2::new(q.x, shear(q.y, q.x)), [Vec2::X, Vec2::new(2.0, 1.0)], [sign, 0.0, c])
    }
}

/// Across a diagonal: with r = √(1 − |cos θ|) and D = X − Y in units of the half side, D/r is the same function of azimuth
/// on both sides, and r of the one side, continued, is √(1 + cos θ) = √(2 − r²) on the other.
fn across_diagonal(q: Vec2, side: f32, upper: bool) -> Across {
    let sum = (q.x + q.y) / side;
    let difference = (q.x - q.y) / side;
    let (sign, r) = if upper { (1.0, sum) } else { (-1.0, 2.0 - sum) };
    // Far from the diagonal, where only footprints of the size of the table reach across it, any slope does.
    let r = r.max(LEAST_CONTINUED);
    let other = (2.0 - r * r).max(0.0).sqrt();
    let along = r / other;
    let across = other / r;
    let there = Vec2::splat(if upper { 2.0 - other } else { other }) + Vec2::new(1.0, -1.0) * (difference * across);
    // With dS′ = along·dS and dD′ = across·dD + lean·dS of the sum S = X + Y: the area stays.
    let lean = -sign * 2.0 * difference / (other * r * r);
    let [x, y] = [along + lean, along - lean];
    let jacobian = [Vec2::new(x + across, x - across) * 0.5, Vec2::new(y - across, y + across) * 0.5];
    (there * (0.5 * side), jacobian, [-sign, -sign, sign * side])
}
