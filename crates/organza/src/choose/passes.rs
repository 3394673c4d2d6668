//! The passes that simulate what a plan has, in the order of running.

use super::row;
use crate::form::Form;
use crate::pass;
use crate::plan::PlannedPass;
use crate::scene::Technique;
use crate::statistics::Statistics;

/// What is opaque, in words.
pub(super) fn what_is_opaque(statistics: &Statistics) -> Option<String> {
    let meshes = statistics.planned.iter().filter(|object| object.form == Form::Polygons).count();
    let counted = |count: u64, what: &str| (count > 0).then(|| format!("{count} {what}"));
    let kinds =
        [counted(statistics.counts.opaque, "opaque splats"), counted(meshes as u64, "opaque meshes of triangles")];
    let present: Vec<String> = kinds.into_iter().flatten().collect();
    (!present.is_empty()).then(|| present.join(" and "))
}

/// The passes of a scene whose lights have these shadow maps.
pub(super) fn passes(statistics: &Statistics, shadow_maps: &[bool]) -> Vec<PlannedPass> {
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
        let is_so = |t: &Technique| shaded(t) == *draws && (!draws || statistics.may_have_splats(*t));
        statistics.techniques.iter().any(is_so)
    };
    // What is not drawn as splats is projected and shaded in the pass of its technique.
    let which = match [true, false].map(|draws| as_they_are(&draws)) {
        [true, true] => "drawn",
        [true, false] => "all",
        _ => "opaque",
    };
    if which != "opaque" || opaque > 0 {
        pass(pass::PROJECT, format!("{which} splats"));
        let skips_hidden = opaque > 0 && statistics.techniques.iter().all(|t| row(*t).skips_hidden);
        let seen = if skips_hidden { "that nothing opaque hides" } else { "in view" };
        pass(pass::SHADE, format!("{which} splats {seen}"));
    }
    if let Some(opaque_things) = what_is_opaque(statistics).filter(|_| opaque > 0 || !statistics.lit_as_drawn) {
        pass(pass::OPAQUE, opaque_things);
    }
    for (row, what) in rows() {
        row.steps.last().into_iter().for_each(|step| what.iter().for_each(|what| pass(step.pass, what.clone())));
    }
    pass(pass::FINISH, "samples become pixels".into());
    passes
}
