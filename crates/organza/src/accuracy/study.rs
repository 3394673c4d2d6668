//! Draws all settings in shuffled order, finds the limit, and judges every setting by it.

use super::resolve::MARGIN;
use super::settings::Settings;
use super::{
    Candidate, Curve, CurvePoint, Distance, Frame, Knob, Options, Request, Sampled, Setting, Settled, Skipped, Step,
    Sweep, Timed, Truth, hold, settle,
};
use crate::{Error, Progress};
use reference::metrics::{Image, Linear, compare};
use splat_core::rng;

/// Relative size of what f32 rounding leaves in a picture.
const ROUNDING: f64 = 1e-7;

/// The picture with all knobs at their ends.
#[derive(Debug, Clone, PartialEq)]
pub struct Limit {
    /// The picture.
    pub image: Image<Linear>,
    /// Sum of the own errors of the ends that it takes, RMSE of linear radiance.
    pub own_error: f64,
    /// Own error of each end that it takes.
    pub parts: Vec<(&'static str, f64)>,
    /// Knobs that it leaves as the scene has them, and why.
    pub held: Vec<Skipped>,
    /// Seconds that drawing it took, once.
    pub seconds: f64,
}

/// What became of one setting.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// The setting.
    pub setting: Setting,
    /// Its repeats.
    pub timed: Timed,
    /// Distance from the limit, the mean over seeds of a random setting; `None` where the setting was not drawn or turns a
    /// knob that the limit holds.
    pub from_limit: Option<Distance>,
    /// Distance from physical truth, where there is one.
    pub from_truth: Option<Distance>,
    /// What its seeds say together; `None` of what is not random.
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
    /// All settings; the first is the scene's own.
    pub outcomes: Vec<Outcome>,
    /// One curve for each knob with a size.
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
    /// Whether its settings are random: they have intervals, and no error is too small to be shown.
    pub fn is_random(&self) -> bool {
        self.outcomes.iter().any(|o| o.sampled.is_some())
    }
}

/// Stages of a study.
const FIRST: &str = "each setting once";
const ENDS: &str = "the limit";
const TOGETHER: &str = "all knobs";
const REPEATS: &str = "repeats";
const FRONTIER: &str = "the frontier";

/// A function that draws: the technique's renderer, or a test's.
pub type Draw<'a> = dyn FnMut(&Request) -> Result<Frame, Error> + 'a;

