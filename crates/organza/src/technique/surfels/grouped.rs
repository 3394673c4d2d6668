//! Groups of discs, as the algorithms of the paper ask for: found once for each object, and kept while it only moves.

use crate::frame::Frame;
use crate::pass;
use crate::plan::{Effect, Plan, PlannedPass};
use crate::scene::{Collisions, Coverage, Grouping, Scene, SceneObject, SurfelGroups, SurfelLayers, Technique};
use crate::{CostRecord, Error, escape_controls};
use deferred_blend::grouping::{self, KeptGroups, Membership, Method, Recipe};
use glam::DVec3;
use splat_core::Cloud;
use std::collections::BTreeMap;

/// Groups of objects by their rank in the scene, and how they were made.
pub(crate) type Kept = BTreeMap<usize, (Recipe, KeptGroups)>;

/// How the discs of an object are grouped, seen by some camera.
fn recipe(groups: &SurfelGroups, frame: &Frame<'_>, object: &SceneObject) -> Recipe {
    let unit = libm::exp2(f64::from(-frame.loaded.exponent));
    let eye = frame.camera.position;
    let collisions = |collisions| match collisions {
        Collisions::Keep => grouping::Collisions::Keep,
        Collisions::Resolve => grouping::Collisions::Resolve,
        Collisions::Near(distance) => grouping::Collisions::ResolveNear { eye, distance: distance * unit },
    };
    let method = match groups.grouping {
        Grouping::Auto if object.deforms => Method::Hash(grouping::Collisions::Resolve),
        Grouping::Auto | Grouping::Weighted => Method::Weighted,
        Grouping::Minimum { factor } => Method::Minimum { factor: factor as f32 },
        Grouping::Hash(of) => Method::Hash(collisions(of)),
    };
    let settings = &frame.settings.surfels;
    let (disc_scale, gap) = (settings.disc_scale as f32, settings.gap as f32);
    Recipe { method, groups: groups.count, coverage: coverage(groups.coverage, &method), disc_scale, gap }
}

fn coverage(asked: Coverage, method: &Method) -> grouping::Coverage {
    match asked {
        Coverage::Auto if matches!(method, Method::Hash(_)) => grouping::Coverage::Bound,
        Coverage::Auto | Coverage::Duplicates => grouping::Coverage::Duplicates,
        Coverage::Partial => grouping::Coverage::Partial,
        Coverage::Enlarged => grouping::Coverage::Enlarged,
        Coverage::Bound => grouping::Coverage::Bound,
    }
}

/// The groups of all discs that are drawn, by their places; `None` where the scene asks for none. The cost record has all discs, and those
/// that were grouped anew.
pub(super) fn members(
    frame: &Frame<'_>,
    mut kept: Option<&mut Kept>,
    cost: &mut CostRecord,
) -> Result<Option<Membership>, Error> {
    let Some(groups) = frame.settings.surfels.layers.groups() else { return Ok(None) };
    let cloud = frame.drawn();
    let mut of_object: BTreeMap<usize, Vec<u32>> = BTreeMap::new();
    for id in frame.translucent(cloud, Technique::Surfels) {
        of_object.entry(cloud.object[id as usize] as usize).or_default().push(id);
    }
    cost.measure(pass::GROUP, |stage| {
        let mut parts = Vec::new();
        for (rank, ids) in &of_object {
            let object = &frame.scene.objects[*rank];
            let recipe = recipe(groups, frame, object);
            let discs = Discs { cloud: cloud.gather(ids), object, frame };
            let (members, is_new) = discs.members(*rank, &recipe, kept.as_deref_mut())?;
            stage.items_in += ids.len() as u64;
            stage.items_out += if is_new { ids.len() as u64 } else { 0 };
            parts.push((ids.as_slice(), members));
            frame.tick()?;
        }
        let all = Membership::join(cloud.len(), &parts);
        stage.bytes = all.bytes();
        Ok(Some(all))
    })
}

/// The discs of one object.
struct Discs<'a> {
    cloud: Cloud,
    object: &'a SceneObject,
    frame: &'a Frame<'a>,
}

