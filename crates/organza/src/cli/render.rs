//! `organza render`.

use super::args::{Frames, RenderArguments};
use super::bar::with_bar;
use super::session::{load_frame, load_scene, path_text, render_options, start_threads};
use super::{console, report};
use organza::output::{self, Format, Metadata, WriteReport, check_target, write_atomically};
use organza::scene::Scene;
use organza::{Error, Progress, Render, RenderOptions, Sequence, Sets, printable};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Least digits of a frame's number in a file name.
const DIGITS: usize = 4;

/// One picture and its files.
struct Job {
    frame: Option<u32>,
    scene: Scene,
    outputs: Vec<PathBuf>,
    cost: Option<PathBuf>,
    checkpoint: Option<PathBuf>,
}

/// What a finished picture has to say.
struct Done {
    text: String,
    json: Value,
    warnings: Vec<String>,
    sets: Option<Sets>,
}

/// Renders and writes, and gives the exit code. Whatever can be refused is refused before any work.
pub(super) fn run(arguments: &RenderArguments) -> Result<u8, Error> {
    let jobs = jobs(arguments)?;
    for job in &jobs {
        job.check(arguments.force)?;
    }
    start_threads(arguments.scene.threads)?;
    let mut done: Vec<Done> = Vec::new();
    let scenes: Vec<Scene> = jobs.iter().map(|job| job.scene.clone()).collect();
    let mut sequence = arguments.frames.map(|_| Sequence::new(&scenes));
    let outcome = with_bar(|progress| {
        for job in &jobs {
            let one = job.run(arguments, sequence.as_mut(), progress)?;
            let interrupted = one.sets.is_some_and(|s| s.interrupted);
            done.push(one);
            if interrupted {
                break;
            }
        }
        Ok(())
    });
    let mut said: Vec<&String> = Vec::new();
    for warning in done.iter().flat_map(|d| &d.warnings) {
        if !said.contains(&warning) {
            console::warn(warning);
            said.push(warning);
        }
    }
    if outcome.is_ok() || !arguments.scene.json {
        console::out(&summary(&jobs, &done, arguments))?;
    }
    outcome?;
    Ok(match done.last().and_then(|d| d.sets) {
        Some(Sets { averaged, asked, interrupted: true }) => {
            console::warn(&format!("interrupted: the picture is the average of {averaged} of {asked} sets"));
            Error::Cancelled.exit_code()
        }
        _ => 0,
    })
}

/// The pictures that are asked for, each with its scene.
fn jobs(arguments: &RenderArguments) -> Result<Vec<Job>, Error> {
    let outputs = outputs(arguments)?;
    let scene = load_scene(&arguments.scene)?;
    let RenderArguments { cost, checkpoint, .. } = arguments;
    let Some(frames) = arguments.frames else {
        return Ok(vec![Job { frame: None, scene, outputs, cost: cost.clone(), checkpoint: checkpoint.clone() }]);
    };
    let Some(count) = scene.frames else {
        let message = format!("--frames: {} has no animation", printable(&scene.file));
        return Err(Error::usage(message, "add the table [animation], see docs/scene.md"));
    };
    let (first, last) = match frames {
        Frames::All => (0, count - 1),
        Frames::Range(first, last) => (first, last),
    };
    if last >= count {
        let message = format!("--frames={first}-{last}: the frames of this scene are 0 to {}", count - 1);
        return Err(Error::usage(message, ""));
    }
    let digits = DIGITS.max(last.to_string().len());
    let job = |frame: u32| {
        let name = |path: &PathBuf| numbered(path, frame, digits);
        Ok(Job {
            frame: Some(frame),
            scene: load_frame(&arguments.scene, Some(frame))?,
            outputs: outputs.iter().map(name).collect(),
            cost: cost.as_ref().map(name),
            checkpoint: checkpoint.as_ref().map(name),
        })
    };
    (first..=last).map(job).collect()
}

