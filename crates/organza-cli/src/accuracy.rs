//! `organza accuracy`.

use super::args::AccuracyArguments;
use super::console;
use super::console::bar::with_bar;
use super::session::{in_folder, load_scene, path_text, processor_only, refuse_technique_and_layers, render_options};
use organza::output::Target;
use organza::{Error, printable};
use organza_judge::accuracy::{self, Judged, Options, Outcome, Report, Study};
use serde_json::json;
use std::fmt::Write;

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
        let Judged { report, is_interrupted } =
            with_bar(|progress| accuracy::judge(&scene, options, &render, progress))?;
        accuracy::write(&report, &targets)?;
        console::out(&summary(&report, &targets, arguments.scene.common.json))?;
        if is_interrupted { Err(Error::Cancelled) } else { Ok(()) }
    })
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
