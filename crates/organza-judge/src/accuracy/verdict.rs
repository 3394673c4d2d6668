//! The verdict on a knob's curve, in words.

use super::{Curve, CurvePoint, Step, Study, least_seconds};
use reference::statistics::Fit;
use std::fmt::Write;

/// The steps of a knob that has no order, each with its RMSE and time.
fn choices(study: &Study, curve: &Curve) -> String {
    // A setting that two knobs share is called as the first calls it: the steps' own labels are meant.
    let steps = study.knobs.iter().filter(|k| k.name == curve.knob).flat_map(|k| &k.steps);
    let step_result = |(p, Step { label, .. }): (&CurvePoint, &Step)| {
        let outcome = &study.outcomes[p.setting];
        let rmse = outcome.from_limit.as_ref().filter(|_| outcome.drawn).map(|d| format!("{:.2e}", d.linear.rmse));
        let ms = least_seconds(outcome).map_or_else(String::new, |s| format!(" in {:.0} ms", 1e3 * s));
        format!("{label} RMSE {}{ms}", rmse.as_deref().unwrap_or("not resolved"))
    };
    format!("A choice: {}.", curve.points.iter().zip(steps).map(step_result).collect::<Vec<_>>().join("; "))
}

/// Compares a knob's measured order of convergence with theory, and states the error of its end.
pub fn verdict(study: &Study, curve: &Curve) -> String {
    if curve.points.iter().all(|p| p.size.is_none()) {
        return choices(study, curve);
    }
    let theory = study.knobs.iter().find(|k| k.name == curve.knob).and_then(|k| k.theory);
    let drawn = curve.points.iter().filter(|p| p.drawn).count();
    let order = curve.settled.order();
    let mut text = match (order, curve.settled.fit) {
        (Some(fit), _) => {
            format!("Order {:.2} ± {:.2}, from {drawn} points", fit.order, fit.half_width.unwrap_or_default())
        }
        (None, Some(Fit { order: slope, half_width: Some(half_width), .. })) => {
            format!("No order: slope {slope:.2} ± {half_width:.2}, from {drawn} points")
        }
        (None, Some(fit)) => format!("No order: slope {:.2} of two points, which have no interval", fit.order),
        (None, None) => format!("No order: {drawn} points can be drawn"),
    };
    if let (Some(t), Some(fit)) = (theory, curve.settled.fit) {
        let half = fit.half_width.unwrap_or(f64::INFINITY);
        let inside = fit.order + half >= t.low && fit.order - half <= t.high;
        let agrees = match (inside, order) {
            (true, Some(_)) => "as theory says",
            // An interval that holds nearly everything supports nothing.
            (true, None) => "too uncertain to compare with theory",
            (false, _) => "theory says otherwise",
        };
        let range = if t.low == t.high { format!("{}", t.low) } else { format!("{} to {}", t.low, t.high) };
        let _ = write!(text, "; {agrees}: {range} ({})", t.why);
    }
    if study.is_random() {
        text += ". From the spread over seeds, which needs no reference.";
    } else {
        let _ = write!(text, ". End: {}, own error {:.1e}.", curve.end.label, curve.settled.own_error);
    }
    text
}
