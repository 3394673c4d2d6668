//! Raw tables → checked scene: what the whole file shares.

use super::raw::RawScene;
use crate::animation::raw::RawAnimation;
use crate::animation::stops::check_stops;
use crate::animation::tracks::{check_animation, deforms, moves};
use crate::at::At;
use crate::background::check::check_background;
use crate::camera::check::check_camera;
use crate::effects::check::{Causes, check_effects};
use crate::effects::switched::{switch, switch_lights};
use crate::footprint::check::check_footprints;
use crate::light::check::check_lights;
use crate::load::options::{LoadOptions, Turn};
use crate::material::check::{NamedMaterials, check_listed, check_materials};
use crate::object::check::{Named, check_object};
use crate::object::drawn::check_drawn;
use crate::object::raw::RawObject;
use crate::paths::{Paths, ROOT_KEY};
use crate::render::check::{check_render, technique_keys};
use crate::source::extract::check_extracts;
use crate::text::tree::Document;
use crate::{
    Aligned, EffectKind, Error, RenderSettings, Scene, SceneLight, SceneObject, ShadowMapping, SwitchedEffect,
};
use splat_core::{Camera, LightShape};
use std::collections::HashMap;

/// Checks everything.
pub(crate) fn scene(
    document: &Document<'_>,
    raw: RawScene,
    options: &LoadOptions,
    turn: Option<Turn>,
    sha256: String,
) -> Result<Scene, Error> {
    let at = At::root(document);
    if raw.version != 1 {
        let message = format!("`version`: expected 1, found {}", raw.version);
        return Err(at.key("version").error(message, "this version of Organza reads scenes of version 1"));
    }
    let paths = Paths::new(&at.key(ROOT_KEY), document.file, raw.root.as_deref(), options)?;
    let at_footprints = at.key("footprints");
    let footprints = check_footprints(&at_footprints, raw.footprints.as_deref(), &paths, options)?;
    let named_materials = check_materials(&at.key("material"), &raw.material, &paths, &footprints.stack, &raw.object)?;
    let extracts = raw.object.iter().filter_map(|object| object.extract.as_ref()?.objects.clone());
    let tracks = raw.animation.iter().flat_map(|animation| &animation.track);
    let stops = tracks.filter_map(|track| track.stop.as_ref()?.objects.clone());
    let seen = extracts.chain(stops).flatten().collect();
    let named = Named {
        materials: &named_materials.list,
        footprints: &footprints.stack,
        paths: &paths,
        memory: &options.memory,
        seen: &seen,
    };
    let at_objects = at.key("object");
    let mut objects = check_objects(&at_objects, raw.object, raw.animation.as_ref(), &named, &named_materials)?;
    let mut materials = named_materials.list;
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
    let at_layers = at.key("render").key("layers");
    check_drawn(&at_objects, &objects, &materials, &at_layers, &raw.render.layers, &mut render)?;
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
        technique_keys: technique_keys(&at.key("render")),
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
    materials: &NamedMaterials,
) -> Result<Vec<SceneObject>, Error> {
    let mut objects: Vec<SceneObject> = Vec::with_capacity(raw.len());
    let mut first_of: HashMap<String, usize> = HashMap::new();
    for (i, object) in raw.into_iter().enumerate() {
        let at = at_objects.index(i);
        if let Some(first) = first_of.insert(object.name.clone(), i) {
            let first = at_objects.index(first).key("name").name();
            let message = format!("duplicate object name `{}`, first at {first}", crate::shown(&object.name));
            return Err(at.key("name").error(message, "each object needs a name of its own"));
        }
        let of_name = |at: &At<'_>, name: &str| materials.of_object(at, &object, name);
        let listed = check_listed(&at, &object, &materials.list, of_name)?;
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
