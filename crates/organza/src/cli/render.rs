//! `organza render`.

use super::args::RenderArguments;
use super::bar::with_bar;
use super::session::{load_scene, path_text, render_options, start_threads};
use super::{console, report};
use organza::output::{self, Format, Metadata, WriteReport, check_target, write_atomically};
use organza::scene::Scene;
use organza::{Error, Render, RenderOptions, Sets, printable};
use serde_json::json;
use std::path::{Path, PathBuf};

/// The backend of this version, as metadata and reports name it.
const BACKEND: &str = "cpu";

/// Renders and writes, and gives the exit code. Whatever can be refused is refused before any work.
pub(super) fn run(arguments: &RenderArguments) -> Result<u8, Error> {
    let outputs = outputs(arguments)?;
    let scene = load_scene(&arguments.scene)?;
    let inputs = scene.files();
    for path in outputs.iter().chain(&arguments.cost) {
        check_target(path, arguments.force, &inputs)?;
    }
    if let Some(path) = &arguments.checkpoint {
        // One that is there is gone on from; the library refuses a file that is something else.
        check_target(path, true, &inputs)?;
    }
    start_threads(arguments.scene.threads)?;
    let options = RenderOptions { checkpoint: arguments.checkpoint.clone(), ..render_options(&arguments.scene) };
    let render = with_bar(|progress| organza::render(&scene, &options, progress))?;
    for warning in &render.warnings {
        console::warn(warning);
    }
    let written = write_outputs(&render, &metadata(&scene, &render), &outputs, arguments.half)?;
    if let Some(path) = &arguments.cost {
        write_atomically(path, format!("{:#}\n", report::cost_json(&render.cost)).as_bytes())?;
    }
    console::out(&summary(&scene, &render, &written, arguments.scene.json))?;
    Ok(match render.sets {
        Some(Sets { averaged, asked, interrupted: true }) => {
            console::warn(&format!("interrupted: the picture is the average of {averaged} of {asked} sets"));
            Error::Cancelled.exit_code()
        }
        _ => 0,
    })
}

fn metadata(scene: &Scene, render: &Render) -> Metadata {
    Metadata {
        scene_sha256: scene.sha256.clone(),
        technique: render.plan.technique.to_owned(),
        seed: scene.render.seed,
        backend: BACKEND.into(),
        sets: render.sets.map(|s| s.averaged),
        exposure: scene.render.exposure,
    }
}

/// The outputs, none twice; the scene's name with `.exr` if none was named.
fn outputs(arguments: &RenderArguments) -> Result<Vec<PathBuf>, Error> {
    let mut outputs = arguments.output.clone();
    if outputs.is_empty() {
        let stem = arguments.scene.scene.file_stem().unwrap_or("picture".as_ref());
        outputs.push(Path::new(stem).with_added_extension("exr"));
    }
    for (i, path) in outputs.iter().enumerate() {
        Format::of_path(path)?;
        let others = [&arguments.cost, &arguments.checkpoint];
        if outputs[..i].contains(path) || others.iter().any(|other| other.as_ref() == Some(path)) {
            return Err(Error::usage(format!("{}: this output is named twice", printable(path)), ""));
        }
    }
    Ok(outputs)
}

fn write_outputs(
    render: &Render,
    metadata: &Metadata,
    outputs: &[PathBuf],
    half: bool,
) -> Result<Vec<(PathBuf, WriteReport)>, Error> {
    let mut written = Vec::with_capacity(outputs.len());
    for path in outputs {
        let report = output::write(&render.layers, metadata, path, half)?;
        if report.clamped > 0 {
            console::warn(&format!("{}: {} values were cut to the format's largest", printable(path), report.clamped));
        }
        if report.not_a_number > 0 {
            let count = report.not_a_number;
            console::warn(&format!("{}: {count} values were not numbers; this is a bug", printable(path)));
        }
        written.push((path.clone(), report));
    }
    Ok(written)
}

fn summary(scene: &Scene, render: &Render, written: &[(PathBuf, WriteReport)], as_json: bool) -> String {
    if !as_json {
        let mut text = report::cost_text(&render.cost);
        if let Some(Sets { averaged, asked, .. }) = render.sets {
            text += &format!("averaged {averaged} of {asked} sets\n");
        }
        for (path, report) in written {
            text += &format!("wrote {} ({} bytes)\n", printable(path), report.bytes);
        }
        return text;
    }
    let outputs = written.iter().map(|(path, r)| {
        json!({
            "path": path_text(path), "bytes": r.bytes, "clamped": r.clamped, "not_a_number": r.not_a_number,
        })
    });
    let document = json!({
        "scene": path_text(&scene.file),
        "scene_sha256": scene.sha256,
        "size": scene.camera.size,
        "seed": scene.render.seed,
        "backend": BACKEND,
        "outputs": outputs.collect::<serde_json::Value>(),
        "plan": report::plan_json(&render.plan),
        "cost": report::cost_json(&render.cost),
        "sets": render.sets.map(|s| json!({ "averaged": s.averaged, "asked": s.asked, "interrupted": s.interrupted })),
        "warnings": render.warnings,
    });
    format!("{document:#}\n")
}
