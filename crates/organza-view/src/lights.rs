//! Changes of a light: its intensity, its shadow, its direction.

use organza::scene::SceneLight;
use serde::Serialize;
use splat_core::LightShape;
use splat_core::glam::{DQuat, DVec3};

/// The direction that light comes from, degrees.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Direction {
    /// About +Y, from +Z towards +X, −180 to 180.
    pub azimuth: f64,
    /// Above the horizon, −90 to 90.
    pub elevation: f64,
}

impl Direction {
    /// The direction of a vector, of any length above 0.
    fn of_vector(vector: DVec3) -> Self {
        let level = libm::hypot(vector.x, vector.z);
        Self {
            azimuth: libm::atan2(vector.x, vector.z).to_degrees(),
            elevation: libm::atan2(vector.y, level).to_degrees(),
        }
    }

    /// Unit vector.
    fn vector(self) -> DVec3 {
        let (sine, cosine) = libm::sincos(self.azimuth.to_radians());
        let (height, level) = libm::sincos(self.elevation.to_radians());
        DVec3::new(level * sine, height, level * cosine)
    }
}

/// A light, as a row of the page.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LightRow {
    /// Its label in effects: its name, or its place in the scene's list.
    pub name: String,
    /// Its kind, in a word.
    pub kind: &'static str,
    /// Stops by which it is brighter than the scene has it.
    pub stops: f64,
    /// The direction that its light comes from; `None` if its shape has no such direction.
    pub direction: Option<Direction>,
    /// Whether it casts shadows.
    pub shadow: bool,
}

/// Changes of a light.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct LightChange {
    pub(crate) stops: Option<f64>,
    pub(crate) direction: Option<Direction>,
    pub(crate) shadow: Option<bool>,
}

/// Which key says where a spot shines to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Aim {
    Direction,
    Target,
}

impl LightChange {
    /// The changes as keys of the light with values in TOML; `centre` is what a light in a place goes around, and with it the side that it shines to.
    pub(crate) fn keys(&self, light: &SceneLight, centre: DVec3, aim: Aim) -> Vec<(&'static str, String)> {
        let mut keys = Vec::new();
        if let Some(stops) = self.stops.filter(|stops| *stops != 0.0) {
            let is_parallel = matches!(light.light.shape, LightShape::Directional { .. });
            let key = if is_parallel { "irradiance" } else { "intensity" };
            let factor = libm::exp2(stops);
            let channels = light.light.intensity.map(|channel| format!("{:?}", (f64::from(channel) * factor) as f32));
            keys.push((key, format!("[{}]", channels.join(", "))));
        }
        let vector = |v: DVec3| format!("[{:?}, {:?}, {:?}]", v.x, v.y, v.z);
        match (self.direction, &light.light.shape) {
            (Some(from), LightShape::Directional { .. }) => keys.push(("direction", vector(-from.vector()))),
            (Some(from), LightShape::Point { position } | LightShape::Sphere { center: position, .. }) => {
                let distance = (*position - centre).length();
                keys.push(("position", vector(centre + from.vector() * distance)));
            }
            (Some(from), shape) => {
                if let Some(place) = place_of(shape).filter(|place| *place != centre) {
                    let turn = DQuat::from_rotation_arc((place - centre).normalize(), from.vector());
                    keys.push(("position", vector(centre + turn * (place - centre))));
                    keys.extend(turned(shape, turn, centre, aim).map(|(key, value)| (key, vector(value))));
                }
            }
            (None, _) => {}
        }
        if let Some(shadow) = self.shadow {
            if !shadow && light.shadow_cells.is_some() {
                // A light without a shadow has no cells.
                keys.push(("shadow_cells", String::new()));
            }
            keys.push(("shadow", shadow.to_string()));
        }
        keys
    }
}

/// Where a light stands.
fn place_of(shape: &LightShape) -> Option<DVec3> {
    Some(match *shape {
        LightShape::Point { position } | LightShape::Spot { position, .. } | LightShape::Patch { position, .. } => {
            position
        }
        LightShape::Sphere { center, .. } | LightShape::Disk { center, .. } | LightShape::Rect { center, .. } => center,
        _ => return None,
    })
}

/// The keys that say to which side a light shines, turned about a centre.
fn turned(shape: &LightShape, turn: DQuat, centre: DVec3, aim: Aim) -> impl Iterator<Item = (&'static str, DVec3)> {
    let [first, second] = match *shape {
        LightShape::Spot { position, direction, .. } => match aim {
            Aim::Direction => [Some(("direction", turn * direction)), None],
            Aim::Target => [Some(("target", centre + turn * (position + direction - centre))), None],
        },
        LightShape::Disk { normal, .. } => [Some(("normal", turn * normal)), None],
        LightShape::Rect { u, v, .. } => [Some(("u", turn * u)), Some(("v", turn * v))],
        _ => [None, None],
    };
    [first, second].into_iter().flatten()
}

/// From where a light comes, seen from a centre; `None` for one that stands there.
pub(crate) fn direction_of(light: &SceneLight, centre: DVec3) -> Option<Direction> {
    let vector = match light.light.shape {
        LightShape::Directional { direction } => -direction,
        _ => place_of(&light.light.shape)? - centre,
    };
    (vector.length() > 0.0).then(|| Direction::of_vector(vector))
}

/// Returns the kind of a light in a word.
pub(crate) fn kind_of(light: &SceneLight) -> &'static str {
    match light.light.shape {
        LightShape::Point { .. } => "point",
        LightShape::Directional { .. } => "parallel light",
        LightShape::Spot { .. } => "spot",
        LightShape::Patch { .. } => "patch",
        LightShape::Sphere { .. } => "sphere",
        LightShape::Disk { .. } => "disc",
        LightShape::Rect { .. } => "rectangle",
        _ => "light",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_direction_comes_back_from_its_vector() {
        for (azimuth, elevation) in [(0.0, 0.0), (90.0, 0.0), (-135.0, 30.0), (20.0, -80.0)] {
            let direction = Direction { azimuth, elevation };
            let again = Direction::of_vector(direction.vector() * 7.0);
            assert!((again.azimuth - azimuth).abs() < 1e-12 && (again.elevation - elevation).abs() < 1e-12);
        }
        assert!((Direction { azimuth: 90.0, elevation: 0.0 }.vector() - DVec3::X).length() < 1e-15);
        assert!((Direction { azimuth: 0.0, elevation: 90.0 }.vector() - DVec3::Y).length() < 1e-15);
    }
}
