//! Renders a picture within a time, or within an error. Settings of the scene give way as far as the time requires, or as far
//! as the error allows.
//!
//! ```text
//! load ─► trial: a sixteenth of the splats, a quarter of the width ─► seconds of an item, by pass, here and now
//!    └──► small pictures, one setting turned in each ──────────────► errors of settings
//!                                                                          │
//! every combination ─► those that none beats in both: the ladder ─► the first that fits the time, the last within the error ─► plan ─► draw
//! ```
//!
//! Counted work comes from the trial's counts, scaled with the quantity that an item grows with: splats, samples of the picture, or fragments of
//! both. The chosen settings are planned in full before they are drawn. They give way to the next if the plan counts more work than the estimate.
//! Without a time nothing is chosen by a clock: figures of a machine take its place.
//!
//! Media that are drawn from their own data take as long in a small picture as in a large one. A trial that would take over a tenth of the time is counted,
//! not drawn, and so are the other small pictures: figures of a machine and errors of typical scenes stand in for them.

mod errors;
mod rung;
mod small;
mod trial;

use super::{Left, Made, Render, foreseen, render_keeping};
use crate::choose::settle;
use crate::cost::Rates;
use crate::frame::{Frame, Leaves};
use crate::load::Loaded;
use crate::load::files::Files;
use crate::pass;
use crate::prepare::{Planned, fitted, load_measured, plan_alone};
use crate::scene::{FoundCamera, Goal, Scene};
use crate::{Context, CostRecord, Error, Progress, RenderOptions};
use errors::Errors;
pub use errors::ExpectedError;
pub use rung::GivenUp;
use rung::{Rung, antialias_values, is_random, rungs};
use small::Drawing;
use splat_core::Exceeded;
use std::borrow::Cow;
use std::time::{Duration, Instant};
use trial::Trial;

/// A time that is named in the place of one that is too short is so many times what was predicted, for predictions err.
const MARGIN: f64 = 1.25;
/// Share of the time that is left which the counted work may fill: predictions err.
const FILLED: f64 = 0.9;
/// Share of a time that the trial may take, and that all pictures may that tell errors.
const FOR_PICTURES: f64 = 0.1;
/// Most times that settings are planned: the first may tell that more fits, or less.
const MOST_PLANS: u32 = 3;
/// A rung is left out that takes more than this share of the time of the one before.
const WORTH_A_RUNG: f64 = 0.85;

/// A rung of the ladder: settings with their expected time and error.
#[derive(Debug, Clone, PartialEq)]
pub struct Expected {
    /// Samples along each side of a pixel.
    pub antialias: u32,
    /// Share of the splats.
    pub splat_share: f64,
    /// Sets of particles; `None` where nothing is random.
    pub sets: Option<u32>,
    /// Time of planning and drawing.
    pub time: Duration,
    /// The expected error, against the scene's stated settings.
    pub error: ExpectedError,
}

/// A picture that keeps to a goal.
#[derive(Debug, Clone, PartialEq)]
pub struct WithinGoal {
    /// The picture.
    pub render: Render,
    /// The settings that gave way; with their values the scene is drawn again to the same bits. Empty if the scene's stated
    /// settings were taken.
    pub given_up: Vec<GivenUp>,
    /// Time that was expected, from files read to picture finished.
    pub expected: Duration,
    /// Time that it took.
    pub taken: Duration,
    /// The expected error, against the scene's stated settings.
    pub error: ExpectedError,
    /// Whether small pictures of the scene told its errors: where these would take too much of the time, errors are those of typical scenes.
    pub is_probed: bool,
    /// The ladder, from the scene's stated settings down.
    pub ladder: Vec<Expected>,
}

/// Settings with what is expected of them.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    rung: Rung,
    seconds: f64,
    error: ExpectedError,
}

impl Candidate {
    fn is_within(&self, goal: &Goal) -> bool {
        goal.max_rmse.is_none_or(|most| self.error.rmse <= most)
            && goal.max_flip.is_none_or(|most| self.error.flip <= most)
    }
}

