//! The input of an object: files read, formulas parsed, with the parameters of the conversion.

use super::files::{Blocks, Fitted, once};
use super::object_context::ObjectContext;
use super::painted::{self, ShownMesh};
use crate::Error;
use crate::scene::{
    CombinedSource, DensitySource, FieldSource, LevelSetSource, MatterSource, ObjectLabels, SceneObject, SliceSource,
    Source, SourceData, SurfaceSampler, VolumeSource,
};
use crate::statistics::{Conversion, ObjectData};
use convert::{
    ClassifiedGrid, CloudShape, Density, DensityParams, DiscShape, HomogeneousMedium, LiddedMesh, MatterParams,
    MediumBody, MeshParams, Section, ShownPoints, SplatParams, SurfaceField, SurfelParams, VolumeParams,
};
use field::{ClippedField, Inside, MpuParams, SharedField, Solid};
use pbsr::{BoundedExtinction, Matter};
use splat_core::points::attributes::TANGENT;
use splat_core::{Clip, DAabb, Grid, Interpolation, Mesh, RawPoints, Reservation, TransferFunction, optics};
use std::borrow::Cow;
use std::path::Path;
use std::sync::Arc;

/// The lattice of a volume that is drawn.
pub(super) struct ShownGrid {
    pub(super) grid: Arc<Grid>,
    /// Voxels of the file that one of its voxels stands for.
    pub(super) stands_for: f64,
}

