//! `organza render`.

pub(crate) mod film;
mod jobs;

use super::args::{GoalArguments, RenderArguments};
use super::console::bar::with_bar;
use super::machine::rates;
use super::session::{open_device, path_text, processor_only, render_options, without_effect};
use super::{console, report};
use jobs::{Drawing, Jobs, Places};
use organza::cost::announcement_of_frames;
use organza::output::{self, Metadata, Target, WriteReport};
use organza::scene::{FoundCamera, Goal, Scene, short};
use organza::{Error, Expected, ExpectedError, GivenUp, Progress, Render, RenderOptions, Sets, WithinGoal, printable};
use organza_judge::documents;
use serde_json::{Value, json};
use splat_core::{MemoryAccount, Reservation};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Stages of a picture; those of the first have names of their own.
const DRAWING: &str = "";
const WRITING: &str = "writing";
/// All frames behind the present one.
const LATER: &str = "later frames";

/// One picture and its files.
struct Job<'a> {
    frame: Option<u32>,
    scene: &'a Scene,
    /// What it is drawn of, as it was named.
    inputs: &'a [PathBuf],
    /// What its files tell of the scene.
    told: String,
    /// Whether that may have comments.
    has_comments: bool,
    /// The camera that was placed for it.
    found: Option<FoundCamera>,
    places: &'a Places,
    /// What it is to keep to, and the options that take out what the scene says of that.
    goal: Goal,
    without_goal: Vec<String>,
}

/// How a picture was drawn that keeps to a goal.
struct Kept {
    goal: Goal,
    given_up: Vec<GivenUp>,
    /// Options that take out what the scene says of a goal.
    without_goal: Vec<String>,
    expected: Duration,
    taken: Duration,
    error: ExpectedError,
    /// Whether the errors are those of this scene.
    is_probed: bool,
    ladder: Vec<Expected>,
    /// The same for programs.
    document: Value,
}

impl Kept {
    /// Options that draw the same picture again.
    fn options(&self) -> impl Iterator<Item = String> + '_ {
        let settings = self.given_up.iter().map(|setting| format!("--set {}={}", setting.key, setting.taken));
        settings.chain(self.without_goal.iter().cloned())
    }

    fn text(&self) -> String {
        let mut text = self.ladder_text();
        let Goal { budget_ms, max_rmse, max_flip } = self.goal;
        let limits = [
            budget_ms.map(|ms| format!("{ms} ms")),
            max_rmse.map(|error| format!("an RMSE of {}", short(error))),
            max_flip.map(|error| format!("a FLIP of {}", short(error))),
        ];
        let limits = limits.into_iter().flatten().collect::<Vec<_>>().join(" and ");
        let [expected, taken] = [self.expected, self.taken].map(|time| time.as_millis());
        // Without a time the ladder is told by figures of a machine, which the clock knows nothing of.
        let expected = if budget_ms.is_some() { format!("expected {expected} ms, ") } else { String::new() };
        text += &format!("within {limits}: {expected}took {taken} ms");
        if self.given_up.is_empty() {
            return text + ", with all that the scene asks for\n";
        }
        let [rmse, flip] = [self.error.rmse, self.error.flip].map(error_text);
        text += &format!(", errs by about {rmse} RMSE and {flip} FLIP");
        if !self.is_probed {
            text += ", as typical scenes do: pictures that tell it of this one would take too much of the time";
        }
        for GivenUp { key, asked, taken } in &self.given_up {
            text += &format!("\n  {key} = {taken}, where the scene has {asked}");
        }
        text += &format!("\n  the same picture again: {}\n", self.options().collect::<Vec<_>>().join(" "));
        text
    }

    /// The settings that were weighed, as a table.
    fn ladder_text(&self) -> String {
        let rows = self.ladder.iter().map(|rung| {
            [
                rung.antialias.to_string(),
                short(rung.splat_share),
                rung.sets.map_or_else(|| "-".to_owned(), |sets| sets.to_string()),
                rung.time.as_millis().to_string(),
                error_text(rung.error.rmse),
                error_text(rung.error.flip),
            ]
        });
        report::table(["antialias", "splat_share", "sets", "ms to draw", "RMSE", "FLIP"], "rrrrrr", rows)
    }

    fn json(&self) -> Value {
        let mut document = self.document.clone();
        document["seconds"] = json!(self.goal.budget_ms.map(|ms| Duration::from_millis(ms).as_secs_f64()));
        document["max_rmse"] = json!(self.goal.max_rmse);
        document["max_flip"] = json!(self.goal.max_flip);
        document["same_again"] = self.options().collect();
        document
    }
}

