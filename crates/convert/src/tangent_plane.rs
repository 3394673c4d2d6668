//! The tangent plane of a point and its share of it, from its neighbours.
//!
//! The normal is the eigenvector of the smallest eigenvalue of the neighbours' covariance (Hoppe et al. 1992), in closed
//! form. The area is that of the point's Voronoi cell in the plane: cells tile, so areas sum to that of the surface.

use splat_core::glam::{DMat3, DVec2, DVec3};

/// Most corners of a cell: four of the first square and one for each neighbour.
const MAX_CORNERS: usize = 4 + super::neighbours::MAX_NEIGHBOURS;

/// Half the side of the square that holds a cell, over the distance of the farthest neighbour. What lies within 0.5 is
/// known exactly; beyond, neighbours that were not asked for would cut too. Measured so that areas of scattered points
/// are right in the mean with ten neighbours.
const CELL_LIMIT: f64 = 0.56;

/// Unit vector across the plane that fits the points best, or `None` when they lie on a line or at one place.
#[inline(always)]
pub(crate) fn fit_normal(offsets: &[DVec3]) -> Option<DVec3> {
    let mean = offsets.iter().sum::<DVec3>() / offsets.len() as f64;
    let (mut diagonal, mut mixed) = (DVec3::ZERO, DVec3::ZERO);
    for o in offsets {
        let d = *o - mean;
        diagonal += d * d;
        mixed += DVec3::new(d.y * d.z, d.z * d.x, d.x * d.y);
    }
    let largest = diagonal.max_element();
    // Negative only for no extent at all; NaN does not occur, offsets are finite.
    if largest <= 0.0 {
        return None;
    }
    smallest_eigenvector(diagonal / largest, mixed / largest)
}

/// Of the symmetric matrix with this diagonal and these entries yz, zx, xy, the largest entry being about 1.
#[inline(always)]
fn smallest_eigenvector(d: DVec3, m: DVec3) -> Option<DVec3> {
    let third = (d.x + d.y + d.z) / 3.0;
    let e = d - DVec3::splat(third);
    let p = ((e.length_squared() + 2.0 * m.length_squared()) / 6.0).sqrt();
    if p <= 1e-12 {
        return None;
    }
    let columns =
        |e: DVec3| DMat3::from_cols(DVec3::new(e.x, m.z, m.y), DVec3::new(m.z, e.y, m.x), DVec3::new(m.y, m.x, e.z));
    let half_determinant = (columns(e).determinant() / (2.0 * p * p * p)).clamp(-1.0, 1.0);
    let angle = libm::acos(half_determinant) / 3.0;
    let smallest = third + 2.0 * p * libm::cos(angle + std::f64::consts::TAU / 3.0);
    // The rows of A − λ lie in the plane across the eigenvector; the longest cross product is the safest.
    let a = columns(d - DVec3::splat(smallest));
    let crosses = [a.x_axis.cross(a.y_axis), a.y_axis.cross(a.z_axis), a.z_axis.cross(a.x_axis)];
    let longest = crosses.iter().fold(DVec3::ZERO, |l, c| if c.length_squared() > l.length_squared() { *c } else { l });
    // Two small eigenvalues: a line, every vector across it would do.
    if longest.length() > 1e-6 { longest.try_normalize() } else { None }
}

/// Area of a cell and the distance of its farthest corner.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Cell {
    pub(crate) area: f64,
    pub(crate) reach: f64,
}

/// A convex polygon in the tangent plane, relative to its point.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Polygon {
    corners: [DVec2; MAX_CORNERS],
    n: usize,
}

impl Default for Polygon {
    fn default() -> Self {
        Self { corners: [DVec2::ZERO; MAX_CORNERS], n: 0 }
    }
}

