//! Points of the lights of a scene, for who lights by points.

use crate::SceneLight;
use splat_core::Light;

/// A light without extent, or one of the points of a light with one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightPoint {
    /// What it gives.
    pub light: Light,
    /// The light that it is of.
    pub whole: Light,
    /// The place of its whole light in the list that it is from.
    pub of: usize,
    /// Which of its points it is, and how many there are.
    pub rank: [usize; 2],
}

impl LightPoint {
    /// How it is called.
    pub fn name(&self) -> String {
        let Self { of, rank: [k, all], .. } = self;
        if *all > 1 { format!("point {k} of light {of}") } else { format!("light {of}") }
    }
}

/// The points of all lights, sorted by their bits so that the order of the file does not matter.
pub fn light_points(lights: &[SceneLight]) -> Vec<LightPoint> {
    let of_light = |(of, light): (usize, &SceneLight)| {
        let points = light.light.points(light.samples);
        let (all, whole) = (points.len(), light.light);
        points.into_iter().enumerate().map(move |(k, light)| LightPoint { light, whole, of, rank: [k, all] })
    };
    let mut all: Vec<LightPoint> = lights.iter().enumerate().flat_map(of_light).collect();
    all.sort_by_cached_key(|point| (point.light.bits(), lights[point.of].shadow));
    all
}

impl SceneLight {
    /// How many points it is taken for.
    pub fn count(&self) -> usize {
        if self.light.shape.is_extended() { self.samples as usize } else { 1 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::LightShape;
    use splat_core::glam::DVec3;

    #[test]
    fn points_do_not_depend_on_the_order_of_lights_and_know_theirs() {
        let light = |shape, samples, shadow| SceneLight {
            light: Light { shape, intensity: [6.0; 3] },
            slide: None,
            samples,
            shadow,
        };
        let disk = LightShape::Disk { center: DVec3::Y, normal: DVec3::NEG_Y, radius: 0.5 };
        let lamp = LightShape::Point { position: DVec3::Y };
        let lights = [light(disk, 3, true), light(lamp, 1, true), light(lamp, 1, false)];
        let found = light_points(&lights);
        assert_eq!(found.len(), lights.iter().map(SceneLight::count).sum::<usize>());
        let names: Vec<String> = found.iter().map(LightPoint::name).collect();
        assert_eq!(names[..2], ["light 2", "light 1"]);
        assert!(names[2..].iter().all(|name| name.ends_with(" of light 0")), "{names:?}");
        let others = light_points(&[2, 0, 1].map(|k: usize| lights[k].clone()));
        let same = |a: &LightPoint, b: &LightPoint| a.light == b.light;
        assert!(found.iter().zip(&others).all(|(a, b)| same(a, b)));
    }
}
