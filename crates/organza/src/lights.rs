//! Points of the lights of a scene, for who lights by points.

use crate::scene::SceneLight;
use splat_core::Light;

/// A light without extent, or one of the points of a light with one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LightPoint {
    /// What it gives.
    pub(crate) light: Light,
    /// The place of its whole light in [`Loaded::lights`](crate::Loaded::lights).
    pub(crate) of: usize,
    /// Which of its points it is, and how many there are.
    rank: [usize; 2],
}

impl LightPoint {
    /// How it is called.
    pub(crate) fn name(&self) -> String {
        let Self { of, rank: [k, all], .. } = self;
        if *all > 1 { format!("point {k} of light {of}") } else { format!("light {of}") }
    }
}

/// The points of all lights, sorted by their bits so that the order of the file does not matter.
pub(crate) fn points(lights: &[SceneLight]) -> Vec<LightPoint> {
    let of_light = |(of, light): (usize, &SceneLight)| {
        let points = light.light.points(light.samples);
        let all = points.len();
        points.into_iter().enumerate().map(move |(k, light)| LightPoint { light, of, rank: [k, all] })
    };
    let mut all: Vec<LightPoint> = lights.iter().enumerate().flat_map(of_light).collect();
    all.sort_by_cached_key(|point| (point.light.bits(), lights[point.of].shadow));
    all
}

/// How many points that are.
pub(crate) fn count(light: &SceneLight) -> usize {
    if light.light.shape.is_extended() { light.samples as usize } else { 1 }
}
