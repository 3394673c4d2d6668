//! Converts an object to its cloud.

use super::input::{Input, input, shown_field};
use super::object_context::{self, ObjectContext};
use super::own::{Body, Own};
use crate::Error;
use crate::scene::{SceneObject, Source};
use crate::statistics::{ObjectData, ObjectStatistics};
use convert::cost::{self, Prediction};
use convert::{
    CloudShape, ConvertError, DensityParams, MatterParams, MeshParams, SplatParams, SurfaceField, SurfelParams,
    VolumeParams,
};
use field::ZeroSearch;
use pbsr::BoundedExtinction;
use splat_core::{Cloud, Exceeded, Grid, Object, Reservation, Shading, TransferFunction};

/// Most operations of an expression on its way to splats: some minutes of two cores.
const MOST_OPERATIONS: f64 = 1e11;

/// The data of one object, and what its conversion would make.
pub(super) struct Prepared<'a> {
    pub(super) input: Input<'a>,
    pub(super) prediction: Prediction,
    /// Whether it is drawn in the colours of its points, without light.
    pub(super) as_it_is: bool,
    /// The refusal of a conversion that would make too many splats.
    pub(super) too_many: Option<ConvertError>,
    /// Extinction, where particles could be sampled from a field of it.
    pub(super) bounded: Option<BoundedExtinction>,
    /// Where a surface may lie, where particles could be sampled from it.
    pub(super) search: Option<ZeroSearch>,
    /// The field that it shows.
    pub(super) field: Option<SurfaceField>,
    /// Memory of what was made of files for it: a mesh that is cut, a volume of another spacing.
    pub(super) held: Option<Reservation>,
}

/// The object's row of the object table.
pub(super) fn entry(object: &SceneObject) -> Object {
    Object {
        name: object.name.clone(),
        casts_shadow: object.casts_shadow,
        shadow_coefficient: object.shadow_coefficient,
    }
}

/// Reads one object and counts its splats; `sampled` where it may be drawn from its own data.
pub(super) fn prepare<'a>(
    object: &'a SceneObject,
    context: &ObjectContext<'_>,
    sampled: bool,
) -> Result<Prepared<'a>, Error> {
    let mut input = input(object, context)?;
    check_work(object, &input)?;
    let as_it_is = match &mut input {
        Input::Points(_, points, SurfelParams { splat, .. }) | Input::Matter(_, points, MatterParams { splat, .. })
            if object.is_unlit(!points.color.is_empty()) =>
        {
            splat.material = context.scene.materials.len() as u16;
            true
        }
        _ => false,
    };
    let bounded = if sampled { input.bounded(context.extinction_factor(object)) } else { None };
    let search = match &input {
        Input::Surface(field, bounds, ..) if sampled => Some(ZeroSearch::new(field, *bounds)),
        _ => None,
    };
    let (prediction, too_many) = match predict(&input) {
        Err(ConvertError::Limit(e)) => {
            (Prediction { splats: e.needed, ..Prediction::default() }, Some(ConvertError::Limit(e)))
        }
        prediction => (prediction?, None),
    };
    let field = shown_field(object, context)?;
    Ok(Prepared { input, prediction, as_it_is, too_many, bounded, search, field, held: None })
}

/// Refuses an expression that would be worked at for many minutes before anything is drawn.
fn check_work(object: &SceneObject, input: &Input<'_>) -> Result<(), Error> {
    let operations = object.source.operations()?;
    let evaluations = match input {
        Input::Surface(field, bounds, params, _) if operations > 0 => {
            cost::surface_evaluations(field.as_ref(), *bounds, params)
        }
        Input::Density(_, bounds, params) => cost::density_evaluations(*bounds, params),
        _ => return Ok(()),
    };
    // A lattice of too many points has a refusal of its own.
    let Ok(evaluations) = evaluations else { return Ok(()) };
    let needed = evaluations * operations as f64;
    let what = format!("the expression of object '{}'", crate::escape_controls(&object.name));
    let hint = "use a larger spacing or a smaller resolution, a smaller box, or an expression with a bound";
    let unit = "operations before anything is drawn";
    Exceeded::check(what, needed as u64, MOST_OPERATIONS as u64, unit, hint).map_err(Error::Limit)
}

fn predict(input: &Input<'_>) -> Result<Prediction, ConvertError> {
    match input {
        Input::Mesh(_, mesh, params) => cost::mesh(mesh, params),
        Input::Points(_, points, params) => cost::raw_points(points, params),
        Input::Matter(_, points, params) => cost::raw_matter(points, params),
        Input::Volume(shown, transfer, params) => cost::volume(&shown.grid, transfer, params),
        Input::Surface(field, bounds, params, _) => cost::surface(field.as_ref(), *bounds, params),
        Input::Density(field, bounds, params) => cost::density(field.as_ref(), *bounds, params),
        Input::Procedural(shape, spacing, params) => cost::procedural(shape, *spacing, params),
        // Whether its splats fit is asked once it is known to become some.
        Input::Medium(medium, params, clip) => cost::medium(medium, clip, &object_context::of_lattice(params)),
        Input::Rectangle(r, opacity, params) => cost::rectangle(r, *opacity, params),
    }
}

