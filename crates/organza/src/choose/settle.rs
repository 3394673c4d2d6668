//! What draws the objects whose technique a scene leaves to the plan (`auto`): settled once, before anything is converted, for all that follows.
//!
//! Ways to draw the scene are compared: each object by the technique of the table that suits it, and for each technique that carries light through
//! media, all of them by that one. What techniques err by is estimated ([`estimates`]), and their time is counted work times the built-in
//! figures of one thread. So a scene is settled alike on every machine, by any number of threads.

use crate::choose::technique_of;
use crate::cost::{Count, CountedPass, ENTRIES_PER_SPLAT, Item, Rates, Translucent, samples};
use crate::load::source_facts;
use crate::plan::Estimate;
use crate::scene::{ComparedTechnique, EffectKind, RenderSettings, Scene, SceneObject, SwitchedEffect, Technique};
use crate::statistics::{MediumFacts, SourceFacts};
use crate::technique::{Asked, Row, TABLE, estimates, row};
use crate::{Context, Error, pass};
use std::borrow::Cow;

/// How many times the time of the next way a way may take.
const MOST_TIMES: f64 = 20.0;
/// Tolerances that the next way may err by where a way is refused for its time.
const MOST_TOLERANCES: f64 = 10.0;
/// Samples of the picture for each splat of a surface, and fragments for each sample: of surfaces other than meshes nothing is counted before they are
/// read.
const SAMPLES_PER_SPLAT: f64 = 4.0;
const FRAGMENTS_PER_SAMPLE: f64 = 4.0;

/// The scene with a named technique for every object, and the settings that the plan takes with them where the scene leaves them open. A scene that
/// names all techniques is returned as it is.
///
/// # Errors
/// Those of reading media and meshes; [`Error::Input`] where a layer is asked for that no way fills.
pub(crate) fn settled<'s>(scene: Cow<'s, Scene>, context: Context<'_>) -> Result<Cow<'s, Scene>, Error> {
    if is_settled(&scene) {
        return Ok(scene);
    }
    let facts = source_facts(&scene, context)?;
    let switched = SwitchedEffect::find(&scene.render.effects, EffectKind::Scatter, "");
    let has_layer = scene.render.layers.names().any(|name| name == SCATTERED);
    let asked_for = has_layer || switched == Some(true);
    let mut ways: Vec<Way> = ways(&scene, &facts).collect();
    for way in &mut ways {
        way.refusal = if way.scatters_again && switched == Some(false) {
            Some("`scatter` is switched off".to_owned())
        } else if !way.scatters_again && asked_for {
            Some("the scene asks for light that is scattered again and again".to_owned())
        } else {
            let needed = if way.carries_light { bytes(&scene, &facts, way) } else { 0 };
            let limit = context.options.max_memory;
            (needed > limit).then(|| format!("it needs {needed} bytes, the limit is {limit} bytes"))
        };
    }
    let Some(way) = chosen(&ways, scene.render.tolerance) else {
        let what = if has_layer { "the layer `scatterN`" } else { "the effect `scatter`, which is on" };
        let message = format!("{what}: no technique that `auto` chooses scatters light again and again here");
        let hint = "leave it out, or let `auto` choose for all translucent objects";
        return Err(Error::input(crate::printable(&scene.file), message, hint));
    };
    let mut settled = with(&scene, way);
    settled.render.choice = Some(compared(&scene, &facts, &ways, way));
    Ok(Cow::Owned(settled))
}

/// The layer of light that media scatter again.
const SCATTERED: &str = "scatterN";

/// Whether every object has a named technique.
pub(crate) fn is_settled(scene: &Scene) -> bool {
    let is_named = |object: &SceneObject| technique_of(object, scene) != Technique::Auto;
    scene.render.technique != Technique::Auto && scene.objects.iter().all(is_named)
}

/// What the techniques err by that draw, and those that `auto` may take in their place, object by object.
pub(crate) fn all_estimates(scene: &Scene, facts: &SourceFacts) -> Vec<Estimate> {
    let visible = scene.objects.iter().enumerate().filter(|(_, object)| object.visible);
    let of_object = |(rank, object): (usize, &SceneObject)| {
        let drawing = technique_of(object, scene);
        let asked = asked(scene, rank, facts, &scene.render);
        let others = TABLE.iter().filter(|row| row.technique != drawing && (row.is_offered)(&asked));
        let techniques = std::iter::once(drawing).chain(others.map(|row| row.technique));
        techniques.flat_map(|technique| estimates(technique, &asked)).collect::<Vec<_>>()
    };
    visible.flat_map(of_object).collect()
}

