//! Samplers as tables, from which a device makes the same sets: the same counters, so the same particles but for rounding.

use crate::Sampler;
use crate::sampler::{Poisson, runs};
use crate::scene::{Object, Scene};
use crate::stream::{REJECTED_FROM, Stage, rejection};
use splat_core::glam::Mat3;
use splat_core::rng;
use splat_shaders::layouts::ParticleSource;

/// Words of a chunk.
const CHUNK_WORDS: usize = 10;

/// Which kernels make the sets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Maker {
    /// Tables: triangles, vertices.
    Mesh,
    /// Tables: cells, values, pieces of the transfer function.
    Volume,
    /// Tables: cells, values.
    Lattice,
    /// Tables: splats, kernels.
    Splats,
    /// None: the processor samples, and gives its particles in as many parts of a set as there are chunks.
    Processor,
}

/// Particles of a part that are expected of a sampler without a twin.
const GIVEN: f64 = 4096.0;

/// A sampler as a device takes it.
#[derive(Debug, Clone, PartialEq)]
pub struct Twin {
    pub(crate) maker: Maker,
    pub(crate) source: ParticleSource,
    /// Chunks with their alias tables, then those of the maker.
    pub(crate) tables: Vec<Vec<u32>>,
}

impl Twin {
    pub(crate) fn new<T: Poisson>(
        maker: Maker,
        sampler: &T,
        source: ParticleSource,
        own_tables: Vec<Vec<u32>>,
        seed: u64,
        stage: Stage,
    ) -> Self {
        let blocks = &sampler.sets().blocks;
        let mut chunks: Vec<u32> = Vec::with_capacity(blocks.chunks() * CHUNK_WORDS + 2 * blocks.slots().len());
        let of_run = runs(sampler).into_iter().zip(0u32..);
        let runs = of_run.flat_map(|(run, rank)| run.chunks.clone().map(move |_| [run.chunks.start as u32, rank]));
        for ((first, elements, mean), [run_begin, run]) in blocks.spans().zip(runs) {
            let [whole, fraction] = [mean.floor(), mean.fract()];
            let numbers = if mean < REJECTED_FROM { [libm::exp(-mean), 0.0, 0.0, 0.0] } else { rejection(mean) };
            let [b, a, v_r, inverse_alpha] = numbers.map(|v| (v as f32).to_bits());
            let fraction = (fraction as f32).to_bits();
            let of_chunk = [first as u32, elements as u32, whole as u32, fraction];
            chunks.extend(of_chunk.into_iter().chain([b, a, v_r, inverse_alpha, run_begin, run]));
        }
        let slots_at = chunks.len() as u32;
        chunks.extend(blocks.slots().iter().flat_map(|(share, other)| [*share, u32::from(*other)]));
        let key = halves(rng::hash(seed, stage as u64));
        let source = ParticleSource { key, chunks: blocks.chunks() as u32, slots_at, ..source };
        let mut tables = vec![chunks];
        tables.extend(own_tables);
        Self { maker, source, tables }
    }
}

impl Twin {
    pub(crate) fn is_given(&self) -> bool {
        self.maker == Maker::Processor
    }
}

/// The twins of all samplers of a scene, in the order of its objects; what has none the processor samples.
#[derive(Debug, Clone, PartialEq)]
pub struct Sources {
    pub(crate) twins: Vec<Twin>,
    /// Share of all particles that is expected of samplers without a twin.
    pub(crate) given_share: f64,
}

impl Sources {
    /// `None` where there are no particles, or none that a device makes: sets are uploaded as they are.
    pub fn new(scene: &Scene<'_>) -> Option<Self> {
        let sampled = |sampler: &dyn Sampler| {
            let chunks = (sampler.expected_particles() / GIVEN).ceil() as u32 + 1;
            let source = ParticleSource { chunks, ..ParticleSource::default() };
            Twin { maker: Maker::Processor, source, tables: Vec::new() }
        };
        let twin = |o: &Object<'_>| o.sampler.twin().unwrap_or_else(|| sampled(o.sampler));
        let mut twins: Vec<Twin> = scene.objects.iter().map(twin).collect();
        let expected = |o: &Object<'_>| o.sampler.expected_particles();
        let total: f64 = scene.objects.iter().map(expected).sum();
        let of_given = scene.objects.iter().zip(&twins).filter(|(_, twin)| twin.is_given());
        let given_share = of_given.map(|(o, _)| expected(o)).sum::<f64>() / total.max(1.0);
        let all_chunks: u32 = twins.iter().map(|t| t.source.chunks).sum();
        let mut first_chunk = 0;
        for (twin, object) in twins.iter_mut().zip(0u32..) {
            let thinning = halves(rng::hash(u64::from(object), Stage::Thinning as u64));
            twin.source = ParticleSource { thinning, object, first_chunk, all_chunks, ..twin.source };
            first_chunk += twin.source.chunks;
        }
        let makes = twins.iter().any(|twin| !twin.is_given() && twin.source.chunks > 0);
        makes.then_some(Self { twins, given_share })
    }

    /// Whether the processor samples some of the particles.
    pub fn has_given(&self) -> bool {
        self.twins.iter().any(Twin::is_given)
    }

    /// Bytes of all tables.
    pub fn bytes(&self) -> u64 {
        self.twins.iter().flat_map(|t| &t.tables).map(|t| 4 * t.len() as u64).sum()
    }

    /// Bytes of the largest table.
    pub fn largest_bytes(&self) -> u64 {
        self.twins.iter().flat_map(|t| &t.tables).map(|t| 4 * t.len() as u64).max().unwrap_or(0)
    }

    /// Chunks of a set of all objects.
    pub(crate) fn chunks(&self) -> u32 {
        self.twins.first().map_or(0, |t| t.source.all_chunks)
    }
}

/// The columns of a matrix as kernels take them.
pub(crate) fn columns(m: &Mat3) -> [[f32; 4]; 3] {
    [m.x_axis, m.y_axis, m.z_axis].map(|v| v.extend(0.0).to_array())
}

/// The lower half, then the upper one.
pub(crate) fn halves(v: u64) -> [u32; 2] {
    [v as u32, (v >> 32) as u32]
}
