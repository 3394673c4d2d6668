//! Where half vectors cannot serve: rays that run along the slabs, or cross them backwards, and lamps inside the medium.

use super::axis::HalfVector;
use super::bodies::Bodies;
use crate::Volume;
use crate::half_vector::sampled_light::SampledLight;
use crate::shared::reason::{LEAST_COSINE, MOST_DEPTH, Reason};
use splat_core::glam::DVec3;
use splat_core::{Camera, Light, LightShape};

/// Whether the half vector of this light and this view can slice what there is: whether every ray of the light to a volume or to the
/// bounds of the splats, and every view ray that may meet one, crosses slabs in one sense, no flatter than [`LEAST_COSINE`] says. True
/// without any.
///
/// Directions from one point to a convex body, and those of an image, are convex cones, and so are those within an angle of the
/// normal: corners decide for all.
///
/// # Errors
/// The first [`Reason`] that was found.
pub fn serves(bodies: &Bodies<'_>, camera: &Camera, light: &Light) -> Result<(), Reason> {
    if bodies.is_empty() {
        return Ok(());
    }
    if light.shape.is_extended() {
        return Err(Reason::Extended);
    }
    serves_across(bodies, camera, SampledLight { light, samples: 1 }, &axis_of(bodies, camera, light))
}

/// Whether the half vector of the centre of a light with an extent can slice the volumes for all of its points, so that one sweep
/// carries its light. As [`serves`] for one without an extent.
///
/// # Errors
/// The first [`Reason`] that was found.
pub fn serves_extended(bodies: &Bodies<'_>, camera: &Camera, light: &Light, samples: u32) -> Result<(), Reason> {
    if bodies.is_empty() {
        return Ok(());
    }
    serves_across(bodies, camera, SampledLight { light, samples }, &axis_of(bodies, camera, light))
}

/// Whether slabs across an axis serve a light, and so many points of one that has an extent.
fn serves_across(
    bodies: &Bodies<'_>,
    camera: &Camera,
    sampled: SampledLight<'_>,
    axis: &HalfVector,
) -> Result<(), Reason> {
    let light = sampled.light;
    light_serves(bodies, light, axis)?;
    if !light.shape.is_extended() {
        return view_serves(bodies, camera, axis);
    }
    let points = sampled.points(light.intensity);
    points.iter().try_for_each(|point| light_serves(bodies, point, axis))?;
    let from_center = |p: DVec3| light.shape.place().map_or(0.0, |center| axis.normal.dot(p - center));
    let near = bodies.corners().map(from_center).fold(f64::INFINITY, f64::min);
    let depth = points.iter().filter_map(|p| p.shape.place()).map(|p| from_center(p).abs()).fold(0.0, f64::max);
    if depth > MOST_DEPTH * near {
        return Err(Reason::TooLarge { share: depth / near });
    }
    view_serves(bodies, camera, axis)
}

/// How wide the penumbra of a light is at the middle of the volumes over the distance to what casts it, far from the light: 2R/d, R the
/// radius or the longer half-axis. 0 for a light without an extent, and without volumes.
pub fn penumbra_widening(bodies: &Bodies<'_>, light: &Light) -> f64 {
    let radius = match light.shape {
        LightShape::Sphere { radius, .. } | LightShape::Disk { radius, .. } => radius,
        LightShape::Rect { u, v, .. } => u.length().max(v.length()),
        _ => return 0.0,
    };
    match light.shape.place() {
        Some(place) if !bodies.is_empty() => 2.0 * radius / (bodies.middle() - place).length(),
        _ => 0.0,
    }
}

/// Whether the light of a point, or of the centre of a light, meets slabs well.
fn light_serves(bodies: &Bodies<'_>, light: &Light, axis: &HalfVector) -> Result<(), Reason> {
    if let Some(position) = light.shape.place() {
        if let Some(volume) = bodies.volumes.iter().position(|v| is_inside(v, position)) {
            return Err(Reason::LampInside { volume, position });
        }
        if bodies.splats.is_some_and(|splats| splats.bounds.contains(position)) {
            return Err(Reason::LampAmong { position });
        }
    }
    // The light's image has an axis of its own, to the middle of all.
    let forward = travel(light, bodies.middle());
    let of_light = |p: DVec3| [axis.normal, forward].map(|axis| axis.dot(travel(light, p)));
    let cosine = least(bodies.corners().flat_map(of_light));
    if cosine < LEAST_COSINE { Err(Reason::LightAlongSlabs { cosine }) } else { Ok(()) }
}

