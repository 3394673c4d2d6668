//! Objects of the scene → what their particles are sampled from.
//!
//! A set of particles has its opacity where a pixel covers the particles' cross-section; elsewhere they are thinned out or
//! widened. So each object gets the area of the smallest pixel on it.

mod sampler;

use super::refuse;
use super::unit::color_unit;
use crate::Error;
use crate::frame::Frame;
use crate::load::Loaded;
use crate::load::own::Own;
use crate::scene::{Technique, VolumeSampler};
use glam::DVec3;
use pbsr::{Appearance, KeptSets, Object, Sampler, SplatParams, SplatSampler};
use splat_core::{Camera, Cloud, DAabb, Similarity, SplatKind, rng};
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

/// Stage of the random numbers that seed the objects.
const SEEDS: u64 = 0x7061_7274;
/// Depth, in radii of an object, nearer than which particles are widened rather than made finer.
const NEAR: f64 = 0.5;

/// One object that particles come from.
pub(super) struct Source<'a> {
    name: String,
    data: Data<'a>,
    transform: Similarity,
    look: Appearance,
    /// Cross-section of the particles, units² of the data.
    cross_section: f64,
    seed: u64,
    volumes_by: VolumeSampler,
    /// Rank of the object in the scene.
    object: u32,
    /// A box in the world that holds it.
    bounds: DAabb,
    /// The largest channel of its colours.
    brightest_color: f32,
}

enum Data<'a> {
    Splats(Box<(Cloud, SplatParams)>),
    Own(&'a Own),
}

/// One object, ready to be drawn.
pub(super) struct Part<'a> {
    name: String,
    pub(super) particles: Particles<'a>,
    transform: Similarity,
    pub(super) look: Appearance,
    /// Rank of the object in the scene.
    pub(super) object: u32,
    /// A box in the world that holds it.
    pub(super) bounds: DAabb,
    /// The largest channel of its colours.
    pub(super) brightest_color: f32,
}

/// Where the particles of an object come from.
pub(super) enum Particles<'a> {
    Sampled(Box<dyn Sampler + 'a>),
    Kept(Arc<KeptSets>),
}

/// The parts in words, by the one that has most particles.
pub(super) fn named(parts: &[&Part<'_>]) -> String {
    let expected = |part: &&Part<'_>| part.object().sampler.expected_particles();
    match parts.iter().max_by(|a, b| expected(a).total_cmp(&expected(b))) {
        Some(most) if parts.len() == 1 => format!("object '{}'", crate::escape_controls(&most.name)),
        Some(most) => format!("all objects, most of all '{}'", crate::escape_controls(&most.name)),
        None => "no object".into(),
    }
}

impl Part<'_> {
    /// The object for the renderer.
    pub(super) fn object(&self) -> Object<'_> {
        let sampler: &dyn Sampler = match &self.particles {
            Particles::Sampled(sampler) => sampler.as_ref(),
            Particles::Kept(sets) => sets.as_ref(),
        };
        Object { sampler, transform: self.transform, look: self.look }
    }

    /// Whether some of it may lie at view depths in a range.
    pub(super) fn reaches(&self, range: &Range<f32>, camera: &Camera) -> bool {
        let depths = self.corners().into_iter().map(|p| camera.view_from_world(p).z as f32);
        let [near, far] = depths.fold([f32::INFINITY, f32::NEG_INFINITY], |[n, f], z| [n.min(z), f.max(z)]);
        far >= range.start && near <= range.end
    }

    /// Corners of a box in the world that holds the object.
    pub(super) fn corners(&self) -> [DVec3; 8] {
        self.bounds.corners()
    }
}

/// Everything translucent that is drawn by particles: objects by their own data, the splats of the others by object.
pub(super) fn sources<'a>(frame: &Frame<'a>) -> Vec<Source<'a>> {
    let loaded = frame.loaded;
    let mut splats = vec![Radii::default(); loaded.objects.len()];
    for (object, radius) in loaded.cloud.object.iter().zip(&loaded.cloud.radius) {
        let radii = &mut splats[*object as usize];
        radii.splats += 1;
        radii.sum += f64::from(*radius);
    }
    // What other techniques draw from data of its own is not drawn again.
    let natives = loaded.own.iter().filter(|native| native.technique == Technique::Particles);
    natives.map(|native| of_own(native, splats[native.object], frame)).chain(of_splats(frame)).collect()
}

/// The finest cross-section that a camera needs of an object, units² of the object.
fn finest_area(camera: &Camera, transform: &Similarity, bounds: DAabb) -> f64 {
    let center = transform.apply(bounds.center());
    let reach = 0.5 * bounds.diagonal() * transform.scale;
    pbsr::finest_pixel_area(camera, center, reach, NEAR) / transform.scale.powi(2)
}

fn seed(frame: &Frame<'_>, object: u32, kind: SplatKind) -> u64 {
    rng::bits(frame.settings.seed, SEEDS, u64::from(object), kind as u64)
}

/// Splats of an object, and the sum of their radii.
#[derive(Clone, Copy, Default)]
struct Radii {
    splats: u32,
    sum: f64,
}

