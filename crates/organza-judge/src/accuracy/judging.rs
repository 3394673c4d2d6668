//! The whole report of a scene: the sweep of each technique, one after the other, with the physical truth.

use super::{Absent, Facts, Options, Renderer, Report, Request, Study, Sweep};
use crate::truth::{self, Orders, Truth};
use organza::scene::Scene;
use organza::{Error, Progress, RenderOptions};

/// Stages with their shares, about as long as they take for `scenes/mixed.toml`.
const STAGES: [(&str, f64); 6] = [
    ("first look", 1.0),
    ("physical truth", 8.0),
    ("settings of points", 10.0),
    ("settings of particles", 10.0),
    ("settings of sheets", 20.0),
    ("settings of surfels", 10.0),
];

/// Techniques that come after `points`.
const FURTHER: [&str; 3] = ["particles", "sheets", "surfels"];

/// A report, and whether it was interrupted before all techniques were judged.
#[derive(Debug)]
pub struct Judged {
    /// The report, of the techniques that were judged.
    pub report: Report,
    /// Whether an interrupt ended it; `Report::absent` names the techniques that are missing.
    pub is_interrupted: bool,
}

/// Sweeps the knobs of every technique that can draw a scene with a placed camera, and compares them.
///
/// # Errors
/// As [`organza::render`]; [`Error::Cancelled`] before `points` are judged: a report that is interrupted after that has the
/// techniques that were judged.
pub fn judge(scene: &Scene, options: Options, render: &RenderOptions, progress: &Progress) -> Result<Judged, Error> {
    let mut studies: Vec<Study> = Vec::new();
    let mut absent = Vec::new();
    let swept = sweep_techniques(scene, &options, render, progress, &mut studies, &mut absent);
    let is_interrupted = matches!(swept, Err(Error::Cancelled)) && !studies.is_empty();
    if is_interrupted {
        let reached = studies.len() + absent.len() - 1;
        absent.extend(FURTHER[reached..].iter().map(|technique| Absent { technique, reason: "interrupted".into() }));
    } else {
        swept?;
    }
    Ok(Judged { report: Report::new(scene, options, studies, absent), is_interrupted })
}

/// Adds the study of each technique, or the reason why there is none.
fn sweep_techniques(
    scene: &Scene,
    options: &Options,
    render: &RenderOptions,
    progress: &Progress,
    studies: &mut Vec<Study>,
    absent: &mut Vec<Absent>,
) -> Result<(), Error> {
    progress.plan(STAGES);
    let mut renderer = Renderer::new(render, progress);
    progress.begin(STAGES[0].0);
    let facts = renderer.facts(&super::in_points(scene))?;
    let sweep = super::points(scene, &facts, options);
    progress.begin(STAGES[1].0);
    let truth = truth(scene, render, options, progress)?;
    progress.begin(STAGES[2].0);
    studies.push(super::study(&sweep, truth, options, progress, &mut |request| renderer.draw(request))?);
    for (technique, (stage, _)) in FURTHER.into_iter().zip(&STAGES[3..]) {
        progress.begin(stage);
        progress.tick(0).map_err(|_| Error::Cancelled)?;
        let points = &studies[0];
        let study = match technique {
            "particles" => particles(scene, &facts, options, points, &mut renderer, progress)?,
            "sheets" => sheets(scene, options, points, &mut renderer, progress)?,
            _ => surfels(scene, options, points, &mut renderer, progress)?,
        };
        match study {
            Ok(study) => studies.push(study),
            Err(reason) => absent.push(reason),
        }
    }
    Ok(())
}

/// The scene's truth, and what its orders of scattering leave out; or why there is none.
fn truth(
    scene: &Scene,
    render: &RenderOptions,
    options: &Options,
    progress: &Progress,
) -> Result<Result<Truth, String>, Error> {
    let mut truth_of_scene = truth::truth(scene, render, Orders::shown_by(scene), options.truth_samples(), progress)?;
    if let Ok(scene_orders) = &mut truth_of_scene
        && let Ok(every_order) = truth::truth(scene, render, Orders::All, options.truth_samples(), progress)?
    {
        scene_orders.all_orders = Some(scene_orders.beside(&every_order)?);
    }
    Ok(truth_of_scene)
}

/// The study of `particles`, by the limit and the truth of `points`; or why there is none.
fn particles(
    scene: &Scene,
    facts: &Facts,
    options: &Options,
    points: &Study,
    renderer: &mut Renderer<'_>,
    progress: &Progress,
) -> Result<Result<Study, Absent>, Error> {
    let absent = |reason| Ok(Err(Absent { technique: "particles", reason }));
    let sweep = match super::particles(scene, facts, options) {
        Ok(sweep) => sweep,
        Err(reason) => return absent(reason),
    };
    if let Some(reason) = renderer.refused(&sweep.base.scene)? {
        return absent(reason);
    }
    let mut draw = |request: &Request| renderer.draw(request);
    super::random_study(
        &sweep,
        super::Yardsticks { limit: &points.limit, truth: points.truth.clone() },
        options,
        progress,
        &mut draw,
    )
    .map(Ok)
}

/// The study of `sheets`, by a limit of its own and the truth of `points`; or why there is none.
fn sheets(
    scene: &Scene,
    options: &Options,
    points: &Study,
    renderer: &mut Renderer<'_>,
    progress: &Progress,
) -> Result<Result<Study, Absent>, Error> {
    let absent = |reason| Ok(Err(Absent { technique: "sheets", reason }));
    let drawn = super::in_sheets(scene);
    if let Some(reason) = renderer.refused(&drawn)? {
        return absent(reason);
    }
    if !renderer.runs(&drawn, organza::pass::SHEETS)? {
        return absent("nothing is translucent, so the picture is that of `points`".into());
    }
    let slab_width = match renderer.slab_width(&drawn) {
        Err(limit @ Error::Limit(_)) => return absent(limit.to_string()),
        found => found?,
    };
    let facts = renderer.facts(&drawn)?;
    by_own_limit(&super::sheets(scene, slab_width, &facts, options), options, points, renderer, progress)
}

/// The study of `surfels`, by a limit of its own and the truth of `points`; or why there is none.
fn surfels(
    scene: &Scene,
    options: &Options,
    points: &Study,
    renderer: &mut Renderer<'_>,
    progress: &Progress,
) -> Result<Result<Study, Absent>, Error> {
    let absent = |reason| Ok(Err(Absent { technique: "surfels", reason }));
    let drawn = super::in_surfels(scene);
    if let Some(reason) = renderer.refused(&drawn)? {
        return absent(reason);
    }
    if !renderer.runs(&drawn, organza::pass::SURFELS)? {
        return absent("no surface is translucent: the picture is that of `points`".into());
    }
    let facts = renderer.facts(&drawn)?;
    by_own_limit(&super::surfels(scene, &facts, options), options, points, renderer, progress)
}

/// A study whose limit is the technique's own, and whose truth is that of `points`.
fn by_own_limit(
    sweep: &Sweep,
    options: &Options,
    points: &Study,
    renderer: &mut Renderer<'_>,
    progress: &Progress,
) -> Result<Result<Study, Absent>, Error> {
    match super::study(sweep, points.truth.clone(), options, progress, &mut |request| renderer.draw(request)) {
        Ok(study) => Ok(Ok(study)),
        Err(Error::Unresolved { message, .. }) => Ok(Err(Absent { technique: sweep.technique, reason: message })),
        Err(other) => Err(other),
    }
}
