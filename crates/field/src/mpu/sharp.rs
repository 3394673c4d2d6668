//! Edges and corners (Ohtake et al. 2003, section 4.3): samples fall into two or three sets by their normals, each set
//! gets a height field, and maximum and minimum join them.
//!
//! An edge lies where two normals differ by more than [`CREASE`]; it is a corner where a third is far from the plane of
//! those two. Deviation: convex, concave and mixed joints are all tried and the samples choose, and corners have three
//! sides at most.

use super::fit::Ball;
use super::quadric::{Joint, Quadric, Shape};
use splat_core::glam::DVec3;

/// Cosine of the angle between normals above which a surface counts as smooth.
const CREASE: f64 = 0.9;
/// Cosine of the angle to the edge's direction above which a normal belongs to a third side.
const CORNER: f64 = 0.7;

/// Shapes that may suit the samples of a ball; none where they are smooth.
pub(super) fn shapes(ball: &Ball) -> Vec<Shape> {
    let seeds = seeds(ball);
    if seeds.is_empty() {
        return Vec::new();
    }
    let mut sets = vec![Vec::new(); seeds.len()];
    for (i, s) in ball.samples.iter().enumerate() {
        let nearer = |best: usize, k: usize| if seeds[k].dot(s.normal) > seeds[best].dot(s.normal) { k } else { best };
        sets[(0..seeds.len()).fold(0, nearer)].push(i);
    }
    if sets.iter().any(Vec::is_empty) {
        return Vec::new();
    }
    let pieces: Vec<Quadric> = sets.iter().map(|set| ball.height(set, true)).collect();
    let mut shapes = vec![Joint::Max, Joint::Min].into_iter().map(|j| joined(&pieces, j, 0)).collect::<Vec<_>>();
    if pieces.len() == 3 {
        for joint in [Joint::MaxMin, Joint::MinMax] {
            shapes.extend((0..3).map(|first| joined(&pieces, joint, first)));
        }
    }
    shapes
}

fn joined(pieces: &[Quadric], joint: Joint, first: usize) -> Shape {
    let mut pieces = pieces.to_vec();
    pieces.rotate_left(first);
    Shape { pieces, joint }
}

/// The normals that the sides begin with: none, two or three.
fn seeds(ball: &Ball) -> Vec<DVec3> {
    let normals: Vec<DVec3> = ball.samples.iter().map(|s| s.normal).collect();
    let mut widest = (CREASE, 0, 0);
    for (i, a) in normals.iter().enumerate() {
        for (j, b) in normals[..i].iter().enumerate() {
            if a.dot(*b) < widest.0 {
                widest = (a.dot(*b), i, j);
            }
        }
    }
    if widest.1 == widest.2 {
        return Vec::new();
    }
    let a = normals[widest.1];
    let b = normals[widest.2];
    let edge = a.cross(b).normalize_or_zero();
    let along =
        normals.iter().fold(DVec3::ZERO, |best, n| if n.dot(edge).abs() > best.dot(edge).abs() { *n } else { best });
    if along.dot(edge).abs() > CORNER { vec![a, b, along] } else { vec![a, b] }
}
