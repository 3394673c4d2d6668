//! Finds the objects whose shadows the picture could show. Shadow maps spend their cells on these alone.
//!
//! Objects are boxes here. Whatever may lie in the view receives as a whole, and whatever may lie between that and a light casts as a
//! whole, so no shadow is lost; and the tables of a view that turns stay as they are while the same objects are in it.

use crate::load::Loaded;
use crate::load::own::Own;
use crate::scene::Scene;
use glam::DVec3;
use rayon::prelude::*;
use splat_core::{Camera, Cloud, DAabb, Light, LightShape, Object, Projection};

/// Splats of a task.
const CHUNK: usize = 1 << 14;
/// How much wider than the view the view is in which objects receive: footprints are filtered, and rounded, beside their splats.
const WIDER: f64 = 1.125;

/// How far corners may lie on the wrong side of a plane through them, in the normalized world, whose size is about one.
const ROUNDING: f64 = 1e-12;
/// Distance from such a plane at which a box lies beside a shadow: a million times as much, as a shadow grows behind a caster near to its light.
const GAP: f64 = 1e-6;

/// The objects of a scene as boxes in the normalized world, and which of them the picture may show.
pub(crate) struct Shadowing {
    boxes: Vec<DAabb>,
    shown: Vec<bool>,
}

impl Shadowing {
    /// Finds what the camera of a loaded scene may see: everything in an animation, whose shadows would jump where an object comes into view, and
    /// where the picture shows light that `leaves_view`.
    pub(crate) fn new(scene: &Scene, loaded: &Loaded, leaves_view: bool) -> Self {
        let objects = loaded.objects.len();
        if leaves_view || scene.frames.is_some() {
            return Self { boxes: Vec::new(), shown: vec![true; objects] };
        }
        let mut boxes = boxes(&loaded.cloud, objects);
        loaded
            .own
            .iter()
            .for_each(|native: &Own| boxes[native.object] = boxes[native.object].union(native.world_box()));
        let view = wider(&loaded.camera);
        let shown = boxes.iter().map(|bounds| !bounds.is_empty() && view.may_see_hull(&bounds.corners())).collect();
        Self { boxes, shown }
    }

    /// For each object, whether the picture may show it.
    pub(crate) fn shown(&self) -> &[bool] {
        &self.shown
    }

    /// For each object, whether it may shadow an object that is shown from this light.
    pub(crate) fn casters(&self, light: &Light) -> Vec<bool> {
        let receivers = || self.boxes.iter().zip(&self.shown).filter(|(_, shown)| **shown);
        let shadows = |caster: &DAabb| {
            !caster.is_empty() && receivers().any(|(receiver, _)| may_shadow(&light.shape, caster, receiver))
        };
        let casts = |object: usize| self.shown[object] || shadows(&self.boxes[object]);
        (0..self.shown.len()).map(casts).collect()
    }
}

/// Objects of which only those cast shadows that are `kept`.
pub(crate) fn casting(objects: &[Object], kept: &[bool]) -> Vec<Object> {
    let casting =
        |(object, kept): (&Object, &bool)| Object { casts_shadow: object.casts_shadow && *kept, ..object.clone() };
    objects.iter().zip(kept).map(casting).collect()
}

/// The same view, wider on all sides.
pub(super) fn wider(camera: &Camera) -> Camera {
    let projection = match camera.projection {
        Projection::Perspective { fov_y } => {
            Projection::Perspective { fov_y: 2.0 * libm::atan(WIDER * libm::tan(0.5 * fov_y)) }
        }
        Projection::Orthographic { height } => Projection::Orthographic { height: WIDER * height },
    };
    Camera { projection, ..*camera }
}

/// The boxes of objects with all of their splats; empty without any.
fn boxes(cloud: &Cloud, objects: usize) -> Vec<DAabb> {
    let of_chunk = |begin: usize| {
        let mut boxes = vec![DAabb::EMPTY; objects];
        for i in begin..cloud.len().min(begin + CHUNK) {
            let reach = f64::from(cloud.radius[i].max(cloud.tangent_of(i).length()));
            let splat = DAabb::around(cloud.origin + cloud.position[i].as_dvec3(), DVec3::splat(reach));
            let bounds = &mut boxes[cloud.object[i] as usize];
            *bounds = bounds.union(splat);
        }
        boxes
    };
    let join = |a: Vec<DAabb>, b: Vec<DAabb>| a.into_iter().zip(b).map(|(a, b)| a.union(b)).collect();
    let chunks = (0..cloud.len().div_ceil(CHUNK)).into_par_iter().map(|chunk| of_chunk(chunk * CHUNK));
    chunks.reduce(|| vec![DAabb::EMPTY; objects], join)
}

