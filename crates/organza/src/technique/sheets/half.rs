//! Half-vector slicing of the technique `sheets` (Zhang and Crawfis, section 4): one sweep a light through all that is translucent.
//!
//! Light that no half vector serves has a shadow map, as in slabs across the view, and joins the first sweep.

mod splats;

use super::{params, reconstruction, refuse, volumes};
use crate::cost::extent::Extent;
use crate::form::{Form, PlannedObject};
use crate::frame::Frame;
use crate::frame::matter::{Carries, CarriesLight, Matter};
use crate::pass;
use crate::scene::{self, LightPoint, RenderSettings, Scene, SceneLight, Slicing, SoftShadows, Technique};
use crate::statistics::SourceFacts;
use crate::technique::{Asked, OwnWork, Session};
use crate::{CostRecord, Error, RenderOptions, stage};
use sheet_light::Params;
use sheet_light::half::{
    self, Bodies, Drawn, Extended, HalfInput, HalfParams, MOST_SAMPLES, Reason, SampledLight, Scattering, fold,
    light_list_bytes, penumbra_widening, polygon_bytes, serves_extended, slab_width,
};
use splat_core::raster::triangles::PlacedMesh;
use splat_core::shade::LitBy;
use splat_core::{Accumulator, Camera, Light, MeanTransmittance};
use splats::{OwnSplats, splat_bounds};

/// Samples of the picture for each one that an opaque mesh covers, as long as nothing is known of its place.
const SAMPLES_OF_A_MESH: f64 = 4.0;
/// What a user can do where half vectors cannot.
const HINT: &str = "use render.sheets.slicing = \"view\"";

/// How light is carried where settings ask for half vectors.
pub(crate) fn carries(settings: &RenderSettings) -> Option<CarriesLight> {
    matches!(settings.sheets.slicing, Slicing::HalfVector { .. }).then_some(points_served as CarriesLight)
}

/// Whether slabs lie across half vectors.
pub(crate) fn is_asked(scene: &Scene) -> bool {
    carries(&scene.render).is_some()
}

/// For each point of a light: whether half vectors serve it, or why not.
fn points_served(matter: &Matter<'_>, points: &[LightPoint]) -> Result<Carries, Error> {
    let translucent = || matter.planned.iter().filter(|o| !matches!(o.form, Form::Opaque | Form::Polygons));
    let refuse = |o: &PlannedObject, message: &str| {
        Err(Error::input(format!("object '{}'", crate::shown(&o.object)), message, HINT))
    };
    if let Some(other) = translucent().find(|o| o.technique != Technique::Sheets) {
        let message =
            format!("drawn by {}, where half-vector sheets draw alone what is translucent", other.technique.name());
        return refuse(other, &message);
    }
    let scatters_again = matter.scene.render.sheets.scattering().is_some();
    let volumes = volumes(matter).collect::<Vec<_>>();
    let splats = splat_bounds(matter);
    let bodies = Bodies { volumes: &volumes, splats };
    let words = |reason: Reason| match reason {
        Reason::LampInside { volume, .. } => {
            let name = &matter.scene.objects[volumes[volume].object as usize].name;
            format!("the lamp lies inside object '{}'", crate::shown(name))
        }
        // Positions are normalized here, not the scene's.
        Reason::LampAmong { .. } => "the lamp lies within the bounds of translucent surfaces or points".into(),
        other => other.to_string(),
    };
    let is_served = |point: &LightPoint| match lamp(matter.scene, point) {
        (_, samples) if samples > MOST_SAMPLES => {
            Err(format!("it has {samples} points, expected at most {MOST_SAMPLES} in one sweep"))
        }
        (light, samples) => serves_extended(&bodies, matter.camera, light, samples).map_err(words),
    };
    Ok(Carries {
        widening: points.iter().map(|point| penumbra_widening(&bodies, &point.whole)).collect(),
        points: points.iter().map(is_served).collect(),
        scatters_again,
        has_scattering_media: volumes.iter().any(half::scatters),
        together: is_one_sweep(matter.scene),
    })
}

