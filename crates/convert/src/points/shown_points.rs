//! Selects and colours raw points: thins them to the requested distance, and colours them by a column.

use crate::points::discs::unused_by_discs;
use crate::points::materials::with_materials;
use crate::points::matter::unused_by_matter;
use crate::{
    Classified, ColorBy, ColorScale, Colored, ConvertError, DiscShape, Kept, MapScale, PointColors, SplatParams,
    colored, kept, thinned, with_cells,
};
use splat_core::glam::DVec3;
use splat_core::points::attributes::EXTINCTION;
use splat_core::text::counted;
use splat_core::{Clip, Column, RawPoints};
use std::sync::Arc;

/// The request; [`PointsShown::default`] leaves points as they are.
#[derive(Debug, Clone, Copy, Default)]
pub struct PointsShown<'a> {
    /// Numbers of columns that are kept.
    pub keep: &'a [Kept],
    /// Regions that are kept, in the space of the points.
    pub clip: &'a [Clip],
    /// Distance below which points become one, units of the file; see [`thinned`].
    pub spacing: Option<f64>,
    /// The column that colours are taken from.
    pub color_by: Option<&'a ColorBy>,
    /// Whether they stand for matter: then for as much as among all points, whichever are kept.
    pub as_matter: bool,
    /// The shape of discs whose points state none.
    pub shape: DiscShape,
    /// Whether all discs have one size.
    pub has_size: bool,
    /// Whether the object states an opacity.
    pub has_opacity: bool,
    /// Whether what becomes of them shows a field.
    pub has_field: bool,
    /// Whether points that have the colours of a column have its numbers as their values.
    pub keeps_values: bool,
    /// The direction in which `height` grows.
    pub up: DVec3,
}

/// The selected points, with notes about them.
#[derive(Debug, Clone, PartialEq)]
pub struct ShownPoints {
    /// The points.
    pub points: Arc<RawPoints>,
    /// Notes: the origin of their colours, an empty selection, and columns that a medium does not use. Each is a sentence
    /// without a full stop.
    pub said: Vec<String>,
    /// The scale of their colours, if a column colours them.
    pub scale: Option<ColorScale>,
}

/// The points that are shown. Steps that are not requested change nothing and make no copy. Colours are those of points that were made one.
///
/// ```
/// use convert::{PointsShown, SplatParams, shown_points};
/// use splat_core::RawPoints;
/// let points = std::sync::Arc::new(RawPoints::default());
/// let same = shown_points(points.clone(), &PointsShown::default(), &SplatParams::default()).unwrap();
/// assert!(std::sync::Arc::ptr_eq(&points, &same.points) && same.said.is_empty());
/// ```
///
/// # Errors
/// Those of [`thinned`], [`colored`] and [`with_cells`].
pub fn shown_points(
    mut points: Arc<RawPoints>,
    shown: &PointsShown<'_>,
    splat: &SplatParams,
) -> Result<ShownPoints, ConvertError> {
    let mut scale = None;
    let mut said = match shown.as_matter {
        true => unused_by_matter(&points),
        false => unused_by_discs(&points, shown.has_size, shown.shape, splat),
    };
    check_ready(&points, shown, splat)?;
    if !(shown.keep.is_empty() && shown.clip.is_empty()) {
        let before = points.len();
        if shown.as_matter {
            points = with_cells(Arc::unwrap_or_clone(points), splat, None)?.into();
        }
        points = kept(&points, shown.keep, shown.clip, shown.up).into();
        if points.is_empty() && before > 0 {
            said.push(format!("nothing is left of {before} points{}", causes(shown)));
        }
    }
    if let Some(spacing) = shown.spacing {
        points = thinned(&points, spacing, splat)?.into();
    }
    points = with_materials(points, splat, shown.has_opacity)?;
    if let Some(by) = shown.color_by.filter(|_| !points.is_empty()) {
        let colored = colored(&points, by, shown.up, splat)?;
        said.push(said_of_colors(by, &colored, "point"));
        scale = ColorScale::of_points(&splat.object_name, by, &colored, splat.color);
        let mut recolored = Arc::unwrap_or_clone(points);
        if !recolored.gaussians.is_empty() {
            recolored.gaussians.recolor(&colored.color);
        }
        match by.colors {
            PointColors::Transfer(_, Classified::Opacity) => multiply(&mut recolored.opacity, &colored.classified),
            PointColors::Transfer(_, Classified::Extinction) => {
                let factors: Vec<f64> = colored.classified.iter().map(|factor| f64::from(*factor)).collect();
                match recolored.columns.iter_mut().find(|column| column.name == EXTINCTION) {
                    Some(column) => multiply(&mut column.values, &factors),
                    None => recolored.columns.push(Column { name: EXTINCTION.to_owned(), values: factors }),
                }
            }
            _ => {}
        }
        recolored.color = colored.color;
        if shown.keeps_values {
            recolored.value = colored.numbers.iter().map(|number| *number as f32).collect();
            let gaps = recolored.value.iter().filter(|value| !value.is_finite()).count() as u64;
            if gaps > 0 {
                recolored.value.clear();
                said.push(format!("splats keep no values: {} without a number that f32 holds", counted(gaps, "point")));
            }
        }
        points = recolored.into();
    }
    Ok(ShownPoints { points, said, scale })
}

