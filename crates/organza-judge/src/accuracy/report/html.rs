//! The report as one page without any other file: curves, frontier, convergence, pictures to flip, table, notes.

use super::frontier::{Against, RULE, error_text, to_copy};
use super::joint::{bar_of, joint};
use super::pictures::{data_uri, difference};
use crate::accuracy::plot::{COLORS, Mark, Plot, Series, escaped};
use crate::accuracy::{Curve, Outcome, Report, SEEDS, Study, TOLD_APART, least_seconds, verdict};
use organza::Error;
use reference::statistics::median_with_spread;
use std::fmt::Write;

/// Most settings that are shown as pictures.
const MOST_PICTURES: usize = 9;

/// The page.
pub(super) fn page(report: &Report) -> Result<String, Error> {
    let mut html = format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" \
         content=\"width=device-width\"><title>What accuracy costs: {0}</title>\n<style>\n{1}</style></head>\n<body><main>\n\
         <h1>What accuracy costs: {0}</h1>\n",
        escaped(&report.scene_name()),
        include_str!("report.css")
    );
    html += &head(report);
    joint(&mut html, report);
    for (at, study) in report.studies.iter().enumerate() {
        summary(&mut html, study);
        time_plot(&mut html, study);
        let frontier = study.frontier.iter().map(|place| (study, *place));
        to_copy(&mut html, &report.scene, frontier, Against::Limit);
        knob_plots(&mut html, study);
        pictures(&mut html, study, report.scene.render.exposure, at)?;
        table(&mut html, study);
        notes(&mut html, study);
    }
    let _ = write!(html, "</main>\n<script>\n{}</script>\n</body></html>\n", include_str!("report.js"));
    Ok(html)
}

fn head(report: &Report) -> String {
    let machine = &report.machine;
    let [width, height] = report.scene.camera.size;
    let quick = if report.options.quick { ", quick: a small picture, few steps and repeats" } else { "" };
    format!(
        "<p class=\"soft\">{width} x {height} pixels, {} repeats{quick}. Organza {}, {} threads on {} ({}).<br>Scene \
         SHA-256 <code>{}</code></p>\n",
        report.options.repeats(),
        env!("CARGO_PKG_VERSION"),
        machine.threads,
        escaped(machine.cpu.as_deref().unwrap_or("an unnamed processor")),
        machine.system,
        report.scene.sha256
    )
}

fn rmse(o: &Outcome) -> Option<f64> {
    o.from_limit.as_ref().map(|d| d.linear.rmse)
}

fn summary(html: &mut String, study: &Study) {
    let scene_outcome = &study.outcomes[0];
    let _ = write!(html, "<h2 class=\"technique\">Technique: {}</h2>\n<div class=\"cards\">", study.technique);
    let mut card = |value: String, what: &str| {
        let _ = write!(html, "<div class=\"card\"><b>{}</b><span>{what}</span></div>", escaped(&value));
    };
    let shown = |v: Option<f64>, text: fn(f64) -> String| v.map_or_else(|| "not measured".into(), text);
    card(
        shown(least_seconds(scene_outcome), |s| format!("{:.0} ms", 1e3 * s)),
        &format!("{}, without loading", scene_outcome.setting.label),
    );
    card(shown(rmse(scene_outcome), |e| format!("{e:.2e}")), "its RMSE against the limit, linear radiance");
    card(shown(scene_outcome.from_limit.as_ref().map(|d| d.flip), |f| format!("{f:.4}")), "its mean FLIP");
    if study.is_random() {
        let sampled = scene_outcome.sampled;
        card(shown(sampled.map(|s| s.from_limit.half_width), |h| format!("± {h:.1e}")), "95 % interval of the RMSE");
        card(shown(sampled.map(|s| s.noise), |n| format!("{n:.2e}")), "standard deviation of one picture");
        let bias = sampled.map(|s| s.bias.map_or_else(|| "none at 95 %".into(), |b| format!("{b:.1e}")));
        card(bias.unwrap_or_else(|| "not measured".into()), "RMS distance of the expectation from the limit");
    } else {
        card(
            shown(scene_outcome.from_limit.as_ref().map(|d| d.psnr), |p| format!("{p:.1} dB")),
            "its PSNR as displayed",
        );
        card(format!("{:.1e}", study.limit.own_error), "the limit's own error; nothing below ten times that is drawn");
    }
    *html += "</div>\n";
}

