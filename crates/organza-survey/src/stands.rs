//! Which axis of data points up, where its format says nothing of it: things stand on the plane that their coordinates begin at.

use convert::read::UpAxis;
use splat_core::DAabb;
use std::path::Path;

/// Distance of the lowest point from 0 over the height, of what stands there.
const ON: f64 = 0.01;
/// Distance of the middle from 0 over the size, of what was placed about 0.
const ABOUT: f64 = 0.1;

/// z where the data's box begins at z = 0 and lies about 0 along x and y, as printable and drawn things mostly do; `None` where it does not
/// or where `format` already told z. glTF has y by its rules.
pub(crate) fn stands_along(path: &Path, format: UpAxis, bounds: DAabb) -> Option<UpAxis> {
    let is_gltf = path.extension().is_some_and(|e| ["gltf", "glb"].iter().any(|gltf| e.eq_ignore_ascii_case(gltf)));
    let (size, center) = (bounds.size(), bounds.center());
    let about = |axis: usize| center[axis].abs() <= ABOUT * size[axis];
    let stands = size.z > 0.0 && bounds.min.z.abs() <= ON * size.z && about(0) && about(1);
    (format == UpAxis::Y && !is_gltf && stands).then_some(UpAxis::Z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::glam::DVec3;

    #[test]
    fn things_stand_where_they_begin_at_zero_and_lie_about_it() {
        let of = |name: &str, min: [f64; 3], max: [f64; 3]| {
            stands_along(name.as_ref(), UpAxis::Y, DAabb::new(DVec3::from_array(min), DVec3::from_array(max)))
        };
        assert_eq!(of("vase.stl", [-2.0, -2.1, 0.01], [2.1, 2.0, 5.0]), Some(UpAxis::Z));
        assert_eq!(of("vase.glb", [-2.0, -2.1, 0.01], [2.1, 2.0, 5.0]), None);
        // On y = 0, about the origin, beside it, flat.
        assert_eq!(of("vase.stl", [-2.0, 0.0, -2.0], [2.0, 5.0, 2.0]), None);
        assert_eq!(of("ball.stl", [-1.0; 3], [1.0; 3]), None);
        assert_eq!(of("part.stl", [0.0; 3], [9.0; 3]), None);
        assert_eq!(of("sheet.stl", [-1.0, -1.0, 0.0], [1.0, 1.0, 0.0]), None);
        let bounds = DAabb::new(DVec3::new(-1.0, -1.0, 0.0), DVec3::ONE);
        assert_eq!(stands_along("a.las".as_ref(), UpAxis::Z, bounds), None);
    }
}
