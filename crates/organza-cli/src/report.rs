//! Plans and costs as tables.

use organza::cost::{Prediction, duration_text};
use organza::plan::{Effect, Plan};
use organza::scene::FoundCamera;
use organza::{CostRecord, SplatCount};
use organza_judge::effects::Measured;
use splat_core::glam::DVec3;
use std::fmt::Write;

/// The camera that was placed by itself, as a scene would say it.
pub(super) fn camera_text(found: &FoundCamera) -> String {
    let unit = 1e-4 * found.camera.position.distance(found.target);
    let list = |v: DVec3| v.to_array().map(|x| organza_survey::rounded(x, unit)).join(", ");
    format!("camera = auto: position = [{}], target = [{}]\n", list(found.camera.position), list(found.target))
}

/// Threads that draw, as all stages share them.
fn threads() -> usize {
    rayon::current_num_threads()
}

/// Counted work of each pass with its predicted time, as a table, and the total in one line.
pub(super) fn predicted_text(predicted: &Prediction) -> String {
    let threads = threads();
    let ms = |seconds: f64| format!("{:.1}", 1e3 * seconds);
    let passes = predicted.joined();
    let rows = passes.iter().filter(|pass| pass.seconds(&predicted.rates, 1) > 0.0).map(|pass| {
        let [one, many] = [1, threads].map(|threads| ms(pass.seconds(&predicted.rates, threads)));
        [pass.pass.to_owned(), one, many, pass.work(&predicted.rates)]
    });
    let by_threads = if threads == 1 { "ms".to_owned() } else { format!("ms, {threads} threads") };
    let mut text = table(["pass, predicted", "ms of one core", &by_threads, "most of it"], "lrrl", rows);
    text += &format!(
        "a picture takes about {} on {threads} thread{}, by {}\n",
        duration_text(predicted.seconds(threads)),
        if threads == 1 { "" } else { "s" },
        predicted.rates.source(),
    );
    text
}

/// Splats by object as a table.
pub(super) fn splats_text(splats: &[SplatCount]) -> String {
    let rows = splats.iter().map(|s| {
        let predicted = if s.exact { s.predicted.to_string() } else { format!("about {}", estimate(s.predicted)) };
        [organza::escape_controls(&s.object).into_owned(), predicted, s.made.to_string()]
    });
    table(["object", "splats predicted", "splats"], "lrr", rows)
}

/// An estimated count to two digits: further ones would not be true.
fn estimate(count: u64) -> u64 {
    let unit = 10u64.pow(count.checked_ilog10().unwrap_or(0).saturating_sub(1));
    count.saturating_add(unit / 2) / unit * unit
}

/// What techniques err by as a table; nothing where nothing is known to be wrong.
fn estimates_text(plan: &Plan) -> String {
    if plan.estimates.is_empty() {
        return String::new();
    }
    let rows = plan.estimates.iter().map(|estimate| {
        let by = if plan.is_drawn_as(estimate) { "yes" } else { "no" };
        let error = estimate.displayed_error;
        let share = if error.is_finite() { share_text(error) } else { "not known".to_owned() };
        let technique = estimate.technique.name().to_owned();
        [technique, by.to_owned(), share, estimate.of_object.clone(), estimate.words.clone()]
    });
    let text = table(["technique", "draws it", "errs by about", "of", "why"], "llrll", rows);
    text + "errs by about: an estimate of the change of a pixel as it is displayed, of black to white; it is no bound\n\n"
}

/// A table of the techniques that `auto` compared; empty where one alone came into question.
fn compared_text(plan: &Plan) -> String {
    const MOST_ROWS: usize = 24;
    if plan.compared.is_empty() {
        return String::new();
    }
    let rows = plan.compared.iter().take(MOST_ROWS).map(|one| {
        let error = one.displayed_error;
        let share = if error.is_finite() { share_text(error) } else { "not known".to_owned() };
        let object = one.object.clone().unwrap_or_else(|| "all".to_owned());
        let is_taken = if one.is_taken { "yes" } else { "no" };
        [object, one.drawn_by.clone(), is_taken.to_owned(), share, duration_text(one.seconds), one.reason.clone()]
    });
    let mut text = table(["compared for", "drawn by", "taken", "errs by about", "takes", "why"], "lllrrl", rows);
    if plan.compared.len() > MOST_ROWS {
        let _ = writeln!(text, "and {} more; `--json` has all of them", plan.compared.len() - MOST_ROWS);
    }
    text + "takes: of one core, counted before anything is converted; objects share passes, so their sum may be more than a picture takes\n\n"
}

