//! Rays in world space, f64.

use glam::DVec3;
use splat_core::{Camera, DAabb};

/// A ray; points are origin + t·direction, t in world units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Where it starts, world space.
    pub origin: DVec3,
    /// Unit direction, world space.
    pub direction: DVec3,
}

impl Ray {
    /// The ray through image position (x, y), pixels from the top left corner; the centre of pixel (0, 0) is (½, ½).
    /// It starts at the eye, or on the plane of the eye for parallel projection.
    pub fn of_pixel(camera: &Camera, x_px: f64, y_px: f64) -> Self {
        let (o, d) = camera.view_ray(x_px, y_px);
        let [right, up, forward] = camera.axes;
        Self {
            origin: camera.position + right * o.x + up * o.y + forward * o.z,
            direction: (right * d.x + up * d.y + forward * d.z).normalize(),
        }
    }

    /// The point at distance `t`.
    #[inline(always)]
    pub fn at(&self, t: f64) -> DVec3 {
        self.origin + self.direction * t
    }

    /// The part [enter, leave] of (t0, t1) inside an axis-aligned box, if any.
    pub(crate) fn clip(&self, bounds: &DAabb, t0: f64, t1: f64) -> Option<(f64, f64)> {
        let mut enter = t0;
        let mut leave = t1;
        for a in 0..3 {
            let o = self.origin[a];
            let d = self.direction[a];
            if d == 0.0 {
                if o < bounds.min[a] || o > bounds.max[a] {
                    return None;
                }
                continue;
            }
            let p = (bounds.min[a] - o) / d;
            let q = (bounds.max[a] - o) / d;
            enter = enter.max(p.min(q));
            leave = leave.min(p.max(q));
        }
        (enter < leave).then_some((enter, leave))
    }

    /// The part of (t0, t1) inside a ball, if any. Half chord from the distance of the ray to the centre, so that a
    /// distant origin costs no digits.
    pub(crate) fn clip_ball(&self, center: DVec3, radius: f64, t0: f64, t1: f64) -> Option<(f64, f64)> {
        let middle = (center - self.origin).dot(self.direction);
        let apart = (self.at(middle) - center).length();
        let half = ((radius - apart) * (radius + apart)).max(0.0).sqrt();
        let enter = t0.max(middle - half);
        let leave = t1.min(middle + half);
        (enter < leave).then_some((enter, leave))
    }
}
