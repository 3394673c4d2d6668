//! Translucent objects in a neutral form other than splats: a field, triangles, or a volume.
//!
//! Lengths and places are in the object's space, so an object far from the origin loses no precision; a transform leads
//! to the world.

use super::input::{Input, Isosurface};
use super::object::{Prepared, procedural};
use super::object_context::{self, ObjectContext};
use super::painted;
use crate::Error;
use crate::form::{Form, PlannedObject};
use crate::scene::{SurfaceSampler, Technique};
use convert::{ClassifiedGrid, SurfaceField, VolumeParams};
use field::{RegionField, SharedField, extinct_bounds};
use glam::DVec3;
use pbsr::{BoundedExtinction, LineParams, LineSampler};
use rayon::prelude::*;
use splat_core::raster::triangles::PlacedMesh;
use splat_core::{
    BccGrid, Clip, DAabb, Footprint, Grid, Interpolation, Mesh, Packing, Similarity, SplatKind, TransferFunction,
};
use std::sync::Arc;

/// Which zeros belong to a surface.
pub(crate) type Inside = Box<dyn Fn(DVec3) -> bool + Send + Sync>;

/// A translucent object that is sampled from its own data.
pub(crate) struct Own {
    /// Rank of the object in the scene.
    pub(crate) object: usize,
    /// What draws it.
    pub(crate) technique: Technique,
    /// As what.
    pub(crate) form: Form,
    /// Its data.
    pub(crate) body: Body,
    /// Its material.
    pub(crate) material: usize,
    /// Opacity of one crossing in the channel that absorbs most; surfaces alone. Where vertices have opacities, where those are 1.
    pub(crate) opacity: f64,
    /// The factor on optical depths of the channel that absorbs most.
    pub(crate) extinction_factor: f64,
    /// From extinction in 1/world unit to that of the same channel in 1/object unit, for cells.
    pub(crate) extinction_scale: f64,
    /// Colour where the data has none.
    pub(crate) color: [f32; 3],
    /// The field that a surface shows, and the opacity of one crossing without it.
    pub(crate) field: Option<(SurfaceField, f64)>,
    /// From the object to the normalized world.
    pub(crate) transform: Similarity,
    /// Bounds of what can be seen, object units.
    pub(crate) bounds: DAabb,
    /// Radius that its splats have or would have, normalized world units.
    pub(crate) radius: f64,
    /// Whether its splats are in the cloud too.
    pub(crate) has_splats: bool,
    /// Bytes that a sampler's tables take, about, and what making them takes beside.
    pub(crate) table_bytes: u64,
}

/// The data of an object.
pub(crate) enum Body {
    /// The zero set of a field.
    Surface {
        field: SharedField,
        /// Beyond this the surface ends.
        inside: Inside,
        /// Distance of samples that were asked for, object units.
        spacing: f64,
        /// Step of a Brownian motion over the longest side of the bounds; without one, lines find particles.
        step: Option<f64>,
    },
    /// An isosurface of a volume.
    Lattice { grid: Arc<Grid>, interpolation: Interpolation, level: f32 },
    /// Triangles with normals.
    Triangles(Mesh),
    /// Extinction by a transfer function, 1/world unit before normalization.
    Cells {
        grid: Arc<Grid>,
        transfer: TransferFunction,
        /// Whether particles get normals.
        normals: bool,
        /// The same values on the body-centred lattice of the same spectrum, where the scene asks for that.
        body_centred: Option<BccGrid>,
        /// 1 where nothing is cut off, and 0 elsewhere; `None` where nothing is cut at all.
        cut: Option<SharedField>,
    },
    /// A field of extinction.
    Field(BoundedExtinction),
}

impl std::fmt::Debug for Own {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Own").field("object", &self.object).field("bounds", &self.bounds).finish_non_exhaustive()
    }
}

