//! Draws all settings in shuffled order, finds the limit, and judges every setting by it.

use super::limit::{MOST_FINER, TOGETHER, converge, finer_by};
use super::repeat::{Repeats, attempt, repeat_all};
use super::resolve::MARGIN;
use super::settings::Settings;
use super::{
    Candidate, Curve, Distance, Frame, Knob, Limit, Options, Request, Sampled, Setting, Skipped, Sweep, Timed, Truth,
    frontier, hold,
};
use organza::{Error, Progress};
use reference::metrics::{Image, Linear};

/// Relative size of what f32 rounding leaves in a picture.
const ROUNDING: f64 = 1e-7;

/// The outcome of one setting: its picture's errors and times, or its failure.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// The setting.
    pub setting: Setting,
    /// Its repeats.
    pub timed: Timed,
    /// Distance from the limit, the mean over seeds of a random setting; `None` where the setting was not drawn or turns a
    /// knob that the limit holds.
    pub from_limit: Option<Distance>,
    /// Distance from physical truth, if the scene has a truth.
    pub from_truth: Option<Distance>,
    /// Bias and noise over its seeds; `None` of what is not random.
    pub sampled: Option<Sampled>,
    /// Whether the error against the limit is large enough to be drawn; a random setting has an interval instead.
    pub drawn: bool,
}

/// Least seconds of a setting's repeats, loading and conversion left out; `None` if it was not drawn. Other work of the machine
/// only ever adds to a repeat.
pub fn least_seconds(outcome: &Outcome) -> Option<f64> {
    outcome.timed.seconds.iter().copied().min_by(f64::total_cmp)
}

/// A judged sweep.
#[derive(Debug, Clone)]
pub struct Study {
    /// Name of the technique.
    pub technique: &'static str,
    /// Outcomes of all settings; the first is the scene's stated setting.
    pub outcomes: Vec<Outcome>,
    /// Convergence curves, one for each knob with a size.
    pub curves: Vec<Curve>,
    /// Knobs that were not turned.
    pub skipped: Vec<Skipped>,
    /// The limit.
    pub limit: Limit,
    /// Physical truth, or why the scene has none.
    pub truth: Result<Truth, String>,
    /// Settings of the frontier, from the most accurate to the fastest.
    pub frontier: Vec<usize>,
    /// The knobs.
    pub knobs: Vec<Knob>,
}

impl Study {
    /// Whether both are held against one limit, so that their errors can stand in one plot.
    pub fn shares_limit_with(&self, other: &Self) -> bool {
        self.limit.image == other.limit.image
    }

    /// Whether its settings are random: they have intervals, and no error is too small to be shown.
    pub fn is_random(&self) -> bool {
        self.outcomes.iter().any(|o| o.sampled.is_some())
    }
}

/// Stages of a study.
const FIRST: &str = "each setting once";
const ENDS: &str = "the limit";
const REPEATS: &str = "repeats";
const FRONTIER: &str = "the frontier";

/// A function that draws: the technique's renderer, or a test's.
pub type Draw<'a> = dyn FnMut(&Request) -> Result<Frame, Error> + 'a;

/// Draws and judges.
///
/// # Errors
/// [`Error::Unresolved`] if the limit's error is not ten times below that of the scene's stated setting, or leaves fewer than three
/// settings to draw. Errors of `draw`; a setting that exceeds a limit of resources is left out with a note instead. A study that is
/// cancelled after every picture is drawn has fewer times, and is no error.
pub fn study(
    sweep: &Sweep,
    truth: Result<Truth, String>,
    options: &Options,
    progress: &Progress,
    draw: &mut Draw<'_>,
) -> Result<Study, Error> {
    let mut settings = Settings::new(sweep);
    let mut timed = vec![Timed::default(); settings.list.len()];
    progress.enter();
    progress.plan(stages(sweep, settings.list.len() as f64, options));
    progress.within(FIRST, settings.list.iter().map(|s| (s.label.clone(), 1.0)), || {
        settings.list.iter().zip(&mut timed).try_for_each(|(setting, timed)| {
            progress.begin(&setting.label);
            // Not timed: it pays for loading and for cold caches.
            attempt(&setting.request, timed, false, false, draw)
        })
    })?;
    let picture = timed[0].image().ok_or_else(|| unresolved(timed[0].failure.clone().unwrap_or_default(), ""))?;
    let floor = ROUNDING * root_mean_square(picture);
    let ends = sweep.knobs.iter().map(|k| (k.name, 1.0)).chain([(TOGETHER, 1.0)]);
    let (curves, limit) = progress.within(ENDS, ends, || converge(sweep, &settings, &timed, floor, progress, draw))?;
    let resolved: Vec<&str> = limit.parts.iter().map(|p| p.0).collect();
    settings.join(sweep, &resolved);
    timed.resize(settings.list.len(), Timed::default());
    let repeats = Repeats { times: options.repeats(), seeded: false, order: options.seed };
    progress.begin(REPEATS);
    match repeat_all(&settings, &mut timed, &repeats, progress, draw) {
        // Every picture is there; some have fewer times.
        Err(Error::Cancelled) => {}
        repeated => repeated?,
    }
    let exposure = sweep.base.scene.render.exposure;
    let mut outcomes = Vec::new();
    for (setting, timed) in settings.list.into_iter().zip(timed) {
        let held = limit.held.iter().any(|h| Some(h.knob) == setting.knob);
        let distance = |to: &Image<Linear>| timed.image().map(|i| Distance::between(i, to, exposure)).transpose();
        let from_limit = if held { None } else { distance(&limit.image)? };
        let from_truth = truth.as_ref().map_or(Ok(None), |t| distance(&t.image))?;
        let drawn = from_limit.as_ref().is_some_and(|d| d.linear.rmse >= MARGIN * limit.own_error);
        outcomes.push(Outcome { setting, timed, from_limit, from_truth, sampled: None, drawn });
    }
    refuse_unless_resolved(&outcomes, &limit, &curves)?;
    progress.begin(FRONTIER);
    let frontier = hold_frontier(&mut outcomes, options, progress, draw)?;
    progress.leave();
    Ok(Study {
        technique: sweep.technique,
        outcomes,
        curves,
        skipped: sweep.skipped.clone(),
        limit,
        truth,
        frontier,
        knobs: sweep.knobs.clone(),
    })
}

