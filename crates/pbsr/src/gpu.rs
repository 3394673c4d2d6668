//! Projection and ensemble average as a recording: sets of particles, one level after the other, that were uploaded, or made
//! on the device (`generate.rs`).
//!
//! A level is four dispatches. The depth buffer is cleared. Each particle lowers the nearest depth of the pixels it
//! reaches. Among the particles at that depth one wins, by a permutation of the particles that differs for each pixel
//! and set. The winner adds hit, colour and square of luminance. If a device has 64-bit atomic minima, depth and place
//! in the permutation are one number and a level is two dispatches: particles lower the number, and each pixel adds the particle
//! that it names ([`Nearest`]). Sums are the integers of [`Ensemble`], in its own order
//! of pixels, so sums that are read back are added to an ensemble like sets that the CPU folded.
//!
//! If particles are lit, or layers beside beauty are kept, the visible particles are listed and shaded before they are added (`lit.rs`).
//!
//! Deviations from the CPU: particles of equal depth are ordered by another permutation, which is as fair. k takes a square root
//! and a division that a GPU may round otherwise, so a particle in a million is thinned out on one side alone. Depths, objects and
//! extinction by channel are left to the CPU.

mod generate;
mod lit;
mod twin;

pub use generate::{Generated, Inputs, record_generated};
pub use lit::{Lighting, ShadowOf, suits};
use lit::{Lit, Seen, Winners};
pub(crate) use twin::{Maker, columns};
pub use twin::{Sources, Twin};

use crate::error::check;
use crate::project::Projector;
use crate::project::bins::{thinning, thinning_key};
use crate::project::tiles::{AREA, Tiling};
use crate::{Ensemble, EnsembleParams, Error, KeptSets, Object, Particles, Sampler, Scene};
use splat_core::{Shading, glam, rng};
use splat_shaders::layouts::{ParticleObject, ParticleView};
use splat_shaders::{Adapter, BufferId, Groups, Overflow, Recording, kernels};
use std::borrow::Cow;

/// Threads of a workgroup.
const BLOCK: u32 = 256;
/// Words of a particle.
const PARTICLE_WORDS: usize = 7;

/// Capacities of a recording, in elements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Capacities {
    /// Width and height of the image, pixels, 1 to 32768 each.
    pub size: [u32; 2],
    /// Objects.
    pub objects: u32,
    /// Sets that are folded in one run.
    pub levels: u32,
    /// Particles of the largest set.
    pub of_set: u32,
    /// Particles of all sets of a run together.
    pub particles: u32,
}

impl Capacities {
    /// Pixels of all tiles.
    fn pixels(&self) -> u32 {
        (Tiling::new(self.size).tiles() * AREA) as u32
    }
}

/// Words of a pixel's sums: hits, two for each number that a hit brings, squares.
fn sum_words(params: &EnsembleParams) -> usize {
    3 + 2 * params.channels()
}

/// The method that finds the nearest particle of a pixel; both find the same one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Nearest {
    /// The nearest depth first, then the lowest rank at that depth: on any device.
    #[default]
    Ranked,
    /// Both at once, in numbers of 64 bits: particles are gone through once in place of three times.
    Wide,
}

impl Nearest {
    /// The better of those that a device can.
    pub fn for_adapter(adapter: &Adapter) -> Self {
        if adapter.wide_atomics { Self::Wide } else { Self::Ranked }
    }
}

/// The recorded folding and the buffers that the caller meets.
#[derive(Debug, Clone, PartialEq)]
pub struct Recorded {
    /// The commands of the device.
    pub recording: Recording,
    /// The room it has.
    pub capacities: Capacities,
    /// Read back: the sums of the sets of this run.
    pub sums: BufferId,
    inputs: [BufferId; 5],
    lit: Option<Lit>,
}

/// The bytes of some sets.
#[derive(Debug, Clone, PartialEq)]
pub struct Uploads {
    /// Particles in them.
    pub particles: u64,
    bytes: Vec<Vec<u8>>,
}