impl Own {
    /// Takes the data of an object; its splats, if it has any, are made from the same. `None` for raw points, and where
    /// there is nothing to sample.
    pub(super) fn new(
        prepared: &mut Prepared<'_>,
        planned: &PlannedObject,
        context: &ObjectContext<'_>,
    ) -> Result<Option<Self>, Error> {
        let source = planned.form;
        let splat = prepared.input.splat().clone();
        let factor = context.extinction_factor(&context.scene.objects[context.id]);
        let opacity = prepared.input.greatest_opacity(factor);
        let bounded = prepared.bounded.take().filter(|_| source == Form::Field);
        let Some((body, bounds, spacing)) = data(prepared, bounded, source, context)? else { return Ok(None) };
        let table_bytes = table_bytes(&body, source, bounds, prepared.prediction.splats);
        let radius = f64::from(splat.profile.cutoff) * f64::from(Footprint::SIGMA_OVER_SPACING) * spacing;
        let has_colors = matches!(&body, Body::Triangles(mesh) if !mesh.color.is_empty());
        Ok(Some(Self {
            object: context.id,
            technique: planned.technique,
            form: source,
            material: usize::from(splat.material),
            opacity,
            field: prepared.field.clone().zip(prepared.input.opacity()),
            extinction_factor: factor,
            extinction_scale: factor * splat.transform.scale,
            // The technique multiplies the data's colours by it.
            color: if has_colors { [1.0; 3] } else { splat.color },
            body,
            transform: splat.transform,
            bounds,
            radius: radius * splat.transform.scale,
            has_splats: planned.splats.is_some(),
            table_bytes,
        }))
    }

    /// Surface or medium.
    pub(crate) fn kind(&self) -> SplatKind {
        match self.body {
            Body::Surface { .. } | Body::Lattice { .. } | Body::Triangles(_) => SplatKind::Surface,
            Body::Cells { .. } | Body::Field(_) => SplatKind::Medium,
        }
    }

    /// The volume that it is sampled from.
    pub(crate) fn grid(&self) -> Option<&Grid> {
        match &self.body {
            Body::Cells { grid, .. } | Body::Lattice { grid, .. } => Some(grid),
            _ => None,
        }
    }

    /// Voxels with extinction; 0 where it is not drawn as cells.
    pub(crate) fn voxels(&self) -> u64 {
        if self.form == Form::Cells { self.table_bytes / BYTES_PER_VOXEL } else { 0 }
    }

    /// Triangles, and where they are.
    pub(crate) fn placed(&self) -> Option<PlacedMesh<'_>> {
        let Body::Triangles(mesh) = &self.body else { return None };
        Some(PlacedMesh { mesh, transform: self.transform })
    }

    /// Bytes of the data.
    pub(crate) fn bytes(&self) -> u64 {
        let of_grid = self.grid().map_or(0, Grid::bytes);
        match &self.body {
            Body::Triangles(mesh) => mesh.bytes(),
            Body::Cells { body_centred: Some(bcc), .. } => of_grid + bcc.planes.bytes(),
            Body::Field(field) => field.bytes(),
            _ => of_grid,
        }
    }

    /// Optical depth that no ray through its cells can exceed, of the channel that absorbs most; without end for triangles; 0 for other bodies.
    pub(crate) fn optical_depth(&self) -> f64 {
        let Body::Cells { transfer, .. } = &self.body else {
            return if matches!(self.body, Body::Triangles(_)) { f64::INFINITY } else { 0.0 };
        };
        let most = transfer.points().iter().map(|p| p.extinction).fold(0.0, f32::max);
        f64::from(most) * self.extinction_scale * self.bounds.diagonal()
    }

    /// A box in the world that holds the object.
    pub(crate) fn world_box(&self) -> DAabb {
        DAabb::of_points(self.bounds.corners().map(|p| self.transform.apply(p)))
    }

    /// The largest channel of the colours of its data.
    pub(crate) fn brightest_color(&self) -> f32 {
        let greatest = |colors: &[[f32; 3]]| colors.as_flattened().iter().copied().fold(0.0, f32::max);
        let data = match &self.body {
            Body::Cells { transfer, .. } => transfer.brightest(),
            Body::Triangles(mesh) if !mesh.color.is_empty() => greatest(&mesh.color) * greatest(&[self.color]),
            Body::Triangles(_) | Body::Surface { .. } | Body::Lattice { .. } | Body::Field(_) => {
                greatest(&[self.color])
            }
        };
        self.field.as_ref().map_or(data, |(field, _)| data.max(field.brightest()))
    }

    /// Scales the world, not the object.
    pub(crate) fn scale_world(&mut self, scale: f64) {
        self.transform = self.transform.scaled(scale);
        self.radius *= scale;
    }
}

