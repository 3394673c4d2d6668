//! Ray against triangle in f64, watertight (Woop, Benthin, Wald 2013).
//!
//! Space is sheared so that the ray is the z axis; the signs of three edge functions decide. Neighbours compute the edge
//! that they share from the same numbers, so no ray slips between them. Deviation: a ray exactly on an edge belongs to
//! one of the two neighbours by the rule of rasterizers (an edge that points up, or left when level, owns it), so that
//! translucent surfaces are counted once; the paper lets both have it.

use glam::{DVec2, DVec3};

/// The shear that makes a direction the z axis.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Shear {
    axis: [usize; 3],
    slope: DVec2,
    per_z: f64,
}

/// Distance along the ray and barycentric weights of the second and third vertex.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Cut {
    pub(crate) t: f64,
    pub(crate) uv: [f64; 2],
}

impl Shear {
    pub(crate) fn new(direction: DVec3) -> Self {
        let size = direction.abs();
        let z = if size.x > size.y && size.x > size.z {
            0
        } else if size.y > size.z {
            1
        } else {
            2
        };
        let axis = [(z + 1) % 3, (z + 2) % 3, z];
        let per_z = 1.0 / direction[z];
        Self { axis, slope: DVec2::new(direction[axis[0]] * per_z, direction[axis[1]] * per_z), per_z }
    }

    fn flat(&self, v: DVec3) -> DVec2 {
        let z = v[self.axis[2]];
        DVec2::new(v[self.axis[0]] - self.slope.x * z, v[self.axis[1]] - self.slope.y * z)
    }

    /// Where the line through `origin` cuts the triangle, in front or behind.
    pub(crate) fn cut(&self, origin: DVec3, triangle: &[DVec3; 3]) -> Option<Cut> {
        let [a, b, c] = triangle.map(|v| v - origin);
        let [fa, fb, fc] = [a, b, c].map(|v| self.flat(v));
        let u = edge(fb, fc);
        let v = edge(fc, fa);
        let w = edge(fa, fb);
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let sum = u + v + w;
        if sum == 0.0 || !sum.is_finite() {
            return None;
        }
        let owned = |value: f64, from: DVec2, to: DVec2| {
            value != 0.0 || {
                let d = (to - from) * sum.signum();
                d.y > 0.0 || (d.y == 0.0 && d.x < 0.0)
            }
        };
        if !(owned(u, fb, fc) && owned(v, fc, fa) && owned(w, fa, fb)) {
            return None;
        }
        let z = self.axis[2];
        let t = (u * a[z] + v * b[z] + w * c[z]) * self.per_z / sum;
        Some(Cut { t, uv: [v / sum, w / sum] })
    }
}

/// Twice the signed area of (0, from, to), negated exactly when the ends are swapped.
fn edge(from: DVec2, to: DVec2) -> f64 {
    to.x * from.y - to.y * from.x
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::rng;

    fn random(i: u64, k: u64) -> f64 {
        2.0 * rng::unit(11, 0, i, k) - 1.0
    }

    #[test]
    fn a_fan_is_hit_exactly_once_through_its_edges_and_its_middle() {
        let n = 7;
        let rim = |i: usize| {
            let a = std::f64::consts::TAU * (i % n) as f64 / n as f64;
            DVec3::new(a.cos(), a.sin(), 0.3 * a.sin())
        };
        let middle = DVec3::new(0.01, -0.02, 0.1);
        let fan: Vec<[DVec3; 3]> = (0..n).map(|i| [middle, rim(i), rim(i + 1)]).collect();
        let hits = |origin: DVec3, target: DVec3| {
            let shear = Shear::new((target - origin).normalize());
            fan.iter().filter(|t| shear.cut(origin, t).is_some()).count()
        };
        for i in 0..2000 {
            let origin = DVec3::new(random(i, 0), random(i, 1), 3.0 + random(i, 2));
            let along = 0.5 * (1.0 + random(i, 3));
            assert_eq!(hits(origin, middle), 1, "ray {i} at the middle");
            assert_eq!(hits(origin, middle.lerp(rim(i as usize), along)), 1, "ray {i} at an edge");
        }
        // Exactly on the edges: parallel rays through lattice points.
        let square =
            [[DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0)], [DVec3::ZERO, DVec3::new(1.0, 1.0, 0.0), DVec3::Y]];
        let shear = Shear::new(DVec3::NEG_Z);
        for k in 1..8 {
            let origin = DVec3::new(f64::from(k) / 8.0, f64::from(k) / 8.0, 1.0);
            assert_eq!(square.iter().filter(|t| shear.cut(origin, t).is_some()).count(), 1);
        }
    }

    #[test]
    fn distance_and_weights_are_those_of_the_plane() {
        let triangle = [DVec3::new(0.0, 0.0, 1.0), DVec3::new(2.0, 0.0, 1.0), DVec3::new(0.0, 2.0, 3.0)];
        let origin = DVec3::new(0.5, 0.5, -4.0);
        let direction = DVec3::Z;
        for far in [0.0, 1e7] {
            let moved = triangle.map(|v| v + far);
            let cut = Shear::new(direction).cut(origin + far, &moved).expect("a hit");
            assert!((cut.t - 5.5).abs() < 1e-8 && (cut.uv[0] - 0.25).abs() < 1e-8, "{cut:?}");
        }
    }
}
