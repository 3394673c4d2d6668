//! Plans, costs and predictions as JSON: the documents that `--json` and `--cost` write, and that programs read.

use crate::effects::{EffectChange, FixedEffect, Measured};
use organza::cost::{CountedPass, EffectWork, Prediction};
use organza::plan::{Estimate, Plan, PlannedObject, PlannedSetting};
use organza::scene::{ComparedTechnique, FoundCamera, Scene, SceneObject, UpBy};
use organza::{CostRecord, Expected, GivenUp, ShadowTable, SplatCount, WithinGoal};
use serde_json::{Value, json};

/// The cost record as JSON, a list of stages.
pub fn cost_json(cost: &CostRecord) -> Value {
    let stage = |s: &splat_core::StageCost| {
        json!({
            "name": s.name, "seconds": s.seconds, "items_in": s.items_in, "items_out": s.items_out,
            "fragments": s.fragments, "bytes": s.bytes, "passes": s.passes,
        })
    };
    cost.stages.iter().map(stage).collect()
}

/// How a picture keeps to a time or an error: expected and reached, the settings that gave way, and the ladder of those that were weighed.
pub fn within_goal_json(within: &WithinGoal) -> Value {
    let setting = |setting: &GivenUp| json!({ "key": setting.key, "asked": setting.asked, "taken": setting.taken });
    let rung = |rung: &Expected| {
        json!({
            "antialias": rung.antialias, "splat_share": rung.splat_share, "sets": rung.sets,
            "seconds": rung.time.as_secs_f64(), "rmse": rung.error.rmse, "flip": rung.error.flip,
        })
    };
    json!({
        "expected_seconds": within.expected.as_secs_f64(),
        "taken_seconds": within.taken.as_secs_f64(),
        "expected_rmse": within.error.rmse,
        "expected_flip": within.error.flip,
        "errors_of": if within.is_probed { "this scene" } else { "typical scenes" },
        "given_up": within.given_up.iter().map(setting).collect::<Value>(),
        "ladder": within.ladder.iter().map(rung).collect::<Value>(),
    })
}

/// The camera's placement, and whether the fit chose it.
pub fn camera_json(scene: &Scene, found: Option<&FoundCamera>) -> Value {
    let (camera, target) = found.map_or((&scene.camera, scene.target), |found| (&found.camera, found.target));
    json!({
        "auto": found.is_some(),
        "position": camera.position.to_array(),
        "target": target.to_array(),
        "forward": camera.axes[2].to_array(),
        "up": camera.axes[1].to_array(),
    })
}

/// Counted work of each pass with its predicted time, as JSON.
pub fn predicted_json(predicted: &Prediction) -> Value {
    let threads = rayon::current_num_threads();
    let pass = |p: &CountedPass| {
        let counts = p.counts.iter().map(|c| (c.item.name().to_owned(), json!(c.number)));
        json!({
            "name": p.pass, "stage": p.stage, "counts": counts.collect::<serde_json::Map<_, _>>(),
            "seconds_of_one_core": p.seconds(&predicted.rates, 1), "seconds": p.seconds(&predicted.rates, threads),
        })
    };
    let effect = |work: &EffectWork| {
        json!({
            "name": work.effect, "seconds": work.seconds(&predicted.rates, threads), "bytes": work.bytes,
            "passes": work.passes.iter().filter(|pass| pass.has_work()).map(pass).collect::<Value>(),
        })
    };
    json!({
        "by": predicted.rates.source(),
        "threads": threads,
        "effects": predicted.effects.iter().map(effect).collect::<Value>(),
        "passes": predicted.passes().map(pass).collect::<Value>(),
        "seconds_of_one_core": predicted.seconds(1),
        "seconds": predicted.seconds(threads),
        "announcement": predicted.announcement(threads),
    })
}

/// Visible objects from files, whose data has an axis that points up.
pub fn from_files(scene: &Scene) -> impl Iterator<Item = &SceneObject> {
    scene.objects.iter().filter(|o| o.visible && o.source.path().is_some())
}

/// The axis that points up in the data of each object, and what states it.
pub fn up_json(scene: &Scene) -> Value {
    from_files(scene).map(|o| json!({ "object": o.name, "axis": o.up.axis.name(), "by_file": o.up.by == UpBy::File, "by": up_by(o.up.by) })).collect()
}

