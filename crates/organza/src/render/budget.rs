//! A picture within a time: settings of the scene give way, one after the other, until what is left fits.
//!
//! ```text
//! load ─► trial: a sixteenth of the splats, a quarter of the width ─► seconds of an item, by pass, here and now
//!                                                                          │
//! ladder of settings, the scene's own first ─► counted work ─► the first that fits ─► plan ─► draw
//! ```
//! Counted work comes from the trial's own counts, scaled by what an item goes with: splats, samples of the picture, or fragments of both. The chosen
//! settings are planned in full before they are drawn, and give way to the next where that tells of more work than was thought.

use super::{Left, Made, Render, render_keeping};
use crate::choose::{row, techniques};
use crate::cost::{Growth, Prediction, Rates};
use crate::frame::{Frame, Leaves};
use crate::load::Loaded;
use crate::load::files::Files;
use crate::pass;
use crate::predict::prediction;
use crate::prepare::{Planned, fitted, load_measured, plan_alone};
use crate::ranges::ranges;
use crate::scene::Scene;
use crate::settle;
use crate::technique::{Fold, Session};
use crate::{CostRecord, Error, Progress, RenderOptions, draw};
use splat_core::Exceeded;
use std::borrow::Cow;
use std::time::{Duration, Instant};

/// Share of the splats in the trial.
const TRIAL_SPLATS: f64 = 1.0 / 16.0;
/// Of the picture's width and height; more of it where objects are drawn from their own data, for what voxels take does not shrink with the picture.
const TRIAL_SIDE: u32 = 4;
const TRIAL_SIDE_OF_VOXELS: u32 = 2;
/// A time that is named in the place of one that is too short is so many times what was predicted, for predictions err.
const MARGIN: f64 = 1.25;
/// Sets of particles in the trial.
const TRIAL_SETS: u32 = 4;
/// A pass of the trial that took less tells nothing of its items, seconds.
const SHORTEST: f64 = 5e-4;
/// Share of the time that is left which the counted work may fill: predictions err.
const FILLED: f64 = 0.9;
/// Most times that settings are planned: the first may tell that more fits, or less.
const MOST_PLANS: u32 = 3;
/// Fewest splats, as a share of all.
const LEAST_SHARE: f64 = 1.0 / 64.0;
/// Fewest sets of particles.
const LEAST_SETS: u32 = 2;

/// Settings that may give way to a budget.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Rung {
    antialias: u32,
    splat_share: f64,
    /// Sets of particles.
    sets: u32,
}

/// A setting of the scene that gave way.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GivenUp {
    /// The key, such as `render.antialias`.
    pub key: &'static str,
    /// Its value in the scene, as it is written there.
    pub asked: String,
    /// The value that the picture was drawn with.
    pub taken: String,
}

/// A picture that was drawn within a time.
#[derive(Debug, Clone, PartialEq)]
pub struct WithinBudget {
    /// The picture.
    pub render: Render,
    /// What gave way; with these values the scene is drawn again to the same bits. Empty where the scene's own settings fit.
    pub given_up: Vec<GivenUp>,
    /// Time that was expected, from files read to picture finished.
    pub expected: Duration,
    /// Time that it took.
    pub taken: Duration,
}

impl Rung {
    fn of_scene(scene: &Scene) -> Self {
        let render = &scene.render;
        Self { antialias: render.antialias, splat_share: render.splat_share, sets: render.particles.repeat_level }
    }

    fn applied_to(self, scene: &Scene) -> Scene {
        let mut scene = scene.clone();
        scene.render.antialias = self.antialias;
        scene.render.splat_share = self.splat_share;
        scene.render.particles.repeat_level = self.sets;
        scene
    }

    /// What differs from the scene's own settings.
    fn given_up(self, asked: Self) -> Vec<GivenUp> {
        let number = organza_scene::short;
        let settings = [
            ("render.antialias", asked.antialias.to_string(), self.antialias.to_string()),
            ("render.splat_share", number(asked.splat_share), number(self.splat_share)),
            ("render.particles.repeat_level", asked.sets.to_string(), self.sets.to_string()),
        ];
        let gone = settings.into_iter().filter(|(_, asked, taken)| asked != taken);
        gone.map(|(key, asked, taken)| GivenUp { key, asked, taken }).collect()
    }
}