fn is_one_sweep(scene: &Scene) -> bool {
    matches!(scene.render.sheets.slicing, Slicing::HalfVector { soft_shadows: SoftShadows::OneSweep, .. })
}

/// Whether the light of a point goes through the volumes with that of all the others of its light.
fn is_whole(scene: &Scene, point: &LightPoint) -> bool {
    is_one_sweep(scene) && point.whole.shape.is_extended()
}

/// What lights for a point: its whole light and how many points that has, or the point itself.
fn lamp<'p>(scene: &Scene, point: &'p LightPoint) -> (&'p Light, u32) {
    if is_whole(scene, point) { (&point.whole, point.rank[1] as u32) } else { (&point.light, 1) }
}

/// The same once for each sweep.
fn swept<'p>(scene: &Scene, point: &'p LightPoint) -> Option<(&'p Light, u32)> {
    (!is_whole(scene, point) || point.rank[0] == 0).then(|| lamp(scene, point))
}

/// Whether a point has a sweep of its own, or stands for its whole light.
pub(super) fn is_swept(scene: &Scene, point: &LightPoint) -> bool {
    swept(scene, point).is_some()
}

/// Pixels of a light's image along the least step of a volume.
pub(super) fn light_pixels(scene: &Scene) -> f64 {
    match scene.render.sheets.slicing {
        Slicing::HalfVector { light_pixels, .. } => light_pixels,
        Slicing::View => 0.0,
    }
}

/// Width of the slabs of media that are not converted yet, world units: as stated, or the least spacing of all on lattices.
pub(super) fn foreseen_width(settings: &RenderSettings, facts: &SourceFacts) -> f64 {
    let spacings = facts.media.iter().filter(|medium| medium.is_lattice).map(|medium| medium.spacing);
    settings.sheets.slab_width.unwrap_or_else(|| spacings.fold(f64::INFINITY, f64::min))
}

/// Work on an object that is not converted yet: on the samples of a medium on a lattice, or on the pixels of a mesh, from which lights are looked at.
pub(super) fn foresees(asked: &Asked<'_>, camera: &Camera) -> OwnWork {
    let Slicing::HalfVector { light_pixels, soft_shadows, .. } = asked.settings.sheets.slicing else {
        return OwnWork::default();
    };
    let shining = || asked.scene.lights.iter().filter(|light| light.light.intensity != [0.0; 3]);
    let points: f64 = shining().map(|light| light.count() as f64).sum();
    if asked.stays_triangles() {
        return OwnWork { polygon_looks: points * camera.pixels() as f64 / SAMPLES_OF_A_MESH, ..OwnWork::default() };
    }
    let Some(medium) = asked.medium().filter(|medium| medium.is_lattice) else { return OwnWork::default() };
    let is_whole = |light: &&SceneLight| soft_shadows == SoftShadows::OneSweep && light.light.shape.is_extended();
    let points_of_whole: f64 = shining().filter(is_whole).map(|light| light.count() as f64).sum();
    let sweeps = points - points_of_whole + shining().filter(is_whole).count() as f64;
    let seen = Extent::new(&medium.bounds, camera);
    let width = foreseen_width(asked.settings, asked.facts);
    // A slab is as thin as the finest volume asks for, and so is the step of the light's image.
    let slabs_of_a_voxel = medium.spacing / width;
    let eye = seen.share * (medium.spacing * seen.samples_per_unit).powi(2);
    let samples_of_a_voxel = slabs_of_a_voxel * (eye + (light_pixels * slabs_of_a_voxel).powi(2));
    let medium_samples = sweeps.max(1.0) * medium.splats * samples_of_a_voxel;
    let has_meshes = asked.facts.meshes.iter().any(|mesh| mesh.stays_triangles);
    OwnWork {
        medium_samples,
        polygon_looks: if has_meshes { points * medium_samples } else { 0.0 },
        soft_samples: moved_samples(points_of_whole, medium.bounds.diagonal() / width, light_pixels),
        ..OwnWork::default()
    }
}

/// Samples of lights' images that are moved in so many slabs, which lie one behind another across the volumes.
pub(super) fn soft_samples(frame: &Frame<'_>, slabs: f64) -> f64 {
    let whole = frame.light_points().iter().filter(|point| is_whole(frame.scene, point));
    moved_samples(whole.count() as f64, slabs, light_pixels(frame.scene))
}

