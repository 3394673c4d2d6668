//! Half-vector slicing of the technique `sheets` (Zhang and Crawfis, section 4): one sweep a light through all that is translucent.
//!
//! Light that no half vector serves has a shadow map, as in slabs across the view, and joins the first sweep.

use super::{params, refuse, volumes};
use crate::form::{Form, PlannedObject};
use crate::frame::Frame;
use crate::lights::LightPoint;
use crate::matter::{Carries, CarriesLight, Matter};
use crate::pass;
use crate::scene::{self, Scene, Slicing, SoftShadows, Technique};
use crate::technique::Session;
use crate::{CostRecord, Error, RenderOptions, stage};
use sheet_light::half::{
    self, Bodies, Extended, HalfInput, HalfParams, HalfSplats, MOST_SAMPLES, Reason, Scattering, SplatBounds, fold,
    penumbra_widening, serves, serves_extended, slab_width,
};
use sheet_light::{Params, SheetInput};
use splat_core::glam::Vec3;
use splat_core::raster::{self, ProjectInput, Projected};
use splat_core::shade::LitBy;
use splat_core::{Aabb, Accumulator, Cloud, DAabb, Light, Receiver, SplatKind, Transmittance};
use tsm::ShadowMap;

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
    let scatters_again = matter.scene.render.sheets.scattering().is_some();
    if let Some(splats) = translucent().find(|o| o.form == Form::Splats)
        && points.iter().any(|point| is_whole(matter.scene, point))
    {
        let message = "a translucent surface, whose shadow of a light with an extent is that of points";
        return refuse(splats, message, ", make it opaque, or use render.sheets.soft_shadows = \"points\"");
    }
    if let Some(splats) = translucent().find(|o| o.form == Form::Splats && scatters_again) {
        let message = "a translucent surface, whose shadow light that is scattered more than once does not have";
        return refuse(splats, message, ", make it opaque, or leave render.sheets.scattering out");
    }
    let (volumes, splats) = (volumes(matter).collect::<Vec<_>>(), splat_bounds(matter));
    let bodies = Bodies { volumes: &volumes, splats };
    let words = |reason: Reason| match reason {
        Reason::LampInside { volume, .. } => {
            let name = &matter.scene.objects[volumes[volume].object as usize].name;
            format!("the lamp lies inside object '{}'", crate::shown(name))
        }
        other => other.to_string(),
    };
    let is_served = |point: &LightPoint| match is_whole(matter.scene, point) {
        true if samples(point) > MOST_SAMPLES => {
            Err(format!("it has {} points, expected at most {MOST_SAMPLES} in one sweep", samples(point)))
        }
        true => serves_extended(&bodies, matter.camera, &point.whole, samples(point)).map_err(words),
        false => serves(&bodies, matter.camera, &point.light).map_err(words),
    };
    Ok(Carries {
        widening: points.iter().map(|point| penumbra_widening(&bodies, &point.whole)).collect(),
        points: points.iter().map(is_served).collect(),
        scatters_again,
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

/// How many points a light has.
fn samples(point: &LightPoint) -> u32 {
    point.rank[1] as u32
}

/// What is swept for a point: its whole light and the points of that, once for all of them, or the point itself.
fn swept<'p>(scene: &Scene, point: &'p LightPoint) -> Option<(&'p Light, u32)> {
    match is_whole(scene, point) {
        true => (point.rank[0] == 0).then(|| (&point.whole, samples(point))),
        false => Some((&point.light, 1)),
    }
}

/// Bytes of the largest sweep.
pub(super) fn bytes(matter: &Matter<'_>, points: &[LightPoint], options: &RenderOptions) -> u64 {
    let (volumes, splats) = (volumes(matter).collect::<Vec<_>>(), splat_bounds(matter));
    let bodies = Bodies { volumes: &volumes, splats };
    // Of counts alone: no length among the parameters plays a part.
    let params = half_params(matter.scene, params(matter.scene, 0, options));
    let is_served = |(light, samples): &(&Light, u32)| match light.shape.is_extended() {
        true => serves_extended(&bodies, matter.camera, light, *samples).is_ok(),
        false => serves(&bodies, matter.camera, light).is_ok(),
    };
    let served = points.iter().filter_map(|point| swept(matter.scene, point)).filter(is_served);
    let mapped = points.iter().filter_map(|point| swept(matter.scene, point)).filter(|light| !is_served(light)).count();
    half::bytes(&bodies, matter.camera, served, mapped, &params)
}

/// Draws all that is translucent into a segment of its own.
pub(super) fn draw(
    frame: &Frame<'_>,
    into: &mut Accumulator,
    session: &mut Session<'_>,
    cost: &mut CostRecord,
) -> Result<(), Error> {
    let opaque = frame.opaque(cost)?;
    let (means, splats) = (mean_shadows(frame, cost)?, OwnSplats::of(frame));
    let mut input = input(frame, &opaque.depth, &means, cost)?;
    input.splats = splats.as_ref().map(|splats| splats.input(frame));
    let params = half_params(frame.scene, params(frame.scene, frame.loaded.exponent, session.options));
    super::warn(frame, &input.sheets.volumes, session.warnings);
    frame.progress.begin(stage::SHEETS);
    frame.tick()?;
    cost.measure(pass::SHEETS, |stage| {
        let mut segment = frame.accumulator();
        let drawn = fold(&input, &params, &frame.layout(), &mut segment, Some(frame.progress));
        let counts = drawn.map_err(|e| refuse(frame, e))?;
        let splats = splats.as_ref().map_or(0, |splats| splats.cloud.len() as u64);
        stage.items_in = counts.voxels + splats;
        stage.items_out = counts.visible + splats;
        stage.fragments = counts.eye_fragments + counts.light_fragments;
        stage.passes = counts.slabs;
        stage.bytes = counts.bytes;
        into.append(&segment);
        Ok(())
    })
}

/// Width of the slabs of the first sweep.
pub(super) fn width(frame: &Frame<'_>, params: &Params) -> Result<f64, Error> {
    let (volumes, splats) = (volumes(&frame.matter()).collect::<Vec<_>>(), splat_bounds(&frame.matter()));
    let bodies = Bodies { volumes: &volumes, splats };
    let carried = frame.light_points().iter().zip(&frame.plan.carried).filter(|(_, carried)| **carried);
    let light = carried.filter_map(|(point, _)| swept(frame.scene, point)).map(|(light, _)| light).next();
    slab_width(&bodies, &frame.camera, light, params).map_err(|e| refuse(frame, e))
}

/// The shadows of what no light is carried through, for each light that is carried whole: by the place of the light.
fn mean_shadows<'a>(frame: &'a Frame<'a>, cost: &mut CostRecord) -> Result<Vec<(usize, MeanShadow<'a>)>, Error> {
    let maps = frame.maps_of_others(cost)?;
    let mut means: Vec<(usize, MeanShadow<'a>)> = Vec::new();
    let points = frame.light_points().iter().zip(&frame.plan.carried).zip(maps);
    for ((point, _), map) in points.filter(|((point, carried), _)| **carried && is_whole(frame.scene, point)) {
        let Some(map) = map else { continue };
        match means.iter_mut().find(|(of, _)| *of == point.of) {
            Some((_, mean)) => mean.0.push(map),
            None => means.push((point.of, MeanShadow(vec![map]))),
        }
    }
    Ok(means)
}

/// Mean transmittance to the points of a light.
struct MeanShadow<'a>(Vec<&'a ShadowMap>);