/// An error as a person reads it: estimates have no third digit.
fn error_text(error: f64) -> String {
    if error <= 0.0 { "0".to_owned() } else { format!("{error:.1e}") }
}

/// What a finished picture has to say.
struct Done {
    /// Its own account, as text or as a JSON document.
    report: String,
    warnings: Vec<String>,
    notes: Vec<String>,
    sets: Option<Sets>,
    /// Predicted seconds of its drawing.
    predicted_seconds: f64,
}

/// What pictures have said so far. An animation may have a million: each sentence is kept once, the text of a frame is printed at once, and
/// documents of frames, which are printed as one at the end, draw on the account of memory.
#[derive(Default)]
struct Said {
    warnings: Vec<String>,
    notes: Vec<String>,
    /// What is printed at the end.
    reports: Vec<String>,
    held: Option<Reservation>,
    sets: Option<Sets>,
}

impl Said {
    /// Takes what a picture says; `memory` is the account of an animation.
    fn add(&mut self, done: Done, is_json: bool, memory: Option<MemoryAccount>) -> Result<(), Error> {
        self.sets = done.sets;
        add_new(&mut self.warnings, done.warnings);
        add_new(&mut self.notes, done.notes);
        match memory {
            Some(_) if !is_json => return console::out_between(&done.report),
            Some(memory) => {
                let bytes = self.held.as_ref().map_or(0, Reservation::bytes) + done.report.len() as u64;
                let what = "the documents of all frames, which --json prints at the end,";
                if self.held.is_none() {
                    self.held = Some(memory.take(what, 0).map_err(Error::Limit)?);
                }
                self.held.iter_mut().try_for_each(|held| held.set(what, bytes)).map_err(Error::Limit)?;
            }
            None => {}
        }
        self.reports.push(done.report);
        Ok(())
    }

    /// Prints warnings and notes.
    fn print_sentences(&self) {
        self.warnings.iter().for_each(|warning| console::warn(warning));
        self.notes.iter().for_each(|note| console::remark(note));
    }

    /// Prints what is not printed yet.
    fn print_reports(&self, is_json: bool, is_still: bool, films: &[film::Written]) -> Result<(), Error> {
        match (is_json, is_still) {
            (false, _) => {
                self.reports.iter().try_for_each(|report| console::account(report))?;
                film::print(films)
            }
            (true, true) => self.reports.iter().try_for_each(|report| console::out(&format!("{report}\n"))),
            (true, false) => self.print_frames(films),
        }
    }

    /// A list of the documents of frames, as one document.
    fn print_frames(&self, films: &[film::Written]) -> Result<(), Error> {
        console::out("{\n  \"frames\": [")?;
        for (i, report) in self.reports.iter().enumerate() {
            let before = if i == 0 { "\n" } else { ",\n" };
            let lines: Vec<String> = report.lines().map(|line| format!("    {line}")).collect();
            console::out(&format!("{before}{}", lines.join("\n")))?;
        }
        console::out(if self.reports.is_empty() { "]" } else { "\n  ]" })?;
        if !films.is_empty() {
            let film = |film: &film::Written| json!({ "path": path_text(&film.path), "frames": film.frames, "bytes": film.bytes });
            console::out(&format!(",\n  \"films\": {}", films.iter().map(film).collect::<Value>()))?;
        }
        console::out("\n}\n")
    }
}

/// Adds the sentences that are not among them yet.
fn add_new(known: &mut Vec<String>, sentences: Vec<String>) {
    for sentence in sentences {
        if !known.contains(&sentence) {
            known.push(sentence);
        }
    }
}

