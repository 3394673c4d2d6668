//! Checks of the source of an object.

use crate::at::At;
use crate::light::check::check_half_axes;
use crate::limits::{LARGEST, SMALLEST};
use crate::object::points_raw::RawPointForm;
use crate::object::raw::RawObject;
use crate::paths::Paths;
use crate::source::extract::check_extract;
use crate::source::field::{check_combined, check_isosurface, check_level_set, check_slice};
use crate::source::raw::{RawCloud, RawDensity, RawImplicit, RawMediumBall, RawMediumBox, RawPart, RawRectangle};
use crate::source::transfer::{Beside, beside_of_points, check_transfer};
use crate::{CloudSource, DensitySource, Error, ImplicitSource, MatterSource, Source, VolumeSource, shown};
use convert::{HomogeneousMedium, MediumBody, Rectangle};
use field::{Combination, ExpressionField};
use glam::DVec3;
use splat_core::DAabb;
use std::path::PathBuf;

/// The keys that name a source.
const SOURCES: [&str; 16] = [
    "mesh",
    "volume",
    "points",
    "extract",
    "implicit",
    "isosurface",
    "level_set",
    "union",
    "intersection",
    "difference",
    "slice",
    "density",
    "cloud",
    "rectangle",
    "medium_box",
    "medium_ball",
];

/// Longest expression, bytes.
const LONGEST_EXPRESSION: usize = 4096;

fn present(raw: &RawObject) -> [bool; 16] {
    [
        raw.mesh.is_some(),
        raw.volume.is_some(),
        raw.points.is_some(),
        raw.extract.is_some(),
        raw.implicit.is_some(),
        raw.isosurface.is_some(),
        raw.level_set.is_some(),
        raw.union.is_some(),
        raw.intersection.is_some(),
        raw.difference.is_some(),
        raw.slice.is_some(),
        raw.density.is_some(),
        raw.cloud.is_some(),
        raw.rectangle.is_some(),
        raw.medium_box.is_some(),
        raw.medium_ball.is_some(),
    ]
}

/// Checks that an object has one source, and that one; `fallback` is the extinction that its material gives media.
pub(crate) fn check_source(
    at: &At<'_>,
    raw: &RawObject,
    fallback: Option<f64>,
    paths: &Paths,
) -> Result<Source, Error> {
    let found: Vec<&str> = SOURCES.into_iter().zip(present(raw)).filter(|(_, on)| *on).map(|(name, _)| name).collect();
    let &[source] = found.as_slice() else {
        let found = if found.is_empty() { "none".to_owned() } else { found.join(" and ") };
        let message = format!("object `{}`: expected exactly one source, found {found}", shown(&raw.name));
        return Err(at.error(message, format!("sources are {}", SOURCES.join(", "))));
    };
    let at_source = at.key(source);
    let extinction = |stated: Option<f64>| check_extinction(&at_source, stated.or(fallback));
    if let Some(path) = &raw.mesh {
        return Ok(Source::Mesh(paths.resolve(&at_source, path)?));
    }
    if let Some(path) = &raw.points {
        return check_raw_points(at, raw, paths.resolve(&at_source, path)?, fallback);
    }
    if let Some(extract) = &raw.extract {
        return check_extract(&at_source, extract).map(Source::Extract);
    }
    if let Some(path) = &raw.volume {
        let path = paths.resolve(&at_source, path)?;
        let frame = raw.frame.unwrap_or(0).into();
        let transfer = check_transfer(at, raw, Beside::Extinction)?;
        return Ok(Source::Volume(VolumeSource { path, frame, transfer, block: 1 }));
    }
    if let Some(implicit) = &raw.implicit {
        return check_implicit(&at_source, implicit).map(Source::Implicit);
    }
    if let Some(isosurface) = &raw.isosurface {
        return check_isosurface(&at_source, isosurface, paths).map(Source::Isosurface);
    }
    if let Some(level_set) = &raw.level_set {
        return check_level_set(&at_source, level_set, paths).map(Source::LevelSet);
    }
    if let Some((parts, combination)) = solids(raw) {
        return check_combined(&at_source, combination, parts, paths).map(Source::Combined);
    }
    if let Some(slice) = &raw.slice {
        return check_slice(&at_source, slice, check_transfer(at, raw, Beside::Nothing)?, paths).map(Source::Slice);
    }
    if let Some(density) = &raw.density {
        return check_density(&at_source, density, extinction(density.extinction)?).map(Source::Density);
    }
    if let Some(cloud) = &raw.cloud {
        return check_cloud(&at_source, cloud, extinction(cloud.extinction)?).map(Source::Cloud);
    }
    if let Some(r) = &raw.rectangle {
        return check_rectangle(&at_source, r).map(Source::Rectangle);
    }
    if let Some(b) = &raw.medium_box {
        return check_medium_box(&at_source, b, fallback).map(Source::Medium);
    }
    let Some(b) = &raw.medium_ball else {
        return Err(Error::Internal("an object has a source of no kind".into()));
    };
    check_medium_ball(&at_source, b, fallback).map(Source::Medium)
}

