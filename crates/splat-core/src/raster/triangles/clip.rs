//! Clipping before projection: at the eye plane, and at planes so far outside of the picture that what is left fits whole numbers.
//!
//! An edge of two triangles is cut from the same one of its ends in both, by the planes in the same order, so both have the same new
//! corners.

use super::view::Meshes;
use glam::DVec3;

/// How far from the middle of the picture corners may lie, pixels: more than any picture has.
pub(super) const GUARD: f64 = 98304.0;

/// The eye plane and four sides.
const PLANES: usize = 5;

/// Most corners of a clipped triangle.
const MOST: usize = 3 + PLANES;

/// A convex polygon.
pub(super) struct Polygon {
    corners: [DVec3; MOST],
    count: usize,
}

impl Polygon {
    pub(super) fn corners(&self) -> &[DVec3] {
        &self.corners[..self.count]
    }

    fn push(&mut self, corner: DVec3) {
        // Rounding may let an edge cross a plane twice; what is more than a convex polygon has is none of it.
        if self.count < MOST {
            self.corners[self.count] = corner;
            self.count += 1;
        }
    }
}

/// What of a triangle can be projected; nothing where it lies behind, far beside, or is no number.
pub(super) fn clip(meshes: &Meshes<'_>, triangle: [DVec3; 3]) -> Polygon {
    let mut polygon = Polygon { corners: [DVec3::ZERO; MOST], count: 0 };
    if triangle.iter().all(|p| p.is_finite()) {
        triangle.into_iter().for_each(|p| polygon.push(p));
    }
    for plane in 0..PLANES {
        if polygon.corners().iter().any(|p| inside(meshes, plane, *p) < 0.0) {
            polygon = cut(meshes, plane, &polygon);
        }
    }
    polygon
}

fn cut(meshes: &Meshes<'_>, plane: usize, polygon: &Polygon) -> Polygon {
    let mut out = Polygon { corners: [DVec3::ZERO; MOST], count: 0 };
    let corners = polygon.corners();
    for (k, &here) in corners.iter().enumerate() {
        let next = corners[(k + 1) % corners.len()];
        let [inside_here, inside_next] = [here, next].map(|p| inside(meshes, plane, p));
        if inside_here >= 0.0 {
            out.push(here);
        }
        if (inside_here >= 0.0) != (inside_next >= 0.0) {
            out.push(crossing(here, next, inside_here, inside_next));
        }
    }
    out
}

/// Where an edge meets a plane, the same from both ends.
fn crossing(a: DVec3, b: DVec3, inside_a: f64, inside_b: f64) -> DVec3 {
    let key = |p: DVec3| p.to_array().map(f64::to_bits);
    if key(a) > key(b) {
        return crossing(b, a, inside_b, inside_a);
    }
    a + (b - a) * (inside_a / (inside_a - inside_b))
}

/// How far inside of a plane a place is.
fn inside(meshes: &Meshes<'_>, plane: usize, p: DVec3) -> f64 {
    let reach = if meshes.camera.is_orthographic() { GUARD } else { GUARD * p.z };
    match plane {
        0 => p.z - meshes.near,
        1 => reach - meshes.focal * p.x,
        2 => reach + meshes.focal * p.x,
        3 => reach - meshes.focal * p.y,
        _ => reach + meshes.focal * p.y,
    }
}
