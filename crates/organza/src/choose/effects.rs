//! The effects that a scene calls for, each with its reason and the bound of what it could change, and the passes that simulate them.

mod lights;
mod scattering;

use super::row;
use crate::form::Form;
use crate::pass;
use crate::plan::{Effect, Plan, PlannedPass};
use crate::scene::Technique;
use crate::shadows::CUT_SHARE;
use crate::shown;
use crate::statistics::Statistics;
use crate::technique::Row;
pub(crate) use scattering::SCATTER;

/// Chooses effects and passes.
pub(crate) fn plan(statistics: &Statistics) -> Plan {
    let rows: Vec<&Row> = statistics.techniques.iter().map(|t| row(*t)).collect();
    let names: Vec<&str> = rows.iter().map(|row| row.technique.name()).collect();
    let mut plan =
        Plan { technique: names.join(" and "), techniques: statistics.techniques.clone(), ..Plan::default() };
    // What ends lists of shadow maps takes the rest.
    let allowance = statistics.tolerance * (1.0 - CUT_SHARE);
    let lights = lights::plan(statistics, allowance);
    plan.effects = lights.effects;
    plan.lights = lights.shine;
    plan.shadow_maps = lights.shadow_maps;
    plan.effects.push(scattering::plan(statistics, allowance - lights.spent));
    plan.effects.push(colored_extinction(statistics));
    plan.effects.push(bending(statistics));
    plan.effects.push(dispersion(statistics));
    plan.effects.push(absorption_inside(statistics));
    plan.effects.push(normals(statistics));
    plan.effects.push(translucency(statistics));
    plan.effects.push(opaque_surfaces(statistics));
    plan.effects.push(kept_layers(statistics));
    plan.objects = statistics.planned.clone();
    let by_channel = statistics.counts.colored_extinction || statistics.disperses || statistics.absorbs_colors;
    plan.optical_depth_planes = if by_channel { 3 } else { 1 };
    plan.passes = passes(statistics, &plan.shadow_maps);
    plan
}

fn effect(name: impl Into<String>, called_for: bool, reason: impl Into<String>) -> Effect {
    Effect { name: name.into(), called_for, reason: reason.into(), bound: 0.0, is_lacking: false }
}

fn colored_extinction(statistics: &Statistics) -> Effect {
    const UNEQUAL: &str = "some material absorbs red, green and blue unequally";
    if statistics.counts.colored_extinction {
        let how: Vec<&str> = statistics.techniques.iter().filter_map(|t| row(*t).by_channel).collect();
        let how = how.iter().map(|how| format!(": {how}")).collect::<String>();
        effect("transmittance per channel", true, format!("{UNEQUAL}{how}"))
    } else {
        effect("transmittance per channel", false, "what all objects consist of absorbs red, green and blue alike")
    }
}

fn bending(statistics: &Statistics) -> Effect {
    let name = "reflection and refraction";
    match statistics.bent.as_slice() {
        [] => effect(name, false, "no surface that bends light is drawn by a technique that can"),
        of => effect(name, true, format!("surfaces of {} bound matter with an index", named(of))),
    }
}

fn dispersion(statistics: &Statistics) -> Effect {
    if statistics.disperses {
        effect("dispersion", true, "an index differs by channel: each has a ray of its own")
    } else {
        effect("dispersion", false, "no index differs by channel")
    }
}

fn absorption_inside(statistics: &Statistics) -> Effect {
    match statistics.absorbing.as_slice() {
        [] => effect("absorption inside", false, "no surface bounds matter that absorbs"),
        of => effect("absorption inside", true, format!("surfaces of {} bound matter that absorbs", named(of))),
    }
}

/// Names of objects, as they are shown.
fn named(names: &[String]) -> String {
    names.iter().map(|name| format!("'{}'", shown(name))).collect::<Vec<_>>().join(", ")
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
    match what_is_opaque(statistics) {
        None => effect("opaque surfaces", false, "nothing is opaque"),
        Some(all) => effect("opaque surfaces", true, format!("{all} hide what lies behind")),
    }
}

/// What is opaque, in words.
fn what_is_opaque(statistics: &Statistics) -> Option<String> {
    let meshes = statistics.planned.iter().filter(|object| object.form == Form::Polygons).count();
    let of = |count: u64, what: &str| (count > 0).then(|| format!("{count} {what}"));
    let kinds = [of(statistics.counts.opaque, "opaque splats"), of(meshes as u64, "opaque meshes of triangles")];
    let all: Vec<String> = kinds.into_iter().flatten().collect();
    (!all.is_empty()).then(|| all.join(" and "))
}

fn kept_layers(statistics: &Statistics) -> Effect {
    if statistics.layers.is_empty() {
        effect("extra layers", false, "no layer beside beauty and alpha was asked for")
    } else {
        effect("extra layers", true, format!("asked for: {}", statistics.layers.join(", ")))
    }
}

