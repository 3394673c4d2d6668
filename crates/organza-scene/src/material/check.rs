//! Checks of materials and of references to them.

use crate::at::At;
use crate::footprint::check::check_footprint;
use crate::limits::{LARGEST, SMALLEST};
use crate::material::raw::{RawBump, RawMaterial, RawShading, RawSurfaceOpacity};
use crate::object::points_raw::RawPointForm;
use crate::object::raw::RawObject;
use crate::paths::Paths;
use crate::text::de::suggest;
use crate::{Error, SceneMaterial, shown};
use splat_core::optics::{SurfaceOpacity, absorption_coefficient};
use splat_core::{Bump, FootprintStack, Material, Shading};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// The default material, then all of the file in order of name.
pub(crate) fn check_materials<'a>(
    at: &At<'a>,
    raw: &'a BTreeMap<String, RawMaterial>,
    paths: &Paths,
    footprints: &FootprintStack,
) -> Result<Vec<SceneMaterial>, Error> {
    if raw.len() > usize::from(u16::MAX) {
        return Err(at.error(format!("expected at most {} materials, found {}", u16::MAX, raw.len()), ""));
    }
    let default = SceneMaterial {
        name: String::new(),
        material: Material::default(),
        color: [1.0; 3],
        opacity: 1.0,
        extinction: None,
        bump_image: None,
        footprint: None,
    };
    let mut materials = vec![default];
    for (name, material) in raw {
        let at = at.key(name);
        let footprint_id = |id: u32| check_footprint(&at.key("footprint"), f64::from(id), footprints);
        let footprint = material.footprint.map(footprint_id).transpose()?;
        materials.push(SceneMaterial { footprint, ..check_material(&at, name, material, paths)? });
    }
    Ok(materials)
}

/// The error of an object whose material is not there.
pub(crate) fn unknown_material(at: &At<'_>, at_materials: &At<'_>, name: &str, materials: &[SceneMaterial]) -> Error {
    let known: Vec<&str> = materials.iter().skip(1).map(|m| m.name.as_str()).collect();
    let hint = match (known.is_empty(), suggest(name, &known)) {
        (true, _) => format!("add a table [material.{}]", shown(name)),
        (false, hint) => {
            let near = known.iter().find(|k| hint == format!("did you mean `{}`?", shown(k)));
            let place = near.map(|k| format!(" It is defined at {}.", at_materials.key(k).name()));
            hint + &place.unwrap_or_default()
        }
    };
    at.error(format!("material `{}` is not defined", shown(name)), hint)
}

