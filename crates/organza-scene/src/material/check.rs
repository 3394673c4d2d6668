//! Checks of materials and of references to them.

use crate::at::At;
use crate::footprint::check::check_footprint;
use crate::limits::{LARGEST, SMALLEST};
use crate::material::raw::{RawBump, RawMaterial, RawShading, RawSurfaceOpacity};
use crate::material::recipes::{Form, Recipe};
use crate::material::tint::Tint;
use crate::object::points_raw::RawPointForm;
use crate::object::raw::RawObject;
use crate::paths::Paths;
use crate::text::de::{nearest_name, suggest};
use crate::{Error, SceneMaterial, shown};
use splat_core::optics::{SurfaceOpacity, absorption_coefficient};
use splat_core::{Bump, FootprintStack, Material, Shading};
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

/// The materials of a scene, and how objects name them.
pub(crate) struct NamedMaterials {
    /// The default material, then all of the file in order of name, then those of media whose presets are those of surfaces too.
    pub(crate) list: Vec<SceneMaterial>,
    by_name: BTreeMap<String, ByForm>,
}

/// Which of the materials have a name.
struct ByForm {
    surface: Option<usize>,
    medium: Option<usize>,
    /// The preset that it is made of.
    preset: Option<&'static str>,
}

/// Checks all materials of the file, in the forms that these objects need.
pub(crate) fn check_materials<'a>(
    at: &At<'a>,
    raw: &'a BTreeMap<String, RawMaterial>,
    paths: &Paths,
    footprints: &FootprintStack,
    objects: &[RawObject],
) -> Result<NamedMaterials, Error> {
    let default = SceneMaterial {
        name: String::new(),
        material: Material::default(),
        color: [1.0; 3],
        opacity: 1.0,
        extinction: None,
        bump_image: None,
        footprint: None,
    };
    let mut list = vec![default];
    let mut by_name = BTreeMap::new();
    let check = |name: &'a str, material: &'a RawMaterial, form: Option<Form>| {
        let at = at.key(name);
        let footprint_id = |id: u32| check_footprint(&at.key("footprint"), f64::from(id), footprints);
        let footprint = material.footprint.map(footprint_id).transpose()?;
        let checked = match check_preset(&at, material)? {
            Some(Made { recipe, metre }) => {
                let form = form.unwrap_or(if recipe.is_of_surfaces() { Form::Surface } else { Form::Medium });
                let merged = material.over(&recipe.keys(form, metre));
                check_material(&at, name, &merged, Some(form), paths)?
            }
            None => check_material(&at, name, material, None, paths)?,
        };
        Ok::<_, Error>(SceneMaterial { footprint, ..checked })
    };
    for (name, material) in raw {
        let id = list.len();
        list.push(check(name, material, None)?);
        let recipe = check_preset(&at.key(name), material)?.map(|made| made.recipe);
        let has = |form| recipe.is_none_or(|recipe| recipe.has(form));
        by_name.insert(
            name.clone(),
            ByForm {
                surface: has(Form::Surface).then_some(id),
                medium: has(Form::Medium).then_some(id),
                preset: recipe.map(|recipe| recipe.name),
            },
        );
    }
    // A surface and a medium of the same preset have unlike keys, so there the name has two materials.
    let of_media =
        objects.iter().filter(|object| is_of_a_medium(object)).filter_map(|object| object.material.as_deref());
    let of_media: BTreeSet<&str> = of_media.collect();
    for (name, material) in raw.iter().filter(|(name, _)| of_media.contains(name.as_str())) {
        let Some(forms) = by_name.get_mut(name) else { continue };
        if forms.preset.is_some() && forms.surface.is_some() && forms.medium.is_some() {
            forms.medium = Some(list.len());
            list.push(check(name, material, Some(Form::Medium))?);
        }
    }
    if list.len() - 1 > usize::from(u16::MAX) {
        return Err(at.error(format!("expected at most {} materials, found {}", u16::MAX, list.len() - 1), ""));
    }
    Ok(NamedMaterials { list, by_name })
}

