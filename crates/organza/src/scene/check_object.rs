//! Checks of objects and their sources.

use super::check::{At, LARGEST, SMALLEST};
use super::check_field::{check_clip, check_isosurface, check_level_set, check_slice};
use super::check_light::check_half_axes;
use super::check_render::check_technique;
use super::paths::Paths;
use super::raw_object::{RawCloud, RawDensity, RawImplicit, RawObject, RawTransferPoint, RawTransform, RawUp};
use super::{
    CloudSource, DensitySource, ImplicitSource, MediumShape, RectangleSource, SceneMaterial, SceneObject, Source,
    Technique, Up, VolumeSource,
};
use crate::Error;
use convert::ExpressionField;
use convert::read::{UpAxis, up_axis};
use glam::{DQuat, DVec3};
use splat_core::{FootprintStack, Similarity, TransferFunction, TransferPoint, optics};

/// The keys that name a source.
const SOURCES: [&str; 12] = [
    "mesh",
    "volume",
    "points",
    "implicit",
    "isosurface",
    "level_set",
    "slice",
    "density",
    "cloud",
    "rectangle",
    "medium_box",
    "medium_ball",
];

/// Longest expression, bytes.
const LONGEST_EXPRESSION: usize = 4096;

/// What objects refer to.
pub(super) struct Named<'a> {
    pub(super) materials: &'a [SceneMaterial],
    pub(super) footprints: &'a FootprintStack,
    pub(super) paths: &'a Paths,
}

/// Checks one object whose material is known.
pub(super) fn check_object(
    at: &At<'_>,
    raw: RawObject,
    material: usize,
    named: &Named<'_>,
) -> Result<SceneObject, Error> {
    if raw.name.is_empty() || raw.name.len() > 256 {
        let message = format!("`name`: expected 1 to 256 bytes of text, found {}", raw.name.len());
        return Err(at.key("name").error(message, ""));
    }
    let fallback = named.materials[material].extinction;
    let source = check_source(at, &raw, fallback, named.paths)?;
    refuse_what_does_not_apply(at, &raw, &source)?;
    let footprints = named.footprints.layers().len();
    if raw.footprint as usize >= footprints {
        let message = format!("`footprint`: expected an index below {footprints}, found {}", raw.footprint);
        return Err(at.key("footprint").error(message, "`footprints` lists them, counted from 0"));
    }
    let up = match raw.transform.up {
        // An invisible object is not even read.
        RawUp::Auto if raw.visible == Some(false) => Up { axis: UpAxis::Y, by_file: false },
        RawUp::Auto => Up { axis: source.path().map_or(UpAxis::Y, up_axis), by_file: source.path().is_some() },
        RawUp::Y => Up { axis: UpAxis::Y, by_file: false },
        RawUp::Z => Up { axis: UpAxis::Z, by_file: false },
    };
    Ok(SceneObject {
        transform: check_transform(&at.key("transform"), &raw.transform, up.axis)?,
        up,
        source,
        material,
        color: raw.color.map(|c| at.color("color", c)).transpose()?,
        opacity: raw.opacity.map(|a| at.number("opacity", a, 0.0..=1.0)).transpose()?,
        clip: raw
            .clip
            .iter()
            .enumerate()
            .map(|(i, c)| check_clip(&at.key("clip").index(i), c))
            .collect::<Result<_, _>>()?,
        spacing: raw.spacing.map(|s| at.length("spacing", s)).transpose()?,
        shadow_coefficient: at.number("shadow_coefficient", raw.shadow_coefficient.unwrap_or(1.0), 0.0..=1.0)? as f32,
        casts_shadow: raw.casts_shadow.unwrap_or(true),
        visible: raw.visible.unwrap_or(true),
        footprint: raw.footprint as u8,
        merge_duplicates: raw.merge_duplicates,
        technique: check_own_technique(at, raw.technique.as_deref())?,
        name: raw.name,
    })
}

/// The technique that an object names; "auto" is that of the scene.
fn check_own_technique(at: &At<'_>, name: Option<&str>) -> Result<Option<Technique>, Error> {
    let named = name.map(|name| check_technique(at, name)).transpose()?;
    Ok(named.filter(|technique| *technique != Technique::Auto))
}

