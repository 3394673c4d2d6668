//! Ellipses that are as long and wide as the cells of points: the discs of points that lie closer along one way than along the other.
//!
//! The second moments of a cell about its point are those of a rectangle of the sides √(12·λ₁) and √(12·λ₂), λ the eigenvalues of its covariance: of
//! a rectangular lattice the cell itself. So its discs are those of a square lattice, stretched with it, and sum to as even a surface.
//! Both sides are then enlarged alike until the ellipse through the corners of that rectangle holds the cell's farthest corner, which bridges
//! gaps among scattered points.

use crate::points::tangent_plane::Eight;
use crate::points::voronoi_cell::{Cells, Lines};
use splat_core::glam::{DVec2, DVec3};

/// Share by which the moments along two ways have to differ, or a cell is round.
const ROUND: f64 = 1e-3;

/// The long side of the rectangle of cell `i`, in its plane, and the length of the short one; zero and `spacing` for a round cell.
pub(crate) fn ellipse(lines: &Lines, cells: &Cells, i: usize, spacing: f64) -> (DVec3, f64) {
    let (covariance, corners) = moments(lines, &cells.area, i);
    let round = (DVec3::ZERO, spacing);
    let Some((long, [first, second])) = covariance.and_then(axes) else { return round };
    let sides = [first, second].map(|moment| (12.0 * moment).sqrt());
    if !sides.iter().all(|side| *side > 0.0) {
        return round;
    }
    let farthest = |c: DVec2| (c.dot(long) / sides[0]).powi(2) + (c.dot(long.perp()) / sides[1]).powi(2);
    let reach = corners.map(farthest).fold(0.0, f64::max);
    let least = (cells.area[i] / (sides[0] * sides[1])).sqrt();
    let enlarged = (2.0 * reach).sqrt().clamp(least, 2.0 * least);
    (lines.in_space(i, long) * (enlarged * sides[0]), enlarged * sides[1])
}

/// Second moments xx, yy, xy of a cell about its point over its area, and its corners.
fn moments<'a>(lines: &'a Lines, area: &Eight, i: usize) -> (Option<[f64; 3]>, impl Iterator<Item = DVec2> + 'a) {
    let mut sums = [0.0; 3];
    for [a, b] in lines.sides(i) {
        // Of the triangle between the point and a side.
        let c = a + b;
        let share = a.perp_dot(b).abs() / 24.0;
        let both = |f: &dyn Fn(DVec2) -> f64| share * (f(a) + f(b) + f(c));
        let found = [both(&|p| p.x * p.x), both(&|p| p.y * p.y), both(&|p| p.x * p.y)];
        (0..3).for_each(|k| sums[k] += found[k]);
    }
    let covariance = (area[i] > 0.0).then(|| sums.map(|sum| sum / area[i]));
    (covariance, lines.sides(i).flatten())
}

/// Unit vector along the greater eigenvalue, and both; `None` where they are alike.
fn axes(covariance: [f64; 3]) -> Option<(DVec2, [f64; 2])> {
    let [xx, yy, xy] = covariance;
    let mean = 0.5 * (xx + yy);
    let half = 0.5 * (xx - yy);
    let apart = (half * half + xy * xy).sqrt();
    if apart <= ROUND * mean {
        return None;
    }
    let along = if half > 0.0 { DVec2::new(half + apart, xy) } else { DVec2::new(xy, apart - half) };
    Some((along.normalize(), [mean + apart, mean - apart]))
}
