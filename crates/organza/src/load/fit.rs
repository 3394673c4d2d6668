//! Places the camera that sees all of a scene, after the data is read and before it is converted.

use super::context::Context;
use super::input::Input;
use super::loading::Loading;
use crate::Error;
use crate::scene::{FoundCamera, Scene};
use convert::{ConvertError, DiscSize, Outline, SurfelParams, raw_to_matter, raw_to_surfels};
use field::{surface_ends, visible_ends};
use splat_core::glam::{DVec2, Vec3};
use splat_core::{Camera, Cloud, DAabb, RawPoints, Similarity};
use std::borrow::Cow;

/// Most points of an object whose splats are looked at: of more each is a pixel or two.
const FEW: usize = 10_000;

/// The scene with a camera that sees all visible objects, where it leaves the camera's place to the data, and that camera.
pub(crate) fn placed<'s>(
    scene: Cow<'s, Scene>,
    context: Context<'_>,
) -> Result<(Cow<'s, Scene>, Option<FoundCamera>), Error> {
    let Some(fit) = scene.fit else { return Ok((scene, None)) };
    let inputs = Loading { scene: &scene, context }.inputs()?;
    let outlines: Vec<_> = inputs.iter().map(outline).collect();
    let found = fit.camera(&scene.camera, &|add| outlines.iter().for_each(|(outline, to)| outline.each(to, add)));
    let Some(found) = found else {
        let nothing = "`camera`: there is nothing to see for a camera that is placed by itself";
        let is_empty = |input: &&Input<'_>| match input {
            Input::Points(_, points, _) | Input::Matter(_, points, _) => points.is_empty(),
            _ => false,
        };
        let empty = inputs.iter().find(is_empty).map(|input| crate::shown(&input.splat().object_name));
        let (message, hint) = match empty {
            Some(name) => (
                format!("{nothing}: object '{name}' is left without points"),
                "widen its `keep` (`organza info` lists the ranges of its columns), or give the camera a position",
            ),
            None => (nothing.to_owned(), "add a visible object, or give the camera a position"),
        };
        return Err(Error::input(crate::printable(&scene.file), message, hint));
    };
    for input in &inputs {
        if let Input::Points(path, points, _) | Input::Matter(path, points, _) = input {
            context.files.warn(path, crowded(points, &input.splat().transform, &found.camera));
        }
    }
    let scene = Scene { camera: found.camera, target: found.target, fit: None, ..Scene::clone(&scene) };
    Ok((Cow::Owned(scene), Some(found)))
}

/// A sentence about points of which nearly all are drawn within one pixel, because a few lie far out.
fn crowded(points: &RawPoints, to_world: &Similarity, camera: &Camera) -> Option<String> {
    /// One of so many is left out at each end of a column of pixels, and of a row.
    const FEW_OF: usize = 100;
    if points.len() < FEW_OF || !points.gaussians.is_empty() {
        return None;
    }
    let pixel = |p: &Vec3| {
        let place = camera.view_from_world(to_world.apply(points.origin + p.as_dvec3()));
        let depth = if camera.is_orthographic() { 1.0 } else { place.z };
        place.truncate() * (camera.focal_px() / depth)
    };
    let pixels: Vec<DVec2> = points.position.iter().map(pixel).collect();
    let few = points.len() / FEW_OF;
    let is_narrow = |mut places: Vec<f64>| {
        let last = places.len() - 1;
        let low = *places.select_nth_unstable_by(few, f64::total_cmp).1;
        let high = *places.select_nth_unstable_by(last - few, f64::total_cmp).1;
        high - low < 1.0
    };
    let low = pixels.iter().fold(DVec2::INFINITY, |low, pixel| low.min(*pixel));
    let high = pixels.iter().fold(DVec2::NEG_INFINITY, |high, pixel| high.max(*pixel));
    let is_crowded = (high - low).max_element() >= 2.0
        && is_narrow(pixels.iter().map(|pixel| pixel.x).collect())
        && is_narrow(pixels.iter().map(|pixel| pixel.y).collect());
    is_crowded.then(|| {
        "nearly all of its points lie within one pixel, because the camera sees a few that lie far out: `clip` leaves those out, or give the \
         camera a position"
            .to_owned()
    })
}

/// Points around what is seen of an object, and what leads them to the world.
fn outline<'i>(input: &'i Input<'i>) -> (Outline<'i>, Similarity) {
    let outline = match input {
        Input::Mesh(_, mesh, _) => Outline::Mesh(mesh),
        // A size in pixels waits for the camera.
        Input::Points(_, points, SurfelParams { size: Some(DiscSize::Pixels(_)), .. }) => Outline::of_points(points),
        Input::Points(_, points, params) => {
            return of_points(input, points, || raw_to_surfels(points, params, None).map(|(cloud, _)| cloud));
        }
        Input::Matter(_, points, params) => {
            return of_points(input, points, || raw_to_matter(points, params, None).map(|(cloud, _)| cloud));
        }
        Input::Volume(shown, transfer, params) => {
            Outline::Places(visible_ends(&shown.grid, transfer, params.splat.transform.scale, &params.clip))
        }
        Input::Surface(_, bounds, _, isosurface) => {
            let ends = isosurface.as_ref().map_or_else(Vec::new, |it| surface_ends(&it.grid, f64::from(it.level)));
            if ends.is_empty() { Outline::of_boxes([*bounds]) } else { Outline::Places(ends) }
        }
        Input::Density(_, bounds, _) => Outline::of_boxes([*bounds]),
        Input::Procedural(shape, ..) => {
            Outline::of_boxes(shape.ellipsoids.iter().map(|e| DAabb::around(e.center, e.radii)))
        }
        Input::Medium(medium, ..) => Outline::of_boxes([medium.body.bounds()]),
        Input::Rectangle(r, ..) => {
            let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
            Outline::Places(corners.map(|(s, t)| r.center + r.u * s + r.v * t).to_vec())
        }
    };
    (outline, input.splat().transform)
}

/// Of a few points what they become, which lies in the world already.
fn of_points<'i>(
    input: &Input<'_>,
    points: &'i RawPoints,
    converted: impl FnOnce() -> Result<Cloud, ConvertError>,
) -> (Outline<'i>, Similarity) {
    let is_few = points.len() <= FEW && points.gaussians.is_empty();
    // What cannot be converted is refused where everything is.
    match is_few.then(converted) {
        Some(Ok(cloud)) => (Outline::of_splats(&cloud), Similarity::default()),
        _ => (Outline::of_points(points), input.splat().transform),
    }
}
