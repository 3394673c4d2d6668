//! Warnings about content that a picture would fail to show, each with its remedy: a scene without light, objects outside
//! the view, a picture of one colour. A warning is no error. An [animation] gets no such warnings, because its objects
//! come into view and fade.

mod keys;
mod small;

use crate::choose::row;
use crate::form::PlannedObject;
use crate::load::{Loaded, by_object::by_object, normalize::object_bounds, own::Own};
use crate::plan::{Effect, Plan};
use crate::scene::place;
use crate::scene::{Scene, SceneLight, SceneObject, Source};
use crate::shadows::{Coarse, TIMES, thickness_of};
use crate::{Layers, ShadowTable, escape_controls};
use glam::DVec3;
pub(crate) use keys::{idle_cells, without_part};
use splat_core::raster::objects_in_view;
use splat_core::shade::joint::MediumSpacing;
use splat_core::{DAabb, Object, Projection, SplatKind};

/// Share of splats in view that may be lit through cells that are too coarse for them, before that is told.
const MANY: f64 = 0.1;
/// Most cells of a side that a scene may ask for.
const MOST_CELLS: f64 = 16384.0;
/// Cells are proposed in steps of so many.
const CELLS_STEP: f64 = 64.0;
/// The share of the memory up to which cells are proposed: their bytes are an estimate.
const SURE: f64 = 0.75;
/// How many times the cells of a side have to grow for the picture to change by it.
const WORTH: f64 = 1.25;
/// Entries of a shadow map that take some seconds to build.
const COSTLY: f64 = 2e7;
/// Most objects outside the view that are told one by one.
const TOLD: usize = 4;
/// Optical depth of a spacing up to which the light of layers of splats is held to closed forms.
const THICKEST: f32 = 16.0;
/// Full angle of a lens, degrees, beyond which a pixel in the middle of the picture is wider than most splats.
const WIDEST_LENS: f64 = 150.0;
/// Optical depth up to which one splat alone tells how light falls off in it: its middle is right within a hundredth.
const LONE: f32 = 0.25;

/// What can be told of a scene before it is drawn, one sentence each.
pub(crate) fn of_scene(scene: &Scene, loaded: &Loaded) -> Vec<String> {
    // Points in the colours of their file are drawn without light, by a material behind those of the scene.
    let is_shown = loaded.materials.len() > scene.materials.len();
    let dark = without_light(scene).filter(|_| !is_shown).into_iter();
    if scene.frames.is_some() {
        return dark.collect();
    }
    let seen = seen(loaded);
    let unseen = outside(scene, loaded, &seen).into_iter().chain(small::too_small(scene, loaded, &seen));
    dark.chain(turned_away(loaded))
        .chain(unseen)
        .chain(too_thick(scene, loaded))
        .chain(wide_lens(scene, loaded))
        .collect()
}

/// A lens through which the resampling filter spreads media over what is empty beside them.
fn wide_lens(scene: &Scene, loaded: &Loaded) -> Option<String> {
    let Projection::Perspective { fov_y } = loaded.camera.projection else { return None };
    let [width, height] = loaded.camera.size.map(f64::from);
    let wider = (width / height).max(1.0);
    let angle = 2.0 * libm::atan(libm::tan(0.5 * fov_y) * wider).to_degrees();
    let has_media =
        loaded.cloud.kind.contains(&SplatKind::Medium) && loaded.planned.iter().any(PlannedObject::is_drawn_as_splats);
    (angle > WIDEST_LENS && has_media && scene.render.points.resampling_filter).then(|| {
        format!(
            "through a lens of {angle:.0}° the resampling filter spreads media over what is empty beside them: set \
             render.points.resampling_filter = false"
        )
    })
}

/// Objects that absorb inside, and lie in a light that casts shadows, which are those of surfaces alone.
pub(crate) fn clear_shadows<'a>(scene: &'a Scene, loaded: &'a Loaded) -> impl Iterator<Item = String> + 'a {
    let is_lit = loaded.lights.iter().any(|light| light.shadow && light.light.intensity != [0.0; 3]);
    let absorbs = |object: &&SceneObject| {
        let material = &scene.materials[object.material].material;
        object.visible && object.casts_shadow && material.absorption_inside != [0.0; 3]
    };
    scene.objects.iter().filter(move |_| is_lit).filter(absorbs).map(|object| {
        let name = escape_controls(&object.name);
        format!("object '{name}' absorbs light inside, but its shadow is that of its `opacity` alone")
    })
}

