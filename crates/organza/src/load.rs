//! The objects of a scene become one cloud in canonical order, with its tables.

pub(crate) mod object;

use crate::scene::Scene;
use crate::{Error, Progress, RenderOptions, normalize::normalize};
use convert::cost::Prediction;
use glam::DVec3;
use splat_core::{Camera, Cloud, FootprintStack, Light, Material, Object};
use std::cmp::Ordering;

/// A scene in memory, normalized by a power of two (see [`Loaded::exponent`]) and ready for a technique.
#[derive(Debug, Clone, PartialEq)]
pub struct Loaded {
    /// All splats in canonical order.
    pub cloud: Cloud,
    /// Materials by id.
    pub materials: Vec<Material>,
    /// Objects by id.
    pub objects: Vec<Object>,
    /// Footprints by id.
    pub footprints: FootprintStack,
    /// The camera.
    pub camera: Camera,
    /// Lights, extended ones as their points, in an order that does not depend on the file's.
    pub lights: Vec<Light>,
    /// For each light: whether it casts shadows.
    pub casts: Vec<bool>,
    /// Slice thickness asked for, in the scale of the cloud.
    pub slice_thickness: Option<f64>,
    /// Whether normals were computed from the gradients of some volume.
    pub normals: bool,
    /// Lengths were multiplied by 2^−exponent.
    pub exponent: i32,
    /// Splats of every visible object, as predicted and as made.
    pub splats: Vec<SplatCount>,
    /// What a user should know of the input, one sentence each.
    pub warnings: Vec<String>,
}

/// Splats of one object.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SplatCount {
    /// Name of the object.
    pub object: String,
    /// Splats counted from the input before the conversion.
    pub predicted: u64,
    /// Whether that is exact rather than an estimate.
    pub exact: bool,
    /// Splats made.
    pub made: u64,
}

impl SplatCount {
    fn predicted(object: &str, prediction: &Prediction) -> Self {
        let exact = prediction.at_most == Some(prediction.splats);
        Self { object: object.to_owned(), predicted: prediction.splats, exact, made: 0 }
    }
}

impl Loaded {
    /// Takes the size of the picture and the slice thickness from a scene whose splats are these.
    pub(crate) fn retarget(&mut self, scene: &Scene) {
        self.camera.size = scene.camera.size;
        self.slice_thickness = scaled_thickness(scene, self.exponent);
    }
}

fn scaled_thickness(scene: &Scene, exponent: i32) -> Option<f64> {
    scene.render.points.slice_thickness.map(|e| e * f64::from(-exponent).exp2())
}

/// Reads and converts every visible object.
///
/// # Errors
/// See [`crate::render`].
pub fn load(scene: &Scene, options: &RenderOptions, progress: &Progress) -> Result<Loaded, Error> {
    let mut warnings = Vec::new();
    let (clouds, splats) = clouds(scene, options, progress, &mut warnings)?;
    let mut cloud = merge(clouds);
    if cloud.is_empty() {
        warnings.push("the scene has no splats: only the background is drawn".into());
    }
    let mut camera = scene.camera;
    let (mut lights, casts) = lights(scene);
    let exponent = normalize(&mut cloud, &mut camera, &mut lights);
    cloud.canonicalize();
    cloud.validate().map_err(|e| Error::Internal(e.to_string()))?;
    Ok(Loaded {
        cloud,
        materials: scene.materials.iter().map(|m| m.material).collect(),
        objects: scene.objects.iter().map(object::entry).collect(),
        footprints: scene.footprints.clone(),
        camera,
        lights,
        casts,
        slice_thickness: scaled_thickness(scene, exponent),
        normals: scene.objects.iter().any(|o| o.visible && object::needs_gradients(o, scene)),
        exponent,
        splats,
        warnings,
    })
}

/// The clouds of all visible objects. First every object is read and its splats are counted, so that a scene that does
/// not fit is refused before anything is converted.
fn clouds(
    scene: &Scene,
    options: &RenderOptions,
    progress: &Progress,
    warnings: &mut Vec<String>,
) -> Result<(Vec<Cloud>, Vec<SplatCount>), Error> {
    let context = |id, used, made| object::Context { scene, options, progress, id, used, made };
    let visible = || scene.objects.iter().enumerate().filter(|(_, object)| object.visible);
    progress.add_total(visible().count() as u64);
    let mut prepared = Vec::new();
    let (mut splats, mut held) = (Vec::new(), 0);
    for (id, object) in visible() {
        progress.tick(1).map_err(|_| Error::Cancelled)?;
        let one = object::prepare(object, &context(id, 0, 0))?;
        splats.push(SplatCount::predicted(&object.name, &one.prediction));
        held += one.bytes();
        check_total(scene, options, held, &splats)?;
        prepared.push((id, object, one));
    }
    let mut clouds: Vec<Cloud> = Vec::new();
    for ((id, object, one), count) in prepared.into_iter().zip(&mut splats) {
        let used = clouds.iter().map(Cloud::bytes).sum();
        let made = clouds.iter().map(|c| c.len() as u64).sum();
        let cloud = object::convert(one, object, &context(id, used, made), warnings)?;
        count.made = cloud.len() as u64;
        clouds.push(cloud);
    }
    Ok((clouds, splats))
}

/// Refuses a scene whose objects together make too many splats for the memory beside the inputs, of `held` bytes, or for
/// the scene's own limit. Estimates count half, so that nothing is refused that would fit.
fn check_total(scene: &Scene, options: &RenderOptions, held: u64, splats: &[SplatCount]) -> Result<(), Error> {
    let needed: u64 = splats.iter().map(|s| if s.exact { s.predicted } else { s.predicted / 2 }).sum();
    let fits = options.max_memory.saturating_sub(held) / object::BYTES_PER_SPLAT;
    let limit = scene.render.max_points.map_or(fits, |asked| asked.min(fits));
    if needed <= limit {
        return Ok(());
    }
    let most = splats.iter().max_by_key(|s| s.predicted);
    let named = most.map(|s| format!(", most of them '{}' with {}", crate::escape_controls(&s.object), s.predicted));
    Err(Error::Limit {
        what: format!("the scene (before conversion{})", named.unwrap_or_default()),
        needed,
        limit,
        unit: "splats",
        hint: "use a larger spacing, or a larger --max-memory or render.max_points".into(),
    })
}

/// One cloud around the least of all origins: a place that does not depend on the order of objects, and that moves with
/// the scene without being rounded.
fn merge(clouds: Vec<Cloud>) -> Cloud {
    let key = |o: &DVec3| o.to_array();
    let origins = clouds.iter().filter(|c| !c.is_empty()).map(|c| c.origin);
    let least = origins.min_by(|a, b| key(a).partial_cmp(&key(b)).unwrap_or(Ordering::Equal));
    let mut all = Cloud::new(least.unwrap_or(DVec3::ZERO));
    all.reserve(clouds.iter().map(Cloud::len).sum());
    clouds.iter().for_each(|c| all.append(c));
    all
}

/// All point lights, sorted by their bits so that the order of the file does not matter.
fn lights(scene: &Scene) -> (Vec<Light>, Vec<bool>) {
    let mut all: Vec<(Light, bool)> =
        scene.lights.iter().flat_map(|l| l.points().into_iter().map(|p| (p, l.shadow))).collect();
    all.sort_by_cached_key(|(light, casts)| (light.bits(), *casts));
    all.into_iter().unzip()
}