/// The data of one object with the parameters of its conversion.
pub(super) enum Input<'a> {
    /// With the name of its source.
    Mesh(String, ShownMesh, MeshParams),
    Points(&'a Path, Arc<RawPoints>, SurfelParams),
    Matter(&'a Path, Arc<RawPoints>, MatterParams),
    Volume(ShownGrid, Cow<'a, TransferFunction>, VolumeParams),
    /// The zero set of a field in a box; of an isosurface that nothing clips with its volume.
    Surface(SharedField, DAabb, MeshParams, Option<Isosurface>),
    Density(SharedField, DAabb, DensityParams),
    Procedural(CloudShape, f64, VolumeParams),
    Medium(HomogeneousMedium, SplatParams, &'a [Clip]),
    Rectangle(convert::Rectangle, f64, SplatParams),
}

impl Input<'_> {
    /// Bytes that it holds, and those of them that [`super::files::Files`] does not hold too.
    pub(super) fn bytes(&self) -> [u64; 2] {
        let (bytes, holders) = match self {
            Self::Mesh(_, mesh, _) => (mesh.bytes(), Arc::strong_count(&mesh.mesh)),
            Self::Points(_, points, _) | Self::Matter(_, points, _) => (points.bytes(), Arc::strong_count(points)),
            Self::Volume(shown, ..) => (shown.grid.bytes(), Arc::strong_count(&shown.grid)),
            _ => (0, 1),
        };
        [bytes, if holders > 1 { 0 } else { bytes }]
    }

    /// Its attributes and limits.
    pub(super) fn splat(&self) -> &SplatParams {
        match self {
            Self::Mesh(_, _, params) | Self::Surface(_, _, params, _) => &params.splat,
            Self::Points(_, _, SurfelParams { splat, .. }) | Self::Matter(_, _, MatterParams { splat, .. }) => splat,
            Self::Volume(_, _, params) | Self::Procedural(_, _, params) => &params.splat,
            Self::Density(_, _, params) => &params.volume.splat,
            Self::Medium(_, params, _) | Self::Rectangle(_, _, params) => params,
        }
    }

    /// Opacity of one crossing, the least of it; `None` for a medium.
    pub(super) fn opacity(&self) -> Option<f64> {
        match self {
            Self::Mesh(_, mesh, params) => Some(params.opacity * f64::from(mesh.least_opacity())),
            Self::Surface(_, _, params, _) => Some(params.opacity),
            Self::Points(_, points, params) => Some(params.opacity * f64::from(points.least_opacity())),
            Self::Rectangle(_, opacity, _) => Some(*opacity),
            Self::Volume(..) | Self::Procedural(..) | Self::Density(..) | Self::Medium(..) | Self::Matter(..) => None,
        }
    }

    /// Opacity of one crossing where opacities of a mesh's vertices are 1; of other data the least of it.
    fn opacity_of_crossing(&self) -> Option<f64> {
        match self {
            Self::Mesh(_, _, params) => Some(params.opacity),
            _ => self.opacity(),
        }
    }

    /// Opacity of one crossing in the channel that absorbs most, by the factor that its material has on extinction there.
    pub(super) fn greatest_opacity(&self, factor: f64) -> f64 {
        // A material without extinction is clear, whatever the opacity.
        if factor > 0.0 {
            optics::opacity(factor * optics::optical_depth(self.opacity_of_crossing().unwrap_or(0.0)))
        } else {
            0.0
        }
    }

    /// Whether opacities of a mesh's vertices make it translucent, and leave parts of it opaque.
    pub(super) fn is_partly_opaque(&self) -> bool {
        matches!(self, Self::Mesh(_, mesh, params) if params.opacity == 1.0 && mesh.opacity.contains(&1.0))
    }

    /// Whether opacities vary over a mesh.
    pub(super) fn is_uneven(&self) -> bool {
        matches!(self, Self::Mesh(_, mesh, _) if !mesh.opacity.is_empty())
    }

    /// Whether particles or splats get the gradient as normal.
    pub(super) fn by_gradient(&self) -> bool {
        match self {
            Self::Volume(_, _, params) | Self::Procedural(_, _, params) => params.normals,
            Self::Density(_, _, params) => params.volume.normals,
            _ => false,
        }
    }

    /// Extinction with its bounds, where it is a field and has some; `factor` is the material's.
    pub(super) fn bounded(&self, factor: f64) -> Option<BoundedExtinction> {
        let scale = self.splat().transform.scale * factor;
        match self {
            Self::Density(field, bounds, params) if !params.volume.normals && params.volume.clip.is_empty() => {
                BoundedExtinction::new(Matter::Density(field.clone()), params.extinction * scale, *bounds)
            }
            Self::Medium(medium, _, []) => {
                let matter = match medium.body {
                    MediumBody::Box(_) => Matter::Everywhere,
                    MediumBody::Ball { center, radius } => Matter::Ball { center, radius },
                };
                BoundedExtinction::new(matter, medium.extinction * scale, medium.body.bounds())
            }
            _ => None,
        }
    }

    /// What it is made of, as far as the data and its field tell.
    /// What its splats are made of.
    pub(super) fn conversion(&self) -> Conversion {
        match self {
            // Gaussians and splats of files ask no neighbours.
            Self::Points(_, points, _) if !(points.gaussians.is_empty() && points.ready.cloud.is_empty()) => {
                Conversion::Plain
            }
            Self::Points(..) => Conversion::SurfacePoint,
            Self::Matter(..) => Conversion::MatterPoint,
            Self::Surface(..) => Conversion::Field,
            _ => Conversion::Plain,
        }
    }

    pub(super) fn data(&self, bounded: bool, looseness: f64, by: SurfaceSampler) -> ObjectData {
        match self {
            Self::Points(_, points, _) if !points.gaussians.is_empty() => ObjectData::Gaussians,
            Self::Points(..) | Self::Matter(..) => ObjectData::Points,
            Self::Mesh(..) | Self::Rectangle(..) => ObjectData::Triangles,
            Self::Surface(.., isosurface) => ObjectData::Surface { looseness, on_lattice: isosurface.is_some(), by },
            Self::Volume(..) | Self::Procedural(..) => ObjectData::Volume,
            Self::Density(..) | Self::Medium(..) => ObjectData::Density { bounded },
        }
    }
}

/// Reads one object.
pub(super) fn input<'a>(object: &'a SceneObject, context: &ObjectContext<'_>) -> Result<Input<'a>, Error> {
    let splat = context.splat_params(object);
    let opacity = context.scene.opacity_of(object);
    context.files.scales.borrow_mut().extend(object.value_scale());
    Ok(match &object.source {
        Source::Mesh(path) => {
            let density = object.spacing.map_or(Density::Auto, Density::Spacing);
            let mut params = MeshParams { splat, density, opacity };
            let mesh = own_mesh(path, object, &mut params, context)?;
            Input::Mesh(crate::printable(path).to_string(), mesh, params)
        }
        Source::Points(path) | Source::Matter(MatterSource { path, .. }) => match context.read(path)? {
            SourceData::Points(points) => raw_points(path, in_metres(points, object), object, splat, context)?,
            _ => {
                return Err(Error::wrong_kind(
                    path,
                    "points without faces",
                    "use `mesh = ` or `volume = ` for this file",
                ));
            }
        },
        Source::Extract(source) => {
            let points = source.points.clone().unwrap_or_default();
            raw_points("what a light sees".as_ref(), points, object, splat, context)?
        }
        Source::Volume(VolumeSource { path, frame, transfer, block }) => {
            // A spacing that the scene states is kept.
            let block = if object.spacing.is_some() { 1 } else { *block };
            let ShownGrid { grid, stands_for } = read_blocks(path, *frame, block, context)?;
            let (grid, transfer) = without_gaps(grid, transfer);
            let at = |spacing: f64| convert::resampled(&grid, spacing / splat.transform.scale, &splat).map(Arc::new);
            let grid = object.spacing.map_or_else(|| Ok(grid.clone()), at)?;
            Input::Volume(ShownGrid { grid, stands_for }, transfer, context.volume_params(splat))
        }
        Source::Implicit(_) | Source::Isosurface(_) | Source::LevelSet(_) | Source::Combined(_) => {
            let (solid, isosurface) = solid(&object.source, object, context)?;
            surface(solid, isosurface, object, splat, opacity)?
        }
        Source::Slice(source) => slice(source, object, splat, opacity, context)?,
        Source::Density(density @ DensitySource { bounds, spacing, extinction, .. }) => {
            let params = DensityParams {
                density: Density::Spacing(spacing * splat.transform.scale),
                extinction: *extinction,
                volume: context.volume_params(splat),
            };
            Input::Density(Arc::new(density.field()?), *bounds, params)
        }
        Source::Cloud(cloud) => Input::Procedural(cloud.shape(), cloud.spacing, context.volume_params(splat)),
        Source::Medium(medium) => Input::Medium(*medium, splat, &object.clip),
        Source::Rectangle(r) if object.clip.is_empty() => Input::Rectangle(*r, opacity, splat),
        Source::Rectangle(r) => {
            let density = Density::Spacing(r.spacing * splat.transform.scale);
            let mesh = convert::clipped_mesh(Mesh::rectangle(r.center, r.u, r.v).into(), &object.clip);
            Input::Mesh(object.name.clone(), mesh.into(), MeshParams { splat, density, opacity })
        }
    })
}

/// The mesh of an object, in the colours that it has, cut and closed again. `params` gets the density of its splats.
fn own_mesh(
    path: &Path,
    object: &SceneObject,
    params: &mut MeshParams,
    context: &ObjectContext<'_>,
) -> Result<ShownMesh, Error> {
    let color_by = object.points.color_by.as_ref();
    let mut shown = read_mesh(path, object.labels.as_ref(), context)?;
    if object.spacing.is_none() {
        params.density = shown.density(&params.splat);
    }
    if color_by.is_some() || object.color.is_some() {
        shown.painting = None;
    }
    if shown.painting.is_some() && !object.clip.is_empty() {
        // Corners where a mesh is cut have no place in a texture.
        let divided = shown.divided(path, painted::finest(params.density, &params.splat.transform), context)?;
        shown = Arc::new(divided).into();
    }
    let ShownMesh { mut mesh, painting } = shown;
    // While it is cut, or gets other colours, there is another one.
    let is_colored = color_by.is_some() || !mesh.columns.is_empty();
    let is_changed = is_colored || !object.clip.is_empty() || object.color.is_some() && !mesh.color.is_empty();
    let more = if is_changed { 2 * mesh.bytes() } else { 0 };
    let _held = context.files.memory(context.options).take(&crate::printable(path), more).map_err(Error::Limit)?;
    if let Some(by) = color_by {
        let colored = convert::colored_mesh(mesh, by, object.up.axis.direction(), &params.splat)?;
        context.files.note(path, colored.said);
        context.files.scales.borrow_mut().extend(colored.scale);
        mesh = colored.mesh;
    } else if !mesh.columns.is_empty() {
        // Another object asks for them.
        mesh = Mesh { columns: Vec::new(), ..Mesh::clone(&mesh) }.into();
    }
    let LiddedMesh { mesh, report } = convert::lidded_mesh(mesh, &object.clip);
    context.files.warn(path, report.said());
    let has_others = object.color.is_some() && !mesh.color.is_empty();
    let mesh = if has_others { Mesh { color: Vec::new(), ..Mesh::clone(&mesh) }.into() } else { mesh };
    Ok(ShownMesh { mesh, painting })
}

/// A plane through a volume, with the volume's colours.
fn slice<'a>(
    source: &SliceSource,
    object: &SceneObject,
    splat: SplatParams,
    opacity: f64,
    context: &ObjectContext<'_>,
) -> Result<Input<'a>, Error> {
    let grid = with_first_value(read_grid(&source.path, source.frame, context)?, &source.transfer);
    let spacing = object.spacing.map_or_else(|| grid.shortest_step(), |s| s / splat.transform.scale);
    let section = Section { center: source.center, normal: source.normal, spacing };
    let mesh = convert::volume_section(grid, &source.transfer, &section, &splat, Some(context.progress))?;
    let density = Density::Spacing(spacing * splat.transform.scale);
    let name = crate::printable(&source.path);
    let mesh = convert::clipped_mesh(mesh.into(), &object.clip);
    Ok(Input::Mesh(name, mesh.into(), MeshParams { splat, density, opacity }))
}

