//! Prepares a scene for drawing: read, choose, convert, plan.

pub(crate) mod carried;
mod facts;
pub(crate) mod media;
pub(crate) mod ranges;
mod seen;

use crate::brightness::{self, Brightness};
use crate::choose::settle;
use crate::choose::{choose, plan, row, same_forms, settings, technique_of, techniques, unshown};
use crate::cost::{Count, Prediction, Translucent};
use crate::form::PlannedObject;
use crate::frame::Frame;
use crate::frame::matter::Matter;
use crate::load::files::Files;
use crate::load::own::Own;
use crate::load::{self, Loaded, Spare, light_statistics, source_facts};
use crate::memory::{self, Memory};
use crate::pass;
use crate::plan::{Effect, Plan};
use crate::predict::prediction;
use crate::scene::{
    EffectKind, FoundCamera, Scene, SceneLight, SceneObject, Source, SwitchedEffect, Technique, light_points,
};
use crate::shadows::{Probe, ShadowTable, Shadowing, casters_by_light};
use crate::statistics::{ObjectData, ObjectStatistics, Statistics};
use crate::technique::{Fold, Row};
use crate::{Context, CostRecord, Error, Progress, RenderOptions, SplatCount, escape_controls, shadows, warnings};
use convert::DiscSize;
use ranges::ranges;
pub use seen::{fitted, seen, settled};
use splat_core::shade::Census;
use splat_core::{Exceeded, Material, SplatKind};
use std::borrow::Cow;
use std::collections::HashMap;

/// The plan of a render, its cost and its memory, without a picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Explanation {
    /// Effects and passes with their reasons.
    pub plan: Plan,
    /// The cost of loading.
    pub cost: CostRecord,
    /// Bytes that rendering will take at its peak, see [`Explanation::plan`] for the passes that take them. Shadow maps are predicted from the sizes
    /// of their casters as a light sees them. The build keeps all of them within the limit.
    pub memory: u64,
    /// Counted work of a render, and its time.
    pub predicted: Prediction,
    /// Splats of every visible object, as predicted from its input and as made.
    pub splats: Vec<SplatCount>,
    /// Warnings about the input.
    pub warnings: Vec<String>,
    /// Data of the files that a picture does not show, and conversions of the data.
    pub notes: Vec<String>,
    /// The camera that was placed, where the scene leaves that to the data.
    pub found: Option<FoundCamera>,
}

/// Loads a scene and plans its render.
///
/// # Errors
/// As [`crate::render`].
pub fn explain(scene: &Scene, options: &RenderOptions, progress: &Progress) -> Result<Explanation, Error> {
    explain_from(scene, Context { files: &Files::default(), options, progress })
}

/// [`explain`] from files of which some were read before.
///
/// # Errors
/// As [`crate::render`].
pub fn explain_from(scene: &Scene, context: Context<'_>) -> Result<Explanation, Error> {
    let (scene, found) = settled(scene, context)?;
    let Context { options, progress, .. } = context;
    let Prepared { scene, loaded, planned, mut explanation } = prepare(&scene, context, None, Purpose::Picture)?;
    let frame = Frame::new(&scene, &loaded, &planned.plan, progress);
    let mut folds: Vec<Box<dyn Fold + '_>> =
        planned.plan.techniques.iter().map(|technique| (row(*technique).begin)(&frame)).collect();
    folds.iter_mut().try_for_each(|fold| fold.check(options, &mut explanation.cost))?;
    explanation.predicted = prediction(&frame, &folds, &ranges(&frame), options);
    explanation.found = found;
    explanation.warnings.extend(settle::said(&scene, &explanation.plan.estimates).warnings);
    explanation.warnings.extend(warnings::of_shadows(&explanation.plan.shadow_limits()));
    explanation.warnings.extend(warnings::of_costly(explanation.plan.tables()));
    explanation.warnings.extend(warnings::of_scattering(&explanation.plan));
    progress.finish();
    Ok(explanation)
}

/// A plan, what it follows from, and the bytes that it takes.
pub(crate) struct Planned {
    pub(crate) plan: Plan,
    pub(crate) memory: Memory,
    statistics: Statistics,
    census: SplatCensus,
}

/// Counts and bounds of all splats, which no camera changes.
#[derive(Clone)]
struct SplatCensus {
    counts: Census,
    brightness: Brightness,
}