/// Draws and judges.
///
/// # Errors
/// [`Error::Unresolved`] when the limit's own error is not ten times below that of the scene's own setting, or leaves fewer
/// than three settings to draw; those of `draw`, but a setting that exceeds a limit of resources is noted and left out.
pub fn study(
    sweep: &Sweep,
    truth: Result<Truth, String>,
    options: &Options,
    progress: &Progress,
    draw: &mut Draw<'_>,
) -> Result<Study, Error> {
    let mut settings = Settings::of(sweep);
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
    let own = timed[0].image().ok_or_else(|| unresolved(timed[0].failure.clone().unwrap_or_default(), ""))?;
    let floor = ROUNDING * root_mean_square(own);
    let ends = sweep.knobs.iter().map(|k| (k.name, 1.0)).chain([(TOGETHER, 1.0)]);
    let (curves, limit) = progress.within(ENDS, ends, || converge(sweep, &settings, &timed, floor, progress, draw))?;
    let resolved: Vec<&str> = limit.parts.iter().map(|p| p.0).collect();
    settings.join(sweep, &resolved);
    timed.resize(settings.list.len(), Timed::default());
    let repeats = Repeats { times: options.repeats(), seeded: false, order: options.seed };
    progress.begin(REPEATS);
    repeat_all(&settings, &mut timed, &repeats, progress, draw)?;
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

/// How often and in which order settings are timed.
pub(super) struct Repeats {
    pub(super) times: usize,
    /// Every repeat has a seed of its own, and its picture is kept.
    pub(super) seeded: bool,
    /// Seed of the order.
    pub(super) order: u64,
}

/// Every repeat of every setting, in an order that neither warms nor cools one of them by its place.
pub(super) fn repeat_all(
    settings: &Settings,
    timed: &mut [Timed],
    repeats: &Repeats,
    progress: &Progress,
    draw: &mut Draw<'_>,
) -> Result<(), Error> {
    let n = settings.list.len();
    let mut jobs: Vec<usize> = (0..n * repeats.times).collect();
    for i in (1..jobs.len()).rev() {
        jobs.swap(i, (rng::unit(repeats.order, 0, i as u64, 0) * (i + 1) as f64) as usize);
    }
    progress.enter();
    let name = |job: usize| format!("{} ({} of {})", settings.list[job % n].label, job / n + 1, repeats.times);
    progress.plan(jobs.iter().map(|job| (name(*job), 1.0)));
    for job in jobs {
        progress.begin(&name(job));
        progress.tick(0).map_err(|_| Error::Cancelled)?;
        let (setting, repeat) = (job % n, job / n);
        let mut request = settings.list[setting].request.clone();
        if repeats.seeded {
            request.scene.render.seed = request.scene.render.seed.wrapping_add(repeat as u64);
        }
        attempt(&request, &mut timed[setting], true, repeats.seeded, draw)?;
    }
    progress.leave();
    Ok(())
}

/// Draws once more, unless it could not be drawn before.
fn attempt(
    request: &Request,
    timed: &mut Timed,
    with_clock: bool,
    keep: bool,
    draw: &mut Draw<'_>,
) -> Result<(), Error> {
    if timed.failure.is_some() {
        return Ok(());
    }
    match draw(request) {
        Ok(frame) => timed.add(frame, with_clock, keep),
        Err(e) if is_resource_limit(&e) => timed.failure = Some(e.to_string()),
        Err(e) => return Err(e),
    }
    Ok(())
}

fn is_resource_limit(error: &Error) -> bool {
    matches!(error, Error::Limit { .. } | Error::TooLarge { .. })
}

/// The convergence of every knob that has an end which can be drawn, and of all together.
fn converge(
    sweep: &Sweep,
    settings: &Settings,
    timed: &[Timed],
    floor: f64,
    progress: &Progress,
    draw: &mut Draw<'_>,
) -> Result<(Vec<Curve>, Limit), Error> {
    let (mut curves, mut refused) = (Vec::new(), Vec::new());
    for (knob, of_step) in sweep.knobs.iter().zip(&settings.of_step) {
        progress.begin(knob.name);
        match curve(sweep, knob, of_step, settings, timed, floor, draw) {
            Ok(curve) => curves.extend(curve),
            Err(e) if is_resource_limit(&e) => refused.push(Skipped { knob: knob.name, reason: e.to_string() }),
            Err(e) => return Err(e),
        }
    }
    progress.begin(TOGETHER);
    let limit = limit(sweep, &curves, refused, draw)?;
    Ok((curves, limit))
}

/// The convergence of one knob against its end, the other knobs as in the scene; `None` for a choice.
fn curve(
    sweep: &Sweep,
    knob: &Knob,
    of_step: &[usize],
    settings: &Settings,
    timed: &[Timed],
    floor: f64,
    draw: &mut Draw<'_>,
) -> Result<Option<Curve>, Error> {
    let Some(End { step: end, image: reference, seconds: end_seconds }) = end(sweep, knob, settings, timed, draw)?
    else {
        return Ok(None);
    };
    let mut points = Vec::new();
    for (step, &setting) in knob.steps.iter().zip(of_step) {
        let image = timed[setting].image();
        let error = image.map(|i| compare(i, &reference)).transpose().map_err(|e| Error::Internal(e.to_string()))?;
        points.push(CurvePoint { setting, size: step.size, error: error.map(|e| e.rmse), drawn: false });
    }
    let sized: Vec<[f64; 2]> = points.iter().filter_map(|p| Some([p.size?, p.error?])).collect();
    let end_size = if knob.end_is_exact { None } else { end.size };
    let settled = settle(&sized, end_size, floor);
    for p in &mut points {
        p.drawn = p.size.is_some() && p.error.is_some_and(|e| e >= settled.least_drawn());
    }
    let own = timed[0].image().map(|i| compare(i, &reference)).transpose();
    let own_setting = own.map_err(|e| Error::Internal(e.to_string()))?.map_or(0.0, |e| e.rmse);
    Ok(Some(Curve { knob: knob.name, end, end_size, points, own_setting, settled, end_seconds }))
}

/// The picture with one knob at its end.
struct End {
    step: Step,
    image: Image<Linear>,
    /// What it took, unless it is one of the settings.
    seconds: Option<f64>,
}

/// The finest end of a knob that can be drawn; `None` for a choice.
fn end(
    sweep: &Sweep,
    knob: &Knob,
    settings: &Settings,
    timed: &[Timed],
    draw: &mut Draw<'_>,
) -> Result<Option<End>, Error> {
    let mut refused = None;
    for step in &knob.ends {
        let request = sweep.turned(knob, step);
        let known = settings.list.iter().position(|s| s.request == request).and_then(|s| timed[s].image().cloned());
        if let Some(image) = known {
            return Ok(Some(End { step: step.clone(), image, seconds: None }));
        }
        match draw(&request) {
            Ok(frame) => {
                return Ok(Some(End { step: step.clone(), image: frame.image, seconds: Some(frame.seconds) }));
            }
            Err(e) if is_resource_limit(&e) => refused = Some(e),
            Err(e) => return Err(e),
        }
    }
    refused.map_or(Ok(None), Err)
}

/// All knobs to their ends; those whose ends are not good enough stay where the scene has them, as do those that `held` names.
///
/// Ends join, the best first, while the sum of their own errors stays ten times below the distance that the scene's own
/// setting has from them together.
fn limit(sweep: &Sweep, curves: &[Curve], mut held: Vec<Skipped>, draw: &mut Draw<'_>) -> Result<Limit, Error> {
    let mut best_first: Vec<&Curve> = curves.iter().collect();
    let worth = |c: &Curve| if c.end_size.is_none() { f64::INFINITY } else { c.own_setting / c.settled.own_error };
    best_first.sort_by(|a, b| worth(b).total_cmp(&worth(a)));
    let (mut own_error, mut square) = (0.0, 0.0);
    let mut parts = Vec::new();
    for curve in best_first {
        let own = own_error + curve.settled.own_error;
        let apart = square + curve.own_setting * curve.own_setting;
        if curve.end_size.is_none() || MARGIN * own <= apart.sqrt() {
            (own_error, square) = (own, apart);
            parts.push((curve.knob, curve.settled.own_error));
        } else {
            held.push(Skipped { knob: curve.knob, reason: why_held(curve, apart.sqrt(), own_error) });
        }
    }
    let mut request = sweep.base.clone();
    for knob in sweep.knobs.iter().filter(|k| parts.iter().any(|p| p.0 == k.name)) {
        if let Some(curve) = curves.iter().find(|c| c.knob == knob.name) {
            (knob.set)(&mut request, curve.end.value);
        }
    }
    let frame = draw(&request)?;
    Ok(Limit { image: frame.image, own_error, parts, held, seconds: frame.seconds })
}

/// `apart` is how far the scene's own setting is from the ends so far and this one, `others` the own error of those so far.
fn why_held(curve: &Curve, apart: f64, others: f64) -> String {
    let target = apart / MARGIN - others;
    let needs = match finer_by(&curve.settled, target) {
        Some(factor) => format!("it would take an end {factor:.1} times finer"),
        None => "it does not converge fast enough to say what it would take".into(),
    };
    format!(
        "its end ({}) has an own error of {:.1e}, where at most {target:.1e} could be shown; {needs}",
        curve.end.label, curve.settled.own_error
    )
}

/// How many times finer an end must be for an own error of `target`; `None` where the order is too low to say.
fn finer_by(settled: &Settled, target: f64) -> Option<f64> {
    let order = settled.careful_order.filter(|p| *p >= 0.25 && target > 0.0)?;
    Some((settled.own_error / target).powf(order.recip()).max(1.0))
}

fn refuse_unless_resolved(outcomes: &[Outcome], limit: &Limit, curves: &[Curve]) -> Result<(), Error> {
    let own = outcomes[0].from_limit.as_ref().map_or(0.0, |d| d.linear.rmse);
    let drawn = outcomes.iter().filter(|o| o.drawn).count();
    // A scene whose own setting is the limit has no error to draw.
    if (outcomes[0].drawn || own <= limit.own_error) && drawn >= 3 {
        return Ok(());
    }
    let target = own / MARGIN / limit.parts.len().max(1) as f64;
    let blame =
        limit.parts.iter().filter(|p| p.1 > target).filter_map(|(knob, _)| {
            let settled = &curves.iter().find(|c| c.knob == *knob)?.settled;
            let factor = finer_by(settled, target);
            Some(factor.map_or_else(
                || format!("{knob}: not converging yet"),
                |f| format!("{knob}: an end {f:.1} times finer"),
            ))
        });
    let held = limit.held.iter().map(|h| format!("{}: {}", h.knob, h.reason));
    let blame: Vec<String> = blame.chain(held).collect();
    let hint = format!("{}; --finer N doubles every end N times", blame.join("; "));
    let message = format!(
        "the limit's own error is {:.1e}, the scene's own setting is {own:.1e} from it, and {drawn} of {} settings are at \
         least ten times as far: expected three, and the scene's own among them unless it is the limit",
        limit.own_error,
        outcomes.len(),
    );
    Err(unresolved(message, hint))
}

fn unresolved(message: impl Into<String>, hint: impl Into<String>) -> Error {
    Error::Unresolved { message: message.into(), hint: hint.into() }
}

/// What may be on a frontier; ids are places in `outcomes`.
pub(super) fn candidates<'a>(outcomes: impl Iterator<Item = &'a Outcome>) -> Vec<Candidate> {
    let candidate = |(id, o): (usize, &Outcome)| {
        let error = o.from_limit.as_ref().filter(|_| o.drawn)?.linear.rmse;
        Some(Candidate { id, error, seconds: least_seconds(o)? })
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
    hold(&mut candidates(outcomes.iter()), options.hold(), |id| {
        progress.tick(0).map_err(|_| Error::Cancelled)?;
        let frame = draw(&outcomes[id].setting.request)?;
        outcomes[id].timed.seconds.push(frame.seconds);
        Ok(frame.seconds)
    })
}

fn root_mean_square(image: &Image<Linear>) -> f64 {
    let n = (3 * image.pixels().len()).max(1) as f64;
    (image.pixels().iter().flatten().map(|v| v * v).sum::<f64>() / n).sqrt()
}
