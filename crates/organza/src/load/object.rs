//! One object → its cloud.

use crate::scene::{
    CloudSource, DensitySource, ImplicitSource, MediumShape, RectangleSource, Scene, SceneObject, Source, VolumeSource,
};
use crate::{Error, RenderOptions};
use convert::cost::{self, Prediction};
use convert::read::{Loaded as FileData, ReadLimits};
use convert::{
    CloudShape, ConvertError, Density, DensityParams, Ellipsoid, ExpressionField, MeshParams, Orientation, RawPoints,
    SplatParams, SurfelParams, VolumeParams,
};
use glam::DVec3;
use splat_core::{Cloud, Grid, Mesh, Object, Progress, Shading, TransferFunction, TransferPoint};
use std::path::Path;

/// Bytes that a splat takes from its conversion to the finished picture, at most.
pub(super) const BYTES_PER_SPLAT: u64 = 256;

/// Largest spacing of raw points over their median: above it, leaves and wires would become petals.
const LARGEST_SPACING: f64 = 1.7;

/// What the conversion of an object reads beside it.
pub(super) struct Context<'a> {
    pub(super) scene: &'a Scene,
    pub(super) options: &'a RenderOptions,
    pub(super) progress: &'a Progress,
    /// Rank of the object.
    pub(super) id: usize,
    /// Bytes and splats that earlier objects take.
    pub(super) used: u64,
    pub(super) made: u64,
}

/// The input of one object with the parameters of its conversion, and what that will make.
pub(super) struct Prepared<'a> {
    input: Input<'a>,
    pub(super) prediction: Prediction,
}

