//! Objects that lie in the view and are smaller than a pixel: files of unlike units or places in one picture.

use crate::load::{Loaded, by_object::by_object, own::Own};
use crate::scene::{Scene, place};
use crate::shown;
use glam::DVec3;
use splat_core::{Camera, DAabb};

/// Most objects that are told one by one.
const TOLD: usize = 4;

/// What is said of each such object; `seen` tells for each object whether some of it lies in the view.
pub(super) fn too_small(scene: &Scene, loaded: &Loaded, seen: &[bool]) -> Vec<String> {
    let boxes = boxes(loaded);
    let widths: Vec<f64> = boxes.iter().map(|bounds| width_px(bounds, &loaded.camera)).collect();
    let is_small = |id: &usize| seen[*id] && !boxes[*id].is_empty() && widths[*id] < 1.0;
    let small: Vec<usize> = (0..boxes.len()).filter(is_small).collect();
    let others = (0..boxes.len()).filter(|id| !boxes[*id].is_empty() && !small.contains(id));
    let largest = others.max_by(|a, b| boxes[*a].diagonal().total_cmp(&boxes[*b].diagonal()));
    // Back into the scene's unit.
    let unit = libm::exp2(f64::from(loaded.exponent));
    let told = |id: &usize| {
        let name = shown(&scene.objects[*id].name);
        let size = boxes[*id].diagonal() * unit;
        let width = about(widths[*id]);
        let what =
            format!("object '{name}' is {width} of a pixel wide and cannot be seen: it is {} across", about(size));
        let Some(largest) = largest else {
            return format!("{what}; move the camera nearer, or set camera = \"auto\"");
        };
        let other = DAabb::new(boxes[largest].min * unit, boxes[largest].max * unit);
        let beside = other.center() + DVec3::X * other.size().x;
        format!(
            "{what}, and '{}' {}; scale it by about {} and move its middle to {} to stand beside that, or show it alone",
            shown(&scene.objects[largest].name),
            about(other.diagonal()),
            about(other.diagonal() / size),
            place(beside),
        )
    };
    let more = small.len().saturating_sub(TOLD);
    let rest = (more > 0).then(|| format!("{more} other objects are smaller than a pixel as well"));
    small.iter().take(TOLD).map(told).chain(rest).collect()
}

/// A box around each object with its discs, in the normalized world; empty for what has nothing.
fn boxes(loaded: &Loaded) -> Vec<DAabb> {
    let cloud = &loaded.cloud;
    let meet = |bounds: &mut DAabb, i: usize| {
        let around = DVec3::splat(f64::from(cloud.radius[i]));
        *bounds = bounds.union(DAabb::around(cloud.origin + cloud.position[i].as_dvec3(), around));
    };
    let join = |bounds: &mut DAabb, other: &DAabb| *bounds = bounds.union(*other);
    let mut boxes = by_object(cloud, loaded.objects.len(), &DAabb::EMPTY, meet, join);
    let add = |native: &Own| boxes[native.object] = boxes[native.object].union(native.world_box());
    loaded.own.iter().for_each(add);
    boxes
}

/// How long the diagonal of a box is in the picture at most, pixels; without end for a box that the eye lies in or before.
fn width_px(bounds: &DAabb, camera: &Camera) -> f64 {
    let diagonal = bounds.diagonal();
    if camera.is_orthographic() {
        return diagonal * camera.focal_px();
    }
    let nearest = camera.view_from_world(bounds.center()).z - 0.5 * diagonal;
    if nearest > 0.0 { diagonal / nearest * camera.focal_px() } else { f64::INFINITY }
}

/// A number for people: two digits that count.
fn about(number: f64) -> String {
    if number == 0.0 || !(1e-3..1e6).contains(&number) {
        return format!("{number:.1e}");
    }
    let digits = (1.0 - libm::log10(number).floor()).max(0.0) as usize;
    format!("{number:.digits$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_two_digits_that_count() {
        let seen = [0.0123, 0.5, 7.04, 12.3, 12_345.6, 3.2e7, 2e-5].map(about);
        assert_eq!(seen, ["0.012", "0.50", "7.0", "12", "12346", "3.2e7", "2.0e-5"]);
    }
}