impl SplatCensus {
    fn new(scene: &Scene, loaded: &Loaded) -> Self {
        let counts = Census::new(&loaded.cloud, &loaded.materials, &loaded.objects, &loaded.footprints);
        Self { counts, brightness: brightness::of_scene(scene, loaded) }
    }
}

/// What drawing reads.
pub(crate) struct Prepared<'a> {
    /// The scene, without the causes of effects of objects that are left out.
    pub(crate) scene: Cow<'a, Scene>,
    pub(crate) loaded: Loaded,
    pub(crate) planned: Planned,
    pub(crate) explanation: Explanation,
}

/// The purpose of a plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Purpose {
    /// A picture.
    Picture,
    /// A preview. Light that a thick splat sends to the eye is not attenuated within it: the preview is as bright within a few percent, and the map of the
    /// eye would be built anew for each view. Cells of shadow maps that are asked for give way where a hand would wait for them.
    Preview,
}

/// Loads and plans; `made` is what was loaded of another scene that serves this one, and its plan where [`turned`] says that it serves, too.
pub(crate) fn prepare<'a>(
    scene: &'a Scene,
    context: Context<'_>,
    made: Option<(Loaded, Option<Planned>)>,
    purpose: Purpose,
) -> Result<Prepared<'a>, Error> {
    let Context { files, options, .. } = context;
    let mut cost = CostRecord::default();
    memory::check("the image", memory::image_bytes(scene), options.max_memory)?;
    check_samples(scene)?;
    let (mut loaded, planned) = match made {
        Some((mut loaded, planned)) => {
            loaded.retarget(scene);
            if planned.is_none() {
                loaded.relight(scene, source_facts(scene, context)?);
            }
            (loaded, planned)
        }
        None => (load_measured(scene, context, &mut cost)?, None),
    };
    let splats = loaded.splats.clone();
    let notes_of_scene: Vec<String> = warnings::clear_shadows(scene, &loaded).collect();
    let mut warnings = loaded.warnings.clone();
    warnings.extend(warnings::of_scene(scene, &loaded));
    warnings.extend(unshown(scene));
    warnings.extend(carried::unshadowed(scene, &loaded));
    // Of fields of a file the file alone knows what it holds.
    let inputs = cost.stages.iter().filter(|s| s.name == pass::READ).map(|s| s.bytes).sum::<u64>().max(files.bytes());
    let loading = memory::loading_bytes(&loaded, inputs);
    // The camera alone has moved where there is a plan.
    let census = planned.as_ref().map(|planned| planned.census.clone());
    // Shadows are judged by what a view shows, in an animation by all that there is.
    let planned = planned.filter(|_| scene.frames.is_some());
    let mut scene = Cow::Borrowed(scene);
    let mut gathering = 0;
    let planned = match planned {
        Some(planned) => {
            plan_counted(&scene, &loaded, options, Effects::from_planned(&planned), Some(planned.plan), purpose)?
        }
        None => {
            let both = loaded.cloud.bytes().saturating_mul(2);
            let census = census.unwrap_or_else(|| SplatCensus::new(&scene, &loaded));
            let mut effects = plan_effects(&scene, &loaded, census, &[], 0.0, both <= options.max_memory)?;
            let mut left_out: Vec<Effect> = Vec::new();
            let mut switched: Vec<SwitchedEffect> = Vec::new();
            while !effects.plan.left_out.is_empty() {
                let is_of_object = |effect: &Effect| is_among(&effects.plan.left_out, effect);
                left_out.extend(effects.plan.effects.iter().filter(|effect| is_of_object(effect)).cloned());
                let reduced = without(&scene, &effects.plan.left_out);
                switched.append(&mut effects.plan.left_out);
                gathering = gathering.max(if loaded.reduce(&scene, &reduced) { both } else { 0 });
                scene = Cow::Owned(reduced);
                let spent = left_out.iter().filter_map(|effect| effect.bound.number()).sum();
                let census = SplatCensus::new(&scene, &loaded);
                effects = plan_effects(&scene, &loaded, census, &left_out, spent, both <= options.max_memory)?;
            }
            effects.plan.left_out = switched;
            plan_counted(&scene, &loaded, options, effects, None, purpose)?
        }
    };
    let plan = planned.plan.clone();
    let memory = planned.memory;
    let mut notes = loaded.notes.clone();
    notes.extend(notes_of_scene);
    notes.extend(warnings::without_part(&scene));
    notes.extend(warnings::idle_cells(&loaded.lights, &plan));
    let said = settle::said(&scene, &plan.estimates);
    // Of a technique that the plan chose a warning tells what it lacks.
    if said.warnings.is_empty() {
        notes.extend(warnings::lacking(&plan));
    }
    notes.extend(said.notes);
    let chosen = settle::foreseen_bytes(&scene, &loaded.facts);
    let most = memory.total().max(loading).max(files.most.get()).max(files.peak()).max(gathering).max(chosen);
    let explanation = Explanation {
        plan,
        cost,
        memory: most,
        predicted: Prediction::default(),
        splats,
        warnings,
        notes,
        found: None,
    };
    Ok(Prepared { scene, loaded, planned, explanation })
}

