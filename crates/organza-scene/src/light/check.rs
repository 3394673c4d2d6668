//! Checks of lights.

use crate::at::At;
use crate::light::raw::{RawLight, RawLightShadow};
use crate::light::slide::{SlideKeys, check_slide};
use crate::limits::{LARGEST, MOST_SHADOW_CELLS, SMALLEST};
use crate::paths::Paths;
use crate::render::raw::Whole;
use crate::{Error, SceneLight, shown};
use glam::DVec3;
use splat_core::{Light, LightShape};
use std::collections::HashMap;

/// Most points that an extended light may be taken for.
const MOST_LIGHT_SAMPLES: u32 = 1_000_000;

/// Points that the plan takes an extended light for.
const SAMPLES: u32 = 16;

/// Checks all lights.
pub(crate) fn check_lights(at_lights: &At<'_>, raw: &[RawLight], paths: &Paths) -> Result<Vec<SceneLight>, Error> {
    let mut first_of: HashMap<&str, usize> = HashMap::new();
    let mut lights = Vec::with_capacity(raw.len());
    for (i, light) in raw.iter().enumerate() {
        let at = at_lights.index(i);
        if let Some(name) = light.name() {
            check_name(&at, name)?;
            if let Some(first) = first_of.insert(name, i) {
                let first = at_lights.index(first).key("name").name();
                let message = format!("duplicate light name `{}`, first at {first}", shown(name));
                return Err(at.key("name").error(message, "each light that has a name needs one of its own"));
            }
        }
        let label = light.name().map_or_else(|| i.to_string(), str::to_owned);
        let shadow_cells = check_shadow_cells(&at, &light.shadow())?;
        lights.push(SceneLight { label, shadow_cells, ..check_light(&at, light, paths)? });
    }
    Ok(lights)
}

/// Refuses names that an effect could not be called by.
fn check_name(at: &At<'_>, name: &str) -> Result<(), Error> {
    let is_index = name.chars().all(|c| c.is_ascii_digit());
    if is_index {
        let message = format!("`name`: expected a name with a letter in it, found \"{}\"", shown(name));
        return Err(at.key("name").error(message, "a light without a name is called by its index"));
    }
    Ok(())
}

fn check_shadow_cells(at: &At<'_>, shadow: &RawLightShadow) -> Result<Option<u32>, Error> {
    let Some(cells) = shadow.cells else { return Ok(None) };
    if !shadow.is_cast {
        let message = "`shadow_cells` beside `shadow = false`: this light has no shadow map".to_owned();
        return Err(at.key("shadow_cells").error(message, "leave one of them out"));
    }
    at.whole("shadow_cells", cells, 1..=MOST_SHADOW_CELLS).map(Some)
}

