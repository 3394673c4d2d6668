//! The limit of a technique: every knob at its end, and how the steps of each converge to that.

use super::repeat::is_resource_limit;
use super::resolve::MARGIN;
use super::settings::Settings;
use super::study::Draw;
use super::{Curve, CurvePoint, Knob, Settled, Skipped, Step, Sweep, Timed, settle};
use organza::{Error, Progress};
use reference::metrics::{Image, Linear, compare};

/// Where the progress says that all knobs are at their ends together.
pub(super) const TOGETHER: &str = "all knobs";

/// An end that has to be finer than this many times is out of reach.
pub(super) const MOST_FINER: f64 = 64.0;

/// The picture with all knobs at their ends.
#[derive(Debug, Clone, PartialEq)]
pub struct Limit {
    /// The picture.
    pub image: Image<Linear>,
    /// Sum of the estimated errors of the ends that it takes, RMSE of linear radiance.
    pub own_error: f64,
    /// Own error of each end that it takes.
    pub parts: Vec<(&'static str, f64)>,
    /// Knobs that it leaves as the scene has them, and why.
    pub held: Vec<Skipped>,
    /// Seconds that drawing it took, once.
    pub seconds: f64,
}

/// The convergence of every knob that has an end which can be drawn, and of all together.
pub(super) fn converge(
    sweep: &Sweep,
    settings: &Settings,
    timed: &[Timed],
    floor: f64,
    progress: &Progress,
    draw: &mut Draw<'_>,
) -> Result<(Vec<Curve>, Limit), Error> {
    let mut curves = Vec::new();
    let mut refused = Vec::new();
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
    let errors = timed[0].image().map(|i| compare(i, &reference)).transpose();
    let own_setting = errors.map_err(|e| Error::Internal(e.to_string()))?.map_or(0.0, |e| e.rmse);
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
    let mut own_error = 0.0;
    let mut square = 0.0;
    let mut parts = Vec::new();
    for curve in best_first {
        let joined_error = own_error + curve.settled.own_error;
        let apart = square + curve.own_setting * curve.own_setting;
        if curve.end_size.is_none() || MARGIN * joined_error <= apart.sqrt() {
            (own_error, square) = (joined_error, apart);
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
        Some(factor) if factor <= MOST_FINER => format!("it would take an end {factor:.1} times finer"),
        Some(_) => format!("no end that is {MOST_FINER} times finer would do"),
        None => "it does not converge fast enough to say what it would take".into(),
    };
    format!(
        "its end ({}) has an own error of {:.1e}, where at most {target:.1e} could be shown; {needs}",
        curve.end.label, curve.settled.own_error
    )
}

/// How many times finer an end must be for an own error of `target`; `None` where the order is too low to say.
pub(super) fn finer_by(settled: &Settled, target: f64) -> Option<f64> {
    let order = settled.careful_order.filter(|p| *p >= 0.25 && target > 0.0)?;
    Some((settled.own_error / target).powf(order.recip()).max(1.0))
}