/// The settings that no others beat in time and error: the scene's own first, each faster than the one before, and less exact.
fn ladder(asked: Rung, mut candidates: Vec<Candidate>) -> Vec<Candidate> {
    let is_other = |candidate: &Candidate| candidate.rung != asked;
    candidates.sort_by(|a, b| {
        let by_error = is_other(a).cmp(&is_other(b)).then(a.error.rmse.total_cmp(&b.error.rmse));
        by_error.then(a.seconds.total_cmp(&b.seconds))
    });
    let mut ladder: Vec<Candidate> = Vec::new();
    for candidate in candidates {
        if ladder.last().is_none_or(|last| candidate.seconds <= WORTH_A_RUNG * last.seconds) {
            ladder.push(candidate);
        }
    }
    ladder
}

/// A scene that is being drawn within a goal.
struct Search<'a> {
    drawing: Drawing<'a>,
    goal: Goal,
    asked: Rung,
    ladder: Vec<Candidate>,
    is_probed: bool,
    trial: Trial,
    loaded: Loaded,
    cost: CostRecord,
    found: Option<FoundCamera>,
    begun: Instant,
}

/// Settings that were planned in full.
struct Chosen {
    candidate: Candidate,
    resolved: Scene,
    planned: Planned,
    /// Seconds of counted work.
    drawing: f64,
    /// Seconds from files read to picture finished.
    expected: f64,
}

/// Renders a scene within a goal, on the threads of the current pool. Among settings within the errors it takes the most accurate that fit the
/// time; without a time, the fastest. The picture is that of the scene with the chosen settings.
///
/// Errors are estimates from small pictures, against the picture with the scene's stated settings: on the whole within a factor of
/// two.
///
/// # Errors
/// [`Error::Limit`] where no settings keep to all of it, with the shortest time that does; else as [`crate::render`].
pub fn render_within(
    scene: &Scene,
    goal: &Goal,
    options: &RenderOptions,
    progress: &Progress,
    files: Files,
) -> Result<WithinGoal, Error> {
    let context = Context { files: &files, options, progress };
    let (stated, found) = fitted(scene, context)?;
    let scene = settle::settled(Cow::Borrowed(&*stated), context)?;
    let mut cost = CostRecord::default();
    let begun = Instant::now();
    let asked = Rung::of_scene(&scene);
    // All splats, of which settings that give way keep a share.
    let everything = Rung { splat_share: 1.0, ..asked }.applied_to(&scene);
    let mut loaded = load_measured(&everything, context, &mut cost)?;
    let drawing = Drawing { scene: &scene, options, progress };
    let has_time = goal.budget_ms.is_some();
    let for_each = goal.budget_ms.map_or(f64::INFINITY, |ms| FOR_PICTURES * 1e-3 * ms as f64);
    let mut trial = Trial::new(&drawing, &mut loaded, for_each)?;
    // A limit of errors is compared with what this scene errs by, however long that takes to find.
    let has_error = goal.max_rmse.is_some() || goal.max_flip.is_some();
    let for_errors = if has_error { f64::INFINITY } else { for_each };
    let errors = Errors::new(&drawing, &mut loaded, &trial, has_time, for_errors)?;
    errors.thinned.iter().for_each(|thinned| trial.learn(thinned));
    // A choice by a clock would be another at each run.
    let trial = if has_time { trial } else { trial.by(&options.rates) };
    // The settings alone have to draw the same picture again: `auto` must not choose otherwise with them. Of these settings it asks for samples alone.
    let mut alike = Vec::new();
    for antialias in antialias_values(asked) {
        let changed = Rung { antialias, ..asked }.applied_to(&stated);
        let changed = settle::settled(Cow::Owned(changed), context)?;
        alike.extend(is_drawn_alike(&scene, &changed).then_some(antialias));
    }
    let possible = rungs(&scene, !loaded.cloud.is_empty()).into_iter().filter(|rung| alike.contains(&rung.antialias));
    let size = scene.camera.size;
    let candidates =
        possible.map(|rung| Candidate { rung, seconds: trial.seconds(rung, size), error: errors.expected(rung) });
    let ladder = ladder(asked, candidates.collect());
    let is_probed = errors.are_probed;
    let mut search = Search { drawing, goal: *goal, asked, ladder, is_probed, trial, loaded, cost, found, begun };
    let chosen = match goal.budget_ms {
        Some(ms) => search.fitting(Duration::from_millis(ms))?,
        None => search.cheapest()?,
    };
    search.drawn(chosen, files)
}