/// The plan as a table.
pub(super) fn plan_text(plan: &Plan, predicted: &Prediction) -> String {
    let threads = rayon::current_num_threads();
    let present = plan.effects.iter().filter(|e| !e.is_absent);
    let effects = present.map(|e| {
        let called = match (e.called_for, e.is_lacking) {
            (true, true) => "lacking",
            (true, false) => "yes",
            (false, _) => "no",
        };
        let work = predicted.effects.iter().find(|work| work.effect == e.name);
        let time = work.map(|work| duration_text(work.seconds(&predicted.rates, threads)));
        let bytes = work.filter(|work| work.bytes > 0).map(|work| bytes_text(work.bytes));
        let or_none = |text: Option<String>| text.unwrap_or_else(|| "-".to_owned());
        [e.name.clone(), called.to_owned(), bound_text(e), or_none(time), or_none(bytes), e.reason.clone()]
    });
    let mut text = format!("technique: {}\n\n", plan.technique);
    text += &table(["effect", "called for", "without it", "takes", "bytes", "why"], "lrrrrl", effects);
    let absent: Vec<&str> = plan.effects.iter().filter(|e| e.is_absent).map(|e| e.name.as_str()).collect();
    if !absent.is_empty() {
        let _ = writeln!(text, "not in this scene: {}", absent.join(", "));
    }
    text += "without it: how much a pixel as it is displayed could change at most, of black to white; - where no bound is known\n\
             takes, bytes: predicted for what runs for it alone; - where that is part of passes that run in any case\n";
    text.push('\n');
    text += &estimates_text(plan);
    text += &compared_text(plan);
    let settings = plan.settings.iter().map(|setting| {
        let by = if setting.is_stated { "scene" } else { "plan" };
        [setting.key.clone(), setting.value.clone(), by.to_owned(), setting.reason.clone()]
    });
    text += &table(["setting", "value", "by", "why"], "llll", settings);
    text.push('\n');
    let passes = plan.passes.iter().map(|p| [p.name.clone(), p.reason.clone()]);
    text += &table(["pass", "what for"], "ll", passes);
    if !plan.chosen().is_empty() {
        let objects = plan.chosen().iter().map(|o| {
            let splats = o.splats.map_or("no".to_owned(), |why| format!("yes: {why}"));
            [o.object.clone(), o.technique.name().to_owned(), o.form.name().to_owned(), o.reason.to_owned(), splats]
        });
        text.push('\n');
        text += &table(["object", "technique", "from", "why", "becomes splats"], "lllll", objects);
    }
    text
}

/// The same as a table, beside the bounds of the plan.
pub(super) fn measured_text(measured: &Measured, plan: &Plan, tolerance: f64) -> String {
    if measured.changes.is_empty() {
        return "no effect of this scene can be switched\n".to_owned();
    }
    let ms = |seconds: f64| format!("{:.1}", 1e3 * seconds);
    let rows = measured.changes.iter().map(|change| {
        let effect = plan.effects.iter().find(|effect| effect.name == change.name);
        [
            change.name.clone(),
            share_text(change.largest),
            effect.map_or_else(String::new, bound_text),
            share_text(change.beyond_tolerance),
            ms(change.seconds_with),
            ms(change.seconds_without),
        ]
    });
    let head = ["effect, measured", "changes", "at most", "pixels", "ms with it", "ms without it"];
    let mut text = table(head, "lrrrrr", rows);
    text += &format!(
        "changes: the most of any displayed pixel, of black to white; at most: its bound; pixels: those that change by more than {}; ms of drawing\n",
        share_text(tolerance)
    );
    if let Some(change) = measured.left_out_together {
        text += &format!("all that is left out, simulated together, changes {}\n", share_text(change));
    }
    if let Some(splats) = measured.lit.filter(|splats| splats.lit < splats.in_view) {
        text +=
            &format!("{} of {} splats in view got light: the others are seen nowhere\n", splats.lit, splats.in_view);
    }
    text
}

