//! Points of the lights of a scene, for who lights by points.

use crate::SceneLight;
use splat_core::Light;

/// A light without extent, or one of the points of a light with one.
#[derive(Debug, Clone, PartialEq)]
pub struct LightPoint {
    /// How its whole light is called.
    pub label: String,
    /// What it gives.
    pub light: Light,
    /// The light that it is of.
    pub whole: Light,
    /// Cells along a side of its shadow map, where its whole light states them.
    pub shadow_cells: Option<u32>,
    /// The place of its whole light in the list that it is from.
    pub light_index: usize,
    /// Which of its points it is, and how many there are.
    pub rank: [usize; 2],
}

impl LightPoint {
    /// How it is called.
    pub fn name(&self) -> String {
        let Self { label, rank: [k, count], .. } = self;
        if *count > 1 { format!("point {k} of light {label}") } else { format!("light {label}") }
    }
}

/// The points of all lights, sorted by their bits so that the order of the file does not matter.
pub fn light_points(lights: &[SceneLight]) -> Vec<LightPoint> {
    let mut light_points = Vec::new();
    for (rank, whole) in lights.iter().enumerate() {
        let points = whole.light.points(whole.samples);
        let count = points.len();
        let point = |(k, light)| LightPoint {
            label: whole.label.clone(),
            light,
            whole: whole.light,
            shadow_cells: whole.shadow_cells,
            light_index: rank,
            rank: [k, count],
        };
        light_points.extend(points.into_iter().enumerate().map(point));
    }
    light_points.sort_by_cached_key(|point| (point.light.key(), lights[point.light_index].shadow));
    light_points
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
        let light = |label: &str, shape, samples, shadow| SceneLight {
            label: label.to_owned(),
            light: Light { shape, intensity: [6.0; 3] },
            slide: None,
            samples,
            states_samples: true,
            shadow,
            shadow_cells: None,
        };
        let disk = LightShape::Disk { center: DVec3::Y, normal: DVec3::NEG_Y, radius: 0.5 };
        let lamp = LightShape::Point { position: DVec3::Y };
        let lights = [light("0", disk, 3, true), light("key", lamp, 1, true), light("fill", lamp, 1, false)];
        let found = light_points(&lights);
        assert_eq!(found.len(), lights.iter().map(SceneLight::count).sum::<usize>());
        let names: Vec<String> = found.iter().map(LightPoint::name).collect();
        assert_eq!(names[..2], ["light fill", "light key"]);
        assert!(names[2..].iter().all(|name| name.ends_with(" of light 0")), "{names:?}");
        let others = light_points(&[2, 0, 1].map(|k: usize| lights[k].clone()));
        let same = |a: &LightPoint, b: &LightPoint| a.light == b.light;
        assert!(found.iter().zip(&others).all(|(a, b)| same(a, b)));
    }
}