impl Search<'_> {
    /// Seconds since files were read.
    fn spent(&self) -> f64 {
        let reading = self.cost.stages.iter().filter(|stage| stage.name == pass::READ).map(|stage| stage.seconds);
        self.begun.elapsed().as_secs_f64() - reading.sum::<f64>()
    }

    /// Plans settings in full, with the splats that they keep: those that they leave out are given back.
    fn planned(&mut self, candidate: Candidate) -> Result<(Chosen, Option<crate::load::Everything>), Error> {
        let resolved = candidate.rung.applied_to(self.drawing.scene);
        let whole = self.loaded.keep_share(candidate.rung.splat_share);
        self.loaded.retarget(&resolved);
        let begun = Instant::now();
        let planned = plan_alone(&resolved, &self.loaded, self.drawing.options)?;
        let planning = begun.elapsed().as_secs_f64();
        let rates = &self.trial.predicted.rates;
        let seconds = drawing_seconds(&resolved, &self.loaded, &planned, rates, self.drawing.options)?;
        // What is drawn is planned once more, with what its bounds leave out.
        let expected = self.spent() + planning + self.trial.uncounted + seconds;
        Ok((Chosen { candidate, resolved, planned, drawing: seconds, expected }, whole))
    }

    /// The settings within the errors that take least.
    fn cheapest(&mut self) -> Result<Chosen, Error> {
        let within = self.ladder.iter().rev().find(|candidate| candidate.is_within(&self.goal));
        // The scene's own settings err by nothing.
        let cheapest = *within.unwrap_or(&self.ladder[0]);
        Ok(self.planned(cheapest)?.0)
    }

    /// The settings within the errors that err least of those that fit the time.
    fn fitting(&mut self, budget: Duration) -> Result<Chosen, Error> {
        let size = self.drawing.scene.camera.size;
        let allowed: Vec<Candidate> =
            self.ladder.iter().filter(|candidate| candidate.is_within(&self.goal)).copied().collect();
        // What the counted work of a plan has been over what the trial told of it.
        let mut scale = 1.0;
        // Rungs from here on may fit; the plan of one of them did.
        let mut first = 0;
        let mut fitting = None;
        let mut attempt = 0;
        loop {
            attempt += 1;
            let left = budget.as_secs_f64() - self.spent();
            let cheap_enough = |at: &usize| scale * allowed[*at].seconds <= FILLED * left;
            let chosen = (first..fitting.unwrap_or(allowed.len())).find(cheap_enough).or(fitting);
            let at = match chosen {
                Some(at) => at,
                // Nothing is known of the last but that it was thought too long.
                None if attempt > 1 && first < allowed.len() => allowed.len() - 1,
                None => {
                    let shortest = allowed.last().map_or(f64::INFINITY, |last| scale * last.seconds);
                    return Err(self.too_short(budget, self.spent() + shortest / FILLED, scale));
                }
            };
            let (chosen, whole) = self.planned(allowed[at])?;
            scale = chosen.drawing / self.trial.drawing(allowed[at].rung, size);
            let left = budget.as_secs_f64() - self.spent();
            let cheap_enough = |at: &usize| scale * allowed[*at].seconds <= FILLED * left;
            let is_more = attempt < MOST_PLANS && (first..at).any(|above| cheap_enough(&above));
            let fits = chosen.expected <= budget.as_secs_f64();
            if fits && !is_more || fitting == Some(at) {
                return Ok(chosen);
            }
            self.loaded.take_back(whole);
            if fits {
                fitting = Some(at);
            } else if at + 1 == allowed.len() {
                return Err(self.too_short(budget, chosen.expected, scale));
            } else {
                first = at + 1;
            }
        }
    }

    /// Draws with settings that were planned, and have their share of the splats.
    fn drawn(self, chosen: Chosen, files: Files) -> Result<WithinGoal, Error> {
        let Chosen { candidate, resolved, planned, expected, .. } = chosen;
        let Drawing { scene, options, progress } = self.drawing;
        let reading = self.cost.stages.iter().filter(|stage| stage.name == pass::READ).map(|stage| stage.seconds);
        let reading = reading.sum::<f64>();
        let made =
            Made { scene: resolved.clone(), loaded: self.loaded, planned, leaves: Leaves::default(), uncut: None };
        let mut left = Left { files, is_still: true, made: Some(made), ..Left::default() };
        let mut render = render_keeping(&resolved, None, options, progress, &mut left)?;
        let taken = self.begun.elapsed().as_secs_f64() - reading;
        render.cost.stages = [self.cost.stages, render.cost.stages].concat();
        render.found = render.found.or(self.found);
        let is_random = is_random(scene);
        let rung = |candidate: &Candidate| Expected {
            antialias: candidate.rung.antialias,
            splat_share: candidate.rung.splat_share,
            sets: is_random.then_some(candidate.rung.sets),
            time: duration(candidate.seconds),
            error: candidate.error,
        };
        Ok(WithinGoal {
            render,
            given_up: candidate.rung.given_up(self.asked),
            expected: duration(expected),
            taken: duration(taken),
            error: candidate.error,
            is_probed: self.is_probed,
            ladder: self.ladder.iter().map(rung).collect(),
        })
    }

    /// Refuses a time that is too short for all settings within the errors, with the shortest that is not, and the least error that the time leaves.
    fn too_short(&self, budget: Duration, shortest: f64, scale: f64) -> Error {
        let ms = |seconds: f64| libm::ceil(1e3 * seconds) as u64;
        let left = budget.as_secs_f64() - self.spent();
        let fits = |candidate: &&Candidate| scale * candidate.seconds <= FILLED * left;
        let least = self.ladder.iter().find(fits).map(|candidate| candidate.error);
        let number = organza_scene::short;
        let mut other = String::new();
        let mut what = "this picture, with the fewest samples and splats,";
        if self.goal.max_rmse.is_some() || self.goal.max_flip.is_some() {
            what = "this picture, with the fewest samples and splats that the errors allow,";
            let rmse = least.filter(|_| self.goal.max_rmse.is_some());
            let flip = least.filter(|_| self.goal.max_flip.is_some());
            other += &rmse.map_or_else(String::new, |e| format!("--max-rmse {}, ", number(rounded_up(e.rmse))));
            other += &flip.map_or_else(String::new, |e| format!("--max-flip {}, ", number(rounded_up(e.flip))));
        }
        Error::Limit(Exceeded {
            what: what.into(),
            needed: ms(shortest),
            limit: Some(ms(budget.as_secs_f64())),
            unit: "ms",
            hint: format!("use --budget {}, {other}or a smaller --size", ms(MARGIN * shortest)).into(),
        })
    }
}

