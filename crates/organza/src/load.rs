//! The objects of a scene become one cloud in canonical order, with its tables.

mod boxes;
pub(crate) mod by_object;
pub(crate) mod context;
pub(crate) mod files;
mod fit;
mod images;
pub(crate) mod input;
mod loading;
mod media_facts;
mod mesh_facts;
pub(crate) mod normalize;
pub(crate) mod object;
mod object_context;
pub(crate) mod own;
mod painted;
mod previews;

use crate::cost::{Count, before_conversion};
use crate::form::{Form, PlannedObject};
use crate::scene::{Scene, SceneLight, SceneObject, SwitchedEffect};
use crate::statistics::{LightStatistics, ObjectStatistics, SourceFacts};
use crate::{CostRecord, Error, SplatCount, pass};
use context::Context;
use convert::ColorScale;
pub(crate) use fit::placed;
use glam::DVec3;
use images::Images;
use loading::{Converting, Loading};
use normalize::normalize;
use object::Prepared;
pub(crate) use object_context::{BYTES_PER_LATTICE_POINT, BYTES_PER_SPLAT};
use own::Own;
use previews::Converted;

use splat_core::shade::Census;
use splat_core::{Camera, Clip, Cloud, DAabb, FootprintStack, Material, Object, Shading, SplatKind};
use std::cmp::Ordering;

/// A scene in memory, normalized by a power of two (see [`Loaded::exponent`]) and ready for a technique.
#[derive(Debug)]
pub struct Loaded {
    /// The splats, in canonical order. Splats of translucent objects in `own` are among them if they may cast
    /// shadows; those are not drawn.
    pub cloud: Cloud,
    /// Translucent objects in the form in which their technique takes them, where that is not splats.
    pub(crate) own: Vec<Own>,
    /// What the planner was told of every visible object.
    pub(crate) statistics: Vec<ObjectStatistics>,
    /// What was known of media and meshes.
    pub(crate) facts: SourceFacts,
    /// How each of them was to be drawn.
    pub(crate) planned: Vec<PlannedObject>,
    /// Materials by id.
    pub materials: Vec<Material>,
    /// Objects by id.
    pub objects: Vec<Object>,
    /// Footprints by id.
    pub footprints: FootprintStack,
    /// The camera.
    pub camera: Camera,
    /// What is made of images.
    pub(crate) images: Images,
    /// Lights, whole, in an order that does not depend on the file's.
    pub lights: Vec<SceneLight>,
    /// Requested slice thickness, in the scale of the cloud.
    pub slice_thickness: Option<f64>,
    /// Lengths were multiplied by 2^−exponent.
    pub exponent: i32,
    /// Splats of every visible object, as predicted and as made.
    pub splats: Vec<SplatCount>,
    /// Splats that every visible object would become, whether or not it does.
    pub(crate) convertible: Vec<u64>,
    /// Warnings about the input, one sentence each.
    pub warnings: Vec<String>,
    /// Data of the files that is not drawn, and conversions of the data, one sentence each.
    pub notes: Vec<String>,
    /// The scales behind the objects' colours.
    pub scales: Vec<ColorScale>,
}

/// All splats, while some of them stand for them, and what is told of their objects.
pub(crate) struct Everything {
    cloud: Cloud,
    splats: Vec<SplatCount>,
    statistics: Vec<ObjectStatistics>,
    planned: Vec<PlannedObject>,
    convertible: Vec<u64>,
}

impl Loaded {
    /// Takes the camera and the slice thickness from another scene. The scene may differ from the loaded one in these
    /// and in other render settings alone, so that the splats serve it.
    pub fn retarget(&mut self, scene: &Scene) {
        self.camera = scene.camera;
        self.camera.scale_world(libm::exp2(f64::from(self.exponent)).recip());
        self.slice_thickness = scaled_thickness(scene, self.exponent);
    }

    /// A box around each object of the scene and its splats, those too that were put aside, world units; empty where there is nothing.
    pub(crate) fn object_bounds(&self, aside: Option<&Everything>) -> Vec<DAabb> {
        let cloud = aside.map_or(&self.cloud, |everything| &everything.cloud);
        let scale = libm::exp2(f64::from(self.exponent));
        let world = |DAabb { min, max }: DAabb| DAabb::new(min * scale, max * scale);
        normalize::object_bounds(cloud, &self.own, self.objects.len()).into_iter().map(world).collect()
    }