/// Checks one light, without its label and the cells of its shadow map.
fn check_light(at: &At<'_>, raw: &RawLight, paths: &Paths) -> Result<SceneLight, Error> {
    let scene_light = |shape, intensity, shadow| SceneLight {
        label: String::new(),
        light: Light { shape, intensity },
        slide: None,
        samples: 1,
        states_samples: false,
        shadow,
        shadow_cells: None,
    };
    let extended = |shape, intensity, samples, shadow| {
        let stated = Whole::stated(samples);
        let samples = at.whole("samples", stated.unwrap_or(SAMPLES), 1..=MOST_LIGHT_SAMPLES)?;
        let light = scene_light(shape, at.color("intensity", intensity)?, shadow);
        Ok(SceneLight { samples, states_samples: stated.is_some(), ..light })
    };
    match *raw {
        RawLight::Point { position, intensity, shadow, .. } => {
            let position = at.vector("position", position)?;
            Ok(scene_light(LightShape::Point { position }, at.color("intensity", intensity)?, shadow))
        }
        RawLight::Directional { direction, irradiance, shadow, .. } => {
            let shape = LightShape::Directional { direction: at.direction("direction", direction)? };
            let slide = check_slide(at, &slide_keys(raw), &shape, paths)?;
            Ok(SceneLight { slide, ..scene_light(shape, at.color("irradiance", irradiance)?, shadow) })
        }
        RawLight::Spot { intensity, shadow, .. } => {
            let shape = spot_shape(at, raw)?;
            let slide = check_slide(at, &slide_keys(raw), &shape, paths)?;
            Ok(SceneLight { slide, ..scene_light(shape, at.color("intensity", intensity)?, shadow) })
        }
        RawLight::Sphere { position, radius, intensity, samples, shadow, .. } => {
            let center = at.vector("position", position)?;
            let radius = at.length("radius", radius)?;
            extended(LightShape::Sphere { center, radius }, intensity, samples, shadow)
        }
        RawLight::Disk { position, normal, radius, intensity, samples, shadow, .. } => {
            let center = at.vector("position", position)?;
            let normal = at.direction("normal", normal)?;
            let radius = at.length("radius", radius)?;
            extended(LightShape::Disk { center, normal, radius }, intensity, samples, shadow)
        }
        RawLight::Rect { position, u, v, intensity, samples, shadow, .. } => {
            let (u, v) = check_half_axes(at, u, v)?;
            let center = at.vector("position", position)?;
            extended(LightShape::Rect { center, u, v }, intensity, samples, shadow)
        }
    }
}

fn slide_keys(raw: &RawLight) -> SlideKeys<'_> {
    let (texture, up, width, center) = match raw {
        RawLight::Spot { texture, texture_up, texture_angle, .. } => {
            (texture, *texture_up, ("texture_angle", *texture_angle), None)
        }
        RawLight::Directional { texture, texture_up, texture_width, texture_center, .. } => {
            (texture, *texture_up, ("texture_width", *texture_width), *texture_center)
        }
        _ => (&None, None, ("texture_width", None), None),
    };
    SlideKeys { texture: texture.as_deref(), up, width, center }
}

fn spot_shape(at: &At<'_>, raw: &RawLight) -> Result<LightShape, Error> {
    let RawLight::Spot { position, target, direction, inner, outer, .. } = *raw else {
        return Err(Error::Internal("a spot light was expected".into()));
    };
    let position = at.vector("position", position)?;
    let direction = match (target, direction) {
        (Some(target), None) => {
            let target = at.vector("target", target)?;
            at.direction("target", (target - position).to_array())?
        }
        (None, Some(direction)) => at.direction("direction", direction)?,
        (Some(_), Some(_)) => {
            return Err(at.key("direction").error("expected one of `target` and `direction`, found both", ""));
        }
        (None, None) => return Err(at.error("expected a key `target` or `direction` here, found neither", "")),
    };
    if !(outer > 0.0 && outer < 90.0) {
        let message = format!("`outer`: expected degrees between 0 and 90, found {}", crate::short(outer));
        return Err(at.key("outer").error(message, "it is half of the cone's angle"));
    }
    let inner = at.number("inner", inner, 0.0..=outer)?;
    Ok(LightShape::Spot { position, direction, inner: inner.to_radians(), outer: outer.to_radians() })
}

/// Two half-axes that span a parallelogram.
pub(crate) fn check_half_axes(at: &At<'_>, u: [f64; 3], v: [f64; 3]) -> Result<(DVec3, DVec3), Error> {
    let u_unit = at.direction("u", u)?;
    let v_unit = at.direction("v", v)?;
    if u_unit.cross(v_unit).length() < 1e-9 {
        let message = format!("`v`: expected a direction that is not parallel to `u`, found {v:?}");
        return Err(at.key("v").error(message, ""));
    }
    let u = DVec3::from_array(u);
    let v = DVec3::from_array(v);
    at.number("u", u.length(), SMALLEST..=LARGEST)?;
    at.number("v", v.length(), SMALLEST..=LARGEST)?;
    Ok((u, v))
}