enum Input<'a> {
    Mesh(&'a Path, Mesh, MeshParams),
    Points(&'a Path, RawPoints, SurfelParams),
    Volume(Grid, &'a TransferFunction, VolumeParams),
    Implicit(ExpressionField, [DVec3; 2], MeshParams),
    Density(ExpressionField, [DVec3; 2], DensityParams),
    Procedural(CloudShape, f64, VolumeParams),
    Medium(MediumShape, SplatParams),
    Rectangle(RectangleSource, f64, SplatParams),
}

impl Prepared<'_> {
    /// Bytes that the input holds.
    pub(super) fn bytes(&self) -> u64 {
        let bytes = match &self.input {
            Input::Mesh(_, mesh, _) => {
                size_of_val(mesh.position.as_slice())
                    + size_of_val(mesh.normal.as_slice())
                    + size_of_val(mesh.color.as_slice())
                    + size_of_val(mesh.triangles.as_slice())
            }
            // Position, normal, colour, value, class and integers at most.
            Input::Points(_, points, _) => 64 * points.len(),
            Input::Volume(grid, ..) => size_of_val(grid.values.as_slice()),
            _ => 0,
        };
        bytes as u64
    }
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

/// Reads one object and counts its splats.
pub(super) fn prepare<'a>(object: &'a SceneObject, context: &Context<'_>) -> Result<Prepared<'a>, Error> {
    let input = input(object, context)?;
    let prediction = match &input {
        Input::Mesh(_, mesh, params) => cost::mesh(mesh, params),
        Input::Points(_, points, params) => cost::raw_points(points, params),
        Input::Volume(grid, transfer, params) => cost::volume(grid, transfer, params),
        Input::Implicit(field, bounds, params) => cost::surface(field, *bounds, params),
        Input::Density(field, bounds, params) => cost::density(field, *bounds, params),
        Input::Procedural(shape, spacing, params) => cost::procedural(shape, *spacing, params),
        Input::Medium(MediumShape::Box { min, max, extinction, spacing }, params) => {
            cost::medium_box(*min, *max, *extinction, *spacing, params)
        }
        Input::Medium(MediumShape::Ball { center, radius, extinction, spacing }, params) => {
            cost::medium_ball(*center, *radius, *extinction, *spacing, params)
        }
        Input::Rectangle(r, _, params) => cost::rectangle(r.u, r.v, r.spacing, params),
    };
    Ok(Prepared { input, prediction: prediction.map_err(|e| refuse(&e))? })
}

fn input<'a>(object: &'a SceneObject, context: &Context<'_>) -> Result<Input<'a>, Error> {
    let splat = context.splat_params(object);
    let opacity = context.opacity(object);
    Ok(match &object.source {
        Source::Mesh(path) => {
            let density = object.spacing.map_or(Density::Auto, Density::Spacing);
            Input::Mesh(path, read_mesh(path, context)?, MeshParams { splat, density, opacity })
        }
        Source::Points(path) => Input::Points(path, read_points(path, context)?, context.surfel_params(object, splat)),
        Source::Volume(VolumeSource { path, transfer }) => {
            Input::Volume(read_grid(path, context)?, transfer, context.volume_params(splat))
        }
        Source::Implicit(ImplicitSource { expression, bounds, spacing }) => {
            let spacing = object.spacing.unwrap_or(spacing * splat.transform.scale);
            let params = MeshParams { splat, density: Density::Spacing(spacing), opacity };
            Input::Implicit(field(expression, object)?, *bounds, params)
        }
        Source::Density(DensitySource { expression, bounds, spacing, extinction }) => {
            let params = DensityParams {
                density: Density::Spacing(spacing * splat.transform.scale),
                extinction: *extinction,
                volume: context.volume_params(splat),
            };
            Input::Density(field(expression, object)?, *bounds, params)
        }
        Source::Cloud(cloud) => Input::Procedural(cloud_shape(cloud), cloud.spacing, context.volume_params(splat)),
        Source::Medium(shape) => Input::Medium(*shape, splat),
        Source::Rectangle(r) => Input::Rectangle(*r, opacity, splat),
    })
}

/// Converts one object.
pub(super) fn convert(
    prepared: Prepared<'_>,
    object: &SceneObject,
    context: &Context<'_>,
    warnings: &mut Vec<String>,
) -> Result<Cloud, Error> {
    let cloud = match prepared.input {
        Input::Mesh(path, mesh, mut params) => {
            context.limit(&mut params.splat);
            mesh_splats(path, &mesh, &params, context, warnings)
        }
        Input::Points(path, points, mut params) => {
            context.limit(&mut params.splat);
            surfels(path, &points, &params, context, warnings)
        }
        Input::Volume(grid, transfer, mut params) => {
            context.limit(&mut params.splat);
            convert::volume_to_points_with_progress(&grid, transfer, &params, context.progress).map(|c| c.0)
        }
        Input::Implicit(field, bounds, mut params) => {
            context.limit(&mut params.splat);
            convert::surface_to_points_with_progress(&field, bounds, &params, context.progress).map(|c| c.0)
        }
        Input::Density(field, bounds, mut params) => {
            context.limit(&mut params.volume.splat);
            convert::density_to_points_with_progress(&field, bounds, &params, context.progress).map(|c| c.0)
        }
        Input::Procedural(shape, spacing, mut params) => {
            context.limit(&mut params.splat);
            procedural(&shape, spacing, &params, context)
        }
        Input::Medium(shape, mut params) => {
            context.limit(&mut params);
            medium(&shape, &params)
        }
        Input::Rectangle(r, opacity, mut params) => {
            context.limit(&mut params);
            convert::rectangle(r.center, r.u, r.v, opacity, r.spacing, &params)
        }
    }
    .map_err(|e| refuse(&e))?;
    if cloud.is_empty() {
        warnings.push(format!("object '{}' has no splats", crate::escape_controls(&object.name)));
    }
    Ok(cloud)
}

fn read_mesh(path: &Path, context: &Context<'_>) -> Result<Mesh, Error> {
    match context.read(path)? {
        FileData::Mesh(mesh) => Ok(mesh),
        _ => Err(wrong_kind(path, "a mesh with faces", "use `points = ` or `volume = ` for this file")),
    }
}

fn read_points(path: &Path, context: &Context<'_>) -> Result<RawPoints, Error> {
    match context.read(path)? {
        FileData::Points(points) => Ok(points),
        _ => Err(wrong_kind(path, "points without faces", "use `mesh = ` or `volume = ` for this file")),
    }
}

fn read_grid(path: &Path, context: &Context<'_>) -> Result<Grid, Error> {
    match context.read(path)? {
        FileData::Grid(grid) => Ok(grid),
        _ => Err(wrong_kind(path, "a volume", "use `mesh = ` or `points = ` for this file")),
    }
}

fn mesh_splats(
    path: &Path,
    mesh: &Mesh,
    params: &MeshParams,
    context: &Context<'_>,
    warnings: &mut Vec<String>,
) -> Result<Cloud, ConvertError> {
    let mut cloud = Cloud::default();
    let report = convert::mesh_to_points_with_progress(mesh, params, &mut cloud, context.progress)?;
    if report.degenerate > 0 {
        warnings.push(format!("{}: {} faces have no area", crate::printable(path), report.degenerate));
    }
    Ok(cloud)
}

fn surfels(
    path: &Path,
    points: &RawPoints,
    params: &SurfelParams,
    context: &Context<'_>,
    warnings: &mut Vec<String>,
) -> Result<Cloud, ConvertError> {
    let (cloud, report) = convert::raw_to_surfels_with_progress(points, params, context.progress)?;
    if report.duplicates > 0 && !params.merge_duplicates {
        let n = report.duplicates;
        warnings
            .push(format!("{}: {n} points lie where another one lies (--merge-duplicates)", crate::printable(path)));
    }
    Ok(cloud)
}

pub(crate) fn wrong_kind(path: &Path, expected: &str, hint: &str) -> Error {
    Error::input(crate::printable(path), format!("expected {expected}"), hint)
}

pub(crate) fn field(text: &str, object: &SceneObject) -> Result<ExpressionField, Error> {
    // The scene's check has parsed it already.
    ExpressionField::parse(text).map_err(|e| {
        let what = format!("object '{}', expression", crate::escape_controls(&object.name));
        Error::input(what, e.to_string(), "variables are x, y and z")
    })
}

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

fn procedural(
    shape: &CloudShape,
    spacing: f64,
    params: &VolumeParams,
    context: &Context<'_>,
) -> Result<Cloud, ConvertError> {
    let lattice = convert::procedural_cloud_with_progress(shape, spacing, &params.splat, context.progress)?;
    let point = |value: f32| TransferPoint { value, color: params.splat.color, extinction: value };
    let mut points = vec![point(0.0)];
    if shape.extinction > 0.0 {
        points.push(point(shape.extinction as f32));
    }
    let transfer = TransferFunction::new(points)
        .map_err(|source| ConvertError::Input { object: params.splat.object_name.clone(), source })?;
    convert::volume_to_points_with_progress(&lattice, &transfer, params, context.progress).map(|c| c.0)
}

fn medium(shape: &MediumShape, params: &SplatParams) -> Result<Cloud, ConvertError> {
    match *shape {
        MediumShape::Box { min, max, extinction, spacing } => {
            convert::medium_box(min, max, extinction, spacing, params)
        }
        MediumShape::Ball { center, radius, extinction, spacing } => {
            convert::medium_ball(center, radius, extinction, spacing, params)
        }
    }
}

impl Context<'_> {
    fn splat_params(&self, object: &SceneObject) -> SplatParams {
        let material = &self.scene.materials[object.material];
        let mut params = SplatParams {
            object_name: object.name.clone(),
            object: self.id as u32,
            material: object.material as u16,
            footprint: object.footprint,
            profile: self.scene.footprints.layers()[object.footprint as usize],
            transform: object.transform,
            color: object.color.unwrap_or(material.color),
            max_splats: 0,
        };
        self.limit(&mut params);
        params
    }

    /// What earlier objects have left of memory and of the scene's own limit.
    fn limit(&self, params: &mut SplatParams) {
        let fits = self.options.max_memory.saturating_sub(self.used) / BYTES_PER_SPLAT;
        let asked = self.scene.render.max_points.map_or(u64::MAX, |most| most.saturating_sub(self.made));
        params.max_splats = fits.min(asked).min(u64::from(u32::MAX));
    }

    /// Parameters of raw points.
    fn surfel_params(&self, object: &SceneObject, splat: SplatParams) -> SurfelParams {
        // The side that faces the sky.
        let up = splat.transform.rotation.inverse() * DVec3::Y;
        SurfelParams {
            splat,
            orientation: Orientation::Toward(up),
            opacity: self.opacity(object),
            largest_spacing: LARGEST_SPACING,
            merge_duplicates: object.merge_duplicates || self.options.merge_duplicates,
            ..SurfelParams::default()
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
        ConvertError::Cancelled => Error::Cancelled,
        other => Error::input("scene", other.to_string(), ""),
    }
}