/// The lattice that a surface comes of, where that is all.
pub(super) struct Isosurface {
    pub(super) grid: Arc<Grid>,
    pub(super) interpolation: Interpolation,
    pub(super) level: f32,
    pub(super) inside: Inside,
}

/// What a field and where it is known make; its step is the distance of its splats where the object states none.
fn solid(
    source: &Source,
    object: &SceneObject,
    context: &ObjectContext<'_>,
) -> Result<(Solid, Option<Isosurface>), Error> {
    Ok(match source {
        Source::Implicit(source) => {
            let field = Arc::new(source.field()?);
            let walls = Vec::new();
            (Solid { field, walls, bounds: source.bounds, step: source.spacing }.closed(), None)
        }
        Source::Isosurface(source) => {
            let grid = read_grid(&source.path, source.frame, context)?;
            let interpolation = source.interpolation;
            let inside = source.inside;
            let grid = convert::gaps_outside(&grid, source.level as f32, inside).map_or(grid, Arc::new);
            let solid = Solid::of_volume(grid.clone(), interpolation, source.level, inside);
            let isosurface = Isosurface { grid, interpolation, level: source.level as f32, inside };
            (solid.map_err(|e| refuse(&source.path, &e, ""))?, Some(isosurface))
        }
        Source::LevelSet(source) => {
            let (field, bounds) = level_set(source, object, context)?;
            (Solid::of_points(field, bounds), None)
        }
        Source::Combined(CombinedSource { combination, parts }) => {
            let parts = parts.iter().map(|part| Ok(solid(part, object, context)?.0)).collect::<Result<_, Error>>()?;
            let refused = |e: splat_core::Error| {
                Error::input(format!("object '{}'", crate::shown(&object.name)), e.to_string(), "")
            };
            (Solid::combined(*combination, parts).map_err(refused)?, None)
        }
        _ => return Err(Error::Internal("a solid is of a source that has no field".into())),
    })
}

