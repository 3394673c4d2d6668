//! Light that a technique carries through what it draws: no shadow map need have that, and which maps are left to build.

use crate::Error;
use crate::choose::{row, techniques};
use crate::form::{Form, PlannedObject};
use crate::frame::matter::{Carries, CarriesLight, Matter};
use crate::load::Loaded;
use crate::plan::{Effect, Plan};
use crate::scene::{EffectKind, LightPoint, Scene, SceneLight, light_points};
use crate::shadows::MapRequest;
use crate::shown;
use crate::statistics::ObjectStatistics;
use splat_core::shade::Census;
use splat_core::{Object, SplatKind};

/// How light is carried in a scene, if any technique of it does.
pub(crate) fn of_scene(scene: &Scene) -> Option<CarriesLight> {
    techniques(scene).into_iter().find_map(|technique| (row(technique).carries)(&scene.render))
}

/// Whether nothing needs a shadow of what is drawn from its own data but that itself, through which all light is carried. Beside
/// translucent splats that is not known before they are made.
pub(crate) fn is_all(
    carries: CarriesLight,
    matter: &Matter<'_>,
    statistics: &[ObjectStatistics],
    lights: &[SceneLight],
) -> Result<bool, Error> {
    if matter.planned.iter().any(|planned| planned.form == Form::Splats) {
        return Ok(false);
    }
    let points = light_points(lights);
    let answers = carries(matter, &points)?.points;
    let is_no_shadow = |point: &LightPoint| !lights[point.light_index].shadow || point.light.intensity == [0.0; 3];
    let receives = |(o, planned): (&ObjectStatistics, &PlannedObject)| o.receives && !planned.form.is_own();
    Ok(!statistics.iter().zip(matter.planned).any(receives)
        && points.iter().zip(&answers).all(|(point, carries)| carries.is_ok() || is_no_shadow(point)))
}

/// Asks the techniques of a plan, and tells what they answer of each light whose shadow is called for.
pub(crate) fn plan(scene: &Scene, loaded: &Loaded, points: &[LightPoint], plan: &mut Plan) -> Result<(), Error> {
    let Some(carries) = of_scene(scene) else { return Ok(()) };
    let cloud = Some(&loaded.cloud);
    let matter = Matter { scene, own: &loaded.own, planned: &plan.objects, cloud, camera: &loaded.camera };
    let asked = carries(&matter, points)?;
    let carries = &asked.points;
    let scattering = match (asked.scatters_again, asked.has_scattering_media) {
        (true, true) => Scattering::Again,
        (true, false) => Scattering::NoMedium,
        (false, _) => Scattering::Once,
    };
    let scatters_again = scattering == Scattering::Again;
    let called_for = |point: &LightPoint| plan.shadow_maps[point.light_index];
    plan.carried = points.iter().zip(carries).map(|(point, carries)| called_for(point) && carries.is_ok()).collect();
    // The layer is there even where nothing fills it.
    plan.scatters_again = asked.scatters_again;
    let missing = loaded.own.iter().any(|native| !native.has_splats && loaded.objects[native.object].casts_shadow);
    if missing && points.iter().zip(carries).any(|(point, carries)| called_for(point) && carries.is_err()) {
        return Err(Error::Internal("splats that a shadow map needs were not made".into()));
    }
    let is_left = |light: usize| {
        plan.shadow_maps[light] && points.iter().zip(carries).any(|(point, c)| point.light_index == light && c.is_err())
    };
    plan.scattered_once = if scatters_again { (0..plan.shadow_maps.len()).filter(|l| is_left(*l)).count() } else { 0 };
    if let Some(scatter) = plan
        .effects
        .iter_mut()
        .find(|effect| effect.name == EffectKind::Scatter.word())
        .filter(|_| plan.scattered_once > 0)
    {
        scatter.is_lacking = true;
        scatter.reason += "; of lights that are not carried it is scattered once all the same";
    }
    let told = |light: usize| plan.shadow_maps[light] || scatters_again;
    let effects: Vec<Effect> = (0..plan.shadow_maps.len())
        .filter(|light| told(*light))
        .map(|light| {
            let point_carries: Vec<_> =
                points.iter().zip(carries).filter(|(point, _)| point.light_index == light).map(|(_, c)| c).collect();
            let (called_for, reason) = way(&point_carries, plan.shadow_maps[light], scattering);
            let label = &loaded.lights[light].label;
            let soft = EffectKind::Soft.name(label);
            let soft = plan.effects.iter_mut().find(|effect| effect.name == soft && effect.called_for);
            if let Some((soft, ways)) = soft.zip(softness(light, points, &asked, called_for)) {
                soft.reason = ways;
            }
            let what = "light that slabs carry through what they draw, without a shadow map";
            Effect::of_technique(format!("carried.{label}"), what, called_for, reason)
        })
        .collect();
    // Behind the light itself and its shadow.
    let is_of_lights = |effect: &Effect| effect.name.starts_with(EffectKind::Shadow.word());
    let behind = plan.effects.iter().rposition(is_of_lights).map_or(plan.effects.len(), |last| last + 1);
    plan.effects.splice(behind..behind, effects);
    Ok(())
}