/// The scene's own settings and what they give way to, each cheaper than the one before. Samples beyond two a side go first, which are hardly seen;
/// then splats down to a quarter, which blurs; then the second sample, which frays edges; then more splats. Of an average of random sets, sets go
/// twice as fast as the rest. Where nothing is made of splats, all that there are stay.
fn ladder(scene: &Scene, has_splats: bool) -> Vec<Rung> {
    let is_random = techniques(scene).into_iter().any(|technique| row(technique).is_random);
    let mut rung = Rung::of_scene(scene);
    let mut rungs = vec![rung];
    let least_share = if has_splats { LEAST_SHARE } else { rung.splat_share };
    let mut quarter = rung.splat_share / 4.0;
    loop {
        let mut is_changed = false;
        if is_random {
            for _ in 0..2 {
                if rung.sets / 2 >= LEAST_SETS {
                    rung.sets /= 2;
                    rungs.push(rung);
                    is_changed = true;
                }
            }
        }
        if rung.antialias > 2 {
            rung.antialias = rung.antialias.div_ceil(2).max(2);
        } else if rung.splat_share > quarter.max(least_share) {
            rung.splat_share = (rung.splat_share / 2.0).max(least_share);
        } else if rung.antialias > 1 {
            rung.antialias = 1;
            quarter = 0.0;
        } else if rung.splat_share > least_share {
            quarter = 0.0;
            rung.splat_share = (rung.splat_share / 2.0).max(least_share);
        } else if !is_changed {
            return rungs;
        } else {
            continue;
        }
        rungs.push(rung);
    }
}

/// What a trial told.
struct Trial {
    /// Counted work, with the seconds of an item as they were measured.
    predicted: Prediction,
    rung: Rung,
    /// Samples of the picture.
    samples: f64,
    /// Seconds of planning, most of which goes with the splats where there are some.
    planning: f64,
    has_splats: bool,
}

/// Renders a scene so that no more than `budget` passes from its files being read to the picture being finished, on the threads that there are.
/// Settings give way where they have to; which is told, and what is drawn is what the scene draws with the settings that were taken.
///
/// # Errors
/// [`Error::Limit`] where no settings fit, with the shortest time that does; else as [`crate::render`].
pub fn render_within(
    scene: &Scene,
    budget: Duration,
    options: &RenderOptions,
    progress: &Progress,
    files: Files,
) -> Result<WithinBudget, Error> {
    let (stated, found) = fitted(scene, options, progress, &files)?;
    let scene = settle::settled(Cow::Borrowed(&*stated), options, progress, &files)?;
    let mut cost = CostRecord::default();
    let begun = Instant::now();
    let asked = Rung::of_scene(&scene);
    // All splats, of which settings that give way keep a share.
    let everything = Rung { splat_share: 1.0, ..asked }.applied_to(&scene);
    let mut loaded = load_measured(&everything, options, progress, &files, &mut cost)?;
    let reading = cost.stages.iter().filter(|stage| stage.name == pass::READ).map(|stage| stage.seconds).sum::<f64>();
    let spent = || begun.elapsed().as_secs_f64() - reading;
    let mut rungs = Vec::new();
    for rung in ladder(&scene, !loaded.cloud.is_empty()) {
        // The settings alone have to draw the same picture again: `auto` must not choose otherwise with them.
        let changed = settle::settled(Cow::Owned(rung.applied_to(&stated)), options, progress, &files)?;
        if is_drawn_alike(&scene, &changed) {
            rungs.push(rung);
        }
    }
    let trial = trial(&scene, &mut loaded, options, progress)?;
    let size = scene.camera.size;
    // What the counted work of a plan has been over what the trial told of it.
    let mut scale = 1.0;
    // Rungs from here on may fit; the plan of one of them did.
    let mut first = 0;
    let mut fitting = None;
    let mut attempt = 0;
    loop {
        attempt += 1;
        let left = budget.as_secs_f64() - spent();
        let cheap_enough = |at: &usize| scale * trial.seconds(rungs[*at], size) <= FILLED * left;
        let chosen = (first..fitting.unwrap_or(rungs.len())).find(cheap_enough).or(fitting);
        let at = match chosen {
            Some(at) => at,
            // Nothing is known of the last but that it was thought too long.
            None if attempt > 1 && first < rungs.len() => rungs.len() - 1,
            None => {
                let shortest =
                    rungs.iter().map(|rung| scale * trial.seconds(*rung, size)).fold(f64::INFINITY, f64::min);
                return Err(too_short(budget, spent() + shortest / FILLED));
            }
        };
        let rung = rungs[at];
        let resolved = rung.applied_to(&scene);
        let whole = loaded.keep_share(rung.splat_share);
        loaded.retarget(&resolved);
        let begun = Instant::now();
        let planned = plan_alone(&resolved, &loaded, options)?;
        let planning = begun.elapsed().as_secs_f64();
        let drawing = drawing_seconds(&resolved, &loaded, &planned, &trial.predicted.rates, options)?;
        // What is drawn is planned once more, with what its bounds leave out.
        let expected = spent() + planning + drawing;
        scale = drawing / trial.drawing(rung, size);
        let left = budget.as_secs_f64() - spent();
        let cheap_enough = |at: &usize| scale * trial.seconds(rungs[*at], size) <= FILLED * left;
        let is_more = attempt < MOST_PLANS && (first..at).any(|above| cheap_enough(&above));
        if expected <= budget.as_secs_f64() && !is_more || fitting == Some(at) {
            drop(whole);
            let made = Made { scene: resolved.clone(), loaded, planned, leaves: Leaves::default() };
            let mut left = Left { files, is_still: true, made: Some(made), ..Left::default() };
            let mut render = render_keeping(&resolved, options, progress, &mut left)?;
            let taken = spent();
            render.cost.stages = [cost.stages, render.cost.stages].concat();
            render.found = render.found.or(found);
            return Ok(WithinBudget {
                render,
                given_up: rung.given_up(asked),
                expected: Duration::from_secs_f64(expected),
                taken: Duration::from_secs_f64(taken),
            });
        }
        loaded.take_back(whole);
        if expected <= budget.as_secs_f64() {
            fitting = Some(at);
        } else if at + 1 == rungs.len() {
            return Err(too_short(budget, expected));
        } else {
            first = at + 1;
        }
    }
}