/// A surface of a field.
fn surface<'a>(
    solid: Solid,
    isosurface: Option<Isosurface>,
    object: &SceneObject,
    splat: SplatParams,
    opacity: f64,
) -> Result<Input<'a>, Error> {
    let Solid { field, bounds, step, .. } = solid;
    let spacing = match (object.spacing, &isosurface) {
        (Some(spacing), _) => spacing,
        (None, None) => step * splat.transform.scale,
        (None, Some(Isosurface { grid, level, inside, .. })) => {
            let spacing = field::isosurface_spacing(grid, f64::from(*level), *inside);
            spacing.map_err(|e| Error::from_core("an isosurface", e))? * splat.transform.scale
        }
    };
    let density = Density::Spacing(spacing);
    let field = if object.clip.is_empty() {
        field
    } else {
        let clipped = ClippedField::new(field, object.clip.clone());
        Arc::new(clipped.map_err(|e| Error::Internal(e.to_string()))?)
    };
    let isosurface = isosurface.filter(|_| object.clip.is_empty());
    Ok(Input::Surface(field, bounds, MeshParams { splat, density, opacity }, isosurface))
}

pub(super) fn refuse(path: &Path, error: &splat_core::Error, hint: &str) -> Error {
    Error::input(crate::printable(path), error.to_string(), hint)
}

