//! Unit vectors in 16 bits: the octahedron |x| + |y| + |z| = 1 laid out as a square (Meyer et al. 2010), of whose points the nearest of four is
//! taken (Cigolle et al. 2014).

use glam::{Vec2, Vec3};

/// Steps from the middle of the square to its side.
const STEPS: f32 = 127.0;

/// The steps whose normal is nearest to `n`.
pub(super) fn steps(n: Vec3) -> [i8; 2] {
    let n = n / (n.x.abs() + n.y.abs() + n.z.abs()).max(f32::MIN_POSITIVE);
    let flat = Vec2::new(n.x, n.y);
    let corner = if n.z < 0.0 { folded(flat) } else { flat } * STEPS;
    let low = corner.floor();
    let candidate =
        |dx: f32, dy: f32| (low + Vec2::new(dx, dy)).clamp(Vec2::splat(-STEPS), Vec2::splat(STEPS)).to_array();
    let candidates = [candidate(0.0, 0.0), candidate(1.0, 0.0), candidate(0.0, 1.0), candidate(1.0, 1.0)]
        .map(|s| s.map(|v| v as i8));
    let along = |steps: &[i8; 2]| normal(*steps).dot(n);
    candidates.into_iter().max_by(|a, b| along(a).total_cmp(&along(b))).unwrap_or_default()
}

/// Steps that no direction has.
const NONE: [i8; 2] = [i8::MIN; 2];

/// The same, or a mark of what has no direction.
pub(super) fn steps_if_any(v: Vec3) -> [i8; 2] {
    if v == Vec3::ZERO { NONE } else { steps(v) }
}

/// The unit vector at these steps, zero at the mark.
#[inline]
pub(super) fn normal_if_any(steps: [i8; 2]) -> Vec3 {
    if steps == NONE { Vec3::ZERO } else { normal(steps) }
}

/// The unit vector at these steps.
#[inline]
pub(super) fn normal(steps: [i8; 2]) -> Vec3 {
    let [x, y] = steps.map(|v| f32::from(v) / STEPS);
    let z = 1.0 - x.abs() - y.abs();
    let back = (-z).max(0.0);
    // The lower half lies outside of the diamond, mirrored at its sides.
    Vec3::new(x - back.copysign(x), y - back.copysign(y), z).normalize()
}

/// A point of the lower half, mirrored at the side of the diamond.
fn folded(p: Vec2) -> Vec2 {
    (Vec2::ONE - Vec2::new(p.y.abs(), p.x.abs())) * Vec2::new(1f32.copysign(p.x), 1f32.copysign(p.y))
}
