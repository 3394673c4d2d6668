//! The place of the scene below the pointer, and the object there.

pub(crate) mod below;

use splat_core::Camera;
use splat_core::glam::DVec3;

/// A place in a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PicturePlace {
    /// Share of the width, from the left, 0 to 1.
    pub right: f64,
    /// Share of the height, from above, 0 to 1.
    pub down: f64,
}

impl PicturePlace {
    /// The pixel of a picture of this size, row by row from above.
    pub(crate) fn pixel(self, width: u32, height: u32) -> usize {
        let nearest = |share: f64, side: u32| ((share * f64::from(side)).max(0.0) as u32).min(side.saturating_sub(1));
        nearest(self.down, height) as usize * width as usize + nearest(self.right, width) as usize
    }
}

/// The depths of a coarse picture.
#[derive(Debug)]
pub(crate) struct Depths {
    /// The state that it shows.
    pub(crate) generation: u64,
    pub(crate) camera: Camera,
    /// View depth at which half of the light is absorbed, world units, a pixel, row by row from above; +∞ where that is nowhere.
    pub(crate) depth: Vec<f32>,
    /// Rank of the object that is seen first, a pixel; empty where it is not known.
    pub(crate) object: Vec<u32>,
}

impl Depths {
    /// The pixel at a place of the picture.
    fn pixel_at(&self, place: PicturePlace) -> usize {
        let [width, height] = self.camera.size;
        place.pixel(width, height)
    }

    /// View depth at a place of the picture, world units; `None` where nothing is seen there that hides half of what lies behind it.
    pub(crate) fn depth_at(&self, place: PicturePlace) -> Option<f64> {
        let depth = f64::from(*self.depth.get(self.pixel_at(place))?);
        (depth.is_finite() && depth > 0.0).then_some(depth)
    }

    /// Rank of the object that is seen first at a place of the picture.
    pub(crate) fn object_at(&self, place: PicturePlace) -> Option<usize> {
        self.object.get(self.pixel_at(place)).filter(|rank| **rank != u32::MAX).map(|rank| *rank as usize)
    }

    /// World position at a place of the picture; `None` where nothing is seen there that hides half of what lies behind it.
    pub(crate) fn point_at(&self, place: PicturePlace) -> Option<DVec3> {
        let [width, height] = self.camera.size;
        let depth = self.depth_at(place)?;
        let (start, direction) = self.camera.view_ray(place.right * f64::from(width), place.down * f64::from(height));
        let seen = start + direction * depth;
        let [right, up, forward] = self.camera.axes;
        Some(self.camera.position + right * seen.x + up * seen.y + forward * seen.z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::Projection;

    #[test]
    fn a_point_is_found_again_where_it_is_seen() {
        for projection in [Projection::Perspective { fov_y: 0.6 }, Projection::Orthographic { height: 3.0 }] {
            let eye = DVec3::new(3.0, 2.0, 5.0);
            let camera = Camera::look_at(eye, DVec3::ZERO, DVec3::Y, projection, [40, 30]).unwrap();
            let point = DVec3::new(0.3, -0.2, 0.4);
            let seen = camera.view_from_world(point);
            let scale = if camera.is_orthographic() { 1.0 } else { seen.z };
            let place = PicturePlace {
                right: 0.5 + seen.x / scale * camera.focal_px() / 40.0,
                down: 0.5 - seen.y / scale * camera.focal_px() / 30.0,
            };
            let depths =
                Depths { generation: 1, camera, depth: vec![seen.z as f32; 40 * 30], object: vec![2; 40 * 30] };
            assert_eq!((depths.object_at(place), depths.depth_at(place)), (Some(2), Some(f64::from(seen.z as f32))));
            let found = depths.point_at(place).unwrap();
            assert!((found - point).length() < 1e-6, "{found}");
            let nothing = Depths { depth: vec![f32::INFINITY; 40 * 30], ..depths };
            assert_eq!(nothing.point_at(place), None);
        }
    }

    #[test]
    fn places_beside_the_picture_are_at_its_border() {
        let camera = Camera::look_at(DVec3::Z, DVec3::ZERO, DVec3::Y, Projection::Perspective { fov_y: 0.6 }, [4, 3]);
        let depths =
            Depths { generation: 1, camera: camera.unwrap(), depth: vec![1.0; 12], object: vec![u32::MAX; 12] };
        for share in [-1.0, 0.0, 1.0, 2.0, f64::NAN] {
            let found = depths.point_at(PicturePlace { right: share, down: share });
            assert!(found.is_some());
            assert_eq!(depths.object_at(PicturePlace { right: share, down: share }), None);
        }
    }
}
