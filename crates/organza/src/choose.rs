//! Only what a scene calls for: what is known of it → what draws each object, the effects to simulate, the passes to run.
//!
//! All of it is pure: nothing is read, converted or drawn here. `auto` and every other question about a technique is
//! answered by the table of techniques.

use crate::form::{DRAWN, Form, PlannedObject};
use crate::pass;
use crate::plan::{Effect, Plan, PlannedPass};
use crate::scene::{Scene, SceneObject, Technique};
use crate::shadows::CUT_SHARE;
use crate::statistics::{LightStatistics, ObjectStatistics, Statistics};
use crate::technique::{Row, TABLE};

/// The technique that draws an object: its own, or the scene's, or the first of the table that `auto` may choose.
pub(crate) fn technique_of(object: &SceneObject, scene: &Scene) -> Technique {
    resolved(object.technique.unwrap_or(scene.render.technique))
}

/// `auto` resolved.
pub(crate) fn resolved(technique: Technique) -> Technique {
    match technique {
        Technique::Auto => TABLE.iter().find(|row| row.is_offered).map_or(Technique::Points, |row| row.technique),
        named => named,
    }
}

/// The techniques that draw a scene, in the order of their table; at least one.
pub(crate) fn techniques(scene: &Scene) -> Vec<Technique> {
    let visible = || scene.objects.iter().filter(|o| o.visible);
    let draws = |row: &&Row| visible().any(|o| technique_of(o, scene) == row.technique);
    let used: Vec<Technique> = TABLE.iter().filter(draws).map(|row| row.technique).collect();
    if used.is_empty() { vec![resolved(scene.render.technique)] } else { used }
}

/// What a technique states.
pub(crate) fn row(technique: Technique) -> &'static Row {
    let known = TABLE.iter().find(|row| row.technique == resolved(technique));
    known.expect("invariant: every technique of a scene has a row")
}

/// The form in which its technique takes each of these visible objects, and whether it becomes splats: only where splats are
/// drawn, or are what there is, or where a shadow map may need them.
pub(crate) fn choose<'a>(
    objects: impl Iterator<Item = (&'a ObjectStatistics, Technique)> + Clone,
    lights: &[LightStatistics],
) -> Vec<PlannedObject> {
    let shining = lights.iter().any(|l| l.wants_shadow && !l.is_dark);
    let shadows = shining && objects.clone().any(|(o, _)| o.receives);
    let one = |(object, technique): (&ObjectStatistics, Technique)| {
        let row = row(technique);
        let (form, reason) = row.form.map_or((Form::Splats, DRAWN), |form| form(object));
        let splats = match form {
            Form::Opaque => Some(DRAWN),
            Form::Splats => Some(row.of_splats),
            _ if shadows && object.casts => Some("they may cast a shadow"),
            _ => None,
        };
        PlannedObject { object: object.name.clone(), technique, form, reason, splats }
    };
    objects.map(one).collect()
}

/// Chooses effects and passes.
pub(crate) fn plan(statistics: &Statistics) -> Plan {
    let rows: Vec<&Row> = statistics.techniques.iter().map(|t| row(*t)).collect();
    let names: Vec<&str> = rows.iter().map(|row| row.technique.name()).collect();
    let mut plan =
        Plan { technique: names.join(" and "), techniques: statistics.techniques.clone(), ..Plan::default() };
    // What ends lists of shadow maps takes the rest.
    let tolerance = statistics.tolerance * (1.0 - CUT_SHARE);
    let mut skipped = 0.0;
    for (i, light) in statistics.lights.iter().enumerate() {
        let effect = shadow_effect(i, light, statistics, tolerance - skipped);
        if !effect.called_for {
            skipped += effect.bound;
        }
        plan.shadow_maps.push(effect.called_for);
        plan.effects.push(effect);
    }
    plan.effects.push(colored_extinction(statistics));
    plan.effects.push(normals(statistics));
    plan.effects.push(translucency(statistics));
    plan.effects.push(opaque_surfaces(statistics));
    plan.effects.push(kept_layers(statistics));
    plan.objects = statistics.planned.clone();
    plan.optical_depth_planes = if statistics.colored_extinction { 3 } else { 1 };
    plan.passes = passes(statistics, &plan.shadow_maps);
    plan
}