/// A time, the longest that there is where it is longer.
fn duration(seconds: f64) -> Duration {
    Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX)
}

/// The next number of two digits.
fn rounded_up(error: f64) -> f64 {
    if error <= 0.0 {
        return error;
    }
    let unit = libm::pow(10.0, libm::floor(libm::log10(error)) - 1.0);
    libm::ceil(error / unit) * unit
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
    let work = foreseen(&frame, options)?.drawing;
    Ok(work.iter().map(|pass| pass.seconds(rates, rayon::current_num_threads())).sum())
}

#[cfg(test)]
mod tests {
    use super::*;

    const ASKED: Rung = Rung { antialias: 2, splat_share: 1.0, sets: 100 };

    fn candidate(rung: Rung, seconds: f64, rmse: f64) -> Candidate {
        Candidate { rung, seconds, error: ExpectedError { rmse, flip: 2.0 * rmse } }
    }

    fn with_share(splat_share: f64, seconds: f64, rmse: f64) -> Candidate {
        candidate(Rung { splat_share, ..ASKED }, seconds, rmse)
    }

    #[test]
    fn the_ladder_begins_with_the_scene_and_each_rung_is_faster_and_less_exact() {
        let candidates = vec![
            with_share(0.25, 3.0, 0.02),
            candidate(Rung { antialias: 1, ..ASKED }, 5.0, 0.01),
            // Slower than what is more exact.
            with_share(0.5, 6.0, 0.015),
            candidate(ASKED, 8.0, 0.0),
            // Nothing is wrong with it, but it is the scene's own that comes first.
            candidate(Rung { sets: 71, ..ASKED }, 7.9, 0.0),
            // Saves too little.
            with_share(0.2, 2.9, 0.021),
            with_share(0.1, 1.0, 0.04),
        ];
        let ladder = ladder(ASKED, candidates);
        let seconds: Vec<f64> = ladder.iter().map(|candidate| candidate.seconds).collect();
        assert_eq!(seconds, [8.0, 5.0, 3.0, 1.0]);
        assert_eq!(ladder[0].rung, ASKED);
        assert!(ladder.windows(2).all(|pair| pair[0].error.rmse < pair[1].error.rmse));
    }