/// A way to draw the scene.
struct Way {
    /// The technique of each object, by rank.
    by: Vec<Technique>,
    settings: RenderSettings,
    /// Whether light is carried through media by what draws them, and whether that scatters it again and again.
    carries_light: bool,
    scatters_again: bool,
    /// Whether one technique draws all objects that the scene leaves to the plan; else each is drawn by what suits it.
    is_of_one: bool,
    weight: Weight,
    /// Why it cannot be taken, whatever its weight is.
    refusal: Option<String>,
}

/// The error and the time by which techniques are compared.
#[derive(Debug, Clone, Copy)]
struct Weight {
    /// The greatest estimate of a change of a displayed pixel.
    displayed_error: f64,
    /// Seconds of one thread by the built-in figures.
    seconds: f64,
}

/// The ways that draw the scene, the plainest first.
fn ways<'a>(scene: &'a Scene, facts: &'a SourceFacts) -> impl Iterator<Item = Way> + 'a {
    let plain = std::iter::once_with(|| {
        let by = scene.objects.iter().enumerate().map(|(rank, object)| match technique_of(object, scene) {
            Technique::Auto => {
                let candidates = candidates(&asked(scene, rank, facts, &scene.render));
                suiting(&candidates, scene.render.tolerance).map_or(TABLE[0].technique, |one| one.technique)
            }
            named => named,
        });
        way(scene, facts, by.collect(), scene.render.clone())
    });
    let of_row = |row: &'static Row| (row.alone)(scene, facts).into_iter().map(move |settings| (row, settings));
    let alone = TABLE.iter().flat_map(of_row).filter_map(|(row, settings)| {
        let draws = |(rank, object): (usize, &SceneObject)| match technique_of(object, scene) {
            Technique::Auto => true,
            named => named == row.technique || asked(scene, rank, facts, &settings).is_opaque(),
        };
        let named = |object: &SceneObject| match technique_of(object, scene) {
            Technique::Auto => row.technique,
            named => named,
        };
        let by: Vec<Technique> = scene.objects.iter().map(named).collect();
        let scatters = settings.sheets.scattering().is_some();
        let serves = |medium: &MediumFacts| {
            medium.is_lattice && by[medium.object] == row.technique && (!scatters || medium.albedo > 0.0)
        };
        let draws_all = scene.objects.iter().enumerate().filter(|(_, object)| object.visible).all(draws);
        let is_way = draws_all && facts.media.iter().any(serves);
        is_way.then(|| Way { is_of_one: true, ..way(scene, facts, by, settings) })
    });
    plain.chain(alone)
}

/// What techniques are asked about an object.
fn asked<'a>(scene: &'a Scene, rank: usize, facts: &'a SourceFacts, settings: &'a RenderSettings) -> Asked<'a> {
    Asked { scene, rank, object: &scene.objects[rank], facts, settings }
}

/// A technique that may draw an object by itself.
struct Candidate {
    technique: Technique,
    weight: Weight,
}

/// The techniques that may draw an object by itself, with the settings of the scene.
fn candidates(asked: &Asked<'_>) -> Vec<Candidate> {
    let offered = TABLE.iter().filter(|row| (row.is_offered)(asked));
    let candidate = |row: &Row| {
        let displayed_error = greatest(&estimates(row.technique, asked));
        Candidate { technique: row.technique, weight: Weight { displayed_error, seconds: seconds(row, asked) } }
    };
    offered.map(candidate).collect()
}

/// The technique that suits an object by itself: of those within the tolerance the fastest, else the one that errs least, and of equal ones the first of
/// the table.
fn suiting(candidates: &[Candidate], tolerance: f64) -> Option<&Candidate> {
    let sufficient = candidates.iter().filter(|one| one.weight.displayed_error <= tolerance);
    let fastest = sufficient.min_by(|a, b| a.weight.seconds.total_cmp(&b.weight.seconds));
    let errs_least = || candidates.iter().min_by(|a, b| a.weight.displayed_error.total_cmp(&b.weight.displayed_error));
    fastest.or_else(errs_least)
}