fn present(raw: &RawObject) -> [bool; 12] {
    [
        raw.mesh.is_some(),
        raw.volume.is_some(),
        raw.points.is_some(),
        raw.implicit.is_some(),
        raw.isosurface.is_some(),
        raw.level_set.is_some(),
        raw.slice.is_some(),
        raw.density.is_some(),
        raw.cloud.is_some(),
        raw.rectangle.is_some(),
        raw.medium_box.is_some(),
        raw.medium_ball.is_some(),
    ]
}

fn check_source(at: &At<'_>, raw: &RawObject, fallback: Option<f64>, paths: &Paths) -> Result<Source, Error> {
    let found: Vec<&str> = SOURCES.into_iter().zip(present(raw)).filter(|(_, on)| *on).map(|(name, _)| name).collect();
    let &[source] = found.as_slice() else {
        let found = if found.is_empty() { "none".to_owned() } else { found.join(" and ") };
        let message = format!("object `{}`: expected exactly one source, found {found}", crate::shown(&raw.name));
        return Err(at.error(message, format!("sources are {}", SOURCES.join(", "))));
    };
    let at_source = at.key(source);
    let extinction = |stated: Option<f64>| match stated.or(fallback) {
        Some(e) => at_source.number("extinction", e, 0.0..=LARGEST),
        None => Err(at_source
            .error("expected a key `extinction` here, found none", "or give its material a `medium.extinction`")),
    };
    if let Some(path) = &raw.mesh {
        return Ok(Source::Mesh(paths.resolve(&at_source, path)?));
    }
    if let Some(path) = &raw.points {
        return Ok(Source::Points(paths.resolve(&at_source, path)?));
    }
    if let Some(path) = &raw.volume {
        let path = paths.resolve(&at_source, path)?;
        return Ok(Source::Volume(VolumeSource { path, transfer: check_transfer(at, raw, false)? }));
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
    if let Some(slice) = &raw.slice {
        return check_slice(&at_source, slice, check_transfer(at, raw, true)?, paths).map(Source::Slice);
    }
    if let Some(density) = &raw.density {
        return check_density(&at_source, density, extinction(density.extinction)?).map(Source::Density);
    }
    if let Some(cloud) = &raw.cloud {
        return check_cloud(&at_source, cloud, extinction(cloud.extinction)?).map(Source::Cloud);
    }
    if let Some(r) = &raw.rectangle {
        let (u, v) = check_half_axes(&at_source, r.u, r.v)?;
        let spacing = at_source.spacing("spacing", r.spacing, 2.0 * u.length().max(v.length()))?;
        let center = at_source.vector("center", r.center)?;
        return Ok(Source::Rectangle(RectangleSource { center, u, v, spacing }));
    }
    if let Some(b) = &raw.medium_box {
        let (min, max) = check_box(&at_source, "min", "max", b.min, b.max)?;
        let spacing = at_source.spacing("spacing", b.spacing, (max - min).max_element())?;
        return Ok(Source::Medium(MediumShape::Box { min, max, extinction: extinction(b.extinction)?, spacing }));
    }
    let Some(b) = &raw.medium_ball else {
        return Err(Error::Internal("an object has a source of no kind".into()));
    };
    let radius = at_source.length("radius", b.radius)?;
    let spacing = at_source.spacing("spacing", b.spacing, 2.0 * radius)?;
    let center = at_source.vector("center", b.center)?;
    Ok(Source::Medium(MediumShape::Ball { center, radius, extinction: extinction(b.extinction)?, spacing }))
}

/// A key that would silently do nothing is an error.
fn refuse_what_does_not_apply(at: &At<'_>, raw: &RawObject, source: &Source) -> Result<(), Error> {
    let is_medium = matches!(source, Source::Volume(_) | Source::Density(_) | Source::Cloud(_) | Source::Medium(_));
    if is_medium && raw.opacity.is_some() {
        return Err(at.key("opacity").error("a medium has no `opacity`", "use its extinction"));
    }
    let has_own_spacing =
        matches!(source, Source::Density(_) | Source::Cloud(_) | Source::Medium(_) | Source::Rectangle(_));
    if has_own_spacing && raw.spacing.is_some() {
        return Err(at.key("spacing").error("this source states its own spacing", "move `spacing` into the source"));
    }
    let of_field = matches!(source, Source::Implicit(_) | Source::Isosurface(_) | Source::LevelSet(_));
    if !of_field && !raw.clip.is_empty() {
        return Err(at.key("clip").error("`clip` belongs to an `implicit`, `isosurface` or `level_set`", ""));
    }
    if raw.slice.is_some() && raw.unit_length.is_some() {
        return Err(at.key("unit_length").error("a slice has no extinction", "its `opacity` is that of one crossing"));
    }
    let colored = [(raw.volume.is_some(), "volume"), (raw.slice.is_some(), "slice")].into_iter().find(|c| c.0);
    if let (Some((_, what)), true) = (colored, raw.color.is_some()) {
        let message = format!("the colours of a {what} are those of its `transfer`");
        return Err(at.key("color").error(message, "change `color` in `transfer`"));
    }
    if raw.points.is_none() && raw.merge_duplicates {
        return Err(at.key("merge_duplicates").error("`merge_duplicates` belongs to `points`", ""));
    }
    if raw.volume.is_none() && raw.slice.is_none() {
        for (key, on) in [("transfer", raw.transfer.is_some()), ("unit_length", raw.unit_length.is_some())] {
            if on {
                return Err(at.key(key).error(format!("`{key}` belongs to a `volume` or `slice`"), ""));
            }
        }
    }
    Ok(())
}

/// A slice has colours alone.
fn check_transfer(at: &At<'_>, raw: &RawObject, colors_alone: bool) -> Result<TransferFunction, Error> {
    let Some(points) = &raw.transfer else {
        if colors_alone {
            let hint = "such as transfer = [{ value = 0, color = [0, 0, 0] }, { value = 1, color = [1, 1, 1] }]";
            return Err(at.error("a slice needs a key `transfer`, found none", hint));
        }
        let hint = "such as transfer = [{ value = 0, color = [1, 1, 1], extinction = 0 }, …]";
        return Err(at.error("a volume needs a key `transfer`, found none", hint));
    };
    let unit_length = raw.unit_length.map(|l| at.length("unit_length", l)).transpose()?;
    let at = at.key("transfer");
    let mut checked: Vec<TransferPoint> = Vec::with_capacity(points.len());
    for (i, p) in points.iter().enumerate() {
        let at = at.index(i);
        let value = at.number("value", p.value, -LARGEST..=LARGEST)? as f32;
        if checked.last().is_some_and(|before| value <= before.value) {
            let message = format!("`value`: expected more than that of the point before, found {}", p.value);
            return Err(at.key("value").error(message, "list the points by rising value"));
        }
        let extinction = if colors_alone {
            no_extinction(&at, p).map(|()| 0.0)?
        } else {
            point_extinction(&at, p, unit_length)? as f32
        };
        checked.push(TransferPoint { value, color: at.color("color", p.color)?, extinction });
    }
    TransferFunction::new(checked).map_err(|e| at.error(e.to_string(), ""))
}

fn no_extinction(at: &At<'_>, p: &RawTransferPoint) -> Result<(), Error> {
    for (key, on) in [("extinction", p.extinction.is_some()), ("opacity", p.opacity.is_some())] {
        if on {
            return Err(at.key(key).error("a slice has no extinction", "its `opacity` is that of one crossing"));
        }
    }
    Ok(())
}

fn point_extinction(at: &At<'_>, p: &RawTransferPoint, unit_length: Option<f64>) -> Result<f64, Error> {
    match (p.extinction, p.opacity) {
        (Some(extinction), None) => at.number("extinction", extinction, 0.0..=LARGEST),
        (None, Some(opacity)) => {
            if !(0.0..1.0).contains(&opacity) {
                let message = format!("`opacity`: expected a number from 0 to below 1, found {opacity}");
                return Err(at.key("opacity").error(message, ""));
            }
            let Some(unit_length) = unit_length else {
                let hint = "the world length over which a point has its opacity";
                return Err(at.key("opacity").error("`opacity` needs the object's `unit_length`, found none", hint));
            };
            at.number("opacity", optics::optical_depth(opacity) / unit_length, 0.0..=LARGEST)
        }
        (Some(_), Some(_)) => {
            Err(at.key("opacity").error("expected one of `extinction` and `opacity`, found both", ""))
        }
        (None, None) => Err(at.error("expected a key `extinction` or `opacity` here, found neither", "")),
    }
}

fn check_box<'a>(
    at: &At<'a>,
    min_key: &'a str,
    max_key: &'a str,
    min: [f64; 3],
    max: [f64; 3],
) -> Result<(DVec3, DVec3), Error> {
    let (low, high) = (at.vector(min_key, min)?, at.vector(max_key, max)?);
    if !low.cmplt(high).all() {
        let message = format!("expected a highest corner above the lowest in all axes, found {min:?} and {max:?}");
        return Err(at.key(max_key).error(message, ""));
    }
    Ok((low, high))
}