fn of_own<'a>(native: &'a Own, radii: Radii, frame: &Frame<'a>) -> Source<'a> {
    let Loaded { objects, materials, .. } = frame.loaded;
    let material = materials[native.material];
    let brightest_color = native.brightest_color();
    // As its splats have it, where it has some.
    let radius = if radii.splats > 0 { radii.sum / f64::from(radii.splats) } else { native.radius };
    Source {
        name: objects[native.object].name.clone(),
        data: Data::Own(native),
        transform: native.transform,
        look: Appearance {
            material,
            kind: native.kind(),
            radius: radius as f32,
            shadow_coefficient: objects[native.object].shadow_coefficient,
            color_unit: color_unit(brightest_color),
        },
        cross_section: finest_area(&frame.camera, &native.transform, native.bounds),
        seed: seed(frame, native.object as u32, native.kind()),
        volumes_by: frame.settings.particles.volume_sampler,
        object: native.object as u32,
        bounds: native.world_box(),
        brightest_color,
    }
}

/// Translucent splats of the objects without data of their own; an object has one material and one kind of them.
fn of_splats<'a>(frame: &Frame<'a>) -> Vec<Source<'a>> {
    let Loaded { cloud, objects, materials, footprints, .. } = frame.loaded;
    let camera = &frame.camera;
    let mut of_object: BTreeMap<(u32, bool), Vec<u32>> = BTreeMap::new();
    for i in frame.translucent_in(cloud, Technique::Particles) {
        let k = i as usize;
        if cloud.cross_section[k] > 0.0 {
            of_object.entry((cloud.object[k], cloud.kind[k] == SplatKind::Surface)).or_default().push(i);
        }
    }
    let part = |((object, _), ids): ((u32, bool), Vec<u32>)| {
        let first = ids[0] as usize;
        let kind = cloud.kind[first];
        let mut splats = cloud.gather(&ids);
        let material = materials[cloud.material[first] as usize];
        let most = material.greatest_extinction();
        splats.cross_section.iter_mut().for_each(|k| *k *= most);
        let brightest_color = splats.color.as_flattened().iter().copied().fold(0.0, f32::max);
        let radius = splats.radius.iter().map(|r| f64::from(*r)).sum::<f64>() / splats.len() as f64;
        let bounds = splats.bounds();
        let center = splats.origin + bounds.center().as_dvec3();
        let reach = 0.5 * f64::from(bounds.diagonal()) + radius;
        let widest = DVec3::splat(f64::from(splats.radius.iter().copied().fold(0.0, f32::max)));
        let corner = |v: glam::Vec3| splats.origin + v.as_dvec3();
        let bounds = DAabb::new(corner(bounds.min) - widest, corner(bounds.max) + widest);
        let cross_section = pbsr::finest_pixel_area(camera, center, reach, NEAR);
        let seed = seed(frame, object, kind);
        let params = SplatParams {
            cross_section,
            surface_opacity: material.surface_opacity,
            footprints: footprints.clone(),
            seed,
            ..SplatParams::default()
        };
        let shadow_coefficient = objects[object as usize].shadow_coefficient * cloud.shadow_coefficient_of(first);
        let color_unit = color_unit(brightest_color);
        splats.color.as_flattened_mut().iter_mut().for_each(|c| *c /= color_unit);
        let look = Appearance { material, kind, radius: radius as f32, shadow_coefficient, color_unit };
        let data = Data::Splats(Box::new((splats, params)));
        let name = objects[object as usize].name.clone();
        let transform = Similarity::default();
        let volumes_by = VolumeSampler::Auto;
        Source { name, data, transform, look, cross_section, seed, volumes_by, object, bounds, brightest_color }
    };
    of_object.into_iter().map(part).collect()
}

impl<'a> Source<'a> {
    /// The object with data of its own, by its rank.
    pub(super) fn own_object(&self) -> Option<usize> {
        match &self.data {
            Data::Own(native) => Some(native.object),
            Data::Splats(_) => None,
        }
    }

    /// Cross-section of the particles, units² of the data.
    pub(super) fn cross_section(&self) -> f64 {
        self.cross_section
    }

    /// Makes particles fine enough for another view of an object with data of its own.
    pub(super) fn refine(&mut self, camera: &Camera, transform: &Similarity) {
        if let Data::Own(native) = &self.data {
            self.cross_section = self.cross_section.min(finest_area(camera, transform, native.bounds));
        }
    }

    /// The object, ready to be drawn, once where it is splats; `None`, with a warning, when nothing of it is found.
    pub(super) fn part(&mut self, warnings: &mut Vec<String>) -> Result<Option<Part<'a>>, Error> {
        let sampler = match &mut self.data {
            Data::Splats(splats) => {
                let (cloud, params) = splats.as_mut();
                SplatSampler::owning(std::mem::take(cloud), params).map(|s| Box::new(s) as Box<dyn Sampler>)
            }
            Data::Own(native) => {
                let native = *native;
                self.sampler(native, warnings)
            }
        };
        let name = || format!("object '{}'", crate::shown(&self.name));
        match sampler {
            Ok(sampler) => Ok(Some(self.part_of(Particles::Sampled(sampler)))),
            Err(pbsr::Error::Empty { reason, .. }) => {
                warnings.push(format!("{} has no particles: {reason}", name()));
                Ok(None)
            }
            Err(e) => Err(refuse(&name(), e)),
        }
    }

    /// The object with these particles.
    pub(super) fn part_of(&self, particles: Particles<'a>) -> Part<'a> {
        Part {
            name: self.name.clone(),
            particles,
            transform: self.transform,
            look: self.look,
            object: self.object,
            bounds: self.bounds,
            brightest_color: self.brightest_color,
        }
    }
}