/// A colour for each knob, the first for what turns several.
fn color(study: &Study, knob: Option<&str>) -> &'static str {
    let at = knob.and_then(|name| study.knobs.iter().position(|k| k.name == name));
    at.map_or("#888c94", |k| COLORS[k % COLORS.len()])
}

fn time_plot(html: &mut String, study: &Study) {
    let place = |i: usize| {
        let o = &study.outcomes[i];
        let s = least_seconds(o)?;
        let e = rmse(o).filter(|_| o.drawn)?;
        Some(([1e3 * s, e], format!("{}: {:.1} ms, RMSE {e:.2e}", o.setting.label, 1e3 * s)))
    };
    let frontier = study.frontier.iter().rev().filter_map(|i| place(*i)).collect();
    let mut series = vec![Series { color: "var(--accent)".into(), mark: Mark::Steps, points: frontier }];
    for (i, outcome) in study.outcomes.iter().enumerate() {
        let color = if i == 0 { "var(--ink)".to_owned() } else { color(study, outcome.setting.knob).to_owned() };
        series.extend(bar_of(outcome, &color));
        series.push(Series { color, mark: Mark::Dots, points: place(i).into_iter().collect() });
    }
    let floor = (10.0 * study.limit.own_error, "ten times the limit's own error".to_owned());
    let plot = Plot {
        size: [1000.0, 460.0],
        x_label: "least time of a frame, loading left out, ms".into(),
        y_label: "RMSE against the limit, linear radiance".into(),
        floor: (!study.is_random()).then_some(floor),
        series,
    };
    let _ = write!(html, "<h2>Error and time</h2>\n<p>Each dot is one setting. {RULE}</p>\n<figure>");
    *html += &plot.svg();
    *html += "<div class=\"legend\">";
    let mut key = |color: &str, name: &str| {
        let _ = write!(html, "<span><i style=\"background:{color}\"></i>{name}</span>");
    };
    key("var(--ink)", &escaped(&study.outcomes[0].setting.label));
    if study.outcomes.iter().skip(1).any(|o| o.setting.knob.is_none()) {
        key(color(study, None), "all knobs together");
    }
    study.knobs.iter().for_each(|k| key(color(study, Some(k.name)), k.name));
    *html += "</div></figure>\n";
}

fn knob_plots(html: &mut String, study: &Study) {
    let error = if study.is_random() {
        "the error is the standard deviation of one picture over seeds, which needs no reference"
    } else {
        "the error is against the picture with this knob alone at its end"
    };
    let _ = write!(
        html,
        "<h2>Convergence of each knob</h2>\n<p>One knob is turned, the others stay as in the scene; {error}. The dashed line is \
         the fitted order, where its interval is narrower than itself.</p>\n<div class=\"grid\">\n"
    );
    for curve in study.curves.iter().filter(|c| c.points.iter().any(|p| p.size.is_some())) {
        let knob = study.knobs.iter().find(|k| k.name == curve.knob);
        let _ = write!(html, "<figure><h3>{}</h3>", curve.knob);
        let meaning = knob.map_or("", |k| k.size_meaning);
        match knob_plot(study, curve, meaning) {
            Some(plot) => *html += &plot.svg(),
            None => *html += "<p>No step is ten times farther from the end than the end's own error.</p>",
        }
        let _ = writeln!(html, "<p>{}</p></figure>", escaped(&verdict(study, curve)));
    }
    *html += "</div>\n";
}