/// Renders and writes, and gives the exit code. Whatever can be refused is refused before any work.
pub(super) fn run(arguments: &RenderArguments) -> Result<u8, Error> {
    let GoalArguments { budget, max_rmse, max_flip } = arguments.goal;
    if budget.is_some() || max_rmse.is_some() || max_flip.is_some() {
        processor_only(&arguments.scene)?;
    }
    let rates = rates(arguments.machine.as_deref())?;
    let (jobs, files) = Jobs::new(arguments)?;
    let mut drawing = jobs.check(files)?;
    let options = RenderOptions { device: open_device(&arguments.scene)?, rates, ..render_options(&arguments.scene) };
    let is_json = arguments.scene.common.json;
    let mut films = jobs.films()?;
    let mut said = Said::default();
    add_new(&mut said.warnings, without_effect(&arguments.scene, jobs.still()));
    add_new(&mut said.warnings, jobs.goal_sentences());
    let outcome = with_bar(|progress| {
        let count = jobs.frames().count();
        for (at, frame) in jobs.frames().enumerate() {
            let (scene, found) = jobs.scene(frame, drawing.sequence())?;
            let places = jobs.places(frame, Target::new)?;
            let told = jobs.told(frame)?;
            let has_comments = jobs.has_comments();
            let job = Job {
                frame,
                scene: &scene,
                inputs: jobs.inputs(),
                told,
                has_comments,
                found,
                places: &places,
                goal: jobs.goal(),
                without_goal: jobs.without_goal().collect(),
            };
            progress.plan([(job.stage(), 1.0), (LATER.to_owned(), (count - at - 1) as f64)]);
            progress.begin(&job.stage());
            progress.enter();
            let one = job.run(arguments, &options, &mut drawing, &mut films, progress)?;
            progress.leave();
            if at == 0 && !jobs.is_still() {
                let seconds = one.predicted_seconds;
                let sentence = announcement_of_frames(count, seconds, &options.rates);
                sentence.iter().for_each(|sentence| progress.announce(sentence));
            }
            let interrupted = one.sets.is_some_and(|s| s.interrupted);
            said.add(one, is_json, drawing.sequence().map(|sequence| sequence.files().memory(&options)))?;
            if interrupted {
                break;
            }
        }
        films.into_iter().filter_map(|film| film.finish().transpose()).collect::<Result<Vec<_>, Error>>()
    });
    // Of pictures before the one that failed what they say is worth knowing, but no document.
    said.print_sentences();
    let films = outcome.as_ref().map_or(&[][..], Vec::as_slice);
    if outcome.is_ok() || !is_json {
        said.print_reports(is_json, jobs.is_still(), films)?;
    }
    outcome?;
    Ok(match said.sets {
        Some(Sets { averaged, asked, interrupted: true }) => {
            console::warn(&format!("interrupted: the picture is the average of {averaged} of {asked} sets"));
            Error::Cancelled.exit_code()
        }
        _ => 0,
    })
}

