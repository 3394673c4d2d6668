//! Points of a light that has an extent, for who lights by points.

use super::{Light, LightShape, rect_normal};
use glam::DVec3;
use std::f64::consts::{FRAC_2_PI, TAU};

/// The golden ratio's fractional part and one of the plastic number: steps of low-discrepancy sequences.
const GOLDEN: f64 = 0.618_033_988_749_894_8;
const PLASTIC: f64 = 0.754_877_666_246_692_7;

impl Light {
    /// The light without its size: all of its intensity from a point in its middle, to the same side; any other light itself.
    #[must_use]
    pub fn without_size(&self) -> Self {
        let shape = match self.shape {
            LightShape::Sphere { center, .. } => LightShape::Point { position: center },
            LightShape::Disk { center, normal, .. } => LightShape::Patch { position: center, normal },
            LightShape::Rect { center, u, v } => LightShape::Patch { position: center, normal: rect_normal(u, v) },
            shape => shape,
        };
        Self { shape, ..*self }
    }

    /// The `n` points that stand for an extended light and share its intensity evenly; any other light itself.
    ///
    /// Points of a flat light lie evenly on it and are [`LightShape::Patch`]. Those of a sphere lie within it, so that they
    /// project to an even disc in every direction, and radiate equally in all directions. As n grows, what they give tends to
    /// what the whole light gives.
    pub fn points(&self, n: u32) -> Vec<Self> {
        let count = f64::from(n);
        let intensity = self.intensity.map(|i| (f64::from(i) / count) as f32);
        let share = |shape| Self { shape, intensity };
        match self.shape {
            LightShape::Sphere { center, radius } => {
                let place = |i| LightShape::Point { position: center + in_ball(i, count) * radius };
                (0..n).map(|i| share(place(i))).collect()
            }
            LightShape::Disk { center, normal, radius } => {
                let u = normal.any_orthonormal_vector();
                let v = normal.cross(u);
                let place = |i| {
                    let (x, y) = in_disc(i, count);
                    LightShape::Patch { position: center + (u * x + v * y) * radius, normal }
                };
                (0..n).map(|i| share(place(i))).collect()
            }
            LightShape::Rect { center, u, v } => {
                let normal = rect_normal(u, v);
                let place = |i| {
                    let (s, t) = in_square(i, count);
                    LightShape::Patch { position: center + u * s + v * t, normal }
                };
                (0..n).map(|i| share(place(i))).collect()
            }
            _ => vec![*self],
        }
    }
}

/// Point `i` of `n` in the unit disc, evenly spread (a sunflower spiral).
fn in_disc(i: u32, n: f64) -> (f64, f64) {
    let radius = ((f64::from(i) + 0.5) / n).sqrt();
    let angle = TAU * (GOLDEN * f64::from(i)).fract();
    (radius * libm::cos(angle), radius * libm::sin(angle))
}

/// Point `i` of `n` in the square \[−1, 1\]², evenly spread: one in each of n columns, golden steps apart. Mirrored at the centre
/// they are the same points, so that the centre is their mean.
fn in_square(i: u32, n: f64) -> (f64, f64) {
    let from_middle = f64::from(i) - 0.5 * (n - 1.0);
    let turn = GOLDEN * from_middle;
    (2.0 * from_middle / n, 2.0 * (turn - turn.round()))
}

/// Point `i` of `n` in the unit ball with density ∝ 1/√(1 − r²), which projects to an even disc in every direction, as
/// a sphere of even radiance is seen.
///
/// Directions are a Fibonacci spiral; r inverts the share inside, (2/π)(asin r − r√(1 − r²)), by bisection.
fn in_ball(i: u32, n: f64) -> DVec3 {
    let z = 1.0 - 2.0 * (f64::from(i) + 0.5) / n;
    let angle = TAU * (GOLDEN * f64::from(i)).fract();
    let ring = (1.0 - z * z).sqrt();
    let direction = DVec3::new(ring * libm::cos(angle), ring * libm::sin(angle), z);
    let share = (0.5 + PLASTIC * f64::from(i)).fract();
    let mut low = 0.0;
    let mut high = 1.0f64;
    for _ in 0..40 {
        let r = 0.5 * (low + high);
        let inside = FRAC_2_PI * (libm::asin(r) - r * (1.0 - r * r).sqrt());
        if inside < share { low = r } else { high = r }
    }
    direction * (0.5 * (low + high))
}