/// Whether an effect is one of those that are switched.
fn is_among(switched: &[SwitchedEffect], effect: &Effect) -> bool {
    switched.iter().any(|switched| switched.kind.name(&switched.label) == effect.name)
}

/// A scene without the causes of effects of objects. What a bound says of an effect it says of the technique that draws the object: that stays.
fn without(stated: &Scene, left_out: &[SwitchedEffect]) -> Scene {
    let mut scene = stated.clone();
    for effect in left_out {
        let Some(rank) = scene.objects.iter().position(|object| object.name == effect.label) else { continue };
        let object = &mut scene.objects[rank];
        object.technique = Some(technique_of(&stated.objects[rank], stated));
        match effect.kind {
            EffectKind::Object => object.visible = false,
            kind => {
                let material = &mut scene.materials[object.material].material;
                *material = kind.taken_from(material);
            }
        }
    }
    scene
}

/// Whether the loaded data of one scene serves the other, after [`Loaded::retarget`]. The scenes may differ in the
/// picture's size and in render settings that decide no object's form.
pub fn same_splats(a: &Scene, b: &Scene) -> bool {
    let mut other = b.clone();
    other.camera.size = a.camera.size;
    other.render = a.render.clone();
    other.technique_keys.clone_from(&a.technique_keys);
    if !settle::is_settled(a) || !settle::is_settled(b) {
        return false;
    }
    let are_alike = |technique: Technique| (row(technique).makes_alike)(&a.render, &b.render);
    // Layers decide whether volumes get normals, the most points whether a scene is refused.
    *a == other
        && a.objects.iter().zip(&b.objects).all(|(of_a, of_b)| same_forms(technique_of(of_a, a), technique_of(of_b, b)))
        && techniques(a).into_iter().chain(techniques(b)).all(are_alike)
        && a.render.layers == b.render.layers
        // Of the cells of shadow maps, what is extracted.
        && (a.render.shadow == b.render.shadow || !a.objects.iter().any(|o| matches!(o.source, Source::Extract(_))))
        && a.render.splat_share == b.render.splat_share
        && a.render.max_points == b.render.max_points
}

/// Whether what is loaded of one frame serves the other, after [`Loaded::retarget`]: whether they differ in the camera alone, and it
/// decides nothing of what is made of an object.
pub(crate) fn turned(a: &Scene, b: &Scene) -> bool {
    // The frame's number is part of the hash.
    let other = Scene { camera: a.camera, target: a.target, sha256: a.sha256.clone(), ..b.clone() };
    let by_pixels = |object: &SceneObject| matches!(object.points.size, Some(DiscSize::Pixels(_)));
    // Discs as large as some pixels; splats that no shadow map needs, as light is carried for this view.
    let of_view = || carried::of_scene(b).is_some() || visible(b).any(by_pixels);
    *a == other && (a.camera == b.camera || !of_view())
}

/// Whether the splats of one scene serve the other, after [`Loaded::retarget`] and [`Loaded::relight`]: whether they differ in camera, lights and settings of the
/// render alone, and none of these decides what is made of an object.
pub(crate) fn splats_serve(before: &Scene, after: &Scene, loaded: &Loaded) -> bool {
    // The frame's number is part of the hash.
    let alike = Scene {
        camera: after.camera,
        target: after.target,
        lights: after.lights.clone(),
        sha256: after.sha256.clone(),
        ..before.clone()
    };
    let by_pixels = |object: &SceneObject| matches!(object.points.size, Some(DiscSize::Pixels(_)));
    let by_lights = |object: &SceneObject| matches!(object.source, Source::Extract(_));
    let is_seen_alike = before.camera == after.camera || !visible(after).any(by_pixels);
    let has_slide = |scene: &Scene| scene.lights.iter().any(|light| light.slide.is_some());
    let is_lit_alike = before.lights == after.lights
        || before.lights.is_empty() == after.lights.is_empty()
            && !has_slide(before)
            && !has_slide(after)
            && !visible(after).any(by_lights);
    is_seen_alike
        && is_lit_alike
        && carried::of_scene(before).is_none()
        && carried::of_scene(after).is_none()
        && same_splats(&alike, after)
        && chosen(loaded, after) == loaded.planned
}

