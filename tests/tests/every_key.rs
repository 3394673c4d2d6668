//! Every key of a scene file does something with every source that it could apply to, or is refused by name.
//!
//! The keys are those of the JSON Schema that `organza schema` prints; docs/scene.md lists the same. A key that is in
//! neither table of `every_key/` fails the test, so a new one cannot be silently ignored.

mod fields;
mod footprints;
mod lights;
mod scenes;
mod schema;
mod seen;
mod surfels;
mod table;

use scenes::{Folder, SOURCES};
use std::collections::{BTreeMap, BTreeSet};
use table::{Entry, Expected, Look};

/// What a scene shows, as far as an entry looks, or why it is refused.
type Shown = Result<String, (u8, String)>;

/// What scenes show before a key is set, by all that decides it: most entries begin with the same ones.
type Before = BTreeMap<(&'static str, &'static str, Look, &'static [&'static str], Option<u32>), Shown>;

fn look(folder: &Folder, source: &str, entry: &Entry, technique: &str, set: &[&str]) -> Shown {
    let refused = |e: organza::Error| (e.exit_code(), format!("{e} ({})", e.hint()));
    let mut overrides = vec![format!("render.technique='{technique}'")];
    overrides.extend(entry.with.iter().chain(set).map(|s| (*s).to_owned()));
    let scene = folder.scene(source, &overrides, entry.frame).map_err(refused)?;
    let options = organza::RenderOptions::default();
    let progress = organza::Progress::new();
    let render = || organza::render(&scene, &options, &progress).map_err(refused);
    Ok(match entry.look {
        Look::Picture => scenes::bits(render()?.layers.rgb("beauty").unwrap()),
        Look::Layers => format!("{:?}", render()?.layers.images.keys()),
        Look::Displayed => folder.png(&render()?, scene.render.exposure),
        Look::Work => {
            let stages = render()?.cost.stages;
            format!("{:?}", stages.iter().map(|s| (&s.name, s.items_out, s.fragments)).collect::<Vec<_>>())
        }
        Look::Sets => format!("{:?}", render()?.sets),
        Look::Told => {
            let explanation = organza::explain(&scene, &options, &progress).map_err(refused)?;
            let effects: Vec<&str> = explanation.plan.effects.iter().map(|effect| effect.name.as_str()).collect();
            format!("{:?} {:?} {effects:?}", explanation.splats, scene.frames)
        }
    })
}

/// What an entry says of a source, and the fault where that is not so.
fn fault(
    folder: &Folder,
    source: &'static str,
    entry: &Entry,
    technique: &'static str,
    known: &mut Before,
) -> Option<String> {
    let picture_key = (source, technique, entry.look, entry.with, entry.frame);
    let before = known.entry(picture_key).or_insert_with(|| look(folder, source, entry, technique, &[]));
    let after = look(folder, source, entry, technique, &[entry.set]);
    let at = format!("{} with {source} by {technique}, {}", entry.key, entry.set);
    if let Err((_, error)) = before {
        return Some(format!("{at}: the scene itself is refused: {error}"));
    }
    match (entry.expected(source, technique), after) {
        (Expected::Changes, Ok(after)) => (*before == Ok(after)).then(|| format!("{at}: nothing changes")),
        (Expected::Refused(code, words), Err((found, error))) => {
            (found != code || !error.contains(words)).then(|| format!("{at}: exit {found}, {error}"))
        }
        (Expected::Nothing(why), Ok(after)) => {
            (*before != Ok(after)).then(|| format!("{at}: something changes, though \"{why}\""))
        }
        (Expected::Refused(..), Ok(_)) => Some(format!("{at}: is not refused")),
        (_, Err((_, error))) => Some(format!("{at}: is refused: {error}")),
    }
}

/// Tries every key: with every source that it could apply to by each technique, or with every sixth source by one technique, in
/// turn.
fn try_all(by_each: bool) {
    let folder = Folder::new();
    let mut faults = Vec::new();
    let mut tried = 0;
    let mut known = Before::new();
    for (at, entry) in table::entries().iter().enumerate() {
        let by = |source| entry.techniques.iter().copied().filter(|t| entry.applies_to(source, t)).collect::<Vec<_>>();
        let mut with: Vec<_> = SOURCES.iter().map(|s| (s.name, by(s.name))).filter(|(_, by)| !by.is_empty()).collect();
        if !by_each {
            let first_technique = |(i, (source, by)): (usize, (_, Vec<_>))| (source, vec![by[(at + i) % by.len()]]);
            let first = at % with.len().clamp(1, 6);
            with = with.into_iter().enumerate().map(first_technique).skip(first).step_by(6).collect();
        }
        for (source, technique) in with.iter().flat_map(|(source, by)| by.iter().map(|t| (*source, *t))) {
            tried += 1;
            faults.extend(fault(&folder, source, entry, technique, &mut known));
        }
    }
    assert!(faults.is_empty(), "{} of {tried}:\n{}", faults.len(), faults.join("\n"));
}

#[test]
fn each_changes_what_is_seen_or_is_refused() {
    try_all(false);
}

#[test]
fn the_table_has_every_key_of_the_schema_and_no_other() {
    let tried: BTreeSet<String> = table::entries().iter().map(|e| e.key.to_owned()).collect();
    let keys = schema::keys();
    let missing: Vec<_> = keys.difference(&tried).collect();
    let unknown: Vec<_> = tried.difference(&keys).collect();
    assert!(missing.is_empty() && unknown.is_empty(), "not tried: {missing:?}\nno such key: {unknown:?}");
}