/// How often the media scatter light.
#[derive(Clone, Copy, PartialEq)]
enum Scattering {
    Once,
    /// More is requested, and no visible medium scatters.
    NoMedium,
    Again,
}

/// Whether any of the points of a light is carried, and how its light comes through volumes, in words.
fn way(points: &[&Result<(), String>], has_shadow: bool, scattering: Scattering) -> (bool, String) {
    if !has_shadow {
        return (false, "its shadow is left out, and so it is scattered once".into());
    }
    let carried = points.iter().filter(|carries| carries.is_ok()).count();
    let of_all = if points.len() > 1 { format!("{carried} of {} points; ", points.len()) } else { String::new() };
    let reason = match points.iter().find_map(|carries| carries.as_ref().err()) {
        Some(why) => format!("a shadow map has it, scattered once: {why}"),
        None => {
            let more = match scattering {
                Scattering::Once => "",
                Scattering::NoMedium => "; no medium that is seen scatters it",
                Scattering::Again => ", and is scattered there again and again",
            };
            format!("it comes through slabs that light and view share{more}")
        }
    };
    (carried > 0, of_all + &reason)
}

/// How the shadow of a light with an extent becomes soft, in words; `None` for a light without one.
fn softness(light: usize, points: &[LightPoint], asked: &Carries, is_carried: bool) -> Option<String> {
    let k = points.iter().position(|point| point.light_index == light && point.whole.shape.is_extended())?;
    let [_, all] = points[k].rank;
    let way = match (is_carried, asked.together) {
        (true, true) => format!("one sweep sees each slab from {all} points of it"),
        (true, false) => format!("a sweep for each of {all} points of it"),
        (false, _) => format!("a shadow map for each of {all} points of it"),
    };
    Some(format!("{way}; penumbras widen by {:.3} of the distance to what casts them", asked.widening[k]))
}

/// Objects with opaque discs beside translucent ones: where light is carried through these, maps of opaque objects leave both out.
pub(crate) fn unshadowed(scene: &Scene, loaded: &Loaded) -> impl Iterator<Item = String> {
    let mut has = vec![[false; 2]; loaded.objects.len()];
    if of_scene(scene).is_some() && !loaded.lights.is_empty() {
        let splats = loaded.cloud.kind.iter().zip(&loaded.cloud.object);
        splats.for_each(|(kind, object)| has[*object as usize][usize::from(*kind == SplatKind::Opaque)] = true);
    }
    let mixed = loaded.objects.iter().zip(has).filter(|(_, has)| *has == [true; 2]).map(|(object, _)| &object.name);
    let what = "opaque points beside translucent ones, which neither cast nor receive shadows where slabs carry light";
    mixed.map(move |name| format!("object '{}' has {what}: put them into a file of their own", shown(name)))
}

/// The maps that are wanted: one for each point of a light, of the objects that cast its shadows, and one for each point of [`Plan::others`], if there
/// are any.
pub(crate) fn requested_maps<'a>(
    loaded: &Loaded,
    points: &'a [LightPoint],
    casting: &'a [Vec<Object>],
    others: Option<&'a [Object]>,
    plan: &Plan,
) -> Vec<Option<MapRequest<'a>>> {
    let called_for = |point: &LightPoint| plan.shadow_maps[point.light_index];
    let Some(others) = others else {
        let of_all = points.iter().zip(casting);
        return of_all.map(|(point, objects)| called_for(point).then_some((point, &objects[..]))).collect();
    };
    // Who receives light beside what it is carried through, and who casts shadows there.
    let beside = Census::new(&loaded.cloud, &loaded.materials, others, &loaded.footprints);
    let is_carried = !plan.carried.is_empty();
    let receives = if is_carried { beside.receivers > 0 } else { loaded.receives_beside_polygons() };
    // Without a technique that carries light, all light on triangles has a z-buffer.
    let asks_others = |k: usize| if is_carried { plan.carried[k] } else { called_for(&points[k]) };
    let of_points = points.iter().zip(casting).enumerate().map(|(k, (point, objects))| {
        let is_requested = called_for(point) && (!asks_others(k) || receives);
        is_requested.then_some((point, &objects[..]))
    });
    let of_others = points.iter().enumerate().map(|(k, point)| {
        let is_requested = asks_others(k) && beside.casters > 0;
        is_requested.then_some((point, others))
    });
    of_points.chain(of_others).collect()
}
