//! `organza accuracy`.

use super::args::AccuracyArguments;
use super::console;
use super::console::bar::with_bar;
use super::session::{in_folder, load_scene, path_text, processor_only, refuse_technique_and_layers, render_options};
use organza::output::Target;
use organza::scene::Scene;
use organza::{Error, Progress, RenderOptions, printable};
use organza_judge::accuracy::{self, Absent, Facts, Options, Outcome, Renderer, Report, Request, Study, Sweep};
use organza_judge::truth::{self, Orders, Truth};
use serde_json::json;
use std::fmt::Write;

/// Stages with their shares, about as long as they take for `scenes/mixed.toml`.
const STAGES: [(&str, f64); 6] = [
    ("first look", 1.0),
    ("physical truth", 8.0),
    ("settings of points", 10.0),
    ("settings of particles", 10.0),
    ("settings of sheets", 20.0),
    ("settings of surfels", 10.0),
];

/// Techniques that come after `points`.
const FURTHER: [&str; 3] = ["particles", "sheets", "surfels"];

/// Sweeps the knobs, judges, writes the report. Whatever can be refused is refused before any work. A report that is interrupted is written
/// with the techniques that it has.
pub(super) fn run(arguments: &AccuracyArguments) -> Result<(), Error> {
    processor_only(&arguments.scene)?;
    refuse_technique_and_layers("accuracy", &arguments.scene)?;
    let mut scene = load_scene("accuracy", &arguments.scene)?;
    let options = Options { quick: arguments.quick, finer: arguments.finer, seed: scene.render.seed };
    if arguments.scene.common.size.is_none() {
        accuracy::shrink(&mut scene, options.longest_side());
    }
    in_folder(&arguments.out, || {
        let targets = Report::check(&arguments.out, arguments.force, &scene.files())?;
        let mut render = render_options(&arguments.scene);
        if arguments.scene.common.max_memory.is_none() {
            render.max_memory = render.max_memory.min(options.memory());
        }
        let mut studies: Vec<Study> = Vec::new();
        let mut absent = Vec::new();
        let swept = with_bar(|progress| {
            progress.plan(STAGES);
            let mut renderer = Renderer::new(&render, progress);
            progress.begin(STAGES[0].0);
            let facts = renderer.facts(&accuracy::in_points(&scene))?;
            let sweep = accuracy::points(&scene, &facts, &options);
            progress.begin(STAGES[1].0);
            let truth = truth(&scene, &render, &options, progress)?;
            progress.begin(STAGES[2].0);
            studies.push(accuracy::study(&sweep, truth, &options, progress, &mut |request| renderer.draw(request))?);
            for (technique, (stage, _)) in FURTHER.into_iter().zip(&STAGES[3..]) {
                progress.begin(stage);
                progress.tick(0).map_err(|_| Error::Cancelled)?;
                let points = &studies[0];
                let study = match technique {
                    "particles" => particles(&scene, &facts, &options, points, &mut renderer, progress)?,
                    "sheets" => sheets(&scene, &options, points, &mut renderer, progress)?,
                    _ => surfels(&scene, &options, points, &mut renderer, progress)?,
                };
                match study {
                    Ok(study) => studies.push(study),
                    Err(reason) => absent.push(reason),
                }
            }
            Ok(())
        });
        let is_interrupted = matches!(swept, Err(Error::Cancelled)) && !studies.is_empty();
        if is_interrupted {
            let reached = studies.len() + absent.len() - 1;
            absent
                .extend(FURTHER[reached..].iter().map(|technique| Absent { technique, reason: "interrupted".into() }));
        } else {
            swept?;
        }
        let report = Report::new(&scene, options, studies, absent);
        accuracy::write(&report, &targets)?;
        console::out(&summary(&report, &targets, arguments.scene.common.json))?;
        if is_interrupted { Err(Error::Cancelled) } else { Ok(()) }
    })
}

/// The scene's truth, and what its orders of scattering leave out; or why there is none.
fn truth(
    scene: &Scene,
    render: &RenderOptions,
    options: &Options,
    progress: &Progress,
) -> Result<Result<Truth, String>, Error> {
    let mut truth_of_scene = truth::truth(scene, render, Orders::of(scene), options.truth_samples(), progress)?;
    if let Ok(scene_orders) = &mut truth_of_scene
        && let Ok(every_order) = truth::truth(scene, render, Orders::All, options.truth_samples(), progress)?
    {
        scene_orders.all_orders = Some(scene_orders.beside(&every_order)?);
    }
    Ok(truth_of_scene)
}

/// The study of `particles`, by the limit and the truth of `points`; or why there is none.
fn particles(
    scene: &Scene,
    facts: &Facts,
    options: &Options,
    points: &Study,
    renderer: &mut Renderer<'_>,
    progress: &Progress,
) -> Result<Result<Study, Absent>, Error> {
    let absent = |reason| Ok(Err(Absent { technique: "particles", reason }));
    let sweep = match accuracy::particles(scene, facts, options) {
        Ok(sweep) => sweep,
        Err(reason) => return absent(reason),
    };
    if let Some(reason) = renderer.refused(&sweep.base.scene)? {
        return absent(reason);
    }
    let mut draw = |request: &Request| renderer.draw(request);
    accuracy::random_study(
        &sweep,
        accuracy::Yardsticks { limit: &points.limit, truth: points.truth.clone() },
        options,
        progress,
        &mut draw,
    )
    .map(Ok)
}