/// Whether two scenes differ in the camera, in the exposure and in how bright lights are, and in nothing else.
pub(crate) fn is_brighter(before: &Scene, after: &Scene) -> bool {
    let mut alike =
        Scene { camera: before.camera, target: before.target, sha256: before.sha256.clone(), ..after.clone() };
    alike.render.exposure = before.render.exposure;
    for (light, of_before) in alike.lights.iter_mut().zip(&before.lights) {
        light.light.intensity = of_before.light.intensity;
    }
    // Of lights in one place the brighter comes behind.
    let order = |scene: &Scene| load::lights(scene).into_iter().map(|light| light.label).collect::<Vec<_>>();
    *before == alike && order(before) == order(after)
}

/// How the objects of a loaded scene would be drawn in the lights and by the settings of another.
fn chosen(loaded: &Loaded, scene: &Scene) -> Vec<PlannedObject> {
    let lights = light_statistics(&scene.lights, &scene.render.effects);
    let objects = loaded.statistics.iter().zip(visible(scene).map(|object| technique_of(object, scene)));
    choose(objects, &lights)
}

/// Plans the render of a loaded scene. `scene` may differ from the one that was loaded in its render settings; whether the same
/// splats serve them is for the caller to know. Techniques and camera are those that [`settled`] has found.
///
/// # Errors
/// [`Error::Usage`] for a scene with an object whose technique is `auto`; [`Error::Input`] where the technique cannot draw the scene; [`Error::Limit`] where it needs more than `options` allow.
pub fn plan_loaded(scene: &Scene, loaded: &Loaded, options: &RenderOptions) -> Result<Plan, Error> {
    if !settle::is_settled(scene) {
        return Err(Error::usage("the technique of an object is still to be chosen", "plan what `settled` returns"));
    }
    plan_alone(scene, loaded, options).map(|planned| planned.plan)
}

/// The same with what it takes and follows from. Effects of objects are kept, whatever their bounds.
pub(crate) fn plan_alone(scene: &Scene, loaded: &Loaded, options: &RenderOptions) -> Result<Planned, Error> {
    let effects = plan_effects(scene, loaded, SplatCensus::new(scene, loaded), &[], 0.0, false)?;
    plan_counted(scene, loaded, options, effects, None, Purpose::Picture)
}

/// Refuses 3D Gaussians, images as footprints, and splats of media that a file has beside others, where a technique leaves them out.
fn check_splats(scene: &Scene, loaded: &Loaded) -> Result<(), Error> {
    let by = |object: &SceneObject| row(technique_of(object, scene));
    let refuse = |o: &SceneObject, what| Err(Error::input(crate::shown(&o.name), what, "use `points` or `reference`"));
    let mut of_gaussians =
        visible(scene).zip(&loaded.statistics).filter(|(_, statistics)| statistics.data == ObjectData::Gaussians);
    if let Some((object, _)) = of_gaussians.find(|(object, _)| !by(object).gaussians) {
        return refuse(object, "3D Gaussians, which its technique does not draw");
    }
    let discs_alone: Vec<bool> = scene.objects.iter().map(|o| by(o).meets_discs).collect();
    let looked_at = if discs_alone.contains(&true) { loaded.cloud.len() } else { 0 };
    let mut splats = loaded.cloud.kind.iter().zip(&loaded.cloud.object).take(looked_at);
    let medium = splats.find(|(kind, o)| **kind == SplatKind::Medium && discs_alone[**o as usize]);
    let object = |i: usize| &scene.objects[loaded.cloud.object[i] as usize];
    let alone = |by: &Row, kind| by.meets_discs || !by.draws_splats && kind == SplatKind::Surface;
    let image = loaded.footprints.images_in(&loaded.cloud).find(|(i, kind)| alone(by(object(*i)), *kind));
    if let Some((i, _)) = image {
        return refuse(object(i), "images as footprints, and its technique draws formulas alone");
    }
    let what = "splats of a medium, and its technique draws surfaces alone";
    medium.map_or(Ok(()), |(_, object)| refuse(&scene.objects[*object as usize], what))
}

