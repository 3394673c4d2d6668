//! Raw tables → checked scene: what the whole file shares, and the tools of the other `check_…` files.

use super::animation::{check_animation, deforms, moves};
use super::check_background::check_background;
use super::check_camera::check_camera;
use super::check_drawn::check_drawn;
use super::check_effects::{Causes, check_effects};
use super::check_extract::check_extracts;
use super::check_footprint::check_footprints;
use super::check_light::check_lights;
use super::check_material::{check_listed, check_materials, unknown_material};
use super::check_object::{Named, check_object};
use super::check_render::check_render;
use super::load::{LoadOptions, Turn};
use super::paths::{Paths, ROOT_KEY};
use super::raw::{RawAnimation, RawScene};
use super::raw_object::RawObject;
use super::stops::check_stops;
use super::switched::{switch, switch_lights};
use super::tree::{Document, Node, Step};
use super::{Aligned, EffectKind, RenderSettings, Scene, SceneLight, SceneObject, ShadowMapping, SwitchedEffect};
use crate::{Error, Written, short};
use glam::DVec3;
use splat_core::{Camera, LightShape};
use std::collections::HashMap;
use std::ops::RangeInclusive;

/// Largest number that a scene may state: its square still fits an f32.
pub(super) const LARGEST: f64 = 1e18;
/// Largest radiant intensity: it goes with the square of a length.
const LARGEST_INTENSITY: f64 = 1e30;
/// Smallest length that a scene may state.
pub(super) const SMALLEST: f64 = 1e-18;
/// Most samples along one side of a region.
const MOST_SAMPLES: f64 = 65536.0;

/// A place in the document, for error messages.
#[derive(Debug, Clone)]
pub(super) struct At<'a> {
    pub(super) document: &'a Document<'a>,
    path: Vec<Step<'a>>,
}

impl<'a> At<'a> {
    /// The whole document.
    pub(super) fn of(document: &'a Document<'a>) -> Self {
        Self { document, path: Vec::new() }
    }

    pub(super) fn key(&self, key: &'a str) -> Self {
        let mut path = self.path.clone();
        path.push(Step::Key(key));
        Self { document: self.document, path }
    }

    pub(super) fn index(&self, index: usize) -> Self {
        let mut path = self.path.clone();
        path.push(Step::Index(index));
        Self { document: self.document, path }
    }

    pub(super) fn error(&self, message: impl Into<String>, hint: impl Into<String>) -> Error {
        self.document.error(self.document.place_of(&self.path), message, hint)
    }

    /// An error at a column (from 1) of the text `value` that is written here.
    pub(super) fn error_in_text(&self, value: &str, column: usize, message: String, hint: &str) -> Error {
        let place = self.document.place_in_text(self.document.place_of(&self.path), value, column);
        self.document.error(place, message, hint)
    }