impl Transmittance for MeanShadow<'_> {
    fn transmittance(&self, receiver: &Receiver) -> [f32; 3] {
        let sum = self.0.iter().fold([0.0; 3], |sum, map| {
            let own = map.transmittance(receiver);
            [0, 1, 2].map(|c| sum[c] + own[c])
        });
        sum.map(|v: f32| v / self.0.len() as f32)
    }
}

/// The volumes, the lights that come through them in sweeps, and those that do not.
fn input<'a>(
    frame: &'a Frame<'a>,
    opaque: &'a [f32],
    means: &'a [(usize, MeanShadow<'a>)],
    cost: &mut CostRecord,
) -> Result<HalfInput<'a>, Error> {
    let maps = frame.maps(cost)?;
    let of_others = frame.maps_of_others(cost)?;
    let (mut lights, mut extended, mut mapped) = (Vec::new(), Vec::new(), Vec::new());
    let points = frame.light_points().iter().zip(&frame.plan.carried).enumerate();
    for (k, (point, carried)) in points.filter(|(_, (point, _))| point.light.intensity != [0.0; 3]) {
        let map = if *carried { of_others.get(k) } else { maps.get(k) };
        let lit = LitBy { light: point.light, shadow: map.and_then(Option::as_ref).map(|map| map as _) };
        match (carried, is_whole(frame.scene, point)) {
            (false, _) => mapped.push(lit),
            (true, false) => lights.push(lit),
            (true, true) if point.rank[0] == 0 => {
                let mean = means.iter().find(|(of, _)| *of == point.of);
                let lit = LitBy { light: point.whole, shadow: mean.map(|(_, mean)| mean as _) };
                extended.push(Extended { lit, samples: samples(point) });
            }
            (true, true) => {}
        }
    }
    let sheets = SheetInput {
        volumes: volumes(&frame.matter()).collect(),
        splats: None,
        camera: &frame.camera,
        lights,
        shadow_origin: frame.loaded.cloud.origin,
        ambient: frame.scene.ambient,
    };
    Ok(HalfInput { sheets, splats: None, extended, mapped, opaque })
}

