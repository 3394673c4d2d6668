//! The width of a pixel's ray, and its growth: the sky is averaged over it.

use crate::interface::Crossing;
use splat_core::glam::Vec3;

/// RMS distance from a place of the discs that are blended there, over their radius.
const BLENDED_RADIUS: f32 = 0.45;

/// A ray's width at its start, and the angle by which it widens, radians.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Cone {
    pub(crate) width: f32,
    pub(crate) spread: f32,
}

impl Cone {
    /// After some distance.
    pub(crate) fn after(self, distance: f32) -> Self {
        Self { width: self.width + self.spread.abs() * distance, ..self }
    }

    /// After a surface of some curvature turned its axis by a normal that turns across its width: once for what passes, as far as
    /// indices differ, twice for what is mirrored.
    pub(crate) fn turned(self, curvature: f32, factor: f32) -> Self {
        Self { spread: self.spread + factor * curvature * self.width, ..self }
    }

    /// The solid angle that it sees.
    pub(crate) fn solid_angle(self) -> f32 {
        (self.spread * self.spread).min(2.0 * std::f32::consts::PI)
    }
}

/// Both ways on from a surface.
pub(crate) fn onward(cone: Cone, curvature: f32, ratio: f32, crossing: &Crossing) -> [Cone; 2] {
    let passes = if crossing.reflectance < 1.0 { (1.0 - ratio).abs() } else { 2.0 };
    [cone.turned(curvature, passes), cone.turned(curvature, 2.0)]
}

/// Curvature of a layer, one over a length: by how far the normals of its discs, of some radius, spread around their mean. `sum` is the
/// sum of unit normals by weight.
pub(crate) fn curvature(sum: Vec3, weights: f32, radius: f32) -> f32 {
    let spread = 2.0 * (1.0 - sum.length() / weights).max(0.0);
    spread.sqrt() / (BLENDED_RADIUS * radius)
}
