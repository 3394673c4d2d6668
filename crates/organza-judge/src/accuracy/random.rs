//! The study of an unbiased random technique: every setting is drawn with several seeds, and means are given with intervals.
//!
//! The limit is another technique's: an expectation has no end that could be drawn. The spread over seeds gives the fall of
//! the error with the repeats. It needs no reference, so no error is too small to be shown.

use super::repeat::{Repeats, repeat_all};
use super::settings::Settings;
use super::study::hold_frontier;
use super::{
    Curve, CurvePoint, Distance, Draw, Limit, Options, Outcome, Sampled, Setting, Settled, Step, Study, Sweep, Timed,
    Truth,
};
use organza::{Error, Progress};
use reference::metrics::{Image, Linear};
use reference::statistics::fit_order;

/// Number of seeds of every setting. The picture of each seed is a timed repeat too.
pub const SEEDS: usize = 5;

/// The references of pictures whose expectation is known.
#[derive(Debug)]
pub struct Yardsticks<'a> {
    /// The limit of a technique whose expectation is the same.
    pub limit: &'a Limit,
    /// The path-traced scene, or the reason why it has no truth.
    pub truth: Result<Truth, String>,
}

/// Draws and judges.
///
/// # Errors
/// Those of `draw`, but a setting that exceeds a limit of resources is noted and left out.
pub fn random_study(
    sweep: &Sweep,
    yardsticks: Yardsticks<'_>,
    options: &Options,
    progress: &Progress,
    draw: &mut Draw<'_>,
) -> Result<Study, Error> {
    let Yardsticks { limit, truth } = yardsticks;
    let settings = Settings::new(sweep);
    let mut timed = vec![Timed::default(); settings.list.len()];
    repeat_all(&settings, &mut timed, &Repeats { times: SEEDS, seeded: true, order: options.seed }, progress, draw)?;
    let exposure = sweep.base.scene.render.exposure;
    let of_truth = truth.as_ref().ok().map(|t| &t.image);
    let mut outcomes = Vec::new();
    for (setting, timed) in settings.list.into_iter().zip(timed) {
        outcomes.push(judge(setting, timed, limit, of_truth, exposure)?);
    }
    let curves = sweep.knobs.iter().zip(&settings.of_step).map(|(knob, steps)| {
        let points: Vec<CurvePoint> = knob.steps.iter().zip(steps).map(|(s, k)| point(s, *k, &outcomes[*k])).collect();
        let sized: Vec<[f64; 2]> = points.iter().filter_map(|p| Some([p.size?, p.error?])).collect();
        Curve {
            knob: knob.name,
            end: Step { label: "the expectation: spread over seeds".into(), size: None, value: f64::INFINITY },
            end_size: None,
            points,
            own_setting: outcomes[0].sampled.map_or(0.0, |s| s.noise),
            settled: Settled { own_error: 0.0, fit: fit_order(&sized), careful_order: None },
            end_seconds: None,
        }
    });
    let curves = curves.collect();
    let frontier = hold_frontier(&mut outcomes, options, progress, draw)?;
    Ok(Study {
        technique: sweep.technique,
        outcomes,
        curves,
        skipped: sweep.skipped.clone(),
        limit: limit.clone(),
        truth,
        frontier,
        knobs: sweep.knobs.clone(),
    })
}

fn point(step: &Step, setting: usize, outcome: &Outcome) -> CurvePoint {
    let error = outcome.sampled.map(|s| s.noise);
    CurvePoint { setting, size: step.size, error, drawn: error.is_some_and(|e| e > 0.0) }
}

/// One setting by the pictures of its seeds.
fn judge(
    setting: Setting,
    timed: Timed,
    limit: &Limit,
    truth: Option<&Image<Linear>>,
    exposure: f64,
) -> Result<Outcome, Error> {
    let distance = |to: &Image<Linear>| -> Result<Option<Distance>, Error> {
        let distances: Result<Vec<Distance>, Error> =
            timed.images.iter().map(|i| Distance::between(i, to, exposure)).collect();
        Ok(Distance::mean(&distances?))
    };
    let from_limit = distance(&limit.image)?;
    let from_truth = truth.map(distance).transpose()?.flatten();
    let sampled = Sampled::new(&timed.images, &limit.image, limit.own_error, truth)?;
    Ok(Outcome { setting, drawn: from_limit.is_some(), timed, from_limit, from_truth, sampled })
}
