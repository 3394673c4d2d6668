//! The images of a light in which polygons are looked for: of what receives its light, from before all that casts shadows.

use crate::Error;
use crate::half_vector::slicing::serves::travel;
use splat_core::glam::DVec3;
use splat_core::raster::triangles::PlacedMesh;
use splat_core::{Camera, Light, Projection};

/// Pixels around what receives light.
const RIM: f64 = 2.0;

/// How far to the side of its axis a lamp sees in one view, as a tangent; beyond that it takes six.
const WIDEST: f64 = 3.0;

/// Views of a light on receivers about a middle, of at most `most` pixels a side: one, or six of a lamp that they surround.
pub(super) fn views(
    light: &Light,
    middle: DVec3,
    casters: &[PlacedMesh<'_>],
    receivers: &[DVec3],
    most: u32,
) -> Result<Vec<Camera>, Error> {
    match light.shape.place() {
        Some(lamp) => lamp_views(lamp, middle, receivers, most),
        None => Ok(vec![sun_view(travel(light, middle), casters, receivers, most)?]),
    }
}

/// The view of parallel light on what receives it, from before all that casts shadows.
fn sun_view(travel: DVec3, casters: &[PlacedMesh<'_>], receivers: &[DVec3], most: u32) -> Result<Camera, Error> {
    let look = |from: DVec3, height: f64, size: [u32; 2]| {
        let projection = Projection::Orthographic { height };
        // Relative to the travel, no bit of the direction is lost to the place.
        let camera = Camera::look_at(DVec3::ZERO, travel, DVec3::Y, projection, size).map_err(Error::Light)?;
        Ok(Camera { position: from, ..camera })
    };
    let plain: Camera = look(DVec3::ZERO, 1.0, [1, 1])?;
    let bounds = |points: &mut dyn Iterator<Item = DVec3>| {
        points
            .map(|p| plain.view_from_world(p))
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)))
    };
    let (low, high) = bounds(&mut receivers.iter().copied());
    let corners = casters.iter().flat_map(|placed| {
        let PlacedMesh { mesh, transform } = *placed;
        mesh.position.iter().map(move |p| transform.apply(mesh.origin + p.as_dvec3()))
    });
    let (nearest, _) = bounds(&mut corners.chain(receivers.iter().copied()));
    let extent = [0, 1].map(|a| high[a] - low[a]);
    let widest = extent[0].max(extent[1]);
    let widest = if widest > 0.0 { widest } else { 1.0 };
    let scale = (f64::from(most) - 2.0 * RIM) / widest;
    let size = extent.map(|e| ((e * scale + 2.0 * RIM).ceil() as u32).clamp(1, most));
    let middle = 0.5 * (low + high);
    let [right, up, forward] = plain.axes;
    // The eye plane itself shows nothing.
    let before = nearest.z - 1e-3 * (widest + high.z - nearest.z);
    look(right * middle.x + up * middle.y + forward * before, f64::from(size[1]) / scale, size)
}

/// The view of a lamp on what receives its light, or six to all sides where that surrounds it.
fn lamp_views(lamp: DVec3, middle: DVec3, receivers: &[DVec3], most: u32) -> Result<Vec<Camera>, Error> {
    let look = |to: DVec3, fov_y: f64, size: [u32; 2]| {
        Camera::look_at(lamp, lamp + to, DVec3::Y, Projection::Perspective { fov_y }, size).map_err(Error::Light)
    };
    let forward = (middle - lamp).normalize_or_zero();
    if forward != DVec3::ZERO {
        let plain = look(forward, 1.0, [1, 1])?;
        let tangent = |p: DVec3| {
            if p.z > 0.0 { (p / p.z).abs() } else { DVec3::INFINITY }
        };
        let half = receivers.iter().map(|p| tangent(plain.view_from_world(*p))).fold(DVec3::ZERO, DVec3::max);
        let widest = half.x.max(half.y);
        if widest <= WIDEST {
            let focal = (0.5 * f64::from(most) - RIM) / widest.max(1e-3);
            let size = [half.x, half.y].map(|h| ((2.0 * (h * focal + RIM)).ceil() as u32).clamp(1, most));
            return Ok(vec![look(forward, 2.0 * libm::atan(0.5 * f64::from(size[1]) / focal), size)?]);
        }
    }
    let sides = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
    let size = [(most / 2).max(1); 2];
    sides.into_iter().map(|side| look(side, std::f64::consts::FRAC_PI_2, size)).collect()
}