/// The stages of a study of so many settings, weighed by draws; ends are large ones.
fn stages(sweep: &Sweep, settings: f64, options: &Options) -> [(&'static str, f64); 4] {
    let repeats = settings * options.repeats() as f64;
    let ends = 4.0 * sweep.knobs.iter().map(|k| k.ends.len()).sum::<usize>() as f64;
    [(FIRST, settings), (ENDS, ends), (REPEATS, repeats), (FRONTIER, 0.1 * repeats)]
}

fn refuse_unless_resolved(outcomes: &[Outcome], limit: &Limit, curves: &[Curve]) -> Result<(), Error> {
    let scene_error = outcomes[0].from_limit.as_ref().map_or(0.0, |d| d.linear.rmse);
    let drawn = outcomes.iter().filter(|o| o.drawn).count();
    // A scene whose own setting is the limit has no error to draw.
    if (outcomes[0].drawn || scene_error <= limit.own_error) && drawn >= 3 {
        return Ok(());
    }
    let target = scene_error / MARGIN / limit.parts.len().max(1) as f64;
    let blame =
        limit.parts.iter().filter(|p| p.1 > target).filter_map(|(knob, _)| {
            let settled = &curves.iter().find(|c| c.knob == *knob)?.settled;
            let factor = finer_by(settled, target);
            Some(factor.filter(|f| *f <= MOST_FINER).map_or_else(
                || format!("{knob}: no end within reach"),
                |f| format!("{knob}: an end {f:.1} times finer"),
            ))
        });
    let held = limit.held.iter().map(|h| format!("{}: {}", h.knob, h.reason));
    let blame: Vec<String> = blame.chain(held).collect();
    let hint = format!("{}; --finer N doubles every end N times", blame.join("; "));
    let message = format!(
        "the limit's own error is {:.1e}, the scene's own setting is {scene_error:.1e} from it, and {drawn} of {} settings are at \
         least ten times as far: expected three, and the scene's own among them unless it is the limit",
        limit.own_error,
        outcomes.len(),
    );
    Err(unresolved(message, hint))
}

fn unresolved(message: impl Into<String>, hint: impl Into<String>) -> Error {
    Error::Unresolved { message: message.into(), hint: hint.into() }
}

/// What may be on a frontier by the limit; ids are places in `outcomes`.
pub(super) fn candidates<'a>(outcomes: impl Iterator<Item = &'a Outcome>) -> Vec<Candidate> {
    // A picture that cannot be told from the limit has no error that could be shown.
    let error = |o: &Outcome| o.from_limit.as_ref().map(|d| if o.drawn { d.linear.rmse } else { 0.0 });
    let half_width = |o: &Outcome| o.sampled.map(|s| s.from_limit.half_width);
    candidates_by(outcomes, error, half_width)
}

/// The same by physical truth.
pub(super) fn candidates_by_truth<'a>(outcomes: impl Iterator<Item = &'a Outcome>) -> Vec<Candidate> {
    let error = |o: &Outcome| Some(o.from_truth.as_ref()?.linear.rmse);
    let half_width = |o: &Outcome| Some(o.sampled?.from_truth?.half_width);
    candidates_by(outcomes, error, half_width)
}

fn candidates_by<'a>(
    outcomes: impl Iterator<Item = &'a Outcome>,
    error: impl Fn(&Outcome) -> Option<f64>,
    half_width: impl Fn(&Outcome) -> Option<f64>,
) -> Vec<Candidate> {
    let candidate = |(id, o): (usize, &Outcome)| {
        let error = error(o)?;
        let seconds = least_seconds(o)?;
        Some(Candidate { id, error, half_width: half_width(o).unwrap_or(0.0), seconds })
    };
    outcomes.enumerate().filter_map(candidate).collect()
}

/// Places of those on the frontier, the most accurate first, after repeats of those that it hangs on.
pub(super) fn hold_frontier(
    outcomes: &mut [Outcome],
    options: &Options,
    progress: &Progress,
    draw: &mut Draw<'_>,
) -> Result<Vec<usize>, Error> {
    let held = hold(&mut candidates(outcomes.iter()), options.hold(), |id| {
        progress.tick(0).map_err(|_| Error::Cancelled)?;
        let frame = draw(&outcomes[id].setting.request)?;
        outcomes[id].timed.seconds.push(frame.seconds);
        Ok(frame.seconds)
    });
    match held {
        // It is that of the repeats there are.
        Err(Error::Cancelled) => Ok(frontier(&candidates(outcomes.iter()))),
        held => held,
    }
}

fn root_mean_square(image: &Image<Linear>) -> f64 {
    let n = (3 * image.pixels().len()).max(1) as f64;
    (image.pixels().iter().flatten().map(|v| v * v).sum::<f64>() / n).sqrt()
}
