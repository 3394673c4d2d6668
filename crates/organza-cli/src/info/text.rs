//! What is known of a file, for people.

use organza::scene::UpAxis;
use organza::{escape_controls, printable};
use organza_survey::{Facts, Histogram, counted, grouped, rounded, sized};
use serde_json::Value;
use std::fmt::Write;
use std::path::Path;

/// Labels up to which each has a line.
const NAMED_LABELS: usize = 64;
/// Widest bar of a histogram, characters.
const BAR: f64 = 40.0;
/// Distance from the origin over the size from which single precision shows: a hundred thousandth of the size is then a rounding step.
const FAR: f64 = 100.0;

/// A document as indented lines; null and empty values are left out.
pub(super) fn lines(document: &Value) -> String {
    let mut text = String::new();
    add(document, "", &mut text);
    text
}

fn add(value: &Value, indent: &str, text: &mut String) {
    let Value::Object(fields) = value else { return };
    for (key, value) in fields {
        match value {
            Value::Null => {}
            Value::Array(items) if items.is_empty() => {}
            Value::Object(_) => {
                *text += &format!("{indent}{key}:\n");
                add(value, &format!("{indent}  "), text);
            }
            Value::Array(items) if items.iter().all(Value::is_object) => {
                for (i, item) in items.iter().enumerate() {
                    *text += &format!("{indent}{key} {i}:\n");
                    add(item, &format!("{indent}  "), text);
                }
            }
            Value::String(s) => *text += &format!("{indent}{key}: {}\n", escape_controls(s)),
            other => *text += &format!("{indent}{key}: {other}\n"),
        }
    }
}

/// Lines with a name in front.
struct Lines(String);

impl Lines {
    fn add(&mut self, name: &str, value: impl AsRef<str>) {
        // Writing to a String cannot fail.
        let _ = writeln!(self.0, "{name:<12}{}", escape_controls(value.as_ref()));
    }
}

/// What a data file holds.
pub(super) fn of_facts(file: &Path, facts: &Facts) -> String {
    let mut text = Lines(String::new());
    text.add("file", printable(file));
    let exact = if facts.bytes < 1000 { String::new() } else { format!(" ({} bytes)", grouped(facts.bytes)) };
    text.add("kind", format!("{}, read as {}, {}{exact}", facts.kind, facts.format, sized(facts.bytes)));
    let counts = facts.counts.iter().map(|(name, n)| format!("{name} {}", grouped(*n)));
    text.add("counts", counts.collect::<Vec<_>>().join(", "));
    if !facts.attributes.is_empty() {
        text.add("attributes", facts.attributes.join(", "));
    }
    places(facts, &mut text);
    values(facts, &mut text);
    faults(facts, &mut text);
    if facts.kind != "image" {
        let stands = facts.stands.map(UpAxis::name);
        let stands = stands.map(|axis| format!("; it stands along {axis}, so a first scene has {axis} point up"));
        let axis = facts.up.name();
        let stands = stands.unwrap_or_default();
        text.add(
            "up",
            if facts.is_up_stated {
                format!("{axis}, as the file says")
            } else {
                format!("{axis}, as nothing in the file says another{stands}; --up of render and init turns it")
            },
        );
    }
    if !facts.unused.is_empty() {
        text.add("not used", facts.unused.join(", "));
    }
    facts.remarks.iter().for_each(|remark| text.add("remark", remark));
    facts.mended.iter().for_each(|mended| text.add("mended", mended));
    facts.warnings.iter().for_each(|warning| text.add("warning", warning));
    text.0
}

fn places(facts: &Facts, text: &mut Lines) {
    let Some(bounds) = facts.bounds else { return };
    let size = bounds.size();
    let unit = 1e-5 * size.max_element().max(1e-300);
    let list = |v: [f64; 3]| v.map(|x| rounded(x, unit)).join("  ");
    text.add("lowest", list(bounds.min.to_array()));
    text.add("highest", list(bounds.max.to_array()));
    let of_unit = match &facts.unit {
        Some(name) => format!(", in {name}"),
        None => ", in the unit of the file, which does not tell it".to_owned(),
    };
    text.add("size", size.to_array().map(|x| rounded(x, unit)).join(" × ") + &of_unit);
    if let Some(far) = facts.far().filter(|far| *far > FAR) {
        text.add(
            "far away",
            format!(
                "{} times its size from the origin: single precision would round it; Organza keeps it",
                rounded(far, 1.0)
            ),
        );
    }
    if let Some(spacing) = facts.spacing {
        text.add(
            "spacing",
            format!(
                "{}, the median distance to the nearest point, of at most 1,000 points",
                rounded(spacing, 1e-3 * spacing)
            ),
        );
    }
    if let Some(duplicates) = facts.duplicates.filter(|d| *d > 0) {
        text.add("duplicates", format!("{} where another one lies", counted(duplicates, ["point lies", "points lie"])));
    }
    if let Some(steps) = facts.steps {
        let lengths = steps.map(|s| s.length());
        text.add("voxel", lengths.map(|l| rounded(l, 1e-4 * l)).join(" × "));
        let axis = |k: usize| {
            format!(
                "{} along [{}]",
                ["x", "y", "z"][k],
                (steps[k] / lengths[k]).to_array().map(|c| rounded(c, 1e-4)).join(", ")
            )
        };
        text.add("axes", [0, 1, 2].map(axis).join("; "));
    }
}