/// Bytes of a voxel with extinction in the table of a sampler, about.
const BYTES_PER_VOXEL: u64 = 32;

/// Bytes of the tables of a sampler, about: of cells with extinction, of triangles, of cubes that a surface meets; a lattice's isosurface
/// has as many splats as there are steps across it.
fn table_bytes(body: &Body, form: Form, bounds: DAabb, splats: u64) -> u64 {
    match body {
        Body::Cells { grid, transfer, .. } => {
            // Chains find cells by an index of each voxel.
            let index = if form == Form::Chains { 4 * grid.values.len() as u64 } else { 0 };
            index
                + BYTES_PER_VOXEL * grid.values.par_iter().filter(|v| transfer.at(**v).extinction > 0.0).count() as u64
        }
        Body::Lattice { .. } => 32 * splats,
        Body::Triangles(mesh) => 16 * mesh.triangles.len() as u64,
        Body::Field(field) => 8 * u64::from(field.cells()).pow(3),
        // Of these fields alone a bound of the gradient is known: those through scattered points.
        Body::Surface { field, .. } if field.steepest(bounds.center(), 0.0).is_some() => LineSampler::MOST_BYTES,
        Body::Surface { spacing, .. } => {
            let lines = LineParams::for_spacing(bounds.size().max_element(), *spacing);
            96 * 6 * u64::from(lines.resolution).pow(2)
        }
    }
}

/// Data, bounds and the distance of splats, object units.
type Data = (Body, DAabb, f64);

