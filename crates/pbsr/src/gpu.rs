//! Projection and ensemble average as a recording: sets of particles, one level after the other, that were uploaded, or made
//! on the device (`generate.rs`).
//!
//! A level is four dispatches: the depth buffer is cleared; each particle lowers the nearest depth of the pixels it
//! reaches; among the particles at that depth one wins, by a permutation of the particles that is another for each pixel
//! and set; the winner adds hit, colour and square of luminance. Where a device takes the least of 64 bits, depth and place
//! in the permutation are one number and a level is two: particles lower it, and each pixel adds whom it names
//! ([`Nearest`]). Sums are the integers of [`Ensemble`], in its own order
//! of pixels, so what comes back is added to an ensemble as sets that the CPU folded are.
//!
//! Deviations from the CPU: equals are ordered by another permutation, which is as fair; k takes a square root and a
//! division that a GPU may round otherwise, so a particle in a million is thinned out on one side alone. Only what is
//! shown as it is ([`Shading::Unlit`]) is folded: shading by lights and shadows, effects apart and depths are the CPU's.

mod generate;
mod twin;

pub use generate::{Generated, Inputs, record_generated};
pub(crate) use twin::{Maker, columns};
pub use twin::{Sources, Twin};

use crate::bins::{AREA, Tiling, thinning, thinning_key};
use crate::error::check;
use crate::project::Projector;
use crate::{Ensemble, Error, KeptSets, Object, Particles, Sampler, Scene};
use splat_core::{Shading, glam, rng};
use splat_shaders::layouts::{ParticleObject, ParticleView};
use splat_shaders::{Adapter, BufferId, Groups, Recording, kernels};

/// Threads of a workgroup.
const BLOCK: u32 = 256;
/// Words of a particle.
const PARTICLE_WORDS: usize = 7;
/// Words of a pixel's sums: hits, three sums, squares.
const SUM_WORDS: usize = 9;

/// What a recording makes room for.
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

/// How the nearest particle of a pixel is found; both find the same one.
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
    pub fn of(adapter: &Adapter) -> Self {
        if adapter.wide_atomics { Self::Wide } else { Self::Ranked }
    }
}

/// The recorded folding and the buffers that the caller meets.
#[derive(Debug, Clone, PartialEq)]
pub struct Recorded {
    /// What the device is to do.
    pub recording: Recording,
    /// The room it has.
    pub capacities: Capacities,
    /// Read back: the sums of the sets of this run.
    pub sums: BufferId,
    inputs: [BufferId; 5],
}

/// The bytes of some sets.
#[derive(Debug, Clone, PartialEq)]
pub struct Uploads {
    /// Particles in them.
    pub particles: u64,
    bytes: [Vec<u8>; 5],
}

/// Records the folding of sets with this room.
///
/// # Errors
/// [`Error::Parameter`] for a size out of range.
pub fn record(capacities: Capacities, nearest: Nearest) -> Result<Recorded, Error> {
    let size = capacities.size;
    check(size.iter().all(|s| (1..=32768).contains(s)), "size", size, "1 to 32768 pixels a side")?;
    let pixels = (Tiling::new(size).tiles() * AREA) as u32;
    let mut recording = Recording::default();
    let r = &mut recording;
    let words = |n: u32, each: usize| 4 * u64::from(n) * each as u64;
    let view = r.input("view", size_of::<ParticleView>() as u64);
    let objects = r.input("objects", u64::from(capacities.objects) * size_of::<ParticleObject>() as u64);
    let limits = r.input("limits", words(pixels, 1));
    let sets = r.input("sets", words(capacities.levels, 3));
    let particles = r.input("particles", words(capacities.particles, PARTICLE_WORDS));
    let sums = r.scratch("sums", words(pixels, SUM_WORDS));
    let all_pixels = Groups::cover(pixels.div_ceil(BLOCK));
    r.dispatch(&kernels::PBSR_BEGIN, all_pixels, &[view, sums], &[]);
    let inputs = [view, objects, limits, sets, particles];
    match nearest {
        Nearest::Ranked => ranked(r, &capacities, pixels, inputs, sums),
        Nearest::Wide => wide(r, &capacities, pixels, inputs, sums),
    }
    r.read(sums);
    Ok(Recorded { recording, capacities, sums, inputs })
}

/// Workgroups over the particles of a set.
fn over_set(capacities: &Capacities) -> Groups {
    Groups::cover(capacities.of_set.div_ceil(BLOCK))
}

/// Four dispatches a level.
fn ranked(r: &mut Recording, capacities: &Capacities, pixels: u32, inputs: [BufferId; 5], sums: BufferId) {
    let [view, objects, limits, sets, particles] = inputs;
    let (all_pixels, set) = (Groups::cover(pixels.div_ceil(BLOCK)), over_set(capacities));
    let footings = r.scratch("footings", 12 * u64::from(capacities.of_set));
    let [nearest, winners] = ["nearest", "winners"].map(|name| r.scratch(name, 4 * u64::from(pixels)));
    for level in 0..capacities.levels {
        r.dispatch(&kernels::PBSR_CLEAR, all_pixels, &[view, limits, nearest, winners], &[]);
        let projected = [view, objects, sets, particles, footings, nearest];
        r.dispatch(&kernels::PBSR_PROJECT, set, &projected, &[level]);
        r.dispatch(&kernels::PBSR_RANK, set, &[view, sets, limits, footings, nearest, winners], &[level]);
        let added = [view, objects, sets, particles, footings, nearest, winners, sums];
        r.dispatch(&kernels::PBSR_ADD, set, &added, &[level]);
    }
}