#[test]
fn the_guide_lists_the_keys_of_the_schema() {
    let sections = schema::sections();
    let mut faults = Vec::new();
    let mut documented: BTreeMap<&str, BTreeSet<String>> = BTreeMap::new();
    for key in schema::keys() {
        let (table, name) = key.rsplit_once('.').unwrap_or(("", &key));
        let heading = schema::heading(table);
        match sections.iter().find(|s| s.heading.contains(heading)) {
            Some(section) if section.words.contains(name) => {
                documented.entry(heading).or_default().insert(name.to_owned());
            }
            Some(_) => faults.push(format!("`{key}` is not in \"{heading}\"")),
            None => faults.push(format!("no section \"{heading}\" for `{key}`")),
        }
    }
    for (heading, names) in &documented {
        let section = sections.iter().find(|s| s.heading.contains(heading)).unwrap();
        for name in section.first_column.difference(names).filter(|n| !schema::is_value(n)) {
            faults.push(format!("\"{heading}\" lists `{name}`, which the schema does not have"));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn a_color_replaces_that_of_the_data_for_points_as_for_meshes() {
    let folder = Folder::new();
    for source in ["mesh", "points"] {
        let shown = |set: &[&str]| {
            let with = ["material.m.shading='unlit'", "material.m.opacity=1.0", "object.it.visible=true"];
            let set: Vec<String> = with.iter().chain(set).map(|s| (*s).to_owned()).collect();
            let scene = folder.scene(source, &set, None).unwrap();
            let render = organza::render(&scene, &organza::RenderOptions::default(), &organza::Progress::new());
            let layers = render.unwrap().layers;
            layers.rgb("beauty").unwrap()[(scenes::SIZE[1] / 2 * scenes::SIZE[0] + scenes::SIZE[0] / 2) as usize]
        };
        let [r, g, b] = shown(&["object.it.color=[0.125, 0.25, 0.5]"]);
        assert!((r - 0.125).abs() + (g - 0.25).abs() + (b - 0.5).abs() < 1e-5, "{source}: {r} {g} {b}");
    }
}

#[test]
fn points_closer_than_the_spacing_become_one_and_a_volume_gets_a_lattice_with_such_steps() {
    let folder = Folder::new();
    let splats = |source: &str, spacing: f64| {
        let set = [format!("object.it.spacing={spacing:?}"), "render.technique='points'".to_owned()];
        let scene = folder.scene(source, &set, None).unwrap();
        let explained = organza::explain(&scene, &organza::RenderOptions::default(), &organza::Progress::new());
        explained.unwrap().splats.iter().find(|s| s.object == "it").map(|s| (s.predicted, s.made)).unwrap()
    };
    // 16 by 16 points 0.08 apart that begin at a corner of a cell of 0.16.
    assert_eq!(splats("points", 0.16), (64, 64));
    assert_eq!(splats("points", 0.04), (256, 256));
    // 6³ cells of 0.2, all with some extinction.
    assert_eq!(splats("volume", 0.2), (216, 216));
    assert_eq!(splats("volume", 0.4), (27, 27));
    assert_eq!(splats("volume", 0.1), (1728, 1728));
}

#[test]
fn the_axis_that_points_up_is_that_of_the_format_unless_the_scene_says_another() {
    let folder = Folder::new();
    let shown = |set: &[&str]| {
        let set: Vec<String> = set.iter().map(|s| (*s).to_owned()).collect();
        let scene = folder.scene("volume", &set, None).unwrap();
        let axis = scene.objects.iter().find(|o| o.name == "it").unwrap().up.axis.name();
        let render = organza::render(&scene, &organza::RenderOptions::default(), &organza::Progress::new()).unwrap();
        (axis, scenes::bits(render.layers.rgb("beauty").unwrap()))
    };
    let (body, up) = ("object.it.volume='body.nrrd'", |axis: &str| format!("object.it.transform.up='{axis}'"));
    let y = shown(&[body, &up("y")]);
    let z = shown(&[body, &up("z")]);
    assert_ne!(y, z);
    assert_eq!(shown(&[body]), z);
    assert_eq!(shown(&[body, &up("auto")]), z);
    assert_eq!(shown(&[]), y);
    // What is not drawn is not opened, unless a light is to see it.
    let hidden =
        [body.to_owned(), "object.it.visible=false".into(), "object.1={name='seen', extract={objects=['it']}}".into()];
    assert_eq!(folder.scene("volume", &hidden, None).unwrap().objects[2].up.axis.name(), z.0);
    assert_eq!(
        folder.scene("volume", &[body.into(), "object.it.visible=false".into()], None).unwrap().objects.len(),
        3
    );
}

#[test]
fn a_material_does_not_tint_data_with_colours_by_either_technique() {
    let folder = Folder::new();
    for technique in ["points", "particles"] {
        let shown = |set: &str| {
            let set = [format!("render.technique='{technique}'"), set.to_owned()];
            let scene = folder.scene("mesh", &set, None).unwrap();
            let render = organza::render(&scene, &organza::RenderOptions::default(), &organza::Progress::new());
            scenes::bits(render.unwrap().layers.rgb("beauty").unwrap())
        };
        assert_eq!(shown("material.m.color=[1, 1, 1]"), shown("material.m.color=[1, 0, 0]"), "{technique}");
    }
}

/// What takes long and rarely fails where the others hold.
mod deep {
    #[test]
    fn each_changes_what_is_seen_or_is_refused_by_every_technique() {
        super::try_all(true);
    }
}