/// The effects of a loaded scene, and what they follow from.
struct Effects {
    statistics: Statistics,
    /// The plan but for its shadow maps.
    plan: Plan,
    census: SplatCensus,
    /// The objects as boxes, where the plan is of one view.
    shadowing: Option<Shadowing>,
}

impl Effects {
    /// Those that were planned before.
    fn from_planned(planned: &Planned) -> Self {
        let Planned { plan, statistics, census, .. } = planned;
        Self { statistics: statistics.clone(), plan: plan.clone(), census: census.clone(), shadowing: None }
    }
}

/// The plan of a loaded scene with these effects; `before` is that of another one that [`turned`] says serves this one.
fn plan_counted(
    scene: &Scene,
    loaded: &Loaded,
    options: &RenderOptions,
    effects: Effects,
    before: Option<Plan>,
    purpose: Purpose,
) -> Result<Planned, Error> {
    check_samples(scene)?;
    let is_new = before.is_none();
    let Effects { statistics, mut plan, census, shadowing } = effects;
    let scene_techniques = techniques(scene);
    let used = scene_techniques.iter().filter(|t| statistics.translucent_of(**t).is_some() || row(**t).meets_discs);
    // They take turns, and each keeps what it has.
    let points = light_points(&loaded.lights);
    let camera = loaded.camera.with_samples(scene.render.antialias);
    let matter =
        Matter { scene, own: &loaded.own, planned: &plan.objects, cloud: Some(&loaded.cloud), camera: &camera };
    let technique_bytes =
        used.map(|t| (row(*t).bytes)(&matter, &points, statistics.counts.colored_extinction, options)).sum();
    let memory = Memory::new(scene, loaded, technique_bytes);
    memory::check("rendering", memory.total(), options.max_memory)?;
    // Shadow maps share what is left.
    let left = options.max_memory - memory.total();
    if is_new {
        carried::plan(scene, loaded, &points, &mut plan)?;
    }
    let shadowing = match shadowing.filter(|_| !plan.leaves_view()) {
        Some(shadowing) => shadowing,
        None => Shadowing::new(scene, loaded, plan.leaves_view()),
    };
    let casters: Vec<_> = points.iter().map(|point| shadowing.casters(&point.light)).collect();
    let is_cast_alike = casters == plan.casters;
    plan.casters = casters;
    plan.shown = shadowing.shown().to_vec();
    if is_new {
        let casters = casters_by_light(loaded, &points, &plan.casters);
        let named = loaded.lights.iter().zip(&casters);
        let casters_of: HashMap<String, &Vec<bool>> =
            named.map(|(light, casters)| (EffectKind::Shadow.name(&light.label), casters)).collect();
        for effect in plan.effects.iter_mut().filter(|effect| effect.called_for) {
            if let Some(casters) = casters_of.get(&effect.name) {
                effect.note_idle_casters(&idle_casters(scene, loaded, casters));
            }
        }
    }
    if is_new || !is_cast_alike || !shadows::fit(plan.tables(), left) {
        let casting: Vec<_> = plan.casters.iter().map(|kept| shadows::casting(&loaded.objects, kept)).collect();
        let others = plan.others(loaded);
        let requests = carried::requested_maps(loaded, &points, &casting, others.as_deref(), &plan);
        let mut tables = shadows::tables(&scene.render, loaded, &requests, left)?;
        if purpose == Purpose::Preview {
            tables.iter_mut().flatten().for_each(ShadowTable::hurry);
        }
        plan.set_shadow_tables(&points, tables, left);
    } else {
        plan.allow_shadows(left);
    }
    // Of the view, which may be another than that of the maps.
    plan.set_eye_table(None);
    let left = left.saturating_sub(shadows::bytes(plan.tables()));
    if purpose == Purpose::Picture && plan.shadow_maps.contains(&true) {
        let eye = shadows::eye_table(loaded, &plan.shown, &plan.draws, left)?;
        plan.set_eye_table(eye);
    }
    let memory = memory.with_maps(shadows::bytes(plan.tables()));
    memory::check("rendering", memory.total(), options.max_memory)?;
    plan.settings = settings(scene, loaded, &plan);
    Ok(Planned { plan, memory, statistics, census })
}

