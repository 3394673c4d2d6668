//! Checks of the surfaces of fields: isosurfaces, level sets, slices, and where they end; and of fields that surfaces show.

use crate::at::At;
use crate::limits::LARGEST;
use crate::object::raw::RawObject;
use crate::paths::Paths;
use crate::source::check::{check_box, check_implicit};
use crate::source::raw::{
    RawClip, RawField, RawInside, RawInterpolation, RawIsosurface, RawLevelSet, RawPart, RawSlice,
};
use crate::source::transfer::{Beside, beside_of_points, check_transfer};
use crate::{CombinedSource, Error, FieldSource, IsosurfaceSource, LevelSetSource, SliceSource, Source};
use convert::Classified;
use field::{Combination, Inside, MpuParams};
use splat_core::{Clip, Interpolation, TransferFunction};

pub(crate) fn check_isosurface(at: &At<'_>, raw: &RawIsosurface, paths: &Paths) -> Result<IsosurfaceSource, Error> {
    Ok(IsosurfaceSource {
        path: paths.resolve(&at.key("volume"), &raw.volume)?,
        frame: raw.frame.into(),
        level: at.number("level", raw.level, -LARGEST..=LARGEST)?,
        interpolation: interpolation(raw.interpolation),
        inside: match raw.inside {
            RawInside::Above => Inside::Above,
            RawInside::Below => Inside::Below,
        },
    })
}

pub(crate) fn check_level_set(at: &At<'_>, raw: &RawLevelSet, paths: &Paths) -> Result<LevelSetSource, Error> {
    let tolerance = raw.tolerance.unwrap_or(MpuParams::default().tolerance);
    if !(tolerance > 0.0 && tolerance <= 1.0) {
        let message = format!("`tolerance`: expected a number above 0, up to 1, found {}", crate::short(tolerance));
        return Err(at.key("tolerance").error(message, "it is a share of the diagonal of the points' box"));
    }
    Ok(LevelSetSource { path: paths.resolve(&at.key("points"), &raw.points)?, tolerance })
}

/// Solids that become one; `at` is the place of the list.
pub(crate) fn check_combined(
    at: &At<'_>,
    combination: Combination,
    parts: &[RawPart],
    paths: &Paths,
) -> Result<CombinedSource, Error> {
    if parts.len() < 2 {
        let message = format!("expected at least two solids, found {}", parts.len());
        return Err(
            at.error(message, "one solid alone is a source of its own: `implicit`, `isosurface` or `level_set`")
        );
    }
    let parts = parts.iter().enumerate().map(|(i, part)| check_part(&at.index(i), part, paths));
    Ok(CombinedSource { combination, parts: parts.collect::<Result<_, _>>()? })
}

fn check_part(at: &At<'_>, raw: &RawPart, paths: &Paths) -> Result<Source, Error> {
    let combined = |key: &'static str, combination, parts: &Option<Vec<RawPart>>| {
        let parts = parts.as_ref()?;
        Some(check_combined(&at.key(key), combination, parts, paths).map(Source::Combined))
    };
    let found = [
        raw.implicit.as_ref().map(|i| check_implicit(&at.key("implicit"), i).map(Source::Implicit)),
        raw.isosurface.as_ref().map(|i| check_isosurface(&at.key("isosurface"), i, paths).map(Source::Isosurface)),
        raw.level_set.as_ref().map(|l| check_level_set(&at.key("level_set"), l, paths).map(Source::LevelSet)),
        combined("union", Combination::Union, &raw.union),
        combined("intersection", Combination::Intersection, &raw.intersection),
        combined("difference", Combination::Difference, &raw.difference),
    ];
    let mut found = found.into_iter().flatten();
    match (found.next(), found.next()) {
        (Some(one), None) => one,
        (none, _) => {
            let count = if none.is_none() { "none" } else { "several" };
            let hint = "solids are implicit, isosurface, level_set, union, intersection and difference";
            Err(at.error(format!("expected exactly one solid in each part, found {count}"), hint))
        }
    }
}

pub(crate) fn check_slice(
    at: &At<'_>,
    raw: &RawSlice,
    transfer: TransferFunction,
    paths: &Paths,
) -> Result<SliceSource, Error> {
    Ok(SliceSource {
        path: paths.resolve(&at.key("volume"), &raw.volume)?,
        frame: raw.frame.into(),
        transfer,
        center: at.vector("center", raw.center)?,
        normal: at.direction("normal", raw.normal)?,
    })
}

/// A field that a surface shows.
pub(crate) fn check_shown_field(
    at: &At<'_>,
    raw: &RawObject,
    field: &RawField,
    source: &Source,
    paths: &Paths,
) -> Result<FieldSource, Error> {
    let at_field = at.key("field");
    if source.is_medium() {
        return Err(at_field.error("`field` belongs to surfaces", "a medium has the values of its own source"));
    }
    if matches!(source, Source::Slice(_)) {
        return Err(at_field.error("a slice shows the values of its own volume", "leave `field` out"));
    }
    for (key, on) in [("color", raw.color.is_some()), ("color_by", raw.color_by.is_some())] {
        if on {
            let message = format!("`field` and `{key}` exclude each other");
            return Err(at_field.error(message, "colours are those of `transfer`"));
        }
    }
    if raw.transfer.is_none() {
        let hint = "such as transfer = [{ value = 0, color = [0, 0, 1] }, { value = 1, color = [1, 0, 0] }]";
        return Err(at.error("a `field` needs a key `transfer`, found none", hint));
    }
    let beside = beside_of_points(raw, false);
    Ok(FieldSource {
        path: paths.resolve(&at_field.key("volume"), &field.volume)?,
        frame: field.frame.into(),
        interpolation: interpolation(field.interpolation),
        transfer: check_transfer(at, raw, beside)?,
        classified: if beside == Beside::Opacity { Classified::Opacity } else { Classified::No },
    })
}

fn interpolation(raw: RawInterpolation) -> Interpolation {
    match raw {
        RawInterpolation::Trilinear => Interpolation::Trilinear,
        RawInterpolation::CatmullRom => Interpolation::CatmullRom,
    }
}

pub(crate) fn check_clip(at: &At<'_>, raw: &RawClip) -> Result<Clip, Error> {
    match (raw.normal, raw.point, raw.bounds) {
        (Some(normal), Some(point), None) => {
            let normal = at.direction("normal", normal)?;
            Ok(Clip::HalfSpace { normal, offset: normal.dot(at.vector("point", point)?) })
        }
        (None, None, Some([low, high])) => Ok(Clip::Box(check_box(at, "box", "box", low, high)?)),
        _ => {
            let hint = "such as { normal = [0, 1, 0], point = [0, 0.5, 0] } or { box = [[-1, -1, -1], [1, 1, 1]] }";
            Err(at.error("expected either `normal` and `point`, or `box`", hint))
        }
    }
}
