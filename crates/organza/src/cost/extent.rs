//! How a box in the world lies in the view, from a few points of it: enough to count work, not to cull by.

use splat_core::glam::{DMat3, DVec2, DVec3};
use splat_core::{Camera, DAabb, Similarity};

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

/// Rays along each side of the part of a picture that a medium may cover, and looks along each.
const RAYS: u32 = 24;
const LOOKS: u32 = 64;

/// A box that may be slanted, world space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SlantedBox {
    pub(crate) corner: DVec3,
    pub(crate) edges: DMat3,
}

impl SlantedBox {
    /// A box of an object's own space, moved by its transform.
    pub(crate) fn of(corner: DVec3, edges: DMat3, transform: &Similarity) -> Self {
        let edge = |axis: usize| transform.rotate(edges.col(axis)) * transform.scale;
        Self { corner: transform.apply(corner), edges: DMat3::from_cols(edge(0), edge(1), edge(2)) }
    }

    pub(crate) fn corners(&self) -> [DVec3; 8] {
        [0, 1, 2, 3, 4, 5, 6, 7].map(|corner| {
            let part = DVec3::new((corner & 1) as f64, (corner >> 1 & 1) as f64, (corner >> 2) as f64);
            self.corner + self.edges * part
        })
    }
}

/// Length of the rays of a picture along which a medium shows, up to where no more than `cutoff` of what is behind passes: mean over the whole picture,
/// world units, from a few rays. `extinction` is that of a place of the box in parts of its edges, 1/world unit.
pub(crate) fn shown_length(
    bounds: &SlantedBox,
    camera: &Camera,
    cutoff: f64,
    extinction: impl Fn(DVec3) -> f64,
) -> f64 {
    let half = DVec2::new(f64::from(camera.size[0]), f64::from(camera.size[1])) * 0.5;
    let whole = Rectangle { low: -half, high: half };
    let about = Rectangle::about(&DAabb::of_points(bounds.corners()), camera).unwrap_or(whole);
    let low = about.low.max(-half);
    let high = about.high.min(half);
    let inverse = bounds.edges.inverse();
    if low.x >= high.x || low.y >= high.y || !inverse.is_finite() {
        return 0.0;
    }
    let finished = -libm::log(cutoff.max(f64::MIN_POSITIVE));
    let world = |view: DVec3| camera.axes[0] * view.x + camera.axes[1] * view.y + camera.axes[2] * view.z;
    let mut sum = 0.0;
    for rank in 0..RAYS * RAYS {
        let part = DVec2::new(f64::from(rank % RAYS) + 0.5, f64::from(rank / RAYS) + 0.5) / f64::from(RAYS);
        let pixel = low + (high - low) * part;
        // Upwards is positive in the rectangle, and downwards in the image.
        let (start, along) = camera.view_ray(half.x + pixel.x, half.y - pixel.y);
        let start = inverse * (camera.position + world(start) - bounds.corner);
        let along_box = inverse * world(along);
        let first = -start / along_box;
        let second = (1.0 - start) / along_box;
        let near = first.min(second).max_element().max(0.0);
        let far = first.max(second).min_element();
        let step = (far - near) / f64::from(LOOKS);
        // Of a ray that misses the box, or lies in one of its faces.
        if step.is_nan() || step <= 0.0 {
            continue;
        }
        let length = step * along.length();
        let mut optical_depth = 0.0;
        for look in 0..LOOKS {
            let here = extinction(start + along_box * (near + (f64::from(look) + 0.5) * step));
            if here > 0.0 {
                sum += length;
                optical_depth += here * length;
            }
            if optical_depth > finished {
                break;
            }
        }
    }
    let share_of_picture = (high - low).element_product() / (4.0 * half.element_product());
    sum / f64::from(RAYS * RAYS) * share_of_picture
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

    /// A cube of side 2 before parallel rays covers a quarter of a picture of side 4.
    #[test]
    fn a_medium_shows_up_to_where_nothing_passes_it() {
        let projection = splat_core::Projection::Orthographic { height: 4.0 };
        let camera =
            Camera { position: DVec3::ZERO, axes: [DVec3::X, DVec3::Y, DVec3::Z], projection, size: [100, 100] };
        let cube = SlantedBox { corner: DVec3::new(-1.0, -1.0, 3.0), edges: DMat3::from_diagonal(DVec3::splat(2.0)) };
        let shown = |extinction: f64, cutoff: f64| shown_length(&cube, &camera, cutoff, |_| extinction);
        assert!((shown(0.1, 1e-3) - 0.5).abs() < 1e-9);
        assert_eq!(shown(0.0, 1e-3), 0.0);
        // e^−10x is a thousandth at .69.
        assert!((shown(10.0, 1e-3) - 0.25 * 0.69).abs() < 0.25 * 2.0 / f64::from(LOOKS), "{}", shown(10.0, 1e-3));
        let behind_alone = |place: DVec3| if place.z > 0.5 { 0.1 } else { 0.0 };
        assert!((shown_length(&cube, &camera, 1e-3, behind_alone) - 0.25).abs() < 1e-9);
        let beside = SlantedBox { corner: DVec3::new(5.0, 0.0, 3.0), ..cube };
        assert_eq!(shown_length(&beside, &camera, 1e-3, |_| 1.0), 0.0);
        // From within, all of the picture.
        let around = SlantedBox { corner: DVec3::splat(-3.0), edges: DMat3::from_diagonal(DVec3::splat(6.0)) };
        assert!((shown_length(&around, &camera, 1e-3, |_| 0.1) - 3.0).abs() < 1e-9);
        let flat = SlantedBox { edges: DMat3::from_diagonal(DVec3::new(2.0, 2.0, 0.0)), ..cube };
        assert_eq!(shown_length(&flat, &camera, 1e-3, |_| 1.0), 0.0);
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