fn data(
    prepared: &Prepared<'_>,
    bounded: Option<BoundedExtinction>,
    source: Form,
    context: &ObjectContext<'_>,
) -> Result<Option<Data>, Error> {
    if let Some(field) = bounded {
        return Ok(field_data(prepared, field));
    }
    let cells = |grid: Arc<Grid>, transfer: TransferFunction, (normals, clip): (bool, &[Clip])| {
        let bounds = extinct_bounds(&grid, &transfer);
        let spacing = grid.shortest_step();
        let cut = RegionField::shared(clip);
        Some((Body::Cells { grid, transfer, normals, body_centred: None, cut }, bounds, spacing))
    };
    let meshed = |mesh: Mesh| triangles(mesh, prepared.prediction.splats, source);
    Ok(match &prepared.input {
        Input::Points(..) | Input::Matter(..) => None,
        Input::Mesh(name, mesh, params) => {
            let finest = painted::finest(params.density, &params.splat.transform);
            meshed(mesh.divided(name.as_ref(), finest, context)?)
        }
        Input::Rectangle(r, ..) => meshed(Mesh::rectangle(r.center, r.u, r.v)),
        Input::Surface(field, bounds, params, isosurface) => {
            let spacing = params.density.spacing() / params.splat.transform.scale;
            let stated = context.scene.objects[context.id].spacing;
            let trilinear = isosurface.as_ref().filter(|surface| surface.interpolation == Interpolation::Trilinear);
            if let (Form::Triangles, Some(surface), None) = (source, trilinear, stated) {
                // Marching cubes on the volume's own steps, as the paper has it (section 5).
                let mesh = field::isosurface_to_mesh(&surface.grid, f64::from(surface.level), surface.inside);
                return Ok(meshed(mesh.map_err(|e| Error::from_core("an isosurface", e))?));
            }
            if source == Form::Triangles {
                let mesh =
                    convert::surface_to_mesh(field.as_ref(), *bounds, spacing, &params.splat, Some(context.progress));
                return Ok(meshed(mesh?));
            }
            let bounds = prepared.search.as_ref().map_or(*bounds, |s| s.bounds);
            if let (Form::Lattice, Some(Isosurface { grid, interpolation, level, .. })) = (source, isosurface) {
                let body = Body::Lattice { grid: grid.clone(), interpolation: *interpolation, level: *level };
                return Ok(Some((body, bounds, spacing)));
            }
            let domain = field.clone();
            let inside: Inside = Box::new(move |p| domain.in_domain(p));
            let step = match context.scene.render.particles.surface_sampler {
                SurfaceSampler::Brownian { step } => Some(step),
                _ => None,
            };
            Some((Body::Surface { field: field.clone(), inside, spacing, step }, bounds, spacing))
        }
        Input::Volume(shown, transfer, params) => Some(volume(&shown.grid, transfer, params, context)?),
        Input::Procedural(shape, spacing, params) => {
            let (grid, transfer) = procedural(shape, *spacing, &params.splat, context)?;
            cells(grid.into(), transfer, (params.normals, &params.clip))
        }
        Input::Density(field, bounds, params) => {
            let ClassifiedGrid { grid, transfer } = convert::density_to_grid(field.as_ref(), *bounds, params)?;
            cells(grid.into(), transfer, (params.volume.normals, &params.volume.clip))
        }
        Input::Medium(medium, params, clip) => {
            let grid = convert::medium_to_grid(medium, &object_context::of_lattice(params))?;
            cells(grid.into(), convert::extinction_as_it_is(medium.extinction, params)?, (false, clip))
        }
    })
}

/// A field of extinction, if there is any.
fn field_data(prepared: &Prepared<'_>, field: BoundedExtinction) -> Option<Data> {
    let spacing = match &prepared.input {
        Input::Density(_, _, params) => params.density.spacing() / params.volume.splat.transform.scale,
        Input::Medium(medium, ..) => medium.spacing,
        _ => 0.0,
    };
    let bounds = field.occupied_cells().fold(DAabb::EMPTY, DAabb::union);
    let some = field.max() > 0.0;
    some.then_some((Body::Field(field), bounds, spacing))
}

/// A volume, and on a body-centred lattice where the scene asks for one.
fn volume(
    grid: &Arc<Grid>,
    transfer: &TransferFunction,
    params: &VolumeParams,
    context: &ObjectContext<'_>,
) -> Result<Data, Error> {
    let is_packed = context.scene.objects[context.id].packing == Packing::BodyCentred;
    let body_centred = is_packed.then(|| convert::body_centred(grid, &params.splat)).transpose()?;
    let bounds = extinct_bounds(grid, transfer);
    let spacing = grid.shortest_step();
    let grid = grid.clone();
    let transfer = transfer.clone();
    let cut = RegionField::shared(&params.clip);
    let body = Body::Cells { grid, transfer, normals: params.normals, body_centred, cut };
    Ok((body, bounds, spacing))
}

/// A mesh with normals; smooth ones where the file has none, as its splats have. In whatever order the file has its triangles, their particles
/// are the same.
fn triangles(mut mesh: Mesh, splats: u64, form: Form) -> Option<Data> {
    mesh.canonicalize();
    splat_core::smooth(&mut mesh);
    let area = mesh.area();
    let bounds = mesh.bounds();
    // Particles are thinned by the angle at which they are seen: of faces, not of normals that lean from them.
    let piece = area / splats.max(1) as f64;
    if form == Form::Triangles {
        convert::flatten_leaning(&mut mesh, piece);
    }
    (area > 0.0).then_some((Body::Triangles(mesh), bounds, piece.sqrt()))
}
