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

/// A world-space box around what may be translucent of each object, by its rank in the scene: empty for an opaque object, `None` for an invisible one and where
/// no box is known.
///
/// # Errors
/// [`Error::Input`] and [`Error::Io`] for a file that cannot be read.
pub(crate) fn boxes(scene: &Scene, context: Context<'_>) -> Result<Vec<Option<DAabb>>, Error> {
    let loading = Loading { scene, context };
    let mut boxes = vec![None; scene.objects.len()];
    for (rank, object) in loading.visible() {
        boxes[rank] = world_box(object, &loading.context(rank, 0, 0)).map_err(|e| loading.named(object, e))?;
    }
    Ok(boxes)
}

/// The box of one object.
fn world_box(object: &SceneObject, context: &ObjectContext<'_>) -> Result<Option<DAabb>, Error> {
    let around = |places: &mut dyn Iterator<Item = DVec3>| {
        Some(DAabb::of_points(places.map(|place| object.transform.apply(place))))
    };
    let around_box = |bounds: DAabb| around(&mut bounds.corners().into_iter());
    Ok(match &object.source {
        Source::Mesh(path) => match context.read(path)? {
            SourceData::Mesh(mesh) | SourceData::Painted(mesh, _) => {
                around(&mut mesh.position.iter().map(|place| place.as_dvec3()))
            }
            _ => None,
        },
        Source::Points(path) | Source::Matter(MatterSource { path, .. }) => match context.read(path)? {
            // Gaussians reach far beyond their centres.
            SourceData::Points(points) if points.gaussians.is_empty() => {
                let is_opaque = !object.source.is_medium() && are_opaque(&points, object, context.scene);
                let step = points.len().div_ceil(FEW).max(1);
                let places = points.position.iter().step_by(step).map(|place| points.origin + place.as_dvec3());
                if is_opaque { Some(DAabb::EMPTY) } else { around(&mut { places }) }
            }
            _ => None,
        },
        Source::Volume(VolumeSource { path, frame, transfer, .. }) => match context.read_frame(path, *frame)? {
            SourceData::Grid(grid) => {
                around(&mut visible_ends(&grid, transfer, object.transform.scale, &object.clip).into_iter())
            }
            _ => None,
        },
        Source::Implicit(implicit) => around_box(implicit.bounds),
        Source::Density(density) => around_box(density.bounds),
        Source::Cloud(cloud) => {
            let ellipsoids = cloud.shape().ellipsoids.into_iter();
            around(&mut ellipsoids.flat_map(|e| DAabb::around(e.center, e.radii).corners()))
        }
        Source::Medium(medium) => around_box(medium.body.bounds()),
        Source::Rectangle(rectangle) => {
            let half = rectangle.u.abs() + rectangle.v.abs();
            around_box(DAabb::new(rectangle.center - half, rectangle.center + half))
        }
        Source::Extract(_) | Source::Isosurface(_) | Source::LevelSet(_) | Source::Combined(_) | Source::Slice(_) => {
            None
        }
    })
}

/// Whether neither the points nor what the scene states about them leaves any light through.
fn are_opaque(points: &RawPoints, object: &SceneObject, scene: &Scene) -> bool {
    // Colours by a column may have opacities, and so may a field and materials by class.
    let is_plain = object.points.color_by.is_none() && object.field.is_none() && object.materials.is_empty();
    is_plain && scene.opacity_of(object) >= 1.0 && points.opacity.iter().all(|opacity| *opacity >= 1.0)
}