fn knob_plot(study: &Study, curve: &Curve, meaning: &str) -> Option<Plot> {
    let y_label = if study.is_random() { "standard deviation" } else { "RMSE" };
    let drawn = curve.points.iter().filter(|p| p.drawn);
    let points: Vec<([f64; 2], String)> = drawn
        .filter_map(|p| {
            let x = p.size?;
            let y = p.error?;
            Some(([x, y], format!("{}: {y_label} {y:.2e}", study.outcomes[p.setting].setting.label)))
        })
        .collect();
    let first = points.first()?.0[0];
    let last = points.last()?.0[0];
    let mut series = Vec::new();
    if let Some(fit) = curve.settled.order() {
        let end_error = if curve.end_size.is_some() { curve.settled.own_error } else { 0.0 };
        let at = |k: usize| first * (last / first).powf(k as f64 / 24.0);
        let line =
            (0..=24).map(at).map(|x| ([x, (fit.log_factor + fit.order * x.ln()).exp() - end_error], String::new()));
        series.push(Series { color: "var(--soft)".into(), mark: Mark::Dashed, points: line.collect() });
    }
    series.push(Series { color: color(study, Some(curve.knob)).into(), mark: Mark::Dots, points });
    Some(Plot { size: [320.0, 230.0], x_label: meaning.into(), y_label: y_label.into(), floor: None, series })
}

/// The settings worth a look: the scene's own, all knobs together, and the coarsest step of each knob.
fn shown_settings(study: &Study) -> Vec<usize> {
    let mut shown = vec![0];
    let together = |i: &usize| *i > 0 && study.outcomes[*i].setting.knob.is_none();
    shown.extend((0..study.outcomes.len()).find(together));
    shown.extend(study.curves.iter().filter_map(|c| c.points.iter().find(|p| p.drawn).map(|p| p.setting)));
    shown.retain(|i| study.outcomes[*i].timed.image().is_some());
    let mut seen = Vec::new();
    shown.retain(|i| {
        !seen.contains(i) && {
            seen.push(*i);
            true
        }
    });
    shown.truncate(MOST_PICTURES);
    shown
}

fn pictures(html: &mut String, study: &Study, exposure: f64, at: usize) -> Result<(), Error> {
    *html += "<h2>Pictures</h2>\n<p>Click a picture to flip between the setting, the limit and their difference.</p>\n";
    let limit = study.limit.image.display(exposure);
    let _ = writeln!(html, "<img hidden id=\"limit{at}\" alt=\"\" src=\"{}\"><div class=\"grid\">", data_uri(&limit)?);
    for i in shown_settings(study) {
        let o = &study.outcomes[i];
        let Some(image) = o.timed.image() else { continue };
        let shown = image.display(exposure);
        let (apart, gain) = difference(&shown, &limit)?;
        let label = escaped(&o.setting.label);
        let a = data_uri(&shown)?;
        let d = data_uri(&apart)?;
        let flip = o.from_limit.as_ref().map_or_else(String::new, |d| format!(" FLIP {:.4}", d.flip));
        let _ = writeln!(
            html,
            "<figure class=\"flip\"><img src=\"{a}\" alt=\"{label}\"><h3>{label}</h3>\
             <button aria-pressed=\"true\">setting</button><button data-of=\"limit{at}\" \
             aria-pressed=\"false\">limit</button><button data-of=\"d{at}-{i}\" aria-pressed=\"false\">difference x {gain}\
             </button><span class=\"soft\">{flip}</span><img hidden \
             id=\"d{at}-{i}\" alt=\"\" src=\"{d}\"></figure>"
        );
    }
    *html += "</div>\n";
    Ok(())
}