/// Most slabs where splats alone say how wide they are.
const MOST_SLABS: f64 = 65536.0;

/// Where the splats are that sweeps draw; `None` without any, and before they are made.
fn splat_bounds(matter: &Matter<'_>) -> Option<SplatBounds> {
    let cloud = matter.cloud?;
    let (mut all, mut radii, mut count) = (Aabb::EMPTY, 0.0f64, 0u64);
    for id in own_splats(matter) {
        let (at, radius) = (cloud.position[id as usize], cloud.radius[id as usize]);
        all = all.union(Aabb { min: at, max: at });
        (radii, count) = (radii + f64::from(radius), count + 1);
    }
    let place = |p: Vec3| cloud.origin + p.as_dvec3();
    let bounds = (count > 0).then(|| DAabb::new(place(all.min), place(all.max)))?;
    // Neighbours are about half a radius apart.
    let least = (bounds.diagonal() / MOST_SLABS).max(f64::MIN_POSITIVE);
    Some(SplatBounds { bounds, slab_width: (0.5 * radii / count as f64).max(least), count })
}

/// Ids of the translucent splats of objects that become nothing else.
fn own_splats<'a>(matter: &Matter<'a>) -> impl Iterator<Item = u32> + use<'a> {
    let mut is_own = vec![false; matter.scene.objects.len()];
    matter.own.iter().for_each(|own| is_own[own.object] = true);
    let kinds = matter.cloud.into_iter().flat_map(|cloud| cloud.kind.iter().zip(&cloud.object));
    let is_one = move |kind: SplatKind, object: u32| kind != SplatKind::Opaque && !is_own[object as usize];
    (0..).zip(kinds).filter_map(move |(id, (kind, object))| is_one(*kind, *object).then_some(id))
}

/// The translucent splats of a frame, for which it has no radiance: theirs is found in sweeps.
struct OwnSplats {
    cloud: Cloud,
    projected: Projected,
    slab_width: f64,
}

impl OwnSplats {
    fn of(frame: &Frame<'_>) -> Option<Self> {
        let slab_width = splat_bounds(&frame.matter())?.slab_width;
        let cloud = frame.loaded.cloud.gather(&own_splats(&frame.matter()).collect::<Vec<u32>>());
        let projected = raster::project(&ProjectInput {
            cloud: &cloud,
            camera: &frame.camera,
            footprints: &frame.loaded.footprints,
            materials: &frame.loaded.materials,
            params: &frame.raster_params(),
            detail: frame.detail(),
        });
        Some(Self { cloud, projected, slab_width })
    }

    fn input<'a>(&'a self, frame: &'a Frame<'_>) -> HalfSplats<'a> {
        let Self { cloud, projected, slab_width } = self;
        let (materials, objects) = (&frame.loaded.materials, &frame.loaded.objects);
        let footprints = &frame.loaded.footprints;
        HalfSplats { cloud, materials, objects, footprints, projected, slab_width: *slab_width }
    }
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
