//! One object → its cloud.

use crate::scene::{CloudSource, DensitySource, ImplicitSource, MediumShape, Scene, SceneObject, Source, VolumeSource};
use crate::{Error, RenderOptions};
use convert::read::{Loaded as FileData, ReadLimits};
use convert::{
    CloudShape, ConvertError, Density, DensityParams, Ellipsoid, ExpressionField, MeshParams, Orientation, SplatParams,
    SurfelParams, VolumeParams,
};
use glam::DVec3;
use splat_core::{Cloud, Object, Shading, TransferFunction, TransferPoint};
use std::path::Path;

/// Bytes that a splat takes from its conversion to the finished picture, at most.
const BYTES_PER_SPLAT: u64 = 256;

/// Largest spacing of raw points over their median: above it, leaves and wires would become petals.
const LARGEST_SPACING: f64 = 1.7;

/// What the conversion of an object reads beside it.
pub(super) struct Context<'a> {
    pub(super) scene: &'a Scene,
    pub(super) options: &'a RenderOptions,
    /// Rank of the object.
    pub(super) id: usize,
    /// Bytes that earlier objects take.
    pub(super) used: u64,
}

/// The object's row of the object table.
pub(super) fn entry(object: &SceneObject) -> Object {
    Object {
        name: object.name.clone(),
        casts_shadow: object.casts_shadow,
        shadow_coefficient: object.shadow_coefficient,
    }
}

/// Whether the gradients of the object's volume could change the picture: lit by Phong, or in a layer of normals.
pub(super) fn needs_gradients(object: &SceneObject, scene: &Scene) -> bool {
    let is_volume = matches!(object.source, Source::Volume(_) | Source::Density(_) | Source::Cloud(_));
    let lit = !scene.lights.is_empty() && scene.materials[object.material].material.shading == Shading::Phong;
    is_volume && (lit || scene.render.layers.set().normal)
}

/// Reads and converts one object.
pub(super) fn convert(object: &SceneObject, context: &Context<'_>, warnings: &mut Vec<String>) -> Result<Cloud, Error> {
    let params = context.splat_params(object);
    let cloud = match &object.source {
        Source::Mesh(path) => mesh(path, object, context, params, warnings),
        Source::Points(path) => raw_points(path, object, context, params, warnings),
        Source::Volume(volume) => grid(volume, context, params),
        Source::Implicit(implicit) => surface(implicit, object, context, params),
        Source::Density(density) => medium_of_expression(density, object, context, params),
        Source::Cloud(cloud) => procedural(cloud, context, params),
        Source::Medium(shape) => medium(shape, &params),
        Source::Rectangle(r) => {
            convert::rectangle(r.center, r.u, r.v, context.opacity(object), r.spacing, &params).map_err(|e| refuse(&e))
        }
    }?;
    if cloud.is_empty() {
        warnings.push(format!("object '{}' has no splats", crate::escape_controls(&object.name)));
    }
    Ok(cloud)
}

fn mesh(
    path: &Path,
    object: &SceneObject,
    context: &Context<'_>,
    splat: SplatParams,
    warnings: &mut Vec<String>,
) -> Result<Cloud, Error> {
    let FileData::Mesh(mesh) = context.read(path)? else {
        return Err(wrong_kind(path, "a mesh with faces", "use `points = ` or `volume = ` for this file"));
    };
    let density = object.spacing.map_or(Density::Auto, Density::Spacing);
    let params = MeshParams { splat, density, opacity: context.opacity(object) };
    let (cloud, report) = convert::mesh_to_points(&mesh, &params).map_err(|e| refuse(&e))?;
    if report.degenerate > 0 {
        warnings.push(format!("{}: {} faces have no area", crate::printable(path), report.degenerate));
    }
    Ok(cloud)
}

fn raw_points(
    path: &Path,
    object: &SceneObject,
    context: &Context<'_>,
    splat: SplatParams,
    warnings: &mut Vec<String>,
) -> Result<Cloud, Error> {
    let FileData::Points(points) = context.read(path)? else {
        return Err(wrong_kind(path, "points without faces", "use `mesh = ` or `volume = ` for this file"));
    };
    // The side that faces the sky.
    let up = splat.transform.rotation.inverse() * DVec3::Y;
    let params = SurfelParams {
        splat,
        orientation: Orientation::Toward(up),
        opacity: context.opacity(object),
        largest_spacing: LARGEST_SPACING,
        merge_duplicates: object.merge_duplicates || context.options.merge_duplicates,
        ..SurfelParams::default()
    };
    let (cloud, report) = convert::raw_to_surfels(&points, &params).map_err(|e| refuse(&e))?;
    if report.duplicates > 0 && !params.merge_duplicates {
        let n = report.duplicates;
        warnings
            .push(format!("{}: {n} points lie where another one lies (--merge-duplicates)", crate::printable(path)));
    }
    Ok(cloud)
}

fn grid(source: &VolumeSource, context: &Context<'_>, splat: SplatParams) -> Result<Cloud, Error> {
    let FileData::Grid(grid) = context.read(&source.path)? else {
        return Err(wrong_kind(&source.path, "a volume", "use `mesh = ` or `points = ` for this file"));
    };
    let params = context.volume_params(splat);
    let (cloud, _) = convert::volume_to_points(&grid, &source.transfer, &params).map_err(|e| refuse(&e))?;
    Ok(cloud)
}

