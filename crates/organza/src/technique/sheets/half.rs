//! Half-vector slicing of the technique `sheets` (Zhang and Crawfis, section 4): one sweep a light through all volumes.
//!
//! Light that no half vector serves has a shadow map, as in slabs across the view, and joins the first sweep.

use super::{params, refuse, volumes};
use crate::form::{Form, PlannedObject};
use crate::frame::Frame;
use crate::lights::LightPoint;
use crate::matter::{Carries, CarriesLight, Matter};
use crate::pass;
use crate::scene::{self, Scene, Slicing, Technique};
use crate::technique::Session;
use crate::{CostRecord, Error, RenderOptions, stage};
use sheet_light::half::{self, HalfInput, HalfParams, Reason, Scattering, fold, serves, slab_width};
use sheet_light::{Params, SheetInput, Volume};
use splat_core::Accumulator;
use splat_core::shade::LitBy;

/// What a user can do where half vectors cannot.
const HINT: &str = "use render.sheets.slicing = \"view\"";

/// How light is carried where a scene asks for half vectors.
pub(crate) fn carries(scene: &Scene) -> Option<CarriesLight> {
    is_asked(scene).then_some(points_served as CarriesLight)
}

pub(super) fn is_asked(scene: &Scene) -> bool {
    matches!(scene.render.sheets.slicing, Slicing::HalfVector { .. })
}

/// For each point of a light: whether half vectors serve it, or why not.
fn points_served(matter: &Matter<'_>, points: &[LightPoint]) -> Result<Carries, Error> {
    let translucent = || matter.planned.iter().filter(|o| o.form != Form::Opaque);
    let refuse = |o: &PlannedObject, message: &str, or: &str| {
        Err(Error::input(format!("object '{}'", crate::shown(&o.object)), message, format!("{HINT}{or}")))
    };
    if let Some(other) = translucent().find(|o| o.technique != Technique::Sheets) {
        let message =
            format!("drawn by {}, where half-vector sheets draw alone what is translucent", other.technique.name());
        return refuse(other, &message, "");
    }
    if let Some(splats) = translucent().find(|o| o.form == Form::Splats) {
        let message = "translucent, but no volume, density, cloud or medium, which half-vector sheets are of";
        return refuse(splats, message, ", or make it opaque");
    }
    let volumes: Vec<Volume<'_>> = volumes(matter).collect();
    let words = |reason: Reason| match reason {
        Reason::LampInside { volume, .. } => {
            let name = &matter.scene.objects[volumes[volume].object as usize].name;
            format!("the lamp lies inside object '{}'", crate::shown(name))
        }
        other => other.to_string(),
    };
    let points = points.iter().map(|point| serves(&volumes, matter.camera, &point.light).map_err(words)).collect();
    Ok(Carries { points, scatters_again: matter.scene.render.sheets.scattering().is_some() })
}

/// Bytes of the largest sweep.
pub(super) fn bytes(matter: &Matter<'_>, points: &[LightPoint], options: &RenderOptions) -> u64 {
    let volumes: Vec<Volume<'_>> = volumes(matter).collect();
    // Of counts alone: no length among the parameters plays a part.
    let params = half_params(matter.scene, params(matter.scene, 0, options));
    let served = points.iter().map(|point| &point.light).filter(|light| serves(&volumes, matter.camera, light).is_ok());
    half::bytes(&volumes, matter.camera, served, &params)
}

/// Draws all volumes into a segment of its own.
pub(super) fn draw(
    frame: &Frame<'_>,
    into: &mut Accumulator,
    session: &mut Session<'_>,
    cost: &mut CostRecord,
) -> Result<(), Error> {
    let opaque = frame.opaque(cost)?;
    let input = input(frame, &opaque.depth, cost)?;
    let params = half_params(frame.scene, params(frame.scene, frame.loaded.exponent, session.options));
    super::warn(frame, &input.sheets.volumes, session.warnings);
    frame.progress.begin(stage::SHEETS);
    frame.tick()?;
    cost.measure(pass::SHEETS, |stage| {
        let mut segment = frame.accumulator();
        let drawn = fold(&input, &params, &frame.layout(), &mut segment, Some(frame.progress));
        let counts = drawn.map_err(|e| refuse(frame, e))?;
        stage.items_in = counts.voxels;
        stage.items_out = counts.visible;
        stage.fragments = counts.eye_fragments + counts.light_fragments;
        stage.passes = counts.slabs;
        stage.bytes = counts.bytes;
        into.append(&segment);
        Ok(())
    })
}

/// Width of the slabs of the first sweep.
pub(super) fn width(frame: &Frame<'_>, params: &Params) -> Result<f64, Error> {
    let volumes: Vec<Volume<'_>> = volumes(&frame.matter()).collect();
    let carried = frame.light_points().iter().zip(&frame.plan.carried).find(|(_, carried)| **carried);
    let light = carried.map(|(point, _)| &point.light);
    slab_width(&volumes, &frame.camera, light, params).map_err(|e| refuse(frame, e))
}

/// The volumes, the lights that come through them in sweeps, and those that do not.
fn input<'a>(frame: &'a Frame<'a>, opaque: &'a [f32], cost: &mut CostRecord) -> Result<HalfInput<'a>, Error> {
    let maps = frame.maps(cost)?;
    let of_others = frame.maps_of_others(cost)?;
    let carried = frame.plan.carried.iter().enumerate();
    let of_each = carried.map(|(k, carried)| {
        let map = if *carried { of_others.get(k) } else { maps.get(k) };
        (*carried, map.and_then(Option::as_ref))
    });
    let (mut lights, mut mapped) = (Vec::new(), Vec::new());
    for (light, (carried, map)) in frame.with_light(of_each) {
        let lit = LitBy { light, shadow: map.map(|map| map as _) };
        if carried { &mut lights } else { &mut mapped }.push(lit);
    }
    let sheets = SheetInput {
        volumes: volumes(&frame.matter()).collect(),
        splats: None,
        camera: &frame.camera,
        lights,
        shadow_origin: frame.loaded.cloud.origin,
        ambient: frame.scene.ambient,
    };
    Ok(HalfInput { sheets, mapped, opaque })
}

fn half_params(scene: &Scene, sheets: Params) -> HalfParams {
    let plain = HalfParams { sheets, ..HalfParams::default() };
    match scene.render.sheets.slicing {
        Slicing::View => plain,
        Slicing::HalfVector { light_pixels, most_light_pixels, scattering } => {
            let plain = HalfParams { light_pixels, most_light_pixels, ..plain };
            let Some(scene::Scattering { back, cone, voxels_per_cell }) = scattering else { return plain };
            let scattering = if back { Scattering::ForwardAndBack } else { Scattering::Forward };
            HalfParams { scattering, cone, voxels_per_cell, ..plain }
        }
    }
}