    /// The value that is written here, or the deepest on the way to it that is.
    pub(super) fn node(&self) -> &'a Node {
        self.document.node_of(&self.path)
    }

    /// The place as it is told once the document is gone.
    pub(super) fn written(&self) -> Written {
        self.document.written(self.document.place_of(&self.path))
    }

    /// The place in words.
    pub(super) fn name(&self) -> String {
        self.document.name_place(self.document.place_of(&self.path))
    }

    /// `value` if it lies in `range`.
    pub(super) fn number(&self, key: &'a str, value: f64, range: RangeInclusive<f64>) -> Result<f64, Error> {
        if range.contains(&value) {
            return Ok(value);
        }
        let (low, high) = (range.start(), range.end());
        let expected = match (*low, *high) {
            (SMALLEST, LARGEST) => format!("a number above 0, from {SMALLEST:e} to {LARGEST:e}"),
            (0.0, LARGEST) => format!("a number from 0 to {LARGEST:e}"),
            _ => format!("a number from {} to {}", short(*low), short(*high)),
        };
        Err(self.key(key).error(format!("`{key}`: expected {expected}, found {}", short(value)), ""))
    }

    /// A whole number in a range.
    pub(super) fn whole(&self, key: &'a str, value: u32, range: RangeInclusive<u32>) -> Result<u32, Error> {
        if range.contains(&value) {
            return Ok(value);
        }
        let expected = format!("a whole number from {} to {}", range.start(), range.end());
        Err(self.key(key).error(format!("`{key}`: expected {expected}, found {value}"), ""))
    }

    /// A length above 0.
    pub(super) fn length(&self, key: &'a str, value: f64) -> Result<f64, Error> {
        self.number(key, value, SMALLEST..=LARGEST)
    }

    /// Three numbers of any sign.
    pub(super) fn vector(&self, key: &'a str, value: [f64; 3]) -> Result<DVec3, Error> {
        for x in value {
            if x.abs() > LARGEST {
                let message = format!("`{key}`: expected numbers from -{LARGEST:e} to {LARGEST:e}, found {}", short(x));
                return Err(self.key(key).error(message, ""));
            }
        }
        Ok(DVec3::from_array(value))
    }

    /// A direction of any length but 0, made a unit vector.
    pub(super) fn direction(&self, key: &'a str, value: [f64; 3]) -> Result<DVec3, Error> {
        let v = self.vector(key, value)?;
        // Scaled first, so that small numbers do not vanish when squared.
        let largest = v.abs().max_element();
        if largest == 0.0 {
            return Err(self.key(key).error(format!("`{key}`: expected a direction, found {value:?}"), ""));
        }
        Ok((v / largest).normalize())
    }

    /// Three numbers ≥ 0.
    pub(super) fn color(&self, key: &'a str, value: [f64; 3]) -> Result<[f32; 3], Error> {
        self.colors_up_to(key, value, LARGEST_INTENSITY)
    }

    /// Three numbers from 0 to `most`.
    pub(super) fn colors_up_to(&self, key: &'a str, value: [f64; 3], most: f64) -> Result<[f32; 3], Error> {
        for (i, x) in value.into_iter().enumerate() {
            if !(0.0..=most).contains(&x) {
                let message = format!("`{key}`: expected numbers from 0 to {most:e}, found {}", short(x));
                return Err(self.key(key).index(i).error(message, ""));
            }
        }
        Ok(value.map(|x| x as f32))
    }

    /// The distance between samples of a region whose longest side is `longest`, from its own key.
    pub(super) fn spacing(&self, key: &'a str, value: f64, longest: f64) -> Result<f64, Error> {
        self.length(key, value)?;
        if longest / value > MOST_SAMPLES {
            let least = longest / MOST_SAMPLES;
            let message = format!("`{key}`: expected at least {least} for a side of {longest}, found {value}");
            return Err(self.key(key).error(message, format!("a side may have {MOST_SAMPLES} samples")));
        }
        Ok(value)
    }
}

/// Checks everything.
pub(super) fn scene(
    document: &Document<'_>,
    raw: RawScene,
    options: &LoadOptions,
    turn: Option<Turn>,
    sha256: String,
) -> Result<Scene, Error> {
    let at = At::of(document);
    if raw.version != 1 {
        let message = format!("`version`: expected 1, found {}", raw.version);
        return Err(at.key("version").error(message, "this version of Organza reads scenes of version 1"));
    }
    let paths = Paths::new(&at.key(ROOT_KEY), document.file, raw.root.as_deref(), options)?;
    let at_footprints = at.key("footprints");
    let footprints = check_footprints(&at_footprints, raw.footprints.as_deref(), &paths, options)?;
    let mut materials = check_materials(&at.key("material"), &raw.material, (&paths, &footprints.stack))?;
    let extracts = raw.object.iter().filter_map(|object| object.extract.as_ref()?.objects.clone());
    let tracks = raw.animation.iter().flat_map(|animation| &animation.track);
    let stops = tracks.filter_map(|track| track.stop.as_ref()?.objects.clone());
    let seen = extracts.chain(stops).flatten().collect();
    let named = Named { materials: &materials, footprints: &footprints.stack, paths: &paths, seen: &seen };
    let at_objects = at.key("object");
    let mut objects = check_objects(&at_objects, raw.object, raw.animation.as_ref(), &named)?;
    check_extracts(&at_objects, &objects, raw.light.len())?;
    let mut render = check_render(&at.key("render"), &raw.render)?;
    let mut lights = check_lights(&at.key("light"), &raw.light, &paths)?;
    let at_effects = at.key("render").key("effects");
    let causes = Causes { lights: &lights, objects: &objects, materials: &materials, render: &render };
    render.effects = check_effects(&at_effects, &raw.render.effects, &causes)?;
    if !switch(&render.effects, &mut objects, &mut materials) {
        let message = format!("expected at most {} materials, with a copy for each effect of an object", u16::MAX);
        return Err(at_effects.error(message, "switch fewer effects"));
    }
    switch_lights(&render.effects, &mut lights);
    if SwitchedEffect::find(&render.effects, EffectKind::Scatter, "") == Some(false) {
        render.sheets.scatter_once();
    }
    let layers = (&at.key("render").key("layers"), raw.render.layers.as_slice());
    check_drawn(&at_objects, &objects, &materials, layers, &mut render)?;
    let goes_around = raw.animation.as_ref().is_some_and(|animation| moves(animation, "camera", "azimuth"));
    let seen = check_camera(&at.key("camera"), &raw.camera, turn, goes_around)?;
    check_aligned(&at.key("render").key("sheets").key("aligned"), &seen.camera, &render)?;
    let (background, environment) = check_background(&at.key("background"), &raw.background, &paths)?;
    check_mapping(&at.key("render").key("shadow").key("mapping"), &render, &lights)?;
    let at_animation = at.key("animation");
    let frames = raw.animation.as_ref().map(|a| check_animation(&at_animation, a)).transpose()?;
    let stops = raw.animation.as_ref().map(|a| check_stops(&at_animation, a, &objects, raw.light.len())).transpose()?;
    Ok(Scene {
        file: document.file.to_owned(),
        sha256,
        frames: turn.map(|turn| turn.frames).or(frames),
        stops: stops.unwrap_or_default(),
        start: None,
        camera: seen.camera,
        target: seen.target,
        fit: seen.fit,
        background,
        environment,
        ambient: at.key("ambient").color("color", raw.ambient.color)?,
        lights,
        objects,
        render,
        materials,
        footprints: footprints.stack,
        footprint_files: footprints.files,
        in_memory: options.in_memory.clone(),
    })
}