/// Two dispatches a level.
fn wide(r: &mut Recording, capacities: &Capacities, pixels: u32, inputs: [BufferId; 5], sums: BufferId) {
    let [view, objects, limits, sets, particles] = inputs;
    let (all_pixels, set) = (Groups::cover(pixels.div_ceil(BLOCK)), over_set(capacities));
    let keys = r.scratch("keys", 8 * u64::from(pixels));
    r.dispatch(&kernels::PBSR_KEYS, all_pixels, &[view, limits, keys], &[]);
    for level in 0..capacities.levels {
        r.dispatch(&kernels::PBSR_NEAREST, set, &[view, objects, sets, particles, keys], &[level]);
        let gathered = [view, objects, sets, particles, limits, keys, sums];
        r.dispatch(&kernels::PBSR_GATHER, all_pixels, &gathered, &[level]);
    }
}

impl Recorded {
    /// Samples the sets `ensemble.levels()` and on, as many as the recording has levels, and puts them into bytes.
    ///
    /// # Errors
    /// [`Error::TooMuch`] when the recording has too little room: record again with what is needed.
    /// [`Error::Parameter`] for sizes that differ, for an object that is lit, or an ensemble that keeps more than beauty.
    pub fn uploads(&self, scene: &Scene<'_>, ensemble: &Ensemble) -> Result<Uploads, Error> {
        let [view, objects, limits] = self.surroundings(scene, ensemble)?;
        let (mut sets, mut particles) = (Vec::new(), Vec::new());
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
        Ok(Uploads { particles: count, bytes: [view, objects, limits, sets, particles] })
    }

    /// The bytes of view, objects and limits.
    fn surroundings(&self, scene: &Scene<'_>, ensemble: &Ensemble) -> Result<[Vec<u8>; 3], Error> {
        let size = self.capacities.size;
        check(scene.camera.size == size, "camera size", scene.camera.size, "the size of the recording")?;
        check(ensemble.size() == size, "ensemble size", ensemble.size(), "the size of the recording")?;
        check(ensemble.params.only_beauty(), "ensemble", ensemble.params, "beauty alone")?;
        let unlit = scene.objects.iter().all(|o| o.look.material.shading == Shading::Unlit);
        check(unlit, "objects", "a lit one", "unlit ones")?;
        room("objects", scene.objects.len(), self.capacities.objects)?;
        let view = bytemuck::bytes_of(&view_of(scene, ensemble)).to_vec();
        let objects: Vec<ParticleObject> = scene.objects.iter().map(|o| object_of(scene, o)).collect();
        let objects = bytemuck::cast_slice(&objects).to_vec();
        Ok([view, objects, limits(scene, &ensemble.tiling)?])
    }

    /// The uploads with the buffers that they go to.
    pub fn inputs<'a>(&self, uploads: &'a Uploads) -> [(BufferId, &'a [u8]); 5] {
        std::array::from_fn(|k| (self.inputs[k], &uploads.bytes[k][..]))
    }

    /// Adds what was read back of [`Recorded::sums`] to the ensemble that the uploads were made for.
    ///
    /// # Errors
    /// [`Error::Parameter`] for bytes that no run gave, or another ensemble.
    pub fn add(&self, sums: &[u8], ensemble: &mut Ensemble) -> Result<(), Error> {
        take_in(self.capacities, sums, ensemble)
    }
}

fn take_in(capacities: Capacities, sums: &[u8], ensemble: &mut Ensemble) -> Result<(), Error> {
    let mut more = Ensemble::new(capacities.size, &ensemble.params)?;
    let (pixels, _) = sums.as_chunks::<{ 4 * SUM_WORDS }>();
    check(pixels.len() >= more.hits.len(), "bytes read back", sums.len(), "the sums of all pixels")?;
    more.levels = capacities.levels;
    for (k, pixel) in pixels.iter().enumerate().take(more.hits.len()) {
        let words: [u32; SUM_WORDS] = bytemuck::pod_read_unaligned(pixel);
        let long = |w: usize| u64::from(words[w]) | u64::from(words[w + 1]) << 32;
        more.hits[k] = words[0];
        (0..3).for_each(|c| more.sums[3 * k + c] = long(1 + 2 * c) as i64);
        more.squares[k] = long(7);
    }
    ensemble.merge(&more)
}

fn room(what: &'static str, needed: usize, had: u32) -> Result<(), Error> {
    let (needed, had) = (needed as u64, u64::from(had));
    if needed > had { Err(Error::TooMuch { what, needed, had }) } else { Ok(()) }
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
    let (sampler, m) = (object.sampler, &object.look.material);
    let projector = Projector::new(scene.camera, sampler.origin(), &object.transform, sampler.cross_section());
    let wide = |v: glam::Vec3| v.extend(0.0).to_array();
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
        emission: wide(m.emission.into()),
        share: [projector.share, 0.0, 0.0, 0.0],
    }
}

fn view_of(scene: &Scene<'_>, ensemble: &Ensemble) -> ParticleView {
    let size = scene.camera.size.map(|s| s as f32);
    ParticleView {
        middle: size.map(|s| 0.5 * s),
        size,
        focal: scene.camera.focal_px() as f32,
        inverse_unit: 1.0 / ensemble.params.unit(),
        orthographic: u32::from(scene.camera.is_orthographic()),
        columns: ensemble.tiling.columns as u32,
        pixels: ensemble.hits.len() as u32,
        unused: 0,
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