/// The solids that become one, and how.
fn solids(raw: &RawObject) -> Option<(&[RawPart], Combination)> {
    let keys = [
        (&raw.union, Combination::Union),
        (&raw.intersection, Combination::Intersection),
        (&raw.difference, Combination::Difference),
    ];
    keys.into_iter().find_map(|(parts, how)| Some((parts.as_deref()?, how)))
}

/// Points as samples of a surface, or as matter.
fn check_raw_points(at: &At<'_>, raw: &RawObject, path: PathBuf, fallback: Option<f64>) -> Result<Source, Error> {
    if raw.form != Some(RawPointForm::Medium) {
        return Ok(Source::Points(path));
    }
    let extinction = check_matter_extinction(at, raw, fallback)?;
    Ok(Source::Matter(MatterSource { path, extinction }))
}

/// The extinction of points that are a medium; 1 where their `transfer` says what that is.
fn check_matter_extinction(at: &At<'_>, raw: &RawObject, fallback: Option<f64>) -> Result<f64, Error> {
    match (beside_of_points(raw, true), raw.extinction) {
        (Beside::Extinction, None) => Ok(1.0),
        (Beside::Extinction, Some(_)) => {
            let message = "`extinction` and those of the object's `transfer` exclude each other";
            Err(at.key("extinction").error(message, "leave one of them out"))
        }
        (_, stated) => check_extinction(at, stated.or(fallback)),
    }
}

fn check_extinction(at: &At<'_>, extinction: Option<f64>) -> Result<f64, Error> {
    match extinction {
        Some(e) => at.number("extinction", e, 0.0..=LARGEST),
        None => {
            Err(at.error("expected a key `extinction` here, found none", "or give its material a `medium.extinction`"))
        }
    }
}

fn check_rectangle(at: &At<'_>, raw: &RawRectangle) -> Result<Rectangle, Error> {
    let (u, v) = check_half_axes(at, raw.u, raw.v)?;
    let spacing = at.spacing("spacing", raw.spacing, 2.0 * u.length().max(v.length()))?;
    Ok(Rectangle { center: at.vector("center", raw.center)?, u, v, spacing })
}

fn check_medium_box(at: &At<'_>, raw: &RawMediumBox, fallback: Option<f64>) -> Result<HomogeneousMedium, Error> {
    let bounds = check_box(at, "min", "max", raw.min, raw.max)?;
    let spacing = at.spacing("spacing", raw.spacing, bounds.size().max_element())?;
    let extinction = check_extinction(at, raw.extinction.or(fallback))?;
    Ok(HomogeneousMedium { body: MediumBody::Box(bounds), extinction, spacing })
}

fn check_medium_ball(at: &At<'_>, raw: &RawMediumBall, fallback: Option<f64>) -> Result<HomogeneousMedium, Error> {
    let radius = at.length("radius", raw.radius)?;
    let spacing = at.spacing("spacing", raw.spacing, 2.0 * radius)?;
    let center = at.vector("center", raw.center)?;
    let extinction = check_extinction(at, raw.extinction.or(fallback))?;
    Ok(HomogeneousMedium { body: MediumBody::Ball { center, radius }, extinction, spacing })
}

