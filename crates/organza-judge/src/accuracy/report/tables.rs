//! The report as JSON and as CSV. A number that was not measured is null, or an empty cell; never 0.

use super::{SHARED_COLUMNS, quoted};
use crate::accuracy::{Curve, Distance, Outcome, Report, Study, TOLD_APART, lines};
use organza::scene::Scene;
use reference::metrics::Errors;
use reference::statistics::{Mean, Spread, median_with_spread};
use serde_json::{Value, json};
use std::fmt::Write;

/// The whole report as one JSON document.
pub(super) fn json(report: &Report) -> Value {
    json!({
        "scene": report.scene_name(),
        "scene_sha256": report.scene.sha256,
        "version": env!("CARGO_PKG_VERSION"),
        "size": report.scene.camera.size,
        "quick": report.options.quick,
        "finer": report.options.finer,
        "repeats": report.options.repeats(),
        "machine": { "cpu": report.machine.cpu, "system": report.machine.system, "threads": report.machine.threads },
        "frontier": frontier(report, &report.frontier),
        "frontier_by_truth": frontier(report, &report.frontier_by_truth),
        "significant_ratio_of_times": TOLD_APART,
        "techniques": report.studies.iter().map(|s| study(&report.scene, s)).collect::<Value>(),
        "absent": report.absent.iter().map(|a| json!({ "technique": a.technique, "reason": a.reason })).collect::<Value>(),
    })
}

fn frontier(report: &Report, places: &[[usize; 2]]) -> Value {
    let place = |[s, o]: &[usize; 2]| {
        let study = &report.studies[*s];
        json!({ "technique": study.technique, "setting": study.outcomes[*o].setting.label })
    };
    places.iter().map(place).collect()
}

fn study(scene: &Scene, study: &Study) -> Value {
    let limit = &study.limit;
    json!({
        "technique": study.technique,
        "limit": {
            "own_error": finite(limit.own_error),
            "own_error_of_ends": limit.parts.iter().map(|(k, e)| json!({ "knob": k, "own_error": finite(*e) })).collect::<Value>(),
            "held": limit.held.iter().map(|h| json!({ "knob": h.knob, "reason": h.reason })).collect::<Value>(),
            "seconds": limit.seconds,
        },
        "truth": match &study.truth {
            Ok(t) => json!({
                "method": t.method,
                "rms_standard_error": t.rms_standard_error(),
                "all_orders": t.all_orders.map(|orders| json!({
                    "rmse": orders.rmse,
                    "rms_standard_error": orders.rms_standard_error,
                    "mean": orders.mean[0],
                    "mean_of_all": orders.mean[1],
                })),
            }),
            Err(reason) => json!({ "missing": reason }),
        },
        "curves": study.curves.iter().map(|c| curve(study, c)).collect::<Value>(),
        "frontier": study.frontier.iter().map(|i| study.outcomes[*i].setting.label.as_str()).collect::<Value>(),
        "skipped": study.skipped.iter().map(|s| json!({ "knob": s.knob, "reason": s.reason })).collect::<Value>(),
        "settings": study.outcomes.iter().enumerate().map(|(i, o)| setting(scene, study, i, o)).collect::<Value>(),
    })
}

fn curve(study: &Study, curve: &Curve) -> Value {
    let knob = study.knobs.iter().find(|k| k.name == curve.knob);
    let theory = knob.and_then(|k| k.theory);
    let order = curve.settled.order();
    let slope = curve.settled.fit;
    let points = curve.points.iter().map(|p| {
        json!({
            "setting": study.outcomes[p.setting].setting.label, "size": p.size, "rmse": p.error, "drawn": p.drawn,
        })
    });
    json!({
        "knob": curve.knob,
        "size": knob.map(|k| k.size_meaning),
        "end": curve.end.label,
        "end_own_error": finite(curve.settled.own_error),
        "end_seconds": curve.end_seconds,
        "order": order.map(|f| f.order),
        "order_half_width_95": order.and_then(|f| f.half_width),
        "slope": slope.map(|f| f.order),
        "slope_half_width_95": slope.and_then(|f| f.half_width),
        "order_in_theory": theory.map(|t| json!({ "low": t.low, "high": t.high, "why": t.why })),
        "points": points.collect::<Value>(),
    })
}