impl Job<'_> {
    /// Its name among the frames; a single picture needs none.
    fn stage(&self) -> String {
        self.frame.map_or_else(String::new, |frame| format!("frame {frame}"))
    }

    fn run(
        &self,
        arguments: &RenderArguments,
        options: &RenderOptions,
        drawing: &mut Drawing,
        films: &mut [film::Film],
        progress: &Progress,
    ) -> Result<Done, Error> {
        let checkpoint = self.places.checkpoint.as_ref().map(|target| target.path().to_owned());
        let options = RenderOptions { checkpoint, ..options.clone() };
        progress.plan([(DRAWING, 0.95), (WRITING, 0.05)]);
        progress.begin(DRAWING);
        progress.enter();
        let (render, kept) = if self.goal.is_any() {
            let within = drawing.render_within(self.scene, &self.goal, &options, progress)?;
            let document = documents::within_goal_json(&within);
            let WithinGoal { render, given_up, expected, taken, error, is_probed, ladder } = within;
            let without_goal = self.without_goal.clone();
            let goal = self.goal;
            (render, Some(Kept { goal, given_up, without_goal, expected, taken, error, is_probed, ladder, document }))
        } else {
            (drawing.render(self.scene, &options, progress)?, None)
        };
        progress.leave();
        progress.begin(WRITING);
        let mut warnings = render.warnings.clone();
        let written = self.write_outputs(&render, kept.as_ref(), arguments, films, &mut warnings)?;
        if let Some(target) = &self.places.cost {
            target.write(format!("{:#}\n", documents::cost_json(&render.cost)).as_bytes())?;
        }
        progress.finish();
        let report = match arguments.scene.common.json {
            true => format!("{:#}", self.json(&render, kept.as_ref(), &written)),
            false => self.text(&render, kept.as_ref(), &written),
        };
        let threads = rayon::current_num_threads();
        let passes = render.predicted.drawing.iter();
        let predicted_seconds = passes.map(|pass| pass.seconds(&render.predicted.rates, threads)).sum();
        Ok(Done { report, warnings, notes: render.notes, sets: render.sets, predicted_seconds })
    }

    fn metadata(&self, render: &Render, kept: Option<&Kept>) -> Metadata {
        let told = kept.filter(|_| self.has_comments).into_iter();
        let changes = told.flat_map(Kept::options).map(|option| format!("\n# {option}"));
        Metadata {
            scene_sha256: self.scene.sha256.clone(),
            scene: self.told.clone() + &changes.collect::<String>(),
            technique: render.plan.technique.clone(),
            left_out: render.plan.left_out_text(),
            seed: self.scene.render.seed,
            backend: render.backend.clone(),
            sets: render.sets.map(|s| s.averaged),
            exposure: self.scene.render.exposure,
        }
    }

    fn write_outputs(
        &self,
        render: &Render,
        kept: Option<&Kept>,
        arguments: &RenderArguments,
        films: &mut [film::Film],
        warnings: &mut Vec<String>,
    ) -> Result<Vec<(&Path, WriteReport)>, Error> {
        let metadata = self.metadata(render, kept);
        let RenderArguments { half, deep, transparent, .. } = *arguments;
        let legend = if arguments.legend { render.scales.clone() } else { Vec::new() };
        if arguments.legend && legend.is_empty() {
            warnings
                .push("there is no legend: nothing that is drawn has a number that its colour stands for".to_owned());
        }
        let has_background = self.scene.background != [0.0; 3] || self.scene.environment.is_some();
        let params = output::Params { half, deep, transparent, has_background, legend, ..output::Params::default() };
        let mut written = Vec::with_capacity(self.places.outputs.len());
        for target in &self.places.outputs {
            let path = target.path();
            let report = output::write(&render.layers, &metadata, target, &params)?;
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
            if report.too_bright > 0 {
                let count = report.too_bright;
                warnings.push(format!(
                    "{}: {count} translucent pixels are brighter than a straight colour with their opacity can be, and lose light: write an \
                     .exr, which keeps it, or lower --exposure",
                    printable(path)
                ));
            }
            warnings.extend(said_of_legends(printable(path), report));
            written.push((path, report));
        }
        for film in films {
            let (bytes, report) = output::displayed_with_report(&render.layers, &metadata, &params)?;
            warnings.extend(said_of_legends("the film", report));
            film.add(render.layers.size, &bytes)?;
        }
        Ok(written)
    }

    fn text(&self, render: &Render, kept: Option<&Kept>, written: &[(&Path, WriteReport)]) -> String {
        let mut text = self.frame.map_or_else(String::new, |frame| format!("frame {frame}\n"));
        text += &report::cost_text(&render.cost);
        if let Some(Sets { averaged, asked, .. }) = render.sets {
            text += &format!("averaged {averaged} of {asked} sets\n");
        }
        text += &kept.map_or_else(String::new, Kept::text);
        if let Some(found) = render.found.or(self.found) {
            text += &report::camera_text(&found);
        }
        for (path, report) in written {
            text += &format!("wrote {} ({} bytes)\n", printable(path), report.bytes);
        }
        text
    }

    fn json(&self, render: &Render, kept: Option<&Kept>, written: &[(&Path, WriteReport)]) -> Value {
        let outputs = written.iter().map(|(path, r)| {
            json!({
                "path": path_text(path), "bytes": r.bytes, "clamped": r.clamped, "not_a_number": r.not_a_number,
            })
        });
        let sets = |s: Sets| json!({ "averaged": s.averaged, "asked": s.asked, "interrupted": s.interrupted });
        let mut document = json!({
            "scene": self.inputs.first().map(|path| path_text(path)),
            "inputs": self.inputs.iter().map(|path| path_text(path)).collect::<Value>(),
            "camera": documents::camera_json(self.scene, render.found.or(self.found).as_ref()),
            "scene_sha256": self.scene.sha256,
            "size": self.scene.camera.size,
            "seed": self.scene.render.seed,
            "backend": render.backend,
            "outputs": outputs.collect::<Value>(),
            "plan": documents::plan_json(&render.plan),
            "cost": documents::cost_json(&render.cost),
            "predicted": documents::predicted_json(&render.predicted),
            "sets": render.sets.map(sets),
            "budget": kept.map(Kept::json),
            "warnings": render.warnings,
            "notes": render.notes,
        });
        if let Some(frame) = self.frame {
            document["frame"] = frame.into();
        }
        document
    }
}

/// Warnings about what a picture does not show of its legends.
fn said_of_legends(picture: impl std::fmt::Display, report: WriteReport) -> Vec<String> {
    let WriteReport { without_room, boxes, .. } = report;
    let counted = |count: u64, what: &str| if count == 1 { format!("a {what}") } else { format!("{count} {what}s") };
    let room = (without_room > 0)
        .then(|| format!("{picture}: there is no room for {}; use a larger --size", counted(without_room, "legend")));
    let letters = (boxes > 0).then(|| {
        format!(
            "{picture}: {} of legends have no form but a box; write them in Latin or Greek ones",
            counted(boxes, "letter")
        )
    });
    room.into_iter().chain(letters).collect()
}
