//! Times and errors that pictures are asked to keep to, and what they took and were (`docs/budgets.csv`).

use super::{fill_page, name, sized};
use organza::scene::{Goal, Scene};
use organza::{Error, Files, Layers, Progress, RenderOptions, render_within};
use reference::metrics::{Image, compare};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

const CSV: &str = "docs/budgets.csv";
/// Pixels of the longer side.
const SIDE: u32 = 480;
/// Shares of the time of the scene's own settings that a picture may take.
const TIME_SHARES: [f64; 2] = [0.7, 0.4];
/// Root mean square errors of the displayed picture that it may have.
const ERRORS: [f64; 2] = [0.01, 0.03];
/// Scenes that take longer by their own settings, seconds, are left out.
const LONGEST: f64 = 12.0;
/// Times its budget that a picture may take, and times its limit that an error may be.
const NEAR_TIME: f64 = 1.25;
const NEAR_ERROR: f64 = 2.0;

/// Between these the page holds the table.
const BEGIN: &str = "<!-- Made by `cargo xtask effects` from docs/budgets.csv. -->\n";
const END: &str = "<!-- End of the budgets. -->\n";

/// What a picture was asked to keep to.
#[derive(Clone, Copy, PartialEq)]
enum Limit {
    /// Share of the time of the scene's own settings.
    Time(f64),
    /// Root mean square error.
    Error(f64),
}

impl Limit {
    fn name(self) -> &'static str {
        match self {
            Self::Time(_) => "time",
            Self::Error(_) => "rmse",
        }
    }

    /// Times its limit that what is reached may be.
    fn near(self) -> f64 {
        match self {
            Self::Time(_) => NEAR_TIME,
            Self::Error(_) => NEAR_ERROR,
        }
    }
}

/// One picture that was asked for.
struct Kept {
    scene: String,
    limit: Limit,
    /// Milliseconds, or an error.
    asked: f64,
    /// The same, expected and reached; `None` where it was refused as more than any settings keep to.
    expected: Option<f64>,
    reached: Option<f64>,
}

impl Kept {
    fn is_near(&self) -> bool {
        self.reached.is_some_and(|reached| reached <= self.limit.near() * self.asked)
    }
}

/// Asks every scene for each limit, and writes both files after each scene.
pub(crate) fn run(scenes: &[PathBuf]) {
    let mut kept = Vec::new();
    for path in scenes {
        kept.extend(limited(path));
        println!("{}: {} of {} kept", name(path), kept.iter().filter(|one| one.is_near()).count(), kept.len());
        std::fs::write(CSV, csv(&kept)).unwrap();
        fill_page(BEGIN, END, &table(&kept));
    }
}

/// A scene within each limit; nothing of one that takes too long, or that has frames.
fn limited(path: &Path) -> Vec<Kept> {
    let scene = sized(path, &[], SIDE).unwrap();
    let options = RenderOptions::default();
    let explained = organza::explain(&scene, &options, &Progress::new()).unwrap();
    if explained.predicted.seconds(rayon::current_num_threads()) > LONGEST || scene.frames.is_some() {
        return Vec::new();
    }
    let begun = Instant::now();
    let whole = organza::render(&scene, &options, &Progress::new()).unwrap();
    let reading = whole.cost.stages.iter().filter(|stage| stage.name == organza::pass::READ);
    let ms = 1e3 * (begun.elapsed().as_secs_f64() - reading.map(|stage| stage.seconds).sum::<f64>());
    let times = TIME_SHARES.map(|share| (Limit::Time(share), (share * ms).round().max(1.0)));
    let errors = ERRORS.map(|error| (Limit::Error(error), error));
    times.into_iter().chain(errors).map(|(limit, asked)| within(&scene, &whole.layers, limit, asked)).collect()
}

/// A scene within one limit, beside its whole picture.
fn within(scene: &Scene, whole: &Layers, limit: Limit, asked: f64) -> Kept {
    let goal = match limit {
        Limit::Time(_) => Goal { budget_ms: Some(asked as u64), ..Goal::default() },
        Limit::Error(_) => Goal { max_rmse: Some(asked), ..Goal::default() },
    };
    let found = render_within(scene, &goal, &RenderOptions::default(), &Progress::new(), Files::default());
    let [expected, reached] = match found {
        Ok(found) => match limit {
            Limit::Time(_) => [found.expected, found.taken].map(|time| Some(1e3 * time.as_secs_f64())),
            Limit::Error(_) => [Some(found.error.rmse), Some(displayed_rmse(whole, &found.render.layers))],
        },
        Err(Error::Limit(_)) => [None, None],
        Err(error) => panic!("{}: {error}", scene.file.display()),
    };
    Kept { scene: name(&scene.file), limit, asked, expected, reached }
}

/// Root mean square of the differences of two pictures as they are displayed, without exposure.
fn displayed_rmse(first: &Layers, second: &Layers) -> f64 {
    let displayed =
        |layers: &Layers| Image::from_layer(layers.size, layers.rgb("beauty").unwrap()).unwrap().display(0.0);
    compare(&displayed(first), &displayed(second)).unwrap().rmse
}

fn csv(kept: &[Kept]) -> String {
    let mut text = "scene,limit,share_of_time,asked,expected,reached\n".to_owned();
    let shown = |number: Option<f64>| number.map_or_else(|| "refused".to_owned(), |number| format!("{number:.4}"));
    for Kept { scene, limit, asked, expected, reached } in kept {
        let share = if let Limit::Time(share) = limit { share.to_string() } else { String::new() };
        let [expected, reached] = [expected, reached].map(|number| shown(*number));
        writeln!(text, "{scene},{},{share},{asked},{expected},{reached}", limit.name()).unwrap();
    }
    text
}

fn table(kept: &[Kept]) -> String {
    let mut text = format!(
        "## Budgets\n\nEach scene, {SIDE} pixels wide at most, asked by `--budget` to take a share of the time that its own settings take, and by `--max-rmse` to err by no more \
         than a limit. `docs/budgets.csv` has each. A limit that no settings keep to is refused.\n\n\
         | limit | pictures | refused | kept within {NEAR_TIME} times the time or {NEAR_ERROR} times the error | reached over asked, median | most |\n\
         |---|---|---|---|---|---|\n"
    );
    let limits = TIME_SHARES.map(Limit::Time).into_iter().chain(ERRORS.map(Limit::Error));
    for limit in limits {
        let asked = || kept.iter().filter(|one| one.limit == limit);
        let mut ratios: Vec<f64> = asked().filter_map(|one| Some(one.reached? / one.asked)).collect();
        ratios.sort_by(f64::total_cmp);
        if ratios.is_empty() {
            continue;
        }
        let words = match limit {
            Limit::Time(share) => format!("{share} of the time"),
            Limit::Error(error) => format!("an RMSE of {error}"),
        };
        let near = asked().filter(|one| one.is_near()).count();
        writeln!(
            text,
            "| {words} | {} | {} | {near}, {:.0} % | {:.2} | {:.2} |",
            asked().count(),
            asked().count() - ratios.len(),
            100.0 * near as f64 / ratios.len() as f64,
            ratios[ratios.len() / 2],
            ratios[ratios.len() - 1]
        )
        .unwrap();
    }
    text + "\n"
}