/// Refuses what would change the optics of splats, which are what they are, and fields upon what is no surface.
fn check_ready(points: &RawPoints, shown: &PointsShown<'_>, splat: &SplatParams) -> Result<(), ConvertError> {
    let is_ready = !points.ready.cloud.is_empty();
    if shown.has_field && (is_ready || !points.gaussians.is_empty()) {
        let expected = "none: 3D Gaussians, and splats of a file, are no samples of a surface";
        return Err(splat.bad_text("field", "stated".to_owned(), expected));
    }
    if !is_ready {
        return Ok(());
    }
    let expected = "none: splats of a file have opacities of their own";
    match shown.color_by.map(|by| &by.colors) {
        _ if shown.has_opacity => Err(splat.bad_text("opacity", "stated".to_owned(), expected)),
        Some(PointColors::Transfer(_, Classified::Opacity | Classified::Extinction)) => {
            Err(splat.bad_text("transfer", "one with opacities".to_owned(), expected))
        }
        _ => Ok(()),
    }
}

/// Multiplies a column, whose numbers are 1 where it has none.
fn multiply<T: Copy + std::ops::Mul<Output = T>>(column: &mut Vec<T>, factors: &[T]) {
    if column.is_empty() {
        column.extend_from_slice(factors);
    } else {
        column.iter_mut().zip(factors).for_each(|(number, factor)| *number = *number * *factor);
    }
}

/// What left points out.
fn causes(shown: &PointsShown<'_>) -> String {
    let columns: Vec<String> = shown.keep.iter().map(|kept| format!("`keep.{}`", kept.column)).collect();
    let clip = (!shown.clip.is_empty()).then(|| "`clip`".to_owned());
    let keys: Vec<String> = columns.into_iter().chain(clip).collect();
    format!(" by {}", keys.join(" and "))
}

/// How colours arose, of what has one number each: a point, a vertex or a face.
pub(crate) fn said_of_colors(by: &ColorBy, colored: &Colored, each: &str) -> String {
    if !colored.has_numbers() {
        let colored = plural(each);
        return format!("no number of `{}` can be shown: all {colored} have the object's colour", by.column);
    }
    let colors = match (&by.colors, colored.range) {
        (PointColors::Map { map, scale, .. }, Some([low, high])) => {
            // Of a logarithmic map the lower end tells how fine numbers are.
            let is_logarithmic = *scale == MapScale::Logarithmic;
            let [from, to] = [low, high].map(|end| short(end, if is_logarithmic { low } else { high - low }));
            let by_logarithm = if is_logarithmic { ", by logarithm" } else { "" };
            format!("the map {} from {from} to {to}{by_logarithm}", map.name())
        }
        (PointColors::Transfer(..), _) => "the object's `transfer`".to_owned(),
        (PointColors::Distinct, _) => "256 colours that are told apart".to_owned(),
        (PointColors::Labels(_), _) => "the table of labels".to_owned(),
        _ => "the colours of classes".to_owned(),
    };
    let gaps = match colored.gaps {
        0 => String::new(),
        n => format!("; the object's colour for {} without a number that shows", counted_each(n, each)),
    };
    let also = match by.colors {
        PointColors::Transfer(_, Classified::Opacity) => " and opacities",
        PointColors::Transfer(_, Classified::Extinction) => " and extinctions",
        _ => "",
    };
    format!("{} have the colours{also} of `{}` by {colors}{gaps}", plural(each), by.column)
}

/// Several of what has one number each.
fn plural(each: &str) -> &str {
    match each {
        "vertex" => "vertices",
        "face" => "faces",
        _ => "points",
    }
}

fn counted_each(n: u64, each: &str) -> String {
    if n == 1 { format!("1 {each}") } else { format!("{n} {}", plural(each)) }
}

/// A number to a thousandth of a width.
fn short(number: f64, width: f64) -> String {
    let digits = if width > 0.0 { 3.0 - libm::log10(width).floor() } else { 0.0 };
    let text = format!("{number:.*}", digits.clamp(0.0, 12.0) as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ColorMap, Within};
    use splat_core::glam::Vec3;

    #[test]
    fn points_are_kept_then_made_fewer_then_coloured() {
        let points = RawPoints {
            position: (0..8).map(|i| Vec3::X * i as f32).collect(),
            value: (0..8).map(|i| i as f32).collect(),
            classification: vec![2, 2, 2, 2, 2, 2, 2, 7],
            ..RawPoints::default()
        };
        let keep = [Kept { column: "class".into(), within: Within::Among(vec![2.0]) }];
        let by = ColorBy { column: "value".into(), colors: PointColors::map_over(ColorMap::VIRIDIS, [0.0, 6.0]) };
        let mut shown = PointsShown { keep: &keep, spacing: Some(2.0), color_by: Some(&by), ..PointsShown::default() };
        let splat = SplatParams::default();
        let ShownPoints { points: found, said, scale } =
            shown_points(points.clone().into(), &shown, &splat).expect("good points");
        assert_eq!(scale.map(|scale| scale.color(6.0)), Some(ColorMap::VIRIDIS.at(1.0)));
        assert_eq!(found.value, [0.5, 2.5, 4.5, 6.0]);
        assert_eq!(found.color[3], ColorMap::VIRIDIS.at(1.0));
        assert_eq!(said, ["points have the colours of `value` by the map viridis from 0 to 6"]);
        assert_eq!([short(637_012.239_87, 35.0), short(-0.5, 0.012), short(7.0, 0.0)], ["637012.24", "-0.5", "7"]);
        let none = [Kept { column: "value".into(), within: Within::Range([50.0, 60.0]) }];
        shown.keep = &none;
        let ShownPoints { points: found, said, scale } =
            shown_points(points.into(), &shown, &splat).expect("good points");
        assert!(
            found.is_empty() && scale.is_none() && said == ["nothing is left of 8 points by `keep.value`"],
            "{said:?}"
        );
    }
}
