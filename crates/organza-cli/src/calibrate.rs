//! `organza calibrate`: small built-in scenes, drawn on one thread, and the time of each pass beside the predicted one.

use super::args::CalibrateArguments;
use super::session::{path_text, start_threads};
use super::{console, machine};
use organza::cost::{Item, Prediction, Rates};
use organza::output::Targets;
use organza::scene::{LoadOptions, Override, parse};
use organza::{CostRecord, Error, Progress, RenderOptions, printable};
use serde_json::{Value, json};
use std::path::Path;
use std::time::{Duration, Instant};

/// No picture is repeated after so long.
const LONGEST: Duration = Duration::from_secs(20);
/// Pictures of each scene, of which the fastest counts: other programs only ever slow them down.
const REPEATS: usize = 3;

/// Fog, a pane of glass and a wall in the light of two lamps: every pass of splats.
const SPLATS: &str = "version = 1\n[camera]\nposition = [0.4, 0.3, 4]\ntarget = [0, 0, 0]\nsize = [200, 150]\n\
    [[light]]\nkind = 'point'\nposition = [1, 2, 3]\nintensity = [9, 9, 9]\n\
    [[light]]\nkind = 'directional'\ndirection = [0, -1, -1]\nirradiance = [1, 1, 1]\n\
    [[object]]\nname = 'fog'\nmaterial = 'fog'\n\
    medium_ball = { center = [0, 0, 0], radius = 1, spacing = 0.04, extinction = 1.5 }\n\
    [[object]]\nname = 'pane'\nopacity = 0.4\n\
    rectangle = { center = [0, 0, 1.2], u = [1, 0, 0], v = [0, 1, 0], spacing = 0.02 }\n\
    [[object]]\nname = 'wall'\nrectangle = { center = [0, 0, -1.5], u = [2, 0, 0], v = [0, 2, 0], spacing = 0.02 }\n\
    [material.fog]\nmedium = { albedo = 0.9 }\n";

/// Each technique draws the same scene; exact compositing a smaller one, for it takes longest. `sheets` and `surfels` leave out the wall: opaque
/// triangles, and discs that rays meet, are other kinds of work than opaque splats.
const PICTURES: [(&str, &[&str]); 5] = [
    ("points", &[]),
    ("particles", &["render.particles.repeat_level=16"]),
    ("sheets", &["object.wall.visible=false"]),
    ("surfels", &["object.fog.visible=false", "object.wall.visible=false"]),
    ("reference", &["camera.size=[96, 72]", "object.fog.medium_ball.spacing=0.1"]),
];

/// Predicted and measured seconds of the passes that ran.
struct Pass {
    name: &'static str,
    predicted: f64,
    measured: f64,
}

/// Measures and writes the file.
pub(super) fn run(arguments: &CalibrateArguments) -> Result<(), Error> {
    let target = Targets::default().add(&arguments.output, arguments.force)?;
    start_threads(1)?;
    let begin = Instant::now();
    let mut best: [Vec<Pass>; PICTURES.len()] = Default::default();
    // Every picture once before any is repeated, so that on a busy machine each pass is measured.
    for round in 0..REPEATS {
        for ((technique, changes), best) in PICTURES.iter().zip(&mut best) {
            if round == 0 || begin.elapsed() < LONGEST {
                keep_fastest(best, draw(technique, changes)?);
            }
        }
    }
    let mut passes: Vec<Pass> = Vec::new();
    best.into_iter().for_each(|of_picture| add(&mut passes, of_picture));
    let built_in = Rates::default();
    let time = |item: Item| built_in.ns(item) * ratio(&passes, item);
    target.write(machine::text(time).as_bytes())?;
    let path = printable(target.path());
    if arguments.json {
        let ns: Value = Item::every().map(|item| (item.name().to_owned(), json!(time(item)))).collect();
        let document = json!({ "path": path_text(target.path()), "machine": machine::name(), "ns": ns });
        return console::out(&format!("{document:#}\n"));
    }
    let mut text = String::new();
    for pass in &passes {
        text += &format!("{}: {:.2} times the built-in figures\n", pass.name, pass.measured / pass.predicted);
    }
    console::out(&format!("{text}wrote {path}; use it: organza explain SCENE --machine {path}\n"))
}

/// The passes of one picture.
fn draw(technique: &str, changes: &[&str]) -> Result<Vec<Pass>, Error> {
    let technique = format!("render.technique=\"{technique}\"");
    let overrides = std::iter::once(technique.as_str()).chain(changes.iter().copied()).map(Override::parse);
    let options = LoadOptions { overrides: overrides.collect::<Result<_, _>>()?, ..LoadOptions::default() };
    let scene = parse(Path::new("calibrate.toml"), SPLATS.as_bytes(), &options)?;
    let render = organza::render(&scene, &RenderOptions::default(), &Progress::new())?;
    Ok(compared(&render.predicted, &render.cost))
}

/// Takes in another run of the same picture.
fn keep_fastest(best: &mut Vec<Pass>, run: Vec<Pass>) {
    for pass in run {
        match best.iter_mut().find(|known| known.name == pass.name) {
            Some(known) => known.measured = known.measured.min(pass.measured),
            None => best.push(pass),
        }
    }
}

/// Predicted and measured seconds of each pass.
fn compared(predicted: &Prediction, cost: &CostRecord) -> Vec<Pass> {
    let measured = |name: &str| cost.stages.iter().filter(|s| s.name == name).map(|s| s.seconds).sum::<f64>();
    let passes = predicted.joined();
    let both = passes.iter().map(|pass| Pass {
        name: pass.pass,
        predicted: pass.seconds(&predicted.rates, 1),
        measured: measured(pass.pass),
    });
    // The scenes have no files.
    both.filter(|pass| pass.predicted > 0.0 && pass.measured > 0.0 && pass.name != organza::pass::READ).collect()
}

fn add(sum: &mut Vec<Pass>, passes: Vec<Pass>) {
    for pass in passes {
        match sum.iter_mut().find(|known| known.name == pass.name) {
            Some(known) => {
                known.predicted += pass.predicted;
                known.measured += pass.measured;
            }
            None => sum.push(pass),
        }
    }
}

/// How many times the built-in figure an item takes here, as its pass does; of a pass that did not run, as all passes do together.
fn ratio(passes: &[Pass], item: Item) -> f64 {
    let known = passes.iter().find(|pass| pass.name == item.pass());
    let sum = |number: fn(&Pass) -> f64| passes.iter().map(number).sum::<f64>();
    known.map_or_else(|| sum(|p| p.measured) / sum(|p| p.predicted), |pass| pass.measured / pass.predicted)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pass_that_did_not_run_takes_the_ratio_of_all() {
        let pass = |name, predicted, measured| Pass { name, predicted, measured };
        let passes = [pass(organza::pass::SHADE, 1.0, 2.0), pass(organza::pass::SPLAT, 3.0, 3.0)];
        assert_eq!(ratio(&passes, Item::ShadedSplat), 2.0);
        assert_eq!(ratio(&passes, Item::Particle), 1.25);
    }
}