/// The techniques of each object that has several, where each is drawn by the one that suits it, then the ways to draw all of them.
fn compared(scene: &Scene, facts: &SourceFacts, ways: &[Way], taken: &Way) -> Vec<ComparedTechnique> {
    let tolerance = scene.render.tolerance;
    let is_open = |object: &SceneObject| object.visible && technique_of(object, scene) == Technique::Auto;
    let mut compared = Vec::new();
    let open = scene.objects.iter().enumerate().filter(|(_, object)| !taken.is_of_one && is_open(object));
    for (rank, object) in open {
        let candidates = candidates(&asked(scene, rank, facts, &scene.render));
        let Some(suiting) = suiting(&candidates, tolerance).filter(|_| candidates.len() > 1) else { continue };
        compared.extend(candidates.iter().map(|one| ComparedTechnique {
            object: Some(object.name.clone()),
            drawn_by: one.technique.name().to_owned(),
            displayed_error: one.weight.displayed_error,
            seconds: one.weight.seconds,
            is_taken: one.technique == suiting.technique,
            reason: if one.technique == suiting.technique {
                reason_for(one.weight, candidates.iter().map(|other| other.weight), tolerance).to_owned()
            } else {
                reason_against(one.weight, suiting.weight, tolerance).to_owned()
            },
        }));
    }
    if ways.len() < 2 {
        return compared;
    }
    let possible = || ways.iter().filter(|way| way.refusal.is_none()).map(|way| way.weight);
    compared.extend(ways.iter().map(|way| {
        let is_taken = std::ptr::eq(way, taken);
        let reason = if is_taken {
            reason_for(way.weight, possible(), tolerance).to_owned()
        } else {
            way.refusal.clone().unwrap_or_else(|| reason_against(way.weight, taken.weight, tolerance).to_owned())
        };
        ComparedTechnique {
            object: None,
            drawn_by: way.drawn_by(scene),
            displayed_error: way.weight.displayed_error,
            seconds: way.weight.seconds,
            is_taken,
            reason,
        }
    }));
    compared
}

/// Why a technique is taken of some.
fn reason_for(taken: Weight, compared: impl Iterator<Item = Weight>, tolerance: f64) -> &'static str {
    let mut compared = compared;
    if taken.displayed_error <= tolerance {
        "the fastest that errs within the tolerance"
    } else if compared.any(|other| other.displayed_error < taken.displayed_error) {
        "nothing errs within the tolerance, and what errs less takes more than 20 times longer"
    } else {
        "nothing errs within the tolerance: it errs least"
    }
}

/// Why another technique is taken in the place of one.
fn reason_against(one: Weight, taken: Weight, tolerance: f64) -> &'static str {
    let is_sufficient = one.displayed_error <= tolerance;
    match taken.displayed_error <= tolerance {
        true if is_sufficient => "it is no faster",
        true if !one.displayed_error.is_finite() => "what it errs by is not known",
        true => "it errs by more than the tolerance",
        false if one.displayed_error < taken.displayed_error => "it takes more than 20 times longer",
        false => "it errs no less",
    }
}

impl Way {
    /// The techniques of objects that the scene leaves to the plan, in words.
    fn drawn_by(&self, scene: &Scene) -> String {
        let open = || scene.objects.iter().zip(&self.by).filter(|(object, _)| object.visible);
        let draws = |row: &&Row| {
            open().any(|(object, by)| technique_of(object, scene) == Technique::Auto && *by == row.technique)
        };
        let names: Vec<&str> = TABLE.iter().filter(draws).map(|row| row.technique.name()).collect();
        let light = match (self.is_of_one, self.scatters_again) {
            (true, true) => ", which scatter light again and again",
            (true, false) => ", which carry light",
            (false, _) => "",
        };
        names.join(" and ") + light
    }
}

/// Bytes that the techniques of a way take at most for media, before anything is converted.
fn bytes(scene: &Scene, facts: &SourceFacts, way: &Way) -> u64 {
    let used = TABLE.iter().filter(|row| way.by.contains(&row.technique));
    used.map(|row| (row.foresees_bytes)(scene, &way.settings, &facts.media)).sum()
}

/// Bytes with which a settled scene is settled alike: with fewer the plan would choose otherwise. 0 where it chose nothing that it weighs by memory.
pub(crate) fn foreseen_bytes(scene: &Scene, facts: &SourceFacts) -> u64 {
    let chosen = |row: &&Row| {
        let is_weighed = scene.render.choice.is_some() && (row.carries)(&scene.render).is_some();
        let is_of_it = |object: &SceneObject| object.is_chosen && technique_of(object, scene) == row.technique;
        is_weighed && scene.objects.iter().any(is_of_it)
    };
    TABLE.iter().filter(chosen).map(|row| (row.foresees_bytes)(scene, &scene.render, &facts.media)).sum()
}