/// Records the folding of sets with these capacities: unlit and for beauty alone, or with `lighting`.
///
/// # Errors
/// [`Error::Parameter`] for a size out of range, and for an ensemble that keeps depths, objects or extinction by channel.
pub fn record(capacities: Capacities, nearest: Nearest, lighting: Option<&Lighting<'_>>) -> Result<Recorded, Error> {
    let size = capacities.size;
    check(size.iter().all(|s| (1..=32768).contains(s)), "size", size, "1 to 32768 pixels a side")?;
    let pixels = capacities.pixels();
    let mut recording = Recording::default();
    let r = &mut recording;
    let words = |n: u32, each: usize| 4 * u64::from(n) * each as u64;
    let view = r.input("view", size_of::<ParticleView>() as u64);
    let objects = r.input("objects", u64::from(capacities.objects) * size_of::<ParticleObject>() as u64);
    let limits = r.input("limits", words(pixels, 1));
    let sets = r.input("sets", words(capacities.levels, 3));
    let particles = r.input("particles", words(capacities.particles, PARTICLE_WORDS));
    let params = lighting.map_or_else(EnsembleParams::default, |l| l.params);
    let sums = r.scratch("sums", words(pixels, sum_words(&params)));
    let lit = match lighting {
        None => None,
        Some(lighting) => {
            let seen = Seen::record(r, &capacities);
            let lit = Lit::record(r, &capacities, lighting, &seen)?;
            Some((lighting, seen, lit))
        }
    };
    r.dispatch(&kernels::PBSR_BEGIN, Groups::cover(pixels.div_ceil(BLOCK)), &[view, sums], &[]);
    let inputs = [view, objects, limits, sets, particles];
    let levels = Levels { capacities: &capacities, inputs, sums, lit: lit.as_ref() };
    match nearest {
        Nearest::Ranked => levels.ranked(r),
        Nearest::Wide => levels.wide(r),
    }
    r.read(sums);
    let lit = lit.map(|(.., lit)| lit);
    Ok(Recorded { recording, capacities, sums, inputs, lit })
}

/// The dispatches of each level.
struct Levels<'a> {
    capacities: &'a Capacities,
    inputs: [BufferId; 5],
    sums: BufferId,
    lit: Option<&'a (&'a Lighting<'a>, Seen, Lit)>,
}

impl Levels<'_> {
    /// Workgroups over all pixels, and over the particles of a set.
    fn groups(&self) -> [Groups; 2] {
        [self.capacities.pixels(), self.capacities.of_set].map(|n| Groups::cover(n.div_ceil(BLOCK)))
    }

    /// Four dispatches a level, or light in place of the last.
    fn ranked(&self, r: &mut Recording) {
        let [view, objects, limits, sets, particles] = self.inputs;
        let [all_pixels, set] = self.groups();
        let pixels = u64::from(self.capacities.pixels());
        let footings = r.scratch("footings", 12 * u64::from(self.capacities.of_set));
        let [nearest, winners] = ["nearest", "winners"].map(|name| r.scratch(name, 4 * pixels));
        for level in 0..self.capacities.levels {
            r.dispatch(&kernels::PBSR_CLEAR, all_pixels, &[view, limits, nearest, winners], &[]);
            let projected = [view, objects, sets, particles, footings, nearest];
            r.dispatch(&kernels::PBSR_PROJECT, set, &projected, &[level]);
            r.dispatch(&kernels::PBSR_RANK, set, &[view, sets, limits, footings, nearest, winners], &[level]);
            if !self.light(r, &Winners::Ranked([limits, nearest, winners]), level) {
                let added = [view, objects, sets, particles, footings, nearest, winners, self.sums];
                r.dispatch(&kernels::PBSR_ADD, set, &added, &[level]);
            }
        }
    }

    /// Two dispatches a level, or light in place of the second.
    fn wide(&self, r: &mut Recording) {
        let [view, objects, limits, sets, particles] = self.inputs;
        let [all_pixels, set] = self.groups();
        let keys = r.scratch("keys", 8 * u64::from(self.capacities.pixels()));
        r.dispatch(&kernels::PBSR_KEYS, all_pixels, &[view, limits, keys], &[]);
        for level in 0..self.capacities.levels {
            r.dispatch(&kernels::PBSR_NEAREST, set, &[view, objects, sets, particles, keys], &[level]);
            if !self.light(r, &Winners::Wide([limits, keys]), level) {
                let gathered = [view, objects, sets, particles, limits, keys, self.sums];
                r.dispatch(&kernels::PBSR_GATHER, all_pixels, &gathered, &[level]);
            }
        }
    }

    /// Lights a level, if anything is lit.
    fn light(&self, r: &mut Recording, winners: &Winners, level: u32) -> bool {
        let Some((lighting, seen, lit)) = self.lit else { return false };
        let [view, objects, _, sets, particles] = self.inputs;
        lit.record_level(r, lighting, view, objects, sets, particles, self.sums, seen, winners, level);
        true
    }
}

