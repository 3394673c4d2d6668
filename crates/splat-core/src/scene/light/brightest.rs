//! How bright a light can be on splats.

use super::Light;
use crate::{Cloud, DAabb};
use glam::DVec3;

/// Standard deviation of a splat over its radius, at least.
const LEAST_DEVIATION: f64 = 0.25;

impl Light {
    /// The most light that any splat of a cloud could receive without shadows, in the channel that has most, W/m²: at the place
    /// of the bounds of their centres that is nearest to the light, by the least radius. Infinite where a splat without extent
    /// could lie at the light.
    pub fn brightest_on(&self, cloud: &Cloud) -> f64 {
        let bounds = cloud.bounds();
        if bounds.is_empty() {
            return self.greatest_intensity();
        }
        let bounds = DAabb::new(bounds.min.as_dvec3(), bounds.max.as_dvec3());
        let least = cloud.radius.iter().copied().fold(f32::INFINITY, f32::min);
        // Relative to the cloud's origin, so that a moved scene has the same bits.
        self.brightest_in(&bounds, cloud.origin, LEAST_DEVIATION * f64::from(least))
    }

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