    /// Takes the lights from a scene that differs from the loaded one in camera, lights and render settings alone, and what is known of its sources in these lights;
    /// no light has a slide.
    pub(crate) fn relight(&mut self, scene: &Scene, facts: SourceFacts) {
        let scale = libm::exp2(f64::from(self.exponent)).recip();
        self.lights = lights(scene);
        self.lights.iter_mut().for_each(|light| light.light = light.light.scaled(scale));
        self.facts = facts;
    }

    /// Keeps a share of the splats, above 0, at most 1, and gives back all of them; `None` where these stay.
    pub(crate) fn keep_share(&mut self, share: f64) -> Option<Everything> {
        if share >= 1.0 {
            return None;
        }
        let fewer = self.cloud.fewer(share);
        Some(self.put_aside(fewer))
    }

    /// Replaces the splats by fewer ones, and returns all of them.
    fn put_aside(&mut self, fewer: Cloud) -> Everything {
        let everything = Everything {
            cloud: std::mem::replace(&mut self.cloud, fewer),
            splats: self.splats.clone(),
            statistics: self.statistics.clone(),
            planned: self.planned.clone(),
            convertible: self.convertible.clone(),
        };
        count_anew(&mut self.splats, &self.cloud, &self.objects);
        everything
    }

    /// Takes back the splats of which it kept some.
    pub(crate) fn take_back(&mut self, everything: Option<Everything>) {
        if let Some(Everything { cloud, splats, statistics, planned, convertible }) = everything {
            self.cloud = cloud;
            self.splats = splats;
            self.statistics = statistics;
            self.planned = planned;
            self.convertible = convertible;
        }
    }

    /// Keeps a share of the splats whose middles lie in what a scene shows, which differs from the loaded one in that objects are hidden or cut; gives back
    /// all of them. `None` where it shows more than was loaded, or more than splats.
    pub(crate) fn keep_shown(&mut self, loaded_of: &Scene, scene: &Scene, share: f64) -> Option<Everything> {
        let mut pairs = loaded_of.objects.iter().zip(&scene.objects);
        let is_part = pairs.all(|(whole, part)| (whole.visible || !part.visible) && part.clip.starts_with(&whole.clip));
        if !self.own.is_empty() || loaded_of.objects.len() != scene.objects.len() || !is_part {
            return None;
        }
        let scale = libm::exp2(f64::from(self.exponent)).recip();
        let borders = scene.objects.iter().zip(&loaded_of.objects).map(|(part, whole)| {
            let regions = part.clip[whole.clip.len()..].iter().flat_map(Clip::half_spaces);
            let in_world = regions.map(|(normal, offset)| {
                let normal = part.transform.rotation * normal;
                (normal, scale * (offset * part.transform.scale + normal.dot(part.transform.translation)))
            });
            in_world.collect::<Vec<_>>()
        });
        let borders: Vec<_> = borders.collect();
        let is_shown = |i: &u32| {
            let object = self.cloud.object[*i as usize] as usize;
            let place = self.cloud.origin + self.cloud.position[*i as usize].as_dvec3();
            scene.objects[object].visible && borders[object].iter().all(|(normal, offset)| normal.dot(place) <= *offset)
        };
        let shown: Vec<u32> = (0..self.cloud.len() as u32).filter(is_shown).collect();
        let shown = self.cloud.gather(&shown);
        let everything = self.put_aside(if share < 1.0 { shown.fewer(share) } else { shown });
        let visible = loaded_of.objects.iter().zip(&scene.objects).filter(|(whole, _)| whole.visible);
        let stays: Vec<bool> = visible.map(|(_, part)| part.visible).collect();
        keep(&mut self.statistics, &stays);
        keep(&mut self.planned, &stays);
        keep(&mut self.splats, &stays);
        keep(&mut self.convertible, &stays);
        Some(everything)
    }

    /// Takes out what a scene lacks which differs from the loaded one in that some objects are not visible, and in what materials say. Returns
    /// whether splats were taken out.
    pub(crate) fn reduce(&mut self, loaded_of: &Scene, scene: &Scene) -> bool {
        for (material, stated) in self.materials.iter_mut().zip(&scene.materials) {
            *material = stated.material;
        }
        let is_gone = |rank: usize| loaded_of.objects[rank].visible && !scene.objects[rank].visible;
        if !(0..scene.objects.len()).any(is_gone) {
            return false;
        }
        let visible = loaded_of.objects.iter().enumerate().filter(|(_, object)| object.visible);
        let stays: Vec<bool> = visible.map(|(rank, _)| !is_gone(rank)).collect();
        keep(&mut self.statistics, &stays);
        keep(&mut self.planned, &stays);
        keep(&mut self.splats, &stays);
        keep(&mut self.convertible, &stays);
        self.own.retain(|native| !is_gone(native.object));
        let left: Vec<u32> =
            (0..self.cloud.len() as u32).filter(|i| !is_gone(self.cloud.object[*i as usize] as usize)).collect();
        self.cloud = self.cloud.gather(&left);
        true
    }