impl Recorded {
    /// Samples the sets `ensemble.levels()` and on, as many as the recording has levels, and puts them into bytes.
    ///
    /// # Errors
    /// [`Error::Overflow`] when the recording has too little room: record again with what is needed.
    /// [`Error::Parameter`] for sizes that differ, for an object that is lit, or an ensemble that keeps more than beauty, where
    /// the recording was made for none.
    pub fn uploads(&self, scene: &Scene<'_>, ensemble: &Ensemble) -> Result<Uploads, Error> {
        let [view, objects, limits] = self.surroundings(scene, ensemble)?;
        let mut sets = Vec::new();
        let mut particles = Vec::new();
        for level in 0..u64::from(self.capacities.levels) {
            let set = u64::from(ensemble.levels) + level;
            let first = particles.len();
            scene.objects.iter().zip(0u32..).for_each(|(object, at)| sample(object, at, set, &mut particles));
            room("particles of one set", particles.len() - first, self.capacities.of_set)?;
            let seed = rng::bits(set, 0x4750_5500, 0, 0) as u32;
            sets.push([first as u32, (particles.len() - first) as u32, seed]);
        }
        room("particles", particles.len(), self.capacities.particles)?;
        let sets = bytemuck::cast_slice(&sets).to_vec();
        let count = particles.len() as u64;
        let particles = bytemuck::cast_slice(&particles).to_vec();
        Ok(Uploads { particles: count, bytes: vec![view, objects, limits, sets, particles] })
    }

    /// The bytes of view, objects and limits.
    fn surroundings(&self, scene: &Scene<'_>, ensemble: &Ensemble) -> Result<[Vec<u8>; 3], Error> {
        let size = self.capacities.size;
        check(scene.camera.size == size, "camera size", scene.camera.size, "the size of the recording")?;
        check(ensemble.size() == size, "ensemble size", ensemble.size(), "the size of the recording")?;
        match &self.lit {
            Some(lit) => lit.check(ensemble)?,
            None => check(is_shown(scene, ensemble.params()), "scene", "lit", "unlit objects, and beauty alone")?,
        }
        room("objects", scene.objects.len(), self.capacities.objects)?;
        let view = bytemuck::bytes_of(&self.view_of(scene, ensemble)).to_vec();
        let objects: Vec<ParticleObject> = scene.objects.iter().map(|o| object_of(scene, o)).collect();
        let objects = bytemuck::cast_slice(&objects).to_vec();
        Ok([view, objects, limits(scene, &ensemble.tiling)?])
    }

    /// The uploads of a run with the buffers that they go to; the first run takes [`Recorded::tables`] beside them.
    pub fn inputs<'a>(&self, uploads: &'a Uploads) -> Inputs<'a> {
        let bytes = uploads.bytes.iter().map(|bytes| Cow::Borrowed(&bytes[..]));
        let nobody = self.lit.iter().map(|lit| lit.nobody()).map(|(buffer, bytes)| (buffer, Cow::Owned(bytes)));
        nobody.chain(self.inputs.into_iter().zip(bytes)).collect()
    }

    /// The inputs of light and of everything that stays the same from run to run. The first run takes them, beside the
    /// inputs of the shadows.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a scene that [`suits`] refuses, or of other lights than there is room for;
    /// [`Error::Core`] for more objects.
    pub fn tables(&self, scene: &Scene<'_>) -> Result<Inputs<'static>, Error> {
        self.lit.as_ref().map_or_else(|| Ok(Vec::new()), |lit| lit.tables(scene))
    }

    /// The inputs of the `light`th shadow ([`Lighting::shadows`]) as those of this recording.
    pub fn shadow_inputs<'a>(
        &self,
        light: usize,
        inputs: impl IntoIterator<Item = (BufferId, &'a [u8])>,
    ) -> impl Iterator<Item = (BufferId, Cow<'a, [u8]>)> {
        let joined = self.lit.as_ref().and_then(|lit| lit.shadows.get(light));
        let inputs = joined.map(|joined| joined.inputs(inputs));
        inputs.into_iter().flatten().map(|(buffer, bytes)| (buffer, Cow::Borrowed(bytes)))
    }

    fn view_of(&self, scene: &Scene<'_>, ensemble: &Ensemble) -> ParticleView {
        let size = scene.camera.size.map(|s| s as f32);
        let [world_x, world_y, world_z] = scene.camera.axes.map(|axis| axis.as_vec3().extend(0.0).to_array());
        ParticleView {
            world_x,
            world_y,
            world_z,
            middle: size.map(|s| 0.5 * s),
            size,
            focal: scene.camera.focal_px() as f32,
            inverse_unit: 1.0 / ensemble.params.unit(),
            orthographic: u32::from(scene.camera.is_orthographic()),
            columns: ensemble.tiling.columns as u32,
            pixels: ensemble.hits.len() as u32,
            at_once: self.capacities.seen().splats,
            channels: ensemble.params.channels() as u32,
            light_channels: ensemble.params.light_channels() as u32,
        }
    }

    /// Adds what was read back of [`Recorded::sums`] to the ensemble that the uploads were made for.
    ///
    /// # Errors
    /// [`Error::Parameter`] for bytes that no run gave, or another ensemble.
    pub fn add(&self, sums: &[u8], ensemble: &mut Ensemble) -> Result<(), Error> {
        take_in(self.capacities, sums, ensemble)
    }
}