/// The names of visible objects that cast shadows and are none of these casters.
fn idle_casters(scene: &Scene, loaded: &Loaded, casters: &[bool]) -> Vec<String> {
    let objects = scene.objects.iter().zip(&loaded.objects).zip(casters);
    let idle = objects.filter(|((o, object), is_kept)| o.visible && object.casts_shadow && !**is_kept);
    idle.map(|((o, _), _)| escape_controls(&o.name).into_owned()).collect()
}

/// The plan of a loaded scene but for its shadow maps, and what it follows from.
/// Effects that are `left_out` of both already have spent a part of the tolerance; others of objects
/// may be only where `objects_may_go`.
///
/// # Errors
/// [`Error::Input`] where a technique cannot draw what it is to draw.
fn plan_effects(
    scene: &Scene,
    loaded: &Loaded,
    census: SplatCensus,
    left_out: &[Effect],
    spent: f64,
    objects_may_go: bool,
) -> Result<Effects, Error> {
    check_splats(scene, loaded)?;
    let planned: Vec<PlannedObject> = visible(scene)
        .zip(&loaded.planned)
        .map(|(object, planned)| PlannedObject { technique: technique_of(object, scene), ..planned.clone() })
        .collect();
    let made: Vec<u64> = loaded.splats.iter().map(|s| s.made).collect();
    let mut statistics = Statistics { counts: census.counts, ..Statistics::default() };
    statistics.lights = light_statistics(&loaded.lights, &scene.render.effects);
    statistics.media = media::of_scene(scene, loaded);
    statistics.scatters_again = carried::of_scene(scene).is_some() && scene.render.sheets.scattering().is_some();
    let brightness = &census.brightness;
    // Of light that is scattered again and again no bound is known.
    if !statistics.scatters_again {
        let radiances = &brightness.lights;
        statistics.lights.iter_mut().zip(radiances).for_each(|(light, radiance)| light.radiance = *radiance);
    }
    statistics.brightest = if statistics.scatters_again { f64::INFINITY } else { brightness.anything };
    statistics.reflectance = brightness.reflectance;
    statistics.switched = scene.render.effects.clone();
    statistics.spent = spent;
    statistics.exposure = scene.render.exposure;
    statistics.layers = scene.render.layers.names().map(str::to_owned).collect();
    statistics.tolerance = scene.render.tolerance;
    statistics = statistics.with_objects(&loaded.statistics, &planned, &made);
    let unsplatted =
        loaded.own.iter().filter(|native| !native.has_splats && loaded.objects[native.object].casts_shadow);
    unsplatted.for_each(|native| statistics.add_caster(native.optical_depth()));
    statistics.techniques = techniques(scene);
    // Those that draw something; where nothing is translucent, one that has nothing to do.
    let idle = |t: &Technique| statistics.translucent_of(*t).is_none();
    match statistics.techniques.iter().all(idle) {
        true => statistics.techniques.truncate(1),
        false => statistics.techniques = statistics.techniques.iter().copied().filter(|t| !idle(t)).collect(),
    }
    let materials = loaded.own.iter().map(|o| &loaded.materials[scene.objects[o.object].material]);
    let unequal = |m: &Material| m.extinction_rgb.iter().any(|e| *e != m.extinction_rgb[0]);
    statistics.counts.colored_extinction |= materials.into_iter().any(unequal);
    let bends = |o: &&SceneObject| (row(technique_of(o, scene)).bends)(scene).is_ok();
    statistics.lit_as_drawn = carried::of_scene(scene).is_some();
    let is_bent = visible(scene).filter(bends).any(|o| loaded.materials[o.material].bounds_matter());
    probe_shadows(scene, loaded, is_bent, &mut statistics);
    // Objects come into view in other frames, are carried light through, are drawn by chance, and are shown by layers whatever light they send.
    statistics.objects_stay = !objects_may_go
        || scene.frames.is_some()
        || statistics.lit_as_drawn
        || statistics.techniques.iter().any(|t| row(*t).is_random)
        || !statistics.layers.is_empty();
    let shadowing = Shadowing::new(scene, loaded, statistics.lit_as_drawn);
    statistics.objects = facts::object_facts(scene, loaded, &shadowing, &brightness.objects, &statistics);
    let mut plan = plan(&statistics);
    // Their causes are gone, which is no news.
    let is_told = |effect: &Effect| effect.is_absent && left_out.iter().any(|old| old.what == effect.what);
    plan.effects.retain(|effect| !is_told(effect));
    plan.effects.splice(0..0, left_out.iter().cloned());
    plan.bends = is_bent;
    plan.by = scene.objects.iter().map(|o| technique_of(o, scene)).collect();
    plan.exact = plan.by.iter().map(|by| row(*by).meets_discs).collect();
    plan.skips_hidden = visible(scene).all(|o| row(technique_of(o, scene)).skips_hidden);
    let skips_behind = matches!(techniques(scene)[..], [alone] if row(alone).skips_behind_finished);
    plan.skips_behind_finished = plan.skips_hidden && skips_behind;
    plan.is_own = vec![false; scene.objects.len()];
    loaded.own.iter().for_each(|native| plan.is_own[native.object] = true);
    let draws = |by: &Technique| row(*by).draws_splats && !statistics.lit_as_drawn;
    plan.draws = plan.by.iter().zip(&plan.is_own).map(|(by, is_own)| draws(by) && !is_own).collect();
    techniques(scene).into_iter().for_each(|t| (row(t).plans)(scene, loaded, &mut plan));
    plan.estimates = settle::all_estimates(scene, &loaded.facts);
    plan.compared = scene.render.choice.clone().unwrap_or_default();
    Ok(Effects { statistics, plan, census, shadowing: Some(shadowing) })
}