/// The same for so many points of lights that take one sweep: samples of a slab and of its light.
fn moved_samples(points: f64, slabs: f64, light_pixels: f64) -> f64 {
    2.0 * points * slabs * (slabs * light_pixels).powi(2)
}

/// Looks of points of lights at opaque polygons: from each sample of a surface, and from so many of volumes.
pub(super) fn polygon_looks(frame: &Frame<'_>, medium_samples: f64) -> f64 {
    let points = frame.light_points().iter().filter(|point| point.light.intensity != [0.0; 3]).count() as f64;
    let polygons = || frame.loaded.own.iter().filter(|native| native.form.is_polygons());
    let samples = polygons().map(|native| Extent::new(&native.world_box(), &frame.camera).samples);
    let surfaces = samples.sum::<f64>().min(frame.camera.pixels() as f64);
    if polygons().next().is_some() { points * (surfaces + medium_samples) } else { 0.0 }
}

/// Bytes of the largest sweep, among such translucent polygons.
pub(super) fn bytes(
    matter: &Matter<'_>,
    panes: &[PlacedMesh<'_>],
    points: &[LightPoint],
    options: &RenderOptions,
) -> u64 {
    let volumes = volumes(matter).collect::<Vec<_>>();
    let splats = splat_bounds(matter);
    let bodies = Bodies { volumes: &volumes, splats };
    // Of counts alone: no length among the parameters plays a part.
    let form = reconstruction::chosen(matter.scene, matter.own, matter.camera);
    let sheets = params(matter.scene, form.reconstruction, 0, options);
    let params = half_params(matter.scene, sheets);
    let lamps = points.iter().filter_map(|point| swept(matter.scene, point));
    let (served, mapped): (Vec<_>, Vec<_>) =
        lamps.partition(|lamp| serves_extended(&bodies, matter.camera, lamp.0, lamp.1).is_ok());
    let samples = served.iter().map(|(_, samples)| *samples).max().unwrap_or(1);
    let has_polygons = matter.own.iter().any(|native| native.form.is_polygons());
    let polygons = if has_polygons { polygon_bytes(matter.camera, samples, &params) } else { 0 };
    let served = served.into_iter().map(|(light, samples)| SampledLight { light, samples });
    let of_light = |light| light_list_bytes(panes, &bodies, light, params.most_light_pixels);
    let lists = served.clone().map(of_light).max().unwrap_or(0);
    lists + polygons + half::bytes(&bodies, matter.camera, served, mapped.len(), &params)
}

/// Draws all that is translucent into a segment of its own.
pub(super) fn draw(
    frame: &Frame<'_>,
    into: &mut Accumulator,
    session: &mut Session<'_>,
    cost: &mut CostRecord,
) -> Result<(), Error> {
    let polygons = frame.polygons();
    // Opaque splats alone, to which polygons are added.
    let solid = frame.solid(cost)?;
    let means = mean_shadows(frame, cost)?;
    let splats = OwnSplats::new(frame);
    let mut input = input(frame, &solid.depth, &means, cost)?;
    input.polygons = &polygons;
    input.splats = splats.as_ref().map(|splats| splats.input(frame));
    let form = reconstruction::chosen(frame.scene, &frame.loaded.own, &frame.camera);
    let sheets = params(frame.scene, form.reconstruction, frame.loaded.exponent, session.options);
    let params = half_params(frame.scene, sheets);
    super::warn(frame, &input.sheets.volumes, session.warnings);
    frame.progress.begin(stage::SHEETS);
    frame.tick()?;
    let seen = cost.measure(pass::SHEETS, |stage| {
        let mut segment = frame.accumulator();
        let drawn = fold(&input, &params, &frame.layout(), &mut segment, Some(frame.progress));
        let Drawn { counts, polygons } = drawn.map_err(|e| refuse(frame, e))?;
        let splats = splats.as_ref().map_or(0, |splats| splats.cloud.len() as u64);
        stage.items_in = counts.voxels + splats;
        stage.items_out = counts.visible + splats;
        stage.fragments = counts.eye_fragments + counts.light_fragments;
        stage.passes = counts.slabs;
        stage.bytes = counts.bytes;
        into.append(&segment);
        Ok::<_, Error>(polygons)
    })?;
    drop(input);
    frame.set_opaque(solid.joined(seen));
    Ok(())
}

/// Width of the slabs of the first sweep.
pub(super) fn width(frame: &Frame<'_>, params: &Params) -> Result<f64, Error> {
    let volumes = volumes(&frame.matter()).collect::<Vec<_>>();
    let splats = splat_bounds(&frame.matter());
    let bodies = Bodies { volumes: &volumes, splats };
    let carried = frame.light_points().iter().zip(&frame.plan.carried).filter(|(_, carried)| **carried);
    let light = carried.filter_map(|(point, _)| swept(frame.scene, point)).map(|(light, _)| light).next();
    slab_width(&bodies, &frame.camera, light, params).map_err(|e| refuse(frame, e))
}

/// The shadows of what no light is carried through, for each light that is carried whole: by the place of the light.
fn mean_shadows<'a>(frame: &'a Frame<'a>, cost: &mut CostRecord) -> Result<Vec<(usize, MeanTransmittance<'a>)>, Error> {
    let maps = frame.maps_of_others(cost)?;
    let mut means: Vec<(usize, MeanTransmittance<'a>)> = Vec::new();
    let points = frame.light_points().iter().zip(&frame.plan.carried).zip(maps);
    for ((point, _), map) in points.filter(|((point, carried), _)| **carried && is_whole(frame.scene, point)) {
        let Some(map) = map else { continue };
        match means.iter_mut().find(|(light, _)| *light == point.light_index) {
            Some((_, mean)) => mean.0.push(map),
            None => means.push((point.light_index, MeanTransmittance(vec![map]))),
        }
    }
    Ok(means)
}

/// The volumes, the lights that come through them in sweeps, and those that do not.
fn input<'a>(
    frame: &'a Frame<'a>,
    opaque: &'a [f32],
    means: &'a [(usize, MeanTransmittance<'a>)],
    cost: &mut CostRecord,
) -> Result<HalfInput<'a>, Error> {
    let maps = frame.maps(cost)?;
    let of_others = frame.maps_of_others(cost)?;
    let mut lights = Vec::new();
    let mut extended = Vec::new();
    let mut mapped = Vec::new();
    let points = frame.light_points().iter().zip(&frame.plan.carried).enumerate();
    for (k, (point, carried)) in points.filter(|(_, (point, _))| point.light.intensity != [0.0; 3]) {
        let map = if *carried { of_others.get(k) } else { maps.get(k) };
        let lit = LitBy { shadow: map.and_then(Option::as_ref).map(|map| map as _), ..frame.lit(point) };
        match (carried, is_whole(frame.scene, point)) {
            (false, _) => mapped.push(lit),
            (true, false) => lights.push(lit),
            (true, true) if point.rank[0] == 0 => {
                let mean = means.iter().find(|(light, _)| *light == point.light_index);
                let lit = LitBy { light: point.whole, slide: None, shadow: mean.map(|(_, mean)| mean as _) };
                extended.push(Extended { lit, samples: lamp(frame.scene, point).1 });
            }
            (true, true) => {}
        }
    }
    let sheets = frame.sheet_input(volumes(&frame.matter()).collect(), lights);
    Ok(HalfInput { sheets, splats: None, polygons: &[], extended, mapped, opaque })
}

fn half_params(scene: &Scene, sheets: Params) -> HalfParams {
    let plain = HalfParams { sheets, ..HalfParams::default() };
    match scene.render.sheets.slicing {
        Slicing::View => plain,
        Slicing::HalfVector { light_pixels, most_light_pixels, scattering, .. } => {
            let plain = HalfParams { light_pixels, most_light_pixels, ..plain };
            let Some(scene::Scattering { back, cone, voxels_per_cell }) = scattering else { return plain };
            let scattering = if back { Scattering::ForwardAndBack } else { Scattering::Forward };
            HalfParams { scattering, cone, voxels_per_cell, ..plain }
        }
    }
}