    /// The objects, of which those that are not opaque neither cast nor receive shadows.
    pub(crate) fn opaque_objects(&self) -> Vec<Object> {
        let mut objects = self.objects.clone();
        let mut hide =
            |object: usize| (objects[object].casts_shadow, objects[object].shadow_coefficient) = (false, 0.0);
        self.own.iter().for_each(|native| hide(native.object));
        let kinds = self.cloud.kind.iter().zip(&self.cloud.object);
        kinds.filter(|(kind, _)| **kind != SplatKind::Opaque).for_each(|(_, object)| hide(*object as usize));
        objects
    }

    /// The objects, of which opaque triangles cast no shadow; `None` where none of these casts one.
    pub(crate) fn beside_polygons(&self) -> Option<Vec<Object>> {
        let mut objects = self.objects.clone();
        let mut casts = false;
        for triangles in self.own.iter().filter(|data| data.form == Form::Polygons) {
            casts |= objects[triangles.object].casts_shadow;
            objects[triangles.object].casts_shadow = false;
        }
        casts.then_some(objects)
    }

    /// Whether anything but opaque triangles receives shadows.
    pub(crate) fn receives_beside_polygons(&self) -> bool {
        let mut objects = self.objects.clone();
        let (polygons, others): (Vec<&Own>, Vec<&Own>) = self.own.iter().partition(|data| data.form == Form::Polygons);
        polygons.iter().for_each(|data| objects[data.object].shadow_coefficient = 0.0);
        others.iter().any(|data| objects[data.object].shadow_coefficient > 0.0)
            || Census::new(&self.cloud, &self.materials, &objects, &self.footprints).receivers > 0
    }
}

/// Keeps the entries that stay.
fn keep<T>(entries: &mut Vec<T>, stays: &[bool]) {
    let mut stays = stays.iter();
    entries.retain(|_| stays.next().copied().unwrap_or(true));
}

fn scaled_thickness(scene: &Scene, exponent: i32) -> Option<f64> {
    scene.render.points.slice_thickness.map(|e| e * libm::exp2(f64::from(-exponent)))
}

/// Every visible object as it was read, before anything is converted.
pub(crate) struct Inputs<'a> {
    loading: Loading<'a>,
    prepared: Vec<Prepared<'a>>,
    images: Images,
    lights: Vec<SceneLight>,
    warnings: Vec<String>,
    /// What is known of each visible object, in the order of the scene.
    pub(crate) statistics: Vec<ObjectStatistics>,
    facts: SourceFacts,
}

/// The facts of the objects' data, before anything is converted. A file is read once: what reads it again takes it from `files`.
///
/// # Errors
/// Those of reading files.
pub(crate) fn source_facts(scene: &Scene, context: Context<'_>) -> Result<SourceFacts, Error> {
    let media = media_facts::media_facts(scene, context)?;
    let meshes = mesh_facts::mesh_facts(scene, context)?;
    // Only objects beside translucent meshes are asked for their boxes: nothing else reads points this early.
    let is_asked = meshes.iter().any(|mesh| mesh.is_translucent);
    let boxes = if is_asked { boxes::boxes(scene, context)? } else { vec![None; scene.objects.len()] };
    Ok(SourceFacts { media, meshes, boxes })
}

/// Whether the splats of objects that are drawn from their own data are not needed: asked with these, how all objects are drawn, what
/// is known of them, and the lights.
pub(crate) type Spare<'a> =
    dyn Fn(&[Own], &[PlannedObject], &[ObjectStatistics], &[SceneLight]) -> Result<bool, Error> + 'a;