fn greatest(estimates: &[Estimate]) -> f64 {
    estimates.iter().map(|estimate| estimate.displayed_error).fold(0.0, f64::max)
}

fn way(scene: &Scene, facts: &SourceFacts, by: Vec<Technique>, settings: RenderSettings) -> Way {
    let mut displayed_error = 0.0f64;
    let mut time = 0.0;
    for (rank, _) in scene.objects.iter().enumerate().filter(|(_, object)| object.visible) {
        let asked = asked(scene, rank, facts, &settings);
        displayed_error = displayed_error.max(greatest(&estimates(by[rank], &asked)));
        time += seconds(row(by[rank]), &asked);
    }
    let carries_light = by.iter().any(|technique| (row(*technique).carries)(&settings).is_some());
    let scatters_again = carries_light && settings.sheets.scattering().is_some();
    let weight = Weight { displayed_error, seconds: time };
    Way { by, settings, carries_light, scatters_again, is_of_one: false, weight, refusal: None }
}

/// Seconds of one thread that an object takes by a technique, counted before anything is converted.
fn seconds(row: &Row, asked: &Asked<'_>) -> f64 {
    let scene = asked.scene;
    let camera = scene.camera.with_samples(asked.settings.antialias);
    let own_work = (row.foresees)(asked, &camera);
    let drawn_items = own_work.items + own_work.slab_samples + own_work.medium_samples + own_work.polygon_looks;
    let draws_own_data = drawn_items > 0.0;
    let samples = samples(scene);
    let casting = scene.lights.iter().filter(|light| light.shadow && light.light.intensity != [0.0; 3]);
    let maps: f64 = casting.map(|light| light.count() as f64).sum();
    // What is drawn from its own data carries its light, or has splats for shadow maps.
    let carries = (row.carries)(asked.settings).is_some();
    let of_medium = asked.medium().map(|medium| medium.splats);
    let of_mesh = asked.mesh().map(|mesh| mesh.splats);
    let converted = of_medium.or(of_mesh).unwrap_or(samples / SAMPLES_PER_SPLAT);
    let drawn = if draws_own_data { 0.0 } else { converted };
    let fragments = if draws_own_data { 0.0 } else { samples * FRAGMENTS_PER_SAMPLE };
    let translucent = Translucent { splats: drawn, fragments, own_work, ranges: 1.0, any: true };
    let mut counts: Vec<Count> = row.steps.iter().flat_map(|step| (step.counts)(scene, &translucent)).collect();
    if !(draws_own_data && carries) {
        counts.push(Count::new(Item::ConvertedSplat, converted));
        counts.push(Count::new(Item::CastSplat, converted * maps));
        counts.push(Count::new(Item::ShadowEntry, converted * maps * ENTRIES_PER_SPLAT));
    }
    if row.draws_splats {
        counts.push(Count::new(Item::ProjectedSplat, drawn));
        counts.push(Count::new(Item::ShadedSplat, drawn));
        counts.push(Count::new(Item::ShadowLookUp, drawn * maps));
    }
    CountedPass::new(pass::FINISH, String::new(), counts).seconds(&Rates::default(), 1)
}

/// The way that is taken: of those whose estimate is within the tolerance the fastest; without any, the one that errs least, unless it takes so many
/// times longer than the fastest that errs by some tolerances.
fn chosen(ways: &[Way], tolerance: f64) -> Option<&Way> {
    let possible = || ways.iter().filter(|way| way.refusal.is_none());
    let by_seconds = |a: &&Way, b: &&Way| a.weight.seconds.total_cmp(&b.weight.seconds);
    let fastest = possible().filter(|way| way.weight.displayed_error <= tolerance).min_by(by_seconds);
    if fastest.is_some() {
        return fastest;
    }
    let best = possible().min_by(|a, b| a.weight.displayed_error.total_cmp(&b.weight.displayed_error))?;
    let is_near = |way: &&Way| way.weight.displayed_error <= MOST_TOLERANCES * tolerance;
    let near = possible().filter(is_near).min_by(by_seconds);
    Some(near.filter(|near| best.weight.seconds > MOST_TIMES * near.weight.seconds).unwrap_or(best))
}