/// Checks an expression's region and how finely it is sampled.
fn check_region(
    at: &At<'_>,
    expression: &str,
    bounds: [[f64; 3]; 2],
    resolution: Option<u32>,
    spacing: Option<f64>,
) -> Result<([DVec3; 2], f64), Error> {
    if expression.trim().is_empty() || expression.len() > LONGEST_EXPRESSION {
        let message = format!(
            "`expression`: expected 1 to {LONGEST_EXPRESSION} bytes in x, y and z, found {}",
            expression.trim().len()
        );
        return Err(at.key("expression").error(message, ""));
    }
    ExpressionField::parse(expression).map_err(|e| {
        let found = crate::shown(&e.found);
        let message = format!("`expression`, column {}: expected {}, found {found}", e.column, e.expected);
        let hint = e.hint.strip_prefix("; ").unwrap_or("variables are x, y and z");
        at.key("expression").error_in_text(expression, e.column, message, hint)
    })?;
    let (low, high) = check_box(at, "box", "box", bounds[0], bounds[1])?;
    let longest = (high - low).max_element();
    let spacing = match (resolution, spacing) {
        (Some(n), None) => longest / f64::from(at.whole("resolution", n, 1..=16384)?),
        (None, Some(spacing)) => at.spacing("spacing", spacing, longest)?,
        (Some(_), Some(_)) => {
            return Err(at.key("spacing").error("expected one of `resolution` and `spacing`, found both", ""));
        }
        (None, None) => return Err(at.error("expected a key `resolution` or `spacing` here, found neither", "")),
    };
    Ok(([low, high], spacing))
}