/// Reads every visible object once and counts its splats; `looks` says of which objects it is asked how they could be drawn from their own data. `beside` is what techniques will make
/// beside splats.
pub(crate) fn read<'a>(
    scene: &'a Scene,
    context: Context<'a>,
    looks: &dyn Fn(&SceneObject) -> bool,
    beside: &[Count],
    cost: &mut CostRecord,
) -> Result<Inputs<'a>, Error> {
    let loading = Loading { scene, context };
    let lights = lights(scene);
    context.files.scales.take();
    // Whoever placed the camera and chose the techniques has read files already.
    let read_before = context.files.take_seconds();
    let (prepared, images) = cost.measure(pass::READ, |stage| {
        let prepared = loading.prepare(looks, beside)?;
        let images = loading.images(&lights)?;
        stage.items_in = prepared.len() as u64;
        stage.items_out = stage.items_in;
        let of_objects: u64 = prepared.iter().map(|p| p.input.bytes()[0]).sum();
        // What was read of images is no more than what was made of it.
        stage.bytes = of_objects + 2 * images.bytes();
        Ok::<_, Error>((prepared, images))
    })?;
    context.files.take_seconds();
    if let Some(stage) = cost.stages.last_mut() {
        stage.seconds += read_before;
    }
    let statistics = loading.statistics(&prepared);
    let facts = source_facts(scene, context)?;
    Ok(Inputs { loading, prepared, images, lights, warnings: context.files.mended(), statistics, facts })
}

impl Inputs<'_> {
    /// What the planner asks of all lights.
    pub(crate) fn light_statistics(&self) -> Vec<LightStatistics> {
        light_statistics(&self.lights, &self.loading.scene.render.effects)
    }

    /// Converts every object to the form that was chosen for it, and to splats where they are needed: `spare` is asked whether
    /// those of objects that are drawn from their own data are. `beside` is what techniques will make beside splats.
    pub(crate) fn convert(
        self,
        mut planned: Vec<PlannedObject>,
        spare: Option<&Spare<'_>>,
        beside: &[Count],
        cost: &mut CostRecord,
    ) -> Result<Loaded, Error> {
        let Self { loading, mut prepared, mut images, mut lights, mut warnings, statistics, facts } = self;
        let Loading { scene, context } = loading;
        let Context { files, options, progress } = context;
        let mut early = spare.map(|_| loading.natives(&mut prepared, &planned, &mut warnings)).transpose()?;
        if let (Some(natives), Some(spare)) = (&mut early, spare)
            && spare(natives, &planned, &statistics, &lights)?
        {
            planned.iter_mut().filter(|p| p.form.is_own()).for_each(|p| p.splats = None);
            natives.iter_mut().for_each(|native| native.has_splats = false);
        }
        let mut splats = loading.counts(&prepared, &planned)?;
        let convertible = prepared.iter().map(|p| p.prediction.splats).collect();
        let mut shares = loading.shares(&prepared);
        let materials = materials(scene, &prepared);
        let points = lights.iter().map(SceneLight::count).sum();
        let work = before_conversion(scene, &splats, &planned, points, beside);
        progress.plan(options.rates.stages(&work));
        let mut natives = early.map_or_else(|| loading.natives(&mut prepared, &planned, &mut warnings), Ok)?;
        let converted = planned.iter().filter(|p| p.splats.is_some()).count();
        let mut cloud = Cloud::default();
        if converted > 0 || natives.is_empty() {
            cloud = cost.measure(pass::CONVERT, |stage| {
                let Converting { clouds, is_known } =
                    loading.clouds(prepared, &planned, &natives, &mut splats, &mut warnings)?;
                let known = is_known.iter().filter(|known| **known).count();
                // They are as few as are drawn.
                shares.iter_mut().zip(is_known).filter(|(_, known)| *known).for_each(|(share, _)| *share = 1.0);
                let cloud = merge(clouds);
                stage.items_in = (converted - known) as u64;
                stage.items_out = cloud.len() as u64;
                stage.bytes = cloud.bytes();
                Ok::<_, Error>(cloud)
            })?;
        }
        let mut camera = scene.camera;
        let exponent = normalize(&mut cloud, &mut natives, &mut camera, &mut lights, &mut images.slides);
        cloud.canonicalize();
        let objects: Vec<Object> = scene.objects.iter().map(object::entry).collect();
        if scene.render.splat_share < 1.0 {
            let before = cloud.len();
            cloud = cloud.fewer_of_each(|object| shares[object]);
            if cloud.len() == before && shares.iter().any(|share| *share < 1.0) {
                warnings.push(UNCHANGED.to_owned());
            }
            count_anew(&mut splats, &cloud, &objects);
        }
        cloud.validate().map_err(|e| out_of_range(scene, &cloud, e))?;
        files.keep_converted(|| {
            let mut of_objects = vec![None; scene.objects.len()];
            loading.visible().zip(&planned).for_each(|((rank, _), plan)| of_objects[rank] = Some(plan.clone()));
            Converted { scene: scene.clone(), planned: of_objects, cloud: cloud.clone(), exponent }
        });
        warnings.extend(unseen(scene, &cloud, &materials, natives.is_empty()));
        Ok(Loaded {
            cloud,
            own: natives,
            statistics,
            facts,
            planned,
            materials,
            objects,
            footprints: scene.footprints.clone(),
            camera,
            images,
            lights,
            slice_thickness: scaled_thickness(scene, exponent),
            exponent,
            splats,
            convertible,
            warnings,
            scales: files.scales.take(),
            notes: files.notes().into_iter().chain(options.cache.iter().flat_map(|cache| cache.said())).collect(),
        })
    }
}

