//! What `auto` takes, beside each technique that shows as much (`docs/choices.csv`).

use super::{SIDE, fill_page, name, percent, scene};
use organza::plan::Plan;
use organza::scene::Technique;
use organza::{Progress, RenderOptions};
use std::fmt::Write;
use std::path::{Path, PathBuf};

const CSV: &str = "docs/choices.csv";
/// Seconds that a picture is drawn again for, at most three times, of which the least counts.
const AGAIN: f64 = 1.0;
/// No technique is drawn that is predicted to take so many times what `auto` takes.
const MUCH_SLOWER: f64 = 3.0;
/// Times the least time that `auto` may take.
const NEARLY: f64 = 1.25;

/// Between these the page holds the table.
const BEGIN: &str = "<!-- Made by `cargo xtask effects` from docs/choices.csv. -->\n";
const END: &str = "<!-- End of the choices. -->\n";

/// Draws every scene by `auto` and by the others, and writes both files after each.
pub(crate) fn run(scenes: &[PathBuf]) {
    let mut chosen = Vec::new();
    for path in scenes {
        let choice = choice(path);
        println!("{}: {}", choice.name, choice.taken);
        chosen.push(choice);
        std::fs::write(CSV, csv(&chosen)).unwrap();
        fill_page(BEGIN, END, &table(&chosen));
    }
}

/// One scene by `auto` and by each technique that errs no more.
struct Choice {
    name: String,
    tolerance: f64,
    /// The technique that `auto` takes, or several.
    taken: String,
    /// By `auto`, then by the techniques that show as much.
    ways: Vec<DrawnBy>,
}

/// A scene drawn by one technique for all of its objects.
struct DrawnBy {
    technique: Technique,
    /// Estimated error of a displayed pixel, 0 to 1.
    displayed_error: f64,
    /// From files to the picture.
    seconds: f64,
}

impl Choice {
    fn by_auto(&self) -> &DrawnBy {
        &self.ways[0]
    }

    /// Whether a way errs within the tolerance or, where none does, least.
    fn suffices(&self, way: &DrawnBy) -> bool {
        let least = self.ways.iter().map(|way| way.displayed_error).fold(f64::INFINITY, f64::min);
        way.displayed_error <= least.max(self.tolerance)
    }

    fn fastest(&self) -> &DrawnBy {
        let sufficient = self.ways.iter().filter(|way| self.suffices(way));
        sufficient.min_by(|a, b| a.seconds.total_cmp(&b.seconds)).unwrap()
    }

    fn is_nearly_fastest(&self) -> bool {
        self.suffices(self.by_auto()) && self.by_auto().seconds <= NEARLY * self.fastest().seconds
    }
}

/// A scene by `auto`, and by each technique that lacks nothing more and errs no more by its estimates, or within the tolerance.
fn choice(path: &Path) -> Choice {
    let options = RenderOptions::default();
    let scene_by = |technique: Technique| {
        let mut scene = scene(path, &[]).unwrap();
        scene.render.technique = technique;
        scene.objects.iter_mut().for_each(|object| object.technique = None);
        scene
    };
    let drawn_by = |technique: Technique| {
        let scene = scene_by(technique);
        let mut seconds = f64::INFINITY;
        let mut spent = 0.0;
        let mut displayed_error = 0.0;
        for _ in 0..3 {
            let render = organza::render(&scene, &options, &Progress::new()).unwrap();
            let taken: f64 = render.cost.stages.iter().map(|stage| stage.seconds).sum();
            seconds = seconds.min(taken);
            displayed_error = error(&render.plan);
            spent += taken;
            if spent > AGAIN {
                break;
            }
        }
        DrawnBy { technique, displayed_error, seconds }
    };
    let explained = |technique| organza::explain(&scene_by(technique), &options, &Progress::new());
    let shown = |plan: &Plan| {
        let shown = plan.effects.iter().filter(|effect| effect.called_for && !effect.is_lacking);
        shown.map(|effect| effect.name.clone()).collect::<Vec<_>>()
    };
    let by_auto = explained(Technique::Auto).unwrap();
    let shown_by_auto = shown(&by_auto.plan);
    let threads = rayon::current_num_threads();
    let seconds_of_auto = by_auto.predicted.seconds(threads);
    let tolerance = scene_by(Technique::Auto).render.tolerance;
    let most_error = error(&by_auto.plan).max(tolerance);
    let shows_as_much = |technique: &Technique| {
        explained(*technique).is_ok_and(|explained| {
            let is_drawn = explained.predicted.seconds(threads) <= MUCH_SLOWER * seconds_of_auto;
            let found = shown(&explained.plan);
            let lacks_more = shown_by_auto.iter().any(|name| !found.contains(name));
            is_drawn && !lacks_more && error(&explained.plan) <= most_error
        })
    };
    let named = Technique::ALL.into_iter().filter(|technique| *technique != Technique::Auto).filter(shows_as_much);
    let mut taken: Vec<&str> = by_auto.plan.techniques.iter().map(|technique| technique.name()).collect();
    taken.dedup();
    Choice {
        name: name(path),
        tolerance,
        taken: taken.join(" and "),
        ways: std::iter::once(Technique::Auto).chain(named).map(drawn_by).collect(),
    }
}

/// The greatest error of a displayed pixel that a plan estimates.
fn error(plan: &Plan) -> f64 {
    let drawing = plan.estimates.iter().filter(|estimate| plan.is_drawn_as(estimate));
    drawing.map(|estimate| estimate.displayed_error).fold(0.0, f64::max)
}

fn csv(chosen: &[Choice]) -> String {
    let mut text = "scene,auto_takes,technique,estimated_error,seconds\n".to_owned();
    for Choice { name, taken, ways, .. } in chosen {
        for DrawnBy { technique, displayed_error, seconds } in ways {
            writeln!(text, "{name},{taken},{},{displayed_error:.2e},{seconds:.4}", technique.name()).unwrap();
        }
    }
    text
}

fn table(chosen: &[Choice]) -> String {
    let near = chosen.iter().filter(|one| one.is_nearly_fastest()).count();
    let mut text = format!(
        "## What `auto` takes\n\nEach scene with `technique = \"auto\"` for all of its objects, and with each technique that lacks no more effects and errs, by its \
         estimates, within the tolerance or no more than what `auto` takes; {SIDE} pixels wide at most, from files to the picture. Those that are \
         predicted to take {MUCH_SLOWER} times what `auto` takes are not drawn. `docs/choices.csv` has each.\n\n\
         Of those that err within the tolerance (or least, where none does) `auto` took the fastest, or one of at most {NEARLY} times its time, in {near} of {} \
         scenes. The others:\n\n\
         | scene | `auto` takes | estimated error | s | the fastest of those | estimated error | s |\n|---|---|---|---|---|---|---|\n",
        chosen.len()
    );
    for one in chosen.iter().filter(|one| !one.is_nearly_fastest()) {
        let Choice { name, taken, .. } = one;
        let told = |way: &DrawnBy| format!("{} | {:.2}", error_text(way.displayed_error), way.seconds);
        let fastest = one.fastest();
        writeln!(
            text,
            "| {name} | {taken} | {} | {} | {} |",
            told(one.by_auto()),
            fastest.technique.name(),
            told(fastest)
        )
        .unwrap();
    }
    text + "\n"
}

/// An estimated error in words.
fn error_text(error: f64) -> String {
    if error.is_finite() { percent(error) } else { "not known".to_owned() }
}
