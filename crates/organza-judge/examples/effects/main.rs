//! `cargo run -p organza-judge --example effects [STAGE…]`: draws each scene of `scenes/`, and writes tables and the parts of `docs/effects.md` that show
//! them. Stages: `effects`, with each effect and without it (`docs/effects.csv`); `choices`, by `auto` and by each technique (`docs/choices.csv`);
//! `budgets`, within times and errors (`docs/budgets.csv`); `predictions`, in two sizes on one thread and on two, with predicted times (`docs/predictions.csv`). All without a name. `cargo xtask effects` runs
//! it, after the tests that write `docs/effect-families.csv`.
#![allow(clippy::unwrap_used, reason = "it stops where something is wrong")]

mod budgets;
mod choices;

use organza::cost::{CountedPass, Prediction};
use organza::plan::Plan;
use organza::scene::{LoadOptions, Override, Scene, parse};
use organza::{Context, Error, Files, Progress, RenderOptions};
use organza_judge::effects::{LitSplats, Switch, measure};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Pixels of the longer side of the pictures.
const SIDE: u32 = 96;
const CSV: &str = "docs/effects.csv";
const FAMILIES: &str = "docs/effect-families.csv";
const PREDICTIONS: &str = "docs/predictions.csv";
/// Pixels of the longer side of pictures whose times are predicted, and threads.
const TIMED: [(u32, usize); 3] = [(160, 1), (160, 2), (480, 1)];
/// No picture is drawn that is predicted to take so many seconds.
const LONGEST: f64 = 40.0;
const PAGE: &str = "docs/effects.md";
/// Between these the page holds the tables.
const BEGIN: &str = "<!-- Made by `cargo xtask effects` from docs/effects.csv. -->\n";
const END: &str = "<!-- End of the tables. -->\n";

/// Between these it holds some scenes as one reads them.
const BEGIN_READ: &str = "<!-- Made by `cargo xtask effects`. -->\n";
const END_READ: &str = "<!-- End of the scenes. -->\n";

/// Between these it holds predicted times.
const BEGIN_TIMES: &str = "<!-- Made by `cargo xtask effects` from docs/predictions.csv. -->\n";
const END_TIMES: &str = "<!-- End of the times. -->\n";

/// A scene that the page shows beside its picture, and what one learns from it.
struct Shown {
    scene: &'static str,
    lesson: &'static str,
}

const SHOWN: [Shown; 5] = [
    Shown {
        scene: "glass",
        lesson: "Bending and absorption make the bunny what it is: without either, pixels change by half of white. All shadows together cost one map.",
    },
    Shown {
        scene: "soft",
        lesson: "16 points stand for the size of the lamp, and one sweep through the slabs carries the light of all of them: `soft` says so, and what it costs. Light that is scattered \
                 again and again is `lacking`, because the scene asks for a technique that scatters it once; a note says what would show it.",
    },
    Shown {
        scene: "window",
        lesson: "The picture that the light shines through makes the beams. The wall behind them is nearly black: without it a pixel changes by about half a per cent, hardly more than is seen.",
    },
    Shown {
        scene: "eye",
        lesson: "The vitreous body is nearly clear: without it a pixel changes by a few per cent, and what it would scatter again is estimated, not bounded, to be less than that.",
    },
    Shown {
        scene: "mixed",
        lesson: "Five kinds of data under two lights. Each light has a map of all of them, and the second light is a fill: the picture changes less without it.",
    },
];

/// One effect of one scene.
struct Row {
    scene: String,
    effect: String,
    /// Whether it is simulated.
    is_on: bool,
    /// Why it is simulated or left out.
    reason: String,
    /// Bound of its change of a displayed pixel; `None` where none is known.
    bound: Option<f64>,
    /// Largest change that was measured.
    change: f64,
    /// Share of pixels that change by more than the tolerance.
    beyond: f64,
    seconds_with: f64,
    seconds_without: f64,
}

/// One scene.
struct Drawn {
    name: String,
    rows: Vec<Row>,
    left_out_together: Option<f64>,
    lit: Option<LitSplats>,
    /// Visible objects that the shadow maps of a light leave out, as their shadows fall on nothing that is seen.
    idle_casters: usize,
    tolerance: f64,
    predicted_seconds: f64,
    seconds: f64,
}

