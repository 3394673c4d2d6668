//! `organza convert`.

use super::args::{ConvertArguments, SceneArguments};
use super::console;
use super::console::bar::with_bar;
use super::given::given;
use super::session::{parse_scene, path_text, processor_only, render_options, unused_goal};
use organza::output::{Target, Targets};
use organza::scene::{Scene, Technique};
use organza::{Context, Error, Files, Loaded, printable, shown};
use serde_json::{Value, json};
use splat_core::splat_file::{packed_splats_to_ply, splats_to_ply};
use splat_core::{Cloud, Shading};
use std::path::Path;

/// Makes splats of a scene or of data files and writes them as rendering-oriented points.
pub(super) fn run(arguments: &ConvertArguments) -> Result<(), Error> {
    let (scene, files, target) = begin(&arguments.scene, &arguments.output, arguments.force)?;
    let options = render_options(&arguments.scene);
    let (loaded, bytes) = with_bar(|progress| {
        let mut loaded = organza::load(&scene, Context { files: &files, options: &options, progress })?;
        refuse_gaussians(&loaded)?;
        refuse_images(&loaded)?;
        // A power of two: no bit of a splat is lost.
        loaded.cloud.scale_world(2f64.powi(loaded.exponent));
        let materials: Vec<String> = scene.materials.iter().map(|material| material.name.clone()).collect();
        let cloud = &loaded.cloud;
        let names = names(&loaded);
        let footprints = &loaded.footprints;
        let bytes = if arguments.packed {
            packed_splats_to_ply(cloud, &names, &materials, footprints).map_err(|e| Error::Internal(e.to_string()))?
        } else {
            splats_to_ply(cloud, &names, &materials, footprints)
        };
        target.write(&bytes)?;
        progress.finish();
        Ok((loaded, bytes.len() as u64))
    })?;
    loaded.warnings.iter().for_each(|warning| console::warn(warning));
    loaded.notes.iter().for_each(|note| console::remark(note));
    if let Some(said) = said_of_unlit(&loaded) {
        console::remark(&said);
    }
    if arguments.scene.common.json {
        return console::out(&format!("{:#}\n", document(&loaded, target.path(), bytes)));
    }
    let path = printable(target.path());
    let argument = console::argument(target.path());
    let count = loaded.cloud.len();
    console::out(&format!(
        "wrote {path} ({bytes} bytes, {count} splats); draw it: organza render {argument} -o picture.png\n"
    ))
}

/// A scene of which a file of points is made, what was read of its files, and where the points go. An output that is in the way is told
/// before anything is read. Every object is one of splats, whatever draws it, with the values that their points have.
pub(super) fn begin(arguments: &SceneArguments, output: &Path, force: bool) -> Result<(Scene, Files, Target), Error> {
    processor_only(arguments)?;
    refuse_of_pictures(arguments)?;
    let path = check_name(output)?;
    Target::new(path, force)?;
    let (given, files) = given(arguments, None)?;
    let mut scene = parse_scene(arguments, &given, None, None)?;
    unused_goal(&scene.render.goal, "a file of points").iter().for_each(|sentence| console::warn(sentence));
    let mut targets = Targets::default();
    targets.add_inputs(&scene.files());
    let target = targets.add(path, force)?;
    scene.render.technique = Technique::Points;
    for object in &mut scene.objects {
        object.technique = None;
        object.points.keeps_values = true;
    }
    Ok((scene, files, target))
}

fn names(loaded: &Loaded) -> Vec<String> {
    loaded.objects.iter().map(|object| object.name.clone()).collect()
}

/// How many splats each object has.
fn counts(cloud: &Cloud, objects: usize) -> Vec<u64> {
    let mut counts = vec![0; objects];
    cloud.object.iter().for_each(|object| counts[*object as usize] += 1);
    counts
}

fn document(loaded: &Loaded, path: &Path, bytes: u64) -> Value {
    let counts = counts(&loaded.cloud, loaded.objects.len());
    let objects = loaded.objects.iter().zip(counts).map(|(object, n)| json!({ "name": object.name, "splats": n }));
    json!({
        "output": path_text(path),
        "bytes": bytes,
        "splats": loaded.cloud.len(),
        "objects": objects.collect::<Value>(),
        "warnings": loaded.warnings,
        "notes": loaded.notes,
    })
}

/// Files of splats have formulas as footprints.
fn refuse_images(loaded: &Loaded) -> Result<(), Error> {
    let Some((i, _)) = loaded.footprints.images_in(&loaded.cloud).next() else { return Ok(()) };
    let name = shown(&loaded.objects[loaded.cloud.object[i] as usize].name);
    let id = loaded.cloud.footprint[i];
    let message = format!("its splats show footprint {id}, an image, which a file of splats cannot hold");
    let hint = format!("set object.{name}.footprint to the index of a formula");
    Err(Error::input(format!("object '{name}'"), message, hint))
}

/// Files of splats have no column for what a Gaussian is.
fn refuse_gaussians(loaded: &Loaded) -> Result<(), Error> {
    let is_one = |i: &usize| loaded.cloud.get(*i).gaussian != splat_core::Gaussians::NONE;
    let first = (0..loaded.cloud.gaussian.len()).find(is_one);
    first.map_or(Ok(()), |i| {
        let name = shown(&loaded.objects[loaded.cloud.object[i] as usize].name);
        let message = "it is 3D Gaussians, which are rendering-oriented points in a format of their own already";
        Err(Error::input(format!("object '{name}'"), message, format!("set object.{name}.visible = false")))
    })
}

/// Objects whose colours are shown as they are, which a file of splats does not say.
fn said_of_unlit(loaded: &Loaded) -> Option<String> {
    let unlit = |material: u16| loaded.materials[usize::from(material)].shading == Shading::Unlit;
    let ids = loaded.cloud.material.iter().zip(&loaded.cloud.object).filter(|(material, _)| unlit(**material));
    let mut objects: Vec<u32> = ids.map(|(_, object)| *object).collect();
    objects.dedup();
    objects.sort_unstable();
    objects.dedup();
    let names: Vec<String> =
        objects.iter().map(|o| format!("'{}'", shown(&loaded.objects[*o as usize].name))).collect();
    (!names.is_empty()).then(|| {
        format!(
            "{} is shown without light: draw its splats with `unlit = true`, or by its material",
            names.join(" and ")
        )
    })
}

/// Splats are written as PLY: another name would be read as something else.
fn check_name(path: &Path) -> Result<&Path, Error> {
    match path.extension() {
        Some(extension) if extension.eq_ignore_ascii_case("ply") => Ok(path),
        _ => Err(Error::usage(format!("{}: expected a name that ends in .ply", printable(path)), "")),
    }
}

/// What is said of pictures says nothing of splats.
fn refuse_of_pictures(scene: &SceneArguments) -> Result<(), Error> {
    let options = [
        ("--technique", scene.technique.is_some()),
        ("--target-error", scene.target_error.is_some()),
        ("--repeat-level", scene.repeat_level.is_some()),
        ("--exposure", scene.exposure.is_some()),
        ("--background", scene.background.is_some()),
        ("--layers", scene.layers.is_some()),
        ("--effect", !scene.effect.is_empty()),
    ];
    let named = options.into_iter().find(|(_, on)| *on);
    named.map_or(Ok(()), |(name, _)| {
        Err(Error::usage(format!("{name} is for pictures, and splats are asked for"), "leave it out"))
    })
}