/// `picture.exr` → `picture.0007.exr`.
fn numbered(path: &Path, frame: u32, digits: usize) -> PathBuf {
    let number = format!("{frame:0digits$}");
    match path.extension() {
        Some(extension) => path.with_extension(number).with_added_extension(extension),
        None => path.with_added_extension(number),
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

impl Job {
    fn check(&self, force: bool) -> Result<(), Error> {
        let inputs = self.scene.files();
        for path in self.outputs.iter().chain(&self.cost) {
            check_target(path, force, &inputs)?;
        }
        match &self.checkpoint {
            // One that is there is gone on from; the library refuses a file that is something else.
            Some(path) => check_target(path, true, &inputs),
            None => Ok(()),
        }
    }

    fn run(
        &self,
        arguments: &RenderArguments,
        sequence: Option<&mut Sequence>,
        progress: &Progress,
    ) -> Result<Done, Error> {
        let options = RenderOptions { checkpoint: self.checkpoint.clone(), ..render_options(&arguments.scene) };
        let render = match sequence {
            Some(sequence) => sequence.render(&self.scene, &options, progress)?,
            None => organza::render(&self.scene, &options, progress)?,
        };
        let mut warnings = render.warnings.clone();
        let written = self.write_outputs(&render, arguments.half, &mut warnings)?;
        if let Some(path) = &self.cost {
            write_atomically(path, format!("{:#}\n", report::cost_json(&render.cost)).as_bytes())?;
        }
        let (text, json) = (self.text(&render, &written), self.json(&render, &written));
        Ok(Done { text, json, warnings, sets: render.sets })
    }

    fn metadata(&self, render: &Render) -> Metadata {
        Metadata {
            scene_sha256: self.scene.sha256.clone(),
            technique: render.plan.technique.to_owned(),
            seed: self.scene.render.seed,
            backend: render.backend.clone(),
            sets: render.sets.map(|s| s.averaged),
            exposure: self.scene.render.exposure,
        }
    }

    fn write_outputs(
        &self,
        render: &Render,
        half: bool,
        warnings: &mut Vec<String>,
    ) -> Result<Vec<(&Path, WriteReport)>, Error> {
        let metadata = self.metadata(render);
        let mut written = Vec::with_capacity(self.outputs.len());
        for path in &self.outputs {
            let report = output::write(&render.layers, &metadata, path, half)?;
            if report.clamped > 0 {
                warnings.push(format!(
                    "{}: {} values were cut to the format's largest",
                    printable(path),
                    report.clamped
                ));
            }
            if report.not_a_number > 0 {
                let count = report.not_a_number;
                warnings.push(format!("{}: {count} values were not numbers; this is a bug", printable(path)));
            }
            written.push((path.as_path(), report));
        }
        Ok(written)
    }

    fn text(&self, render: &Render, written: &[(&Path, WriteReport)]) -> String {
        let mut text = self.frame.map_or_else(String::new, |frame| format!("frame {frame}\n"));
        text += &report::cost_text(&render.cost);
        if let Some(Sets { averaged, asked, .. }) = render.sets {
            text += &format!("averaged {averaged} of {asked} sets\n");
        }
        for (path, report) in written {
            text += &format!("wrote {} ({} bytes)\n", printable(path), report.bytes);
        }
        text
    }

    fn json(&self, render: &Render, written: &[(&Path, WriteReport)]) -> Value {
        let outputs = written.iter().map(|(path, r)| {
            json!({
                "path": path_text(path), "bytes": r.bytes, "clamped": r.clamped, "not_a_number": r.not_a_number,
            })
        });
        let sets = |s: Sets| json!({ "averaged": s.averaged, "asked": s.asked, "interrupted": s.interrupted });
        let mut document = json!({
            "scene": path_text(&self.scene.file),
            "scene_sha256": self.scene.sha256,
            "size": self.scene.camera.size,
            "seed": self.scene.render.seed,
            "backend": render.backend,
            "outputs": outputs.collect::<Value>(),
            "plan": report::plan_json(&render.plan),
            "cost": report::cost_json(&render.cost),
            "sets": render.sets.map(sets),
            "warnings": render.warnings,
        });
        if let Some(frame) = self.frame {
            document["frame"] = frame.into();
        }
        document
    }
}

/// Of one picture its own account, of frames a list of them.
fn summary(jobs: &[Job], done: &[Done], arguments: &RenderArguments) -> String {
    if !arguments.scene.json {
        return done.iter().map(|d| d.text.as_str()).collect();
    }
    let still = jobs.iter().all(|job| job.frame.is_none());
    let mut documents = done.iter().map(|d| &d.json);
    match (still, documents.next()) {
        (true, Some(document)) => format!("{document:#}\n"),
        _ => format!("{:#}\n", json!({ "frames": done.iter().map(|d| &d.json).collect::<Vec<_>>() })),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_have_a_number_before_the_extension() {
        assert_eq!(numbered("a/b.exr".as_ref(), 7, 4), Path::new("a/b.0007.exr"));
        assert_eq!(numbered("a.b.png".as_ref(), 12345, 5), Path::new("a.b.12345.png"));
        assert_eq!(numbered("sums".as_ref(), 0, 4), Path::new("sums.0000"));
    }
}
