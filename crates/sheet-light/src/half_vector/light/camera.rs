//! The light's image: a camera at the lamp that sees all that casts shadows.

use crate::half_vector::params::HalfParams;
use crate::half_vector::slicing::bodies::Bodies;
use crate::half_vector::slicing::serves::travel;
use splat_core::glam::DVec3;
use splat_core::{Camera, Light, Projection};

/// Pixels around the bodies, so that a look-up finds neighbours.
const RIM: f64 = 3.0;

/// The camera of a light that half vectors serve: parallel for directional light, else a pinhole at the lamp.
pub(crate) fn camera_of(bodies: &Bodies<'_>, light: &Light, params: &HalfParams) -> Camera {
    let middle = bodies.middle();
    let forward = travel(light, middle);
    let up = if forward.y.abs() < 0.9 { DVec3::Y } else { DVec3::NEG_Z };
    let right = forward.cross(up).normalize();
    let axes = [right, right.cross(forward), forward];
    let projection = Projection::Orthographic { height: 1.0 };
    let camera = Camera { position: light.shape.place().unwrap_or(middle), axes, projection, size: [1, 1] };
    let pixel = bodies.least_step() / params.light_pixels;
    let corners = bodies.corners().map(|p| camera.view_from_world(p));
    if light.shape.place().is_some() {
        let half = corners.fold(DVec3::ZERO, |half, p| half.max((p / p.z).abs()));
        let focal = camera.view_from_world(middle).z / pixel;
        let (size, focal) = size_of([2.0 * half.x, 2.0 * half.y], focal, params.most_light_pixels);
        let fov_y = 2.0 * libm::atan(0.5 * f64::from(size[1]) / focal);
        return Camera { projection: Projection::Perspective { fov_y }, size, ..camera };
    }
    let mut low = DVec3::INFINITY;
    let mut high = DVec3::NEG_INFINITY;
    corners.for_each(|p| (low, high) = (low.min(p), high.max(p)));
    let center = 0.5 * (low + high);
    let position = camera.position + right * center.x + axes[1] * center.y + forward * (2.0 * low.z - high.z);
    let (size, scale) = size_of([high.x - low.x, high.y - low.y], 1.0 / pixel, params.most_light_pixels);
    let projection = Projection::Orthographic { height: f64::from(size[1]) / scale };
    Camera { position, projection, size, ..camera }
}

/// Pixels for an extent at `scale` pixels a unit, and the scale, less where there would be more than `most`.
fn size_of(extent: [f64; 2], scale: f64, most: u32) -> ([u32; 2], f64) {
    let largest = extent[0].max(extent[1]);
    let scale = scale.min((f64::from(most) - 2.0 * RIM) / largest);
    (extent.map(|e| ((e * scale + 2.0 * RIM).ceil() as u32).clamp(1, most)), scale)
}