impl Prepared<'_> {
    /// See [`crate::statistics::ObjectData::Surface`].
    fn looseness(&self) -> f64 {
        let (Some(search), Input::Surface(_, _, params, _)) = (&self.search, &self.input) else { return f64::INFINITY };
        let step = params.density.spacing() / params.splat.transform.scale;
        let area = self.prediction.splats as f64 / cost::ZERO_SET_EXCESS * step.powi(2);
        // A surface that touches its level without crossing it has no triangles: lines may find it.
        if area > 0.0 { search.area / area } else { 0.0 }
    }

    /// What the planner asks of the object.
    pub(super) fn statistics(&self, object: &SceneObject, context: &ObjectContext<'_>) -> ObjectStatistics {
        let material = &context.scene.materials[object.material].material;
        // Fields of measured data have tight bounds.
        let looseness =
            if matches!(object.source, Source::Implicit(_) | Source::Combined(_)) { self.looseness() } else { 0.0 };
        let share = self.field.as_ref().map_or(1.0, SurfaceField::least_share);
        let opaque = self.input.opacity().is_some_and(|opacity| opacity * share == 1.0);
        let extinct = material.extinction_rgb.iter().any(|e| *e > 0.0) || opaque;
        ObjectStatistics {
            name: object.name.clone(),
            data: match self.field {
                Some(_) if self.input.opacity() == Some(1.0) || self.input.is_uneven() => ObjectData::Points,
                _ => self.input.data(self.bounded.is_some(), looseness, context.scene.render.particles.surface_sampler),
            },
            opaque,
            by_gradient: self.input.by_gradient(),
            is_partly_opaque: self.input.is_partly_opaque(),
            is_plain: object.footprints.is_usual() && self.field.is_none(),
            volumes_by: context.scene.render.particles.volume_sampler,
            casts: object.casts_shadow && extinct,
            receives: !self.as_it_is && material.shading != Shading::Unlit && object.shadow_coefficient > 0.0,
        }
    }
}

/// Converts one object; a lattice that `native` has already is not made again.
pub(super) fn convert(
    prepared: &Prepared<'_>,
    native: Option<&Own>,
    context: &ObjectContext<'_>,
    warnings: &mut Vec<String>,
) -> Result<Cloud, Error> {
    if let Some(too_many) = &prepared.too_many {
        return Err(too_many.clone().into());
    }
    let progress = context.progress;
    let splat = context.limited(prepared.input.splat());
    let cloud = match &prepared.input {
        Input::Mesh(name, mesh, params) => {
            let params = MeshParams { splat, ..params.clone() };
            let made = match mesh.painting {
                Some(_) => convert::painted_mesh_to_points(mesh, mesh, &params, Some(progress)),
                None => convert::mesh_to_points(mesh, &params, Some(progress)),
            };
            made.inspect(|(_, report)| warnings.extend(report.said().map(|said| format!("{name}: {said}"))))
                .map(|c| c.0)
        }
        Input::Points(path, points, params) => {
            let made = convert::raw_to_surfels(points, &SurfelParams { splat, ..params.clone() }, Some(progress));
            let named = |said| format!("{}: {said} (--merge-duplicates)", crate::printable(path));
            made.inspect(|(_, report)| warnings.extend(report.said().map(named))).map(|c| c.0)
        }
        Input::Matter(path, points, params) => {
            let made = convert::raw_to_matter(points, &MatterParams { splat, ..params.clone() }, Some(progress));
            made.inspect(|(_, report)| context.files.note(path, report.said())).map(|c| c.0)
        }
        Input::Volume(shown, transfer, params) => {
            let params = VolumeParams { splat, ..params.clone() };
            convert::volume_to_points(&shown.grid, transfer, &params, Some(progress)).map(|c| c.0)
        }
        Input::Surface(field, bounds, params, _) => {
            let params = MeshParams { splat, ..params.clone() };
            convert::surface_to_points(field.as_ref(), *bounds, &params, Some(progress)).map(|c| c.0)
        }
        Input::Density(field, bounds, params) => {
            let params = DensityParams { volume: VolumeParams { splat, ..params.volume.clone() }, ..params.clone() };
            convert::density_to_points(field.as_ref(), *bounds, &params, Some(progress)).map(|c| c.0)
        }
        Input::Procedural(shape, spacing, params) => {
            let params = VolumeParams { splat, ..params.clone() };
            let convert = |grid: &Grid, transfer: &TransferFunction| {
                convert::volume_to_points(grid, transfer, &params, Some(progress)).map(|c| c.0)
            };
            match native.map(|o| &o.body) {
                Some(Body::Cells { grid, transfer, .. }) => convert(grid, transfer),
                _ => procedural(shape, *spacing, &params.splat, context).and_then(|(grid, tf)| convert(&grid, &tf)),
            }
        }
        Input::Medium(medium, _, clip) => convert::medium(medium, clip, &splat),
        Input::Rectangle(r, opacity, _) => convert::rectangle(r, *opacity, &splat),
    };
    let mut cloud = cloud?;
    let object = &context.scene.objects[context.id];
    if let (Some(field), Some(source)) = (&prepared.field, &object.field) {
        let said = field.show(&mut cloud, prepared.input.splat(), object.points.keeps_values);
        let said = said.map_err(|e| Error::input(crate::printable(&source.path), e.to_string(), ""))?;
        warnings.extend(said.map(|said| format!("object '{}': {said}", crate::shown(&object.name))));
    }
    Ok(cloud)
}

/// The extinction of a cloud on its lattice, and the transfer function that takes it as it is.
pub(super) fn procedural(
    shape: &CloudShape,
    spacing: f64,
    params: &SplatParams,
    context: &ObjectContext<'_>,
) -> Result<(Grid, TransferFunction), ConvertError> {
    let lattice = convert::procedural_cloud(shape, spacing, params, Some(context.progress))?;
    Ok((lattice, convert::extinction_as_it_is(shape.extinction, params)?))
}
