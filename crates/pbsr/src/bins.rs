//! Projected particles of one task, sorted by tile: a counting sort of a few thousand records in the nearest cache.

use crate::project::Projector;
use crate::stream::{Stage, scramble};
use crate::{PackedColor, PackedNormal, Particles, Sampler};
use splat_core::rng;

/// Side of a tile, pixels: its depths fit the first cache.
pub(crate) const TILE: usize = 64;

/// Pixels of a tile.
pub(crate) const AREA: usize = TILE * TILE;

/// One particle on one pixel.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Record {
    /// Pixel of the tile (12 bits), place within the pixel (two of 8 bits).
    place: u32,
    pub(crate) depth: f32,
    /// Counts the particles of the task.
    pub(crate) id: u32,
    pub(crate) normal: PackedNormal,
    pub(crate) color: PackedColor,
}

impl Record {
    #[inline(always)]
    pub(crate) fn pixel(&self) -> usize {
        (self.place & 0xfff) as usize
    }

    /// Place in the pixel, (0, 1).
    #[inline(always)]
    pub(crate) fn within(&self) -> [f32; 2] {
        [self.place >> 12, self.place >> 20].map(|v| ((v & 255) as f32 + 0.5) * (1.0 / 256.0))
    }
}

/// Tiles of an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Tiling {
    pub(crate) size: [usize; 2],
    pub(crate) columns: usize,
    pub(crate) rows: usize,
}

impl Tiling {
    pub(crate) fn new(size: [u32; 2]) -> Self {
        let size = size.map(|s| s as usize);
        Self { size, columns: size[0].div_ceil(TILE), rows: size[1].div_ceil(TILE) }
    }

    pub(crate) fn tiles(&self) -> usize {
        self.columns * self.rows
    }

    /// Where pixel (x, y) stands in tile order.
    pub(crate) fn index(&self, x: usize, y: usize) -> usize {
        (y / TILE * self.columns + x / TILE) * AREA + y % TILE * TILE + x % TILE
    }
}

/// Work of one task: some chunks of one set of one object.
#[derive(Debug, Default)]
pub(crate) struct Task {
    pub(crate) set: u64,
    pub(crate) object: u32,
    pub(crate) chunks: std::ops::Range<usize>,
    records: Vec<Record>,
    /// First record of each tile, and the end.
    starts: Vec<u32>,
    pub(crate) particles: u64,
}

/// What a task needs beside its own: kept by each thread.
#[derive(Default)]
pub(crate) struct Staging {
    particles: Particles,
    staged: Vec<(u32, Record)>,
}

impl Task {
    /// The records of a tile.
    #[inline]
    pub(crate) fn tile(&self, t: usize) -> &[Record] {
        &self.records[self.starts[t] as usize..self.starts[t + 1] as usize]
    }

    pub(crate) fn record(&self, i: u32) -> &Record {
        &self.records[i as usize]
    }

    /// Index of the first record of a tile.
    pub(crate) fn first(&self, t: usize) -> u32 {
        self.starts[t]
    }

    pub(crate) fn records(&self) -> u64 {
        self.records.len() as u64
    }

    pub(crate) fn bytes(&self) -> u64 {
        (self.records.capacity() * size_of::<Record>() + self.starts.capacity() * 4) as u64
    }

    /// Samples the chunks, projects and sorts.
    pub(crate) fn run(&mut self, sampler: &dyn Sampler, projector: &Projector, tiling: &Tiling, staging: &mut Staging) {
        let Staging { particles: scratch, staged } = staging;
        staged.clear();
        self.particles = 0;
        for chunk in self.chunks.clone() {
            let particles = sampler.chunk(self.set, chunk, scratch);
            let key = thinning_key(self.object, self.set, chunk);
            stage(particles, projector, tiling, key, self.particles as u32, staged);
            self.particles += particles.len() as u64;
        }
        self.sort(staged, tiling.tiles());
    }

    fn sort(&mut self, staged: &[(u32, Record)], tiles: usize) {
        self.starts.clear();
        self.starts.resize(tiles + 1, 0);
        staged.iter().for_each(|(tile, _)| self.starts[*tile as usize + 1] += 1);
        for t in 0..tiles {
            self.starts[t + 1] += self.starts[t];
        }
        self.records.resize(staged.len(), Record::default());
        for (tile, record) in staged {
            let at = &mut self.starts[*tile as usize];
            self.records[*at as usize] = *record;
            *at += 1;
        }
        // Each start has moved to the end of its tile.
        self.starts.rotate_right(1);
        self.starts[0] = 0;
    }
}

/// Counter of the numbers that thin out the particles of one chunk.
pub(crate) fn thinning_key(object: u32, set: u64, chunk: usize) -> u64 {
    rng::bits(u64::from(object), Stage::Thinning as u64, set, chunk as u64)
}

/// The number in (0, 1) of particle `i` of a chunk.
#[inline(always)]
pub(crate) fn thinning(key: u64, i: usize) -> f32 {
    let bits = scramble(key.wrapping_add((i as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15)));
    ((bits >> 41) as f32 + 0.5) * (1.0 / (1u32 << 23) as f32)
}

fn stage(
    particles: &Particles,
    projector: &Projector,
    tiling: &Tiling,
    key: u64,
    first: u32,
    staged: &mut Vec<(u32, Record)>,
) {
    let columns = tiling.columns as u32;
    let each = particles.position.iter().zip(&particles.normal).zip(&particles.color).enumerate();
    for (i, ((&position, &normal), &color)) in each {
        let own = || thinning(key, i);
        let Some(foot) = projector.project(position, normal, own) else { continue };
        let within = u32::from(foot.within[0]) << 12 | u32::from(foot.within[1]) << 20;
        for y in foot.y[0]..foot.y[1] {
            for x in foot.x[0]..foot.x[1] {
                let (x, y) = (x as u32, y as u32);
                let tile = y / TILE as u32 * columns + x / TILE as u32;
                let pixel = y % TILE as u32 * TILE as u32 + x % TILE as u32;
                staged.push((
                    tile,
                    Record { place: pixel | within, depth: foot.depth, id: first + i as u32, normal, color },
                ));
            }
        }
    }
}