/// Bytes that a point takes while a field is fitted to it, beside the field.
const BYTES_PER_FITTED_POINT: u64 = 128;

/// The field that scattered points lie on, and its bounds.
fn level_set(source: &LevelSetSource, object: &SceneObject, context: &ObjectContext<'_>) -> Result<Fitted, Error> {
    let fit = || {
        let params =
            MpuParams { object_name: object.name.clone(), tolerance: source.tolerance, ..MpuParams::default() };
        let (points, _held) = read_scattered(&source.path, context)?;
        let what = format!("the level set of {}", crate::printable(&source.path));
        let memory = context.files.memory(context.options);
        let _fitting = memory.take(&what, points.len() as u64 * BYTES_PER_FITTED_POINT).map_err(Error::Limit)?;
        let (field, _) = convert::points_to_field(&points, &params, Some(context.progress))?;
        let bounds = field.bounds();
        let bytes = field.bytes();
        memory.hold(&what, bytes).map_err(Error::Limit)?;
        Ok(((Arc::new(field) as SharedField, bounds), bytes))
    };
    once(&context.files.fitted, (source.path.clone(), source.tolerance), fit).map(|fitted| fitted.0)
}

/// Scattered points with normals where the file has some; of a mesh its vertices.
fn read_scattered(path: &Path, context: &ObjectContext<'_>) -> Result<(Arc<RawPoints>, Arc<Reservation>), Error> {
    let (data, held) = context.read_once(path)?;
    match data {
        SourceData::Points(points) => {
            context.files.note(path, points.unused_by_fields());
            Ok((points, held))
        }
        SourceData::Mesh(mesh) | SourceData::Painted(mesh, _) => {
            mesh.validate().map_err(|e| refuse(path, &e, ""))?;
            Ok((RawPoints::of_vertices(&mesh).into(), held))
        }
        _ => Err(Error::wrong_kind(path, "points", "use `volume = ` or `isosurface = ` for this file")),
    }
}

fn read_mesh(path: &Path, known: Option<&ObjectLabels>, context: &ObjectContext<'_>) -> Result<ShownMesh, Error> {
    match context.read(path)? {
        SourceData::Mesh(mesh) => Ok(mesh.into()),
        SourceData::Painted(mesh, painting) => Ok(ShownMesh { mesh, painting: Some(painting) }),
        SourceData::Grid(grid) => labels(path, &grid, known, context).map(ShownMesh::from),
        _ => Err(Error::wrong_kind(path, "a mesh with faces", "use `points = ` or `volume = ` for this file")),
    }
}

