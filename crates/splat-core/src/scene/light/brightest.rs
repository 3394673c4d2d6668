//! How bright a light can be on splats.

use super::Light;
use crate::{Cloud, DAabb};
use glam::DVec3;
use rayon::prelude::*;

/// Splats that a thread looks at, at a time.
const CHUNK: usize = 1 << 14;

/// Standard deviation of a splat over its radius, at least.
const LEAST_DEVIATION: f64 = 0.25;

/// How near any splat of a cloud can be to a light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LitBounds {
    /// Where centres lie, relative to the cloud's origin, so that a moved scene has the same bits; `None` of a cloud without splats.
    centers: Option<DAabb>,
    origin: DVec3,
    /// The least standard deviation.
    spread: f64,
}

impl LitBounds {
    /// Those of the splats of a cloud.
    pub fn new(cloud: &Cloud) -> Self {
        let bounds = cloud.bounds();
        let centers = (!bounds.is_empty()).then(|| DAabb::new(bounds.min.as_dvec3(), bounds.max.as_dvec3()));
        let least = |radii: &[f32]| radii.iter().copied().fold(f32::INFINITY, f32::min);
        let least = cloud.radius.par_chunks(CHUNK).map(least).reduce(|| f32::INFINITY, f32::min);
        Self { centers, origin: cloud.origin, spread: LEAST_DEVIATION * f64::from(least) }
    }

    /// The most light of a lamp that any of the splats could receive without shadows, in the channel that has most, W/m²: at the place of the bounds of
    /// their centres that is nearest to it, by the least radius. Infinite where a splat without extent could lie at the light.
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