/// A box between two corners, the lowest and the highest.
pub(crate) fn check_box<'a>(
    at: &At<'a>,
    min_key: &'a str,
    max_key: &'a str,
    min: [f64; 3],
    max: [f64; 3],
) -> Result<DAabb, Error> {
    let low = at.vector(min_key, min)?;
    let high = at.vector(max_key, max)?;
    if !low.cmplt(high).all() {
        let message = format!("expected a highest corner above the lowest in all axes, found {min:?} and {max:?}");
        return Err(at.key(max_key).error(message, ""));
    }
    Ok(DAabb::new(low, high))
}

/// Checks an expression's region and how finely it is sampled.
fn check_region(
    at: &At<'_>,
    expression: &str,
    bounds: [[f64; 3]; 2],
    resolution: Option<u32>,
    spacing: Option<f64>,
) -> Result<(DAabb, f64), Error> {
    if expression.trim().is_empty() || expression.len() > LONGEST_EXPRESSION {
        let message = format!(
            "`expression`: expected 1 to {LONGEST_EXPRESSION} bytes in x, y and z, found {}",
            expression.trim().len()
        );
        return Err(at.key("expression").error(message, ""));
    }
    ExpressionField::parse(expression).map_err(|e| {
        let found = shown(&e.found);
        let message = format!("`expression`, column {}: expected {}, found {found}", e.column, e.expected);
        let hint = e.hint.strip_prefix("; ").unwrap_or("variables are x, y and z");
        at.key("expression").error_in_text(expression, e.column, message, hint)
    })?;
    let bounds = check_box(at, "box", "box", bounds[0], bounds[1])?;
    let longest = bounds.size().max_element();
    let spacing = match (resolution, spacing) {
        (Some(n), None) => longest / f64::from(at.whole("resolution", n, 1..=16384)?),
        (None, Some(spacing)) => at.spacing("spacing", spacing, longest)?,
        (Some(_), Some(_)) => {
            return Err(at.key("spacing").error("expected one of `resolution` and `spacing`, found both", ""));
        }
        (None, None) => return Err(at.error("expected a key `resolution` or `spacing` here, found neither", "")),
    };
    Ok((bounds, spacing))
}

pub(crate) fn check_implicit(at: &At<'_>, raw: &RawImplicit) -> Result<ImplicitSource, Error> {
    let (bounds, spacing) = check_region(at, &raw.expression, raw.bounds, raw.resolution, raw.spacing)?;
    Ok(ImplicitSource { expression: raw.expression.clone(), bounds, spacing })
}

fn check_density(at: &At<'_>, raw: &RawDensity, extinction: f64) -> Result<DensitySource, Error> {
    let (bounds, spacing) = check_region(at, &raw.expression, raw.bounds, raw.resolution, raw.spacing)?;
    Ok(DensitySource { expression: raw.expression.clone(), bounds, spacing, extinction })
}

fn check_cloud(at: &At<'_>, raw: &RawCloud, extinction: f64) -> Result<CloudSource, Error> {
    if raw.ellipsoids.is_empty() {
        return Err(at.key("ellipsoids").error("expected at least one ellipsoid, found none", ""));
    }
    let mut ellipsoids = Vec::with_capacity(raw.ellipsoids.len());
    for (i, e) in raw.ellipsoids.iter().enumerate() {
        let at = at.key("ellipsoids").index(i);
        for radius in e.radii {
            at.length("radii", radius)?;
        }
        ellipsoids.push((at.vector("center", e.center)?, DVec3::from_array(e.radii)));
    }
    let longest = ellipsoids.iter().map(|(_, radii)| 2.0 * radii.max_element()).fold(0.0, f64::max);
    Ok(CloudSource {
        ellipsoids,
        octaves: at.whole("octaves", raw.octaves.unwrap_or(5), 1..=16)?,
        frequency: at.number("frequency", raw.frequency.unwrap_or(1.0), SMALLEST..=LARGEST)?,
        amplitude: at.number("amplitude", raw.amplitude.unwrap_or(0.5), 0.0..=100.0)?,
        seed: raw.seed,
        spacing: at.spacing("spacing", raw.spacing, longest)?,
        extinction,
    })
}