/// The surfaces between the labels of a volume, with their column.
fn labels(
    path: &Path,
    grid: &Grid,
    known: Option<&ObjectLabels>,
    context: &ObjectContext<'_>,
) -> Result<Arc<Mesh>, Error> {
    let name = crate::printable(path).to_string();
    let bytes = convert::label_surface_bytes(grid);
    let _held = context.files.memory(context.options).take(&name, bytes).map_err(Error::Limit)?;
    let table = known.map(|known| &*known.table);
    if grid.values.contains(&-1.0) {
        context.files.note(path, ["its voxels of -1 belong to no region, as those of 0".to_owned()]);
    }
    let mesh = convert::label_surfaces(grid, table, &name).map_err(|error| match error {
        convert::ConvertError::Parameter { parameter, found, expected, .. } => {
            let message = format!("{parameter} is {found}, expected {expected}");
            Error::input(&name, message, "use `volume = ` or `isosurface = ` for this file, whose values are amounts")
        }
        other => other.into(),
    })?;
    if let Some(known) = known {
        if let Some(file) = &known.file {
            context.files.note(file, known.remarks.iter().cloned());
        }
        context.files.note(path, convert::said_of_labels(grid, &known.table));
        if mesh.triangles.is_empty() {
            let hint = "raise an `opacity` of `labels`, or set `visible` of one; in a table alpha 0 hides a label";
            return Err(Error::input(&name, "expected a label that is shown, found none: all are hidden", hint));
        }
    }
    Ok(mesh.into())
}

/// Points whose degrees became metres, where the object says that they have such.
fn in_metres(points: Arc<RawPoints>, object: &SceneObject) -> Arc<RawPoints> {
    if object.degrees { convert::metres_of_degrees(&points).into() } else { points }
}

/// Points as samples of a surface, or as matter.
fn raw_points<'a>(
    path: &'a Path,
    points: Arc<RawPoints>,
    object: &SceneObject,
    splat: SplatParams,
    context: &ObjectContext<'_>,
) -> Result<Input<'a>, Error> {
    let ShownPoints { points, said, scale } = convert::shown_points(points, &object.points_shown(), &splat)?;
    context.files.note(path, said);
    context.files.scales.borrow_mut().extend(scale);
    Ok(match object.matter_params(&splat) {
        Some(params) => Input::Matter(path, points, params),
        None => {
            let mut params = context.surfel_params(object, splat);
            if object.points.shape.is_none() {
                params.shape = shape_of_most(path, &points, &params, context);
            }
            Input::Points(path, points, params)
        }
    })
}

/// The most splats that balls become unasked: of more points each ball would be about a pixel, and its discs fill the memory.
const MOST_SPLATS_OF_BALLS: u64 = 4_000_000;

/// Share of points on no surface from which all are balls. Scans of surfaces have less than a twentieth, scans of the ground with trees about a quarter, and
/// bushes a half, some of whose leaves are flat: their discs would be flakes as wide as the gaps between leaves.
const SCATTERED: f64 = 1.0 / 3.0;

/// The shape of discs of points whose object states none: balls where opaque points lie on no surface, and their splats are within all limits.
fn shape_of_most(path: &Path, points: &RawPoints, params: &SurfelParams, context: &ObjectContext<'_>) -> DiscShape {
    let is_plain = points.normal.is_empty() && points.gaussians.is_empty() && points.ready.cloud.is_empty();
    let has_tangents = TANGENT.into_iter().any(|name| points.own_column(name).is_some());
    let is_opaque = params.opacity * f64::from(points.least_opacity()) >= 1.0;
    let balls = SurfelParams { shape: DiscShape::Balls, ..params.clone() };
    let may_be_made = convert::cost::raw_points(points, &balls).is_ok_and(|predicted| {
        predicted.splats <= MOST_SPLATS_OF_BALLS && predicted.bytes <= context.options.max_memory / 8
    });
    if !is_plain || has_tangents || !is_opaque || !may_be_made {
        return DiscShape::default();
    }
    let share = convert::scattered_share(points);
    if share <= SCATTERED {
        return DiscShape::default();
    }
    let percent = (100.0 * share).round();
    let said =
        format!("{percent} % of the points lie on no surface, so each is a ball; discs = \"round\" makes each a disc");
    context.files.note(path, Some(said));
    DiscShape::Balls
}

/// The field that a surface shows.
pub(super) fn shown_field(object: &SceneObject, context: &ObjectContext<'_>) -> Result<Option<SurfaceField>, Error> {
    let Some(FieldSource { path, frame, interpolation, transfer, classified }) = &object.field else { return Ok(None) };
    let grid = with_first_value(read_grid(path, *frame, context)?, transfer);
    let field = SurfaceField::new(grid, *interpolation, transfer.clone(), *classified);
    field.map(Some).map_err(|e| refuse(path, &e, ""))
}