fn passes(statistics: &Statistics, shadow_maps: &[bool]) -> Vec<PlannedPass> {
    let opaque = statistics.counts.opaque;
    let rows = || statistics.techniques.iter().map(|t| (row(*t), statistics.translucent_of(*t)));
    let mut passes = Vec::new();
    let mut pass = |name: &str, reason: String| passes.push(PlannedPass { name: name.into(), reason });
    pass(pass::READ, "the objects' data".into());
    if statistics.counts.splats > 0 || statistics.own() == 0 {
        pass(pass::CONVERT, format!("{} splats", statistics.counts.splats));
    }
    for (row, what) in rows() {
        row.prepares.into_iter().for_each(|name| what.iter().for_each(|what| pass(name, what.clone())));
    }
    for (light, _) in statistics.lights.iter().zip(shadow_maps).filter(|(_, has_map)| **has_map) {
        (0..light.points).for_each(|_| pass(pass::SHADOW_MAP, format!("light {}", light.label)));
    }
    for (row, what) in rows() {
        let before = row.steps.split_last().map_or(&[][..], |(_, before)| before);
        before.iter().for_each(|step| what.iter().for_each(|what| pass(step.pass, what.clone())));
    }
    let as_they_are = |draws: &bool| {
        let shaded = |t: &Technique| row(*t).draws_splats && !statistics.lit_as_drawn;
        let of = |t: &Technique| shaded(t) == *draws && (!draws || statistics.may_have_splats(*t));
        statistics.techniques.iter().any(of)
    };
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
    if let Some(all) = what_is_opaque(statistics).filter(|_| opaque > 0 || !statistics.lit_as_drawn) {
        pass(pass::OPAQUE, all);
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
    use crate::statistics::LightStatistics;
    use splat_core::shade::Census;

    fn scene() -> Statistics {
        let light = LightStatistics {
            label: "0".into(),
            casts_shadows: true,
            points: 1,
            radiance: f64::INFINITY,
            opacity: 1.0,
            ..LightStatistics::default()
        };
        Statistics {
            counts: Census {
                translucent: 10,
                opaque: 5,
                receivers: 15,
                casters: 15,
                opaque_casters: 5,
                ..Census::default()
            },
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
            |s: &mut Statistics| s.counts.casters = 0,
            |s: &mut Statistics| s.counts.receivers = 0,
            |s: &mut Statistics| s.lights[0].is_dark = true,
            |s: &mut Statistics| s.lights[0].casts_shadows = false,
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
        let light = LightStatistics { points: 3, ..s.lights[0].clone() };
        s.lights = vec![light.clone(), LightStatistics { casts_shadows: false, ..light }];
        let plan = plan(&s);
        assert_eq!(plan.shadow_maps, [true, false]);
        assert_eq!(plan.passes.iter().filter(|p| p.name == pass::SHADOW_MAP).count(), 3);
        assert!(plan.effects[1].reason.ends_with("receive it, from 3 points"), "{}", plan.effects[1].reason);
    }

    #[test]
    fn x7_faint_casters_are_skipped_while_their_bounds_fit_the_tolerance() {
        let mut s = scene();
        s.counts.opaque_casters = 0;
        s.counts.caster_optical_depth = 0.003;
        let maps = |radiances: [f64; 2]| {
            let mut s = s.clone();
            s.lights = radiances.map(|radiance| LightStatistics { radiance, ..s.lights[0].clone() }).to_vec();
            let plan = plan(&s);
            let skipped: f64 = plan.effects.iter().filter(|e| !e.called_for).map(|e| e.bound).sum();
            assert!(skipped <= s.tolerance);
            plan.shadow_maps
        };
        // Two of 0.003 are above 1/255 together. Of two that are alike none goes: the order of a file would choose.
        assert_eq!(maps([1.0, 1.0]), [true, true]);
        assert_eq!(maps([0.06, 1.0]), [false, true]);
        assert_eq!(maps([1.0, 0.06]), [true, false]);
        assert_eq!(maps([0.02, 0.02]), [true, true]);
    }

    #[test]
    fn x7_only_the_passes_for_what_is_there() {
        let mut s = scene();
        s.translucent_by.clear();
        assert!(!has(&plan(&s), pass::SORT) && !has(&plan(&s), pass::SPLAT) && has(&plan(&s), pass::OPAQUE));
        s = scene();
        s.counts.opaque = 0;
        assert!(has(&plan(&s), pass::SORT) && !has(&plan(&s), pass::OPAQUE));
        assert_eq!(plan(&s).optical_depth_planes, 1);
        s.counts.colored_extinction = true;
        assert_eq!(plan(&s).optical_depth_planes, 3);
        s.techniques = vec![Technique::Particles];
        let only = plan(&s);
        assert!(has(&only, pass::PARTICLES) && ![pass::SORT, pass::PROJECT, pass::SPLAT].iter().any(|p| has(&only, p)));
    }
}