fn effect(name: impl Into<String>, called_for: bool, reason: impl Into<String>) -> Effect {
    Effect { name: name.into(), called_for, reason: reason.into(), bound: 0.0 }
}

fn shadow_effect(i: usize, light: &LightStatistics, statistics: &Statistics, allowance: f64) -> Effect {
    let name = format!("shadow of light {i}");
    if !light.wants_shadow {
        return effect(name, false, "the light has shadow = false");
    }
    if light.is_dark {
        return effect(name, false, "the light has no intensity");
    }
    if statistics.receivers == 0 {
        return effect(name, false, "nothing can receive it: no lit splat with a shadow coefficient");
    }
    if statistics.casters == 0 {
        return effect(name, false, "nothing can cast it");
    }
    // A displayed pixel is at most 1, so what a shadow can take away is at most its opacity.
    let bound = if statistics.opaque_casters > 0 { 1.0 } else { -libm::expm1(-statistics.caster_optical_depth) };
    let called_for = bound > allowance;
    let reason = if called_for {
        let from = if light.points > 1 { format!(", from {} points", light.points) } else { String::new() };
        format!("{} splats cast and {} receive it{from}", statistics.casters, statistics.receivers)
    } else {
        format!("no ray could lose more than {bound:.1e} of its light")
    };
    Effect { name, called_for, reason, bound }
}

fn colored_extinction(statistics: &Statistics) -> Effect {
    const UNEQUAL: &str = "some material absorbs red, green and blue unequally";
    if statistics.colored_extinction {
        let how: Vec<&str> = statistics.techniques.iter().filter_map(|t| row(*t).by_channel).collect();
        let how = how.iter().map(|how| format!(": {how}")).collect::<String>();
        effect("transmittance per channel", true, format!("{UNEQUAL}{how}"))
    } else {
        effect("transmittance per channel", false, "all materials absorb red, green and blue alike")
    }
}

fn normals(statistics: &Statistics) -> Effect {
    if statistics.normals_needed {
        effect("normals of volumes", true, "a light shades a volume by its gradient, or the layer was asked for")
    } else {
        effect("normals of volumes", false, "no volume is shaded by its gradient, and none is asked for")
    }
}

fn translucency(statistics: &Statistics) -> Effect {
    let some = |t: &Technique| Some(format!("{} {}", statistics.translucent_of(*t)?, row(*t).how));
    let all: Vec<String> = statistics.techniques.iter().filter_map(some).collect();
    if all.is_empty() {
        return effect("translucency", false, "nothing is translucent: nothing to sort");
    }
    effect("translucency", true, all.join("; "))
}

fn opaque_surfaces(statistics: &Statistics) -> Effect {
    let n = statistics.opaque;
    if n > 0 {
        effect("opaque surfaces", true, format!("{n} opaque splats hide what lies behind"))
    } else {
        effect("opaque surfaces", false, "no splat is opaque")
    }
}

fn kept_layers(statistics: &Statistics) -> Effect {
    if statistics.layers.is_empty() {
        effect("extra layers", false, "no layer beside beauty and alpha was asked for")
    } else {
        effect("extra layers", true, format!("asked for: {}", statistics.layers.join(", ")))
    }
}