/// Voronoi cell of a point among neighbours at `offsets` (near to far), in the plane across `normal`, within a square
/// of 0.56 times the farthest neighbour: at the rim of the points nothing else would end it.
#[inline(always)]
pub(crate) fn voronoi_cell(offsets: &[DVec3], normal: DVec3, scratch: &mut [Polygon; 2]) -> Cell {
    let (u, v) = normal.any_orthonormal_pair();
    let half = CELL_LIMIT * offsets.last().map_or(0.0, |o| o.length());
    let [mut cell, mut next] = scratch.each_mut();
    let square = [(-half, -half), (half, -half), (half, half), (-half, half)];
    for i in 0..4 {
        cell.corners[i] = square[i].into();
    }
    cell.n = 4;
    let mut reach_sq = 2.0 * half * half;
    for o in offsets {
        let q = DVec2::new(o.dot(u), o.dot(v));
        let limit = 0.5 * q.length_squared();
        // A bisector at half the distance cannot cut corners that are nearer.
        if limit <= 0.0 || 0.5 * limit >= reach_sq {
            continue;
        }
        if clip(cell, next, q, limit) {
            (cell, next) = (next, cell);
            reach_sq = 0.0;
            for c in &cell.corners[..cell.n] {
                reach_sq = c.length_squared().max(reach_sq);
            }
        }
    }
    let corners = &cell.corners[..cell.n];
    let mut twice = 0.0;
    let mut before = corners[cell.n - 1];
    for c in corners {
        twice += before.perp_dot(*c);
        before = *c;
    }
    Cell { area: 0.5 * twice, reach: reach_sq.sqrt() }
}

/// Leaves the part of a convex polygon with c·q ≤ limit in `kept`; the origin is inside, so something is left. False
/// where nothing was to be cut.
#[inline(always)]
fn clip(polygon: &Polygon, kept: &mut Polygon, q: DVec2, limit: f64) -> bool {
    let (corners, n) = (&polygon.corners, polygon.n);
    let mut outside = 0u64;
    for (i, c) in corners[..n].iter().enumerate() {
        outside |= u64::from(c.dot(q) > limit) << i;
    }
    let all = (1u64 << n) - 1;
    if outside == 0 || outside == all {
        return false;
    }
    // The corners outside follow each other: `first` comes after the last one inside, `end` is the first inside again.
    let after = (outside << 1 | outside >> (n - 1)) & all;
    let first = (outside & !after).trailing_zeros() as usize;
    let end = (!outside & after).trailing_zeros() as usize;
    let previous = |i: usize| if i == 0 { n - 1 } else { i - 1 };
    let cross = |inside: DVec2, beyond: DVec2| {
        let (d, e) = (inside.dot(q) - limit, beyond.dot(q) - limit);
        inside + (beyond - inside) * (d / (d - e))
    };
    kept.corners[0] = cross(corners[previous(first)], corners[first]);
    kept.corners[1] = cross(corners[end], corners[previous(end)]);
    kept.n = 2;
    let mut i = end;
    while i != first {
        kept.corners[kept.n] = corners[i];
        kept.n += 1;
        i = if i + 1 == n { 0 } else { i + 1 };
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lattice_point_owns_one_square() {
        let mut offsets: Vec<DVec3> = (-2..=2)
            .flat_map(|i| (-2..=2).map(move |j| DVec3::new(f64::from(i), 0.0, f64::from(j))))
            .filter(|o| *o != DVec3::ZERO)
            .collect();
        offsets.sort_by(|a, b| a.length().total_cmp(&b.length()));
        let normal = fit_normal(&offsets).map_or(DVec3::ZERO, DVec3::abs);
        assert!((normal - DVec3::Y).length() < 1e-12);
        let cell = voronoi_cell(&offsets[..10], normal, &mut [Polygon::default(); 2]);
        assert!((cell.area - 1.0).abs() < 1e-12 && (cell.reach - 0.5f64.sqrt()).abs() < 1e-12, "{cell:?}");
    }

    #[test]
    fn a_tilted_noisy_plane_gives_its_normal() {
        let normal = DVec3::new(0.3, 0.9, -0.2).normalize();
        let (u, v) = normal.any_orthonormal_pair();
        let ring = |i: i32| (f64::from(i) * 0.61).sin_cos();
        let offsets: Vec<DVec3> = (0..12).map(|i| (u * ring(i).0 + v * ring(i).1) * f64::from(i % 3 + 1)).collect();
        let found = fit_normal(&offsets).unwrap_or_default();
        assert!(found.dot(normal).abs() > 1.0 - 1e-12, "{found}");
    }

    #[test]
    fn points_on_a_line_have_no_plane() {
        let offsets: Vec<DVec3> = (0..5).map(|i| DVec3::new(f64::from(i), 2.0 * f64::from(i), 0.0)).collect();
        assert_eq!(fit_normal(&offsets), None);
        assert_eq!(fit_normal(&[DVec3::ZERO; 4]), None);
    }
}
