//! What is said of a knob's curve, in words.

use super::{Curve, CurvePoint, Step, Study, least_seconds};
use std::fmt::Write;

/// The steps of a knob that has no order, each with its RMSE and time.
fn choices(study: &Study, curve: &Curve) -> String {
    // A setting that two knobs share is called as the first calls it: the steps' own labels are meant.
    let steps = study.knobs.iter().filter(|k| k.name == curve.knob).flat_map(|k| &k.steps);
    let one = |(p, Step { label, .. }): (&CurvePoint, &Step)| {
        let outcome = &study.outcomes[p.setting];
        let rmse = outcome.from_limit.as_ref().filter(|_| outcome.drawn).map(|d| format!("{:.2e}", d.linear.rmse));
        let ms = least_seconds(outcome).map_or_else(String::new, |s| format!(" in {:.0} ms", 1e3 * s));
        format!("{label} RMSE {}{ms}", rmse.as_deref().unwrap_or("not resolved"))
    };
    format!("A choice: {}.", curve.points.iter().zip(steps).map(one).collect::<Vec<_>>().join("; "))
}

/// What was found of a knob's order of convergence, what theory says, and what its end is worth.
pub fn verdict(study: &Study, curve: &Curve) -> String {
    if curve.points.iter().all(|p| p.size.is_none()) {
        return choices(study, curve);
    }
    let theory = study.knobs.iter().find(|k| k.name == curve.knob).and_then(|k| k.theory);
    let drawn = curve.points.iter().filter(|p| p.drawn).count();
    let mut text = match curve.settled.fit {
        Some(fit) => {
            let interval = fit.half_width.map_or_else(|| " (two points: no interval)".into(), |h| format!(" ± {h:.2}"));
            format!("Order {:.2}{interval}, from {drawn} points", fit.order)
        }
        None => format!("No order: {drawn} points can be drawn"),
    };
    if let (Some(t), Some(fit)) = (theory, curve.settled.fit) {
        let half = fit.half_width.unwrap_or(0.0);
        let inside = fit.order + half >= t.low && fit.order - half <= t.high;
        let range = if t.low == t.high { format!("{}", t.low) } else { format!("{} to {}", t.low, t.high) };
        let agrees = if inside { "as theory says" } else { "theory says otherwise" };
        let _ = write!(text, "; {agrees}: {range} ({})", t.why);
    }
    if study.is_random() {
        text += ". From the spread over seeds, which needs no reference.";
    } else {
        let _ = write!(text, ". End: {}, own error {:.1e}.", curve.end.label, curve.settled.own_error);
    }
    text
}
