//! Scenes and files described: the documents that the command prints with `--json`.

use crate::calls::{Given, How};
use crate::running::run;
use crate::wording;
use organza::output::Target;
use organza::scene::Scene;
use organza::{Context, Error, Explanation, Files, Progress, RenderOptions, printable};
use organza_judge::accuracy::{self, Judged, Report};
use organza_judge::effects::{self, Switch};
use organza_judge::orders::{self, OrdersReport};
use organza_judge::{documents, effects::Measured};
use organza_survey::documents::{facts_json, scene_json};
use organza_survey::facts;
use pyo3::prelude::*;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// The extent of a report, and its place.
#[derive(FromPyObject)]
pub(crate) struct Effort {
    /// A smaller picture, fewer steps, fewer repeats.
    #[pyo3(item)]
    quick: bool,
    /// Doublings of the end of each knob.
    #[pyo3(item)]
    finer: u32,
    /// The folder of the files, which is there; none are written where it is `None`.
    #[pyo3(item)]
    folder: Option<PathBuf>,
    /// Whether files that exist are replaced.
    #[pyo3(item)]
    force: bool,
}

/// Explains what drawing a scene would do; `measure` draws it too, with each effect and without.
#[pyfunction]
pub(crate) fn explain(py: Python<'_>, mut given: Given, measure: bool, how: How<'_>) -> PyResult<String> {
    let options = how.options();
    let in_memory = given.take_memory()?;
    let work = move |progress: &Progress| {
        let scene = given.scene(in_memory.clone(), &options)?;
        if !measure {
            let explanation = organza::explain(&scene, &options, progress);
            let explanation = explanation.map_err(|error| wording::placed(error, &given.text))?;
            return Ok(explained(&scene, explanation, None).to_string());
        }
        let switched = |switches: &[Switch]| {
            let words = |switch: &Switch| format!("{}={}", switch.name, if switch.is_on { "on" } else { "off" });
            let effects: Vec<String> = switches.iter().map(words).collect();
            placed(&given.switched(in_memory.clone(), &options, &effects)?, &options)
        };
        measured(&scene, &switched, &options, progress).map(|document| document.to_string())
    };
    run(py, how.threads, how.progress.as_ref(), work)
}

/// The scene with a camera that has its place.
fn placed(scene: &Scene, options: &RenderOptions) -> Result<Scene, Error> {
    let context = Context { files: &Files::default(), options, progress: &Progress::new() };
    Ok(organza::fitted(scene, context)?.0.into_owned())
}

/// A scene that is drawn as planned, then with each of its effects switched the other way.
fn measured(
    scene: &Scene,
    switched: &dyn Fn(&[Switch]) -> Result<Scene, Error>,
    options: &RenderOptions,
    progress: &Progress,
) -> Result<Value, Error> {
    progress.plan([("the picture as planned", 1.0), ("each effect the other way", 4.0)]);
    progress.begin("the picture as planned");
    let fitted = placed(scene, options)?;
    progress.enter();
    let render = organza::render(scene, options, progress)?;
    progress.leave();
    progress.begin("each effect the other way");
    progress.enter();
    let changes = effects::measure(&render.plan, &fitted, switched, options, progress)?;
    progress.leave();
    let explanation = Explanation {
        plan: render.plan,
        cost: render.cost,
        memory: 0,
        predicted: render.predicted,
        splats: Vec::new(),
        warnings: render.warnings,
        notes: render.notes,
        found: render.found,
    };
    Ok(explained(scene, explanation, Some(&changes)))
}

/// The document of `organza explain --json`. What is known before a picture alone is null where one was drawn.
fn explained(scene: &Scene, explanation: Explanation, measured: Option<&Measured>) -> Value {
    let before = measured.is_none();
    wording::document(json!({
        "scene": Value::Null,
        "camera": documents::camera_json(scene, explanation.found.as_ref()),
        "plan": documents::plan_json(&explanation.plan),
        "cost": documents::cost_json(&explanation.cost),
        "predicted": documents::predicted_json(&explanation.predicted),
        "measured": measured.map(documents::measured_json),
        "memory_bytes": before.then_some(explanation.memory),
        "up": documents::up_json(scene),
        "splats": before.then(|| documents::splats_json(&explanation.splats)),
        "warnings": explanation.warnings,
        "notes": explanation.notes,
    }))
}