fn check_implicit(at: &At<'_>, raw: &RawImplicit) -> Result<ImplicitSource, Error> {
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

/// Turns `up`, then rotates around x, y and z in this order.
fn check_transform(at: &At<'_>, raw: &RawTransform, up: UpAxis) -> Result<Similarity, Error> {
    let angles = at.vector("rotate", raw.rotate)?.map(f64::to_radians);
    // Extrinsic x, y, z is intrinsic z, y, x.
    let rotation = turned(DVec3::Z, angles.z) * turned(DVec3::Y, angles.y) * turned(DVec3::X, angles.x);
    let up = match up {
        UpAxis::Y => DQuat::IDENTITY,
        UpAxis::Z => turned(DVec3::X, -std::f64::consts::FRAC_PI_2),
    };
    Ok(Similarity {
        scale: at.length("scale", raw.scale.unwrap_or(1.0))?,
        rotation: (rotation * up).normalize(),
        translation: at.vector("translate", raw.translate)?,
    })
}

/// A turn about an axis, radians, with the same bits on every system, which glam's own has not.
fn turned(axis: DVec3, angle: f64) -> DQuat {
    let (sin, cos) = libm::sincos(0.5 * angle);
    let v = axis * sin;
    DQuat::from_xyzw(v.x, v.y, v.z, cos)
}
