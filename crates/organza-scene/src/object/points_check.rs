//! Checks of how raw points look.

use crate::at::At;
use crate::limits::LARGEST;
use crate::object::points_raw::{RawColorBy, RawDiscShape, RawMapScale, RawPointForm, RawPointSize};
use crate::object::raw::RawObject;
use crate::source::transfer::{Beside, beside_of_points, check_transfer};
use crate::{Error, PointsLook, shown};
use convert::{Classified, ColorBy, ColorMap, DiscShape, DiscSize, Kept, MapScale, PointColors, Within};

/// Longest name of a column, bytes.
const LONGEST_NAME: usize = 256;
/// Largest diameter of a disc, pixels.
const MOST_PIXELS: f64 = 1024.0;
/// The map of the classes of LAS.
const OF_CLASSES: &str = "classes";
/// The map of other whole numbers.
const OF_WHOLE_NUMBERS: &str = "distinct";
/// Names of the column of classes.
const CLASSES: [&str; 2] = ["classification", "class"];

/// Names of the maps that colour an object by a column: those of ranges of numbers, then those of whole numbers.
pub fn color_map_names() -> impl Iterator<Item = &'static str> {
    ColorMap::names().chain([OF_CLASSES, OF_WHOLE_NUMBERS])
}

/// Checks an object's keys of points, and of the colours of a mesh; sources that take none of them have the default.
pub(crate) fn check_points(at: &At<'_>, raw: &RawObject) -> Result<PointsLook, Error> {
    let is_medium = raw.points.is_some() && raw.form == Some(RawPointForm::Medium);
    if raw.extinction.is_some() && !is_medium {
        let message = "`extinction` belongs to `points` with as = \"medium\"";
        return Err(at
            .key("extinction")
            .error(message, "other media have an `extinction` in their source, surfaces none"));
    }
    if let (Some(_), Some(_)) = (&raw.color_by, raw.color) {
        let hint = "remove the key `color` of the object, or `color_by`";
        return Err(at.key("color").error("`color` and `color_by` exclude each other", hint));
    }
    let color_by = || raw.color_by.as_ref().map(|by| check_color_by(at, raw, by)).transpose();
    if raw.points.is_none() {
        let keys = [
            ("as", raw.form.is_some()),
            ("color_by", raw.color_by.is_some() && raw.mesh.is_none()),
            ("keep", raw.keep.is_some()),
            ("unlit", raw.unlit.is_some()),
            ("point_size", raw.point_size.is_some()),
            ("discs", raw.discs.is_some()),
        ];
        return match keys.into_iter().find(|(_, on)| *on) {
            Some(("unlit", _)) => {
                let hint = "give its material shading = \"unlit\"";
                Err(at.key("unlit").error("`unlit` belongs to `points`", hint))
            }
            Some((key @ "color_by", _)) => {
                let hint = "a surface shows the values of a volume by `field`";
                Err(at.key(key).error("`color_by` belongs to `points` and to a `mesh`", hint))
            }
            Some((key, _)) => Err(at.key(key).error(format!("`{key}` belongs to `points`"), "")),
            None => Ok(PointsLook { color_by: color_by()?, ..PointsLook::default() }),
        };
    }
    if raw.point_size.is_some() && is_medium {
        let hint = "a column `radius` of the file, or `footprint`, says how wide it is drawn";
        return Err(at.key("point_size").error("points that are a medium have no discs", hint));
    }
    if raw.discs.is_some() && is_medium {
        return Err(at.key("discs").error("points that are a medium have no discs", "their kernels are balls"));
    }
    if raw.discs == Some(RawDiscShape::Elliptical) && raw.point_size.is_some() {
        let message = "`point_size` and discs = \"elliptical\" exclude each other";
        return Err(at.key("discs").error(message, "leave one of them out"));
    }
    if raw.merge_duplicates && is_medium {
        let message = "points that are a medium share the matter of their place";
        return Err(at.key("merge_duplicates").error(message, "leave `merge_duplicates` out"));
    }
    if raw.unlit.is_some() && raw.material.is_some() {
        let hint = "leave one of them out, or give the material shading = \"unlit\"";
        return Err(at.key("unlit").error("`unlit` and `material` exclude each other", hint));
    }
    let keep = raw.keep.iter().flatten().map(|(column, numbers)| check_kept(&at.key("keep"), column, numbers));
    Ok(PointsLook {
        color_by: color_by()?,
        keep: keep.collect::<Result<_, _>>()?,
        unlit: raw.unlit,
        shape: match raw.discs {
            None | Some(RawDiscShape::Auto) => None,
            Some(RawDiscShape::Round) => Some(DiscShape::Round),
            Some(RawDiscShape::Elliptical) => Some(DiscShape::Elliptical),
            Some(RawDiscShape::Balls) => Some(DiscShape::Balls),
        },
        keeps_values: false,
        size: raw.point_size.as_ref().map(|size| check_size(&at.key("point_size"), size)).transpose()?,
    })
}

fn check_name<'n>(at: &At<'_>, name: &'n str) -> Result<&'n str, Error> {
    if (1..=LONGEST_NAME).contains(&name.len()) {
        return Ok(name);
    }
    let message = format!("expected the name of a column, 1 to {LONGEST_NAME} bytes, found {}", name.len());
    Err(at.error(message, "`organza info` lists the columns of a file"))
}