/// Whether two settled scenes, which differ in settings that give way, are drawn by the same techniques.
fn is_drawn_alike(scene: &Scene, other: &Scene) -> bool {
    scene.render.technique == other.render.technique
        && scene.render.sheets == other.render.sheets
        && scene.objects.iter().zip(&other.objects).all(|(object, changed)| object.technique == changed.technique)
}

/// Predicted seconds of drawing what was planned.
fn drawing_seconds(
    scene: &Scene,
    loaded: &Loaded,
    planned: &Planned,
    rates: &Rates,
    options: &RenderOptions,
) -> Result<f64, Error> {
    let progress = Progress::new();
    let frame = Frame::new(scene, loaded, &planned.plan, &progress);
    let mut folds: Vec<Box<dyn Fold + '_>> =
        planned.plan.techniques.iter().map(|technique| (row(*technique).begin)(&frame)).collect();
    folds.iter_mut().try_for_each(|fold| fold.check(options, &mut CostRecord::default()))?;
    let work = prediction(&frame, &folds, &ranges(&frame), options).drawing;
    Ok(work.iter().map(|pass| pass.seconds(rates, rayon::current_num_threads())).sum())
}

/// A small picture of a part of the splats, timed.
fn trial(scene: &Scene, loaded: &mut Loaded, options: &RenderOptions, progress: &Progress) -> Result<Trial, Error> {
    let asked = Rung::of_scene(scene);
    let rung = Rung { splat_share: asked.splat_share * TRIAL_SPLATS, sets: asked.sets.min(TRIAL_SETS), ..asked };
    let mut small = rung.applied_to(scene);
    let part = if loaded.own.is_empty() { TRIAL_SIDE } else { TRIAL_SIDE_OF_VOXELS };
    small.camera.size = scene.camera.size.map(|side| side.div_ceil(part));
    let whole = loaded.keep_share(rung.splat_share);
    loaded.retarget(&small);
    let begun = Instant::now();
    let planned = plan_alone(&small, loaded, options)?;
    let planning = begun.elapsed().as_secs_f64();
    let mut cost = CostRecord::default();
    let mut warnings = Vec::new();
    let predicted = {
        let frame = Frame::new(&small, loaded, &planned.plan, progress);
        let mut session = Session {
            options,
            checkpoint: None,
            kept: None,
            warnings: &mut warnings,
            sets: None,
            predicted: Prediction::default(),
        };
        draw::draw(&frame, &mut session, &mut cost)?;
        session.predicted
    };
    loaded.take_back(whole);
    let [width, height] = small.camera.size.map(f64::from);
    let samples = width * height * f64::from(rung.antialias).powi(2);
    let rates = measured_rates(&predicted, &cost);
    let has_splats = !loaded.cloud.is_empty();
    Ok(Trial { predicted: Prediction { rates, ..predicted }, rung, samples, planning, has_splats })
}