/// Effects that are called for and that no technique of the scene has.
pub(crate) fn lacking(plan: &Plan) -> impl Iterator<Item = String> + '_ {
    // Of lights that are scattered once a warning tells; what no technique has nobody can ask for.
    let can_be_had = |effect: &Effect| effect.kind.is_some_and(|kind| kind.fixed_because().is_none());
    let lacking = plan.effects.iter().filter(|effect| effect.is_lacking && plan.scattered_once == 0);
    let lacking = lacking.filter(move |effect| can_be_had(effect));
    lacking.map(|effect| {
        // The whole of what is displayed is no bound.
        let most = match effect.bound.number() {
            Some(bound) if bound < 1.0 => {
                format!(", which changes no displayed pixel by more than {:.2} %", 100.0 * bound)
            }
            _ => String::new(),
        };
        effect.reason.clone() + &most
    })
}

/// What a finished picture shows too little of.
pub(crate) fn of_picture(scene: &Scene, layers: &Layers) -> Option<String> {
    let beauty = layers.rgb("beauty").filter(|_| scene.frames.is_none())?;
    crate::output::doubt(beauty, scene.render.exposure)
}

fn without_light(scene: &Scene) -> Option<String> {
    scene.lacks_light().then(|| {
        "the scene has no light: add a [[light]], a `color` in [ambient], or a material with `emission` or shading = \
         \"unlit\""
            .to_owned()
    })
}

/// Flat lights that nothing lies before.
fn turned_away(loaded: &Loaded) -> Vec<String> {
    let cloud = &loaded.cloud;
    let around = |p: glam::Vec3| cloud.origin + p.as_dvec3();
    let splats = (!cloud.is_empty()).then(|| cloud.bounds()).map(|b| DAabb::new(around(b.min), around(b.max)));
    let boxes: Vec<DAabb> = loaded.own.iter().map(Own::world_box).chain(splats).collect();
    let unit = libm::exp2(f64::from(loaded.exponent));
    let warning = |light: &SceneLight| {
        let shape = &light.light.shape;
        let at = shape.place()?;
        let normal = shape.normal()?;
        // The corner of a box that lies farthest along the normal.
        let farthest = |b: &DAabb| DVec3::select(normal.cmpgt(DVec3::ZERO), b.max, b.min);
        let is_lit = boxes.iter().any(|b| (farthest(b) - at).dot(normal) > 0.0);
        (!is_lit && !boxes.is_empty()).then(|| {
            let at = place(at * unit);
            let along = place(normal);
            format!(
                "the flat light at {at} shines along {along}, away from all objects: turn its `normal`, or exchange `u` and `v`"
            )
        })
    };
    loaded.lights.iter().filter_map(warning).collect()
}

/// What is known of the medium of an object.
#[derive(Clone, Copy)]
struct Thickness {
    /// Greatest optical depth of a spacing, and that spacing.
    optical_depth: f32,
    spacing: f32,
    /// Of the middles of splats.
    bounds: DAabb,
}

impl Thickness {
    const NONE: Self = Self { optical_depth: 0.0, spacing: 0.0, bounds: DAabb::EMPTY };

    fn join(&mut self, other: &Self) {
        self.bounds = self.bounds.union(other.bounds);
        // Equal optical depths take the narrower spacing, so that the order of threads does not matter.
        let is_equal = other.optical_depth == self.optical_depth;
        if other.optical_depth > self.optical_depth || is_equal && other.spacing < self.spacing {
            self.optical_depth = other.optical_depth;
            self.spacing = other.spacing;
        }
    }
}

/// What is known of the medium of each object.
fn thicknesses(loaded: &Loaded) -> Vec<Thickness> {
    let meet = |medium: &mut Thickness, i: usize| {
        let Some(spacing) = MediumSpacing::of_splat(&loaded.cloud, &loaded.footprints, i) else { return };
        let place = loaded.cloud.position[i].as_dvec3();
        medium.join(&Thickness {
            optical_depth: thickness_of(loaded, i),
            spacing: spacing.width,
            bounds: DAabb::new(place, place),
        });
    };
    by_object(&loaded.cloud, loaded.objects.len(), &Thickness::NONE, meet, Thickness::join)
}