fn values(facts: &Facts, text: &mut Lines) {
    if let Some([low, high]) = facts.range {
        text.add("values", format!("{low} to {high}"));
    }
    let step = facts.histogram.as_ref().map_or(1e-300, |h| 1e-3 * (h.high - h.low));
    if !facts.quantiles.is_empty() {
        let share =
            |(share, value): &(f64, f64)| format!("{} % below {}", rounded(100.0 * share, 1.0), rounded(*value, step));
        text.add("shares", facts.quantiles.iter().map(share).collect::<Vec<_>>().join(", "));
    }
    if let Some(histogram) = &facts.histogram {
        bars(histogram, text);
    }
    for label in facts.labels.iter().take(NAMED_LABELS) {
        let name = if label.name.is_empty() { String::new() } else { format!(" {}", label.name) };
        let voxels = counted(label.voxels, ["voxel", "voxels"]);
        text.add("label", format!("{}{name}: {voxels}{}", label.number, if label.is_hidden { ", hidden" } else { "" }));
    }
    if let Some(more) = facts.labels.len().checked_sub(NAMED_LABELS).filter(|more| *more > 0) {
        text.add("labels", format!("and {more} more: --json has all"));
    }
    for (name, [low, high]) in &facts.columns {
        let unit = 1e-5 * (high - low).max(1e-300);
        let association = facts.associations.iter().find(|(column, _)| column == name);
        let element = association.map(|(_, association)| format!(" of the {}", association.name())).unwrap_or_default();
        text.add("column", format!("{name}{element}: {} to {}", rounded(*low, unit), rounded(*high, unit)));
    }
}

/// A bar for each bin, as long as the logarithm of its count: air would hide all else.
fn bars(histogram: &Histogram, text: &mut Lines) {
    let most = histogram.counts.iter().copied().max().unwrap_or(0);
    let length = |count: u64| (count as f64).ln_1p() / (most as f64).ln_1p().max(1e-9) * BAR;
    text.add("histogram", "from each value on; bars are logarithms of counts");
    let step = 1e-2 * histogram.width();
    for (bin, count) in histogram.counts.iter().enumerate() {
        let from = histogram.low + bin as f64 * histogram.width();
        let bar = "#".repeat(length(*count).round() as usize);
        let _ = writeln!(text.0, "{:>12}  {bar:<41} {}", rounded(from, step), grouped(*count));
    }
}

fn faults(facts: &Facts, text: &mut Lines) {
    let Some(faults) = facts.faults else { return };
    let rims = counted(faults.holes, ["hole or open rim", "holes or open rims"]);
    let found = [
        (faults.open_edges, ["edge", "edges"], format!(" of one triangle alone, in about {rims}")),
        (faults.crowded_edges, ["edge", "edges"], " of more than two triangles".to_owned()),
        (faults.duplicates, ["triangle", "triangles"], " that another one covers".to_owned()),
        (faults.degenerate, ["triangle", "triangles"], " without area".to_owned()),
        (faults.isolated, ["vertex", "vertices"], " of no triangle".to_owned()),
    ];
    let there = found.into_iter().filter(|(count, ..)| *count > 0);
    let there: Vec<String> = there.map(|(count, noun, what)| counted(count, noun) + &what).collect();
    if there.is_empty() {
        let has_faces = facts.counts.iter().any(|(name, count)| *name == "triangles" && *count > 0);
        text.add("faults", if has_faces { "none: a closed surface" } else { "no face" });
    }
    there.iter().for_each(|fault| text.add("fault", fault));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_are_as_many_as_bins_and_counts_have_commas() {
        let histogram = Histogram { low: 0.0, high: 4.0, counts: vec![1_000_000, 0, 10, 1] };
        let mut text = Lines(String::new());
        bars(&histogram, &mut text);
        assert_eq!(text.0.lines().count(), 5);
        assert!(text.0.contains("1,000,000") && text.0.contains(&"#".repeat(40)));
    }
}
