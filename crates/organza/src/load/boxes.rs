//! Boxes around what is translucent, known before anything is converted.

use super::context::Context;
use super::loading::Loading;
use super::object_context::ObjectContext;
use crate::Error;
use crate::scene::{MatterSource, Scene, SceneObject, Source, SourceData, VolumeSource};
use field::visible_ends;
use glam::DVec3;
use splat_core::{DAabb, RawPoints};

/// Points that are looked at, of more every nth.
const FEW: usize = 1 << 16;

/// A world-space box around what may be translucent of each object, by its rank in the scene, empty where nothing is; `None` for an invisible object, and where
/// no box is known.
///
/// # Errors
/// Those of reading their files.
pub(crate) fn boxes(scene: &Scene, context: Context<'_>) -> Result<Vec<Option<DAabb>>, Error> {
    let loading = Loading { scene, context };
    let mut boxes = vec![None; scene.objects.len()];
    for (rank, object) in loading.visible() {
        let places = places(object, &loading.context(rank, 0, 0)).map_err(|e| loading.named(object, e))?;
        let world =
            |places: Vec<DVec3>| DAabb::of_points(places.into_iter().map(|place| object.transform.apply(place)));
        boxes[rank] = places.map(world);
    }
    Ok(boxes)
}

/// Places around what may be translucent of an object, before its transform: none for an opaque one, `None` where no place is known.
fn places(object: &SceneObject, context: &ObjectContext<'_>) -> Result<Option<Vec<DVec3>>, Error> {
    let corners = |bounds: DAabb| bounds.corners().to_vec();
    Ok(match &object.source {
        Source::Mesh(path) => match context.read(path)? {
            SourceData::Mesh(mesh) | SourceData::Painted(mesh, _) => {
                Some(mesh.position.iter().map(|place| place.as_dvec3()).collect())
            }
            _ => None,
        },
        Source::Points(path) | Source::Matter(MatterSource { path, .. }) => match context.read(path)? {
            SourceData::Points(points) => places_of_points(&points, object, context.scene),
            _ => None,
        },
        Source::Volume(VolumeSource { path, frame, transfer }) => match context.read_frame(path, *frame)? {
            SourceData::Grid(grid) => Some(visible_ends(&grid, transfer, object.transform.scale, &object.clip)),
            _ => None,
        },
        Source::Implicit(implicit) => Some(corners(implicit.bounds)),
        Source::Density(density) => Some(corners(density.bounds)),
        Source::Cloud(cloud) => {
            let ellipsoids = cloud.shape().ellipsoids.into_iter();
            Some(ellipsoids.flat_map(|e| DAabb::around(e.center, e.radii).corners()).collect())
        }
        Source::Medium(medium) => Some(corners(medium.body.bounds())),
        Source::Rectangle(rectangle) => {
            let half = rectangle.u.abs() + rectangle.v.abs();
            Some(corners(DAabb::new(rectangle.center - half, rectangle.center + half)))
        }
        Source::Extract(_) | Source::Isosurface(_) | Source::LevelSet(_) | Source::Combined(_) | Source::Slice(_) => {
            None
        }
    })
}

/// Every nth point; none of opaque ones.
fn places_of_points(points: &RawPoints, object: &SceneObject, scene: &Scene) -> Option<Vec<DVec3>> {
    if !points.gaussians.is_empty() {
        // Gaussians reach far beyond their centres.
        return None;
    }
    if !object.source.is_medium() && are_opaque(points, object, scene) {
        return Some(Vec::new());
    }
    let step = points.len().div_ceil(FEW).max(1);
    Some(points.position.iter().step_by(step).map(|place| points.origin + place.as_dvec3()).collect())
}

/// Whether neither the points nor what the scene states about them leaves any light through.
fn are_opaque(points: &RawPoints, object: &SceneObject, scene: &Scene) -> bool {
    // Colours by a column may have opacities, and so may a field and materials by class.
    let is_plain = object.points.color_by.is_none() && object.field.is_none() && object.materials.is_empty();
    is_plain && scene.opacity_of(object) >= 1.0 && points.opacity.iter().all(|opacity| *opacity >= 1.0)
}