/// Whether a box may throw a shadow of a light upon another: no plane is found that has the shadow on one side and the other box on the other.
fn may_shadow(light: &LightShape, caster: &DAabb, receiver: &DAabb) -> bool {
    // From the light to a corner.
    let towards = |corner: DVec3| match (light, light.place()) {
        (LightShape::Directional { direction }, _) => *direction,
        (_, place) => corner - place.unwrap_or(corner),
    };
    let behind = |normal: DVec3| {
        let [rounding, gap] = [ROUNDING, GAP].map(|part| part * normal.length());
        let is_beyond = caster.corners().iter().all(|corner| normal.dot(towards(*corner)) >= -rounding);
        let nearest = caster.corners().iter().map(|corner| normal.dot(*corner)).fold(f64::INFINITY, f64::min);
        is_beyond && receiver.corners().iter().all(|corner| normal.dot(*corner) < nearest - gap)
    };
    // The sides of the boxes, and the planes that the light grazes an edge of either in.
    let edges = [caster, receiver].into_iter().flat_map(DAabb::corners);
    let grazed = edges.flat_map(|corner| DVec3::AXES.map(|axis| axis.cross(towards(corner))));
    !DVec3::AXES.into_iter().chain(grazed).any(|normal| behind(normal) || behind(-normal))
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::rng;

    fn around(center: [f64; 3], reach: f64) -> DAabb {
        DAabb::around(DVec3::from(center), DVec3::splat(reach))
    }

    #[test]
    fn boxes_shadow_what_lies_behind_them() {
        let lamp = LightShape::Point { position: DVec3::new(0.0, 10.0, 0.0) };
        let sun = LightShape::Directional { direction: DVec3::NEG_Y };
        let ground = DAabb::new(DVec3::new(-3.0, -0.1, -3.0), DVec3::new(3.0, 0.1, 3.0));
        for (center, by_lamp, by_sun) in [
            ([0.0, 5.0, 0.0], true, true),
            // Beside the ground, above it as the lamp sees it.
            ([3.9, 1.0, 0.0], false, false),
            ([1.9, 5.0, 0.0], true, true),
            ([2.5, 5.0, 0.0], false, true),
            // Below the ground, and behind the lamp.
            ([0.0, -2.0, 0.0], false, false),
            ([0.0, 20.0, 0.0], false, true),
            ([0.0, 10.0, 0.0], true, true),
            ([500.0, 0.0, 0.0], false, false),
        ] {
            let caster = around(center, 0.5);
            assert_eq!(may_shadow(&lamp, &caster, &ground), by_lamp, "{center:?} by the lamp");
            assert_eq!(may_shadow(&sun, &caster, &ground), by_sun, "{center:?} by the sun");
        }
    }

    #[test]
    fn no_shadow_of_a_box_is_lost() {
        let unit = |k: u64, index: u64| rng::unit(7, 1, k, index);
        let mut shadowed = 0;
        for k in 0..20_000 {
            let some = |index: u64| DVec3::new(unit(k, index), unit(k, index + 1), unit(k, index + 2));
            let caster = DAabb::around(4.0 * some(0), 0.6 * some(3));
            let receiver = DAabb::around(4.0 * some(6), 0.6 * some(9));
            let within = |bounds: &DAabb, index: u64| bounds.min + bounds.size() * some(index);
            let at = within(&receiver, 12);
            let from = 4.0 * some(15);
            let direction = (within(&caster, 18) - at).normalize();
            // A light that sees the receiver through the caster.
            let between = within(&caster, 18);
            let lights = [
                LightShape::Directional { direction: -direction },
                LightShape::Point { position: between + direction * from.x },
            ];
            for light in lights {
                shadowed += 1;
                assert!(may_shadow(&light, &caster, &receiver), "{k}: {light:?} {caster:?} {receiver:?}");
            }
        }
        assert_eq!(shadowed, 40_000);
    }
}