/// The scene as a way has it.
fn with(scene: &Scene, way: &Way) -> Scene {
    let mut settled = scene.clone();
    let is_open = |object: &SceneObject| technique_of(object, scene) == Technique::Auto;
    // What most objects have in common stays a setting of the scene, as it was asked for.
    let open = || scene.objects.iter().zip(&way.by).filter(|(object, _)| is_open(object));
    let used = |row: &&Row| open().any(|(object, by)| object.visible && *by == row.technique);
    let common = TABLE.iter().find(used).unwrap_or(&TABLE[0]).technique;
    settled.render = way.settings.clone();
    if settled.render.technique == Technique::Auto {
        settled.render.technique = common;
    }
    for (object, by) in settled.objects.iter_mut().zip(&way.by) {
        object.is_chosen = technique_of(object, scene) == Technique::Auto;
        let has_it = object.technique.is_none() && settled.render.technique == *by;
        if !has_it {
            object.technique = Some(*by);
        }
    }
    if way.scatters_again && scene.render.layers.has_effects() {
        let is_layer = settled.render.layers.add(SCATTERED);
        debug_assert!(is_layer, "invariant: the layer has a name");
    }
    settled
}

/// Sentences on what the plan's choice errs by: as warnings the effects that it leaves out and that are seen at once, as notes the rest.
pub(crate) struct Said {
    pub(crate) warnings: Vec<String>,
    pub(crate) notes: Vec<String>,
}

/// What is said of estimates above the tolerance, of objects whose technique the plan chose.
pub(crate) fn said(scene: &Scene, estimates: &[Estimate]) -> Said {
    let mut said = Said { warnings: Vec::new(), notes: Vec::new() };
    if scene.frames.is_some() {
        return said;
    }
    for estimate in estimates.iter().filter(|estimate| is_of_choice(scene, estimate)) {
        // Of what is not known by number other warnings tell.
        if !estimate.displayed_error.is_finite() || estimate.displayed_error <= scene.render.tolerance {
            continue;
        }
        let sentence = format!(
            "object '{}': `{}` errs by about {:.0} % of white: {}",
            crate::shown(&estimate.of_object),
            estimate.technique.name(),
            100.0 * estimate.displayed_error,
            estimate.words
        );
        let is_much = estimate.displayed_error > MOST_TOLERANCES * scene.render.tolerance;
        if is_much && estimate.is_left_out { said.warnings.push(sentence) } else { said.notes.push(sentence) }
    }
    said
}

