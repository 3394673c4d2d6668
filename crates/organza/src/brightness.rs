//! Bounds of radiance before anything is lit: of each light, of each object, and of the whole scene. The same pass over all splats bounds the opacity
//! of each object.

use crate::load::Loaded;
use crate::load::by_object::by_object;
use crate::load::own::Own;
use crate::scene::{Scene, light_points};
use glam::{DVec3, Vec3};
use splat_core::shade::LitBy;
use splat_core::{DAabb, Material, Shading, SplatKind};

/// Standard deviation of a splat over its radius, at least: so near its light comes.
const LEAST_DEVIATION: f64 = 0.25;

/// Units of optical depth in sums, which are whole numbers: those know no order of threads.
const UNIT: f64 = (1u64 << 29) as f64;

/// What is known of how bright a loaded scene can be.
#[derive(Clone)]
pub(crate) struct Brightness {
    /// The most radiance that comes of each light in any channel, W·m⁻²·sr⁻¹, scattered or reflected once: the irradiance at the nearest place of what
    /// receives it, all points of the light together, times the peak of its material. Infinite where a lamp may lie on a point without extent.
    pub(crate) lights: Vec<f64>,
    /// The most radiance that anything shows, the background among it.
    pub(crate) anything: f64,
    /// π times the most radiance that a surface sends of an irradiance of 1.
    pub(crate) reflectance: f64,
    /// The same of each object, by its rank.
    pub(crate) objects: Vec<ObjectBrightness>,
}

/// What is known of one object.
#[derive(Clone, Copy, Default)]
pub(crate) struct ObjectBrightness {
    /// The most radiance that it sends of all lights, and of ambient radiance.
    pub(crate) sent: f64,
    /// The most radiance that it has without light.
    pub(crate) given_off: f64,
    /// The greatest optical depth of one of its splats, in the channel that has most; infinite of what hides all.
    pub(crate) thickest_splat: f64,
    /// An optical depth that no line through all of its splats exceeds, in that channel.
    pub(crate) sum_of_splats: f64,
}

/// An object that receives light.
#[derive(Clone, Copy)]
struct Receiver {
    /// Where it may lie, in the world.
    bounds: DAabb,
    /// It receives 1/(d² + spread²) of a lamp.
    spread: f64,
    /// The most radiance that it sends of an irradiance of 1, 1/sr.
    response: f64,
    /// The same of a surface, or of a medium that is shaded as one; 0 of another medium.
    reflected: f64,
    /// The most radiance that it sends of an ambient radiance of 1.
    ambient: f64,
    /// The most radiance that it has of its own.
    given_off: f64,
    /// The greatest optical depth of a splat, and the sum of all in whole units.
    thickest: f64,
    depths: u64,
}

impl Receiver {
    const NOTHING: Self = Self {
        bounds: DAabb::EMPTY,
        spread: f64::INFINITY,
        response: 0.0,
        reflected: 0.0,
        ambient: 0.0,
        given_off: 0.0,
        thickest: 0.0,
        depths: 0,
    };

    fn join(&mut self, other: &Self) {
        self.bounds = self.bounds.union(other.bounds);
        self.spread = self.spread.min(other.spread);
        self.response = self.response.max(other.response);
        self.reflected = self.reflected.max(other.reflected);
        self.ambient = self.ambient.max(other.ambient);
        self.given_off = self.given_off.max(other.given_off);
        self.thickest = self.thickest.max(other.thickest);
        self.depths = self.depths.saturating_add(other.depths);
    }
}

/// How bright a loaded scene can be, before this background.
pub(crate) fn of_scene(scene: &Scene, loaded: &Loaded) -> Brightness {
    let mut of_objects = splats(loaded);
    let as_they_are: Vec<Receiver> = loaded.own.iter().map(|native| as_it_is(loaded, native)).collect();
    let points = light_points(&loaded.lights);
    let mut lights: Vec<f64> = vec![0.0; loaded.lights.len()];
    let mut sent = vec![0.0f64; of_objects.len()];
    let ranks = loaded.own.iter().map(|native| native.object);
    let receivers = of_objects.iter().zip(0..).chain(as_they_are.iter().zip(ranks));
    for (receiver, object) in receivers.filter(|(receiver, _)| receiver.response > 0.0) {
        let mut received = vec![0.0; loaded.lights.len()];
        for point in &points {
            let lit =
                LitBy { light: point.light, slide: loaded.images.slides[point.light_index].as_ref(), shadow: None };
            received[point.light_index] += lit.brightest_in(&receiver.bounds, receiver.spread);
        }
        for (brightest, received) in lights.iter_mut().zip(&received) {
            *brightest = brightest.max(received * receiver.response);
        }
        sent[object] = sent[object].max(received.iter().sum::<f64>() * receiver.response);
    }
    for (receiver, native) in as_they_are.iter().zip(&loaded.own) {
        of_objects[native.object].join(&Receiver { bounds: DAabb::EMPTY, ..*receiver });
    }
    let ambient = f64::from(scene.ambient.into_iter().fold(0.0, f32::max));
    let background = match &loaded.images.environment {
        Some(_) => loaded.images.brightest_environment,
        None => f64::from(scene.background.into_iter().fold(0.0, f32::max)),
    };
    let shown = of_objects.iter().zip(&sent).map(|(object, sent)| object.given_off + ambient * object.ambient + sent);
    let anything = shown.fold(background, f64::max);
    let reflected = of_objects.iter().map(|object| object.reflected).fold(0.0, f64::max);
    let objects = of_objects.iter().zip(&sent).map(|(object, sent)| ObjectBrightness {
        sent: ambient * object.ambient + sent,
        given_off: object.given_off,
        thickest_splat: object.thickest,
        sum_of_splats: object.depths as f64 / UNIT,
    });
    Brightness { lights, anything, reflectance: std::f64::consts::PI * reflected, objects: objects.collect() }
}