/// The rates of a prediction, those of each pass times what it took over what was predicted.
fn measured_rates(predicted: &Prediction, cost: &CostRecord) -> Rates {
    let threads = rayon::current_num_threads();
    let ratio = |name: &str| {
        let took = cost.stages.iter().filter(|stage| stage.name == name).map(|stage| stage.seconds).sum::<f64>();
        let passes = predicted.drawing.iter().filter(|pass| pass.pass == name);
        let thought = passes.map(|pass| pass.seconds(&predicted.rates, threads)).sum::<f64>();
        if took > SHORTEST && thought > 0.0 { took / thought } else { 1.0 }
    };
    Rates::measured(|item| predicted.rates.ns(item) * ratio(item.pass()), "a trial".to_owned())
}

impl Trial {
    /// Seconds of planning and drawing with other settings in a picture of this size, from the trial's counts.
    fn seconds(&self, rung: Rung, size: [u32; 2]) -> f64 {
        let splats = if self.has_splats { rung.splat_share / self.rung.splat_share } else { 1.0 };
        self.planning * splats + self.drawing(rung, size)
    }

    /// Seconds of drawing alone.
    fn drawing(&self, rung: Rung, size: [u32; 2]) -> f64 {
        let threads = rayon::current_num_threads();
        let splats = rung.splat_share / self.rung.splat_share;
        let [width, height] = size.map(f64::from);
        let samples = width * height * f64::from(rung.antialias).powi(2) / self.samples;
        let sets = f64::from(rung.sets) / f64::from(self.rung.sets);
        let grown = |pass: &crate::cost::CountedPass| {
            let mut pass = pass.clone();
            for count in &mut pass.counts {
                count.number *= match count.item.growth() {
                    Growth::Fixed => 1.0,
                    Growth::Splats => splats,
                    Growth::Samples => samples,
                    // Footprints of media grow more slowly than splats become fewer.
                    Growth::Fragments => samples * libm::cbrt(splats),
                    Growth::Sets => samples * sets,
                };
            }
            pass.seconds(&self.predicted.rates, threads)
        };
        self.predicted.drawing.iter().map(grown).sum()
    }
}

/// Refuses a time that is too short for all settings.
fn too_short(budget: Duration, shortest: f64) -> Error {
    let ms = |seconds: f64| libm::ceil(1e3 * seconds) as u64;
    Error::Limit(Exceeded {
        what: "this picture, with the fewest samples and splats,".into(),
        needed: ms(shortest),
        limit: Some(ms(budget.as_secs_f64())),
        unit: "ms",
        hint: format!("use --budget {}, or a smaller --size", ms(MARGIN * shortest)).into(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{LoadOptions, parse};

    fn scene(render: &str) -> Scene {
        let text = format!(
            "version = 1\n[camera]\nposition = [0, 0, 4]\ntarget = [0, 0, 0]\nsize = [64, 48]\n\
             [[object]]\nname = 'fog'\nmedium_box = {{ min = [-1, -1, -1], max = [1, 1, 1], extinction = 1, spacing = 0.1 }}\n\
             [render]\n{render}\n"
        );
        parse("s.toml".as_ref(), text.as_bytes(), &LoadOptions::default()).unwrap()
    }

    #[test]
    fn the_ladder_begins_with_the_scene_and_each_rung_gives_way_in_one_setting() {
        for render in
            ["antialias = 8", "antialias = 1", "technique = 'particles'", "splat_share = 0.01", "antialias = 3"]
        {
            let scene = scene(render);
            let rungs = ladder(&scene, true);
            assert_eq!(rungs[0], Rung::of_scene(&scene));
            assert!(ladder(&scene, false).iter().all(|rung| rung.splat_share == rungs[0].splat_share));
            for pair in rungs.windows(2) {
                let before = pair[0];
                let after = pair[1];
                let changed = after.given_up(before);
                assert_eq!(changed.len(), 1, "{render}: {changed:?}");
                let less = after.antialias <= before.antialias
                    && after.splat_share <= before.splat_share
                    && after.sets <= before.sets;
                assert!(less, "{render}: {changed:?}");
            }
            let last = rungs[rungs.len() - 1];
            assert_eq!(last.antialias, 1, "{render}");
            assert_eq!(last.splat_share, LEAST_SHARE.min(rungs[0].splat_share), "{render}");
            assert_eq!(last.sets < 2 * LEAST_SETS, render.contains("particles"), "{render}");
        }
    }

    #[test]
    fn what_was_given_up_is_named_with_both_values() {
        let asked = Rung { antialias: 4, splat_share: 1.0, sets: 100 };
        assert!(asked.given_up(asked).is_empty());
        let taken = Rung { splat_share: 0.25, ..asked };
        let expected = GivenUp { key: "render.splat_share", asked: "1".into(), taken: "0.25".into() };
        assert_eq!(taken.given_up(asked), [expected]);
    }
}
