//! Sets that the device makes itself, and folds: nothing of a set is uploaded, and none leaves the device.
//!
//! Each chunk of each set draws its Poisson number from its own counter. Volumes count the arrivals that thinning keeps. One
//! scan over the chunks of all sets, objects and levels gives every particle its place, the same as among
//! uploaded particles. Then a workgroup makes each chunk, and projection continues as for uploaded sets. Particles of
//! samplers that have no twin are uploaded run by run: a run counts like a chunk, and its particles move to their places.
//!
//! Deviations from the CPU: a Poisson number takes logarithms in 32 bits, so in some chunks of 10⁵ it differs by one. A
//! place takes products and sums alone and has the CPU's bits. A normal and a colour are at most one step off.

use super::twin::{Maker, Sources, halves};
use super::{Capacities, Lighting, Lit, Nearest, PARTICLE_WORDS, Recorded, record, room, sample, take_in};
use crate::{Ensemble, Error, Scene};
use splat_shaders::layouts::{ParticleSource, ParticlesFound, Scan};
use splat_shaders::radix::{SCAN_BLOCK, Scanned};
use splat_shaders::{BufferId, Groups, Joined, Recording, Run, kernels};
use std::borrow::Cow;

/// Words of a chunk's arrivals: their number, and the state of its stream after that.
const ARRIVAL_WORDS: u64 = 3;

/// Inputs of a recording with the buffers that they go to.
pub type Inputs<'a> = Vec<(BufferId, Cow<'a, [u8]>)>;

/// The recorded making and folding of sets.
#[derive(Debug, Clone, PartialEq)]
pub struct Generated {
    /// The commands of the device.
    pub recording: Recording,
    /// The room it has.
    pub capacities: Capacities,
    /// Read back: the sums of the sets of this run.
    pub sums: BufferId,
    /// Read back: how many particles there are.
    pub found: BufferId,
    /// First particle, particles and seed of each set.
    pub sets: BufferId,
    /// The particles, as they are uploaded elsewhere.
    pub particles: BufferId,
    /// Of each chunk the number of arrivals and the state of its stream after it.
    pub arrivals: BufferId,
    scan: BufferId,
    /// Of each object its source and its tables.
    sources: Vec<(BufferId, Vec<BufferId>)>,
    given: Option<Given>,
    projection: Recorded,
    in_whole: Joined,
}

/// Particles of samplers without a twin, uploaded run by run.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Given {
    /// Of each part of each set of each object: place among the counts, first particle, particles.
    spans: BufferId,
    particles: BufferId,
    /// How many spans there are.
    parts: u32,
    /// Room for so many particles.
    room: u32,
}

impl Given {
    fn record(r: &mut Recording, capacities: &Capacities, sources: &Sources) -> Option<Self> {
        let chunks: u32 = sources.twins.iter().filter(|twin| twin.is_given()).map(|twin| twin.source.chunks).sum();
        let parts = chunks.saturating_mul(capacities.levels);
        let expected = f64::from(capacities.particles) * sources.given_share;
        let room = ((expected + 6.0 * expected.sqrt() + 64.0) as u32).min(capacities.particles);
        let bytes = 4 * PARTICLE_WORDS as u64 * u64::from(room);
        (chunks > 0).then(|| {
            let spans = r.input("spans", 12 * u64::from(parts));
            let particles = r.input("given", bytes);
            Self { spans, particles, parts, room }
        })
    }

    /// Samples the sets from `first` on, as many as there is room for.
    fn sample(
        &self,
        capacities: &Capacities,
        sources: &Sources,
        scene: &Scene<'_>,
        first: u64,
    ) -> Result<Inputs<'static>, Error> {
        let mut spans: Vec<[u32; 3]> = Vec::new();
        let mut particles: Vec<_> = Vec::new();
        for level in 0..capacities.levels {
            let objects = scene.objects.iter().zip(&sources.twins).zip(0u32..);
            for ((object, twin), at) in objects.filter(|((_, twin), _)| twin.is_given()) {
                let begin = particles.len();
                let source = &twin.source;
                sample(object, at, first + u64::from(level), &mut particles);
                let each = (particles.len() - begin).div_ceil(source.chunks as usize);
                let place = level * source.all_chunks + source.first_chunk;
                spans.extend((0..source.chunks).map(|chunk| {
                    let [from, to] = [chunk, chunk + 1].map(|c| (begin + c as usize * each).min(particles.len()));
                    [place + chunk, from as u32, (to - from) as u32]
                }));
            }
        }
        room("particles", particles.len(), self.room)?;
        let bytes = [bytemuck::cast_slice(&spans).to_vec(), bytemuck::cast_slice(&particles).to_vec()];
        Ok([self.spans, self.particles].into_iter().zip(bytes.map(Cow::Owned)).collect())
    }
}

