//! Groups of discs, as the algorithms of the paper ask for: found once for each object, and kept while it only moves.

use crate::cost::{Count, Item};
use crate::frame::Frame;
use crate::scene::{Collisions, Coverage, Grouping, Scene, SceneObject, SurfelGroups};
use crate::{CostRecord, Error, escape_controls};
use crate::{pass, stage as stages};
use deferred_blend::grouping::{self, CloudMembers, KeptGroups, Membership, Method, Recipe};

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
        Grouping::Hash(kind) => Method::Hash(collisions(kind)),
    };
    let settings = &frame.settings.surfels;
    let disc_scale = settings.disc_scale as f32;
    let gap = settings.gap as f32;
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

/// The groups of discs that are drawn, all of a kind, by their places. The cost record has all discs, and those that were grouped anew.
pub(super) fn members(
    frame: &Frame<'_>,
    groups: &SurfelGroups,
    ids: &[u32],
    are_opaque: bool,
    cost: &mut CostRecord,
) -> Result<Membership, Error> {
    let transforms = super::discs::transforms(frame);
    let objects = &frame.scene.objects;
    let placed_recipe = |rank: usize| (transforms[rank], recipe(groups, frame, &objects[rank]));
    frame.progress.begin(stages::GROUP);
    cost.measure(pass::GROUP, |stage| {
        let groups = &mut *frame.groups.borrow_mut();
        let kept = if are_opaque { &mut groups.opaque } else { &mut groups.translucent };
        let made = kept.members_of_all(frame.drawn(), ids, placed_recipe, Some(frame.progress));
        let CloudMembers { membership, regrouped } =
            made.map_err(|refused| refuse(&objects[refused.object], refused.error))?;
        stage.items_in = ids.len() as u64;
        stage.items_out = regrouped;
        stage.bytes = membership.bytes();
        Ok(membership)
    })
}

fn refuse(object: &SceneObject, error: deferred_blend::Error) -> Error {
    match error {
        deferred_blend::Error::Limit(exceeded) => Error::Limit(exceeded.owned_by(
            &format!("object '{}'", escape_controls(&object.name)),
            "set render.surfels.grouping = \"hash\", collisions = \"keep\" and coverage = \"bound\", or a larger spacing",
        )),
        other => super::discs::refuse(other),
    }
}

/// Work of grouping so many discs; those that are enlarged look at all discs beside each.
pub(crate) fn counts(scene: &Scene, discs: f64) -> Vec<Count> {
    let settings = &scene.render.surfels;
    let item = |groups: &SurfelGroups| {
        if groups.coverage == Coverage::Enlarged { Item::EnlargedDisc } else { Item::GroupedDisc }
    };
    let groups = [settings.layers.groups(), settings.opaque.groups()].into_iter().flatten();
    groups.map(|groups| Count::new(item(groups), discs)).collect()
}

/// Bytes of grouping so many discs, of a cloud of these bytes.
pub(super) fn bytes(scene: &Scene, discs: u64, cloud: u64) -> u64 {
    let settings = &scene.render.surfels;
    let group_bytes = |groups: &SurfelGroups| {
        let method = match groups.grouping {
            Grouping::Hash(Collisions::Keep) => Method::Hash(grouping::Collisions::Keep),
            _ => Method::Weighted,
        };
        let coverage = coverage(groups.coverage, &method);
        let recipe = Recipe { method, groups: groups.count, coverage, disc_scale: 1.0, gap: settings.gap as f32 };
        recipe.bytes(discs) + KeptGroups::place_bytes(discs) + cloud
    };
    [settings.layers.groups(), settings.opaque.groups()].into_iter().flatten().map(group_bytes).sum()
}
