//! `organza explain`.

use super::args::{ExplainArguments, SceneArguments};
use super::console::bar::with_bar;
use super::given::{Given, given};
use super::machine::rates;
use super::session::{
    parse_scene, parse_switched, path_text, processor_only, render_options, unused_goal, without_effect,
};
use super::{console, report};
use organza::cost::Prediction;
use organza::plan::Plan;
use organza::scene::{FoundCamera, Scene, SceneObject};
use organza::{Context, CostRecord, Error, Files, Progress, RenderOptions, SplatCount, escape_controls};
use organza_judge::documents;
use organza_judge::effects::{self, Measured, Switch};
use serde_json::json;

/// Stages of a measured scene.
const PICTURE: &str = "the picture as planned";
const EFFECTS: &str = "each effect the other way";

/// A scene as it is explained: before it is drawn, or after.
struct Explained {
    plan: Plan,
    cost: CostRecord,
    predicted: Prediction,
    /// Bytes and splats, where nothing was drawn.
    prepared: Option<Prepared>,
    /// Effects drawn with and without, where all was drawn.
    measured: Option<Measured>,
    warnings: Vec<String>,
    notes: Vec<String>,
    found: Option<FoundCamera>,
}

/// Facts of a scene that was prepared and not drawn.
struct Prepared {
    memory: u64,
    splats: Vec<SplatCount>,
}

/// Prints the plan; with `--measure` renders too and prints what it cost, and what each effect changes.
pub(super) fn run(arguments: &ExplainArguments) -> Result<(), Error> {
    processor_only(&arguments.scene)?;
    let rates = rates(arguments.machine.as_deref())?;
    let (given, files) = given(&arguments.scene, None)?;
    let scene = parse_scene(&arguments.scene, &given, None, None)?;
    let options = RenderOptions { rates, ..render_options(&arguments.scene) };
    let mut explained = with_bar(|progress| {
        if arguments.measure {
            return drawn(&arguments.scene, &given, &scene, &options, progress, files);
        }
        let explanation = organza::explain_from(&scene, Context { files: &files, options: &options, progress })?;
        let organza::Explanation { plan, cost, memory, predicted, splats, warnings, notes, found } = explanation;
        let prepared = Some(Prepared { memory, splats });
        Ok(Explained { plan, cost, predicted, prepared, measured: None, warnings, notes, found })
    })?;
    explained.warnings.extend(without_effect(&arguments.scene, &scene));
    explained
        .warnings
        .extend(unused_goal(&scene.render.goal, "`organza explain`, which tells of the scene's own settings"));
    for warning in &explained.warnings {
        console::warn(warning);
    }
    explained.notes.iter().for_each(|note| console::remark(note));
    if !arguments.measure {
        // A render has announced it before it began.
        let sentence = explained.predicted.announcement(rayon::current_num_threads());
        sentence.iter().for_each(|sentence| console::remark(sentence));
    }
    if arguments.scene.common.json {
        let document = json!({
            "scene": arguments.scene.inputs.first().map(|path| path_text(path)),
            "camera": documents::camera_json(&scene, explained.found.as_ref()),
            "plan": documents::plan_json(&explained.plan),
            "cost": documents::cost_json(&explained.cost),
            "predicted": documents::predicted_json(&explained.predicted),
            "measured": explained.measured.as_ref().map(documents::measured_json),
            "memory_bytes": explained.prepared.as_ref().map(|p| p.memory),
            "up": documents::up_json(&scene),
            "splats": explained.prepared.as_ref().map(|p| documents::splats_json(&p.splats)),
            "warnings": explained.warnings,
            "notes": explained.notes,
        });
        return console::out(&format!("{document:#}\n"));
    }
    let mut text = report::plan_text(&explained.plan, &explained.predicted);
    text.push('\n');
    text += &report::predicted_text(&explained.predicted);
    text.push('\n');
    text += &report::cost_text(&explained.cost);
    if let Some(measured) = &explained.measured {
        text += &format!("\n{}", report::measured_text(measured, &explained.plan, scene.render.tolerance));
    }
    text += &up_text(&scene);
    if let Some(found) = &explained.found {
        text += &format!("\n{}", report::camera_text(found));
    }
    if let Some(Prepared { memory, splats }) = explained.prepared {
        text += &format!("\n{}\n", report::splats_text(&splats));
        text += &format!("rendering takes at most {} of memory\n", report::bytes_text(memory));
    }
    console::out(&text)
}

/// The scene drawn as planned, then with each of its effects switched the other way.
fn drawn(
    arguments: &SceneArguments,
    given: &Given,
    scene: &Scene,
    options: &RenderOptions,
    progress: &Progress,
    files: Files,
) -> Result<Explained, Error> {
    progress.plan([(PICTURE, 1.0), (EFFECTS, 4.0)]);
    progress.begin(PICTURE);
    let fitted = organza::fitted(scene, Context { files: &files, options, progress })?.0.into_owned();
    progress.enter();
    let render = organza::render_from(scene, options, progress, files)?;
    progress.leave();
    progress.begin(EFFECTS);
    progress.enter();
    let switched = |switches: &[Switch]| {
        let words = |switch: &Switch| format!("{}={}", switch.name, if switch.is_on { "on" } else { "off" });
        let effects: Vec<String> = switches.iter().map(words).collect();
        parse_switched(arguments, given, &Files::default(), &effects)
    };
    let measured = effects::measure(&render.plan, &fitted, &switched, options, progress)?;
    progress.leave();
    let mut warnings = render.warnings;
    let contradictions = measured.contradictions(&render.plan);
    let remedy = match scene.render.shadow.cells {
        // Cells of shadow maps go by all that casts, so switching an object moves those of the others.
        None => "if it stays so with `render.shadow.cells` stated, please report this scene",
        Some(_) => "please report this scene",
    };
    warnings.extend(contradictions.into_iter().map(|sentence| format!("{sentence}: {remedy}")));
    Ok(Explained {
        plan: render.plan,
        cost: render.cost,
        predicted: render.predicted,
        prepared: None,
        measured: Some(measured),
        warnings,
        notes: render.notes,
        found: render.found,
    })
}

fn up_text(scene: &Scene) -> String {
    let line = |o: &SceneObject| {
        format!("{}: {} points up, {}\n", escape_controls(&o.name), o.up.axis.name(), documents::up_by(o.up.by))
    };
    let lines: String = documents::from_files(scene).map(line).collect();
    if lines.is_empty() { lines } else { format!("\n{lines}") }
}
