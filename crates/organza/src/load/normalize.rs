//! Scenes of any size become scenes of size one, by a power of two, so that squares of lengths neither overflow nor vanish
//! in f32 and a scene scaled by a power of two gives the same picture bit by bit.

use super::by_object::by_object;
use super::own::Own;
use crate::scene::SceneLight;
use glam::Vec3;
use splat_core::{Aabb, Camera, Cloud, DAabb, Slide};

/// Scales everything by 2^−e, where 2^e is the size of the bounds of all splats and objects, and returns e.
///
/// Lengths scale with 2^−e, cross-sections and point intensities with 2^−2e; directional irradiance stays.
pub(super) fn normalize(
    cloud: &mut Cloud,
    natives: &mut [Own],
    camera: &mut Camera,
    lights: &mut [SceneLight],
    slides: &mut [Option<Slide>],
) -> i32 {
    let diagonal = bounds(cloud, natives).diagonal();
    if !(diagonal.is_finite() && diagonal > 0.0) {
        return 0;
    }
    let exponent = libm::log2(diagonal).floor() as i32;
    let scale = libm::exp2(f64::from(exponent)).recip();
    cloud.scale_world(scale);
    camera.scale_world(scale);
    natives.iter_mut().for_each(|o| o.scale_world(scale));
    for light in lights {
        light.light = light.light.scaled(scale);
    }
    slides.iter_mut().flatten().for_each(|slide| slide.scale_world(scale));
    exponent
}

/// The bounds of all splats and objects; empty where there is nothing.
fn bounds(cloud: &Cloud, natives: &[Own]) -> DAabb {
    let bounds = cloud.bounds();
    // Nothing stays nothing: its corners are infinite.
    let splats = DAabb::new(cloud.origin + bounds.min.as_dvec3(), cloud.origin + bounds.max.as_dvec3());
    natives.iter().map(Own::world_box).fold(splats, DAabb::union)
}

/// The bounds of each of so many objects and its splats; empty where there is nothing of one.
pub(crate) fn object_bounds(cloud: &Cloud, natives: &[Own], objects: usize) -> Vec<DAabb> {
    let meet = |around: &mut Aabb, i: usize| {
        let place = cloud.position[i];
        *around = around.union(Aabb { min: place, max: place });
    };
    let splats = by_object(cloud, objects, &Aabb::EMPTY, meet, |around, other| *around = around.union(*other));
    // Nothing stays nothing: its corners are infinite.
    let place = |corner: Vec3| cloud.origin + corner.as_dvec3();
    let mut boxes: Vec<DAabb> = splats.iter().map(|b| DAabb::new(place(b.min), place(b.max))).collect();
    for native in natives {
        boxes[native.object] = boxes[native.object].union(native.world_box());
    }
    boxes
}