/// A volume whose voxels without a value draw nothing.
fn without_gaps<'t>(grid: Arc<Grid>, transfer: &'t TransferFunction) -> (Arc<Grid>, Cow<'t, TransferFunction>) {
    match convert::transparent_gaps(&grid, transfer) {
        Some(ClassifiedGrid { grid, transfer }) => (grid.into(), Cow::Owned(transfer)),
        None => (grid, Cow::Borrowed(transfer)),
    }
}

/// A volume whose voxels without a value have the first colour of a transfer function.
fn with_first_value(grid: Arc<Grid>, transfer: &TransferFunction) -> Arc<Grid> {
    let first = transfer.points().first().map_or(0.0, |point| point.value);
    convert::gaps_of_value(&grid, first).map_or(grid, Arc::new)
}

/// Blocks along a side of a volume that a preview keeps at least.
const LEAST_BLOCKS: usize = 32;

/// A volume of which blocks with so many voxels along each side are taken as one voxel; fewer where the volume is small.
fn read_blocks(path: &Path, frame: u64, block: usize, context: &ObjectContext<'_>) -> Result<ShownGrid, Error> {
    if block == 1 {
        return Ok(ShownGrid { grid: read_grid(path, frame, context)?, stands_for: 1.0 });
    }
    let SourceData::Grid(whole) = context.read_frame(path, frame)? else { return Err(no_volume(path)) };
    let make = || {
        let grid = with_known_values(whole.clone(), path, context)?.coarsened(block, LEAST_BLOCKS);
        let held = context.files.memory(context.options).take(&crate::printable(path), grid.bytes());
        Ok(Blocks { grid: grid.into(), _held: held.map_err(Error::Limit)?.into() })
    };
    let grid = context.files.blocks(&whole, context.nodata(), block, make)?;
    let stands_for = whole.values.len() as f64 / grid.values.len() as f64;
    Ok(ShownGrid { grid, stands_for })
}

fn no_volume(path: &Path) -> Error {
    Error::wrong_kind(path, "a volume", "use `mesh = ` or `points = ` for this file")
}

fn read_grid(path: &Path, frame: u64, context: &ObjectContext<'_>) -> Result<Arc<Grid>, Error> {
    match context.read_frame(path, frame)? {
        SourceData::Grid(grid) => with_known_values(grid, path, context),
        _ => Err(no_volume(path)),
    }
}

/// A volume whose voxels of the value `nodata` have none. Values that look like such are warned of.
fn with_known_values(grid: Arc<Grid>, path: &Path, context: &ObjectContext<'_>) -> Result<Arc<Grid>, Error> {
    let Some(nodata) = context.nodata() else {
        let fill = convert::FillValue::of_grid(&grid);
        // A fill value is not told as a stray too.
        let strays = if fill.is_none() { convert::Strays::of_grid(&grid) } else { None };
        context.files.warn(path, fill);
        context.files.warn(path, strays);
        return Ok(grid);
    };
    let _held =
        context.files.memory(context.options).take(&crate::printable(path), grid.bytes()).map_err(Error::Limit)?;
    let (grid, count) = convert::without_value(&grid, nodata);
    let voxels = grid.values.len() as u64;
    let value = convert::written_value(nodata);
    if count == voxels {
        let message = format!("expected a voxel with a value, found `nodata`, {value}, in all of them");
        return Err(Error::input(crate::printable(path), message, "leave `nodata` out"));
    }
    if count == 0 {
        context.files.warn(
            path,
            [format!("no voxel has the value of `nodata`, {value}: `organza info` has the range of the values")],
        );
    } else {
        context
            .files
            .note(path, [format!("{count} of {voxels} voxels have the value of `nodata`, {value}: they draw nothing")]);
    }
    context.files.warn(path, convert::Strays::of_grid(&grid));
    Ok(grid.into())
}
