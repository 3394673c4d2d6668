//! The objects of a scene become one cloud in canonical order, with its tables.

pub(crate) mod object;

use crate::scene::Scene;
use crate::{Error, Progress, RenderOptions, normalize::normalize};
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
    /// What a user should know of the input, one sentence each.
    pub warnings: Vec<String>,
}

/// Reads and converts every visible object.
///
/// # Errors
/// See [`crate::render`].
pub fn load(scene: &Scene, options: &RenderOptions, progress: &Progress) -> Result<Loaded, Error> {
    let mut warnings = Vec::new();
    progress.add_total(scene.objects.len() as u64);
    let mut clouds = Vec::new();
    for (id, object) in scene.objects.iter().enumerate() {
        progress.tick(1).map_err(|_| Error::Cancelled)?;
        if object.visible {
            let used: u64 = clouds.iter().map(Cloud::bytes).sum();
            let context = object::Context { scene, options, id, used };
            clouds.push(object::convert(object, &context, &mut warnings)?);
        }
    }
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
        slice_thickness: scene.render.points.slice_thickness.map(|e| e * f64::from(-exponent).exp2()),
        normals: scene.objects.iter().any(|o| o.visible && object::needs_gradients(o, scene)),
        exponent,
        warnings,
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