fn check_color_by(at: &At<'_>, raw: &RawObject, by: &RawColorBy) -> Result<ColorBy, Error> {
    let at_by = at.key("color_by");
    let column = check_name(&at_by.key("column"), &by.column)?.to_owned();
    let range = by.range.map(|range| check_range(&at_by.key("range"), range)).transpose()?;
    if raw.transfer.is_some() {
        for (key, on) in [("map", by.map.is_some()), ("range", range.is_some()), ("scale", by.scale.is_some())] {
            if on {
                let message = format!("`{key}` and the object's `transfer` exclude each other");
                return Err(at_by.key(key).error(message, "leave one of them out"));
            }
        }
        let beside = beside_of_points(raw, raw.form == Some(RawPointForm::Medium));
        let classified = match beside {
            Beside::Nothing => Classified::No,
            Beside::Opacity => Classified::Opacity,
            Beside::Extinction => Classified::Extinction,
        };
        return Ok(ColorBy { column, colors: PointColors::Transfer(check_transfer(at, raw, beside)?, classified) });
    }
    let default = if CLASSES.contains(&column.as_str()) { OF_CLASSES } else { "viridis" };
    let colors = match by.map.as_deref().unwrap_or(default) {
        name @ (OF_CLASSES | OF_WHOLE_NUMBERS) => {
            for (key, on) in [("range", range.is_some()), ("scale", by.scale.is_some())] {
                if on {
                    let message = format!("the map \"{name}\" has a colour for each number and no `{key}`");
                    return Err(at_by.key(key).error(message, "leave it out, or choose another map"));
                }
            }
            if name == OF_CLASSES { PointColors::Classes } else { PointColors::Distinct }
        }
        name => match ColorMap::named(name) {
            Some(map) => PointColors::Map { map, range, scale: check_scale(&at_by, by.scale, range)? },
            None => {
                let names: Vec<&str> = color_map_names().collect();
                let message = format!("`map`: expected one of {}, found `{}`", names.join(", "), shown(name));
                return Err(at_by.key("map").error(message, "or give the object a `transfer` with colours of its own"));
            }
        },
    };
    Ok(ColorBy { column, colors })
}

/// How numbers lie along a map; only numbers above 0 have logarithms.
fn check_scale(at: &At<'_>, scale: Option<RawMapScale>, range: Option<[f64; 2]>) -> Result<MapScale, Error> {
    let Some(RawMapScale::Log) = scale else { return Ok(MapScale::Linear) };
    match range {
        Some([low, _]) if low <= 0.0 => {
            let message = format!("scale = \"log\": expected a range above 0, found one from {low}");
            Err(at.key("range").error(message, "such as [0.01, 100]"))
        }
        _ => Ok(MapScale::Logarithmic),
    }
}

/// Two numbers of which the first is below the second.
fn check_range(at: &At<'_>, range: [f64; 2]) -> Result<[f64; 2], Error> {
    let [low, high] = range;
    if low.abs() <= LARGEST && high.abs() <= LARGEST && low < high {
        return Ok(range);
    }
    let message = format!("expected a lowest and a highest number up to {LARGEST:e}, found {low} and {high}");
    Err(at.error(message, "such as [0, 255]"))
}

/// Classes are listed; of other columns a range is kept, which may be a single number twice.
fn check_kept<'k>(at: &At<'k>, column: &'k str, numbers: &[f64]) -> Result<Kept, Error> {
    let at = at.key(column);
    let column = check_name(&at, column)?.to_owned();
    if CLASSES.contains(&column.as_str()) {
        if let Some(bad) = numbers.iter().find(|n| !(0.0..=255.0).contains(*n) || n.fract() != 0.0) {
            return Err(
                at.error(format!("expected classes, whole numbers from 0 to 255, found {bad}"), "such as [2, 6]")
            );
        }
        if numbers.is_empty() {
            return Err(at.error("expected at least one class, found none", "such as [2, 6]"));
        }
        return Ok(Kept { column, within: Within::Among(numbers.to_vec()) });
    }
    match *numbers {
        [low, high] if low <= high && low.abs() <= LARGEST && high.abs() <= LARGEST => {
            Ok(Kept { column, within: Within::Range([low, high]) })
        }
        _ => {
            let message = format!("expected a lowest and a highest number up to {LARGEST:e}, found {numbers:?}");
            Err(at.error(message, "such as [10, 200]; of classes a list is kept"))
        }
    }
}

fn check_size(at: &At<'_>, raw: &RawPointSize) -> Result<DiscSize, Error> {
    match (raw.pixels, raw.world) {
        (Some(pixels), None) if pixels > 0.0 && pixels <= MOST_PIXELS => Ok(DiscSize::Pixels(pixels)),
        (Some(pixels), None) => {
            let message = format!("`pixels`: expected a number above 0, up to {MOST_PIXELS}, found {pixels}");
            Err(at.key("pixels").error(message, ""))
        }
        (None, Some(world)) => at.length("world", world).map(DiscSize::World),
        _ => Err(at.error("expected either `pixels` or `world`", "such as { pixels = 2 } or { world = 0.5 }")),
    }
}