pub(crate) fn wrong_kind(path: &Path, expected: &str, hint: &str) -> Error {
    Error::input(crate::printable(path), format!("expected {expected}"), hint)
}

fn surface(
    implicit: &ImplicitSource,
    object: &SceneObject,
    context: &Context<'_>,
    splat: SplatParams,
) -> Result<Cloud, Error> {
    let field = expression(&implicit.expression, object)?;
    let spacing = implicit.spacing * splat.transform.scale;
    let density = Density::Spacing(object.spacing.unwrap_or(spacing));
    let params = MeshParams { splat, density, opacity: context.opacity(object) };
    let (cloud, _) = convert::surface_to_points(&field, implicit.bounds, &params).map_err(|e| refuse(&e))?;
    Ok(cloud)
}

fn medium_of_expression(
    source: &DensitySource,
    object: &SceneObject,
    context: &Context<'_>,
    splat: SplatParams,
) -> Result<Cloud, Error> {
    let field = expression(&source.expression, object)?;
    let spacing = source.spacing * splat.transform.scale;
    let params = DensityParams {
        density: Density::Spacing(spacing),
        extinction: source.extinction,
        volume: context.volume_params(splat),
    };
    let (cloud, _) = convert::density_to_points(&field, source.bounds, &params).map_err(|e| refuse(&e))?;
    Ok(cloud)
}

pub(crate) fn expression(text: &str, object: &SceneObject) -> Result<ExpressionField, Error> {
    ExpressionField::parse(text).map_err(|e| {
        let what = format!("object '{}', expression", crate::escape_controls(&object.name));
        Error::input(what, e.to_string(), "variables are x, y and z")
    })
}

/// The cloud that a scene describes.
pub(crate) fn cloud_shape(source: &CloudSource) -> CloudShape {
    CloudShape {
        ellipsoids: source.ellipsoids.iter().map(|&(center, radii)| Ellipsoid { center, radii }).collect(),
        octaves: source.octaves,
        frequency: source.frequency,
        amplitude: source.amplitude,
        seed: source.seed,
        extinction: source.extinction,
        base: None,
        ..CloudShape::default()
    }
}

fn procedural(source: &CloudSource, context: &Context<'_>, splat: SplatParams) -> Result<Cloud, Error> {
    let lattice = convert::procedural_cloud(&cloud_shape(source), source.spacing, &splat).map_err(|e| refuse(&e))?;
    let point = |value: f32| TransferPoint { value, color: splat.color, extinction: value };
    let mut points = vec![point(0.0)];
    if source.extinction > 0.0 {
        points.push(point(source.extinction as f32));
    }
    let transfer = TransferFunction::new(points).map_err(|e| Error::Internal(e.to_string()))?;
    let (cloud, _) =
        convert::volume_to_points(&lattice, &transfer, &context.volume_params(splat)).map_err(|e| refuse(&e))?;
    Ok(cloud)
}

fn medium(shape: &MediumShape, params: &SplatParams) -> Result<Cloud, Error> {
    match *shape {
        MediumShape::Box { min, max, extinction, spacing } => {
            convert::medium_box(min, max, extinction, spacing, params)
        }
        MediumShape::Ball { center, radius, extinction, spacing } => {
            convert::medium_ball(center, radius, extinction, spacing, params)
        }
    }
    .map_err(|e| refuse(&e))
}

impl Context<'_> {
    fn splat_params(&self, object: &SceneObject) -> SplatParams {
        let material = &self.scene.materials[object.material];
        let fits = self.options.max_memory.saturating_sub(self.used) / BYTES_PER_SPLAT;
        let asked = self.scene.render.max_points.unwrap_or(u64::MAX);
        SplatParams {
            object_name: object.name.clone(),
            object: self.id as u32,
            material: object.material as u16,
            footprint: object.footprint,
            profile: self.scene.footprints.layers()[object.footprint as usize],
            transform: object.transform,
            color: object.color.unwrap_or(material.color),
            max_splats: fits.min(asked).min(u64::from(u32::MAX)),
        }
    }

    fn read(&self, path: &Path) -> Result<FileData, Error> {
        let limits = ReadLimits { max_bytes: self.options.max_memory, drop_invalid: self.options.drop_invalid };
        convert::read::file(path, &limits).map_err(|e| Error::from_read(path, &e))
    }

    /// Parameters of a volume: normals only where they are used.
    fn volume_params(&self, splat: SplatParams) -> VolumeParams {
        let normals = needs_gradients(&self.scene.objects[self.id], self.scene);
        VolumeParams { splat, normals, ..VolumeParams::default() }
    }

    /// Opacity of one crossing of the object's surfaces.
    fn opacity(&self, object: &SceneObject) -> f64 {
        object.opacity.unwrap_or(self.scene.materials[object.material].opacity)
    }
}

pub(crate) fn refuse(error: &ConvertError) -> Error {
    match error {
        ConvertError::TooMany { object, what, needed, limit } => Error::Limit {
            what: format!("object '{}'", crate::escape_controls(object)),
            needed: *needed as u64,
            limit: *limit,
            unit: what,
            hint: "use a larger spacing, or a larger --max-memory or render.max_points".into(),
        },
        other => Error::input("scene", other.to_string(), ""),
    }
}