/// A preset that a material names, with the world units of a metre.
struct Made {
    recipe: &'static Recipe,
    metre: f64,
}

/// The preset of a material, if it names one.
fn check_preset(at: &At<'_>, raw: &RawMaterial) -> Result<Option<Made>, Error> {
    let Some(name) = &raw.preset else {
        return match raw.metre {
            None => Ok(None),
            Some(_) => {
                let message = "`metre` gives the lengths of a `preset`, and none is named";
                Err(at.key("metre").error(message, "leave it out, or name a `preset`"))
            }
        };
    };
    let recipe = Recipe::named(name).ok_or_else(|| {
        let known: Vec<&str> = Recipe::list().iter().map(|recipe| recipe.name).collect();
        let message = format!("`preset`: expected one of {}; found `{}`", known.join(", "), shown(name));
        let near = nearest_name(name, &known).map(|near| format!("did you mean `{near}`?"));
        at.key("preset").error(message, near.unwrap_or_default())
    })?;
    Ok(Some(Made { recipe, metre: at.number("metre", raw.metre.unwrap_or(1.0), METRES)? }))
}

/// World units that a metre may have: lengths of all presets stay in range.
const METRES: std::ops::RangeInclusive<f64> = 1e-12..=1e12;

/// Whether an object is a medium, by the keys that it has.
fn is_of_a_medium(object: &RawObject) -> bool {
    let is_matter = object.points.is_some() && object.form == Some(RawPointForm::Medium);
    let is_body = object.medium_box.is_some() || object.medium_ball.is_some();
    object.volume.is_some() || object.density.is_some() || object.cloud.is_some() || is_body || is_matter
}

impl NamedMaterials {
    /// The material that an object names.
    pub(crate) fn of_object(&self, at: &At<'_>, object: &RawObject, name: &str) -> Result<usize, Error> {
        let at_materials = At::root(at.document).key("material");
        let Some(forms) = self.by_name.get(name) else { return Err(self.unknown(at, &at_materials, name)) };
        let is_medium = is_of_a_medium(object);
        let found = if is_medium { forms.medium } else { forms.surface };
        found.ok_or_else(|| {
            let form = if is_medium { Form::Medium } else { Form::Surface };
            let fits: Vec<&str> = Recipe::list().iter().filter(|recipe| recipe.has(form)).map(|r| r.name).collect();
            let preset = forms.preset.unwrap_or_default();
            let [needed, is] = if is_medium { ["surfaces", "a medium"] } else { ["media", "a surface"] };
            let message =
                format!("material `{}` is `{preset}`, which {needed} alone have, and this is {is}", shown(name));
            at.error(message, format!("presets of {is} are {}", fits.join(", ")))
        })
    }