fn passes(statistics: &Statistics, shadow_maps: &[bool]) -> Vec<PlannedPass> {
    let opaque = statistics.opaque;
    let rows = || statistics.techniques.iter().map(|t| (row(*t), statistics.translucent_of(*t)));
    let mut passes = Vec::new();
    let mut pass = |name: &str, reason: String| passes.push(PlannedPass { name: name.into(), reason });
    pass(pass::READ, "the objects' data".into());
    if statistics.splats > 0 || statistics.own() == 0 {
        pass(pass::CONVERT, format!("{} splats", statistics.splats));
    }
    for (i, light) in statistics.lights.iter().enumerate().filter(|(i, _)| shadow_maps[*i]) {
        (0..light.points).for_each(|_| pass(pass::SHADOW_MAP, format!("light {i}")));
    }
    for (row, what) in rows() {
        let before = row.steps.split_last().map_or(&[][..], |(_, before)| before);
        before.iter().for_each(|step| what.iter().for_each(|what| pass(step.pass, what.clone())));
    }
    let as_they_are = |draws: &bool| statistics.techniques.iter().any(|t| row(*t).draws_splats == *draws);
    // What is not drawn as splats is projected and shaded in the pass of its technique.
    let which = match [true, false].map(|draws| as_they_are(&draws)) {
        [true, true] => "drawn",
        [true, false] => "all",
        _ => "opaque",
    };
    if which != "opaque" || opaque > 0 {
        pass(pass::PROJECT, format!("{which} splats"));
        pass(pass::SHADE, format!("{which} splats in view"));
    }
    if opaque > 0 {
        pass(pass::OPAQUE, format!("{opaque} opaque splats"));
    }
    for (row, what) in rows() {
        row.steps.last().into_iter().for_each(|step| what.iter().for_each(|what| pass(step.pass, what.clone())));
    }
    pass(pass::FINISH, "samples become pixels".into());
    passes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::SurfaceSampler;
    use crate::statistics::ObjectData;

    fn scene() -> Statistics {
        let light = LightStatistics { wants_shadow: true, is_dark: false, points: 1 };
        Statistics {
            translucent: 10,
            opaque: 5,
            receivers: 15,
            casters: 15,
            opaque_casters: 5,
            lights: vec![light],
            tolerance: 1.0 / 255.0,
            normals_needed: true,
            techniques: vec![Technique::Points],
            translucent_by: vec![(Technique::Points, [10, 0]), (Technique::Particles, [10, 0])],
            ..Statistics::default()
        }
    }

    fn has(plan: &Plan, name: &str) -> bool {
        plan.passes.iter().any(|p| p.name == name)
    }

    #[test]
    fn x7_no_shadow_map_without_caster_receiver_or_light() {
        assert!(has(&plan(&scene()), pass::SHADOW_MAP));
        for change in [
            |s: &mut Statistics| s.casters = 0,
            |s: &mut Statistics| s.receivers = 0,
            |s: &mut Statistics| s.lights[0].is_dark = true,
            |s: &mut Statistics| s.lights[0].wants_shadow = false,
            |s: &mut Statistics| s.lights.clear(),
        ] {
            let mut statistics = scene();
            change(&mut statistics);
            assert!(!has(&plan(&statistics), pass::SHADOW_MAP));
        }
    }

    #[test]
    fn every_point_of_a_light_gets_a_map() {
        let mut s = scene();
        let light = LightStatistics { points: 3, ..s.lights[0] };
        s.lights = vec![light, LightStatistics { wants_shadow: false, ..light }];
        let plan = plan(&s);
        assert_eq!(plan.shadow_maps, [true, false]);
        assert_eq!(plan.passes.iter().filter(|p| p.name == pass::SHADOW_MAP).count(), 3);
        assert!(plan.effects[0].reason.ends_with("receive it, from 3 points"), "{}", plan.effects[0].reason);
    }

    #[test]
    fn x7_faint_casters_are_skipped_while_their_bounds_fit_the_tolerance() {
        let mut s = scene();
        s.opaque_casters = 0;
        s.caster_optical_depth = 0.003;
        s.lights = vec![s.lights[0]; 2];
        let plan = plan(&s);
        // Two of 0.003 are above 1/255 together, so the second one is simulated.
        assert_eq!(plan.shadow_maps, [false, true]);
        let skipped: f64 = plan.effects.iter().filter(|e| !e.called_for).map(|e| e.bound).sum();
        assert!(skipped <= s.tolerance);
    }

    #[test]
    fn x7_only_the_passes_for_what_is_there() {
        let mut s = scene();
        s.translucent_by.clear();
        assert!(!has(&plan(&s), pass::SORT) && !has(&plan(&s), pass::SPLAT) && has(&plan(&s), pass::OPAQUE));
        s = scene();
        s.opaque = 0;
        assert!(has(&plan(&s), pass::SORT) && !has(&plan(&s), pass::OPAQUE));
        assert_eq!(plan(&s).optical_depth_planes, 1);
        s.colored_extinction = true;
        assert_eq!(plan(&s).optical_depth_planes, 3);
        s.techniques = vec![Technique::Particles];
        let only = plan(&s);
        assert!(has(&only, pass::PARTICLES) && ![pass::SORT, pass::PROJECT, pass::SPLAT].iter().any(|p| has(&only, p)));
    }

    fn chosen(objects: &[ObjectStatistics], lights: &[LightStatistics]) -> Vec<PlannedObject> {
        choose(objects.iter().map(|o| (o, Technique::Particles)), lights)
    }

    fn object(data: ObjectData) -> ObjectStatistics {
        ObjectStatistics {
            name: "a".into(),
            data,
            opaque: false,
            by_gradient: false,
            casts: true,
            receives: true,
            splats: 7,
        }
    }

    const SUN: LightStatistics = LightStatistics { wants_shadow: true, is_dark: false, points: 1 };

    #[test]
    fn every_kind_of_data_has_its_sampler() {
        let of = |o: ObjectStatistics| chosen(&[o], &[])[0].form;
        assert_eq!(of(object(ObjectData::Points)), Form::Splats);
        assert_eq!(of(object(ObjectData::Triangles)), Form::Triangles);
        let surface = |looseness, by| object(ObjectData::Surface { looseness, trilinear: false, by });
        let auto = |looseness| surface(looseness, SurfaceSampler::Auto);
        assert_eq!(of(auto(2.6)), Form::Lines);
        assert_eq!(of(auto(f64::INFINITY)), Form::Triangles);
        assert_eq!(of(surface(f64::INFINITY, SurfaceSampler::Lines)), Form::Lines);
        assert_eq!(of(surface(2.6, SurfaceSampler::Triangles)), Form::Triangles);
        assert_eq!(of(surface(2.6, SurfaceSampler::Brownian { step: 0.01 })), Form::Brownian);
        let trilinear = |by| of(object(ObjectData::Surface { looseness: 0.0, trilinear: true, by }));
        assert_eq!(trilinear(SurfaceSampler::Auto), Form::Lattice);
        assert_eq!(trilinear(SurfaceSampler::Lines), Form::Lines);
        assert_eq!(of(object(ObjectData::Volume)), Form::Cells);
        assert_eq!(of(object(ObjectData::Density { bounded: true })), Form::Field);
        assert_eq!(of(object(ObjectData::Density { bounded: false })), Form::Cells);
        let lit = ObjectStatistics { by_gradient: true, ..object(ObjectData::Density { bounded: true }) };
        assert_eq!(of(lit), Form::Cells);
        assert_eq!(of(ObjectStatistics { opaque: true, ..auto(2.6) }), Form::Opaque);
    }

    #[test]
    fn x7_only_casters_become_splats_and_only_for_a_light_and_a_receiver() {
        let mesh = object(ObjectData::Triangles);
        let splats = |objects: &[ObjectStatistics], lights: &[LightStatistics]| -> Vec<bool> {
            chosen(objects, lights).iter().map(|s| s.splats.is_some()).collect()
        };
        let shy = ObjectStatistics { casts: false, ..mesh.clone() };
        assert_eq!(splats(&[mesh.clone(), shy.clone()], &[SUN]), [true, false]);
        assert_eq!(splats(&[mesh.clone(), shy.clone()], &[]), [false, false]);
        for light in [LightStatistics { is_dark: true, ..SUN }, LightStatistics { wants_shadow: false, ..SUN }] {
            assert_eq!(splats(&[mesh.clone(), shy.clone()], &[light]), [false, false]);
        }
        let deaf = ObjectStatistics { receives: false, ..mesh };
        assert_eq!(splats(&[deaf.clone(), deaf], &[SUN]), [false, false]);
    }
}