/// What is said of a share that leaves all splats.
const UNCHANGED: &str = "render.splat_share changes nothing: objects of up to 64 splats, 3D Gaussians, and what is drawn from its own data \
                         keep all that they have";

/// Takes the splats that are left of each visible object as those that were made.
fn count_anew(splats: &mut [SplatCount], cloud: &Cloud, objects: &[Object]) {
    let mut left = vec![0; objects.len()];
    cloud.object.iter().for_each(|object| left[*object as usize] += 1);
    for count in splats {
        let object = objects.iter().position(|object| object.name == count.object);
        count.made = object.map_or(0, |object| left[object]);
    }
}

/// Splats beyond what their numbers hold: sizes and places of the input are.
fn out_of_range(scene: &Scene, cloud: &Cloud, error: splat_core::Error) -> Error {
    let splat_core::Error::Invalid { element: "splat", index, .. } = &error else {
        return Error::Internal(error.to_string());
    };
    let object = cloud.object.get(*index).and_then(|o| scene.objects.get(*o as usize));
    let name = object.map_or_else(|| "an object".into(), |o| format!("object '{}'", crate::escape_controls(&o.name)));
    let file = object.and_then(|o| o.source.path()).map(|path| format!(", {}", crate::printable(path)));
    let hint = "use a scale, spacing or extinction with which sizes, areas and places stay within 1e38";
    Error::input(name + &file.unwrap_or_default(), error.to_string(), hint)
}

/// The materials of the scene, and after them the one of colours that are shown as they are, if there are any.
fn materials(scene: &Scene, prepared: &[Prepared<'_>]) -> Vec<Material> {
    let mut materials: Vec<Material> = scene.materials.iter().map(|m| m.material).collect();
    if let (true, Some(default)) = (prepared.iter().any(|p| p.as_it_is), materials.first().copied()) {
        materials.push(Material { shading: Shading::Unlit, ..default });
    }
    materials
}

/// What the planner asks of all lights.
pub(crate) fn light_statistics(lights: &[SceneLight], switched: &[SwitchedEffect]) -> Vec<LightStatistics> {
    lights.iter().map(|light| LightStatistics::of_light(light, switched)).collect()
}

/// What to say of splats that nothing is seen of, where there may be nothing else.
fn unseen(scene: &Scene, cloud: &Cloud, materials: &[Material], is_all: bool) -> Vec<String> {
    if cloud.is_empty() && is_all {
        return vec!["the scene has no splats: only the background is drawn".into()];
    }
    let faint = splat_core::optics::too_faint(cloud, materials, scene.objects.len());
    let names = faint.into_iter().map(|object| crate::shown(&scene.objects[object].name));
    names.map(|it| format!("object '{it}' is too faint to be seen: no splat has an optical depth above 2⁻⁴⁰")).collect()
}

/// One cloud around the least of all origins: a place that does not depend on the order of objects, and that moves with
/// the scene without being rounded.
fn merge(mut clouds: Vec<Cloud>) -> Cloud {
    if let [cloud] = &mut clouds[..] {
        return std::mem::take(cloud);
    }
    let key = |o: &DVec3| o.to_array();
    let origins = clouds.iter().filter(|c| !c.is_empty()).map(|c| c.origin);
    let least = origins.min_by(|a, b| key(a).partial_cmp(&key(b)).unwrap_or(Ordering::Equal));
    let mut merged = Cloud::new(least.unwrap_or(DVec3::ZERO));
    merged.reserve(clouds.iter().map(Cloud::len).sum());
    clouds.iter().for_each(|c| merged.append(c));
    merged
}

/// All lights, sorted by their bits so that the order of the file does not matter.
pub(crate) fn lights(scene: &Scene) -> Vec<SceneLight> {
    let mut lights = scene.lights.clone();
    lights.sort_by_cached_key(|l| (l.light.key(), l.shadow, l.samples, format!("{:?}", l.slide)));
    lights
}
