//! The interface of every source of particles (Tanaka 2012, STEP 1): independent sets, in chunks, from a counter.

use crate::Particles;
use crate::blocks::Blocks;
#[cfg(feature = "gpu")]
use crate::gpu::Twin;
use rayon::prelude::*;
use splat_core::glam::DVec3;
use std::ops::Range;

/// A source of statistically independent particle sets.
///
/// Chunk `c` of set `r` depends on (seed, r, c) alone. So sets need not be kept: a set can be made again, and any number
/// of threads makes the same. In one set, the particles of a sampler lie independently of each other. A region of
/// projected area A that faces the ray holds τ·A / [`Sampler::cross_section`] of them in the mean, where τ is the
/// optical depth of the surface or medium.
pub trait Sampler: Sync {
    /// World position that all particle positions are relative to.
    fn origin(&self) -> DVec3;

    /// Cross-section s of every particle, world units²: the set has its opacity where a pixel covers this area.
    /// Elsewhere the projection takes a share of the particles, or widens them, so that the opacity is the same.
    fn cross_section(&self) -> f64;

    /// Number of chunks of a set.
    fn chunks(&self) -> usize;

    /// Mean number of particles of a chunk.
    fn expected(&self, chunk: usize) -> f64;

    /// The particles of chunk `chunk` of set `set`: made in `scratch`, which is cleared first, or kept elsewhere.
    fn chunk<'a>(&'a self, set: u64, chunk: usize, scratch: &'a mut Particles) -> &'a Particles;

    /// Mean number of particles of a set.
    fn expected_particles(&self) -> f64 {
        (0..self.chunks()).map(|c| self.expected(c)).sum()
    }

    /// The tables from which a device makes the same sets, where it can; else its sets are uploaded.
    #[cfg(feature = "gpu")]
    fn twin(&self) -> Option<Twin> {
        None
    }
}

/// The common part of samplers with Poisson numbers of particles: elements with rates, in blocks.
#[derive(Debug, Clone, Default)]
pub(crate) struct PoissonSets {
    pub(crate) origin: DVec3,
    pub(crate) cross_section: f64,
    pub(crate) blocks: Blocks,
    /// Share of the blocks' arrivals that become particles, in the mean, where it is known.
    pub(crate) share: f64,
}

impl PoissonSets {
    /// Where every arrival becomes a particle.
    pub(crate) fn new(origin: DVec3, cross_section: f64, blocks: Blocks) -> Self {
        Self { origin, cross_section, blocks, share: 1.0 }
    }
}

/// A sampler whose sets are Poisson processes on blocks of elements.
pub(crate) trait Poisson: Sync {
    /// Rates, and where they are.
    fn sets(&self) -> &PoissonSets;

    /// Appends the particles of chunk `chunk` of set `set`.
    fn fill(&self, set: u64, chunk: usize, particles: &mut Particles);

    /// Tables from which a device makes the same sets; `None` if it cannot.
    #[cfg(feature = "gpu")]
    fn tables(&self) -> Option<Twin> {
        None
    }
}

impl<T: Poisson> Sampler for T {
    fn origin(&self) -> DVec3 {
        self.sets().origin
    }

    fn cross_section(&self) -> f64 {
        self.sets().cross_section
    }

    fn chunks(&self) -> usize {
        self.sets().blocks.chunks()
    }

    fn expected(&self, chunk: usize) -> f64 {
        self.sets().blocks.mean(chunk) * self.sets().share
    }

    fn chunk<'a>(&'a self, set: u64, chunk: usize, scratch: &'a mut Particles) -> &'a Particles {
        scratch.clear();
        scratch.reserve((self.expected(chunk) * 1.1) as usize + 64);
        self.fill(set, chunk, scratch);
        scratch
    }

    #[cfg(feature = "gpu")]
    fn twin(&self) -> Option<Twin> {
        self.tables()
    }
}

/// Particles of a run, in the mean, at least; the last has what is left.
const RUN_PARTICLES: f64 = 16384.0;

/// Chunks of a sampler that are projected one after the other. Their particles are numbered through, so that one kept
/// chunk in place of a run is thinned out by the same random numbers.
#[derive(Debug, Clone)]
pub(crate) struct Run {
    pub(crate) chunks: Range<usize>,
    /// Mean number of particles.
    pub(crate) expected: f64,
}

/// The runs of a sampler: each ends with the first chunk that makes it long enough.
pub(crate) fn runs(sampler: &dyn Sampler) -> Vec<Run> {
    let chunks = sampler.chunks();
    let mut runs = Vec::new();
    let mut run = Run { chunks: 0..0, expected: 0.0 };
    for c in 0..chunks {
        run.chunks.end = c + 1;
        run.expected += sampler.expected(c);
        if run.expected >= RUN_PARTICLES || run.chunks.end == chunks {
            let next = Run { chunks: c + 1..c + 1, expected: 0.0 };
            runs.push(std::mem::replace(&mut run, next));
        }
    }
    runs
}

/// Sets `first .. first + n` of another sampler, kept in memory: set r is kept set r mod n.
///
/// Kept sets serve objects that are seen from many places, or that move, without another sampling. Asking for more
/// sets than are kept repeats them, and the images of the same set are not independent.
#[derive(Debug, Clone)]
pub struct KeptSets {
    origin: DVec3,
    cross_section: f64,
    expected: Vec<f64>,
    sets: Vec<Vec<Particles>>,
}

impl KeptSets {
    /// Samples `n` ≥ 1 sets from `first` on, in parallel. Each run of chunks is joined to one.
    pub fn new(sampler: &dyn Sampler, first: u64, n: usize) -> Self {
        let runs = runs(sampler);
        let particles_of = |set: u64, run: &Run| {
            let mut particles = Particles::default();
            let mut scratch = Particles::default();
            particles.reserve((run.expected * 1.1) as usize + 64);
            run.chunks.clone().for_each(|c| particles.append(sampler.chunk(set, c, &mut scratch)));
            particles
        };
        let kept = |set: u64| runs.par_iter().map(|run| particles_of(set, run)).collect();
        Self {
            origin: sampler.origin(),
            cross_section: sampler.cross_section(),
            expected: runs.iter().map(|run| run.expected).collect(),
            sets: (0..n.max(1) as u64).map(|k| kept(first + k)).collect(),
        }
    }

    /// Particles kept.
    pub fn particles(&self) -> u64 {
        self.sets.iter().flatten().map(|p| p.len() as u64).sum()
    }

    /// Bytes kept.
    pub fn bytes(&self) -> u64 {
        self.particles() * Particles::BYTES as u64
    }
}

impl Sampler for KeptSets {
    fn origin(&self) -> DVec3 {
        self.origin
    }

    fn cross_section(&self) -> f64 {
        self.cross_section
    }

    fn chunks(&self) -> usize {
        self.expected.len()
    }

    fn expected(&self, chunk: usize) -> f64 {
        self.expected[chunk]
    }

    fn chunk<'a>(&'a self, set: u64, chunk: usize, _scratch: &'a mut Particles) -> &'a Particles {
        &self.sets[(set % self.sets.len() as u64) as usize][chunk]
    }
}