    #[test]
    fn where_small_pictures_would_take_too_long_typical_errors_take_their_place() {
        let text = "version = 1\n[camera]\nposition = [0, 0, 4]\ntarget = [0, 0, 0]\nsize = [64, 48]\n[render]\ntechnique = 'points'\n\
            [[light]]\nkind = 'directional'\ndirection = [0, -1, -1]\nirradiance = [1, 1, 1]\n\
            [[object]]\nname = 'fog'\nmedium_box = { min = [-1, -1, -1], max = [1, 1, 1], extinction = 1, spacing = 0.1 }\n";
        let scene = crate::scene::parse("s.toml".as_ref(), text.as_bytes(), &crate::scene::LoadOptions::default());
        let scene = scene.unwrap();
        let options = RenderOptions::default();
        let progress = Progress::new();
        let context = Context { files: &Files::default(), options: &options, progress: &progress };
        let mut loaded = load_measured(&scene, context, &mut CostRecord::default()).unwrap();
        let splats = loaded.cloud.len();
        let drawing = Drawing { scene: &scene, options: &options, progress: &progress };
        let mut told = |most_seconds: f64| {
            let trial = Trial::new(&drawing, &mut loaded, most_seconds).unwrap();
            Errors::new(&drawing, &mut loaded, &trial, true, most_seconds).unwrap()
        };
        let typical = told(0.0);
        assert!(!typical.are_probed && told(f64::INFINITY).are_probed);
        let asked = Rung::of_scene(&scene);
        let rmse = |rung: Rung| typical.expected(rung).rmse;
        let with_share = |splat_share: f64| rmse(Rung { splat_share, ..asked });
        assert_eq!(rmse(asked), 0.0);
        assert!(with_share(0.5) > 0.0 && with_share(0.25) > with_share(0.5));
        assert!(rmse(Rung { antialias: 1, ..asked }) > 0.0);
        // Work is counted all the same, and no splat is lost.
        let thinned = typical.thinned.unwrap();
        let work = |prediction: &crate::cost::Prediction| prediction.seconds(1);
        assert!(work(&thinned.base) > work(&thinned.quarter) && work(&thinned.quarter) > 0.0);
        assert_eq!(loaded.cloud.len(), splats);
    }

    #[test]
    fn both_errors_have_to_be_within_the_goal() {
        let candidate = with_share(0.25, 3.0, 0.02);
        let is_within = |max_rmse, max_flip| candidate.is_within(&Goal { budget_ms: None, max_rmse, max_flip });
        assert!(is_within(None, None) && is_within(Some(0.02), Some(0.04)));
        assert!(!is_within(Some(0.019), None) && !is_within(Some(0.03), Some(0.039)));
    }

    #[test]
    fn an_error_that_is_named_is_not_below_the_one_that_it_stands_for() {
        for error in [0.001_23, 0.0999, 0.5, 1e-9] {
            let rounded = rounded_up(error);
            assert!(rounded >= error * (1.0 - 1e-12) && rounded <= 1.1 * error, "{error}: {rounded}");
        }
        assert_eq!(rounded_up(0.0), 0.0);
    }
}