    /// The error of an object whose material is not there.
    fn unknown(&self, at: &At<'_>, at_materials: &At<'_>, name: &str) -> Error {
        let known: Vec<&str> = self.by_name.keys().map(String::as_str).collect();
        let hint = match (Recipe::named(name), known.is_empty(), suggest(name, &known)) {
            (Some(recipe), ..) => format!("add a table [material.{0}] with preset = \"{0}\"", recipe.name),
            (None, true, _) => format!("add a table [material.{}]", shown(name)),
            (None, false, hint) => {
                let near = known.iter().find(|k| hint == format!("did you mean `{}`?", shown(k)));
                let place = near.map(|k| format!(" It is defined at {}.", at_materials.key(k).name()));
                hint + &place.unwrap_or_default()
            }
        };
        at.error(format!("material `{}` is not defined", shown(name)), hint)
    }
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

/// Checks a material; `form` is that of its preset.
fn check_material(
    at: &At<'_>,
    name: &str,
    raw: &RawMaterial,
    form: Option<Form>,
    paths: &Paths,
) -> Result<SceneMaterial, Error> {
    let unit = |key, value: Option<f64>, default: f64| at.number(key, value.unwrap_or(default), 0.0..=1.0);
    let tint = raw.tint.map(|tint| check_tint(at, raw, tint)).transpose()?;
    let (extinction, extinction_rgb) = check_extinction(at, raw)?;
    let extinction_rgb = tint.map_or(extinction_rgb, |tint| tint.extinction_rgb.map(|ratio| ratio as f32));
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
            None if form.map_or(medium.is_some(), |form| form == Form::Medium) => Shading::Phase,
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
        absorption_inside: check_absorption_inside(at, raw)?,
        bump,
    };
    // Matter that bends light is clear where nothing else is said.
    let opacity = match tint {
        Some(tint) => tint.opacity,
        None if material.bounds_matter() => 0.0,
        None => 1.0,
    };
    let color = tint.map_or([1.0; 3], |tint| tint.color);
    Ok(SceneMaterial {
        name: name.to_owned(),
        material,
        color: at.color("color", raw.color.unwrap_or(color))?,
        opacity: unit("opacity", raw.opacity, opacity)?,
        extinction,
        bump_image,
        footprint: None,
    })
}

/// The surface of a tint.
fn check_tint(at: &At<'_>, raw: &RawMaterial, shares: [f64; 3]) -> Result<Tint, Error> {
    let others = [("extinction_rgb", raw.extinction_rgb.is_some()), ("absorption", raw.absorption.is_some())];
    if let Some((key, _)) = others.iter().find(|(_, is_there)| *is_there) {
        let message = format!("expected one of `tint` and `{key}`, found both");
        return Err(at.key(key).error(message, "`tint` gives the ratio of the channels"));
    }
    for share in shares {
        at.number("tint", share, Tint::LEAST..=1.0)?;
    }
    let opacity = raw.opacity.map(|opacity| at.number("opacity", opacity, 0.0..=1.0)).transpose()?;
    Ok(Tint::new(shares, opacity))
}

/// What the matter that a surface bounds absorbs, by coefficients or by half-lengths.
fn check_absorption_inside(at: &At<'_>, raw: &RawMaterial) -> Result<[f32; 3], Error> {
    let Some(lengths) = raw.half_length else {
        return at.color("absorption_inside", raw.absorption_inside.unwrap_or_default());
    };
    if raw.absorption_inside.is_some() {
        let message = "expected one of `absorption_inside` and `half_length`, found both";
        return Err(at.key("absorption_inside").error(message, "`half_length` gives the absorption"));
    }
    Ok(check_half_lengths(at, lengths)?.map(|absorption| absorption as f32))
}

/// Coefficients of distances after which half of the light is left.
fn check_half_lengths(at: &At<'_>, lengths: [f64; 3]) -> Result<[f64; 3], Error> {
    for length in lengths {
        at.length("half_length", length)?;
    }
    Ok(lengths.map(|length| std::f64::consts::LN_2 / length))
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
    if let Some(lengths) = raw.medium.as_ref().and_then(|m| m.half_length) {
        let others = [
            ("absorption", raw.absorption.is_some()),
            ("extinction_rgb", raw.extinction_rgb.is_some()),
            ("medium.extinction", stated.is_some()),
            ("tint", raw.tint.is_some()),
        ];
        let at_lengths = at.key("medium").key("half_length");
        if let Some((key, _)) = others.iter().find(|(_, is_there)| *is_there) {
            let message = format!("expected one of `medium.half_length` and `{key}`, found both");
            return Err(at_lengths.error(message, "`half_length` gives the extinction of each channel"));
        }
        let per_channel = check_half_lengths(&at.key("medium"), lengths)?;
        let largest = per_channel.into_iter().fold(0.0, f64::max);
        return Ok((Some(largest), per_channel.map(|a| (a / largest) as f32)));
    }
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
