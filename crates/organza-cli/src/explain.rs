//! `organza explain`.

use super::args::ExplainArguments;
use super::bar::with_bar;
use super::given::given;
use super::machine::rates;
use super::session::{parse_scene, path_text, processor_only, render_options, without_effect};
use super::{console, report};
use organza::scene::{Scene, SceneObject, UpBy};
use organza::{Error, RenderOptions, escape_controls};
use serde_json::{Value, json};

/// Prints the plan; with `--measure` renders too and prints what it cost.
pub(super) fn run(arguments: &ExplainArguments) -> Result<(), Error> {
    processor_only(&arguments.scene)?;
    let rates = rates(arguments.machine.as_deref())?;
    let (given, files) = given(&arguments.scene, None)?;
    let scene = parse_scene(&arguments.scene, &given, None, None)?;
    let options = RenderOptions { rates, ..render_options(&arguments.scene) };
    let (plan, cost, predicted, prepared, (mut warnings, notes, found)) = with_bar(|progress| {
        if arguments.measure {
            let render = organza::render_from(&scene, &options, progress, files)?;
            return Ok((
                render.plan,
                render.cost,
                render.predicted,
                None,
                (render.warnings, render.notes, render.found),
            ));
        }
        let explanation = organza::explain_from(&scene, &options, progress, &files)?;
        let organza::Explanation { plan, cost, memory, predicted, splats, warnings, notes, found } = explanation;
        Ok((plan, cost, predicted, Some((memory, splats)), (warnings, notes, found)))
    })?;
    warnings.extend(without_effect(&arguments.scene, &scene));
    for warning in &warnings {
        console::warn(warning);
    }
    notes.iter().for_each(|note| console::remark(note));
    if !arguments.measure {
        // A render has announced it before it began.
        predicted.announcement(rayon::current_num_threads()).iter().for_each(|sentence| console::remark(sentence));
    }
    if arguments.scene.common.json {
        let document = json!({
            "scene": arguments.scene.inputs.first().map(|path| path_text(path)),
            "camera": report::camera_json(&scene, found.as_ref()),
            "plan": report::plan_json(&plan),
            "cost": report::cost_json(&cost),
            "predicted": report::predicted_json(&predicted),
            "memory_bytes": prepared.as_ref().map(|p| p.0),
            "up": up_json(&scene),
            "splats": prepared.as_ref().map(|p| report::splats_json(&p.1)),
            "warnings": warnings,
            "notes": notes,
        });
        return console::out(&format!("{document:#}\n"));
    }
    let mut text = report::plan_text(&plan);
    text.push('\n');
    text += &report::predicted_text(&predicted);
    text.push('\n');
    text += &report::cost_text(&cost);
    text += &up_text(&scene);
    if let Some(found) = &found {
        text += &format!("\n{}", report::camera_text(found));
    }
    if let Some((memory, splats)) = prepared {
        text += &format!("\n{}\n", report::splats_text(&splats));
        text += &format!("rendering takes at most {} of memory\n", report::bytes_text(memory));
    }
    console::out(&text)
}

/// Visible objects from files, whose data has an axis that points up.
fn from_files(scene: &Scene) -> impl Iterator<Item = &SceneObject> {
    scene.objects.iter().filter(|o| o.visible && o.source.path().is_some())
}

fn up_json(scene: &Scene) -> Value {
    from_files(scene).map(|o| json!({ "object": o.name, "axis": o.up.axis.name(), "by_file": o.up.by == UpBy::File, "by": up_by(o.up.by) })).collect()
}

/// What says which axis points up, for people.
fn up_by(by: UpBy) -> &'static str {
    match by {
        UpBy::File => "by its file",
        UpBy::Scene => "as the scene says",
        UpBy::Nothing => "as nothing says another: transform = { up = \"z\" } of the object turns it",
    }
}

fn up_text(scene: &Scene) -> String {
    let line =
        |o: &SceneObject| format!("{}: {} points up, {}\n", escape_controls(&o.name), o.up.axis.name(), up_by(o.up.by));
    let lines: String = from_files(scene).map(line).collect();
    if lines.is_empty() { lines } else { format!("\n{lines}") }
}