/// Records the making of sets from these sources, and their folding, with this room.
///
/// # Errors
/// As [`record`].
pub fn record_generated(
    capacities: Capacities,
    nearest: Nearest,
    lighting: Option<&Lighting<'_>>,
    sources: &Sources,
) -> Result<Generated, Error> {
    let projection = record(capacities, nearest, lighting)?;
    let Capacities { levels, particles, of_set, .. } = capacities;
    let chunks = sources.chunks().saturating_mul(levels);
    let mut recording = Recording::default();
    let r = &mut recording;
    let scan = r.input("scan", size_of::<Scan>() as u64);
    let inputs: Vec<(BufferId, Vec<BufferId>)> = sources.twins.iter().map(|twin| twin.input(r)).collect();
    let given = Given::record(r, &capacities, sources);
    let arrivals = r.scratch("arrivals", 4 * ARRIVAL_WORDS * u64::from(chunks));
    let counts = Scanned::scratch(r, scan, ["counts", "count sums"], chunks);
    let particle_bytes = 4 * PARTICLE_WORDS as u64 * u64::from(particles);
    let particles = r.scratch("particles", particle_bytes);
    let sets = r.scratch("sets", 12 * u64::from(levels));
    let found = r.scratch("found", size_of::<ParticlesFound>() as u64);
    count(r, sources, &inputs, levels, [arrivals, counts.numbers]);
    if let Some(Given { spans, parts, .. }) = given {
        let each = Groups::cover(parts.div_ceil(super::BLOCK));
        r.dispatch(&kernels::PBSR_GIVEN_COUNT, each, &[spans, counts.numbers], &[parts]);
    }
    counts.record(r, Groups::cover(chunks.div_ceil(SCAN_BLOCK)));
    if let Some((source, _)) = inputs.first() {
        let buffers = [*source, scan, counts.numbers, sets, found];
        r.dispatch(&kernels::PBSR_SETS, Groups::cover(1), &buffers, &[capacities.particles, of_set]);
    }
    put(r, sources, &inputs, given, levels, arrivals, counts.numbers, particles);
    r.read(found);
    let [.., of_sets, of_particles] = projection.inputs;
    let in_whole = r.join(&projection.recording, &[(of_sets, sets), (of_particles, particles)]);
    let sums = in_whole.buffer(projection.sums);
    let sources = inputs;
    Ok(Generated {
        recording,
        capacities,
        sums,
        found,
        sets,
        particles,
        arrivals,
        scan,
        sources,
        given,
        projection,
        in_whole,
    })
}

/// The particles of all chunks, where they belong.
fn put(
    r: &mut Recording,
    sources: &Sources,
    inputs: &[(BufferId, Vec<BufferId>)],
    given: Option<Given>,
    levels: u32,
    arrivals: BufferId,
    counts: BufferId,
    particles: BufferId,
) {
    for (twin, (source, tables)) in sources.twins.iter().zip(inputs) {
        let kernel = match twin.maker {
            Maker::Mesh => &kernels::PBSR_MESH,
            Maker::Volume => &kernels::PBSR_VOLUME,
            Maker::Lattice => &kernels::PBSR_LATTICE,
            Maker::Splats => &kernels::PBSR_SPLATS,
            Maker::Processor => continue,
        };
        let mut buffers = vec![*source];
        buffers.extend(tables);
        buffers.extend([arrivals, counts, particles]);
        r.dispatch(kernel, Groups::cover(twin.source.chunks.saturating_mul(levels)), &buffers, &[]);
    }
    if let Some(Given { spans, particles: of_given, parts, .. }) = given {
        let put = [spans, of_given, counts, particles];
        r.dispatch(&kernels::PBSR_GIVEN, Groups::cover(parts), &put, &[parts]);
    }
}

/// How many particles each chunk of each set has.
fn count(
    r: &mut Recording,
    sources: &Sources,
    inputs: &[(BufferId, Vec<BufferId>)],
    levels: u32,
    outputs: [BufferId; 2],
) {
    let [arrivals, counts] = outputs;
    for (twin, (source, tables)) in sources.twins.iter().zip(inputs).filter(|(twin, _)| !twin.is_given()) {
        let each = twin.source.chunks.saturating_mul(levels);
        let arrive = [*source, tables[0], arrivals, counts];
        r.dispatch(&kernels::PBSR_ARRIVE, Groups::cover(each.div_ceil(super::BLOCK)), &arrive, &[]);
        let thinned = match twin.maker {
            Maker::Mesh | Maker::Splats | Maker::Processor => continue,
            Maker::Volume => &kernels::PBSR_VOLUME_COUNT,
            Maker::Lattice => &kernels::PBSR_LATTICE_COUNT,
        };
        let mut buffers = vec![*source];
        buffers.extend(tables);
        buffers.extend([arrivals, counts]);
        r.dispatch(thinned, Groups::cover(each), &buffers, &[]);
    }
}

