//! The passes and effects that the technique adds to a plan, and those that it lacks.

use crate::load::Loaded;
use crate::pass;
use crate::plan::{Effect, Plan, PlannedPass};
use crate::scene::{OpaqueSurfels, Scene, SurfelGroups, SurfelLayers, Technique};
use splat_core::SplatKind;

/// Adds to a plan how discs are drawn, and the passes that group them where they are; takes those out that shade splats where
/// light falls on pixels alone.
pub(crate) fn plans(scene: &Scene, loaded: &Loaded, plan: &mut Plan) {
    let by = plan.by.clone();
    let draws = plan.draws.clone();
    let settings = &scene.render.surfels;
    let cloud = &loaded.cloud;
    let object = |i: usize| cloud.object[i] as usize;
    let is_ours = |i: usize| by[object(i)] == Technique::Surfels;
    let is_solid = |i: usize| cloud.kind[i] == SplatKind::Opaque && !plan.is_own[object(i)];
    let has_solid = (0..cloud.len()).any(|i| is_ours(i) && is_solid(i));
    let ours = scene.objects.iter().zip(&by).filter(|(o, by)| o.visible && **by == Technique::Surfels);
    let bent = ours.clone().any(|(o, _)| loaded.materials[o.material].bounds_matter());
    let others = (0..cloud.len()).any(|i| !is_ours(i) && (is_solid(i) || draws[object(i)]));
    let deforms = ours.clone().any(|(o, _)| o.deforms);
    if settings.lights_pixels && !bent && !others {
        plan.passes.retain(|p| p.name != pass::PROJECT && p.name != pass::SHADE);
    }
    let mut add = |at: &str, name: &str, reason: String, groups: bool| {
        let Some(at) = plan.passes.iter().position(|p| p.name == at) else { return };
        plan.effects.push(Effect::of_technique(name.into(), "how discs of surfaces are joined", true, reason));
        if groups {
            let reason = "groups of discs that hardly overlap".into();
            plan.passes.insert(at, PlannedPass { name: pass::GROUP.into(), reason });
        }
    };
    if let (true, OpaqueSurfels::OnePass { groups, .. }) = (has_solid, &settings.opaque) {
        let reason = format!("{}, one pass over them", groups.describe(deforms));
        add(pass::OPAQUE, "groups of opaque discs", reason, true);
    }
    let of_groups = |name: &str, groups: &SurfelGroups| {
        let steps = groups.depth_steps.map_or_else(|| "steps as long as `gap`".to_owned(), |n| format!("{n} steps"));
        let described = groups.describe(deforms);
        format!("{name}: the images of {described} are averaged, in each the discs of {steps} of depth")
    };
    let reason = match &settings.layers {
        SurfelLayers::Gaps => "all layers, told apart by gaps in depth".to_owned(),
        SurfelLayers::Peeled(most) => format!("the {most} nearest layers, told apart by gaps in depth"),
        SurfelLayers::Algorithm1(groups) => of_groups("Algorithm 1", groups),
        SurfelLayers::Algorithm2(groups) => of_groups("the nearest layer, before the others by Algorithm 1", groups),
    };
    add(pass::SURFELS, "layers of surfaces", reason, settings.layers.groups().is_some());
}