/// The materials that an object lists, which its points choose among; empty where it lists none.
pub(crate) fn check_listed(
    at: &At<'_>,
    object: &RawObject,
    materials: &[SceneMaterial],
    of_name: impl Fn(&At<'_>, &str) -> Result<usize, Error>,
) -> Result<Vec<usize>, Error> {
    let Some(names) = &object.materials else { return Ok(Vec::new()) };
    let at = at.key("materials");
    if object.points.is_none() || object.form == Some(RawPointForm::Medium) {
        let hint = "a column `material` of points that are surfaces chooses among them; else name one `material`";
        return Err(at.error("`materials` belongs to `points` that are surfaces", hint));
    }
    let excluded = [("material", object.material.is_some()), ("unlit", object.unlit.is_some())];
    if let Some((key, _)) = excluded.iter().find(|(_, on)| *on) {
        return Err(at.error(format!("`materials` and `{key}` exclude each other"), "leave one of them out"));
    }
    if names.is_empty() || names.len() > usize::from(u16::MAX) {
        return Err(at.error(format!("`materials`: expected 1 to {} names, found {}", u16::MAX, names.len()), ""));
    }
    let ids = names.iter().enumerate().map(|(i, name)| {
        let at = at.index(i);
        let id = of_name(&at, name)?;
        let SceneMaterial { material, footprint, .. } = &materials[id];
        let of_one = [
            ("bounds matter", material.bounds_matter()),
            ("has bumps", material.bump.height > 0.0),
            ("names a footprint", footprint.is_some()),
        ];
        match of_one.iter().find(|(_, has)| *has) {
            Some((what, _)) => {
                let message = format!("material `{}` {what}, which is for all points of an object alike", shown(name));
                Err(at.error(message, "give those points an object and a `material` of their own, by `keep`"))
            }
            None => Ok(id),
        }
    });
    ids.collect()
}

fn check_material(at: &At<'_>, name: &str, raw: &RawMaterial, paths: &Paths) -> Result<SceneMaterial, Error> {
    let unit = |key, value: Option<f64>, default: f64| at.number(key, value.unwrap_or(default), 0.0..=1.0);
    let (extinction, extinction_rgb) = check_extinction(at, raw)?;
    let medium = raw.medium.as_ref();
    let at_medium = at.key("medium");
    let albedo = medium.and_then(|m| m.albedo).unwrap_or(if raw.absorption.is_some() { 0.0 } else { 1.0 });
    let asymmetry = medium.and_then(|m| m.asymmetry).unwrap_or(0.0);
    if asymmetry.abs() >= 1.0 {
        let message = format!("`asymmetry`: expected a number between -1 and 1, found {}", crate::short(asymmetry));
        return Err(at_medium.key("asymmetry").error(message, ""));
    }
    let bump = raw.bump.as_ref().map(|bump| check_bump(&at.key("bump"), bump, paths)).transpose()?;
    let (bump, bump_image) = bump.unwrap_or_default();
    let material = Material {
        shading: match raw.shading {
            Some(RawShading::Phong) => Shading::Phong,
            Some(RawShading::Phase) => Shading::Phase,
            Some(RawShading::Unlit) => Shading::Unlit,
            None if medium.is_some() => Shading::Phase,
            None => Shading::Phong,
        },
        ambient: at.number("ambient", raw.ambient.unwrap_or(1.0), 0.0..=LARGEST)? as f32,
        diffuse: unit("diffuse", raw.diffuse, 1.0)? as f32,
        specular: unit("specular", raw.specular, 0.0)? as f32,
        shininess: at.number("shininess", raw.shininess.unwrap_or(32.0), 0.0..=1e6)? as f32,
        transmission: unit("transmission", raw.transmission, 0.0)? as f32,
        single_scattering_albedo: at_medium.number("albedo", albedo, 0.0..=1.0)? as f32,
        asymmetry: asymmetry as f32,
        emission: at.color("emission", raw.emission)?,
        extinction_rgb,
        surface_opacity: match raw.surface_opacity {
            RawSurfaceOpacity::PerCrossing => SurfaceOpacity::PerCrossing,
            RawSurfaceOpacity::ThinSlab => SurfaceOpacity::ThinSlab,
        },
        index: check_index(at, raw)?,
        absorption_inside: at.color("absorption_inside", raw.absorption_inside.unwrap_or_default())?,
        bump,
    };
    // Matter that bends light is clear where nothing else is said.
    let opacity = if material.bounds_matter() { 0.0 } else { 1.0 };
    Ok(SceneMaterial {
        name: name.to_owned(),
        material,
        color: at.color("color", raw.color.unwrap_or([1.0; 3]))?,
        opacity: unit("opacity", raw.opacity, opacity)?,
        extinction,
        bump_image,
        footprint: None,
    })
}

/// Bumps, and the image that has their heights where it is no noise.
fn check_bump(at: &At<'_>, raw: &RawBump, paths: &Paths) -> Result<(Bump, Option<PathBuf>), Error> {
    let height = at.number("height", raw.height, 0.0..=LARGEST)? as f32;
    let size = at.length("size", raw.size)? as f32;
    let Some(image) = &raw.image else {
        let octaves = at.whole("octaves", raw.octaves.unwrap_or(4), 1..=12)?;
        return Ok((Bump { height, size, octaves, seed: raw.seed.unwrap_or(0).into() }, None));
    };
    let of_noise = [("octaves", raw.octaves.is_some()), ("seed", raw.seed.is_some())];
    if let Some((key, _)) = of_noise.iter().find(|(_, is_there)| *is_there) {
        let message = format!("`{key}` belongs to noise, and an `image` is named");
        return Err(at.key(key).error(message, "leave one of both out"));
    }
    let image = paths.resolve(&at.key("image"), image)?;
    Ok((Bump { height, size, octaves: 0, seed: 0 }, Some(image)))
}

/// Dominant wavelengths of the primaries of Rec.709, µm.
const WAVELENGTHS: [f64; 3] = [0.6114, 0.5491, 0.4642];

/// The refractive index per channel, where there is one.
fn check_index(at: &At<'_>, raw: &RawMaterial) -> Result<Option<[f32; 3]>, Error> {
    let Some(cauchy) = &raw.cauchy else {
        let index = raw.ior.map(|ior| at.number("ior", ior, 0.1..=10.0)).transpose()?;
        return Ok(index.map(|index| [index as f32; 3]));
    };
    if raw.ior.is_some() {
        return Err(at.key("ior").error("expected one of `ior` and `cauchy`, found both", "`cauchy` gives the index"));
    }
    let at = at.key("cauchy");
    let a = at.number("a", cauchy.a, 0.1..=10.0)?;
    let b = at.number("b", cauchy.b, 0.0..=1.0)?;
    Ok(Some(WAVELENGTHS.map(|wavelength| (a + b / (wavelength * wavelength)) as f32)))
}

/// Extinction of a medium, and its ratio per channel.
fn check_extinction(at: &At<'_>, raw: &RawMaterial) -> Result<(Option<f64>, [f32; 3]), Error> {
    let stated = raw.medium.as_ref().and_then(|m| m.extinction);
    let Some(absorption) = &raw.absorption else {
        let rgb = at.colors_up_to("extinction_rgb", raw.extinction_rgb.unwrap_or([1.0; 3]), 1e6)?;
        let extinction = stated.map(|e| at.key("medium").number("extinction", e, 0.0..=LARGEST)).transpose()?;
        return Ok((extinction, rgb));
    };
    if raw.extinction_rgb.is_some() {
        let message = "expected one of `absorption` and `extinction_rgb`, found both";
        return Err(at.key("extinction_rgb").error(message, "`absorption` gives the ratio of the channels"));
    }
    if stated.is_some() {
        let message = "expected one of `absorption` and `medium.extinction`, found both";
        return Err(at.key("medium").key("extinction").error(message, "`absorption` gives the extinction"));
    }
    let at = at.key("absorption");
    let mut per_channel = [0.0; 3];
    for (c, coefficient) in per_channel.iter_mut().enumerate() {
        let kappa = at.number("kappa", absorption.kappa[c], 0.0..=LARGEST)?;
        let wavelength = at.number("wavelength", absorption.wavelength[c], SMALLEST..=LARGEST)?;
        *coefficient = absorption_coefficient(kappa, wavelength);
    }
    let largest = per_channel.iter().copied().fold(0.0, f64::max);
    if !(SMALLEST..=LARGEST).contains(&largest) {
        let message = format!("expected a largest 4πκ/λ from {SMALLEST:e} to {LARGEST:e}, found {largest}");
        return Err(at.key("kappa").error(message, ""));
    }
    Ok((Some(largest), per_channel.map(|a| (a / largest) as f32)))
}