/// The origin of the axis that points up, in words.
pub fn up_by(by: UpBy) -> &'static str {
    match by {
        UpBy::File => "by its file",
        UpBy::Scene => "as the scene says",
        UpBy::Nothing => "as the file states no axis: transform = { up = \"z\" } of the object turns it",
    }
}

/// Splats by object as JSON.
pub fn splats_json(splats: &[SplatCount]) -> Value {
    let object =
        |s: &SplatCount| json!({ "object": s.object, "predicted": s.predicted, "exact": s.exact, "made": s.made });
    splats.iter().map(object).collect()
}

/// The plan as JSON.
pub fn plan_json(plan: &Plan) -> Value {
    let effects = plan
        .effects
        .iter()
        .map(|e| json!({
            "name": e.name, "what": e.what, "called_for": e.called_for, "lacking": e.is_lacking, "in_scene": !e.is_absent,
            "reason": e.reason, "bound": e.bound.number(),
        }));
    let passes = plan.passes.iter().map(|p| json!({ "name": p.name, "reason": p.reason }));
    json!({
        "technique": plan.technique,
        "effects": effects.collect::<Value>(),
        "estimates": plan.estimates.iter().map(|e| estimate_json(plan, e)).collect::<Value>(),
        "compared": plan.compared.iter().map(compared_json).collect::<Value>(),
        "settings": plan.settings.iter().map(setting_json).collect::<Value>(),
        "passes": passes.collect::<Value>(),
        "optical_depth_planes": plan.optical_depth_planes,
        "shadow_maps": plan.shadow_maps,
        "shadow_tables": plan.shadow_tables.iter().map(|t| t.as_ref().map(table_json)).collect::<Value>(),
        "samplers": plan.chosen().iter().map(object_json).collect::<Value>(),
    })
}

fn estimate_json(plan: &Plan, estimate: &Estimate) -> Value {
    let error = estimate.displayed_error;
    json!({
        "technique": estimate.technique.name(), "object": estimate.of_object, "what": estimate.what,
        // JSON has no infinity: an error that is not known is none.
        "displayed_error": error.is_finite().then_some(error),
        "draws": plan.is_drawn_as(estimate), "reason": estimate.words,
    })
}

fn compared_json(compared: &ComparedTechnique) -> Value {
    let error = compared.displayed_error;
    json!({
        "object": compared.object, "drawn_by": compared.drawn_by,
        // As in estimates.
        "displayed_error": error.is_finite().then_some(error),
        "seconds": compared.seconds, "taken": compared.is_taken, "reason": compared.reason,
    })
}

fn setting_json(setting: &PlannedSetting) -> Value {
    let PlannedSetting { key, value, is_stated, reason } = setting;
    json!({ "key": key, "value": value, "stated": is_stated, "reason": reason })
}

fn table_json(t: &ShadowTable) -> Value {
    let p = &t.predicted;
    json!({
        "columns": p.size[0], "rows": p.size[1], "cells": p.limit.to_string(), "entries": p.entries as u64, "bytes": p.bytes,
        "map_bytes": p.map_bytes,
        "absorbance_cut": t.absorbance_cut(),
    })
}

fn object_json(o: &PlannedObject) -> Value {
    json!({
        "object": o.object, "technique": o.technique.name(), "source": o.form.name(), "reason": o.reason,
        "becomes_splats": o.splats,
    })
}

/// Changes and times of effects, as JSON.
pub fn measured_json(measured: &Measured) -> Value {
    let change = |change: &EffectChange| {
        json!({
            "name": change.name, "largest_change": change.largest, "share_beyond_tolerance": change.beyond_tolerance,
            "seconds_with": change.seconds_with, "seconds_without": change.seconds_without,
        })
    };
    let fixed = |fixed: &FixedEffect| json!({ "name": fixed.name, "reason": fixed.reason });
    json!({
        "seconds": measured.seconds,
        "splats": measured.lit.map(|splats| json!({ "lit": splats.lit, "in_view": splats.in_view })),
        "effects": measured.changes.iter().map(change).collect::<Value>(),
        "not_switched": measured.fixed.iter().map(fixed).collect::<Value>(),
        "left_out_together": measured.left_out_together,
    })
}