/// What an object is that is drawn from its own data. How much it hides splats do not tell.
fn as_it_is(loaded: &Loaded, native: &Own) -> Receiver {
    let material = &loaded.materials[native.material];
    let color = f64::from(native.brightest_color());
    let response = material.brightest(color, true);
    Receiver {
        bounds: native.world_box(),
        spread: 0.0,
        response,
        reflected: reflected(material, response),
        ambient: ambient_share(material, color),
        given_off: radiance_given_off(material, color),
        thickest: f64::INFINITY,
        depths: u64::MAX,
    }
}

/// The part of a response that is reflected by a surface.
fn reflected(material: &Material, response: f64) -> f64 {
    if material.shading == Shading::Phong { response } else { 0.0 }
}

/// The share of ambient radiance that a material of this colour sends.
fn ambient_share(material: &Material, color: f64) -> f64 {
    if material.shading == Shading::Unlit {
        return 0.0;
    }
    let reflectance = material.diffuse.max(material.single_scattering_albedo);
    color * f64::from(reflectance) * f64::from(material.ambient)
}

/// The radiance that a material of this colour has without light, in the channel that has most.
fn radiance_given_off(material: &Material, color: f64) -> f64 {
    let emission = f64::from(material.emission.into_iter().fold(0.0, f32::max));
    if material.shading == Shading::Unlit { emission + color } else { emission }
}

/// The splats of each object.
fn splats(loaded: &Loaded) -> Vec<Receiver> {
    let cloud = &loaded.cloud;
    let norms: Vec<f64> = loaded.footprints.layers().iter().map(|footprint| footprint.norm()).collect();
    let meet = |receiver: &mut Receiver, i: usize| receiver.join(&splat(loaded, &norms, i));
    by_object(cloud, loaded.objects.len(), &Receiver::NOTHING, meet, Receiver::join)
}

/// A splat; `norms` are those of the footprints.
fn splat(loaded: &Loaded, norms: &[f64], i: usize) -> Receiver {
    let cloud = &loaded.cloud;
    let position = cloud.origin + cloud.position[i].as_dvec3();
    let radius = f64::from(cloud.radius[i]);
    let material = &loaded.materials[cloud.material[i] as usize];
    let has_normal = cloud.kind[i] != SplatKind::Medium || cloud.shading_normal_of(i) != Vec3::ZERO;
    // Colours of Gaussians depend on where they are seen from.
    let is_known = cloud.gaussians.is_empty();
    let color = f64::from(if is_known { cloud.color[i].into_iter().fold(0.0, f32::max) } else { f32::MAX });
    let footprint = usize::from(cloud.footprint[i]);
    // A few texels of an image may hold all of its cross-section, and of a Gaussian opacity has the shape.
    let hides = cloud.kind[i] == SplatKind::Opaque || loaded.footprints.image(footprint).is_some() || !is_known;
    let extinction = f64::from(material.greatest_extinction());
    let cross_section = f64::from(cloud.cross_section[i]);
    let depth = if hides { f64::INFINITY } else { cross_section * extinction * norms[footprint] / (radius * radius) };
    let response = if material.shading == Shading::Unlit { 0.0 } else { material.brightest(color, has_normal) };
    Receiver {
        bounds: DAabb::around(position, DVec3::splat(radius)),
        spread: LEAST_DEVIATION * radius,
        response,
        reflected: reflected(material, response),
        ambient: ambient_share(material, color),
        given_off: radiance_given_off(material, color),
        thickest: depth,
        depths: libm::ceil(depth * UNIT) as u64,
    }
}