impl Discs<'_> {
    /// Their groups, and whether they are new: those that were kept, or new ones, which are kept.
    fn members(&self, rank: usize, recipe: &Recipe, kept: Option<&mut Kept>) -> Result<(Membership, bool), Error> {
        let group = || recipe.group(&self.cloud, Some(self.frame.progress)).map_err(|e| self.refuse(e));
        let Some(kept) = kept else { return Ok((group()?, true)) };
        let (places, radius) = self.on_object();
        let found = kept.get(&rank).filter(|(of, _)| of == recipe).and_then(|(_, groups)| groups.of(&places, radius));
        if let Some(found) = found {
            return Ok((found, false));
        }
        let members = group()?;
        kept.insert(rank, (*recipe, KeptGroups::new(&places, radius, members.clone())));
        Ok((members, true))
    }

    /// Where they lie on the object, and the radius of the smallest there.
    fn on_object(&self) -> (Vec<DVec3>, f64) {
        let (cloud, transform) = (&self.cloud, &self.object.transform);
        let (unit, turn) = (libm::exp2(f64::from(self.frame.loaded.exponent)), transform.rotation.inverse());
        let place =
            |p: &glam::Vec3| turn * ((cloud.origin + p.as_dvec3()) * unit - transform.translation) / transform.scale;
        let least = cloud.radius.iter().copied().fold(f32::INFINITY, f32::min);
        (cloud.position.iter().map(place).collect(), f64::from(least) * unit / transform.scale)
    }

    fn refuse(&self, error: deferred_blend::Error) -> Error {
        match error {
            deferred_blend::Error::Limit(exceeded) => Error::Limit(exceeded.of(
                &format!("object '{}'", escape_controls(&self.object.name)),
                "set render.surfels.grouping = \"hash\", collisions = \"keep\" and coverage = \"bound\", or a larger spacing",
            )),
            other => super::refuse(other),
        }
    }
}

/// Bytes of grouping so many discs, of a cloud of these bytes.
pub(super) fn bytes(scene: &Scene, discs: u64, cloud: u64) -> u64 {
    let settings = &scene.render.surfels;
    let Some(groups) = settings.layers.groups() else { return 0 };
    let method = match groups.grouping {
        Grouping::Hash(Collisions::Keep) => Method::Hash(grouping::Collisions::Keep),
        _ => Method::Weighted,
    };
    let coverage = coverage(groups.coverage, &method);
    let recipe = Recipe { method, groups: groups.count, coverage, disc_scale: 1.0, gap: settings.gap as f32 };
    recipe.bytes(discs) + KeptGroups::place_bytes(discs) + cloud
}

/// Adds to a plan how discs become layers, and the pass that groups them where they are.
pub(crate) fn plans(scene: &Scene, plan: &mut Plan) {
    let by = plan.by.clone();
    let of_groups = |name: &str, groups: &SurfelGroups| {
        let changes = |(o, by): (&SceneObject, &Technique)| o.visible && o.deforms && *by == Technique::Surfels;
        let deforms = groups.grouping == Grouping::Auto && scene.objects.iter().zip(&by).any(changes);
        let how = match groups.grouping {
            Grouping::Auto if deforms => "weighted colouring, where the animation changes a shape by hashing",
            Grouping::Auto | Grouping::Weighted => "weighted colouring",
            Grouping::Minimum { .. } => "minimum colouring",
            Grouping::Hash(_) => "hashing",
        };
        let steps = groups.depth_steps.map_or_else(|| "steps as long as `gap`".to_owned(), |n| format!("{n} steps"));
        format!(
            "{name}: the images of {} groups by {how} are averaged, in each the discs of {steps} of depth",
            groups.count
        )
    };
    let (reason, groups) = match &scene.render.surfels.layers {
        SurfelLayers::Gaps => ("all layers, told apart by gaps in depth".to_owned(), false),
        SurfelLayers::Peeled(most) => (format!("the {most} nearest layers, told apart by gaps in depth"), false),
        SurfelLayers::Algorithm1(groups) => (of_groups("Algorithm 1", groups), true),
        SurfelLayers::Algorithm2(groups) => {
            (of_groups("the nearest layer, before the others by Algorithm 1", groups), true)
        }
    };
    plan.effects.push(Effect { name: "layers of surfaces".into(), called_for: true, reason, bound: 0.0 });
    if groups && let Some(at) = plan.passes.iter().position(|p| p.name == pass::SURFELS) {
        let reason = "groups of discs that hardly overlap".into();
        plan.passes.insert(at, PlannedPass { name: pass::GROUP.into(), reason });
    }
}