/// Whether an estimate is of a technique that the plan chose for its object.
fn is_of_choice(scene: &Scene, estimate: &Estimate) -> bool {
    let object = scene.objects.iter().find(|object| object.name == estimate.of_object);
    object.is_some_and(|object| object.is_chosen && technique_of(object, scene) == estimate.technique)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::parse;
    use crate::{Files, Progress, RenderOptions};

    const VIEW: &str = "version = 1\n[camera]\nposition = [0, 0, 5]\ntarget = [0, 0, 0]\nsize = [64, 48]\n\
        [[light]]\nkind = 'directional'\ndirection = [0, -1, -1]\nirradiance = [3, 3, 3]\n\
        [material.cloud]\nmedium = { albedo = 0.98, asymmetry = 0.3 }\n[material.soot]\nmedium = { albedo = 0 }\n\
        [material.glass]\nior = 1.5\n";
    const CLOUD: &str = "[[object]]\nname = 'cloud'\nmaterial = 'cloud'\n\
        medium_ball = { center = [0, 0, 0], radius = 1, extinction = 3.2, spacing = 0.1 }\n";
    const GLASS: &str = "[[object]]\nname = 'glass'\nmaterial = 'glass'\n\
        implicit = { expression = 'x^2 + y^2 + z^2 - 0.25', box = [[-1, -1, -1], [1, 1, 1]], spacing = 0.1 }\n";
    const WALL: &str = "[[object]]\nname = 'wall'\n\
        rectangle = { center = [0, 0, -2], u = [2, 0, 0], v = [0, 2, 0], spacing = 0.1 }\n";

    fn settled_with(text: &str, options: &RenderOptions) -> Result<Scene, Error> {
        let scene = parse("s.toml".as_ref(), text.as_bytes(), &crate::scene::LoadOptions::default()).unwrap();
        let context = Context { files: &Files::default(), options, progress: &Progress::new() };
        settled(Cow::Owned(scene), context).map(Cow::into_owned)
    }

    fn techniques_of(parts: &[&str]) -> Vec<&'static str> {
        let scene = settled_with(&(VIEW.to_owned() + &parts.concat()), &RenderOptions::default()).unwrap();
        assert!(is_settled(&scene));
        scene.objects.iter().map(|object| technique_of(object, &scene).name()).collect()
    }

    #[test]
    fn every_kind_of_data_is_drawn_by_what_suits_it() {
        let cloud = CLOUD;
        let soot = CLOUD.replace("material = 'cloud'", "material = 'soot'");
        let density = "[[object]]\nname = 'fog'\nmaterial = 'cloud'\n\
            density = { expression = '2 - x^2', box = [[-1, -1, -1], [1, 1, 1]], spacing = 0.1, extinction = 2 }\n";
        let puffs = "[[object]]\nname = 'puffs'\nmaterial = 'cloud'\n\
            cloud = { ellipsoids = [{ center = [0, 0, 0], radii = [1, 1, 1] }], spacing = 0.1, extinction = 12 }\n";
        for medium in [cloud, density, puffs] {
            assert_eq!(techniques_of(&[medium]), ["sheets"], "{medium}");
            assert_eq!(techniques_of(&[medium, WALL]), ["sheets", "sheets"]);
        }
        assert_eq!(techniques_of(&[&soot]), ["points"]);
        assert_eq!(techniques_of(&[&cloud.replace("extinction = 3.2", "extinction = 0.01")]), ["points"]);
        assert_eq!(techniques_of(&[WALL]), ["points"]);
        assert_eq!(techniques_of(&[GLASS, WALL]), ["surfels", "points"]);
        // Nothing that bends light draws fog again and again, and none of the others bends light.
        assert_eq!(techniques_of(&[cloud, GLASS, WALL]), ["points", "surfels", "points"]);
        // Without light nothing scatters, and volumes that reflect by their gradients do not.
        let dark = VIEW.replace("irradiance = [3, 3, 3]", "irradiance = [0, 0, 0]");
        let scene = settled_with(&(dark + cloud), &RenderOptions::default()).unwrap();
        assert_eq!(scene.render.technique, TABLE[0].technique);
        let phong =
            density.replace("material = 'cloud'", "material = 'phong'") + "[material.phong]\nshading = 'phong'\n";
        assert_eq!(techniques_of(&[&phong]), ["points"]);
    }

    #[test]
    fn what_a_scene_states_is_obeyed() {
        let named = CLOUD.replace("material = 'cloud'", "material = 'cloud'\ntechnique = 'points'");
        assert_eq!(techniques_of(&[&named, WALL]), ["points", "points"]);
        for sheets in [
            "slicing = 'view'",
            "scattering = 'once'",
            "classify = 'before'",
            "classify = 'preintegrated'",
            "slicing = 'half_vector', scattering = 'once'",
        ] {
            assert_eq!(
                techniques_of(&[CLOUD, &format!("[render]\nsheets = {{ {sheets} }}\n")]),
                ["points"],
                "{sheets}"
            );
        }
        let half = "[render]\nsheets = { slicing = 'half_vector', light_pixels = 3 }\n";
        let scene = settled_with(&(VIEW.to_owned() + CLOUD + half), &RenderOptions::default()).unwrap();
        assert!(scene.render.sheets.scattering().is_some());
        assert!(format!("{:?}", scene.render.sheets.slicing).contains("light_pixels: 3.0"));
        // Named sheets lie across the view, as long as the scene states no more.
        let scene =
            settled_with(&(VIEW.to_owned() + CLOUD + "[render]\ntechnique = 'sheets'\n"), &RenderOptions::default());
        assert!(scene.unwrap().render.sheets.scattering().is_none());
    }

    #[test]
    fn a_layer_is_filled_or_refused_and_memory_is_kept_to() {
        let thin = CLOUD.replace("extinction = 3.2", "extinction = 0.01");
        let layer = "[render]\nlayers = ['scatterN']\n";
        assert_eq!(techniques_of(&[&thin, layer]), ["sheets"]);
        let asked_for = settled_with(&[VIEW, CLOUD, GLASS, layer].concat(), &RenderOptions::default());
        // Glass is drawn without its bending where the layer asks for it.
        assert_eq!(asked_for.unwrap().render.technique.name(), "sheets");
        let small = RenderOptions { max_memory: 1 << 20, ..RenderOptions::default() };
        let scene = settled_with(&(VIEW.to_owned() + CLOUD), &small).unwrap();
        assert_eq!(scene.render.technique, TABLE[0].technique);
        let message = settled_with(&[VIEW, CLOUD, layer].concat(), &small).unwrap_err().to_string();
        assert!(message.contains("scatterN"), "{message}");
        // All effects sum to beauty: the layer of what is scattered again is one of them.
        let effects =
            settled_with(&[VIEW, CLOUD, "[render]\nlayers = ['effects']\n"].concat(), &RenderOptions::default());
        assert!(effects.unwrap().render.layers.names().any(|name| name == SCATTERED));
    }

    #[test]
    fn what_was_compared_is_told_with_what_was_taken_and_why() {
        let compared = |parts: &[&str], options: &RenderOptions| {
            let scene = settled_with(&(VIEW.to_owned() + &parts.concat()), options).unwrap();
            scene.render.choice.clone().unwrap()
        };
        let usual = RenderOptions::default();
        // A cloud that scatters again and again, by each technique alone, and by the one that shows it.
        let of_cloud = compared(&[CLOUD, WALL], &usual);
        let taken: Vec<&ComparedTechnique> = of_cloud.iter().filter(|one| one.is_taken).collect();
        assert_eq!(taken.len(), 1, "{of_cloud:?}");
        assert_eq!(taken[0].drawn_by, "sheets, which scatter light again and again");
        let rival = of_cloud.iter().find(|one| one.drawn_by == "points").unwrap();
        assert!(rival.displayed_error > taken[0].displayed_error && rival.seconds > 0.0, "{of_cloud:?}");
        assert!(rival.reason.contains("errs"), "{}", rival.reason);
        // Objects by themselves: glass by what bends light, the wall by the only one.
        let of_glass = compared(&[GLASS, WALL], &usual);
        assert!(of_glass.iter().all(|one| one.object.as_deref() == Some("glass")), "{of_glass:?}");
        let told: Vec<(&str, bool, &str)> =
            of_glass.iter().map(|one| (one.drawn_by.as_str(), one.is_taken, one.reason.as_str())).collect();
        assert!(told.contains(&("surfels", true, "the fastest that errs within the tolerance")), "{told:?}");
        assert!(told.contains(&("points", false, "what it errs by is not known")), "{told:?}");
        // A way that does not fit says why.
        let small = RenderOptions { max_memory: 1 << 20, ..RenderOptions::default() };
        let of_small = compared(&[CLOUD], &small);
        assert!(
            of_small.iter().any(|one| !one.is_taken && one.reason.contains("the limit is 1048576")),
            "{of_small:?}"
        );
        let off = "[render]\neffects = { scatter = 'off' }\n";
        let switched = compared(&[CLOUD, off], &usual);
        assert!(switched.iter().any(|one| one.reason == "`scatter` is switched off"), "{switched:?}");
        // A scene that names its techniques compares nothing.
        let named = settled_with(&(VIEW.to_owned() + CLOUD + "[render]\ntechnique = 'points'\n"), &usual).unwrap();
        assert_eq!(named.render.choice, None);
    }

    #[test]
    fn the_fastest_that_is_enough_is_taken_else_the_best_unless_it_takes_far_too_long() {
        let scene = settled_with(&(VIEW.to_owned() + WALL), &RenderOptions::default()).unwrap();
        let way = |displayed_error: f64, seconds: f64| Way {
            by: Vec::new(),
            settings: scene.render.clone(),
            carries_light: false,
            scatters_again: false,
            is_of_one: false,
            weight: Weight { displayed_error, seconds },
            refusal: None,
        };
        let taken = |ways: &[Way]| chosen(ways, 0.004).map(|way| way.weight.seconds).unwrap();
        assert_eq!(taken(&[way(0.003, 5.0), way(0.001, 7.0)]), 5.0);
        assert_eq!(taken(&[way(0.02, 1.0), way(0.001, 30.0)]), 30.0);
        assert_eq!(taken(&[way(0.02, 1.0), way(0.01, 19.0)]), 19.0);
        assert_eq!(taken(&[way(0.02, 1.0), way(0.01, 21.0)]), 1.0);
        assert_eq!(taken(&[way(0.2, 1.0), way(0.01, 21.0)]), 21.0);
        assert!(chosen(&[], 0.004).is_none());
    }
}