impl super::Twin {
    /// The buffers of its source and tables.
    fn input(&self, r: &mut Recording) -> (BufferId, Vec<BufferId>) {
        let names: &[&'static str] = match self.maker {
            Maker::Mesh => &["chunks", "triangles", "vertices"],
            Maker::Volume => &["chunks", "cells", "values", "transfer"],
            Maker::Lattice => &["chunks", "cells", "values"],
            Maker::Splats => &["chunks", "splats", "kernels"],
            Maker::Processor => &[],
        };
        let source = r.input("source", size_of::<ParticleSource>() as u64);
        let bytes = self.tables.iter().map(|t| 4 * t.len() as u64);
        (source, names.iter().zip(bytes).map(|(name, bytes)| r.input(name, bytes)).collect())
    }
}

impl Generated {
    /// The inputs that stay the same from run to run; the first run takes them.
    ///
    /// # Errors
    /// [`Error::Overflow`] and [`Error::Parameter`] as [`Recorded::uploads`].
    pub fn tables<'a>(
        &self,
        sources: &'a Sources,
        scene: &Scene<'_>,
        ensemble: &Ensemble,
    ) -> Result<Inputs<'a>, Error> {
        room("objects", sources.twins.len(), self.capacities.objects)?;
        let around = self.projection.surroundings(scene, ensemble)?.map(Cow::Owned);
        let scan = Scan { count: sources.chunks().saturating_mul(self.capacities.levels), total: 0 };
        let mut inputs: Inputs<'a> = vec![(self.scan, Cow::Owned(bytemuck::bytes_of(&scan).to_vec()))];
        let around = self.projection.inputs.into_iter().zip(around).chain(self.projection.tables(scene)?);
        inputs.extend(around.map(|(buffer, bytes)| (self.in_whole.buffer(buffer), bytes)));
        for (twin, (_, buffers)) in sources.twins.iter().zip(&self.sources) {
            let tables = twin.tables.iter().map(|words| Cow::Borrowed(bytemuck::cast_slice(words)));
            inputs.extend(buffers.iter().copied().zip(tables));
        }
        Ok(inputs)
    }

    /// As [`Recorded::shadow_inputs`].
    pub fn shadow_inputs<'a>(
        &self,
        light: usize,
        inputs: impl IntoIterator<Item = (BufferId, &'a [u8])>,
    ) -> impl Iterator<Item = (BufferId, Cow<'a, [u8]>)> {
        let inputs = self.projection.shadow_inputs(light, inputs);
        inputs.map(|(buffer, bytes)| (self.in_whole.buffer(buffer), bytes))
    }

    /// The inputs of a run of the next sets, beside the tables: the numbers of the sets, and the particles that the device
    /// does not make.
    ///
    /// # Errors
    /// [`Error::Overflow`] when there is too little room for those: record again with what is needed.
    pub fn next(&self, sources: &Sources, scene: &Scene<'_>, ensemble: &Ensemble) -> Result<Inputs<'static>, Error> {
        let first = u64::from(ensemble.levels);
        let levels = self.capacities.levels;
        let of_object = |(twin, (buffer, _)): (&super::Twin, &(BufferId, Vec<BufferId>))| {
            let source = ParticleSource { first_set: halves(first), levels, ..twin.source };
            (*buffer, Cow::Owned(bytemuck::bytes_of(&source).to_vec()))
        };
        let mut inputs: Inputs<'static> = sources.twins.iter().zip(&self.sources).map(of_object).collect();
        let nobody = self.projection.lit.iter().map(Lit::nobody);
        inputs.extend(nobody.map(|(buffer, bytes)| (self.in_whole.buffer(buffer), Cow::Owned(bytes))));
        if let Some(given) = &self.given {
            inputs.extend(given.sample(&self.capacities, sources, scene, first)?);
        }
        Ok(inputs)
    }

    /// Adds what a run gave to the ensemble that its inputs were made for, and gives the number of its particles.
    ///
    /// # Errors
    /// [`Error::Overflow`] when there was too little room and nothing was folded: record again with what is needed.
    /// [`Error::Parameter`] for a run of another recording, or another ensemble.
    pub fn add(&self, run: &Run, ensemble: &mut Ensemble) -> Result<u64, Error> {
        let found = run.bytes(self.found).get(..size_of::<ParticlesFound>());
        let found = found.ok_or_else(|| Error::parameter("bytes read back", 0, "how many particles there are"))?;
        let ParticlesFound { total, most } = bytemuck::pod_read_unaligned(found);
        room("particles of one set", most as usize, self.capacities.of_set)?;
        room("particles", total as usize, self.capacities.particles)?;
        take_in(self.capacities, run.bytes(self.sums), ensemble)?;
        Ok(u64::from(total))
    }
}
