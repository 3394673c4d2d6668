//! Settings drawn again and again, with a clock.

use super::settings::Settings;
use super::study::Draw;
use super::{Request, Timed};
use organza::{Error, Progress};
use splat_core::rng;

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
        let setting = job % n;
        let repeat = job / n;
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
pub(super) fn attempt(
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

/// Whether a setting took more than it may, which is noted and no failure.
pub(super) fn is_resource_limit(error: &Error) -> bool {
    matches!(error, Error::Limit(_) | Error::TooLarge { .. })
}