fn table(html: &mut String, study: &Study) {
    *html += "<h2>All settings</h2>\n<div class=\"wide\"><table><tr><th>setting (frontier in colour)</th><th>least ms</th><th>median to \
              max</th><th>RMSE</th><th>bias</th><th>max</th><th>PSNR dB</th><th>FLIP</th><th>ε 8 bit</th><th>truth RMSE\
              </th><th>convert ms</th><th>fragments</th></tr>\n";
    for (i, o) in study.outcomes.iter().enumerate() {
        let class = if study.frontier.contains(&i) { " class=\"front\"" } else { "" };
        let time = median_with_spread(&o.timed.seconds);
        let convert = median_with_spread(&o.timed.convert_seconds);
        // An error that the limit cannot show is not shown.
        let d = o.from_limit.as_ref().filter(|_| o.drawn);
        let cell = |v: Option<String>| v.unwrap_or_else(|| "–".into());
        let half = |h: f64| if h > 0.0 { format!(" ± {h:.0e}") } else { String::new() };
        let limit_half = half(o.sampled.map_or(0.0, |s| s.from_limit.half_width));
        let truth_half = half(o.sampled.and_then(|s| s.from_truth).map_or(0.0, |m| m.half_width));
        let cells = [
            escaped(&o.setting.label),
            cell(time.map(|t| format!("{:.1}", 1e3 * t.min))),
            cell(time.map(|t| format!("{:.1} to {:.1}", 1e3 * t.median, 1e3 * t.max))),
            cell(error_text(study, o).map(|text| text + &limit_half)),
            cell(d.map(|d| format!("{:+.1e}", d.linear.bias))),
            cell(d.map(|d| format!("{:.2e}", d.linear.max))),
            cell(d.map(|d| format!("{:.1}", d.psnr))),
            cell(d.map(|d| format!("{:.4}", d.flip))),
            cell(d.map(|d| format!("{:.3}", d.epsilon))),
            cell(o.from_truth.as_ref().map(|d| format!("{:.2e}{truth_half}", d.linear.rmse))),
            cell(convert.map(|t| format!("{:.0}", 1e3 * t.median))),
            cell(o.timed.fragments.map(|n| n.to_string())),
        ];
        let _ = writeln!(html, "<tr{class}><td>{}</td></tr>", cells.join("</td><td>"));
    }
    *html += "</table></div>\n";
}

fn notes(html: &mut String, study: &Study) {
    *html += "<h2>Notes</h2>\n<ul>\n";
    let mut note = |text: String| {
        let _ = writeln!(html, "<li>{}</li>", escaped(&text));
    };
    let hidden = study.outcomes.iter().filter(|o| !o.drawn).count();
    if study.is_random() {
        note(format!(
            "Errors are means over {SEEDS} seeds. The limit is that of points, whose own error {:.1e} is part of every interval; \
             what differs from it at any repeat level is bias: the settings that both techniques share, and particles that are \
             sampled at pixels where points are averaged over them.",
            study.limit.own_error
        ));
    } else {
        note(format!(
            "The limit is the picture with all knobs at their ends ({:.0} ms). Its own error is the sum of those of its ends: {}. \
         {hidden} of {} settings are nearer to it than ten times that, or cannot be compared with it, and show no error.",
            1e3 * study.limit.seconds,
            study.limit.parts.iter().map(|(k, e)| format!("{k} {e:.1e}")).collect::<Vec<_>>().join(", "),
            study.outcomes.len()
        ));
    }
    let ratio = 100.0 * (TOLD_APART - 1.0);
    note(format!(
        "A time is the least of the repeats. Times that differ by less than {ratio:.0} % count as equal on the frontier; \
         settings that may be on it were repeated until it held."
    ));
    let held = study.limit.held.iter().filter(|_| !study.is_random());
    held.for_each(|h| note(format!("The limit leaves {} as in the scene: {}.", h.knob, h.reason)));
    study.skipped.iter().for_each(|s| note(format!("Not turned: {}: {}.", s.knob, s.reason)));
    for o in study.outcomes.iter().filter(|o| o.timed.failure.is_some()) {
        note(format!("Not drawn: {}: {}.", o.setting.label, o.timed.failure.as_deref().unwrap_or_default()));
    }
    match &study.truth {
        Ok(t) => {
            note(format!(
                "Truth: {}. Its RMS standard error is {:.1e}; no RMSE against it is smaller.",
                t.method,
                t.rms_standard_error()
            ));
            if let Some(all) = t.all_orders {
                note(format!(
                    "Light that is scattered or reflected more often is no part of that truth: from the truth of all orders it is {:.1e} away \
                     (RMSE; that truth's own standard error is {:.1e}), with a mean radiance of {:.4} for {:.4}.",
                    all.rmse, all.rms_standard_error, all.mean[0], all.mean[1]
                ));
            }
        }
        Err(reason) => note(format!("No physical truth: {reason}.")),
    }
    *html += "</ul>\n";
}
