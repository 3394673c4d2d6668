//! Which column points or a mesh take their colours from in a first scene, and in which colours.

use super::quoted;
use crate::data_file::DataFile;
use crate::number::grouped;
use crate::preset::{Preset, Wish};
use convert::class_name;
use splat_core::RawPoints;
use std::fmt::Write;

/// Least share of points that have a class with a meaning, for classes to be looked at.
const CLASSIFIED: f64 = 0.5;
/// Classes that say nothing of what a point is: created, and unclassified.
const NOTHING: [u8; 2] = [0, 1];

/// The keys of the colours; `None` where the file has colours and no others are asked for, and where no column tells anything.
pub(super) fn point_colors(points: &RawPoints, are_colored: bool, wish: &Wish) -> Option<String> {
    let chosen = match &wish.color_by {
        Some(column) => column.as_str(),
        None if !are_colored => telling(points)?,
        None => return None,
    };
    let mut text = String::new();
    if chosen == "classification" && !points.classification.is_empty() {
        let _ = writeln!(text, "# {}", classes(points));
    }
    text +=
        "# Colours by a column; `organza info` lists the columns of the file, and `keep` leaves points out by them.\n";
    text += &color_by(chosen, wish);
    Some(text)
}

/// The keys of the colours of a mesh: of the column that is asked for, else of the one that its file shows, unless that has one value.
pub(super) fn mesh_colors(file: &DataFile, wish: &Wish) -> Option<String> {
    let is_free = wish.material.is_none() && !file.is_colored();
    let shown = file.column.as_ref().filter(|column| is_free && !column.is_constant());
    let chosen = wish.color_by.as_ref().or(shown.map(|column| &column.name))?;
    let about = "# Colours by a column; `organza info` lists the columns of the file.\n";
    Some(format!("{about}{}", color_by(chosen, wish)))
}

/// The line that names a column.
fn color_by(column: &str, wish: &Wish) -> String {
    let preset = wish.preset.as_ref();
    let name = preset.and_then(Preset::map).map(|map| map.name());
    let name = name.or(preset.filter(|preset| preset.is_labels()).map(|_| "distinct"));
    let map = name.map(|name| format!(", map = \"{name}\""));
    let range = wish.color_range.map(|[low, high]| format!(", range = [{low:?}, {high:?}]"));
    let scale = if wish.is_logarithmic { ", scale = \"log\"" } else { "" };
    let keys = [map.unwrap_or_default(), range.unwrap_or_default()].concat();
    format!("color_by = {{ column = {}{keys}{scale} }}\n", quoted(column))
}

/// The column that tells most of points without colours: their classes, else their values, if they differ.
fn telling(points: &RawPoints) -> Option<&'static str> {
    let classified = points.classification.iter().filter(|class| !NOTHING.contains(class));
    let mut counts = [0usize; 256];
    classified.for_each(|class| counts[usize::from(*class)] += 1);
    let share = counts.iter().sum::<usize>() as f64 / points.len().max(1) as f64;
    if share >= CLASSIFIED && counts.iter().filter(|count| **count > 0).count() > 1 {
        return Some("classification");
    }
    let first = points.value.first()?;
    points.value.iter().any(|value| value != first).then_some(points.value_name())
}

/// How many points have which class.
fn classes(points: &RawPoints) -> String {
    let mut counts = [0u64; 256];
    points.classification.iter().for_each(|class| counts[usize::from(*class)] += 1);
    let there = (0..=255u8).map(|class| (class, counts[usize::from(class)])).filter(|(_, count)| *count > 0);
    let class_count = |(class, count): (u8, u64)| {
        let name = class_name(class).map(|name| format!(" ({name})")).unwrap_or_default();
        format!("{class}{name} {}", grouped(count))
    };
    format!("Classes: {}.", there.map(class_count).collect::<Vec<_>>().join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::glam::Vec3;

    fn points(classification: Vec<u8>, value: Vec<f32>) -> RawPoints {
        let position = vec![Vec3::ZERO; classification.len().max(value.len())];
        RawPoints { position, classification, value, ..RawPoints::default() }
    }

    #[test]
    fn classes_tell_more_than_values_and_one_value_tells_nothing() {
        assert_eq!(telling(&points(vec![2, 2, 6, 1], vec![1.0, 2.0, 3.0, 4.0])), Some("classification"));
        assert_eq!(telling(&points(vec![1, 1, 2, 1], vec![1.0, 2.0, 3.0, 4.0])), Some("value"));
        assert_eq!(telling(&points(vec![2, 2, 2, 2], vec![5.0; 4])), None);
        assert_eq!(telling(&points(Vec::new(), Vec::new())), None);
    }

    #[test]
    fn what_is_asked_for_goes_before_colours_of_the_file() {
        let mut colored = points(vec![2, 6], Vec::new());
        colored.color = vec![[1.0; 3]; 2];
        assert_eq!(point_colors(&colored, true, &Wish::default()), None);
        let preset = Some(Preset::named("turbo").unwrap());
        let wish = Wish { color_by: Some("height".into()), preset, ..Wish::default() };
        let text = point_colors(&colored, true, &wish).unwrap();
        assert!(text.ends_with("color_by = { column = \"height\", map = \"turbo\" }\n"), "{text}");
        let wish = Wish { color_range: Some([0.5, 20.0]), is_logarithmic: true, ..wish };
        let text = point_colors(&colored, true, &wish).unwrap();
        assert!(text.ends_with("map = \"turbo\", range = [0.5, 20.0], scale = \"log\" }\n"), "{text}");
        let wish = Wish { color_by: Some("classification".into()), ..Wish::default() };
        let text = point_colors(&colored, true, &wish).unwrap();
        assert!(text.starts_with("# Classes: 2 (ground) 1, 6 (building) 1.\n"), "{text}");
    }
}
