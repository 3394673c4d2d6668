//! How a box in the world lies in the view, from a few points of it: enough to count work, not to cull by.

use splat_core::glam::{DVec2, DVec3};
use splat_core::{Camera, DAabb};

/// Points along a side of the box.
const SIDE: u32 = 8;
/// Share of the rectangle about a projected box that the box covers, on average of directions.
const COVERED: f64 = 0.75;

/// How a box lies in the view.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Extent {
    /// Share of its volume that is in view, 0 to 1.
    pub(crate) share: f64,
    /// Samples of the picture that it covers.
    pub(crate) samples: f64,
    /// Mean width of a world unit in it, samples.
    pub(crate) samples_per_unit: f64,
}

impl Extent {
    /// How a box lies in the view of a camera whose pixels are samples.
    pub(crate) fn new(bounds: &DAabb, camera: &Camera) -> Self {
        let size = bounds.max - bounds.min;
        let focal = camera.focal_px();
        let half = camera.size.map(|s| 0.5 * f64::from(s));
        let place = |k: u32| (f64::from(k) + 0.5) / f64::from(SIDE);
        let mut seen = 0.0;
        let mut sum = 0.0;
        let mut low = [f64::INFINITY; 2];
        let mut high = [f64::NEG_INFINITY; 2];
        for k in 0..SIDE.pow(3) {
            let part = DVec3::new(place(k % SIDE), place(k / SIDE % SIDE), place(k / SIDE / SIDE));
            let p = camera.view_from_world(bounds.min + size * part);
            let scale = if camera.is_orthographic() { focal } else { focal / p.z };
            let at = [p.x * scale, p.y * scale];
            if p.z <= 0.0 || at[0].abs() > half[0] || at[1].abs() > half[1] {
                continue;
            }
            seen += 1.0;
            sum += scale;
            for axis in 0..2 {
                low[axis] = low[axis].min(at[axis]);
                high[axis] = high[axis].max(at[axis]);
            }
        }
        if seen == 0.0 {
            return Self::default();
        }
        // Middles of parts lie half a part within the box.
        let widened = f64::from(SIDE) / f64::from(SIDE - 1);
        let rectangle = [0, 1].map(|axis| ((high[axis] - low[axis]) * widened).min(2.0 * half[axis]));
        Self {
            share: seen / f64::from(SIDE.pow(3)),
            samples: COVERED * rectangle[0] * rectangle[1],
            samples_per_unit: sum / seen,
        }
    }
}

/// Whether two boxes may be seen in one pixel: neither is empty, and the rectangles about both overlap or are at most [`GAP`] pixels apart.
pub(crate) fn may_share_pixel(first: &DAabb, second: &DAabb, camera: &Camera) -> bool {
    if first.is_empty() || second.is_empty() {
        return false;
    }
    let (Some(first), Some(second)) = (Rectangle::about(first, camera), Rectangle::about(second, camera)) else {
        return true;
    };
    let is_near =
        |axis: usize| first.low[axis] <= second.high[axis] + GAP && second.low[axis] <= first.high[axis] + GAP;
    is_near(0) && is_near(1)
}

/// Pixels by which splats reach beyond the box of their object, about.
const GAP: f64 = 2.0;

/// The part of the image plane about a box, pixels from the middle of the picture.
struct Rectangle {
    low: DVec2,
    high: DVec2,
}

impl Rectangle {
    /// `None` where the box reaches behind the camera.
    fn about(bounds: &DAabb, camera: &Camera) -> Option<Self> {
        let focal = camera.focal_px();
        let mut rectangle = Self { low: DVec2::INFINITY, high: DVec2::NEG_INFINITY };
        for corner in bounds.corners() {
            let place = camera.view_from_world(corner);
            if place.z <= 0.0 {
                return None;
            }
            let at = place.truncate() * if camera.is_orthographic() { focal } else { focal / place.z };
            rectangle = Self { low: rectangle.low.min(at), high: rectangle.high.max(at) };
        }
        Some(rectangle)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_half_out_of_view_has_half_its_share() {
        let projection = splat_core::Projection::Orthographic { height: 2.0 };
        let camera =
            Camera { position: DVec3::ZERO, axes: [DVec3::X, DVec3::Y, DVec3::Z], projection, size: [100, 100] };
        let whole = Extent::new(&DAabb::new(DVec3::new(-0.5, -0.5, 1.0), DVec3::new(0.5, 0.5, 2.0)), &camera);
        assert_eq!((whole.share, whole.samples_per_unit), (1.0, 50.0));
        assert!((whole.samples - COVERED * 2500.0).abs() < 1e-6, "{whole:?}");
        let half = Extent::new(&DAabb::new(DVec3::new(0.5, -0.5, 1.0), DVec3::new(1.5, 0.5, 2.0)), &camera);
        assert_eq!(half.share, 0.5);
        let behind = Extent::new(&DAabb::new(DVec3::new(0.0, 0.0, -2.0), DVec3::new(1.0, 1.0, -1.0)), &camera);
        assert_eq!(behind, Extent::default());
    }

    #[test]
    fn boxes_share_a_pixel_where_one_is_before_the_other_and_not_beside_it() {
        let projection = splat_core::Projection::Perspective { fov_y: 0.8 };
        let camera =
            Camera { position: DVec3::ZERO, axes: [DVec3::X, DVec3::Y, DVec3::Z], projection, size: [100, 100] };
        let unit = |x: f64, z: f64| DAabb::around(DVec3::new(x, 0.0, z), DVec3::splat(0.5));
        assert!(may_share_pixel(&unit(0.0, 5.0), &unit(0.0, 9.0), &camera));
        assert!(!may_share_pixel(&unit(-1.0, 5.0), &unit(1.0, 5.0), &camera));
        // Side by side, with a gap of less than two pixels.
        assert!(may_share_pixel(&unit(-0.505, 5.0), &unit(0.505, 5.0), &camera));
        assert!(!may_share_pixel(&unit(0.0, 5.0), &DAabb::EMPTY, &camera));
        // Behind the camera in part, it may be anywhere.
        assert!(may_share_pixel(&unit(-1.0, 5.0), &unit(3.0, 0.0), &camera));
    }
}