/// One picture with its times.
struct Timed {
    name: String,
    side: u32,
    threads: usize,
    predicted_seconds: f64,
    seconds: f64,
    predicted_bytes: u64,
    bytes: u64,
    /// Those of all shadow maps.
    predicted_map_bytes: u64,
    map_bytes: u64,
}

fn main() {
    let asked: Vec<String> = std::env::args().skip(1).collect();
    let is_known = |stage: &String| ["effects", "choices", "budgets", "predictions"].contains(&stage.as_str());
    assert!(
        asked.iter().all(is_known),
        "expected the stages effects, choices, budgets or predictions, found {}",
        asked.join(" ")
    );
    let is_asked = |stage: &str| asked.is_empty() || asked.iter().any(|named| named == stage);
    let mut scenes: Vec<PathBuf> = std::fs::read_dir("scenes").unwrap().map(|entry| entry.unwrap().path()).collect();
    scenes.retain(|path| path.extension().is_some_and(|extension| extension == "toml"));
    scenes.sort();
    if is_asked("effects") {
        let mut drawn = Vec::new();
        for path in &scenes {
            let scene = draw(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
            println!("{}: {} effects", scene.name, scene.rows.len());
            drawn.push(scene);
        }
        std::fs::write(CSV, csv(&drawn)).unwrap();
        fill_page(BEGIN_READ, END_READ, &read(&drawn));
        fill_page(BEGIN, END, &(tables(&drawn) + &families(&std::fs::read_to_string(FAMILIES).unwrap())));
    }
    if is_asked("choices") {
        choices::run(&scenes);
    }
    if is_asked("budgets") {
        budgets::run(&scenes);
    }
    if is_asked("predictions") {
        let mut timed = Vec::new();
        for (side, threads) in TIMED {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let pictures = scenes.iter().filter_map(|path| pool.install(|| time(path, side, threads)));
            timed.extend(
                pictures.inspect(|one| println!("{} of {side} pixels on {threads}: {:.2} s", one.name, one.seconds)),
            );
            std::fs::write(PREDICTIONS, predictions(&timed)).unwrap();
            fill_page(BEGIN_TIMES, END_TIMES, &times(&timed));
        }
    }
}

/// A scene drawn with its longer side of so many pixels; `None` where it would take too long.
fn time(path: &Path, side: u32, threads: usize) -> Option<Timed> {
    let scene = sized(path, &[], side).unwrap();
    let options = RenderOptions::default();
    let progress = Progress::new();
    let explained = organza::explain(&scene, &options, &progress).unwrap();
    let predicted_seconds = drawing_seconds(&explained.predicted, threads);
    if predicted_seconds > LONGEST {
        return None;
    }
    let render = organza::render(&scene, &options, &progress).unwrap();
    let is_drawing = |name: &str| name != organza::pass::READ && name != organza::pass::CONVERT;
    let stages = || render.cost.stages.iter().filter(|stage| is_drawing(&stage.name));
    let is_map = |name: &str| [organza::pass::SHADOW_MAP, organza::pass::EYE_MAP].contains(&name);
    Some(Timed {
        name: name(path),
        side,
        threads,
        predicted_seconds,
        seconds: stages().map(|stage| stage.seconds).sum(),
        predicted_bytes: explained.memory,
        bytes: render.cost.stages.iter().map(|stage| stage.bytes).sum(),
        predicted_map_bytes: render.plan.tables().map(|table| table.predicted.map_bytes).sum(),
        map_bytes: stages().filter(|stage| is_map(&stage.name)).map(|stage| stage.bytes).sum(),
    })
}

/// Predicted seconds of all passes but reading and conversion, which other pages measure.
fn drawing_seconds(predicted: &Prediction, threads: usize) -> f64 {
    let is_drawing = |pass: &&CountedPass| pass.pass != organza::pass::READ && pass.pass != organza::pass::CONVERT;
    predicted.passes().filter(is_drawing).map(|pass| pass.seconds(&predicted.rates, threads)).sum()
}

fn predictions(timed: &[Timed]) -> String {
    let mut text =
        "scene,pixels_of_longer_side,threads,predicted_seconds,seconds,bytes_at_most,bytes_of_passes,predicted_bytes_of_maps,bytes_of_maps\n".to_owned();
    for one in timed {
        let Timed { name, side, threads, predicted_seconds, seconds, predicted_bytes, bytes, .. } = one;
        let Timed { predicted_map_bytes, map_bytes, .. } = one;
        writeln!(
            text,
            "{name},{side},{threads},{predicted_seconds:.4},{seconds:.4},{predicted_bytes},{bytes},{predicted_map_bytes},{map_bytes}"
        )
        .unwrap();
    }
    text
}

/// A line for each size and number of threads.
fn times(timed: &[Timed]) -> String {
    let mut text = "## Predicted times\n\nPasses behind reading and conversion, by the built-in figures; `docs/predictions.csv` has each scene. A ratio is the larger of both times over the smaller.\n\n\
                    | longer side, pixels | threads | scenes | ratio, median | ninth tenth | most | within a quarter | within a factor of 2 |\n\
                    |---|---|---|---|---|---|---|---|\n"
        .to_owned();
    for (side, threads) in TIMED {
        if !timed.iter().any(|one| one.side == side && one.threads == threads) {
            continue;
        }
        let of_size = timed.iter().filter(|one| one.side == side && one.threads == threads);
        let ratio = |one: &Timed| (one.predicted_seconds / one.seconds).max(one.seconds / one.predicted_seconds);
        let mut ratios: Vec<f64> = of_size.map(ratio).collect();
        ratios.sort_by(f64::total_cmp);
        let count = ratios.len();
        let within = |most: f64| 100.0 * ratios.iter().filter(|ratio| **ratio <= most).count() as f64 / count as f64;
        writeln!(
            text,
            "| {side} | {threads} | {count} | {:.2} | {:.2} | {:.2} | {:.0} % | {:.0} % |",
            ratios[count / 2],
            ratios[count * 9 / 10],
            ratios[count - 1],
            within(1.25),
            within(2.0)
        )
        .unwrap();
    }
    text + &map_bytes(timed) + "\n"
}

/// A sentence on the bytes of shadow maps.
fn map_bytes(timed: &[Timed]) -> String {
    let with_maps = timed.iter().filter(|one| one.map_bytes > 0 && one.predicted_map_bytes > 0);
    let mut ratios: Vec<f64> = with_maps.map(|one| one.predicted_map_bytes as f64 / one.map_bytes as f64).collect();
    ratios.sort_by(f64::total_cmp);
    if ratios.is_empty() {
        return String::new();
    }
    let near = ratios.iter().filter(|ratio| (1.0 / 1.2..=1.2).contains(*ratio)).count();
    format!(
        "\nBytes of all shadow maps of a picture, predicted over measured: {:.2} in the middle, {:.2} to {:.2}; within a fifth in {near} of {} pictures.\n",
        ratios[ratios.len() / 2],
        ratios[0],
        ratios[ratios.len() - 1],
        ratios.len()
    )
}

/// The families, row by row.
fn families(csv: &str) -> String {
    let mut text = "## Families\n\nScenes of 32x24 pixels in which one number grows from invisible to plain. The tests draw each with the effect on, off and as planned. \
                    `cargo xtask effects` draws other numbers each time. Where the share is small, a bound takes for black what is not: a shadow could make anything black, where a displayed \
                    value is 29 times as steep as at white.\n\n\
                    | effect | what grows | settings | first visible | last left out | share of it | largest change that was left out, tolerances | bound over change, median |\n\
                    |---|---|---|---|---|---|---|---|\n"
        .to_owned();
    for row in csv.lines().skip(1) {
        let cells: Vec<&str> = row.split(',').collect();
        let [effect, grows, settings, visible, left_out, change, ratio] = cells[..] else {
            panic!("{FAMILIES}: {row}")
        };
        let number = |text: &str| text.parse::<f64>().unwrap();
        let settings = if settings.is_empty() { String::new() } else { format!("`{settings}`") };
        writeln!(
            text,
            "| `{effect}` | `{grows}` | {settings} | {:.1e} | {:.1e} | {:.3} | {change} | {ratio} |",
            number(visible),
            number(left_out),
            number(left_out) / number(visible)
        )
        .unwrap();
    }
    text + "\n"
}

/// Writes this text between two lines of the page.
fn fill_page(begin: &str, end: &str, text: &str) {
    let page = std::fs::read_to_string(PAGE).unwrap();
    let (before, rest) = page.split_once(begin).unwrap();
    let (_, after) = rest.split_once(end).unwrap();
    std::fs::write(PAGE, format!("{before}{begin}{text}{end}{after}")).unwrap();
}

/// Some scenes beside their pictures, with what was measured of each effect.
fn read(drawn: &[Drawn]) -> String {
    let mut text = String::new();
    for shown in SHOWN {
        let scene = drawn.iter().find(|scene| scene.name == shown.scene).unwrap();
        let name = shown.scene;
        writeln!(text, "\n### `scenes/{name}.toml`\n\n![{name}](images/{name}.png)\n\n{}\n", shown.lesson).unwrap();
        text += "| effect | simulated | without it: at most | measured | ms with and without | why |\n|---|---|---|---|---|---|\n";
        for row in &scene.rows {
            let Row { effect, is_on, change, reason, seconds_with, seconds_without, .. } = row;
            let simulated = if *is_on { "yes" } else { "no" };
            let bound = row.bound.map_or_else(|| "not known".to_owned(), percent);
            let [with, without] = [seconds_with, seconds_without].map(|seconds| (1e3 * seconds).round());
            writeln!(
                text,
                "| `{effect}` | {simulated} | {bound} | {} | {with}, {without} | {reason} |",
                percent(*change)
            )
            .unwrap();
        }
    }
    text + "\n"
}

/// The scene in `path`, small, with effects switched.
fn scene(path: &Path, switches: &[Switch]) -> Result<Scene, Error> {
    sized(path, switches, SIDE)
}

/// Its name.
fn name(path: &Path) -> String {
    path.file_stem().unwrap().to_string_lossy().into_owned()
}

/// The same with a longer side of so many pixels at most.
fn sized(path: &Path, switches: &[Switch], side: u32) -> Result<Scene, Error> {
    let words = switches.iter().map(|switch| format!("{}={}", switch.name, if switch.is_on { "on" } else { "off" }));
    let overrides = words.map(|word| Override::of_effect(&word)).collect::<Result<Vec<_>, _>>()?;
    let options = LoadOptions { overrides, ..LoadOptions::default() };
    let mut scene = parse(path, &std::fs::read(path).unwrap(), &options)?;
    let longest = scene.camera.size.into_iter().max().unwrap();
    if longest > side {
        scene.camera.size = scene.camera.size.map(|pixels| (pixels * side).div_ceil(longest));
    }
    let context = Context { files: &Files::default(), options: &RenderOptions::default(), progress: &Progress::new() };
    Ok(organza::fitted(&scene, context)?.0.into_owned())
}

fn draw(path: &Path) -> Result<Drawn, Error> {
    let options = RenderOptions::default();
    let progress = Progress::new();
    let planned = scene(path, &[])?;
    let explained = organza::explain(&planned, &options, &progress)?;
    let measured = measure(&explained.plan, &planned, &|switches| scene(path, switches), &options, &progress)?;
    let contradictions = measured.contradictions(&explained.plan);
    assert!(contradictions.is_empty(), "{}: {}", path.display(), contradictions.join("; "));
    let name = name(path);
    let effect = |name: &str| explained.plan.effects.iter().find(|effect| effect.name == name).unwrap();
    let row = |change: &organza_judge::effects::EffectChange| {
        let effect = effect(&change.name);
        Row {
            scene: name.clone(),
            effect: change.name.clone(),
            is_on: effect.called_for,
            reason: effect.reason.clone(),
            bound: effect.bound.number(),
            change: change.largest,
            beyond: change.beyond_tolerance,
            seconds_with: change.seconds_with,
            seconds_without: change.seconds_without,
        }
    };
    let threads = rayon::current_num_threads();
    Ok(Drawn {
        rows: measured.changes.iter().map(row).collect(),
        left_out_together: measured.left_out_together,
        lit: measured.lit,
        idle_casters: idle_casters(&explained.plan, &planned),
        tolerance: planned.render.tolerance,
        predicted_seconds: drawing_seconds(&explained.predicted, threads),
        seconds: measured.seconds,
        name,
    })
}

/// The number of visible objects that no shadow map of some point of a light holds.
fn idle_casters(plan: &Plan, scene: &Scene) -> usize {
    let is_visible = |rank: usize| scene.objects.get(rank).is_some_and(|object| object.visible && object.casts_shadow);
    let with_maps = plan.casters.iter().zip(&plan.shadow_tables).filter(|(_, table)| table.is_some());
    let is_idle = |rank: &usize| with_maps.clone().any(|(kept, _)| kept.get(*rank) == Some(&false));
    (0..scene.objects.len()).filter(|rank| is_visible(*rank)).filter(is_idle).count()
}

fn csv(drawn: &[Drawn]) -> String {
    let head = "scene,effect,simulated,bound,change,share_of_pixels_beyond_tolerance,seconds_with,seconds_without\n";
    let mut text = head.to_owned();
    for row in drawn.iter().flat_map(|scene| &scene.rows) {
        let Row { scene, effect, is_on, change, beyond, seconds_with, seconds_without, .. } = row;
        let bound = row.bound.map_or_else(String::new, |bound| format!("{bound:.3e}"));
        writeln!(
            text,
            "{scene},{effect},{is_on},{bound},{change:.3e},{beyond:.4},{seconds_with:.4},{seconds_without:.4}"
        )
        .unwrap();
    }
    text
}

fn percent(share: f64) -> String {
    match 100.0 * share {
        0.0 => "nothing".to_owned(),
        p if p < 0.01 => "below 0.01 %".to_owned(),
        p if p < 10.0 => format!("{p:.2} %"),
        p => format!("{p:.0} %"),
    }
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

fn tables(drawn: &[Drawn]) -> String {
    let rows = || drawn.iter().flat_map(|scene| scene.rows.iter().map(move |row| (row, scene.tolerance)));
    let off = || rows().filter(|(row, _)| !row.is_on);
    let on = || rows().filter(|(row, _)| row.is_on);
    let most_off = off().map(|(row, _)| row.change).fold(0.0, f64::max);
    let beyond = off().filter(|(row, tolerance)| row.change > *tolerance).count();
    let seen = on().filter(|(row, tolerance)| row.change > *tolerance).count();
    let over = rows().filter(|(row, _)| row.bound.is_some_and(|bound| row.change > bound + 1e-6)).count();
    let ratios = on().filter_map(|(row, _)| row.bound.map(|bound| bound / row.change)).filter(|r| r.is_finite());
    let ratio = |scene: &Drawn| (scene.predicted_seconds / scene.seconds).max(scene.seconds / scene.predicted_seconds);
    // Bent rays meet splats outside of the view.
    let meets_view = |splats: &LitSplats| splats.lit <= splats.in_view;
    let mut text = format!(
        "\n{} scenes, {SIDE} pixels wide at most: {} effects could be switched.\n\n\
         - Left out: {}. Forced on, {beyond} change a pixel by more than the tolerance; the most is {}.\n\
         - Called for: {}. Forced off, {seen} of these change some pixel by more than the tolerance.\n\
         - {over} changed a pixel by more than their bound. The bound is {:.1} times the change, in the median.\n\
         - In part: in {} scenes, splats that are seen nowhere get no light; in {}, shadow maps leave out objects whose shadows fall on nothing that is seen.\n\
         - Predicted and measured times of drawing differ by a factor of {:.2} in the median, {:.1} at most; in {:.0} % of the scenes by no more than 2.\n\n",
        drawn.len(),
        rows().count(),
        off().count(),
        percent(most_off),
        on().count(),
        median(ratios),
        drawn.iter().filter(|scene| scene.lit.is_some_and(|splats| splats.lit < splats.in_view)).count(),
        drawn.iter().filter(|scene| scene.idle_casters > 0).count(),
        median(drawn.iter().map(ratio)),
        drawn.iter().map(ratio).fold(0.0, f64::max),
        100.0 * drawn.iter().filter(|scene| ratio(scene) <= 2.0).count() as f64 / drawn.len() as f64,
    );
    text += "| scene | left out | all of it, forced on, changes | splats that get light, of those in view | called for, and what a pixel changes without it | s predicted | s measured |\n\
             |---|---|---|---|---|---|---|\n";
    for scene in drawn {
        let names = |is_on: bool| scene.rows.iter().filter(move |row| row.is_on == is_on);
        let left_out: Vec<String> = names(false).map(|row| format!("`{}`", row.effect)).collect();
        let called_for = names(true).map(|row| format!("`{}` {}", row.effect, percent(row.change)));
        let together = scene.left_out_together.map_or_else(String::new, percent);
        writeln!(
            text,
            "| {} | {} | {together} | {} | {} | {:.2} | {:.2} |",
            scene.name,
            left_out.join(", "),
            scene
                .lit
                .filter(meets_view)
                .map_or_else(String::new, |splats| format!("{} of {}", splats.lit, splats.in_view)),
            called_for.collect::<Vec<_>>().join(", "),
            scene.predicted_seconds,
            scene.seconds,
        )
        .unwrap();
    }
    text + "\n"
}
