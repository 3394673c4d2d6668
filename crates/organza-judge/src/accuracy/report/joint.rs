//! The part of the page that shows all techniques together: their settings in one plot, and one frontier.

use super::frontier::{Against, RULE, to_copy};
use crate::accuracy::plot::{COLORS, Mark, Plot, Series, escaped};
use crate::accuracy::{Outcome, Report, Study, least_seconds};
use std::fmt::Write;

/// A bar that reaches below zero ends at this share of the mean.
const LEAST: f64 = 0.02;

/// Techniques side by side; nothing for one alone.
pub(super) fn joint(html: &mut String, report: &Report) {
    for absent in &report.absent {
        let _ = writeln!(html, "<p>No technique {}: {}.</p>", absent.technique, escaped(&absent.reason));
    }
    if report.studies.len() < 2 {
        return;
    }
    let _ = write!(
        html,
        "<h2>All techniques</h2>\n<p>Each dot is one setting of a technique. {RULE} It goes over all of them that are held against \
         one limit; a technique with a limit of its own stands in the plot by physical truth. A bar is the 95 % interval of a random \
         technique's mean error over its seeds.</p>\n<figure>"
    );
    let limit = &report.studies[0].limit;
    let floor = Some((10.0 * limit.own_error, "ten times the limit's own error".to_owned()));
    *html += &plot(report, Against::Limit, "RMSE against the limit, linear radiance", floor).svg();
    legend(html, report);
    copied(html, report, &report.frontier, Against::Limit);
    if let Ok(truth) = &report.studies[0].truth {
        let level = truth.rms_standard_error();
        let floor = Some((level, "the truth's own standard error".to_owned()));
        *html += "<p>The same against physical truth. No picture can come below the truth's own standard error.</p>\n<figure>";
        *html += &plot(report, Against::Truth, "RMSE against physical truth", floor).svg();
        legend(html, report);
        copied(html, report, &report.frontier_by_truth, Against::Truth);
    }
}

fn copied(html: &mut String, report: &Report, frontier: &[[usize; 2]], against: Against) {
    to_copy(html, &report.scene, frontier.iter().map(|[study, place]| (&report.studies[*study], *place)), against);
}

fn legend(html: &mut String, report: &Report) {
    *html += "<div class=\"legend\">";
    for (k, study) in report.studies.iter().enumerate() {
        let _ =
            write!(html, "<span><i style=\"background:{}\"></i>{}</span>", COLORS[k % COLORS.len()], study.technique);
    }
    *html += "</div></figure>\n";
}

/// Mean and half width of the interval; `None` of what cannot be shown.
fn error(o: &Outcome, against: Against) -> Option<(f64, f64)> {
    match (against, &o.sampled) {
        (Against::Limit, Some(s)) => Some((s.from_limit.mean, s.from_limit.half_width)),
        (Against::Truth, Some(s)) => s.from_truth.map(|m| (m.mean, m.half_width)),
        (Against::Limit, None) => o.from_limit.as_ref().filter(|_| o.drawn).map(|d| (d.linear.rmse, 0.0)),
        (Against::Truth, None) => o.from_truth.as_ref().map(|d| (d.linear.rmse, 0.0)),
    }
}

/// The interval of a random setting as a bar in the plot of error and time.
pub(super) fn bar_of(o: &Outcome, color: &str) -> Option<Series> {
    bar(o, Against::Limit, color)
}

fn bar(o: &Outcome, against: Against, color: &str) -> Option<Series> {
    let (mean, half) = error(o, against).filter(|e| e.1 > 0.0)?;
    let seconds = least_seconds(o)?;
    let ends = [-half, half].map(|h| ([1e3 * seconds, (mean + h).max(LEAST * mean)], String::new()));
    Some(Series { color: color.into(), mark: Mark::Bars, points: ends.to_vec() })
}

fn plot(report: &Report, against: Against, y_label: &str, floor: Option<(f64, String)>) -> Plot {
    let place = |o: &Outcome| {
        let s = least_seconds(o)?;
        let (e, half) = error(o, against)?;
        let interval = if half > 0.0 { format!(" ± {half:.1e}") } else { String::new() };
        Some(([1e3 * s, e], format!("{}: {:.1} ms, RMSE {e:.2e}{interval}", o.setting.label, 1e3 * s)))
    };
    let mut series = Vec::new();
    let limit = &report.frontier;
    let truth = &report.frontier_by_truth;
    let on_it = if against == Against::Limit { limit } else { truth };
    let on_it = on_it.iter().rev().filter_map(|[s, o]| place(&report.studies[*s].outcomes[*o]));
    series.push(Series { color: "var(--accent)".into(), mark: Mark::Steps, points: on_it.collect() });
    let shown = |study: &Study| against == Against::Truth || study.shares_limit_with(&report.studies[0]);
    for (k, study) in report.studies.iter().enumerate().filter(|(_, study)| shown(study)) {
        let color = COLORS[k % COLORS.len()];
        series.extend(study.outcomes.iter().filter_map(|o| bar(o, against, color)));
        let dots = study.outcomes.iter().filter_map(place);
        let named = dots.map(|(at, text)| (at, format!("{}, {text}", study.technique)));
        series.push(Series { color: color.into(), mark: Mark::Dots, points: named.collect() });
    }
    let x_label = "least time of a frame, loading left out, ms".into();
    Plot { size: [1000.0, 420.0], x_label, y_label: y_label.into(), floor, series }
}