/// Finds how much each light can lose, where it may cast shadows.
fn probe_shadows(scene: &Scene, loaded: &Loaded, is_bent: bool, statistics: &mut Statistics) {
    // Bent light, and light that slabs carry, comes from what is out of view; other frames of an animation have other views.
    let leaves_view = is_bent || statistics.lit_as_drawn || scene.frames.is_some();
    let probe = Probe::new(loaded, leaves_view);
    let points = light_points(&loaded.lights);
    for (k, light) in statistics.lights.iter_mut().enumerate().filter(|(_, light)| light.may_shadow()) {
        let opacities =
            points.iter().filter(|point| point.light_index == k).map(|point| probe.greatest_opacity(&point.light));
        light.opacity = opacities.fold(0.0, f64::max);
    }
}

/// Footprints keep their pixel rectangles in 16 bits.
fn check_samples(scene: &Scene) -> Result<(), Error> {
    let longest = scene.camera.size[0].max(scene.camera.size[1]);
    let needed = u64::from(longest) * u64::from(scene.render.antialias);
    let limit = u64::from(u16::MAX);
    let hint = "use a smaller camera.size or render.antialias";
    Exceeded::check("the longer side of the image", needed, limit, "samples", hint).map_err(Error::Limit)
}

/// Reads every visible object whose file was not read before, chooses its technique and form, and converts it.
///
/// # Errors
/// See [`crate::render`].
pub fn load(scene: &Scene, context: Context<'_>) -> Result<Loaded, Error> {
    let (scene, _) = settled(scene, context)?;
    load_measured(&scene, context, &mut CostRecord::default())
}

/// [`load`] with entries in the cost record: reading, and conversion where something is converted.
pub(crate) fn load_measured(scene: &Scene, context: Context<'_>, cost: &mut CostRecord) -> Result<Loaded, Error> {
    let looks = |object: &SceneObject| row(technique_of(object, scene)).form.is_some();
    // The work on forms other than splats is not known yet; assume that each is present.
    let unknown = Translucent::unknown(scene);
    let steps = techniques(scene).into_iter().flat_map(|t| row(t).steps);
    let beside: Vec<Count> = steps.flat_map(|step| (step.counts)(scene, &unknown)).collect();
    let inputs = load::read(scene, context, &looks, &beside, cost)?;
    let by = visible(scene).map(|o| technique_of(o, scene));
    let planned = choose(inputs.statistics.iter().zip(by), &inputs.light_statistics());
    let spare = carried::of_scene(scene).map(|carries| {
        move |natives: &[Own], planned: &[PlannedObject], statistics: &[ObjectStatistics], lights: &[SceneLight]| {
            carried::is_all(
                carries,
                &Matter { scene, own: natives, planned, cloud: None, camera: &scene.camera },
                statistics,
                lights,
            )
        }
    });
    inputs.convert(planned, spare.as_ref().map(|spare| spare as &Spare<'_>), &beside, cost)
}

fn visible(scene: &Scene) -> impl Iterator<Item = &SceneObject> + Clone {
    scene.objects.iter().filter(|o| o.visible)
}