/// Media that are so thick that splats do not tell their light, or the maps of sheets that of their edges.
fn too_thick(scene: &Scene, loaded: &Loaded) -> Vec<String> {
    if scene.lacks_light() {
        return Vec::new();
    }
    let media = thicknesses(loaded);
    let unit = libm::exp2(f64::from(loaded.exponent));
    let told = |(id, (object, medium)): (usize, (&Object, &Thickness))| {
        let planned = loaded.planned.iter().find(|planned| planned.object == object.name)?;
        let is_body = matches!(scene.objects[id].source, Source::Medium(_));
        let (most, what) = if !planned.is_drawn_as_splats() {
            let thickest = row(planned.technique).thickest_body.filter(|_| is_body)?;
            (thickest, format!("by which `{}` shows dark frames along its edges", planned.technique.name()))
        } else if medium.is_lone() && medium.optical_depth > LONE {
            (LONE, "and is no wider than that".to_owned())
        } else {
            (THICKEST, "which is too much for its splats".to_owned())
        };
        (medium.optical_depth > most).then(|| {
            let spacing = f64::from(medium.spacing) * unit;
            let better = spacing * f64::from(most / medium.optical_depth);
            format!(
                "object '{}' has an optical depth of {:.3} in a spacing of {}, {what}: spacing = {} tells how its light falls off",
                escape_controls(&object.name),
                medium.optical_depth,
                rounded(spacing),
                rounded(better),
            )
        })
    };
    loaded.objects.iter().zip(&media).enumerate().filter_map(told).collect()
}

impl Thickness {
    /// Whether there is no more than a row of splats.
    fn is_lone(&self) -> bool {
        let size = (self.bounds.max - self.bounds.min).to_array();
        size.iter().filter(|side| **side < 1.5 * f64::from(self.spacing)).count() > 1
    }
}

/// Three digits of a length.
fn rounded(length: f64) -> f64 {
    let unit = libm::pow(10.0, 2.0 - libm::floor(libm::log10(length)));
    if unit.is_finite() { libm::round(length * unit) / unit } else { length }
}

/// Objects of which nothing lies in the view.
fn outside(scene: &Scene, loaded: &Loaded, seen: &[bool]) -> Vec<String> {
    let mut lost: Vec<(usize, DAabb)> = bounds(loaded, seen);
    // Back into the scene's unit.
    let unit = libm::exp2(f64::from(loaded.exponent));
    lost.iter_mut().for_each(|(_, b)| *b = DAabb::new(b.min * unit, b.max * unit));
    let camera = &scene.camera;
    let looks = format!("the camera at {} looks along {}", place(camera.position), place(camera.axes[2]));
    if !lost.is_empty() && !seen.contains(&true) {
        let hull = lost.iter().fold(DAabb::EMPTY, |hull, (_, b)| hull.union(*b));
        return vec![format!(
            "the camera sees nothing: all objects lie from {} to {}, and {looks}; set camera.target to {}",
            place(hull.min),
            place(hull.max),
            place(hull.center())
        )];
    }
    // The body of a lamp stands where its light is, seen or not.
    lost.retain(|(_, b)| !lights(loaded).any(|p| b.contains(p * unit)));
    let told = |(id, bounds): &(usize, DAabb)| {
        let name = escape_controls(&scene.objects[*id].name);
        let low = place(bounds.min);
        let high = place(bounds.max);
        format!(
            "object '{name}' lies outside the view, from {low} to {high}: {looks}; move either, or set visible = false"
        )
    };
    let more = lost.len().saturating_sub(TOLD);
    let rest = (more > 0).then(|| format!("{more} other objects lie outside the view as well"));
    lost.iter().take(TOLD).map(told).chain(rest).collect()
}

/// Where light comes from, in the normalized world.
fn lights(loaded: &Loaded) -> impl Iterator<Item = DVec3> {
    loaded.lights.iter().filter_map(|light| light.light.shape.place())
}

/// For each object whether some of it lies in the view.
fn seen(loaded: &Loaded) -> Vec<bool> {
    let view = &loaded.camera;
    let mut seen = objects_in_view(&loaded.cloud, view, loaded.objects.len());
    for native in &loaded.own {
        seen[native.object] |= view.may_see_hull(&native.world_box().corners());
    }
    seen
}

/// The objects that are not seen and not empty, with their bounds in the normalized world.
fn bounds(loaded: &Loaded, seen: &[bool]) -> Vec<(usize, DAabb)> {
    if seen.iter().all(|is_seen| *is_seen) {
        return Vec::new();
    }
    let boxes = object_bounds(&loaded.cloud, &loaded.own, seen.len());
    boxes.into_iter().enumerate().filter(|(id, b)| !seen[*id] && !b.is_empty()).collect()
}

