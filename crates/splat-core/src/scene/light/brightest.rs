//! How bright a light can be on splats.

use super::Light;
use crate::{Cloud, DAabb};
use glam::DVec3;
use rayon::prelude::*;

/// Radii per task.
const CHUNK: usize = 1 << 14;

/// Standard deviation of a splat over its radius, at least.
const LEAST_DEVIATION: f64 = 0.25;

/// Bounds of a cloud that limit how near a splat can be to a light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LitBounds {
    /// Bounds of the centres, relative to `origin`, so that a moved scene has the same bits; `None` for an empty cloud.
    centers: Option<DAabb>,
    /// Origin of the cloud, world units.
    origin: DVec3,
    /// The least standard deviation of a splat, world units.
    spread: f64,
}

impl LitBounds {
    /// Computes the bounds of a cloud in one parallel pass.
    pub fn new(cloud: &Cloud) -> Self {
        let bounds = cloud.bounds();
        let centers = (!bounds.is_empty()).then(|| DAabb::new(bounds.min.as_dvec3(), bounds.max.as_dvec3()));
        let least = |radii: &[f32]| radii.iter().copied().fold(f32::INFINITY, f32::min);
        let least = cloud.radius.par_chunks(CHUNK).map(least).reduce(|| f32::INFINITY, f32::min);
        Self { centers, origin: cloud.origin, spread: LEAST_DEVIATION * f64::from(least) }
    }

    /// Returns an upper bound of the irradiance that `light` gives any splat without shadows, W/m², in its brightest channel: at the point of the bounds that is
    /// nearest to the light, with the least deviation. Infinite if a splat without extent could lie at the light. An empty cloud has the light's greatest intensity.
    pub fn brightest_of(&self, light: &Light) -> f64 {
        self.centers.map_or_else(
            || light.greatest_intensity(),
            |centers| light.brightest_in(&centers, self.origin, self.spread),
        )
    }
}

impl Light {
    /// The most light that a point in `bounds`, which lie relative to `origin`, could receive without shadows as 1/(d² + `spread`²), in the channel
    /// that has most, W/m². Infinite where the light may lie at such a point and `spread` is 0.
    pub fn brightest_in(&self, bounds: &DAabb, origin: DVec3, spread: f64) -> f64 {
        let intensity = self.greatest_intensity();
        let Some(position) = self.shape.place() else { return intensity };
        let position = position - origin;
        let square = position.distance_squared(position.clamp(bounds.min, bounds.max)) + spread * spread;
        if square > 0.0 { intensity / square } else { f64::INFINITY }
    }

    /// Of the channel that has most.
    fn greatest_intensity(&self) -> f64 {
        self.intensity.into_iter().map(f64::from).fold(0.0, f64::max)
    }
}