/// Whether a scene's particles are shown as they are, and no more is kept than that.
pub fn is_shown(scene: &Scene<'_>, params: &EnsembleParams) -> bool {
    params.only_beauty() && scene.objects.iter().all(|o| o.look.material.shading == Shading::Unlit)
}

fn take_in(capacities: Capacities, sums: &[u8], ensemble: &mut Ensemble) -> Result<(), Error> {
    let mut more = Ensemble::new(capacities.size, &ensemble.params)?;
    let channels = ensemble.params.channels();
    let words = sum_words(&ensemble.params);
    let pixels = sums.chunks_exact(4 * words);
    check(pixels.len() >= more.hits.len(), "bytes read back", sums.len(), "the sums of all pixels")?;
    more.levels = capacities.levels;
    let word = |pixel: &[u8], w: usize| bytemuck::pod_read_unaligned::<u32>(&pixel[4 * w..4 * w + 4]);
    let long = |pixel: &[u8], w: usize| u64::from(word(pixel, w)) | u64::from(word(pixel, w + 1)) << 32;
    for (k, pixel) in pixels.enumerate().take(more.hits.len()) {
        more.hits[k] = word(pixel, 0);
        let numbers = more.sums[channels * k..][..channels].iter_mut();
        numbers.enumerate().for_each(|(c, sum)| *sum = long(pixel, 1 + 2 * c) as i64);
        more.squares[k] = long(pixel, words - 2);
    }
    ensemble.merge(&more)
}

fn room(what: &'static str, needed: usize, had: u32) -> Result<(), Error> {
    Ok(Overflow::check(what, needed as u64, had.into())?)
}

/// The particles of one object in a set, with the numbers that thin them out on the CPU.
fn sample(object: &Object<'_>, at: u32, set: u64, out: &mut Vec<[u32; PARTICLE_WORDS]>) {
    let mut scratch = Particles::default();
    let kept = KeptSets::new(object.sampler, set, 1);
    for run in 0..kept.chunks() {
        let key = thinning_key(at, set, run);
        let particles = kept.chunk(set, run, &mut scratch);
        let each = particles.position.iter().zip(&particles.normal).zip(&particles.color);
        out.extend(each.zip(0..).map(|(((position, normal), color), i)| {
            let [x, y, z] = position.to_array().map(f32::to_bits);
            [x, y, z, normal.bits(), color.bits(), thinning(key, i).to_bits(), at]
        }));
    }
}

fn object_of(scene: &Scene<'_>, object: &Object<'_>) -> ParticleObject {
    let sampler = object.sampler;
    let m = &object.look.material;
    let projector = Projector::new(scene.camera, sampler.origin(), &object.transform, sampler.cross_section());
    let wide = |v: glam::Vec3| v.extend(0.0).to_array();
    let kind = object.look.kind as u8;
    let [linear_x, linear_y, linear_z] = columns(&projector.linear);
    let [rotation_x, rotation_y, rotation_z] = columns(&projector.rotation);
    ParticleObject {
        linear_x,
        linear_y,
        linear_z,
        translation: wide(projector.translation),
        rotation_x,
        rotation_y,
        rotation_z,
        emission: glam::Vec3::from(m.emission).extend(object.look.color_unit).to_array(),
        share: [projector.share, object.look.radius, f32::from(kind), object.look.shadow_coefficient],
    }
}

/// Depths of what hides particles, by tile.
fn limits(scene: &Scene<'_>, tiling: &Tiling) -> Result<Vec<u8>, Error> {
    let mut limits = vec![f32::INFINITY; tiling.tiles() * AREA];
    if let Some(occluder) = scene.occluder {
        let [width, height] = tiling.size;
        check(occluder.depth.len() == width * height, "occluder", occluder.depth.len(), "a depth for each pixel")?;
        for (k, depth) in occluder.depth.iter().enumerate() {
            limits[tiling.index(k % width, k / width)] = *depth;
        }
    }
    Ok(bytemuck::cast_slice(&limits).to_vec())
}