/// How much a pixel could change without an effect, at most.
fn bound_text(effect: &Effect) -> String {
    effect.bound.number().map_or_else(|| "-".to_owned(), share_text)
}

/// A change of a displayed pixel, 0 to 1, as percent.
fn share_text(share: f64) -> String {
    let percent = 100.0 * share;
    match percent {
        p if p <= 0.0 => "nothing".to_owned(),
        p if p < 0.01 => "below 0.01 %".to_owned(),
        p if p < 10.0 => format!("{} %", organza_survey::rounded(p, 0.01)),
        p => format!("{} %", organza_survey::rounded(p, 1.0)),
    }
}

/// Bytes in the largest unit that they have one of.
pub(super) fn bytes_text(bytes: u64) -> String {
    const UNITS: [&str; 5] = ["bytes", "KiB", "MiB", "GiB", "TiB"];
    let mut rank = 0;
    while rank + 1 < UNITS.len() && bytes >> (10 * (rank + 1)) > 0 {
        rank += 1;
    }
    let size = bytes as f64 / f64::from(1u32 << (10 * rank.min(3))) / if rank > 3 { 1024.0 } else { 1.0 };
    let unit = if size < 10.0 && rank > 0 { 0.1 } else { 1.0 };
    format!("{} {}", organza_survey::rounded(size, unit), UNITS[rank])
}

/// The cost record as a table, with the sum of times.
pub(super) fn cost_text(cost: &CostRecord) -> String {
    let rows = cost.stages.iter().map(|s| {
        [
            s.name.clone(),
            format!("{:.3}", s.seconds),
            s.items_in.to_string(),
            s.items_out.to_string(),
            s.fragments.to_string(),
            s.bytes.to_string(),
        ]
    });
    let mut text = table(["pass", "seconds", "in", "out", "fragments", "bytes"], "lrrrrr", rows);
    let total = cost.stages.iter().fold(0.0, |sum, s| sum + s.seconds);
    // Writing to a String cannot fail.
    let _ = writeln!(text, "total {total:.3} s");
    text
}

/// Columns as wide as they need to be; `align` has `l` or `r` for each.
pub(super) fn table<const N: usize>(head: [&str; N], align: &str, rows: impl Iterator<Item = [String; N]>) -> String {
    let mut lines = vec![head.map(str::to_owned)];
    lines.extend(rows.map(|row| row.map(|cell| organza::escape_controls(&cell).into_owned())));
    let width = |column: usize| lines.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: [usize; N] = std::array::from_fn(width);
    let mut text = String::new();
    for row in &lines {
        let mut line = String::new();
        for ((cell, width), side) in row.iter().zip(widths).zip(align.chars()) {
            let padding = " ".repeat(width - cell.chars().count());
            line += &if side == 'r' { padding + cell } else { cell.clone() + &padding };
            line += "  ";
        }
        text += line.trim_end();
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    #[test]
    fn shares_and_bytes_are_for_people() {
        let share = super::share_text;
        assert_eq!([0.0, 4e-6, 0.0123, 1.0].map(share), ["nothing", "below 0.01 %", "1.23 %", "100 %"]);
        let bytes = [999, 1 << 10, 302_992_911, 5 << 30, 3 << 40].map(super::bytes_text);
        assert_eq!(bytes, ["999 bytes", "1 KiB", "289 MiB", "5 GiB", "3 TiB"]);
    }

    #[test]
    fn columns_line_up() {
        let rows = [["ä".to_owned(), "10".to_owned()], ["bcd".to_owned(), "9".to_owned()]];
        assert_eq!(super::table(["x", "n"], "lr", rows.into_iter()), "x     n\nä    10\nbcd   9\n");
    }
}
