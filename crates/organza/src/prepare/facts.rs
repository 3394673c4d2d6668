//! Facts of the effects of each object once it is loaded.

use crate::brightness::ObjectBrightness;
use crate::choose::{changed_without, changed_without_color, row, technique_of};
use crate::load::Loaded;
use crate::scene::{EffectKind, Scene, SceneObject};
use crate::shadows::{Hiding, SEEN, Shadowing, View, hiding};
use crate::statistics::{ObjectFacts, ObjectStatistics, Statistics};
use glam::DVec3;
use splat_core::{DAabb, Material};

/// The optical depth along the middle of a splat is at least this share of that of its spacing.
const MIDDLE_OF_SPACING: f64 = 0.1;

/// Ways of a bent ray: `deferred_blend` follows it through twelve surfaces at most, and there is a way to the first of them.
const MOST_WAYS: f64 = 13.0;

/// The facts of every visible object; `statistics` hold what is known of everything else.
pub(super) fn object_facts(
    scene: &Scene,
    loaded: &Loaded,
    shadowing: &Shadowing,
    brightness: &[ObjectBrightness],
    statistics: &Statistics,
) -> Vec<ObjectFacts> {
    let bends = |rank: usize| {
        let object = &scene.objects[rank];
        object.visible && is_bent_by(scene, object) && loaded.materials[object.material].bends_light()
    };
    let is_bent = (0..scene.objects.len()).any(|rank| bends(rank) && shadowing.shown()[rank]);
    // Of rays that go anywhere, and of what stays in any case, nothing need be known.
    let view = View { shadowing, is_known: !is_bent && !statistics.objects_stay };
    // Bent rays show other things, light that is scattered again and again has no bound, and in the eye's map a thick object moves the places in other
    // media that are seen of them.
    let shown = |rank: usize| {
        let ObjectBrightness { sent, given_off, thickest_splat, .. } = brightness[rank];
        let shows_others =
            bends(rank) || statistics.brightest.is_infinite() || thickest_splat > MIDDLE_OF_SPACING * f64::from(SEEN);
        if shows_others { statistics.brightest } else { sent + given_off }
    };
    let is_thin = |rank: usize, depth: f64| {
        let material = &loaded.materials[scene.objects[rank].material];
        let is_within = |change: f64| change <= statistics.tolerance;
        let without_color = || {
            let stretched = depth * color_spread(material).max(f64::MIN_POSITIVE);
            changed_without_color(stretched, shown(rank), statistics).is_some_and(is_within)
        };
        changed_without(-libm::expm1(-depth), shown(rank), statistics).is_some_and(is_within)
            || EffectKind::Color.is_of(material) && without_color()
    };
    let hidings = hiding(loaded, &view, brightness, &is_thin);
    let longest = longest_way(scene, loaded, is_bent);
    let visible = scene.objects.iter().enumerate().filter(|(_, object)| object.visible);
    let facts = visible.zip(&loaded.statistics).map(|((rank, object), known)| {
        let material = &loaded.materials[object.material];
        let Hiding { is_in_view, view_depth, light_depths } = hidings[rank].clone();
        let [red, green, blue] = material.absorption_inside;
        let is_splats = loaded.own.iter().all(|native| native.object != rank);
        ObjectFacts {
            name: object.name.clone(),
            material: only_material(scene, object),
            causes: causes(scene, object, material, known),
            absorbs_colors: red != green || green != blue,
            absorption: f64::from(red.max(green).max(blue)) * longest,
            color_spread: color_spread(material),
            radiance: if is_splats { brightness[rank].sent } else { f64::INFINITY },
            shown: shown(rank),
            is_in_view,
            view_depth,
            light_depths,
        }
    });
    facts.collect()
}

/// Whether the technique of an object shows what its surfaces bound.
fn is_bent_by(scene: &Scene, object: &SceneObject) -> bool {
    (row(technique_of(object, scene)).bends)(scene).is_ok()
}

/// The kinds of effects of objects that an object is a cause of, and that its technique shows.
fn causes(scene: &Scene, object: &SceneObject, material: &Material, known: &ObjectStatistics) -> Vec<EffectKind> {
    let shows = |kind: EffectKind| match kind {
        EffectKind::Object => true,
        EffectKind::Bending | EffectKind::Dispersion | EffectKind::Absorption => is_bent_by(scene, object),
        EffectKind::Color => !known.opaque,
        EffectKind::Gradients => object.source.has_gradients() && !scene.lights.is_empty(),
        // Each kind by name, so that a new one of objects is not forgotten here.
        EffectKind::Light | EffectKind::Shadow | EffectKind::Soft => false,
        EffectKind::Scatter | EffectKind::Interreflection | EffectKind::Caustics => false,
        EffectKind::Translucency | EffectKind::Opaque | EffectKind::Layers => false,
    };
    let is_caused = |kind: EffectKind| {
        let of_any = || object.material_ids().any(|id| kind.is_of(&scene.materials[id].material));
        kind == EffectKind::Object || kind.is_of(material) || of_any()
    };
    EffectKind::ALL.into_iter().filter(|kind| shows(*kind) && is_caused(*kind)).collect()
}

/// The material of an object that has one alone, which no visible object with several has.
fn only_material(scene: &Scene, object: &SceneObject) -> Option<usize> {
    let lists_it = |other: &SceneObject| other.visible && other.materials.contains(&object.material);
    (object.materials.is_empty() && !scene.objects.iter().any(lists_it)).then_some(object.material)
}

/// By how much the extinction of a channel differs from the mean of all, at most, as a share of the largest.
fn color_spread(material: &Material) -> f64 {
    let without = EffectKind::Color.taken_from(material);
    let differences = material.extinction_rgb.iter().zip(without.extinction_rgb);
    let most = differences.map(|(channel, mean)| f64::from((channel - mean).abs())).fold(0.0, f64::max);
    let largest = f64::from(material.greatest_extinction());
    if largest > 0.0 { most / largest } else { 0.0 }
}

/// The longest way of a ray in what one object bounds, world units. A surface need not be closed, so each part of it may go through all that there is,
/// from the eye on. A straight ray has one way, which is cut into parts; a bent one has as many as surfaces that it is followed through.
fn longest_way(scene: &Scene, loaded: &Loaded, is_bent: bool) -> f64 {
    let absorbs =
        |object: &SceneObject| object.visible && EffectKind::Absorption.is_of(&loaded.materials[object.material]);
    if !scene.objects.iter().any(absorbs) {
        return 0.0;
    }
    let cloud = &loaded.cloud;
    let eye = DAabb::new(loaded.camera.position, loaded.camera.position);
    let objects = loaded.own.iter().fold(eye, |bounds, native| bounds.union(native.world_box()));
    let splat = |i: usize| {
        let reach = f64::from(cloud.radius[i].max(cloud.tangent_of(i).length()));
        DAabb::around(cloud.origin + cloud.position[i].as_dvec3(), DVec3::splat(reach))
    };
    let bounds = (0..cloud.len()).fold(objects, |bounds, i| bounds.union(splat(i)));
    let ways = if is_bent { MOST_WAYS } else { 1.0 };
    ways * bounds.size().length() * libm::exp2(f64::from(loaded.exponent))
}