fn setting(scene: &Scene, study: &Study, index: usize, o: &Outcome) -> Value {
    let render = median_with_spread(&o.timed.seconds);
    json!({
        "setting": o.setting.label,
        "knob": o.setting.knob,
        "toml": lines(scene, &o.setting.request),
        "drawn": o.drawn,
        "on_frontier": study.frontier.contains(&index),
        "seconds": spread(render),
        "seconds_of_repeats": o.timed.seconds,
        "convert_seconds": spread(median_with_spread(&o.timed.convert_seconds)),
        "fragments": o.timed.fragments,
        "bytes": o.timed.bytes,
        "from_limit": o.from_limit.as_ref().map(distance),
        "from_truth": o.from_truth.as_ref().map(distance),
        "sampled": o.sampled.map(|s| json!({
            "seeds": s.seeds,
            "rmse_from_limit": mean(&s.from_limit),
            "rmse_from_truth": s.from_truth.as_ref().map(mean),
            "standard_deviation": s.noise,
            "rms_bias_from_limit": s.bias,
        })),
        "failure": o.timed.failure,
    })
}

fn mean(m: &Mean) -> Value {
    json!({ "mean": m.mean, "half_width_95": m.half_width })
}

fn spread(s: Option<Spread>) -> Value {
    s.map_or(Value::Null, |s| json!({ "median": s.median, "min": s.min, "max": s.max }))
}

fn distance(d: &Distance) -> Value {
    let errors = |e: &Errors| json!({ "rmse": e.rmse, "bias": e.bias, "mean_absolute": e.mean_absolute, "max": e.max });
    json!({
        "linear": errors(&d.linear), "display": errors(&d.display), "psnr_db": finite(d.psnr), "flip": d.flip,
        "epsilon_8_bit": d.epsilon,
    })
}

/// JSON has no infinity.
fn finite(value: f64) -> Option<f64> {
    Some(value).filter(|v| v.is_finite())
}

/// One line a setting, after what all lines share: the scene, the picture's size, what computed.
pub(super) fn csv(report: &Report) -> String {
    let mut text = format!(
        "{SHARED_COLUMNS},technique,setting,knob,drawn,on_frontier,rmse_radiance,bias_radiance,mean_absolute_radiance,max_radiance,\
         rmse_displayed,psnr_db,flip,epsilon_8_bit,truth_rmse_radiance,median_ms,min_ms,max_ms,convert_ms,fragments,bytes,\
         on_joint_frontier,rmse_half_width_95_radiance,truth_rmse_half_width_95_radiance,standard_deviation_radiance,\
         rms_bias_radiance\n",
    );
    let size = report.scene.camera.size.map(|side| side as usize);
    let shared = report.machine.shared_cells(&report.scene_name(), size);
    for (at, study) in report.studies.iter().enumerate() {
        for (i, o) in study.outcomes.iter().enumerate() {
            let d = o.from_limit.as_ref();
            let time = median_with_spread(&o.timed.seconds);
            let convert = median_with_spread(&o.timed.convert_seconds);
            let ms = |seconds: Option<f64>| cell(seconds.map(|s| 1e3 * s));
            let cells = [
                shared.clone(),
                quoted(study.technique),
                quoted(&o.setting.label),
                quoted(o.setting.knob.unwrap_or("")),
                o.drawn.to_string(),
                study.frontier.contains(&i).to_string(),
                cell(d.map(|d| d.linear.rmse)),
                cell(d.map(|d| d.linear.bias)),
                cell(d.map(|d| d.linear.mean_absolute)),
                cell(d.map(|d| d.linear.max)),
                cell(d.map(|d| d.display.rmse)),
                cell(d.map(|d| d.psnr)),
                cell(d.map(|d| d.flip)),
                cell(d.map(|d| d.epsilon)),
                cell(o.from_truth.as_ref().map(|d| d.linear.rmse)),
                ms(time.map(|t| t.median)),
                ms(time.map(|t| t.min)),
                ms(time.map(|t| t.max)),
                ms(convert.map(|t| t.median)),
                o.timed.fragments.map_or_else(String::new, |n| n.to_string()),
                o.timed.bytes.map_or_else(String::new, |n| n.to_string()),
                report.frontier.contains(&[at, i]).to_string(),
                cell(o.sampled.map(|s| s.from_limit.half_width)),
                cell(o.sampled.and_then(|s| s.from_truth).map(|m| m.half_width)),
                cell(o.sampled.map(|s| s.noise)),
                cell(o.sampled.and_then(|s| s.bias)),
            ];
            let _ = writeln!(text, "{}", cells.join(","));
        }
    }
    text
}

fn cell(value: Option<f64>) -> String {
    value.filter(|v| v.is_finite()).map_or_else(String::new, |v| format!("{v:.6e}"))
}
