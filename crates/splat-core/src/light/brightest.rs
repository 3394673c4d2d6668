//! How bright a light can be on splats.

use super::Light;
use crate::Cloud;

/// Standard deviation of a splat over its radius, at least.
const LEAST_DEVIATION: f64 = 0.25;

impl Light {
    /// The most light that any splat of a cloud could receive without shadows, in the channel that has most, W/m²: at the place
    /// of the bounds of their centres that is nearest to the light, by the least radius. Infinite where a splat without extent
    /// could lie at the light.
    pub fn brightest_on(&self, cloud: &Cloud) -> f64 {
        let intensity = self.intensity.into_iter().map(f64::from).fold(0.0, f64::max);
        let Some(position) = self.shape.place() else { return intensity };
        let bounds = cloud.bounds();
        if bounds.is_empty() {
            return intensity;
        }
        // Relative to the cloud's origin, so that a moved scene has the same bits.
        let position = position - cloud.origin;
        let [low, high] = [bounds.min, bounds.max].map(|p| p.as_dvec3());
        let least = cloud.radius.iter().copied().fold(f32::INFINITY, f32::min);
        let spread = LEAST_DEVIATION * f64::from(least);
        let square = position.distance_squared(position.clamp(low, high)) + spread * spread;
        if square > 0.0 { intensity / square } else { f64::INFINITY }
    }
}