/// Checks every object: its name, its material, and what [`check_object`] does.
fn check_objects(
    at_objects: &At<'_>,
    raw: Vec<RawObject>,
    animation: Option<&RawAnimation>,
    named: &Named<'_>,
) -> Result<Vec<SceneObject>, Error> {
    let materials = named.materials;
    let named_materials: HashMap<&str, usize> =
        materials.iter().enumerate().skip(1).map(|(i, m)| (m.name.as_str(), i)).collect();
    let mut objects: Vec<SceneObject> = Vec::with_capacity(raw.len());
    let mut first_of: HashMap<String, usize> = HashMap::new();
    for (i, object) in raw.into_iter().enumerate() {
        let at = at_objects.index(i);
        if let Some(first) = first_of.insert(object.name.clone(), i) {
            let first = at_objects.index(first).key("name").name();
            let message = format!("duplicate object name `{}`, first at {first}", crate::shown(&object.name));
            return Err(at.key("name").error(message, "each object needs a name of its own"));
        }
        let of_name = |at: &At<'_>, name: &str| match named_materials.get(name) {
            Some(i) => Ok(*i),
            None => Err(unknown_material(at, &at_materials(at_objects), name, materials)),
        };
        let listed = check_listed(&at, &object, materials, of_name)?;
        let named_one = object.material.as_deref().map(|name| of_name(&at.key("material"), name)).transpose()?;
        let material = named_one.or(listed.first().copied()).unwrap_or(0);
        // What is extracted changes with what it is extracted from.
        let deforms = animation.is_some_and(|a| object.extract.is_some() || deforms(a, i, &object.name));
        objects.push(SceneObject { deforms, materials: listed, ..check_object(&at, object, material, named)? });
    }
    Ok(objects)
}

/// Refuses maps around a place for light that comes from none.
fn check_mapping(at: &At<'_>, render: &RenderSettings, lights: &[SceneLight]) -> Result<(), Error> {
    let is_parallel = |light: &&SceneLight| light.shadow && matches!(light.light.shape, LightShape::Directional { .. });
    let parallel = lights.iter().find(is_parallel).filter(|_| render.shadow.mapping != ShadowMapping::Auto);
    let Some(light) = parallel else { return Ok(()) };
    let message = format!(
        "`mapping`: directions around a place are for lights that have one, and light `{}` is directional",
        crate::shown(&light.label)
    );
    Err(at.error(message, "leave `mapping` out, or set shadow = false for that light"))
}

/// Refuses slabs along a lattice that are seen in perspective.
fn check_aligned(at: &At<'_>, camera: &Camera, render: &RenderSettings) -> Result<(), Error> {
    if render.sheets.aligned != Aligned::Axis || camera.is_orthographic() {
        return Ok(());
    }
    let message = "`aligned`: slabs along a lattice are seen by parallel rays alone";
    Err(at.error(message, "set camera.orthographic, or \"view\""))
}

fn at_materials<'a>(at: &At<'a>) -> At<'a> {
    At { document: at.document, path: vec![Step::Key("material")] }
}