/// The study of `sheets`, by a limit of its own and the truth of `points`; or why there is none.
fn sheets(
    scene: &Scene,
    options: &Options,
    points: &Study,
    renderer: &mut Renderer<'_>,
    progress: &Progress,
) -> Result<Result<Study, Absent>, Error> {
    let absent = |reason| Ok(Err(Absent { technique: "sheets", reason }));
    let drawn = accuracy::in_sheets(scene);
    if let Some(reason) = renderer.refused(&drawn)? {
        return absent(reason);
    }
    if !renderer.runs(&drawn, organza::pass::SHEETS)? {
        return absent("nothing is translucent, so the picture is that of `points`".into());
    }
    let slab_width = match renderer.slab_width(&drawn) {
        Err(limit @ Error::Limit(_)) => return absent(limit.to_string()),
        found => found?,
    };
    let facts = renderer.facts(&drawn)?;
    by_own_limit(&accuracy::sheets(scene, slab_width, &facts, options), options, points, renderer, progress)
}

/// The study of `surfels`, by a limit of its own and the truth of `points`; or why there is none.
fn surfels(
    scene: &Scene,
    options: &Options,
    points: &Study,
    renderer: &mut Renderer<'_>,
    progress: &Progress,
) -> Result<Result<Study, Absent>, Error> {
    let absent = |reason| Ok(Err(Absent { technique: "surfels", reason }));
    let drawn = accuracy::in_surfels(scene);
    if let Some(reason) = renderer.refused(&drawn)? {
        return absent(reason);
    }
    if !renderer.runs(&drawn, organza::pass::SURFELS)? {
        return absent("no surface is translucent: the picture is that of `points`".into());
    }
    let facts = renderer.facts(&drawn)?;
    by_own_limit(&accuracy::surfels(scene, &facts, options), options, points, renderer, progress)
}

/// A study whose limit is the technique's own, and whose truth is that of `points`.
fn by_own_limit(
    sweep: &Sweep,
    options: &Options,
    points: &Study,
    renderer: &mut Renderer<'_>,
    progress: &Progress,
) -> Result<Result<Study, Absent>, Error> {
    match accuracy::study(sweep, points.truth.clone(), options, progress, &mut |request| renderer.draw(request)) {
        Ok(study) => Ok(Ok(study)),
        Err(Error::Unresolved { message, .. }) => Ok(Err(Absent { technique: sweep.technique, reason: message })),
        Err(other) => Err(other),
    }
}

fn summary(report: &Report, files: &[Target], as_json: bool) -> String {
    if as_json {
        let files: Vec<String> = files.iter().map(|f| path_text(f.path())).collect();
        let report: serde_json::Value = serde_json::from_str(&report.json()).unwrap_or_default();
        return format!("{:#}\n", json!({ "outputs": files, "report": report }));
    }
    let mut text = String::new();
    for study in &report.studies {
        text += &study_text(study);
        text += "\n";
    }
    for absent in &report.absent {
        let _ = writeln!(text, "no technique {}: {}\n", absent.technique, absent.reason);
    }
    if report.studies.len() > 1 {
        text += "frontier over all techniques with one limit, from the most accurate to the fastest\n";
        for [study, setting] in &report.frontier {
            let study = &report.studies[*study];
            let _ = writeln!(text, "  {:>9}  {}", study.technique, outcome_text(&study.outcomes[*setting]));
        }
    }
    text += "what to write into the scene for each of them stands in accuracy.html, and as `toml` in accuracy.json\n";
    for file in files {
        let _ = writeln!(text, "wrote {}", printable(file.path()));
    }
    text
}

fn study_text(study: &Study) -> String {
    let mut text = format!("technique: {}\n", study.technique);
    // A random technique is judged by the limit and the truth of another, which says it all.
    if !study.is_random() {
        let _ = writeln!(
            text,
            "errors are against the limit, all knobs at their ends; the limit's own error: {:.1e}",
            study.limit.own_error
        );
        for held in &study.limit.held {
            let _ = writeln!(text, "the limit keeps `{}` as the scene has it: {}", held.knob, held.reason);
        }
    }
    text += "\nfrontier, from the most accurate to the fastest\n";
    for i in &study.frontier {
        let _ = writeln!(text, "  {}", outcome_text(&study.outcomes[*i]));
    }
    let _ = writeln!(text, "the base\n  {}\nconvergence", outcome_text(&study.outcomes[0]));
    for curve in &study.curves {
        let _ = writeln!(text, "  {}: {}", curve.knob, accuracy::verdict(study, curve));
    }
    if study.is_random() {
        return text;
    }
    for skipped in &study.skipped {
        let _ = writeln!(text, "  {}: {}", skipped.knob, skipped.reason);
    }
    let _ = match (&study.truth, &study.outcomes[0].from_truth) {
        (Ok(truth), Some(distance)) => writeln!(
            text,
            "the scene's own setting against physical truth: RMSE {:.2e}, of which the truth's standard error {:.1e}",
            distance.linear.rmse,
            truth.rms_standard_error()
        ),
        (Ok(_), None) => Ok(()),
        (Err(reason), _) => writeln!(text, "no physical truth: {reason}"),
    };
    text
}

fn outcome_text(o: &Outcome) -> String {
    let time = accuracy::least_seconds(o).map_or_else(|| "-".into(), |s| format!("{:.1} ms", 1e3 * s));
    let half = o.sampled.map_or_else(String::new, |s| format!(" ± {:.0e}", s.from_limit.half_width));
    let error = match &o.from_limit {
        Some(d) if o.drawn => format!("RMSE {:.2e}{half}  FLIP {:.4}", d.linear.rmse, d.flip),
        Some(_) => "not told from the limit".into(),
        None => "-".into(),
    };
    format!("{time:>10}  {error}  {}", o.setting.label)
}