/// Describes a data file.
#[pyfunction]
pub(crate) fn info_of_file(py: Python<'_>, file: PathBuf, how: How<'_>) -> PyResult<String> {
    let options = how.options();
    let work = move |_: &Progress| {
        let found = facts(&file, None, options.max_memory, options.strict)?;
        Ok(wording::document(facts_json(&found)).to_string())
    };
    run(py, how.threads, None, work)
}

/// Describes a scene.
#[pyfunction]
pub(crate) fn info_of_scene(py: Python<'_>, mut given: Given, how: How<'_>) -> PyResult<String> {
    let options = how.options();
    let in_memory = given.take_memory()?;
    let work = move |_: &Progress| Ok(scene_json(&given.scene(in_memory, &options)?).to_string());
    run(py, how.threads, None, work)
}

/// Draws a scene by every technique with each of its knobs turned, and judges error and time.
#[pyfunction]
pub(crate) fn judge_accuracy(py: Python<'_>, mut given: Given, effort: Effort, how: How<'_>) -> PyResult<String> {
    let mut options = how.options();
    let in_memory = given.take_memory()?;
    let has_memory = how.max_memory.is_some();
    let work = move |progress: &Progress| {
        let mut scene = placed(&given.scene(in_memory, &options)?, &options)?;
        let extent = accuracy::Options { quick: effort.quick, finer: effort.finer, seed: scene.render.seed };
        if given.size.is_none() {
            accuracy::shrink(&mut scene, extent.longest_side());
        }
        if !has_memory {
            options.max_memory = options.max_memory.min(extent.memory());
        }
        let folder = effort.folder.as_deref();
        let targets = folder.map(|folder| Report::check(folder, effort.force, &scene.files())).transpose()?;
        let Judged { report, is_interrupted } = accuracy::judge(&scene, extent, &options, progress)?;
        if let Some(targets) = &targets {
            accuracy::write(&report, targets)?;
        }
        if is_interrupted {
            return Err(Error::Cancelled);
        }
        reported(&report.json(), targets.iter().flatten())
    };
    run(py, how.threads, how.progress.as_ref(), work)
}

/// Draws a scene by every order of its splats, and compares each with the exact order.
#[pyfunction]
pub(crate) fn judge_orders(py: Python<'_>, mut given: Given, effort: Effort, how: How<'_>) -> PyResult<String> {
    let options = how.options();
    let in_memory = given.take_memory()?;
    let work = move |progress: &Progress| {
        let mut scene = placed(&given.scene(in_memory, &options)?, &options)?;
        let extent = orders::Options { quick: effort.quick };
        if given.size.is_none() {
            accuracy::shrink(&mut scene, extent.longest_side());
        }
        let folder = effort.folder.as_deref();
        let targets = folder.map(|folder| OrdersReport::check(folder, effort.force, &scene.files())).transpose()?;
        let comparison = orders::compare(&scene, &extent, &options, progress)?;
        let is_interrupted = comparison.interrupted.is_some();
        let report = OrdersReport::new(&scene, comparison)?;
        if let Some(targets) = &targets {
            orders::write(&report, targets)?;
        }
        if is_interrupted {
            return Err(Error::Cancelled);
        }
        reported(&report.json(), targets.iter().flatten())
    };
    run(py, how.threads, how.progress.as_ref(), work)
}

/// A report with the files that it was written to.
fn reported<'t>(report: &str, targets: impl Iterator<Item = &'t Target>) -> Result<String, Error> {
    let report: Value = serde_json::from_str(report).map_err(|error| Error::Internal(error.to_string()))?;
    let text = |path: &Path| path.to_str().map_or_else(|| printable(path), str::to_owned);
    let files: Vec<String> = targets.map(|target| text(target.path())).collect();
    Ok(json!({ "outputs": files, "report": report }).to_string())
}