/// Whether view rays do.
fn view_serves(bodies: &Bodies<'_>, camera: &Camera, axis: &HalfVector) -> Result<(), Reason> {
    let sense = if axis.back_to_front { -axis.normal } else { axis.normal };
    let cosine = least_of_view(bodies, camera, sense);
    if cosine < LEAST_COSINE { Err(Reason::ViewAlongSlabs { cosine }) } else { Ok(()) }
}

/// The half vector at the middle of the bodies, of which there is at least one.
fn axis_of(bodies: &Bodies<'_>, camera: &Camera, light: &Light) -> HalfVector {
    let middle = bodies.middle();
    HalfVector::between(-seen_along(camera, middle), -travel(light, middle))
}

/// The half vector of a light, or the view's own axis without one.
pub(crate) fn axis_of_view(bodies: &Bodies<'_>, camera: &Camera, light: Option<&Light>) -> HalfVector {
    match light {
        Some(light) => axis_of(bodies, camera, light),
        None => HalfVector { normal: seen_along(camera, bodies.middle()), back_to_front: false },
    }
}

/// Cosine of view and light below which both axes, that of light ahead of the eye and that of light before it, have a part.
const TURNING: f64 = 0.02;

/// Where view and light are nearly at right angles, and the half vector is about to turn over: the axis that comes then, and its share in the picture, at most
/// a half; `None` where it cannot serve.
pub(crate) fn other_axis(bodies: &Bodies<'_>, camera: &Camera, sampled: SampledLight<'_>) -> Option<(HalfVector, f32)> {
    let light = sampled.light;
    let middle = bodies.middle();
    let to_eye = -seen_along(camera, middle);
    let to_light = -travel(light, middle);
    let cosine = to_eye.dot(to_light);
    let axis = HalfVector::beyond(to_eye, to_light);
    let serves = cosine.abs() < TURNING && serves_across(bodies, camera, sampled, &axis).is_ok();
    serves.then(|| (axis, (0.5 * (1.0 - cosine.abs() / TURNING)) as f32))
}

/// Unit direction of travel of light that arrives at `p`; zero at the lamp itself.
pub(crate) fn travel(light: &Light, p: DVec3) -> DVec3 {
    match (light.shape, light.shape.place()) {
        (LightShape::Directional { direction }, _) => direction.normalize_or_zero(),
        (_, Some(place)) => (p - place).normalize_or_zero(),
        _ => DVec3::ZERO,
    }
}

fn least(cosines: impl Iterator<Item = f64>) -> f64 {
    // What is no number serves nobody.
    cosines.fold(1.0, |least, c| if c >= least { least } else { c })
}

fn is_inside(volume: &Volume<'_>, p: DVec3) -> bool {
    let place = volume.axes().inverse() * (p - volume.origin());
    let [lowest, highest] = volume.ends();
    place.cmpge(lowest).all() && place.cmple(highest).all()
}

fn world(camera: &Camera, v: DVec3) -> DVec3 {
    camera.axes[0] * v.x + camera.axes[1] * v.y + camera.axes[2] * v.z
}

/// Unit direction of the view ray to `p`, or to the place of the picture that is nearest to it.
fn seen_along(camera: &Camera, p: DVec3) -> DVec3 {
    let view = camera.view_from_world(p);
    if camera.is_orthographic() || view.z <= 0.0 {
        return camera.axes[2];
    }
    let focal = camera.focal_px();
    let [width, height] = camera.size.map(|s| 0.5 * f64::from(s) / focal);
    let clamped = DVec3::new((view.x / view.z).clamp(-width, width), (view.y / view.z).clamp(-height, height), 1.0);
    world(camera, clamped).normalize()
}

/// The least cosine of what is in the picture and in a body: no less than that of either.
fn least_of_view(bodies: &Bodies<'_>, camera: &Camera, normal: DVec3) -> f64 {
    let [width, height] = camera.size.map(f64::from);
    let corners = [[0.0, 0.0], [width, 0.0], [0.0, height], [width, height]];
    let cosine = |direction: DVec3| normal.dot(direction.normalize_or_zero());
    let picture = least(corners.into_iter().map(|[x, y]| cosine(world(camera, camera.view_ray(x, y).1))));
    if camera.is_orthographic() {
        return picture;
    }
    let bodies = least(bodies.corners().map(|p| cosine(p - camera.position)));
    picture.max(bodies)
}