/// Lights that are not scattered as often as was asked for.
pub(crate) fn of_scattering(plan: &Plan) -> Option<String> {
    let lights = match plan.scattered_once {
        0 => return None,
        1 => "a light is".to_owned(),
        n => format!("{n} lights are"),
    };
    Some(format!("{lights} scattered once, though render.sheets.scattering asks for more: `organza explain` says why"))
}

/// Shadow maps whose cells are seen in the picture; a table may take `max_bytes`.
pub(crate) fn of_cells(coarse: Coarse, max_bytes: u64) -> Option<String> {
    let Coarse { share, cells, better_cells, light, bytes } = coarse;
    let cells = f64::from(cells);
    let better = libm::ceil(better_cells / CELLS_STEP) * CELLS_STEP;
    // Bytes go with the number of cells at least; less than what is allowed is proposed, as that is an estimate.
    let fitting = cells * libm::sqrt(SURE * max_bytes as f64 / bytes.max(1) as f64);
    let most = libm::floor(fitting.min(MOST_CELLS) / CELLS_STEP) * CELLS_STEP;
    (share > MANY).then(|| {
        let percent = libm::round(100.0 * share);
        let limit = if most < MOST_CELLS { "that fit the memory" } else { "that a table may have" };
        let advice = if better <= most {
            format!("shadow_cells = {better} of that [[light]] leaves about a twentieth")
        } else if most >= WORTH * cells {
            let left = libm::round(100.0 * share * cells / most);
            format!("shadow_cells = {most} of that [[light]], the most {limit}, leave about {left} %")
        } else if most < MOST_CELLS {
            "finer cells do not fit the memory: a larger --max-memory, or a larger `spacing` of what casts thin shadows, helps".to_owned()
        } else {
            "no table has finer ones: a larger `spacing` of what casts thin shadows makes these softer, nothing else helps".to_owned()
        };
        format!(
            "shadows are coarse: about {percent} % of what splats show is lit off by more than the tolerance, most by light {light}, whose map has \
             {cells} cells a side: {advice}"
        )
    })
}

/// Shadow maps that memory made coarser, by what their cells follow from.
pub(crate) fn of_shadows(limits: &[tsm::Limit]) -> Option<String> {
    let coarse = limits.iter().filter(|limit| **limit == tsm::Limit::Memory).count();
    (coarse > 0).then(|| {
        let maps = if coarse == 1 { "a shadow map is" } else { "shadow maps are" };
        format!("{maps} coarser than the splats ask for, to fit the memory: a larger --max-memory makes them finer")
    })
}

/// The most costly table whose cells a scene asks for.
pub(crate) fn of_costly<'a>(tables: impl Iterator<Item = &'a ShadowTable>) -> Option<String> {
    let table = tables.max_by(|a, b| a.predicted.entries.total_cmp(&b.predicted.entries))?;
    let entries = table.predicted.entries;
    let times = entries / table.automatic.entries.max(1.0);
    (entries >= COSTLY && times >= TIMES).then(|| {
        let [millions, times] = [1e-6 * entries, times].map(libm::round);
        format!(
            "the cells that are asked for make {millions} million entries of a shadow map, {times} times those of cells = \"auto\", \
             and take as much longer to build"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_proposed_that_a_table_can_have() {
        let told = |share: f64, cells: u32, bytes: u64| {
            let better_cells = f64::from(cells) * share / 0.05;
            let coarse = Coarse { share, cells, better_cells, light: "0".to_owned(), bytes };
            of_cells(coarse, 4 << 30).unwrap_or_default()
        };
        assert_eq!(told(0.1, 1024, 1 << 20), "");
        assert!(told(0.2, 1024, 1 << 20).ends_with("shadow_cells = 4096 of that [[light]] leaves about a twentieth"));
        let most = told(0.5, 4096, 64 << 20);
        assert!(
            most.ends_with("shadow_cells = 16384 of that [[light]], the most that a table may have, leave about 13 %"),
            "{most}"
        );
        let fitting = told(0.5, 4096, 768 << 20);
        assert!(
            fitting.ends_with("shadow_cells = 8192 of that [[light]], the most that fit the memory, leave about 25 %"),
            "{fitting}"
        );
        assert!(told(0.5, 4096, 4 << 30).contains("larger --max-memory"));
        assert!(told(0.5, 16384, 1 << 20).contains("no table has finer ones"));
    }
}
